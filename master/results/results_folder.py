"""The results folder of a run: its names, who may work in it, and how its files are written."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from master.errors import MasterError, RequestError
from master.evaluation.contact_signals import Signals, force_table
from master.recording.checkpoint import NAME as CHECKPOINT
from master.recording.continuation import Continuation
from master.recording.recording import NUMBER_FORMAT
from master.recording.static_geometry import Geometry
from master.results import summary_schema
from master.safety import folder_lock
from master.safety.safe_files import PART, safe_cell, write_atomically

GENERATOR: Final = "openpanto master"
#: Version of what a run leaves. 1, which names none: figures of a brick wall at 20 Hz; 2: the present one.
FORMAT: Final = 2
SUMMARY: Final = "summary.json"
GEOMETRY: Final = "geometry.json"
FORCES: Final = "contact_force.csv"
REPORT: Final = "report.html"
_TABLES: Final = ("timeseries*.csv", "timeseries*.parquet", FORCES, "contact_force.parquet")
_OURS: Final = (*_TABLES, GEOMETRY, REPORT, "*.png", "*.svg", "definition_*.toml")
#: What a run, a study or a verification may leave half written if it is killed, and what is no result.
_PARTS: Final = (*(name + PART for name in (SUMMARY, GEOMETRY, FORCES, CHECKPOINT)), f".*{PART}")
_LOCKS: Final = (folder_lock.LOCK, folder_lock.OWNER)
#: How folders begin that hold nothing of worth once the process is gone that made them.
WORK: Final = ".work-"
#: Format of numbers that are to be read back to the last bit.
_EXACT: Final = "%.17g"
_NOT_OURS: Final = "exists and is {kind} of this tool; it is left alone, choose another with --out"


@dataclass(frozen=True)
class RunFolder:
    """The results folder of one run, claimed: its files, and which run it is.

    Attributes
    ----------
    path : Path
        The folder.
    run : str
        Identity of the run.
    """

    path: Path
    run: str

    @property
    def summary_file(self) -> Path:
        """Path of ``summary.json``."""
        return self.path / SUMMARY

    @property
    def checkpoint_file(self) -> Path:
        """Path of the checkpoint."""
        return self.path / CHECKPOINT

    @property
    def holds_this_run(self) -> bool:
        """Whether the results that lie in the folder are still those of this run."""
        with suppress(MasterError):
            return identity(self.path) == self.run
        return False

    def write_summary(self, summary: Mapping[str, Any]) -> None:
        """Write ``summary.json``."""
        write_json(self.summary_file, summary)

    def write_geometry(self, geometry: Geometry) -> None:
        """Write ``geometry.json``."""
        write_json(self.path / GEOMETRY, geometry)


@contextmanager
def claimed_for_run(folder: Path, continuation: Continuation | None = None) -> Iterator[RunFolder]:
    """Work alone in a results folder, emptied for a new run; or as it is, for the run that continues in it.

    Parameters
    ----------
    folder : Path
    continuation : Continuation, optional
        Where the run continues from.

    Raises
    ------
    FolderInUseError
        If another process works in it.
    RequestError
        If another run's results lie in it than those of the run to be continued.
    MasterError
        If it exists and is something else, or cannot be written.
    """
    with claimed(folder):
        if continuation is not None and continuation.is_same_run:
            run = identity(folder)
            if not run or run != continuation.checkpoint.run:
                raise RequestError(f"{continuation.file} comes from another run than the results beside it")
        else:
            _empty(folder, None if continuation is None else Path(continuation.file))
            run = uuid.uuid4().hex
        yield RunFolder(folder, run)


@contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Work alone in a results folder of this tool, or a new one; nothing in it is changed yet.

    Raises
    ------
    FolderInUseError
        If another process works in it.
    MasterError
        If it exists and is something else, or cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise MasterError(f"{folder} is a file, not a results folder; choose another with --out")
    if not (is_ours(folder) or _holds_nothing(folder)):
        raise MasterError(f"{folder} {_NOT_OURS.format(kind='not a results folder')}")
    with _alone_in(folder, "results folder"):
        yield


def replaced_run(folder: Path, definitions: Mapping[str, str]) -> str:
    """Return which other run in a results folder a new one replaces, empty if it holds none, or one of the same.

    Parameters
    ----------
    folder : Path
    definitions : mapping
        File that each component's FMU was made from, by the component's name; empty where it does not say.
    """
    components: Any = contents_of(folder / SUMMARY).get("components")
    try:
        before = {str(c["name"]): str(c["definition"]) for c in components}
    except (TypeError, KeyError):
        return ""
    others = [file for name, file in before.items() if file and file != definitions.get(name)]
    if not others:
        return ""
    return f"{folder} held a run with {', '.join(others)}, which this one replaces; --out DIR keeps both"


@contextmanager
def taken_over(folder: Path, marker: str, generator: str, kind: str, scenario: str | None = None) -> Iterator[None]:
    """Work alone in a new folder, or in one whose JSON file ``marker`` names its ``generator``; no results are removed.

    With a ``scenario``, one whose JSON file names another is left alone, too: its table would be replaced.

    Raises
    ------
    FolderInUseError
        If another process works in it.
    MasterError
        If it exists and is no ``kind`` of this tool, or that of another scenario, or cannot be made.
    """
    check_free(folder, marker, generator, kind)
    found = scenario if scenario is None else contents_of(folder / marker).get("scenario", scenario)
    if found != scenario:
        a = "an" if kind[0] in "aeio" else "a"
        raise MasterError(
            f"{folder} holds {a} {kind} of the scenario '{found}', this one is of '{scenario}'; "
            "choose another with --out"
        )
    with _alone_in(folder, "folder"):
        _remove(folder, _PARTS)
        yield


def check_free(folder: Path, marker: str, generator: str, kind: str) -> None:
    """Refuse a folder that `taken_over` would, before long work is done for it; nothing is made.

    Raises
    ------
    MasterError
        If it exists and is no ``kind`` of this tool, or cannot be made or written.
    """
    check_writable(folder)
    if folder.is_dir() and not (made_by(folder / marker, generator) or _holds_nothing(folder)):
        raise MasterError(f"{folder} {_NOT_OURS.format(kind=f'no {kind}')}")


def check_writable(folder: Path) -> None:
    """Refuse a folder that cannot be made or written, before long work is done for it; nothing is made.

    Raises
    ------
    MasterError
    """
    there = next(place for place in (folder, *folder.absolute().parents) if _exists(place))
    if not there.is_dir():
        raise MasterError(f"the folder {folder} cannot be made: {there} is a file; choose another with --out")
    if not os.access(there, os.W_OK | os.X_OK):
        raise MasterError(f"the folder {folder} cannot be written: no permission in {there}; choose another with --out")


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # nobody may look
        return False


def check_place(out: Path | None, default: Path, marker: str, generator: str, kind: str) -> None:
    """Refuse a folder for results before the scenario is opened, whose FMUs may have to be built.

    Parameters
    ----------
    out : Path, optional
        As the user gave it.
    default : Path
        Where the folder, named after the scenario, lies without it.
    marker, generator, kind : str
        As `taken_over` has them.

    Raises
    ------
    MasterError
        As `check_free`.
    """
    if out is None:
        check_writable(default)
    else:
        check_free(out, marker, generator, kind)


@contextmanager
def _alone_in(folder: Path, kind: str) -> Iterator[None]:
    """Make a folder and lock it; remove it again if the command line turns out to be wrong."""
    is_new = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        claim = ExitStack()
        claim.enter_context(folder_lock.claimed(folder))
    except OSError as error:
        text = f"the {kind} {folder} cannot be written ({error.strerror}); choose another with --out"
        raise MasterError(text) from error
    try:
        with claim:
            yield
    except RequestError:
        if is_new:
            with suppress(OSError):  # it is not empty
                folder.rmdir()
        raise


def _empty(folder: Path, keep: Path | None) -> None:
    """Remove the results of an earlier run from a claimed folder; its summary is left for the new one to replace.

    It says from now on that its run is not finished: whoever is killed here leaves a folder of ours without results.

    Parameters
    ----------
    folder : Path
    keep : Path, optional
        The checkpoint that the new run begins from, if it lies there.

    Raises
    ------
    MasterError
        If it cannot be written.
    """
    try:
        if is_ours(folder):
            write_json(folder / SUMMARY, {**contents_of(folder / SUMMARY), "status": "running"})
        _remove(folder, (*_OURS, *_PARTS))
        checkpoint = folder / CHECKPOINT
        if checkpoint.exists() and not (keep is not None and keep.exists() and checkpoint.samefile(keep)):
            checkpoint.unlink()
    except OSError as error:
        raise MasterError(
            f"the results folder {folder} cannot be written ({error.strerror}); choose another with --out"
        ) from error


def _remove(folder: Path, patterns: Sequence[str]) -> None:
    for pattern in patterns:
        for path in folder.glob(pattern):
            path.unlink()


def _holds_nothing(folder: Path) -> bool:
    """Whether a folder does not exist, or holds only what a run that was killed at once has left."""
    if not folder.is_dir():
        return not folder.exists()
    return all(any(path.match(p) for p in (*_PARTS, *_LOCKS, f"{WORK}*")) for path in folder.iterdir())


def is_ours(folder: Path) -> bool:
    """Whether the folder is a results folder of this tool."""
    return made_by(folder / SUMMARY, GENERATOR)


def identity(folder: Path) -> str:
    """Return the identity of the run whose results lie in a folder.

    Raises
    ------
    MasterError
        If it is not a results folder of this tool.
    """
    return str(summary_of(folder).get("run", ""))


def made_by(path: Path, generator: str) -> bool:
    """Whether a JSON file names this ``generator``."""
    return contents_of(path).get("generator") == generator


def contents_of(path: Path) -> dict[str, Any]:
    """Return what a JSON file holds; nothing if it cannot be read or holds something else."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write a JSON file atomically: readers see the old one or the new one, never half of it."""
    write_text(path, json.dumps(_finite(data), indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically."""
    write_atomically(path, text.encode())


def write_forces(folder: Path, signals: Sequence[Signals]) -> None:
    """Write the filtered contact forces that the figures are made of, to the last bit."""
    if not signals:
        return
    titles, columns = force_table(signals)
    formats = [_EXACT if title.endswith(".filtered_force [N]") else NUMBER_FORMAT for title in titles]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(map(safe_cell, titles))
    np.savetxt(text, np.column_stack(columns), fmt=formats, delimiter=",")
    write_text(folder / FORCES, text.getvalue())


def summary_of(folder: Path) -> dict[str, Any]:
    """Return the summary of the run in a folder.

    Raises
    ------
    MasterError
        If it is not a results folder of this tool, or of a newer version.
    """
    if not is_ours(folder):
        text = f"is not a results folder: it has no {SUMMARY} written by this tool; give the folder that a run printed"
        raise MasterError(f"{folder} {text}")
    found = summary_schema.read_summary(folder / SUMMARY)
    if found.get("format", 1) > FORMAT:
        raise MasterError(
            f"{folder / SUMMARY} has format {found['format']}, this version reads up to {FORMAT}; "
            "read it with the newer version that wrote it"
        )
    return found


def _finite(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {str(k): _finite(v) for k, v in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(v) for v in data]
    if isinstance(data, float) and not math.isfinite(data):
        return None
    return data
