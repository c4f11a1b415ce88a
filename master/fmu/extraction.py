"""Extracted FMUs: a folder serves one instance at a time, and the next one again where that saves memory.

Some libraries stay in the process for ever, even when freed: C++ with unique symbols, and so every FMU made with
pythonfmu. From one folder such a library is loaded once; extracted to a new folder for every instance, a thousand
instances would keep a thousand copies of it. Other libraries are unloaded, and their folders removed.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import shutil
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import Final

import fmpy

from master.system.components import Fmu

_Key = tuple[str, int, int, int]
#: Folders that no instance uses now, by the FMU extracted there.
_idle: Final[defaultdict[_Key, list[str]]] = defaultdict(list)


class ExtractedFmu:
    """An extracted FMU, for one instance.

    Parameters
    ----------
    fmu : Fmu

    Attributes
    ----------
    folder : str
    """

    def __init__(self, fmu: Fmu) -> None:
        self._key = _key(fmu.path)
        self._platform = f"binaries/{fmpy.platform}/{fmu.identifier}{fmpy.sharedLibraryExtension}"
        self._is_released = False
        idle = _idle[self._key]
        self.folder = idle.pop() if idle else _extracted(fmu.path)

    def release(self) -> None:
        """Keep the folder for the next instance if the library, freed, is still loaded; remove it otherwise."""
        if not self._is_released and _is_loaded(Path(self.folder) / self._platform):
            _idle[self._key].append(self.folder)
            self._is_released = True
        self.remove()

    def remove(self) -> None:
        """Remove the folder, unless it is kept for the next instance."""
        if not self._is_released:
            self._is_released = True
            shutil.rmtree(self.folder, ignore_errors=True)


def _key(path: Path) -> _Key:
    stat = path.stat()
    return str(path.resolve()), stat.st_ino, stat.st_size, stat.st_mtime_ns


def _extracted(path: Path) -> str:
    folder = tempfile.mkdtemp(prefix="fmu-")
    try:
        fmpy.extract(str(path), unzipdir=folder)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return folder


def _is_loaded(library: Path) -> bool:
    mode = getattr(os, "RTLD_NOLOAD", None)
    if mode is None:
        return False
    try:
        fmpy.freeLibrary(ctypes.CDLL(str(library), mode=mode)._handle)
    except OSError:
        return False
    return True


@atexit.register
def _remove_all() -> None:
    for folders in _idle.values():
        for folder in folders:
            shutil.rmtree(folder, ignore_errors=True)
