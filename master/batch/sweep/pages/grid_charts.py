"""Charts of a grid: every figure over a parameter, one curve for each value of the others, and maps over two."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final, TypeVar

import numpy as np

from master.arrays import FloatArray
from master.batch.sweep.pages.sample_statistics import QUANTILES
from master.batch.sweep.pages.sweep_view import (
    Figure,
    SweepView,
    SweptColumn,
    failed_limits,
    is_judged,
    level_text,
    levels,
    values_of,
)
from master.batch.sweep.sweep_run import Row
from master.report.charts.chart import (
    LIMIT,
    Axis,
    Cells,
    Chart,
    Curve,
    Envelope,
    Level,
    Part,
    Points,
    Stroke,
    stroke,
)

T = TypeVar("T")
#: Most curves of a chart, charts of figures, maps of a figure, and cells along an axis of a map.
MOST_CURVES: Final = 7
MOST_CHARTS: Final = 24
_MOST_MAPS: Final = 4
_MOST_CELLS: Final = 40
#: Most values of a parameter along a curve.
_MOST_LEVELS: Final = 500
#: Up to how many points of a curve are marked.
_MARKED: Final = 40
#: Figures that are mapped, those of them that there are.
_MAPPED: Final = ("sigma", "maximum", "minimum", "sigma / mean", "uplift")
_CELL_WIDTH: Final = 46
#: What the first map shows.
_UNMET: Final = Figure("", "limits that are not met", "", 0)
_LONGEST: Final = 16


def ordered(view: SweepView, parameters: Sequence[SweptColumn]) -> list[SweptColumn]:
    """Return parameters in the order of their numbers of values, those of numbers first."""
    counts = {p.title: levels(view.rows, p.title) for p in parameters}
    return sorted(parameters, key=lambda p: (not isinstance(counts[p.title][0], float), -len(counts[p.title])))


def axis_of(title: str, found: Sequence[float | str]) -> tuple[Axis, FloatArray]:
    """Return the axis of a parameter and the places of its values: numbers in their place, texts in a row."""
    if all(isinstance(v, float) for v in found):
        return Axis(title), np.array(found, dtype=np.float64)
    places = tuple(map(float, range(len(found))))
    return Axis(title, ticks=places, words=tuple(map(level_text, found))), np.array(places)


def curve_charts(view: SweepView, rows: Sequence[Row], parameters: Sequence[SweptColumn], key: str) -> list[Chart]:
    """Return a chart for each figure: its curves over the first parameter, one for each value of the others.

    Where there are samples too, a curve is their median, and what lies between their quantiles is shaded.
    """
    first, *others = parameters
    found = evenly(levels(rows, first.title), _MOST_LEVELS)
    if len(found) < 2:
        return []
    axis, places = axis_of(view.short_title(first.title), found)
    groups = grouped(view, rows, others)
    drawn = evenly(list(groups), MOST_CURVES)
    note = "" if len(drawn) == len(groups) else f"{len(drawn)} of {len(groups)} curves; the table has all."
    cells = [_by_level(groups[group], first.title, found) for group in drawn]
    whole = _by_level(rows, first.title, found)
    made = []
    for number, figure in enumerate(view.figures[:MOST_CHARTS]):
        parts: list[Part] = []
        for k, group in enumerate(drawn):
            parts += _curve(group or figure.name, figure, cells[k], places, k)
        if not any(np.isfinite(p.y).any() for p in parts if isinstance(p, Curve)):
            continue
        parts += limit_parts(view, figure, whole, places)
        ordinate = Axis(figure.name, figure.unit, shown_range(parts))
        made.append(Chart(f"{key}_{number}", figure.heading, axis, ordinate, tuple(parts), note, height=300))
    return made


def shown_range(parts: Sequence[Part]) -> tuple[float, float]:
    """Return the range of an ordinate in which all parts are seen, their limits and the words at them too."""
    found = [np.array([p.at]) for p in parts if isinstance(p, Level)]
    found += [p.y for p in parts if isinstance(p, Curve | Points)]
    found += [v for p in parts if isinstance(p, Envelope) for v in (p.low, p.high)]
    whole = np.concatenate(found)
    low, high = float(np.nanmin(whole)), float(np.nanmax(whole))
    margin = 0.1 * (high - low) or max(0.1 * abs(high), 1.0)
    return (0.0, high + margin) if 0.0 <= low <= margin else (low - margin, high + margin)


def _curve(name: str, figure: Figure, cells: Sequence[Sequence[Row]], places: FloatArray, index: int) -> list[Part]:
    """Return the curve of a figure through its medians, and the band of its quantiles if there are samples."""
    values = [v[np.isfinite(v)] for v in (values_of(rows, figure.title) for rows in cells)]
    low, middle, high = (np.array([np.quantile(v, q) if len(v) else np.nan for v in values]) for q in QUANTILES)
    look = stroke(index)
    parts: list[Part] = []
    if any(len(v) > 1 for v in values):
        parts.append(Envelope(f"{name}, 5 to 95 %".removeprefix(f"{figure.name}, "), places, low, high, look.colour))
    parts.append(Curve(name, places, middle, look, has_marks=len(places) <= _MARKED))
    return parts


def limit_parts(view: SweepView, figure: Figure, cells: Sequence[Sequence[Row]], places: FloatArray) -> list[Part]:
    """Return the limits of a figure: a level if it is the same everywhere, else a curve; none if it is ambiguous."""
    parts: list[Part] = []
    for side in (0, 1):
        bounds = [{round(view.bounds(figure, row)[side], 9) for row in rows} for rows in cells]
        if any(len(b) > 1 for b in bounds) or not any(math.isfinite(v) for b in bounds for v in b):
            continue
        values = np.array([next(iter(b), math.nan) for b in bounds])
        if len({*values[np.isfinite(values)]}) == 1:
            at = float(values[np.isfinite(values)][0])
            parts.append(Level(at, f"limit {at:g} {figure.unit}".strip()))
        else:
            name = "upper limit" if side else "lower limit"
            parts.append(Curve(name, places, values, Stroke(LIMIT, "dash" if side else "dot", 1.2)))
    return parts


def map_charts(view: SweepView, rows: Sequence[Row], parameters: Sequence[SweptColumn], key: str) -> list[Chart]:
    """Return maps of the most important figures over two parameters, one for each value of the others."""
    first, second, *others = parameters
    columns, lines = (levels(rows, p.title) for p in (first, second))
    if len(columns) < 2 or len(lines) < 2:
        return []
    groups = grouped(view, rows, others)
    drawn = evenly(list(groups), _MOST_MAPS)
    figures = [f for name in _MAPPED for f in view.figures if f.name == name] or list(view.figures[:4])
    if any(map(is_judged, rows)):
        figures.insert(0, _UNMET)
    kept = (evenly(columns, _MOST_CELLS), evenly(lines, _MOST_CELLS))
    axes = (
        _cell_axis(view.short_title(first.title), kept[0]),
        _cell_axis(broken(view.short_title(second.title)), kept[1]),
    )
    width, height = 110 + _CELL_WIDTH * len(kept[0]), 80 + max(34 * len(kept[1]), 130)
    made: list[Chart] = []
    for figure in figures:
        maps = {g: _cells(view, figure, groups[g], (first.title, second.title), kept) for g in drawn}
        for group, cells in _alike(maps).items():
            title = f"{figure.heading}{f' [{figure.unit}]' if figure.unit else ''}{f', {group}' if group else ''}"
            note = " ".join(_map_notes(cells, (len(columns), len(lines)), kept, (len(groups), len(drawn))))
            name = f"{key}_{len(made)}"
            made.append(Chart(name, title, axes[0], axes[1], (cells,), note, height=height, least_width=width))
    return made


def _alike(maps: dict[str, Cells]) -> dict[str, Cells]:
    """Return maps in which one colour means one value; those without any value are left out."""
    there = {name: cells for name, cells in maps.items() if np.isfinite(cells.values).any()}
    ends = [(float(np.nanmin(c.values)), float(np.nanmax(c.values))) for c in there.values()]
    span = (min(low for low, _ in ends), max(high for _, high in ends)) if ends else None
    return {name: replace(cells, span=span) for name, cells in there.items()}


def _map_notes(
    cells: Cells, counts: tuple[int, int], kept: tuple[list[float | str], list[float | str]], maps: tuple[int, int]
) -> Iterator[str]:
    if cells.hatched.any():
        yield "Hatched: the limit is not met."
    if counts != (len(kept[0]), len(kept[1])):
        yield f"{len(kept[0])} of {counts[0]} and {len(kept[1])} of {counts[1]} values; the table has all."
    if maps[0] > maps[1]:
        yield f"Maps of {maps[1]} of {maps[0]} combinations of the other parameters."


def _cell_axis(title: str, found: Sequence[float | str]) -> Axis:
    limits = (-0.5, len(found) - 0.5)
    words = tuple(map(level_text, found))
    thin = range(0, len(found), 1 + (len(found) - 1) // 20)
    return Axis(title, limits=limits, ticks=tuple(map(float, thin)), words=tuple(words[k] for k in thin))


def _cells(
    view: SweepView,
    figure: Figure,
    rows: Sequence[Row],
    titles: tuple[str, str],
    kept: tuple[list[float | str], list[float | str]],
) -> Cells:
    shape = (len(kept[1]), len(kept[0]))
    values, hatched = np.full(shape, np.nan), np.zeros(shape, dtype=np.bool_)
    words = [[""] * shape[1] for _ in range(shape[0])]
    hints = [[""] * shape[1] for _ in range(shape[0])]
    by_place: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        by_place.setdefault((level_text(row.get(titles[0])), level_text(row.get(titles[1]))), []).append(row)
    for r, c in np.ndindex(shape):
        x, y = level_text(kept[0][c]), level_text(kept[1][r])
        here = by_place.get((x, y), [])
        there = _unmet(here) if figure is _UNMET else values_of(here, figure.title)
        if np.isfinite(there).any():
            values[r, c] = np.nanmedian(there)
            hatched[r, c] = values[r, c] > 0.0 if figure is _UNMET else is_beyond(figure, here)
            words[r][c] = figure.shown(float(values[r, c]))
            verdict = ", limit not met" if hatched[r, c] else ""
            place = f"{view.told(titles[0], kept[0][c])}, {view.told(titles[1], kept[1][r])}"
            hints[r][c] = f"{place}: {figure.name} {words[r][c]} {figure.unit}".rstrip() + verdict
    return Cells(values, tuple(map(tuple, words)), hatched, tuple(map(tuple, hints)))


def _unmet(rows: Sequence[Row]) -> FloatArray:
    """Return how many limits rows do not meet, NaN where there is no verdict."""
    return np.array([float(len(failed_limits(row))) if is_judged(row) else math.nan for row in rows])


def is_beyond(figure: Figure, rows: Sequence[Row]) -> bool:
    """Whether most of the rows that have a verdict do not meet the limit of a figure."""
    judged = [row for row in rows if is_judged(row)]
    return 2 * sum(figure.criterion in failed_limits(row) for row in judged) > len(judged)


def broken(name: str) -> str:
    r"""Return a name in lines of which each is short, if it has dots or spaces to break at.

    Examples
    --------
    >>> broken("catenary.contact_wire.tension [kN]")
    'catenary.\ncontact_wire.\ntension [kN]'
    """
    lines = [""]
    for piece in name.replace(".", ".\0").replace(" ", " \0").split("\0"):
        if lines[-1] and len(lines[-1]) + len(piece) > _LONGEST:
            lines.append("")
        lines[-1] += piece
    return "\n".join(line.strip() for line in lines)


def grouped(view: SweepView, rows: Sequence[Row], parameters: Sequence[SweptColumn]) -> dict[str, list[Row]]:
    """Return rows by the values of some parameters in words; under an empty text if there are no parameters."""
    found: dict[str, list[Row]] = {}
    order = {p.title: {level_text(v): k for k, v in enumerate(levels(rows, p.title))} for p in parameters}
    for row in rows:
        words = (view.told(p.title, row.get(p.title)) for p in parameters)
        found.setdefault(", ".join(words), []).append(row)
    keys = {
        name: tuple(order[p.title].get(level_text(group[0].get(p.title)), -1) for p in parameters)
        for name, group in found.items()
    }
    return dict(sorted(found.items(), key=lambda each: keys[each[0]]))


def _by_level(rows: Sequence[Row], title: str, found: Sequence[float | str]) -> list[list[Row]]:
    """Return the rows in which a parameter has each of its values."""
    by_value: dict[float | str | None, list[Row]] = {}
    for row in rows:
        by_value.setdefault(row.get(title), []).append(row)
    return [by_value.get(value, []) for value in found]


def evenly(found: Sequence[T], most: int) -> list[T]:
    """Return all, or ``most`` of them evenly spaced, the first and the last included."""
    if len(found) <= most:
        return list(found)
    return [found[round(k * (len(found) - 1) / (most - 1))] for k in range(most)]
