"""The tables of an XLSX workbook: values of cells as stored, and of formulas what they last came to.

Needs `openpyxl`, an extra; imported when a workbook is read or written.
"""

from __future__ import annotations

import datetime
import io
import warnings
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from models.definition_files.message_text import said
from models.layout.csv_sheets import Cell, SheetGrid, Unusable, is_comment
from models.layout.sheet_problems import LayoutError, Place, SheetProblems

#: Largest workbook that is read, unpacked [bytes], and most cells of a sheet.
_LARGEST: Final = 200_000_000
_MOST_CELLS: Final = 5_000_000
_MISSING: Final = (
    "needs openpyxl, which is not installed: pip install 'openpanto[xlsx]', or use CSV files, one for each sheet"
)
_NO_RESULT: Final = (
    "holds a formula without a stored value: open the file in a spreadsheet program and save it, or write the value"
)


def read_xlsx(path: Path, problems: SheetProblems) -> dict[str, SheetGrid]:
    """Return the visible sheets of a workbook by their names in lower case; if it cannot be read, tell why."""
    try:
        from openpyxl import load_workbook
    except ImportError:
        problems.add(Place(""), _MISSING)
        return {}
    data = _packed(path, problems)
    if data is None:
        return {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what openpyxl does not keep when it writes
            stored = load_workbook(io.BytesIO(data), data_only=True)
            written = load_workbook(io.BytesIO(data), data_only=False)
    except MemoryError:
        raise
    except Exception as error:  # of any kind: openpyxl trusts the file
        text = f"cannot be read as a workbook ({type(error).__name__}: {error}): open and save it once more"
        problems.add(Place(""), text)
        return {}
    sheets = {}
    titles: dict[str, str] = {}
    for sheet in stored.worksheets:
        if sheet.sheet_state != "visible":
            problems.hidden.append(sheet.title)
            continue
        name = sheet.title.strip().casefold()
        if (other := titles.setdefault(name, sheet.title)) != sheet.title:
            text = f"stands in two sheets, '{other}' and '{sheet.title}': remove one, or give it another name"
            problems.add(Place(name), text)
            continue
        grid = _grid(sheet, written[sheet.title], problems)
        if grid is not None:
            sheets[name] = grid
    return sheets


def workbook_bytes(sheets: Mapping[str, Sequence[Sequence[str | float | None]]]) -> bytes:
    """Return a workbook of sheets, each a list of rows of which the first has the names.

    Raises
    ------
    LayoutError
        If openpyxl is not installed.
    """
    try:
        from openpyxl import Workbook
        from openpyxl.styles import Font
    except ImportError as error:
        problems = SheetProblems("--xlsx")
        problems.add(Place(""), _MISSING)
        raise LayoutError(tuple(problems.found)) from error
    book = Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for number, row in enumerate(rows, 1):
            sheet.append(list(row))
            for cell in sheet[number]:
                cell.data_type = "s" if isinstance(cell.value, str) else cell.data_type  # text with = is no formula
        for cell in sheet[1]:
            cell.font = Font(bold=True)
            sheet.column_dimensions[cell.column_letter].width = max(10.0, len(str(cell.value)) + 3.0)
        sheet.freeze_panes = "A2"
    buffer = io.BytesIO()
    book.save(buffer)
    return buffer.getvalue()


def _packed(path: Path, problems: SheetProblems) -> bytes | None:
    """Return the bytes of a workbook, or tell why it cannot be one and return None."""
    try:
        data = path.read_bytes() if path.stat().st_size <= _LARGEST else b""
        with zipfile.ZipFile(path) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
    except OSError as error:
        problems.add(Place(""), f"cannot be read ({said(error)})")
        return None
    except zipfile.BadZipFile:
        old = data.startswith(b"\xd0\xcf\x11\xe0")
        text = "is a workbook of old Excel (.xls), or one with a password" if old else "is not an XLSX workbook"
        problems.add(Place(""), f"{text}: save it as .xlsx, without a password")
        return None
    if size > _LARGEST or not data:
        text = f"has {size / 1e6:.0f} MB unpacked, and {_LARGEST / 1e6:.0f} MB are read at most: split it"
        problems.add(Place(""), text)
        return None
    return data


def _grid(stored: Any, written: Any, problems: SheetProblems) -> SheetGrid | None:
    name = stored.title.strip().casefold()
    if stored.max_row * stored.max_column > _MOST_CELLS:
        last = stored.cell(1, stored.max_column).column_letter + str(stored.max_row)
        problems.add(Place(name), f"reaches as far as cell {last}: delete what stands beyond the table")
        return None
    merged = dict(_merged(stored))
    rows = []
    for values, formulas in zip(stored.iter_rows(), written.iter_rows(), strict=True):
        cells = tuple(
            merged[v.coordinate] if v.coordinate in merged else _cell(v.value, f, v.data_type)
            for v, f in zip(values, formulas, strict=True)
        )
        if any(cell is not None for cell in cells) and not is_comment(cells):
            rows.append((values[0].row, cells))
    return SheetGrid(name, tuple(rows))


def _merged(sheet: Any) -> Iterator[tuple[str, Unusable]]:
    """Yield the cells that merging has emptied, all but the first of each range that holds something."""
    for found in sheet.merged_cells.ranges:
        if sheet.cell(found.min_row, found.min_col).value is None:
            continue
        text = f"belongs to the merged cells {found.coord}: unmerge them, and write into each what holds there"
        yield from ((sheet.cell(*place).coordinate, Unusable(text)) for place in list(found.cells)[1:])


def _cell(value: Any, written: Any, kind: str) -> Cell:
    if value is None:
        return Unusable(_NO_RESULT) if written.data_type == "f" else None
    if kind == "e":
        return Unusable(f"holds the error {value}: correct its formula, or write the value")
    if isinstance(value, bool):
        return Unusable(f"holds {str(value).upper()}, which is no number: write the value")
    if isinstance(value, (datetime.date, datetime.time, datetime.timedelta)):
        return Unusable(f"holds the date or time {value}: format the cell as a number and write the value again")
    if isinstance(value, str):
        return value.strip() or None
    return float(value)
