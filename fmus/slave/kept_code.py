"""The sources of an FMU, compiled once on a machine: Python keeps what it compiled beside a source, and every run
unpacks the sources to a new place.

What Python compiled is kept in the user's folder (`models.numerics.user_cache`), one file for all modules of an FMU,
and is used where the source is as it was. It is run, like the compiled kernels: a folder that others may write to is
not read. Where nothing is kept, and where Python is to write no bytecode (``PYTHONDONTWRITEBYTECODE``), modules are
compiled as ever.
"""

from __future__ import annotations

import marshal
import os
import sys
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from importlib.machinery import SOURCE_SUFFIXES, FileFinder, SourceFileLoader
from typing import Any, Final

import numpy as np

from models.numerics.user_cache import keep_arrays, kept_arrays

#: What ends the name of a file that Python keeps.
_COMPILED: Final = ".pyc"


@contextmanager
def kept_code(package: str) -> Iterator[None]:
    """Import modules of a package, which has been imported itself, as they were compiled before; keep what is new.

    Parameters
    ----------
    package : str
        Its name holds the hash of its content.
    """
    [root] = sys.modules[package].__path__
    compiled = _Compiled(f"{package}-{sys.implementation.cache_tag}", root)
    folders = [folder for folder, _, _ in os.walk(root)]
    loader: Any = partial(_Loader, compiled=compiled)
    for folder in folders:
        sys.path_importer_cache[folder] = FileFinder(folder, (loader, SOURCE_SUFFIXES))
    try:
        yield
        compiled.keep()
    finally:
        for folder in folders:
            sys.path_importer_cache.pop(folder, None)
        compiled.forget()


class _Compiled:
    """What Python keeps of the modules below a folder: path from there -> content of the file.

    Parameters
    ----------
    key : str
        Under which it is kept.
    root : str
    """

    def __init__(self, key: str, root: str) -> None:
        self._key, self._root = key, root
        self._files: dict[str, bytes] | None = None
        self._is_new = False

    def read(self, path: str) -> bytes:
        """Return the content of a file; raises ``FileNotFoundError`` if it is not kept."""
        if self._files is None:
            self._files = self._kept()
        try:
            return self._files[self._name(path)]
        except KeyError as error:
            raise FileNotFoundError(path) from error

    def write(self, path: str, content: bytes) -> None:
        """Take the content of a file."""
        if self._files is not None:
            self._files[self._name(path)] = content
            self._is_new = True

    def keep(self) -> None:
        """Keep everything, if some of it is new."""
        if self._is_new:
            keep_arrays(self._key, {"compiled": np.frombuffer(marshal.dumps(self._files), dtype=np.uint8)})

    def forget(self) -> None:
        """Give the memory back: modules refer to this through their loaders as long as they live."""
        self._files = {}

    def _kept(self) -> dict[str, bytes]:
        try:
            return dict(marshal.loads((kept_arrays(self._key) or {})["compiled"].tobytes()))
        except (EOFError, KeyError, TypeError, ValueError):
            return {}

    def _name(self, path: str) -> str:
        return path.removeprefix(self._root)


class _Loader(SourceFileLoader):
    """Loads a module; knows a source by its content, not by when it was unpacked."""

    def __init__(self, fullname: str, path: str, compiled: _Compiled) -> None:
        super().__init__(fullname, path)
        self._compiled = compiled

    def path_stats(self, path: str) -> dict[str, Any]:
        """Return size of a source, and a checksum for its time: a compiled module is used if it states the same."""
        source = self.get_data(path)
        return {"mtime": zlib.crc32(source), "size": len(source)}

    def get_data(self, path: str) -> bytes:
        """Return the content of a file."""
        return self._compiled.read(path) if path.endswith(_COMPILED) else super().get_data(path)

    def set_data(self, path: str, data: Any, *, _mode: int = 0o666) -> None:
        """Keep a compiled module."""
        self._compiled.write(path, bytes(data))
