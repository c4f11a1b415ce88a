"""Charts of runs that have no order but that of their table: a point for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from master.batch.sweep.pages.grid_charts import MOST_CHARTS, evenly, limit_parts, shown_range
from master.batch.sweep.pages.sweep_view import SweepView, level_text, values_of
from master.batch.sweep.sweep_run import Row
from master.report.charts.chart import COLOURS, Axis, Chart, Part, Points

#: Most runs whose names stand below their points, and that are drawn.
_MOST_NAMES: Final = 12
_MOST_POINTS: Final = 1000


def variant_charts(view: SweepView, rows: Sequence[Row], key: str) -> list[Chart]:
    """Return a chart for each figure, with a point for each run."""
    note = "" if len(rows) <= _MOST_POINTS else f"{_MOST_POINTS} of {len(rows)} runs; the table has all."
    rows = evenly(rows, _MOST_POINTS)
    numbers = values_of(rows, "run")
    names = [str(row.get("variant") or level_text(row.get("run"))) for row in rows]
    axis = Axis("run")
    if len(rows) <= _MOST_NAMES:
        axis = Axis("", ticks=tuple(numbers.tolist()), words=tuple(_cut(name) for name in names))
    made = []
    for number, f in enumerate(view.figures[:MOST_CHARTS]):
        values = values_of(rows, f.title)
        if np.isfinite(values).any():
            words = tuple(f"{name}: {f.shown(v)} {f.unit}".rstrip() for name, v in zip(names, values, strict=True))
            size = 8.0 if len(rows) <= 100 else 4.0
            parts: list[Part] = [Points(f.name, numbers, values, "circle", COLOURS[0], size, words)]
            parts += limit_parts(view, f, [[row] for row in rows], numbers)
            made.append(
                Chart(
                    f"{key}_{number}",
                    f.heading,
                    axis,
                    Axis(f.name, f.unit, shown_range(parts)),
                    tuple(parts),
                    note,
                    height=280,
                )
            )
    return made


def _cut(name: str) -> str:
    return name if len(name) <= 24 else f"{name[:23]}\u2026"
