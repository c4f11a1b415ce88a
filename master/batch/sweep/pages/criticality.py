"""Which dropper or arm matters: each of them with its fault in turn, against the line without any."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from master.batch.sweep.pages.grid_charts import MOST_CURVES, evenly, grouped
from master.batch.sweep.pages.span_drawing import span_drawing, with_room
from master.batch.sweep.pages.sweep_view import Figure, SweepView, SweptColumn, values_of
from master.batch.sweep.sweep_run import Row
from master.report.charts.chart import Axis, Bars, Chart

#: Figures that are compared, the first of them by which droppers are ranked.
_FIGURES: Final = ("maximum", "minimum", "sigma", "uplift", "slack droppers", "share of loss")
#: Most faults that a note names.
_MOST_NAMED: Final = 4
#: Width of bars at supports [m].
_WIDTH: Final = 5.0
_ACTIVE: Final = re.compile(r"(?:.*\.)?fault\[(\d+)\]\.active")
#: What an FMU's description of a parameter says after its meaning, without the source of its value.
_SAID: Final = re.compile(r"; (.+?)(?: \[.*\])?$", re.DOTALL)
_DROPPER: Final = re.compile(r"dropper (\d+) of span (\d+)(?: of section (\d+))?")
_ARM: Final = re.compile(r"(?:steady arm of )?support \d+(?: of section \d+)?")
_AT: Final = re.compile(r" at (-?[\d.]+) m(?:, supports at (-?[\d.]+) and (-?[\d.]+) m)?$")


@dataclass(frozen=True)
class FaultyPart:
    """What has a fault.

    Attributes
    ----------
    name : str
    position : float
        Along the track, NaN if it is not known [m].
    span : (float, float), optional
        Supports on both sides of a dropper [m].
    is_support : bool
        Whether it stands at a support.
    """

    name: str
    position: float
    span: tuple[float, float] | None = None
    is_support: bool = False


@dataclass(frozen=True)
class Criticality:
    """What the fault of each part changes.

    Attributes
    ----------
    circumstances : str
        Values of the other parameters, empty if there are none.
    parts : tuple of FaultyPart
    figures : tuple of Figure
    healthy : tuple of float
        The figures of the line without a fault.
    faulty : ndarray, shape (n_parts, n_figures)
        The figures with each fault; NaN where a run failed.
    """

    circumstances: str
    parts: tuple[FaultyPart, ...]
    figures: tuple[Figure, ...]
    healthy: tuple[float, ...]
    faulty: np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def fault_parameters(view: SweepView) -> list[SweptColumn]:
    """Return the varied parameters that make a fault act."""
    return [p for p in view.parameters if _ACTIVE.fullmatch(p.name)]


def criticalities(view: SweepView, rows: Sequence[Row], others: Sequence[SweptColumn]) -> list[Criticality]:
    """Return what each fault alone changes, for each value of the other parameters that has a run without any."""
    faults = fault_parameters(view)
    figures = tuple(f for name in _FIGURES for f in view.figures if f.name == name) or view.figures[:4]
    made = []
    for circumstances, group in grouped(view, rows, others).items() if faults and figures else ():
        by_fault = {acting_faults(row, faults): row for row in group}
        healthy = by_fault.get(())
        single = [p for p in faults if (p.title,) in by_fault]
        if healthy is None or not single:
            continue
        parts = {p.title: _part(view, p) for p in single}
        single.sort(key=lambda p: parts[p.title].position)
        faulty = [[values_of([by_fault[(p.title,)]], f.title)[0] for f in figures] for p in single]
        whole = tuple(float(values_of([healthy], f.title)[0]) for f in figures)
        places = tuple(parts[p.title] for p in single)
        made.append(Criticality(circumstances, places, figures, whole, np.array(faulty)))
    return made


def acting_faults(row: Row, faults: Sequence[SweptColumn]) -> tuple[str, ...]:
    """Return the titles of the faults that act in a row."""
    return tuple(p.title for p in faults if isinstance(v := row.get(p.title), float) and v > 0.5)


def acting_names(view: SweepView, row: Row) -> str:
    """Return the names of what has a fault that acts in a row, or a word for none."""
    faults = {p.title: p for p in fault_parameters(view)}
    return "; ".join(_part(view, faults[t]).name for t in acting_faults(row, list(faults.values()))) or "none"


def unseen_note(places: Mapping[str, str], interval: tuple[float | None, float | None]) -> str:
    """Return which of the faults that act in turn lie where no run is judged, empty if none does.

    Parameters
    ----------
    places : mapping
        Name of a varied parameter -> what its FMU says of it.
    interval : (float, float)
        Interval of interest [m]; None: open.
    """
    low, high = -math.inf if interval[0] is None else interval[0], math.inf if interval[1] is None else interval[1]
    parts = [_described(name, said) for name, said in places.items() if _ACTIVE.fullmatch(name)]
    unseen = [part.name for part in parts if part.position < low or part.position > high]
    if not unseen:
        return ""
    where = " ".join([f"from {low:g} m"] * (low > -math.inf) + [f"to {high:g} m"] * (high < math.inf))
    shown = "; ".join(unseen[:_MOST_NAMED]) + (" ..." if len(unseen) > _MOST_NAMED else "")
    return (
        f"{len(unseen)} of {len(parts)} faults lie outside the interval of interest, {where}, in which "
        f"runs are judged ({shown}): what they change where they are is not seen; take others, or another interval"
    )


def _part(view: SweepView, parameter: SweptColumn) -> FaultyPart:
    return _described(parameter.name, view.places.get(parameter.name, ""))


def _described(parameter: str, text: str) -> FaultyPart:
    match = _SAID.search(text)
    if match is None:
        return FaultyPart(parameter.removesuffix(".active"), math.nan)
    said = match[1]
    at = _AT.search(said)
    name = said[: at.start()] if at else said
    span = (float(at[2]), float(at[3])) if at and at[2] else None
    if dropper := _DROPPER.fullmatch(name):
        section = f"section {dropper[3]}, " if dropper[3] else ""
        name = f"{section}span {dropper[2]}, dropper {dropper[1]}"
    return FaultyPart(name, float(at[1]) if at else math.nan, span, _ARM.fullmatch(name) is not None)


def criticality_charts(found: Sequence[Criticality], key: str) -> list[Chart]:
    """Return for each figure how much it changes with the fault of each part, over a drawing of their spans."""
    drawn = evenly(found, MOST_CURVES)
    made = []
    for k, figure in enumerate(drawn[0].figures if drawn else ()):
        bars = tuple(_bars(c, k, number) for number, c in enumerate(drawn))
        if not any(np.nan_to_num(each.y).any() for each in bars):
            continue  # what no fault changes is in the table
        change = Axis(f"change of {figure.name}", figure.unit)
        title = f"Change of {figure.name}"
        if isinstance(bars[0].x, tuple):
            made.append(Chart(f"{key}_{k}", title, Axis("fault"), change, bars, height=300))
        else:
            made.append(_over_spans(Chart(f"{key}_{k}", title, Axis("position", "m"), change, bars, height=340), drawn))
    return made


def _over_spans(chart: Chart, found: Sequence[Criticality]) -> Chart:
    """Return a chart of bars along the track with a drawing of the spans below them, where these are known."""
    parts = [part for c in found for part in c.parts]
    spans = sorted({part.span for part in parts if part.span is not None})
    spans = spans or list(pairwise(sorted({part.position for part in parts if part.is_support})))
    values = np.concatenate([np.zeros(1), *(bars.y for bars in chart.parts if isinstance(bars, Bars))])
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if not spans or not high > low:
        return chart
    hung = np.array(sorted({part.position for part in parts if part.span is not None}))
    margin = 0.03 * (spans[-1][1] - spans[0][0]) + (0.5 * _WIDTH if any(p.is_support for p in parts) else 0.0)
    return replace(
        chart,
        x=replace(chart.x, limits=(spans[0][0] - margin, spans[-1][1] + margin)),
        y=with_room(chart.y, low, high),
        parts=(*chart.parts, span_drawing(hung, spans, low, high)),
    )


def _bars(c: Criticality, k: int, number: int) -> Bars:
    change = c.faulty[:, k] - c.healthy[k]
    words = tuple(
        f"{d.name}: {v:+.{c.figures[k].decimals}f} {c.figures[k].unit}" for d, v in zip(c.parts, change, strict=True)
    )
    name = c.circumstances or "change"
    positions = np.array([d.position for d in c.parts])
    if np.isfinite(positions).all() and len(set(positions.tolist())) == len(positions):
        return Bars(
            name, positions, change, number, _WIDTH if len(positions) == 1 or c.parts[0].is_support else None, words
        )
    return Bars(name, tuple(d.name for d in c.parts), change, number, None, words)


def ranking_rows(found: Sequence[Criticality]) -> list[list[str]]:
    """Return the rows of the ranking: circumstances, dropper, position, figures with their change in percent."""
    rows = []
    for c in found:
        change = c.faulty[:, 0] - c.healthy[0]
        order = np.argsort(-np.nan_to_num(change, nan=-math.inf), kind="stable")
        head = [c.circumstances] if len(found) > 1 else []
        shown = [f.shown(v) for f, v in zip(c.figures, c.healthy, strict=True)]
        rows.append([*head, "none, the healthy line", "", *shown])
        for i in map(int, order):
            d = c.parts[i]
            place = f"{d.position:.2f}" if math.isfinite(d.position) else "-"
            cells = [_with_change(f, v, h) for f, v, h in zip(c.figures, c.faulty[i], c.healthy, strict=True)]
            rows.append([*head, d.name, place, *cells])
    return rows


def _with_change(figure: Figure, value: float, healthy: float) -> str:
    if not math.isfinite(value):
        return "-"
    share = f" ({100.0 * (value / healthy - 1.0):+.1f} %)" if healthy > 0.0 else ""
    return f"{figure.shown(value)}{share}"
