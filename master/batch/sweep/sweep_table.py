"""The table of a sweep: inputs with units and figures, a row for each run and pantograph, as CSV and as Parquet.

It holds nothing that differs from one machine to the next: no times, no names of workers. So it is the same to the bit
however many workers made the runs, in whatever order.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from master.batch.batch_session import BatchState
from master.batch.sweep.sweep_plan import VARIANT
from master.batch.sweep.sweep_run import TEXTS, Cell, Row, SweepResult
from master.batch.sweep.swept_systems import SweepRun
from master.safety.safe_files import atomic_file, safe_cell

#: A whole number as a parameter's value is written: any other text would not come back the same.
_WHOLE: Final = re.compile(r"0|-?[1-9]\d{0,9}", re.ASCII)
_TRUTH: Final = {"true": True, "false": False}


@dataclass(frozen=True, kw_only=True)
class MadeRuns(BatchState):
    """The state of a batch whose runs become rows of one table.

    Attributes
    ----------
    runs : tuple of SweepRun
        All that there are so far.
    found : dict
        What has become of runs, by key.
    """

    runs: tuple[SweepRun, ...] = ()
    found: Mapping[str, SweepResult] = field(default_factory=dict)

    @property
    def finished(self) -> tuple[SweepRun, ...]:
        """The runs that are finished."""
        return tuple(r for r in self.runs if r.key in self.found)

    @property
    def failures(self) -> dict[int, str]:
        """Reasons why runs failed, by their numbers."""
        return {r.number: self.found[r.key].reason for r in self.finished if self.found[r.key].failed}

    @property
    def rows(self) -> list[Row]:
        """The table so far."""
        return table_rows(self.runs, self.found)


def table_rows(runs: Sequence[SweepRun], found: Mapping[str, SweepResult]) -> list[Row]:
    """Return the rows of all finished runs, in the order of the plan; a failed one has a row with its reason."""
    return [row for run in runs if run.key in found for row in _rows_of(run, found[run.key])]


def _rows_of(run: SweepRun, result: SweepResult) -> Iterator[Row]:
    named: dict[str, Cell] = {VARIANT: run.variant} if run.variant else {}
    status = {"key": run.key, "status": "failed" if result.failed else "complete", "reason": result.reason}
    head: dict[str, Cell] = {"run": float(run.number), **named, **run.inputs, "stop time [s]": run.stop, **status}
    for figures in result.rows or ({},):
        yield {**head, **figures}


def columns(rows: Iterable[Row]) -> list[str]:
    """Return the columns of a table, in the order in which its rows have them."""
    return list(dict.fromkeys(name for row in rows for name in row))


def unjudged_note(rows: Iterable[Row]) -> str:
    """Return what is to be said of complete runs that have no figures, empty if there are none."""
    found = {
        row["run"]: str(row["verdict"])
        for row in rows
        if row.get("status") == "complete" and row.get("verdict") and not row.get("pantograph")
    }
    return no_figures(found, "has" if len(found) == 1 else "have")


def no_figures(reasons: Mapping[Any, str], verb: str) -> str:
    """Return a sentence on runs without figures, the reasons given by their numbers; empty if there are none."""
    if not reasons:
        return ""
    first, reason = next(iter(reasons.items()))
    return f"{len(reasons)} run{'' if len(reasons) == 1 else 's'} {verb} no figures; run {first:g}: {reason}"


def as_csv(rows: Sequence[Row]) -> str:
    """Return a table as CSV; numbers read back to the last bit."""
    names = columns(rows)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(map(safe_cell, names))
    writer.writerows([_cell(name, row.get(name)) for name in names] for row in rows)
    return text.getvalue()


def _cell(name: str, value: Cell) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        return value if _WHOLE.fullmatch(value) else safe_cell(value)
    return str(int(value)) if name == "run" else repr(value)


def has_parquet() -> bool:
    """Whether Parquet can be written here."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        return False
    return True


def write_parquet(rows: Sequence[Row], path: Path) -> None:
    """Write a table as Parquet, atomically; columns are double, whole numbers, true or false, or text."""
    import pyarrow
    from pyarrow import parquet

    with atomic_file(path) as temporary:
        parquet.write_table(pyarrow.table({n: _column(pyarrow, v) for n, v in typed_columns(rows).items()}), temporary)


def _column(pyarrow: Any, values: Sequence[Any]) -> Any:
    return pyarrow.array(values) if any(v is not None for v in values) else pyarrow.array(values, pyarrow.float64())


def typed_columns(rows: Sequence[Row]) -> dict[str, list[Any]]:
    """Return the columns of a table for programs: whole numbers and truths as such, None where a cell is empty."""
    return {name: _typed(name, [row.get(name) for row in rows]) for name in columns(rows)}


def _typed(name: str, values: list[Cell]) -> list[Any]:
    """Return the values of a column; parameters that are not Real have come as texts."""
    if name == "run":
        return [int(v) for v in values if isinstance(v, float)]
    there = [v for v in values if isinstance(v, str) and v]
    if not any(isinstance(v, str) for v in values):
        return values
    if name not in TEXTS and there and all(v in _TRUTH for v in there):
        return [_TRUTH[v] if isinstance(v, str) and v else None for v in values]
    if name not in TEXTS and there and all(_WHOLE.fullmatch(v) for v in there):
        return [int(v) if isinstance(v, str) and v else None for v in values]
    return [v if v is None or isinstance(v, str) else repr(v) for v in values]
