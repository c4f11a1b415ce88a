"""The columns of a table by their names: numbers in SI, each with the sheet, row and column that it stands in.

The first row has the names, in any order, upper or lower case, each with its unit in brackets where that is not SI:
``height [mm]``. A column whose name begins with ``#`` is a remark.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.definition_files.message_text import hint, shown_value
from models.definition_files.si_units import SI, shown, to_si
from models.definition_files.toml_reader import LARGEST, SMALLEST, in_its_unit
from models.layout.csv_sheets import Cell, SheetGrid, Unusable
from models.layout.sheet_problems import Place, SheetProblems

_HEADING: Final = re.compile(r"\s*([^\[\](]*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*")
_NUMBER: Final = re.compile(r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?", re.ASCII)
#: What may be 1234 as well as 1.234, where other numbers have a decimal point.
_THOUSANDS: Final = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
_WITH_UNIT: Final = re.compile(rf"({_NUMBER.pattern})\s*([^\d\s].*)", re.ASCII)
#: Units as they are also written.
_SIGNS: Final = str.maketrans({"²": "2", "³": "3", "°": "deg", "·": "."})
#: How far below the first row names are looked for, to say where they are.
_LOOKED_AT: Final = 30


@dataclass(frozen=True)
class SheetColumn:
    """A column that a table may have.

    Attributes
    ----------
    name : str
    unit : str
        SI unit; empty: the cells hold text.
    description : str
    required : bool
        Whether every row must have a value.
    minimum, maximum : float
        Range of the numbers, in SI.
    positive, whole : bool
        Whether numbers must be greater than 0, be whole ones.
    choices : tuple of str
        What a text must be one of; empty: anything.
    """

    name: str
    unit: str
    description: str
    required: bool = False
    minimum: float = -math.inf
    maximum: float = math.inf
    positive: bool = False
    whole: bool = False
    choices: tuple[str, ...] = ()


@dataclass(frozen=True)
class ReadColumn:
    """A column as read.

    Attributes
    ----------
    label : str
        As messages name it: ``C (height)``.
    numbers : ndarray, shape (n,)
        In SI; NaN where a cell is empty, holds text or could not be read.
    texts : tuple of str
        Empty where a cell is empty or the column holds numbers.
    told : ndarray, shape (n,)
        True where a problem of the cell has been told already.
    """

    label: str
    numbers: FloatArray
    texts: tuple[str, ...]
    told: BoolArray


@dataclass(frozen=True)
class SheetTable:
    """A table as read: its columns by name, those that it has not being empty ones.

    Attributes
    ----------
    name : str
        Of the sheet; empty if the file is its own sheet.
    rows : tuple of int
        Number of each row in the sheet, from 1.
    columns : mapping of str to ReadColumn
        Those that the table has.
    """

    name: str
    heading_row: int
    rows: tuple[int, ...]
    columns: Mapping[str, ReadColumn]

    def __len__(self) -> int:
        return len(self.rows)

    def has(self, name: str) -> bool:
        """Return whether the table has a column."""
        return name in self.columns

    def numbers(self, name: str) -> FloatArray:
        """Return the numbers of a column in SI, shape (n,), NaN where there is none."""
        return self.columns[name].numbers if self.has(name) else np.full(len(self), math.nan)

    def texts(self, name: str) -> tuple[str, ...]:
        """Return the texts of a column, empty where there is none."""
        return self.columns[name].texts if self.has(name) else ("",) * len(self)

    def told(self, name: str) -> BoolArray:
        """Return in which rows a problem of the column has been told already, shape (n,)."""
        return self.columns[name].told if self.has(name) else np.zeros(len(self), dtype=bool)

    def place(self, index: int, name: str = "") -> Place:
        """Return where the value of a column stands, by the index of its row; without a name, the row."""
        return Place(self.name, self.rows[index], self.columns[name].label if self.has(name) else "")

    def heading(self, name: str = "") -> Place:
        """Return where the name of a column stands."""
        return Place(self.name, self.heading_row, self.columns[name].label if self.has(name) else "")


def read_table(grid: SheetGrid, declared: Sequence[SheetColumn], problems: SheetProblems) -> SheetTable | None:
    """Return the columns of a table, having told all problems of its cells.

    Parameters
    ----------
    grid : SheetGrid
        From ``read_csv`` or ``read_xlsx``.
    declared : sequence of SheetColumn
        What the table may have.

    Returns
    -------
    SheetTable or None
        None if the names of the columns cannot be found.
    """
    if not grid.rows:
        problems.add(Place(grid.name), f"is empty: the first row has the names of the columns, {_names(declared)}")
        return None
    (heading_row, heading), *body = grid.rows
    found = _headings(grid, declared, problems)
    if found is None:
        return None
    if body and _are_units(body[0][1], found):
        text = "holds units: write them behind the names in brackets, as 'height [mm]', and delete this row"
        problems.add(Place(grid.name, body.pop(0)[0]), text)
    columns = {}
    decimal_point = _has_decimal_point(body, [place for place, (column, _) in found.items() if column.unit])
    for place, (column, unit) in found.items():
        label = f"{_letter(place)} ({column.name})"
        cells = [row[place] if place < len(row) else None for _, row in body]
        reader = _ColumnReader(grid.name, label, column, unit, decimal_point, problems)
        columns[column.name] = reader.read([number for number, _ in body], cells)
    for column in declared:
        if column.required and column.name not in columns:
            problems.add(Place(grid.name, heading_row), f"the column '{column.name}' is missing")
    _tell_nameless(grid.name, len(heading), set(found), heading, body, problems)
    if not body:
        problems.add(Place(grid.name, heading_row), "has no rows below the names of its columns")
    return SheetTable(grid.name, heading_row, tuple(number for number, _ in body), columns)


def _headings(
    grid: SheetGrid, declared: Sequence[SheetColumn], problems: SheetProblems
) -> dict[int, tuple[SheetColumn, str]] | None:
    """Return the declared column and the unit by the place of every column; None if the row has no names."""
    known = {column.name: column for column in declared}
    row, cells = grid.rows[0]
    if not any(_name_and_unit(cell)[0] in known for cell in cells):
        problems.add(Place(grid.name, row), _no_names(grid, known))
        return None
    found: dict[int, tuple[SheetColumn, str]] = {}
    places: dict[str, int] = {}
    for place, cell in enumerate(cells):
        at = Place(grid.name, row, _letter(place))
        if isinstance(cell, Unusable):
            problems.add(at, cell.text)
        elif isinstance(cell, float):
            problems.add(at, f"{cell:g} is no name of a column")
        elif cell and not cell.startswith("#"):
            name, unit = _name_and_unit(cell)
            if name not in known:
                advice = hint(name, known) or f"; known here: {', '.join(known)}; a remark's name begins with #"
                problems.add(at, f"there is no column {shown_value(cell)}{advice}")
            elif name in places:
                first = _letter(places[name])
                problems.add(at, f"'{name}' stands in column {first} already: one of them must go, or begin with #")
            else:
                places[name] = place
                found[place] = known[name], unit
                _check_unit(known[name], unit, Place(grid.name, row, f"{_letter(place)} ({name})"), problems)
    return found


def _no_names(grid: SheetGrid, known: Mapping[str, SheetColumn]) -> str:
    """Return what to say of a first row without any known name."""
    text = f"has none of the names of columns ({', '.join(known)})"
    for row, cells in grid.rows[1:_LOOKED_AT]:
        names = {_name_and_unit(cell)[0] for cell in cells} & set(known)
        if len(names) > 1 or (names and len(known) == 1):
            return f"{text}, and row {row} has: delete the rows above it, or begin them with #"
    words = [cell for cell in grid.rows[0][1] if isinstance(cell, str) and not _NUMBER.fullmatch(cell)]
    near = next((advice for cell in words if (advice := hint(_name_and_unit(cell)[0], known))), "")
    return f"{text}: write them into the first row{near}"


def _check_unit(column: SheetColumn, unit: str, place: Place, problems: SheetProblems) -> None:
    if not unit:
        return
    if not column.unit:
        problems.add(place, f"holds text, and has no unit: remove '[{unit}]'")
        return
    try:
        to_si(1.0, unit, column.unit)
    except ValueError as error:
        problems.add(place, str(error))


def _name_and_unit(cell: Cell) -> tuple[str, str]:
    """Return name and unit of a heading, both empty if it is none.

    Examples
    --------
    >>> _name_and_unit(" Youngs-Modulus [GPa]"), _name_and_unit("span")
    (('youngs_modulus', 'GPa'), ('span', ''))
    """
    match = _HEADING.fullmatch(cell) if isinstance(cell, str) else None
    if match is None:
        return (cell.casefold() if isinstance(cell, str) else ""), ""
    return _plain_name(match[1]), (match[2] or "").translate(_SIGNS)


def _plain_name(text: str) -> str:
    """Return a name in lower case, its words joined as declared ones are."""
    return re.sub(r"[\s_-]+", "_", text.casefold())


def _are_units(cells: Sequence[Cell], found: Mapping[int, tuple[SheetColumn, str]]) -> bool:
    """Return whether a row has units where numbers should be, as below the names in the tables of many."""
    there = [cells[k] for k, (column, _) in found.items() if column.unit and k < len(cells) and cells[k]]
    words = [c.strip("[]() ").translate(_SIGNS) if isinstance(c, str) else "" for c in there]
    return any(word != "1" for word in words) and all(word in SI for word in words)


def _tell_nameless(
    sheet: str,
    width: int,
    read: Iterable[int],
    heading: Sequence[Cell],
    body: Sequence[tuple[int, tuple[Cell, ...]]],
    problems: SheetProblems,
) -> None:
    """Tell of cells that stand in no column with a name."""
    for number, cells in body:
        beyond = [k for k, cell in enumerate(cells) if cell is not None and cell != "" and k >= width]
        if beyond:
            text = f"has {beyond[-1] + 1} cells for the {width} names of the first row: are there decimal commas"
            problems.add(Place(sheet, number, _letter(beyond[0])), f"{text} between commas? Separate by semicolons")
    nameless = [k for k, cell in enumerate(heading) if (cell is None or cell == "") and k not in read]
    for k in nameless:
        first = next((number for number, cells in body if k < len(cells) and cells[k] not in (None, "")), 0)
        if first:
            problems.add(Place(sheet, first, _letter(k)), "stands in a column without a name: name it, or empty it")


def _has_decimal_point(body: Sequence[tuple[int, tuple[Cell, ...]]], places: Sequence[int]) -> bool:
    """Return whether a number in one of the columns at some places is written with a decimal point."""
    cells = (row[place] for _, row in body for place in places if place < len(row))
    return any(isinstance(cell, str) and "." in cell and _NUMBER.fullmatch(cell) for cell in cells)


def _letter(place: int) -> str:
    """Return what spreadsheet programs call a column.

    Examples
    --------
    >>> _letter(0), _letter(27)
    ('A', 'AB')
    """
    rest, last = divmod(place, 26)
    return (_letter(rest - 1) if rest else "") + chr(ord("A") + last)


def _names(declared: Sequence[SheetColumn]) -> str:
    return ", ".join(f"[{column.name}]" if not column.required else column.name for column in declared)


@dataclass(frozen=True)
class _ColumnReader:
    """Reads the cells of one column."""

    sheet: str
    label: str
    column: SheetColumn
    unit: str
    decimal_point: bool
    problems: SheetProblems

    def read(self, rows: Sequence[int], cells: Sequence[Cell]) -> ReadColumn:
        """Return the column, having told of what cannot be read."""
        numbers = np.full(len(cells), math.nan)
        texts = [""] * len(cells)
        told = np.full(len(cells), self._unit_is_wrong())
        for k, cell in enumerate(cells):
            try:
                if cell is None or cell == "":
                    self._check_empty()
                elif self.column.unit:
                    numbers[k] = self._number(cell)
                else:
                    texts[k] = self._choice(cell)
            except ValueError as error:
                self.problems.add(Place(self.sheet, rows[k], self.label), str(error))
                told[k] = True
        return ReadColumn(self.label, numbers, tuple(texts), told)

    def _unit_is_wrong(self) -> bool:
        """Return whether the unit is none of the column's, of which its heading has told."""
        return bool(self.unit) and bool(self.column.unit) and SI.get(self.unit, ("", 1.0))[0] != self.column.unit

    def _check_empty(self) -> None:
        if self.column.required:
            raise ValueError("is empty: every row needs a value")

    def _choice(self, cell: Cell) -> str:
        """Return the text of a cell; a number is one too, the name of a structure say."""
        if isinstance(cell, Unusable):
            raise ValueError(cell.text)  # noqa: TRY004 - the cell is at fault, not a type
        text = f"{cell:.15g}" if isinstance(cell, float) else str(cell)
        choices = self.column.choices
        if not choices:
            return text
        name = _plain_name(text)
        if name not in choices:
            raise ValueError(f"{shown_value(text)} is none of {', '.join(choices)}{hint(text, choices)}")
        return name

    def _number(self, cell: Cell) -> float:
        """Return the number of a cell in SI, raise ``ValueError`` saying what is wrong with it."""
        if isinstance(cell, Unusable):
            raise ValueError(cell.text)  # noqa: TRY004 - as above
        written = cell if isinstance(cell, float) else self._parsed(str(cell))
        if not abs(written) <= LARGEST:
            raise ValueError(f"{written:g} is not finite, or larger than anything here can be ({LARGEST:g})")
        if self._unit_is_wrong():
            return math.nan
        value = to_si(written, self.unit, self.column.unit) if self.unit else float(written)
        self._check_range(value)
        return value

    def _parsed(self, text: str) -> float:
        plain = text.replace("\u2212", "-")
        if _NUMBER.fullmatch(plain) is None:
            raise ValueError(f"{shown_value(text)} is not a number{_advice(plain)}")
        if self.decimal_point and _THOUSANDS.fullmatch(plain):
            raise ValueError(
                f"'{text}' may have a decimal comma or one for thousands, as other numbers here have a point: "
                "write a decimal point, and no mark for thousands"
            )
        return float(plain.replace(",", "."))

    def _check_range(self, value: float) -> None:
        column = self.column
        if column.whole and not value.is_integer():
            raise ValueError(f"{value:g} is not a whole number")
        if column.positive and value < SMALLEST:
            raise ValueError(f"{shown(value, column.unit)} must be greater than 0")
        if not column.minimum <= value <= column.maximum:
            text = f"{value:g} is outside {column.minimum:g} ... {shown(column.maximum, column.unit)}"
            if math.isinf(column.maximum):
                text = f"{value:g} is less than {shown(column.minimum, column.unit)}"
            raise ValueError(text + in_its_unit(column.unit))


def _advice(text: str) -> str:
    """Return what to do with a text that is no number, empty if that is plain."""
    match = _WITH_UNIT.fullmatch(text)
    if match is not None and match[2].translate(_SIGNS).strip() in SI:
        return f"; write the number alone, and the unit into the name of the column: [{match[2]}]"
    if re.fullmatch(r"[+-]?(nan|inf|infinity)", text, re.IGNORECASE):
        return "; leave the cell empty where there is no value"
    if re.fullmatch(r"\d+\+\d+([.,]\d+)?", text):
        return "; write a kilometrage as one number, 12+345.6 as 12.3456 in [km] or 12345.6 in [m]"
    if re.fullmatch(r"[+-]?\d{1,3}([.,' \u00a0\u202f]\d{3})+([.,]\d+)?", text):
        return "; write it without marks for thousands"
    return ""
