"""The user's folder for what can be computed again, and arrays kept there by the hash of what they follow from.

What is kept decides neither whether a run works nor what it gives: a file that is missing, damaged, of another user or
cannot be written is passed over in silence, and computed again. The folder stays below a size; what was not used for
longest goes first. ``OPENPANTO_CACHE=off`` reads and writes nothing.
"""

from __future__ import annotations

import hashlib
import io
import os
import stat
import sys
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final

import numpy as np

from models.arrays import Snapshot

#: Environment variable that leaves the cache out.
SWITCH: Final = "OPENPANTO_CACHE"
#: First bytes of a file; the digit is the version of the layout: this, a SHA-256, and numpy's archive of arrays.
_MAGIC: Final = b"openpanto kept 1\n"
_DIGEST: Final = hashlib.sha256().digest_size
#: What all kept arrays, and those of one file, may take [bytes].
_MOST: Final = 1 << 27
_LARGEST: Final = 1 << 24


def cache_folder() -> Path:
    """Return the folder for data of this user's programs that can be regenerated.

    A relative XDG_CACHE_HOME is to be ignored (XDG Base Directory Specification).
    """
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", "~")).expanduser()
    chosen = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return chosen if chosen.is_absolute() else Path("~/.cache").expanduser()


def check_owner(folder: Path) -> None:
    """Reject a folder to which somebody else can write; one that does not exist yet is accepted.

    Raises
    ------
    PermissionError
        If it belongs to another user, or its mode lets others write. On Windows a user's folders are private.
    """
    if sys.platform == "win32":
        return
    try:
        found = folder.stat()
    except FileNotFoundError:
        return
    if found.st_uid != os.geteuid():
        raise PermissionError(f"{folder} belongs to another user")
    if stat.S_IMODE(found.st_mode) & (stat.S_IWGRP | stat.S_IWOTH):
        raise PermissionError(f"{folder} can be written by others; chmod go-w it")


def kept_arrays(key: str) -> Snapshot | None:
    """Return the arrays kept under a key, None if there are none that can be used."""
    if os.environ.get(SWITCH) == "off":
        return None
    try:
        file = _folder() / f"{key}.kept"
        data = file.read_bytes()
        content = memoryview(data)[len(_MAGIC) + _DIGEST :]
        if data[: -len(content)] != _MAGIC + hashlib.sha256(content).digest():
            return None
        with np.load(io.BytesIO(content)) as arrays:
            found = dict(arrays)
    except (OSError, EOFError, ValueError, KeyError, RuntimeError, zipfile.BadZipFile):  # RuntimeError: without a home
        return None
    with suppress(OSError):
        os.utime(file)  # used just now
    return found


def keep_arrays(key: str, arrays: Mapping[str, np.ndarray]) -> None:
    """Keep arrays under a key, a file's name, if that is possible."""
    if os.environ.get(SWITCH) == "off":
        return
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    content = buffer.getvalue()
    if len(content) > _LARGEST:
        return
    with suppress(OSError, RuntimeError):
        folder = _folder()
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        part = folder / f"{key}.{os.getpid()}.part"
        try:
            part.write_bytes(_MAGIC + hashlib.sha256(content).digest() + content)
            part.replace(folder / f"{key}.kept")
        finally:
            part.unlink(missing_ok=True)
        _make_room(folder)


def _folder() -> Path:
    """Return where arrays are kept.

    Raises
    ------
    OSError, RuntimeError
        If others may write there, or the user has no home.
    """
    home = cache_folder() / "openpanto"
    for folder in (home, home / "kept"):
        check_owner(folder)
    return home / "kept"


def _make_room(folder: Path) -> None:
    """Delete what was not used for longest, until the rest is within bounds; unfinished files with it."""
    with os.scandir(folder) as entries:  # not as paths: their names would stay in the process
        files = sorted(
            ((s.st_mtime, s.st_size, entry.path) for entry in entries if (s := _status(entry))), reverse=True
        )
    total = 0
    for _, size, path in files:
        total += size
        if total > _MOST:
            Path(path).unlink(missing_ok=True)


def _status(entry: os.DirEntry[str]) -> os.stat_result | None:
    """Return size and age of a file, None if another process has deleted it meanwhile."""
    try:
        return entry.stat()
    except FileNotFoundError:
        return None
