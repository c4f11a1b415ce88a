"""Recorded variables over time, and the CSV files that hold them: one row per time."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from master.arrays import FloatArray
from master.errors import MasterError
from master.safety.safe_files import plain_cell
from master.system.variable_names import matcher

#: Name of the recording of every step.
TIMESERIES: Final = "timeseries.csv"
NUMBER_FORMAT: Final = "%.10g"
_HEADER: Final = re.compile(r"(?P<name>.*?)(?: \[(?P<unit>[^\[\]]*)\])?")


@dataclass(frozen=True)
class Recording:
    """Recorded variables over time.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Times [s].
    names : tuple of str
        ``component.variable``.
    units : tuple of str
        Units, empty where there is none.
    values : ndarray, shape (n, n_variables)
        One row per time.
    """

    time: FloatArray
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: FloatArray

    def __contains__(self, name: str) -> bool:
        return name in self.names

    def __getitem__(self, name: str) -> FloatArray:
        column: FloatArray = self.values[:, self.names.index(name)]
        return column

    def matching(self, pattern: str) -> tuple[str, ...]:
        """Return the names that match a pattern (`matcher`), in order."""
        fits = matcher(pattern)
        return tuple(n for n in self.names if fits(n))


EMPTY: Final = Recording(np.zeros(0), (), (), np.zeros((0, 0)))


def header(names: Sequence[str], units: Sequence[str]) -> list[str]:
    """Return column titles: ``time [s]``, then ``name [unit]``."""
    titles = [f"{n} [{u}]" if u else n for n, u in zip(names, units, strict=True)]
    return ["time [s]", *titles]


def load(path: Path) -> Recording:
    """Read a recording from its CSV file; a last line cut short by a crash is left out.

    Raises
    ------
    MasterError
        If the file is missing or is not a recording.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise MasterError(f"{path} cannot be read ({error})") from error
    first, _, rest = text[: text.rfind("\n") + 1].partition("\n")
    titles = [plain_cell(cell) for cell in next(csv.reader([first]), [])]
    if titles[:1] != ["time [s]"]:
        raise MasterError(f"{path} is not a recording: its first column is not 'time [s]'")
    return _table(path, titles[1:], rest)


def _table(path: Path, titles: Sequence[str], rows: str) -> Recording:
    columns = len(titles) + 1
    try:
        table = np.loadtxt(io.StringIO(rows), delimiter=",", ndmin=2, comments=None) if rows else np.zeros((0, columns))
    except ValueError as error:
        raise MasterError(f"{path} is not a recording: {error}") from error
    if table.shape[1] != columns:
        raise MasterError(f"{path} is not a recording: {columns} titles, but {table.shape[1]} columns")
    time = table[:, 0]
    if not (np.isfinite(time).all() and (np.diff(time) > 0.0).all()):
        raise MasterError(f"{path} is not a recording: its times are not finite, or do not increase from row to row")
    parts = [m for t in titles if (m := _HEADER.fullmatch(t))]
    names = tuple(m["name"] for m in parts)
    units = tuple(m["unit"] or "" for m in parts)
    return Recording(time, names, units, table[:, 1:])
