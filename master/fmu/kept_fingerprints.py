"""Fingerprints that ``python -m fmus`` has said, kept in the user's cache while what they depend on is the same.

Asking starts a Python for every FMU of every run. With its answer the builder names what it depends on: files, and
folders with all that is below them. An answer is kept with their sizes and times (of content and of status, which no
program sets back) and is valid while these are the same. What was changed while it was asked for, or just before, could
change again within the same tick of the clock, and is not kept. A cache that is missing, damaged, of another user, or
cannot be written is passed over in silence; ``OPENPANTO_CACHE=off`` does without.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

#: Environment variable that leaves the cache out.
SWITCH: Final = "OPENPANTO_CACHE"
#: Answers that are kept at most.
_MOST: Final = 200
#: How long before the question the last change must lie, for file systems that keep times coarsely [s].
_SETTLED: Final = 2.5
#: The layout of a file.
_VERSION: Final = 1


@dataclass(frozen=True)
class Answer:
    """What the builder said: the fingerprint, None for a name that it does not know, and its notes."""

    fingerprint: str | None
    notes: tuple[str, ...] = ()


def kept_answer(question: Sequence[str]) -> Answer | None:
    """Return the answer to a question, None if it is not kept or may have changed."""
    try:
        content, checksum = _file(question).read_text(encoding="utf-8").rsplit("\n", 1)
        if hashlib.sha256(content.encode()).hexdigest() != checksum:
            return None
        kept: dict[str, Any] = json.loads(content)
        if kept["version"] != _VERSION or kept["question"] != list(question):
            return None
        if any(_state(Path(place))[0] != state for place, state in kept["watched"].items()):
            return None
        return Answer(kept["fingerprint"], tuple(kept["notes"]))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RuntimeError):
        return None


def keep_answer(question: Sequence[str], answer: Answer, watched: Sequence[str], asked: float) -> None:
    """Keep an answer, if that is possible and nothing that it depends on has changed lately.

    Parameters
    ----------
    question : sequence of str
        All that the answer may depend on but files.
    answer : Answer
    watched : sequence of str
        The files and folders; with none, nothing is kept.
    asked : float
        When the question was asked [s since the epoch].
    """
    try:
        states = {place: _state(Path(place)) for place in watched}
        if not states or max(changed for _, changed in states.values()) > asked - _SETTLED:
            return
        content = json.dumps(
            {
                "version": _VERSION,
                "question": list(question),
                "fingerprint": answer.fingerprint,
                "notes": answer.notes,
                "watched": {place: state for place, (state, _) in states.items()},
            }
        )
        file = _file(question)
        file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        part = file.with_suffix(f".{os.getpid()}.part")
        try:
            part.write_text(f"{content}\n{hashlib.sha256(content.encode()).hexdigest()}", encoding="utf-8")
            part.replace(file)
        finally:
            part.unlink(missing_ok=True)
        _make_room(file.parent)
    except (OSError, RuntimeError):
        return


def _file(question: Sequence[str]) -> Path:
    """Return where the answer to a question is kept.

    Raises
    ------
    OSError, RuntimeError
        If there is to be none, others may write there, or the user has no home.
    """
    if os.environ.get(SWITCH) == "off":
        raise FileNotFoundError(SWITCH)
    chosen = Path(os.environ.get("XDG_CACHE_HOME", ""))
    home = (chosen if chosen.is_absolute() else Path.home() / ".cache") / "openpanto"
    for folder in (home, home / "fingerprints"):
        _check_owner(folder)
    return home / "fingerprints" / f"{hashlib.sha256(json.dumps(list(question)).encode()).hexdigest()}.json"


def _check_owner(folder: Path) -> None:
    with suppress(FileNotFoundError):
        found = folder.stat()
        is_shared = bool(stat.S_IMODE(found.st_mode) & (stat.S_IWGRP | stat.S_IWOTH))
        if sys.platform != "win32" and (found.st_uid != os.geteuid() or is_shared):
            raise PermissionError(f"{folder} can be written by others")


def _state(place: Path) -> tuple[str, float]:
    """Return a hash of sizes and times of a file, or of all files below a folder, and when the last change was [s]."""
    whole, last = hashlib.sha256(), 0.0
    for path in _files(place):
        try:
            found = path.stat()
        except (FileNotFoundError, NotADirectoryError):
            whole.update(f"{path}\0missing\0".encode(errors="surrogateescape"))
            continue
        times = (found.st_mtime_ns, found.st_ctime_ns)
        last = max(last, *(1e-9 * time for time in times))
        if not stat.S_ISDIR(found.st_mode):  # what lies in a folder is listed; that it was touched says nothing
            text = f"{path}\0{found.st_size}\0{found.st_ino}\0{times}\0"
            whole.update(text.encode(errors="surrogateescape"))
    return whole.hexdigest(), last


def _files(place: Path) -> Iterator[Path]:
    """Yield a place and, if it is a folder, every file below it, in a fixed order, without compiled code."""
    yield place
    for folder, folders, files in os.walk(place):
        folders[:] = sorted(name for name in folders if name != "__pycache__")
        for name in sorted(files):
            yield Path(folder, name)


def _make_room(folder: Path) -> None:
    """Delete the oldest answers, until as many are left as may be."""
    by_age = sorted(folder.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
    for path in by_age[_MOST:]:
        path.unlink(missing_ok=True)
