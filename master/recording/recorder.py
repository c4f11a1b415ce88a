"""Recording while a run goes on: one row at the start and one at the end of every step, or of every n-th."""

from __future__ import annotations

import csv
import io
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from master.arrays import FloatArray
from master.coupling.network import Network
from master.errors import ForeignResultsError, MasterError, said
from master.recording.recording import NUMBER_FORMAT, Recording, header, load
from master.safety.safe_files import AppendOnlyFile, safe_cell

#: Rows held back before they are written, and the simulated time that they may span [s].
ROWS_PER_FLUSH: Final = 250
LONGEST_UNWRITTEN: Final = 1.0
#: What a user can do about results that were changed by others.
RERUN_ADVICE: Final = "while the run was in progress; run it again, into another folder (--out)"


class RecordedValues:
    """Values to be recorded together; ``read`` refreshes them when a row is due."""

    def __init__(self, names: Sequence[str], values: FloatArray, read: Callable[[], None] = lambda: None) -> None:
        self.names = tuple(names)
        self.values = values
        self.read = read


class Recorder:
    """Observer that records sources every ``every``-th step in a CSV file, row by row.

    A row is written at the latest when `ROWS_PER_FLUSH` are waiting, or when waiting for the next one would leave more
    than `LONGEST_UNWRITTEN` of simulated time unwritten, so a process that is killed loses no more than that.

    Parameters
    ----------
    path : Path
        The CSV file.
    sources : sequence of RecordedValues
        Groups of variables.
    units : mapping
        Unit by name.
    every : int
        Steps between rows.
    keep : int, optional
        Rows to keep of an existing file, which is then continued; the first of them is the start.
    is_steady : bool
        Whether every row takes the same time; otherwise many are formatted at once, which takes less in all.

    Raises
    ------
    MasterError
        If the file cannot be written, or lacks rows that are to be kept.
    """

    def __init__(
        self,
        path: Path,
        sources: Sequence[RecordedValues],
        units: Mapping[str, str],
        every: int = 1,
        keep: int = 0,
        is_steady: bool = False,
    ) -> None:
        self.names = tuple(n for s in sources for n in s.names)
        self.units = tuple(units.get(n, "") for n in self.names)
        self._every = every
        ends = list(itertools.accumulate((len(s.names) for s in sources), initial=1))
        self._places = [(s, slice(*ends)) for s, ends in zip(sources, itertools.pairwise(ends), strict=True)]
        self._is_steady = is_steady
        self._format = (",".join([NUMBER_FORMAT] * ends[-1]) + "\n").encode()
        self._waiting: FloatArray = np.empty((1 if is_steady else ROWS_PER_FLUSH, ends[-1]))
        self._unformatted = 0  # rows that wait there
        self._lines: list[bytes] = []
        self._count = 0  # rows not written yet, as numbers or as lines
        self._oldest = self._latest = -math.inf
        self._is_continued = keep > 0
        self._rows = keep
        titles = _title_line(self.names, self.units)
        self._file = AppendOnlyFile(path, _end_of_rows(path, titles, keep) if keep else 0)
        if not keep:
            self._file.write(titles.encode())

    def begin(self, time: float, network: Network) -> None:
        """Record the start, unless the file already ends with it."""
        if not self._is_continued:
            self._record(time)

    def observe(self, index: int, time: float, network: Network) -> None:
        """Record the end of a step, if one is due."""
        if index % self._every == 0:
            self._record(time)

    def finish(self) -> None:
        """Write what is left and close the file."""
        if self._file.is_open:
            try:
                self._write()
            finally:
                self._file.close()

    @property
    def path(self) -> Path:
        """The file."""
        return self._file.path

    def sync(self) -> None:
        """Write what is waiting and wait until it is on the disk."""
        self._write()
        self._file.sync()

    def read_back(self, is_complete: bool = True) -> Recording:
        """Return what is in the file.

        Parameters
        ----------
        is_complete : bool
            Whether the file must hold, to the last byte, what was kept and recorded.

        Raises
        ------
        ForeignResultsError
            If it is no longer the file that was written.
        """
        if not self.path.is_file():
            raise ForeignResultsError(f"{self.path} was removed {RERUN_ADVICE}")
        found = load(self.path)
        if is_complete and len(found.time) != self._rows:
            counts = f"has {len(found.time)} rows, {self._rows} were written"
            raise ForeignResultsError(f"{self.path} {counts}: it was changed {RERUN_ADVICE}")
        if is_complete and not self._file.is_as_written:
            raise ForeignResultsError(f"{self.path} is not what was written: it was changed {RERUN_ADVICE}")
        return found

    def _record(self, time: float) -> None:
        row = self._waiting[self._unformatted]
        row[0] = time
        for source, place in self._places:
            source.read()
            row[place] = source.values
        if self._count == 0:
            self._oldest = time
        self._count += 1
        self._rows += 1
        self._unformatted += 1
        if self._is_steady:
            self._format_rows()
        spacing, self._latest = time - self._latest, time
        if self._count >= ROWS_PER_FLUSH or time + spacing > self._oldest + LONGEST_UNWRITTEN:
            self._write()

    def _format_rows(self) -> None:
        count, self._unformatted = self._unformatted, 0
        self._lines.append((self._format * count) % tuple(self._waiting[:count].ravel().tolist()))

    def _write(self) -> None:
        self._format_rows()
        lines, self._count = b"".join(self._lines), 0
        self._lines.clear()  # before writing: what fails now is not tried again
        if lines:
            self._file.write(lines)


def _title_line(names: Sequence[str], units: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(map(safe_cell, header(names, units)))
    return text.getvalue()


def _end_of_rows(path: Path, titles: str, rows: int) -> int:
    """Return the length [bytes] of a recording with these titles up to the end of row ``rows``."""
    try:
        with path.open("rb") as file:
            same = file.readline() == titles.encode()
            sizes = [len(line) for line in itertools.islice(file, rows) if line.endswith(b"\n")]
    except OSError as error:
        raise MasterError(f"{path} cannot be read ({said(error)})") from error
    if not same:
        raise MasterError(f"{path} records other variables than this run does and cannot be continued")
    if len(sizes) < rows:
        raise MasterError(
            f"{path} has {len(sizes)} rows, fewer than the {rows} of the run that is to continue: some are lost"
        )
    return len(titles.encode()) + sum(sizes)
