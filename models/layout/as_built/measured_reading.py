"""Reading a measuring run from a table: CSV, or the one sheet of a workbook (or its sheet 'measured')."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.definition_files.toml_reader import Problem
from models.layout.as_built.measured_run import MeasuredRun
from models.layout.csv_sheets import SheetGrid, read_csv
from models.layout.sheet_problems import LayoutError, Place, SheetProblems
from models.layout.sheet_table import SheetColumn, SheetTable, read_table
from models.layout.xlsx_sheets import read_xlsx

COLUMNS: Final = (
    SheetColumn("position", "m", "along the track, by the vehicle's own way", required=True),
    SheetColumn("height", "m", "of the contact wire above the rails", minimum=2.0, maximum=10.0),
    SheetColumn("stagger", "m", "of the contact wire, left positive", minimum=-1.5, maximum=1.5),
    SheetColumn("thickness", "m", "of what is left of the contact wire", minimum=1e-3, maximum=0.05),
    SheetColumn("structure", "", "name of the structure that stands there"),
)
#: Rows that a run needs.
_LEAST: Final = 3
#: Problems of a column that are listed.
_LISTED: Final = 10
_SHEET: Final = "measured"


def read_measured_run(path: Path) -> MeasuredRun:
    """Read a measuring run.

    Positions rise throughout, or fall throughout, as those of a run against the kilometrage do.

    Raises
    ------
    LayoutError
        With every problem of the table.
    """
    problems = SheetProblems(str(path))
    grid = _grid(path, problems)
    table = read_table(grid, COLUMNS, problems) if grid is not None else None
    if table is not None and len(table):
        if not np.isfinite(table.numbers("height")).any() and not table.told("height").any():
            problems.add(table.heading("height"), "a column 'height' with the heights of the wire is needed")
        if table.has("position"):
            _check_positions(table, problems)
    try:
        problems.finish()
    except LayoutError as error:
        raise LayoutError(_first_ones(error.problems)) from None
    assert table is not None
    return replace(_run(path, table), notes=problems.notes)


def _first_ones(problems: Sequence[Problem]) -> tuple[Problem, ...]:
    """Return the first problems of each column, and how many more there are: a run has thousands of rows."""
    listed, count = [], Counter[str]()
    for problem in problems:
        column = problem.key.rpartition("column ")[2] if "column " in problem.key else ""
        count[column] += 1
        if not column or count[column] <= _LISTED:
            listed.append(problem)
    more = {column: number - _LISTED for column, number in count.items() if column and number > _LISTED}
    file = problems[0].file
    return (*listed, *(Problem(file, f"column {c}", f"... and {n} more rows are wrong") for c, n in more.items()))


def _grid(path: Path, problems: SheetProblems) -> SheetGrid | None:
    if path.exists() and not path.is_file():
        problems.add(Place(""), "is no file: name the table with the run, CSV or XLSX")
        return None
    if path.suffix.lower() not in (".xlsx", ".xlsm"):
        return read_csv(path, "", problems)
    sheets = read_xlsx(path, problems)
    if len(sheets) == 1:
        return next(iter(sheets.values()))
    if _SHEET not in sheets and (sheets or problems.hidden):
        text = f"has {len(sheets)} sheets that are not hidden, none named '{_SHEET}': name the one with the run so"
        problems.add(Place(""), text)
    return sheets.get(_SHEET)


def _check_positions(table: SheetTable, problems: SheetProblems) -> None:
    """Tell of positions that neither rise nor fall like the others."""
    if len(table) < _LEAST:
        problems.add(Place(table.name), f"has {len(table)} rows, and a run has {_LEAST} at least")
        return
    x = table.numbers("position")
    known = np.flatnonzero(np.isfinite(x))
    steps = np.diff(x[known])
    sign = 1.0 if np.median(steps) >= 0.0 else -1.0
    for k in np.flatnonzero(sign * steps <= 0.0):
        before, here = x[known[k]], x[known[k + 1]]
        what = "stands in the row before, too" if here == before else f"comes after {before:.10g} m"
        course = "rise" if sign > 0.0 else "fall"
        text = f"{here:.10g} m {what}, where positions {course}: give one run, in its order"
        problems.add(table.place(int(known[k + 1]), "position"), text)


def _run(path: Path, table: SheetTable) -> MeasuredRun:
    order = np.argsort(table.numbers("position"), kind="stable")
    texts = table.texts("structure")

    def column(name: str) -> FloatArray:
        return np.asarray(table.numbers(name)[order])

    return MeasuredRun(
        source=path.name,
        position=column("position"),
        height=column("height"),
        stagger=column("stagger"),
        thickness=column("thickness"),
        structure=tuple(texts[k] for k in order),
        row=tuple(table.rows[k] for k in order),
    )
