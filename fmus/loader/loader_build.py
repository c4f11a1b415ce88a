"""The loader: the library of an FMU that its host loads (``loader.c``), compiled or taken from the installed package.

It is compiled when the package is built (``setup.py``) or, where that was not done, when an FMU is, once for each user.
Its bytes depend on the compiler, so an FMU's GUID covers its sources and never the bytes.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).resolve().parent
PROBE: Final = FOLDER / "python_probe.py"
#: All that decides about the loader.
SOURCES: Final = (
    "loader.c",
    "platform.h",
    "platform_posix.c",
    "platform_windows.c",
    "python_probe.py",
    "fmu_opening.py",
    "loader_build.py",
)
#: What pythonfmu's own library is called behind the loader.
INNER_SUFFIX: Final = ".pythonfmu.so"
#: The oldest glibc that the loader runs on; tests/fmus/loader compares it with the symbols in the library.
OLDEST_GLIBC: Final = (2, 17)
#: The file of a runtime that tells the loader what lies where.
DESCRIPTION: Final = "runtime.txt"
_BINARIES: Final = "binaries/linux64"
_INPUTS: Final = ("loader.c", "platform_posix.c")
_WINDOWS_INPUTS: Final = ("loader.c", "platform_windows.c")
_MINGW: Final = "x86_64-w64-mingw32-gcc"
_WINDOWS_OPTIONS: Final = (
    "-std=gnu11",
    "-shared",
    "-O2",
    "-Wall",
    "-Wextra",
    "-Wno-unused-parameter",
    "-static-libgcc",
    "-s",
)
_OPTIONS: Final = (
    "-std=gnu11",
    "-shared",
    "-fPIC",
    "-O2",
    "-fvisibility=hidden",
    "-Wall",
    "-Wextra",
    "-Wno-unused-parameter",
)
#: Not to be unloaded: pythonfmu's library stays in the process as well, and so their place can be used again.
#: libdl and libpthread are part of libc from glibc 2.34 on; older ones have dlopen in libdl.
_LIBRARIES: Final = ("-Wl,-z,nodelete", "-Wl,--no-as-needed", "-l:libdl.so.2", "-lpthread")
_VERSION: Final = re.compile(rb"\0(GLIBC|GLIBCXX)_(\d+(?:\.\d+)+)(?=\0)")


class LoaderError(ValueError):
    """The loader cannot be made here; says why."""


def with_loader(binaries: Mapping[str, bytes], name: str) -> dict[str, bytes]:
    """Return an FMU's files with the loader in front of pythonfmu's Linux library.

    Raises
    ------
    LoaderError
        If the package brings no loader and none can be compiled here.
    """
    outer, inner = f"{_BINARIES}/{name}.so", f"{_BINARIES}/{name}{INNER_SUFFIX}"
    if outer not in binaries:
        raise LoaderError("this pythonfmu brings no library for Linux that the loader could stand before")
    return {**binaries, inner: binaries[outer], outer: loader_library()}


def with_windows_loader(binaries: Mapping[str, bytes], name: str) -> dict[str, bytes]:
    """Return an FMU's files with the loader in front of pythonfmu's Windows library, to open a Python beside it.

    Raises
    ------
    LoaderError
        If it cannot be compiled here.
    """
    outer, inner = f"binaries/win64/{name}.dll", f"binaries/win64/{name}.pythonfmu.dll"
    if outer not in binaries:
        raise LoaderError("this pythonfmu brings no library for Windows that the loader could stand before")
    return {**binaries, inner: binaries[outer], outer: windows_loader_library()}


@cache
def windows_loader_library() -> bytes:
    """Return the loader for Windows, made by the compiler in ``CC_WINDOWS`` (mingw-w64's by default).

    Raises
    ------
    LoaderError
    """
    compiler = shutil.which(os.environ.get("CC_WINDOWS", _MINGW))
    if compiler is None:
        raise LoaderError(f"there is no C compiler for the loader for Windows (install {_MINGW}, or set CC_WINDOWS)")
    with tempfile.TemporaryDirectory(prefix="openpanto_") as folder:
        library = Path(folder) / "loader.dll"
        command = [compiler, *_WINDOWS_OPTIONS, *_WINDOWS_INPUTS, "-o", str(library)]
        done = subprocess.run(command, cwd=FOLDER, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise LoaderError(f"the C compiler refused the loader for Windows: {_first_line(done.stderr)}")
        return library.read_bytes()


@cache
def loader_library() -> bytes:
    """Return the loader for Linux on x86-64, from the package or made by the C compiler in ``CC`` (cc by default).

    Raises
    ------
    LoaderError
    """
    ready = FOLDER / built_name()
    if ready.is_file():
        return ready.read_bytes()
    import numpy as np  # neither is there where `setup.py` compiles the loader

    from models.numerics.user_cache import keep_arrays, kept_arrays

    key = f"loader-{source_hash()[:16]}-{_compiler_hash()}"
    if (kept := kept_arrays(key)) is not None and "library" in kept:
        return kept["library"].tobytes()
    with tempfile.TemporaryDirectory(prefix="openpanto_") as folder:
        library = Path(folder) / "loader.so"
        compile_loader(library)
        made = library.read_bytes()
    keep_arrays(key, {"library": np.frombuffer(made, np.uint8)})
    return made


def _compiler_hash() -> str:
    """Return what changes with the compiler, and with what it is told."""
    command = build_command(Path("/loader.so"))
    compiler = Path(command[0]).resolve()
    found = compiler.stat()
    whole = "\0".join((*command, str(compiler), str(found.st_size), str(found.st_mtime_ns)))
    return hashlib.sha256(whole.encode()).hexdigest()[:16]


def built_name() -> str:
    """Return the file name of a loader compiled beside its sources; another one belongs to other sources."""
    return f"loader-linux64-{source_hash()[:16]}.so"


def source_hash() -> str:
    """Return a SHA-256 of the loader's sources."""
    whole = hashlib.sha256()
    for name, data in sources().items():
        whole.update(f"{name}\0{len(data)}\0".encode() + data)
    return whole.hexdigest()


def sources() -> dict[str, bytes]:
    """Return the loader's sources by name."""
    return {name: (FOLDER / name).read_bytes() for name in SOURCES}


def compile_loader(library: Path, extra: tuple[str, ...] = ("-s",)) -> None:
    """Compile the loader.

    Parameters
    ----------
    library : Path
        What is written.
    extra : tuple of str
        More options for the compiler.

    Raises
    ------
    LoaderError
    """
    done = subprocess.run(build_command(library, extra), cwd=FOLDER, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise LoaderError(f"the C compiler refused the loader: {_first_line(done.stderr)}")


def build_command(library: Path, extra: tuple[str, ...] = ("-s",)) -> list[str]:
    """Return the command that compiles the loader, to be run in this folder.

    Raises
    ------
    LoaderError
        If there is no compiler, or this is not Linux on x86-64.
    """
    if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
        raise LoaderError(f"there is no loader for {platform.system()} on {platform.machine()} yet")
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        raise LoaderError("there is no C compiler for the loader (install gcc, or set CC)")
    return [compiler, *_OPTIONS, *extra, *_INPUTS, "-o", str(library.resolve()), *_LIBRARIES]


def needed_versions(library: bytes) -> dict[str, tuple[int, ...]]:
    r"""Return the newest versions of glibc ("GLIBC") and libstdc++ ("GLIBCXX") whose symbols a library needs.

    Examples
    --------
    >>> needed_versions(b"\0GLIBC_2.4\0GLIBC_2.14\0")
    {'GLIBC': (2, 14)}
    """
    newest: dict[str, tuple[int, ...]] = {}
    for match in _VERSION.finditer(library):
        name, version = match[1].decode(), tuple(int(part) for part in match[2].split(b"."))
        newest[name] = max(newest.get(name, (0,)), version)
    return newest


def _first_line(text: str) -> str:
    lines = [line for line in text.splitlines() if "error" in line] or text.splitlines() or ["no reason given"]
    return lines[0].strip()
