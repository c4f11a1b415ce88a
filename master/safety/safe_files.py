"""Files that outlive the process that writes them: whole files or none, whole lines or none."""

from __future__ import annotations

import errno
import os
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from master.errors import MasterError

#: How the name of a file ends while it is written.
PART: Final = ".part"
#: What to choose instead, for most of our files.
_ELSEWHERE: Final = "another folder with --out"
#: How a cell begins that a spreadsheet would compute, after any quotes that prevent it.
_FORMULA: Final = re.compile(r"'*[=+\-@\t\r]")
#: Bytes that are read at once.
_PIECE: Final = 1 << 20
_NO_ROOM: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def write_atomically(path: Path, data: bytes, elsewhere: str = _ELSEWHERE) -> None:
    """Write a file in one go: readers see the old one or the new one, never half of it, whatever happens.

    Raises
    ------
    MasterError
        If it cannot be written; the old one is still there then.
    """
    with atomic_file(path, elsewhere) as temporary, temporary.open("wb") as file:
        file.write(data)


@contextmanager
def atomic_file(path: Path, elsewhere: str = _ELSEWHERE) -> Iterator[Path]:
    """Yield a file to write next to ``path``, which replaces it once complete and on the disk.

    For code that writes by a file's name; `write_atomically` takes bytes. The message of a failure names
    ``elsewhere`` as what to choose instead.

    Raises
    ------
    MasterError
        If it cannot be written; the old one is still there then.
    """
    if path.is_dir():
        raise MasterError(f"{path} is a folder; choose {elsewhere}")
    # A device, such as /dev/null, would be replaced by a file for all users of the computer.
    if path.exists() and not path.is_file():
        raise MasterError(f"{path} is not a file and is left alone; choose {elsewhere}")
    # Hidden, so that no archive includes it; one per process, so that two writers do not mix.
    temporary = path.with_name(f".{path.name}.{os.getpid()}{PART}")
    try:
        yield temporary
        _sync(temporary)
        temporary.replace(path)
        _sync(path.parent)
    except BaseException as error:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise cannot_write(path, error, elsewhere) from error
        raise


def cannot_write(path: Path, error: OSError, elsewhere: str = _ELSEWHERE) -> MasterError:
    """Return the error that says which file cannot be written, why, and what to do."""
    remedy = "make room there, or choose" if error.errno in _NO_ROOM else "choose"
    return MasterError(f"{path} cannot be written ({error.strerror or error}); {remedy} {elsewhere}")


def _sync(path: Path) -> None:
    """Wait until a file or a folder's entries are on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def safe_cell(text: str) -> str:
    """Return text for a cell of a table that no spreadsheet takes for a formula; `plain_cell` undoes it.

    Examples
    --------
    >>> safe_cell("=cmd|'/C calc'!A0"), safe_cell("31 m"), plain_cell(safe_cell("'=1"))
    ("'=cmd|'/C calc'!A0", '31 m', "'=1")
    """
    return f"'{text}" if _FORMULA.match(text) else text


def plain_cell(cell: str) -> str:
    """Return the text that `safe_cell` was given."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


class AppendOnlyFile:
    """A text file that grows by whole lines, each batch handed to the system in one call.

    Nothing waits in the process after a call has returned, so a process that is killed leaves what it has written;
    on a full disk the lines that still fit are kept and an incomplete one is removed.

    Parameters
    ----------
    path : Path
        The file.
    keep : int, optional
        Bytes of an existing file to keep and to append to; 0 for a new file.

    Raises
    ------
    MasterError
        If it cannot be written.
    """

    def __init__(self, path: Path, keep: int = 0) -> None:
        self.path = path
        self._size = keep
        self._sum = 0
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666)
            os.ftruncate(self._file, keep)
            if keep:
                self._sum = _check_sum(path)
            os.lseek(self._file, keep, os.SEEK_SET)
        except OSError as error:
            raise cannot_write(path, error) from error
        self.is_open = True

    def write(self, lines: bytes) -> None:
        """Write lines, each with its end."""
        done = 0
        try:
            while done < len(lines):
                done += os.write(self._file, lines[done:])
        except OSError as error:
            self._cut(lines[:done])
            raise cannot_write(self.path, error) from error
        self._count(lines)

    @property
    def is_as_written(self) -> bool:
        """Whether the file of this name holds what was kept and written here, and nothing else."""
        try:
            return self.path.stat().st_size == self._size and _check_sum(self.path) == self._sum
        except OSError:
            return False

    def sync(self) -> None:
        """Wait until what was written is on the disk."""
        try:
            os.fsync(self._file)
        except OSError as error:
            raise cannot_write(self.path, error) from error

    def close(self) -> None:
        """Close the file; a second call does nothing."""
        if self.is_open:
            self.is_open = False
            os.close(self._file)

    def _cut(self, written: bytes) -> None:
        self._count(written[: written.rfind(b"\n") + 1])
        os.ftruncate(self._file, self._size)
        os.lseek(self._file, self._size, os.SEEK_SET)

    def _count(self, written: bytes) -> None:
        self._size += len(written)
        self._sum = zlib.crc32(written, self._sum)


def _check_sum(path: Path) -> int:
    found = 0
    with path.open("rb") as file:
        while piece := file.read(_PIECE):
            found = zlib.crc32(piece, found)
    return found
