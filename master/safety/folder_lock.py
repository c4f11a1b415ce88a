"""Who works in a folder: one process at a time, known by name to those that have to wait.

The lock is the kernel's, on the file `LOCK` in the folder, so it is gone with the process that holds it, however that
ends; the file itself then stays, and means nothing. Who it is stands in a second file, for a locked one cannot be read
everywhere.
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
#: Seconds for which a folder is asked for again: if it is only looked at, or its owner is just dying, it is free soon.
_PATIENCE: Final = 1.0
_POLL: Final = 0.02
#: What a file system says that knows no locks.
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

    Where the file system knows no locks, nobody is kept out: what a run certifies is compared with what it wrote.

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
            if os.path.samestat(
                os.fstat(lock), (folder / LOCK).stat()
            ):  # not another's, in a new folder of the same name
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
    with suppress(OSError):  # a folder of somebody else's: not to be locked, and so not to be known
        os.close(_locked(folder, remedy))


def _locked(folder: Path, remedy: str) -> int:
    """Return a descriptor of the lock's file, locked; closing it gives the lock back."""
    deadline = time.monotonic() + _PATIENCE
    while True:
        lock = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if _is_got(lock, folder / LOCK):
                return lock
        except BaseException:
            os.close(lock)
            raise
        os.close(lock)
        if time.monotonic() > deadline:
            raise FolderInUseError(f"{folder} is in use ({_owner(folder)}); {remedy}")
        time.sleep(_POLL)


def _is_got(lock: int, path: Path) -> bool:
    """Lock a file, and say whether that locks the folder: its owner may just have removed it."""
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
    with suppress(OSError):  # what is missing then is a name in a refusal
        (folder / OWNER).write_text(json.dumps(owner) + "\n", encoding="utf-8")


def _owner(folder: Path) -> str:
    try:
        found = json.loads((folder / OWNER).read_text(encoding="utf-8"))
        owner = Owner(int(found["process"]), str(found["computer"]), str(found["since"]))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return "by a process that has not left its name"
    return one_line(str(owner))


def _key(folder: Path) -> _Key:
    return os.getpid(), threading.get_ident(), str(folder.resolve())
