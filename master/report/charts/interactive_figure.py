"""The renderer for pages: charts as dictionaries for plotly.js. Colours of paper, ink and grid are left to the page."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from master.report.charts.chart import Axis, Band, Bars, Chart, Curve, Level, Points, Stroke, Ticks, fill, gapped
from master.report.charts.sample_packing import packed

Trace = dict[str, Any]

_PATTERNS: Final = ("", "/", "x", "-", ".", "+")
#: An invisible second ordinate from 0 to 1, to which the ticks belong.
_SHARES: Final = {"overlaying": "y", "range": [0, 1], "visible": False, "fixedrange": True}


def interactive_figure(chart: Chart) -> dict[str, Any]:
    """Return ``data`` and ``layout`` of a chart for plotly.js."""
    shapes = [_shape(part) for part in chart.parts if isinstance(part, Band | Level)]
    data = [_TRACES[type(part)](part) for part in chart.parts if not isinstance(part, Band | Level)]
    layout: dict[str, Any] = {"xaxis": _axis(chart.x), "yaxis": _axis(chart.y), "shapes": shapes}
    if any(isinstance(part, Ticks) for part in chart.parts):
        layout["yaxis2"] = _SHARES
    if any(isinstance(bars, Bars) and bars.width is None and not isinstance(bars.x, tuple) for bars in chart.parts):
        layout["bargap"] = 0.04
    if chart.group:
        layout["meta"] = {"sync": chart.group}
    return {"data": data, "layout": layout}


def _axis(axis: Axis) -> dict[str, Any]:
    found: dict[str, Any] = {"title": {"text": axis.label}}
    if axis.limits is not None:
        found["range"] = np.log10(axis.limits).tolist() if axis.is_logarithmic else list(axis.limits)
    if axis.is_logarithmic:
        found |= {"type": "log", "exponentformat": "power"}
    if axis.ticks:
        found["tickvals"] = list(axis.ticks)
    return found


def _curve(curve: Curve) -> Trace:
    trace = _lines(curve.name, *curve.points, curve.stroke)
    if curve.is_whole:
        trace["hoverinfo"] = "skip"
    return trace if curve.is_shown else {**trace, "visible": "legendonly"}


def _ticks(ticks: Ticks) -> Trace:
    x, y = gapped(ticks.x, np.zeros(len(ticks.x)), np.full(len(ticks.x), ticks.share))
    trace = _lines(ticks.name, x, y, Stroke(ticks.colour, ticks.dash, 1.0))
    return {**trace, "yaxis": "y2", "hoverinfo": "skip", "opacity": 0.75}


def _bars(bars: Bars) -> Trace:
    colour, hatching = fill(bars.index)
    marker = {"color": colour, "pattern": {"shape": _PATTERNS[hatching], "solidity": 0.4}}
    x = list(bars.x) if isinstance(bars.x, tuple) else packed(bars.x)
    trace = {"type": "bar", "name": bars.name, "marker": marker, "x": x, "y": packed(bars.y), "width": bars.width}
    said = {"text": list(bars.words), "textposition": "none", "hovertemplate": "%{text}"}
    return {**trace, **said} if bars.words else trace


def _points(points: Points) -> Trace:
    marker = {"color": points.colour, "size": points.size, "symbol": points.symbol}
    trace = {"type": "scatter", "mode": "markers", "x": packed(points.x), "y": packed(points.y), "marker": marker}
    return {**trace, "name": points.name} | ({"text": list(points.words)} if points.words else {})


def _lines(name: str, x: Any, y: Any, stroke: Stroke) -> Trace:
    line = {"color": stroke.colour, "dash": stroke.dash, "width": stroke.width}
    return {"type": "scatter", "mode": "lines", "x": packed(x), "y": packed(y), "line": line, "name": name}


def _shape(part: Band | Level) -> dict[str, Any]:
    if isinstance(part, Band):
        box = {"type": "rect", "xref": "x", "yref": "paper", "x0": part.start, "x1": part.end, "y0": 0, "y1": 1}
        edge = {"width": 1, "color": _transparent(part.edge, 0.6)}
        return {**box, "fillcolor": _transparent(part.colour, part.opacity), "layer": "below", "line": edge}
    place: dict[str, Any] = {"xref": "paper", "yref": "y", "x0": 0, "x1": 1, "y0": part.at, "y1": part.at}
    label: dict[str, Any] = {"textposition": "start", "yanchor": "bottom"}
    if part.is_upright:
        place = {"xref": "x", "yref": "paper", "x0": part.at, "x1": part.at, "y0": 0, "y1": 1}
        label = {"textposition": "end", "textangle": -90, "xanchor": "right"}
    line = {"color": part.colour, "width": 1.2, "dash": "dash"}
    return {"type": "line", **place, "line": line, "label": {"text": part.text, "font": {"size": 11}, **label}}


def _transparent(colour: str, opacity: float) -> str:
    """Return a colour with its opacity in the notation of CSS.

    Examples
    --------
    >>> _transparent("#e6b428", 0.16)
    'rgba(230,180,40,0.16)'
    """
    red, green, blue = bytes.fromhex(colour[1:])
    return f"rgba({red},{green},{blue},{opacity})"


_TRACES: Final[dict[type, Callable[[Any], Trace]]] = {Curve: _curve, Ticks: _ticks, Bars: _bars, Points: _points}
