"""The sensitivity of every figure in a sweep's table, and the files that tell it."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any, Final

import numpy as np

from master.arrays import FloatArray
from master.batch.sweep.sensitivity import SensitivityIndices, indices_of
from master.batch.sweep.sweep_plan import SweepPlan, SweepRequest
from master.batch.sweep.sweep_run import SweepResult
from master.batch.sweep.swept_systems import SweepRun
from master.safety.safe_files import safe_cell

#: A column of figures: its name and its unit.
_TITLE: Final = re.compile(r"(.+) \[([^\]]*)\]")
_HEADS: Final = (
    "method",
    "figure",
    "unit",
    "parameter",
    "first",
    "first low",
    "first high",
    "total",
    "total low",
    "total high",
    "blocks",
    "left out",
)


def sensitivity_of(
    request: SweepRequest, plan: SweepPlan, runs: Sequence[SweepRun], found: Mapping[str, SweepResult]
) -> tuple[SensitivityIndices, ...]:
    """Return the indices of every figure that varies, none if they were not asked for or runs are missing.

    With several pantographs every one has figures of its own, named ``figure (pantograph)``.
    """
    if request.sensitivity is None or any(r.key not in found for r in runs):
        return ()
    names = [p.name for p in plan.parameters]
    made = (
        indices_of(request.sensitivity, names, name, unit, values, request.seed)
        for name, unit, values in _figures([found[r.key] for r in runs])
    )
    return tuple(indices for indices in made if indices is not None)


def _figures(results: Sequence[SweepResult]) -> Iterator[tuple[str, str, FloatArray]]:
    """Yield name, unit and values of every figure, NaN where a run has none."""
    columns: dict[tuple[str, str], FloatArray] = {}
    several = any(len(r.rows) > 1 for r in results)
    for place, result in enumerate(results):
        for row in result.rows:
            for title, value in row.items():
                match = _TITLE.fullmatch(title)
                if match is None or not isinstance(value, float):
                    continue
                name = f"{match[1]} ({row['pantograph']})" if several and "pantograph" in row else match[1]
                column = columns.setdefault((name, match[2]), np.full(len(results), np.nan))
                column[place] = value
    for (name, unit), values in columns.items():
        yield name, unit, values


def failed_note(request: SweepRequest, indices: Sequence[SensitivityIndices], failed: int) -> str:
    """Return what is to be said about indices: how many blocks were left out, or that there are none."""
    if request.sensitivity is None:
        return ""
    if not indices:
        return "no sensitivity indices: no figure varies, or too few blocks of runs are complete"
    left_out = max(i.left_out for i in indices)
    if not left_out:
        return ""
    total = request.samples or 0
    return f"sensitivity: {left_out} of {total} blocks are left out, since {failed} runs failed or a figure is missing"


def sensitivity_csv(indices: Sequence[SensitivityIndices]) -> str:
    """Return indices as CSV, a row for each figure and parameter."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_HEADS)
    for row in sensitivity_rows(indices):
        writer.writerow([safe_cell(c) if isinstance(c, str) else repr(c) for c in row])
    return text.getvalue()


def sensitivity_rows(indices: Sequence[SensitivityIndices]) -> list[tuple[str | float | int, ...]]:
    """Return the rows of the table of indices, under `sensitivity_heads`."""
    return [
        (i.method, i.figure, i.unit, name, first, *of_first, total, *of_total, i.blocks, i.left_out)
        for i in indices
        for name, first, of_first, total, of_total in zip(
            i.parameters, i.first, i.first_interval, i.total, i.total_interval, strict=True
        )
    ]


def sensitivity_heads() -> tuple[str, ...]:
    """Return the heads of the table of indices."""
    return _HEADS


def sensitivity_data(indices: Sequence[SensitivityIndices]) -> dict[str, Any]:
    """Return indices as plain data."""
    return {"indices": [asdict(i) for i in indices]}
