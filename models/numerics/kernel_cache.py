"""Compiled kernels, and the folder in which their machine code is kept between runs.

numba stores what it compiles as pickles beside the source. Loading a pickle executes it, and a damaged one ends the
run, so the cache must neither be trusted blindly nor decide whether a run works:

- a folder that does not belong to this user, or that others may write to, is not read;
- every file carries a checksum, and one that does not match is compiled again and replaced;
- where nothing can be stored (no home, no space, no permission) the kernels are compiled into a temporary folder of
  this process, or kept in memory only.

In each case one warning names the folder, through `logging`; results are the same with and without a cache. That
kernels are compiled, which takes long, is said there too, at the level INFO: commands show it, other hosts need not.

Of kernels of one name, as many versions are kept as were used last (`_MOST_VERSIONS`), a few megabytes each.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import gc
import hashlib
import importlib.util
import logging
import os
import pickle
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from models.numerics.user_cache import cache_folder, check_owner

#: Environment variable that chooses between compiled kernels and NumPy.
SWITCH: Final = "OPENPANTO_KERNEL"
#: An import of other kernels of the project, on one line or in brackets; inside an FMU ``models`` lies in its package.
_FROM_PROJECT: Final = re.compile(
    rb"^from (?:openpanto_\w+\.)?models\.[\w.]+_kernels import (?:\([^)]*\)|[^(\n]*)$", re.MULTILINE
)
_LOG: Final = logging.getLogger("openpanto")
_COMPILING: Final = "compiling kernels that were not used before, once for each user and version: up to half a minute"
#: The end of a folder's name.
_VERSION: Final = re.compile(r"\w+-[0-9a-f]{16}")
#: Length of the checksum before the content of a file [bytes].
_DIGEST: Final = hashlib.sha256().digest_size
#: Warnings and notes given in this process.
_named: set[str] = set()
#: How many versions of kernels of one name are kept: every release, working tree and Python has its own.
_MOST_VERSIONS: Final = 24


class KernelError(RuntimeError):
    """Compiled kernels were requested and are not available."""


def joined(files: Iterable[Path]) -> bytes:
    """Return the source of kernels that are kept in several files, without the lines by which these import each other.

    Parameters
    ----------
    files : iterable of Path
        Each after those that it imports; no two may define the same name, unless for the same.
    """
    return b"\n".join(_FROM_PROJECT.sub(b"", path.read_bytes()) for path in files)


def load_kernels(name: str, source: bytes) -> ModuleType:
    """Return a module of numba kernels, made from ``source`` on first use in a process.

    FMUs are unpacked to a new place every time, and numba identifies its files by the path of the source, so the module
    is loaded from a copy in the user's cache, named by its content.

    Parameters
    ----------
    name : str
        Name of the kernels, letters and underscores.
    source : bytes
        A Python module that imports nothing from the project.

    Raises
    ------
    ImportError
        If numba is not installed, or no folder can hold the source.
    """
    if importlib.util.find_spec("numba") is None:
        raise ImportError("numba is not installed; pip install numba")
    key = _key(source)
    module_name = f"openpanto_{name}_{key}"
    found = sys.modules.get(module_name)
    return _load(module_name, _kept_source(source, f"{name}-{key}")) if found is None else found


@functools.cache
def _key(source: bytes) -> str:
    return hashlib.sha256(source + sys.version.encode()).hexdigest()[:16]


def wanted_kernels() -> str:
    """Return what the environment asks for: auto, numpy or numba; raises ``KernelError`` if it is something else."""
    wanted = os.environ.get(SWITCH, "auto")
    if wanted not in ("auto", "numpy", "numba"):
        raise KernelError(f"{SWITCH} is '{wanted}'; use auto, numpy or numba")
    return wanted


def kernels_if_wanted(name: str, source: bytes) -> ModuleType | None:
    """Return kernels as `load_kernels` does, None if there are none or `SWITCH` says to do without.

    Raises
    ------
    KernelError
        If the environment asks for kernels that cannot be had, or for ones that do not exist.
    """
    wanted = wanted_kernels()
    if wanted == "numpy":
        return None
    try:
        return load_kernels(name, source)
    except ImportError as error:
        if wanted == "numba":
            raise KernelError(f"{SWITCH} is 'numba', but {error}") from error
        return None


def _load(name: str, path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    _guard(module, path.parent)
    sys.modules[name] = module
    return module


def _kept_source(source: bytes, folder: str) -> Path:
    """Return a copy of the source in the user's cache, or in a folder that is deleted with this process.

    Raises
    ------
    ImportError
        If neither can be written to.
    """
    try:
        home = cache_folder()
        copy = home / "openpanto" / folder / "kernels.py"
        copy.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        for place in (home / "openpanto", copy.parent, copy.parent / "__pycache__"):
            check_owner(place)
        if _write(copy, source):
            _make_room(home / "openpanto", copy.parent)
        os.utime(copy.parent)  # used just now; the time of the source is numba's
    except (OSError, RuntimeError) as error:  # RuntimeError: a user without a home
        _warn(f"compiled kernels are not kept, and have to be compiled in every run: {error}")
    else:
        return copy
    try:
        temporary = tempfile.mkdtemp(prefix="openpanto-")
        atexit.register(shutil.rmtree, temporary, ignore_errors=True)
        copy = Path(temporary) / "kernels.py"
        _write(copy, source)
    except OSError as error:
        raise ImportError(f"no folder can hold what the kernels are compiled from: {error}") from error
    return copy


def _make_room(home: Path, own: Path) -> None:
    """Delete the versions of kernels of a name that were not used for longest, until few enough are left."""
    name = own.name.rpartition("-")[0]
    with contextlib.suppress(OSError):  # another process makes room, too
        others = [folder for folder in home.glob(f"{name}-*") if folder != own and _VERSION.fullmatch(folder.name)]
        by_use = sorted(others, key=lambda folder: folder.stat().st_mtime, reverse=True)
        for folder in by_use[_MOST_VERSIONS - 1 :]:
            shutil.rmtree(folder, ignore_errors=True)


def _write(copy: Path, source: bytes) -> bool:
    """Write the source to the place it is compiled from, unless it is already there; return whether it was not."""
    if copy.is_file() and copy.read_bytes() == source:
        return False
    part = copy.with_name(f"{copy.name}.{os.getpid()}.part")
    try:
        part.write_bytes(source)
        part.replace(copy)
    except OSError:
        part.unlink(missing_ok=True)
        raise
    return True


def _warn(text: str) -> None:
    """Log a warning once per process."""
    if text not in _named:
        _named.add(text)
        _LOG.warning("warning: %s", text)


def _guard(module: ModuleType, folder: Path) -> None:
    """Make every kernel of a module store its machine code in checked files, and compile undisturbed."""
    for kernel in vars(module).values():
        cache = getattr(kernel, "_cache", None)
        if hasattr(kernel, "py_func") and hasattr(cache, "_cache_file"):
            kernel._cache = _GuardedCache(cache, folder)
            kernel.compile = _undisturbed(kernel.compile)
            _leave_out_if_foreign(cache)


def _undisturbed(compile_for: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return what compiles a kernel for a signature, Python looking for no garbage meanwhile: a sixth of the time.

    Nearly all that numba makes is needed to the end, and is looked through again and again.
    """

    @functools.wraps(compile_for)
    def compiled(signature: Any) -> Any:
        if not gc.isenabled():
            return compile_for(signature)
        gc.disable()
        try:
            return compile_for(signature)
        finally:
            gc.enable()

    return compiled


def _leave_out_if_foreign(cache: Any) -> None:
    """Disable a cache where others may write; numba has further places, and an environment variable for more."""
    try:
        check_owner(Path(cache.cache_path))
    except OSError as error:
        _warn(f"compiled kernels are not kept, and have to be compiled in every run: {error}")
        cache.disable()


class _GuardedCache:
    """The cache of a numba kernel, whose failures cost time but never a run.

    Parameters
    ----------
    cache : numba cache
        The cache that does the work.
    folder : Path
        Folder to name in warnings.
    """

    def __init__(self, cache: Any, folder: Path) -> None:
        self._cache = cache
        self._folder = folder
        cache._cache_file = _checked_files(cache._cache_file)

    @property
    def cache_path(self) -> Any:
        """Return where the files are."""
        return self._cache.cache_path

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the stored code for a signature, None if there is none that can be used."""
        try:
            with _without_declarations(target_context):
                found = self._cache.load_overload(sig, target_context)
        except Exception as error:  # whatever a damaged file may raise
            _warn(f"compiled kernels in {self._folder} are damaged and are compiled afresh ({error})")
            with contextlib.suppress(Exception):
                self._cache.flush()
            found = None
        if found is None and _COMPILING not in _named:
            _named.add(_COMPILING)
            _LOG.info(_COMPILING)
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store compiled code, if possible."""
        try:
            self._cache.save_overload(sig, data)
        except Exception as error:  # a full disk, say
            _warn(f"compiled kernels cannot be kept in {self._folder}: {error}")

    def enable(self) -> None:
        """Start using the cache."""
        self._cache.enable()

    def disable(self) -> None:
        """Stop using the cache."""
        self._cache.disable()

    def flush(self) -> None:
        """Discard what is stored."""
        self._cache.flush()


@contextlib.contextmanager
def _without_declarations(target_context: Any) -> Iterator[None]:
    """Spare numba what it prepares before it loads machine code: all that it can compile, a tenth of a second.

    Code that is loaded needs numba's memory management alone; whatever has to be compiled after all prepares the rest.
    """
    runtime = getattr(sys.modules.get("numba.core.runtime"), "rtsys", None)
    if runtime is None:  # another numba, which had better go its own way
        yield
        return
    runtime.initialize(target_context)
    target_context.refresh = lambda: None
    try:
        yield
    finally:
        del target_context.refresh


def _checked_files(files: Any) -> Any:
    """Return numba's files of a kernel, each preceded by the checksum of its content.

    Files in numba's format are left alone: they have different names and are not read.
    """
    base: Any = type(files)

    class CheckedFiles(base):  # type: ignore[misc]
        def _load_index(self) -> Any:
            try:
                version, stamp, overloads = pickle.loads(_checked(Path(self._index_path)))
            except FileNotFoundError:
                return {}
            return overloads if (version, stamp) == (self._version, self._source_stamp) else {}

        def _save_index(self, overloads: Any) -> None:
            content = self._dump((self._version, self._source_stamp, overloads))
            with self._open_for_write(self._index_path) as file:
                file.write(_with_checksum(content))

        def _load_data(self, name: str) -> Any:
            return pickle.loads(_checked(Path(self._data_path(name))))

        def _save_data(self, name: str, data: Any) -> None:
            with self._open_for_write(self._data_path(name)) as file:
                file.write(_with_checksum(self._dump(data)))

    checked = CheckedFiles.__new__(CheckedFiles)
    checked.__dict__.update(vars(files))
    checked._index_path = f"{files._index_path}.sum"
    checked._data_name_pattern = f"{files._data_name_pattern}.sum"
    return checked


def _with_checksum(content: bytes) -> bytes:
    return hashlib.sha256(content).digest() + content


def _checked(path: Path) -> bytes:
    """Return the content of a file after verifying its checksum.

    Raises
    ------
    ValueError
        If the checksum does not match.
    """
    raw = path.read_bytes()
    content = raw[_DIGEST:]
    if hashlib.sha256(content).digest() != raw[:_DIGEST]:
        raise ValueError(f"{path.name} does not match its checksum")
    return content
