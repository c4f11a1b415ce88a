"""A table of signals over time in a CSV file: `name [unit]` in its first line, SI in what is read."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NoReturn

import numpy as np

from models.arrays import FloatArray
from models.definition_files.message_text import hint, not_utf8, said
from models.definition_files.si_units import SI

_HEAD: Final = re.compile(r"\s*(.*?)\s*\[\s*(.*?)\s*\]\s*")
_WORD: Final = r"[A-Za-z_]\w*(\[\d+\])?"
#: Names of variables: words with dots between them, each with an index if there are several.
VARIABLE: Final = re.compile(rf"{_WORD}(\.{_WORD})*", re.ASCII)
#: The column of the times, unless another is named.
TIME: Final = "time"
_FEWEST_ROWS: Final = 2


class SignalFileError(ValueError):
    """A file that is no table of signals; says where and why."""


@dataclass(frozen=True)
class SignalTable:
    """Signals over time, in SI.

    Attributes
    ----------
    names, units : tuple of str
        Of the columns, the times aside; SI units.
    time : ndarray, shape (n,)
        Rising [s].
    values : ndarray, shape (n, k)
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    time: FloatArray
    values: FloatArray


@dataclass(frozen=True)
class _Column:
    name: str
    unit: str
    factor: float


def read_signals(path: Path, time: str | None = None) -> SignalTable:
    """Read a table of signals.

    Parameters
    ----------
    path : Path
    time : str, optional
        Name of the column of times; the first column, named ``time``, by default.

    Raises
    ------
    SignalFileError
        If the file cannot be read or is no such table; with line and column.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise SignalFileError(f"{path} cannot be read ({said(error)})") from error
    except UnicodeDecodeError as error:
        raise SignalFileError(f"{path} {not_utf8(error)}") from error
    head, _, body = text.partition("\n")
    columns = _columns(path, head)
    clock = _clock(path, columns, time)
    rows = _rows(path, body, columns)
    times = rows[:, clock] * columns[clock].factor
    _check_times(path, times)
    kept = [k for k in range(len(columns)) if k != clock]
    values = np.ascontiguousarray(rows[:, kept]) * np.array([columns[k].factor for k in kept])
    return SignalTable(tuple(columns[k].name for k in kept), tuple(columns[k].unit for k in kept), times, values)


def _columns(path: Path, head: str) -> list[_Column]:
    cells = next(csv.reader([head.rstrip("\r")]), [])
    if len(cells) < _FEWEST_ROWS:
        more = " (they are separated by semicolons: separate them by commas)" if ";" in head else ""
        raise SignalFileError(f"{path}, line 1: needs a column of times and at least one more, such as "
                              f"'time [s],base.z [mm]'{more}")  # fmt: skip
    columns = [_column(path, number, cell) for number, cell in enumerate(cells, 1)]
    names = [c.name for c in columns]
    for number, name in enumerate(names, 1):
        if name in names[: number - 1]:
            _fail(path, 1, number, name, "is the name of a column before it too")
    return columns


def _column(path: Path, number: int, cell: str) -> _Column:
    match = _HEAD.fullmatch(cell)
    if match is None:
        _fail(path, 1, number, cell.strip(), "has no unit: write 'name [unit]', '[1]' for a plain number")
    name, unit = match[1], match[2]
    if not VARIABLE.fullmatch(name):
        _fail(path, 1, number, name, "is no name such as base.z or mass[1].z: letters, digits and '_', a letter first")
    if unit not in SI:
        _fail(path, 1, number, name, f"has the unknown unit '{unit}'{hint(unit, SI)}; known are {', '.join(SI)}")
    return _Column(name, *SI[unit])


def _clock(path: Path, columns: Sequence[_Column], time: str | None) -> int:
    names = [c.name for c in columns]
    if time is None and names[0] != TIME:
        _fail(path, 1, 1, names[0], f"is not '{TIME}': name the column of the times by --time")
    if time is not None and time not in names:
        raise SignalFileError(f"{path}, line 1: there is no column '{time}' of times{hint(time, names)}")
    clock = 0 if time is None else names.index(time)
    if columns[clock].unit != "s":
        _fail(path, 1, clock + 1, names[clock], f"has times in a unit of '{columns[clock].unit}': write [s] or [ms]")
    return clock


def _rows(path: Path, body: str, columns: Sequence[_Column]) -> FloatArray:
    lines = body.rstrip().count("\n") + 1
    if not body.strip():
        raise SignalFileError(f"{path} has no row of values")
    try:
        rows = np.loadtxt(io.StringIO(body.rstrip()), delimiter=",", comments=None, ndmin=2, dtype=np.float64)
        is_sound = rows.shape == (lines, len(columns)) and bool(np.isfinite(rows).all())
    except ValueError:
        is_sound = False
    if not is_sound:
        rows = _read_slowly(path, body, columns)
    if len(rows) < _FEWEST_ROWS:
        raise SignalFileError(f"{path} has {len(rows)} row of values where a signal takes at least {_FEWEST_ROWS}")
    return rows


def _read_slowly(path: Path, body: str, columns: Sequence[_Column]) -> FloatArray:
    """Read cell by cell: what is wrong is found with its place."""
    rows = [list(_numbers(path, number, line, columns)) for number, line in enumerate(body.rstrip().split("\n"), 2)]
    return np.array(rows, dtype=np.float64)


def _numbers(path: Path, line: int, text: str, columns: Sequence[_Column]) -> Iterator[float]:
    cells = next(csv.reader([text.rstrip("\r")]), [])
    if len(cells) != len(columns):
        raise SignalFileError(f"{path}, line {line}: has {len(cells)} values for {len(columns)} columns")
    for number, (cell, column) in enumerate(zip(cells, columns, strict=True), 1):
        if not cell.strip():
            _fail(path, line, number, column.name, "is empty")
        try:
            value = float(cell)
        except ValueError:
            _fail(path, line, number, column.name, f"'{cell.strip()}' is not a number")
        if not math.isfinite(value):
            _fail(path, line, number, column.name, f"is {cell.strip()}: leave out the row, or write a number")
        yield value


def _check_times(path: Path, times: FloatArray) -> None:
    wrong = np.flatnonzero(np.diff(times) <= 0.0)
    if len(wrong):
        k = int(wrong[0]) + 1
        what = "is that of the line before too" if times[k] == times[k - 1] else "lies before that of the line before"
        raise SignalFileError(f"{path}, line {k + 2}: the time {times[k]:.9g} s {what}; times must rise")


def _fail(path: Path, line: int, column: int, name: str, text: str) -> NoReturn:
    raise SignalFileError(f"{path}, line {line}, column {column} ('{name}'): {text}")
