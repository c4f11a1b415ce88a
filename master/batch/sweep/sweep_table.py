"""The table of a sweep: inputs with units and figures, a row for each run and pantograph, as CSV and as Parquet.

It holds nothing that differs from one machine to the next: no times, no names of workers. So it is the same to the bit
however many workers made the runs, in whatever order.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from master.batch.sweep.sweep_plan import VARIANT
from master.batch.sweep.sweep_run import Cell, Row, SweepResult
from master.batch.sweep.swept_systems import SweepRun
from master.safety.safe_files import atomic_file, safe_cell


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
        return safe_cell(value)
    return str(int(value)) if name == "run" else repr(value)


def has_parquet() -> bool:
    """Whether Parquet can be written here."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        return False
    return True


def write_parquet(rows: Sequence[Row], path: Path) -> None:
    """Write a table as Parquet, atomically; columns of numbers are double, all others text."""
    import pyarrow
    from pyarrow import parquet

    with atomic_file(path) as temporary:
        parquet.write_table(pyarrow.table({n: _column(pyarrow, n, rows) for n in columns(rows)}), temporary)


def _column(pyarrow: Any, name: str, rows: Sequence[Row]) -> Any:
    values = [row.get(name) for row in rows]
    if name == "run":
        return pyarrow.array([int(v) for v in values if isinstance(v, float)], pyarrow.int64())
    is_text = any(isinstance(v, str) for v in values)
    return pyarrow.array(values, pyarrow.string() if is_text else pyarrow.float64())
