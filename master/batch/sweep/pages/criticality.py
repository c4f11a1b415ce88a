"""Which dropper matters: each of them with its fault in turn, against the line without any."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from master.batch.sweep.pages.grid_charts import MOST_CURVES, evenly, grouped
from master.batch.sweep.pages.sweep_view import Figure, SweepView, SweptColumn, values_of
from master.batch.sweep.sweep_run import Row
from master.report.charts.chart import Axis, Bars, Chart

#: Figures that are compared, the first of them by which droppers are ranked.
_FIGURES: Final = ("maximum", "minimum", "sigma", "uplift")
_ACTIVE: Final = re.compile(r"(?:.*\.)?fault\[(\d+)\]\.active")
_PLACE: Final = re.compile(r"dropper (\d+) of span (\d+)(?: of section (\d+))? at (-?[\d.]+) m")


@dataclass(frozen=True)
class Dropper:
    """A dropper with a fault: name, and position along the track [m], NaN if it is not known."""

    name: str
    position: float


@dataclass(frozen=True)
class Criticality:
    """What the fault of each dropper changes.

    Attributes
    ----------
    circumstances : str
        Values of the other parameters, empty if there are none.
    droppers : tuple of Dropper
    figures : tuple of Figure
    healthy : tuple of float
        The figures of the line without a fault.
    faulty : ndarray, shape (n_droppers, n_figures)
        The figures with each fault; NaN where a run failed.
    """

    circumstances: str
    droppers: tuple[Dropper, ...]
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
        droppers = {p.title: _dropper(view, p) for p in single}
        single.sort(key=lambda p: droppers[p.title].position)
        faulty = [[values_of([by_fault[(p.title,)]], f.title)[0] for f in figures] for p in single]
        whole = tuple(float(values_of([healthy], f.title)[0]) for f in figures)
        places = tuple(droppers[p.title] for p in single)
        made.append(Criticality(circumstances, places, figures, whole, np.array(faulty)))
    return made


def acting_faults(row: Row, faults: Sequence[SweptColumn]) -> tuple[str, ...]:
    """Return the titles of the faults that act in a row."""
    return tuple(p.title for p in faults if isinstance(v := row.get(p.title), float) and v > 0.5)


def acting_names(view: SweepView, row: Row) -> str:
    """Return the names of the droppers whose faults act in a row, or a word for none."""
    faults = {p.title: p for p in fault_parameters(view)}
    return "; ".join(_dropper(view, faults[t]).name for t in acting_faults(row, list(faults.values()))) or "none"


def _dropper(view: SweepView, parameter: SweptColumn) -> Dropper:
    match = _PLACE.search(view.places.get(parameter.name, ""))
    if match is None:
        return Dropper(parameter.name.removesuffix(".active"), math.nan)
    section = f"section {match[3]}, " if match[3] else ""
    return Dropper(f"{section}span {match[2]}, dropper {match[1]}", float(match[4]))


def criticality_charts(found: Sequence[Criticality], key: str) -> list[Chart]:
    """Return for each figure how much it changes with the fault of each dropper."""
    drawn = evenly(found, MOST_CURVES)
    made = []
    for k, figure in enumerate(drawn[0].figures if drawn else ()):
        bars = tuple(_bars(c, k, number) for number, c in enumerate(drawn))
        is_placed = not isinstance(bars[0].x, tuple)
        axis = Axis("position of the dropper", "m") if is_placed else Axis("dropper")
        change = Axis(f"change of {figure.name}", figure.unit)
        made.append(Chart(f"{key}_{k}", f"Change of {figure.name}", axis, change, bars, height=300))
    return made


def _bars(c: Criticality, k: int, number: int) -> Bars:
    change = c.faulty[:, k] - c.healthy[k]
    words = tuple(
        f"{d.name}: {v:+.{c.figures[k].decimals}f} {c.figures[k].unit}" for d, v in zip(c.droppers, change, strict=True)
    )
    name = c.circumstances or "change"
    positions = np.array([d.position for d in c.droppers])
    if np.isfinite(positions).all() and len(set(positions.tolist())) == len(positions):
        return Bars(name, positions, change, number, None, words)
    return Bars(name, tuple(d.name for d in c.droppers), change, number, None, words)


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
            d = c.droppers[i]
            place = f"{d.position:.2f}" if math.isfinite(d.position) else "-"
            cells = [_with_change(f, v, h) for f, v, h in zip(c.figures, c.faulty[i], c.healthy, strict=True)]
            rows.append([*head, d.name, place, *cells])
    return rows


def _with_change(figure: Figure, value: float, healthy: float) -> str:
    if not math.isfinite(value):
        return "-"
    share = f" ({100.0 * (value / healthy - 1.0):+.1f} %)" if healthy > 0.0 else ""
    return f"{figure.shown(value)}{share}"
