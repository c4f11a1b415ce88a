"""A table in a CSV file, as spreadsheet programs of any country write it: its cells as text.

Cells are separated by commas, semicolons or tabs, by what the first row has; they may be quoted. Lines that begin with
``#`` and empty ones are left out. Text is UTF-8, or UTF-16 with its mark.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from models.definition_files.message_text import said
from models.layout.sheet_problems import Place, SheetProblems

#: Largest file that is read [bytes]: ten measuring runs of a whole section, every centimetre.
LARGEST_FILE: Final = 200_000_000
#: Text that begins as formulas do, but is no number.
_FORMULA: Final = re.compile(r"'*(?![+-]?[\d.])[=+\-@\t\r]")
_UTF16: Final = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
#: How files begin that are tables, but not as text.
_OTHERS: Final = {
    b"PK\x03\x04": "is a workbook or an archive, not CSV: name it .xlsx if it is one, or save it as CSV",
    b"\xd0\xcf\x11\xe0": "is a workbook of old Excel (.xls), or one with a password: save it as CSV or .xlsx",
}


@dataclass(frozen=True)
class Unusable:
    """A cell that holds no value that could be read; ``text`` says why, and what to do."""

    text: str


#: A cell: text, a number of a workbook, nothing.
Cell = str | float | Unusable | None


@dataclass(frozen=True)
class SheetGrid:
    """The cells of a table.

    Attributes
    ----------
    name : str
        Of the sheet; empty if the file is its own sheet.
    rows : tuple of (int, tuple of Cell)
        Number of the row from 1, and its cells; without empty rows and comments.
    """

    name: str
    rows: tuple[tuple[int, tuple[Cell, ...]], ...]


def read_csv(path: Path, name: str, problems: SheetProblems) -> SheetGrid | None:
    """Return the cells of a CSV file; if it cannot be read, tell why and return None."""
    text = _text(path, name, problems)
    if text is None:
        return None
    lines = text.splitlines(keepends=True)
    first = next((line for line in lines if not _is_left_out(line)), "")
    separator = _separator(first)
    reader = csv.reader(_without_comments(lines), delimiter=separator, strict=True)
    rows, start = [], 1
    try:
        for cells in reader:
            stripped = tuple(plain_text(cell.strip()) for cell in cells)
            if any(stripped) and not stripped[0].lower().startswith("sep="):
                rows.append((start, stripped))
            start = reader.line_num + 1
    except csv.Error as error:
        text = f"cannot be split into cells ({error}): check the quotation marks from here on"
        problems.add(Place(name, start), text)
        return None
    return SheetGrid(name, tuple(rows))


def safe_text(text: str) -> str:
    """Return text for a cell that no spreadsheet takes for a formula; ``plain_text`` undoes it.

    Examples
    --------
    >>> safe_text("=1+1"), safe_text("-0.5 2"), safe_text("mast 3"), plain_text(safe_text("'=1"))
    ("'=1+1", '-0.5 2', 'mast 3', "'=1")
    """
    return f"'{text}" if _FORMULA.match(text) else text


def plain_text(cell: str) -> str:
    """Return the text that ``safe_text`` was given."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def is_comment(cells: tuple[Cell, ...]) -> bool:
    """Return whether a row of a workbook is one that begins with ``#``."""
    return bool(cells) and isinstance(cells[0], str) and cells[0].startswith("#")


def _text(path: Path, name: str, problems: SheetProblems) -> str | None:
    """Return the text of a file, or tell why there is none and return None."""
    try:
        if path.exists() and not path.is_file():
            problems.add(Place(name), f"{path.name} is not a file")
            return None
        if (size := path.stat().st_size) > LARGEST_FILE:
            text = f"has {size / 1e6:.0f} MB, and {LARGEST_FILE / 1e6:.0f} MB are read at most: split it"
            problems.add(Place(name), text)
            return None
        data = path.read_bytes()
    except OSError as error:
        problems.add(Place(name), f"cannot be read ({said(error)})")
        return None
    if other := _OTHERS.get(data[:4]):
        problems.add(Place(name), other)
        return None
    return _decoded(data, name, problems)


def _decoded(data: bytes, name: str, problems: SheetProblems) -> str | None:
    encoding = "utf-16" if data.startswith(_UTF16) else "utf-8-sig"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        row = data[: error.start].count(b"\n") + 1
        what = f"is not UTF-8 text (byte {error.start}): save the file as 'CSV UTF-8'"
        problems.add(Place(name, row), what)
        return None
    if "\0" in text:
        problems.add(Place(name, text[: text.index("\0")].count("\n") + 1), "is not text: save the table as CSV")
        return None
    return text


def _is_left_out(line: str) -> bool:
    return not line.strip() or line.lstrip().startswith("#") or line.lower().startswith("sep=")


def _without_comments(lines: list[str]) -> Iterator[str]:
    """Yield lines, comments as empty ones: what stands in them may look like quotations."""
    for line in lines:
        yield "\n" if line.lstrip().startswith("#") else line


def _separator(line: str) -> str:
    """Return what separates the cells of the first row: names and units hold none of the three."""
    return next((mark for mark in "\t;," if mark in line), ",")
