"""The journal of a sweep: a line for every finished run, written at once, from which a later sweep goes on."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from master.batch.sweep.sweep_run import SweepResult
from master.safety.safe_files import AppendOnlyFile

JOURNAL: Final = "sweep_runs.jsonl"


class SweepJournal:
    """The journal in a sweep's folder.

    Parameters
    ----------
    folder : Path
        Exists, and is claimed.

    Attributes
    ----------
    found : dict
        The results in it, by key; the last one of each.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / JOURNAL
        data = self._path.read_bytes() if self._path.is_file() else b""
        whole = data[: data.rfind(b"\n") + 1]  # a process that was killed may have left half a line
        self.found: dict[str, SweepResult] = {}
        for line in whole.splitlines():
            # A damaged line costs its run: it is made again.
            if (result := SweepResult.of_line(line)) is not None:
                self.found[result.key] = result
        self._size = len(whole)
        self._file: AppendOnlyFile | None = None  # a folder that holds nothing but a journal is not yet a sweep's

    def add(self, result: SweepResult) -> None:
        """Write down what has become of a run."""
        self.found[result.key] = result
        if self._file is None:
            self._file = AppendOnlyFile(self._path, self._size)
        self._file.write(result.line())

    def close(self) -> None:
        """Wait until all is on the disk."""
        if self._file is not None:
            self._file.sync()
            self._file.close()
