"""A lock on a folder: one process at a time works in it, known by name to those that have to wait.

The lock is the kernel's, on the file `LOCK` in the folder, so it ends with the process that holds it, however that
ends; the file itself may then stay, and means nothing. The owner's name is in a second file, because a locked file
cannot be read on every system.
"""

from __future__ import annotations

import errno
import json
import os
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final

from filelock import lock_descriptor

from master.errors import MasterError, one_line

LOCK: Final = ".lock"
OWNER: Final = ".owner.json"
#: Seconds for which a claim is tried again: a folder that is only checked, or whose owner is ending, is free soon.
_PATIENCE: Final = 1.0
_POLL: Final = 0.02
#: Errors of a file system without locks.
_NO_LOCKS: Final = tuple(getattr(errno, n) for n in ("ENOSYS", "ENOTSUP", "EOPNOTSUPP", "ENOLCK") if hasattr(errno, n))

#: How often this process, and which thread of it, has claimed a folder; a forked child has claimed none.
_Key = tuple[int, int, str]
_held: Final[dict[_Key, int]] = {}


class FolderInUseError(MasterError):
    """A folder that another process works in."""


@dataclass(frozen=True)
class Owner:
    """Who works in a folder: process, computer, and since when."""

    process: int
    computer: str
    since: str

    def __str__(self) -> str:
        return f"process {self.process} on {self.computer}, since {self.since}"


@contextmanager
def claimed(folder: Path, remedy: str = "choose another with --out") -> Iterator[None]:
    """Work alone in a folder that exists; the same thread may claim it several times.

    A file system without locks keeps nobody out; so a run compares its files with what it wrote before it vouches for
    them.

    Parameters
    ----------
    folder : Path
    remedy : str
        What to do instead of waiting.

    Raises
    ------
    FolderInUseError
        Naming the process that works in it.
    OSError
        If the lock's file cannot be made.
    """
    key = _key(folder)
    if key in _held:
        _held[key] += 1
        try:
            yield
        finally:
            _held[key] -= 1
        return
    lock = _locked(folder, remedy)
    try:
        _held[key] = 1
        _sign(folder)
        yield
    finally:
        del _held[key]
        with suppress(OSError):  # the folder is gone, or (Windows) the file is open
            # Not the lock of another process in a new folder of the same name.
            if os.path.samestat(os.fstat(lock), (folder / LOCK).stat()):
                (folder / OWNER).unlink()
                (folder / LOCK).unlink()
        os.close(lock)


def check_free(folder: Path, remedy: str = "wait for it to end") -> None:
    """Refuse a folder that another process works in.

    Raises
    ------
    FolderInUseError
        Naming that process.
    """
    if _key(folder) in _held or not (folder / LOCK).is_file():
        return
    with suppress(OSError):  # a folder of another user: it cannot be locked, so nothing is known of it
        os.close(_locked(folder, remedy))


def _locked(folder: Path, remedy: str) -> int:
    """Return a descriptor of the lock's file, locked; closing it releases the lock."""
    deadline = time.monotonic() + _PATIENCE
    while True:
        lock = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if _is_acquired(lock, folder / LOCK):
                return lock
        except BaseException:
            os.close(lock)
            raise
        os.close(lock)
        if time.monotonic() > deadline:
            raise FolderInUseError(f"{folder} is in use ({_owner(folder)}); {remedy}")
        time.sleep(_POLL)


def _is_acquired(lock: int, path: Path) -> bool:
    """Lock a file and return whether that locks the folder: its owner may just have removed the file."""
    try:
        if not lock_descriptor(lock, blocking=False):
            return False
    except OSError as error:
        if error.errno in _NO_LOCKS:
            return True
        raise
    try:
        return os.path.samestat(os.fstat(lock), path.stat())
    except FileNotFoundError:
        return False


def _sign(folder: Path) -> None:
    owner = {
        "process": os.getpid(),
        "computer": socket.gethostname(),
        "since": datetime.now().astimezone().isoformat(" ", "seconds"),
    }
    with suppress(OSError):  # without it, a refusal cannot name the owner
        (folder / OWNER).write_text(json.dumps(owner) + "\n", encoding="utf-8")


def _owner(folder: Path) -> str:
    try:
        found = json.loads((folder / OWNER).read_text(encoding="utf-8"))
        owner = Owner(int(found["process"]), str(found["computer"]), str(found["since"]))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return "by a process that left no name"
    return one_line(str(owner))


def _key(folder: Path) -> _Key:
    return os.getpid(), threading.get_ident(), str(folder.resolve())
