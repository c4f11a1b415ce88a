"""Recording: one row per time at the end of each step, plus the start, written out as the run goes on."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TextIO

import numpy as np

from master.arrays import FloatArray
from master.errors import MasterError
from master.network import Network

#: Rows kept back before they are written.
ROWS_PER_FLUSH: Final = 250
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


def matcher(pattern: str) -> Callable[[str], bool]:
    """Return a test for names; ``*`` stands for anything, brackets for themselves.

    Examples
    --------
    >>> matcher("*.dropper[*].force")("catenary.dropper[12].force")
    True
    """
    compiled = re.compile("".join(".*" if part == "*" else re.escape(part) for part in re.split(r"(\*)", pattern)))
    return lambda name: compiled.fullmatch(name) is not None


def header(names: Sequence[str], units: Sequence[str]) -> list[str]:
    """Return column titles: ``time [s]``, then ``name [unit]``."""
    titles = [f"{n} [{u}]" if u else n for n, u in zip(names, units, strict=True)]
    return ["time [s]", *titles]


class Source:
    """Where values of a recording come from: called when a row is due."""

    def __init__(self, names: Sequence[str], values: FloatArray, read: Callable[[], None] = lambda: None) -> None:
        self.names = tuple(names)
        self.values = values
        self.read = read


class Recorder:
    """Observer that records sources every ``every``-th step, in memory and in a CSV file.

    Parameters
    ----------
    path : Path
        The CSV file.
    sources : sequence of Source
        Groups of variables.
    units : mapping
        Unit by name.
    rows : int
        Rows to expect (a bound).
    every : int
        Steps between rows.
    """

    def __init__(
        self, path: Path, sources: Sequence[Source], units: Mapping[str, str], rows: int, every: int = 1
    ) -> None:
        self.names = tuple(n for s in sources for n in s.names)
        self.units = tuple(units.get(n, "") for n in self.names)
        self._sources = tuple(sources)
        self._every = every
        self._table: FloatArray = np.zeros((rows, 1 + len(self.names)))
        self._columns = self._make_columns()
        self._count = 0
        self._written = 0
        self._format = ",".join([NUMBER_FORMAT] * self._table.shape[1]) + "\n"
        self._file: TextIO = path.open("w", encoding="utf-8", newline="")
        csv.writer(self._file, lineterminator="\n").writerow(header(self.names, self.units))
        self._file.flush()

    def begin(self, time: float, network: Network) -> None:
        """Record the start."""
        self._record(time)

    def observe(self, index: int, time: float, network: Network) -> None:
        """Record the end of a step, if one is due."""
        if index % self._every == 0:
            self._record(time)

    def finish(self) -> None:
        """Write what is left and close the file."""
        if not self._file.closed:
            self._flush()
            self._file.close()

    @property
    def recording(self) -> Recording:
        """What was recorded so far."""
        done = self._table[: self._count]
        return Recording(done[:, 0], self.names, self.units, done[:, 1:])

    def _make_columns(self) -> list[tuple[Source, slice]]:
        columns, first = [], 1
        for source in self._sources:
            columns.append((source, slice(first, first + len(source.names))))
            first += len(source.names)
        return columns

    def _record(self, time: float) -> None:
        row = self._table[self._count]
        row[0] = time
        for source, part in self._columns:
            source.read()
            row[part] = source.values
        self._count += 1
        if self._count - self._written >= ROWS_PER_FLUSH:
            self._flush()

    def _flush(self) -> None:
        rows = self._table[self._written : self._count]
        self._file.writelines(self._format % tuple(row) for row in rows.tolist())
        self._file.flush()
        self._written = self._count


def load(path: Path) -> Recording:
    """Read a recording from its CSV file; a last line cut short by a crash is left out.

    Raises
    ------
    MasterError
        If the file is missing or is not such a recording.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise MasterError(f"{path} cannot be read ({error})") from error
    lines = text[: text.rfind("\n") + 1].splitlines()
    titles = next(csv.reader(lines[:1]), [])
    if titles[:1] != ["time [s]"]:
        raise MasterError(f"{path} is not a recording: its first column is not 'time [s]'")
    return _table(path, titles[1:], [line.split(",") for line in lines[1:]])


def _table(path: Path, titles: Sequence[str], rows: Sequence[Sequence[str]]) -> Recording:
    try:
        table = np.array(rows, dtype=np.float64).reshape(len(rows), len(titles) + 1)
    except ValueError as error:
        raise MasterError(f"{path} is not a recording: {error}") from error
    parts = [m for t in titles if (m := _HEADER.fullmatch(t))]
    names = tuple(m["name"] for m in parts)
    units = tuple(m["unit"] or "" for m in parts)
    return Recording(table[:, 0], names, units, table[:, 1:])
