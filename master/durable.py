"""Files that outlive the process that writes them: whole files or none, whole lines or none."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Final

from master.errors import MasterError

#: What a file that is being written is called.
PART: Final = ".part"
_NO_ROOM: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def write_whole(path: Path, data: bytes) -> None:
    """Write a file in one go: readers see the old one or the new one, never half of it, whatever happens.

    Raises
    ------
    MasterError
        If it cannot be written; the old one is still there then.
    """
    # Hidden, so that no archive takes it along, and each process has its own: two writers do not mix.
    temporary = path.with_name(f".{path.name}.{os.getpid()}{PART}")
    try:
        with temporary.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
        _sync_folder(path.parent)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise cannot_write(path, error) from error


def cannot_write(path: Path, error: OSError) -> MasterError:
    """Return the error that tells the user which file cannot be written, why, and what to do."""
    remedy = "make room there, or choose" if error.errno in _NO_ROOM else "choose"
    return MasterError(f"{path} cannot be written ({error.strerror or error}); {remedy} another folder with --out")


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


class LineFile:
    """A text file that grows by whole lines, handed to the system in one call each time.

    Nothing waits in the process after a call has returned, so a process that is killed leaves what it has written;
    where the disk is full, the lines that still fit are kept and the rest of a line is taken away.

    Parameters
    ----------
    path : Path
        The file.
    keep : int, optional
        Bytes of an existing file to keep and to go on after; 0 for a new file.

    Raises
    ------
    MasterError
        If it cannot be written.
    """

    def __init__(self, path: Path, keep: int = 0) -> None:
        self.path = path
        self._size = keep
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o666)
            os.ftruncate(self._file, keep)
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
        self._size += done

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
        self._size += written.rfind(b"\n") + 1
        os.ftruncate(self._file, self._size)
        os.lseek(self._file, self._size, os.SEEK_SET)
