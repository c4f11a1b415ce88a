"""A drawing of the spans that faults lie in, under the bars of a chart: supports, wires and droppers, not to scale."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from master.arrays import FloatArray
from master.report.charts.chart import MARK, Axis, Curve, Stroke, gapped

#: Of the bars' height: distance from the lowest of them, height of the drawing, margin.
_BELOW, _HEIGHT, _MARGIN = 0.12, 0.34, 0.06
#: How low the messenger wire hangs in the middle of a span, of its height at the supports.
_LOWEST: Final = 0.4
_POINTS: Final = 41
#: How far supports stand out above and below the wires.
_POST: Final = 0.12


Spans = Sequence[tuple[float, float]]


def span_drawing(droppers: FloatArray, spans: Spans, low: float, high: float) -> Curve:
    """Return spans below bars that reach from ``low`` to ``high``.

    Parameters
    ----------
    droppers : ndarray, shape (n,)
        Where droppers hang along the track, each in one of the spans [m].
    spans : sequence of (float, float)
        Supports at both ends of each, rising [m].
    """
    share = np.append(np.linspace(0.0, 1.0, _POINTS), np.nan)
    along = np.concatenate([a + (b - a) * share for a, b in spans])
    supports = np.unique(np.array(spans))
    lines = (
        (along, np.tile(_hanging(share), len(spans))),
        (along, np.where(np.isnan(along), np.nan, 0.0)),
        gapped(droppers, np.zeros(len(droppers)), _messenger(droppers, spans)),
        gapped(supports, np.full(len(supports), -_POST), np.full(len(supports), 1.0 + _POST)),
    )
    x, y = (np.concatenate([line[k] for line in lines]) for k in (0, 1))
    height = high - low
    foot = low - (_BELOW + _HEIGHT) * height
    return Curve("span, not to scale", x, foot + _HEIGHT * height * y, Stroke(MARK, width=1.3), is_whole=True)


def with_room(axis: Axis, low: float, high: float) -> Axis:
    """Return the ordinate of bars from ``low`` to ``high`` with room for the drawing, where no numbers stand."""
    height = high - low
    limits = (low - (_BELOW + (1.0 + _POST) * _HEIGHT + _MARGIN) * height, high + _MARGIN * height)
    return Axis(axis.name, axis.unit, limits, ticks=_ticks(low, high))


def _hanging(share: FloatArray) -> FloatArray:
    """Return the height of the messenger wire over the way along a span, as a share of that at the supports."""
    return 1.0 - (1.0 - _LOWEST) * 4.0 * share * (1.0 - share)


def _messenger(x: FloatArray, spans: Spans) -> FloatArray:
    ends = np.array([next(((a, b) for a, b in spans if a <= at <= b), (math.nan, math.nan)) for at in x.tolist()])
    ends = ends.reshape(-1, 2)
    return _hanging((x - ends[:, 0]) / (ends[:, 1] - ends[:, 0]))


def _ticks(low: float, high: float) -> tuple[float, ...]:
    """Return round numbers from ``low`` to ``high``, four to ten of them."""
    size = 10.0 ** math.floor(math.log10((high - low) / 4.0))
    step = next(size * m for m in (5.0, 2.0, 1.0) if (high - low) / (size * m) >= 4.0)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return tuple(round(k * step, 12) for k in range(first, last + 1))
