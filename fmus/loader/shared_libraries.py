"""The shared libraries that a runtime has to bring: what its compiled modules ask for, and glibc does not have."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Final

from fmus.loader.elf_library import needed, soname
from fmus.loader.loader_build import needed_versions
from fmus.loader.python_installation import PACKAGES, Installation, InstallationError

#: Libraries of glibc, which are the machine's: to bring others would break it.
_GLIBC: Final = frozenset(
    {
        "ld-linux-x86-64.so.2",
        "libc.so.6",
        "libdl.so.2",
        "libm.so.6",
        "libpthread.so.0",
        "libresolv.so.2",
        "librt.so.1",
        "libutil.so.1",
    }
)
_SYSTEM_FOLDERS: Final = (
    "/lib/x86_64-linux-gnu",
    "/usr/lib/x86_64-linux-gnu",
    "/lib64",
    "/usr/lib64",
    "/lib",
    "/usr/lib",
)
_ROOT_FOLDERS: Final = ("lib", "lib64", "lib/x86_64-linux-gnu")
#: Lets numpy use the OpenBLAS of scipy.
ONE_BLAS: Final = Path(__file__).resolve().parent / "one_blas.c"


class BlasError(ValueError):
    """One OpenBLAS cannot serve both numpy and scipy; says why."""


@dataclass(frozen=True)
class Libraries:
    """Libraries of a runtime.

    Attributes
    ----------
    files : mapping
        Place in the runtime -> file.
    python : str
        Place of Python's own.
    preload : tuple of str
        Places of those that the loader opens before it, each after those that it needs itself.
    glibc : str
        The oldest glibc that has all that they ask for, empty for other systems.
    """

    files: Mapping[str, Path]
    python: str
    preload: tuple[str, ...]
    glibc: str


def collect_libraries(source: Installation, modules: Mapping[str, Path], one_blas: Path | None = None) -> Libraries:
    """Return the libraries that Python and compiled modules need.

    Parameters
    ----------
    source : Installation
    modules : mapping
        Place in the runtime -> file; those that are not libraries are skipped.
    one_blas : Path, optional
        Folder to compile the library in that lets numpy use scipy's OpenBLAS (``one_blas.c``); without it the runtime
        holds both copies.

    Raises
    ------
    InstallationError
        If a library cannot be found.
    BlasError
        If that library cannot be compiled here.
    """
    return _of_windows(source) if source.platform == "win64" else _of_linux(source, modules, one_blas)


# Libraries of wheels lie with the others: what numpy and scipy both need is there once. Opened first, they are found by
# their names, for which those of wheels hold a hash.
def _of_linux(source: Installation, modules: Mapping[str, Path], one_blas: Path | None) -> Libraries:
    compiled = [path for name, path in modules.items() if name.endswith(".so")]
    found = _closure([source.library, *compiled], source)
    if one_blas is not None:
        found |= _one_blas(found, one_blas)
    order = TopologicalSorter({name: set(needed(path.read_bytes())) & found.keys() for name, path in found.items()})
    files = {f"lib/{name}": path for name, path in found.items()}
    preload = [f"lib/{name}" for name in order.static_order()]
    python = f"lib/{soname(source.library.read_bytes()) or source.library.name}"
    files[python] = source.library
    versions = (needed_versions(path.read_bytes()) for path in (*files.values(), *compiled))
    glibc = max(version.get("GLIBC", (0,)) for version in versions)
    return Libraries(files, python, tuple(preload), ".".join(map(str, glibc)))


def _one_blas(found: Mapping[str, Path], folder: Path) -> dict[str, Path]:
    """Compile the stand-in for numpy's OpenBLAS that hands over to scipy's."""
    numpys = [name for name in found if name.startswith("libscipy_openblas64_-")]
    scipys = [path for name, path in found.items() if name.startswith("libscipy_openblas-")]
    if len(numpys) != 1 or len(scipys) != 1:
        raise BlasError("numpy and scipy do not bring one OpenBLAS each")
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        raise BlasError("there is no C compiler (install gcc, or set CC)")
    library = folder / numpys[0]
    options = ["-shared", "-fPIC", "-O2", "-s", f"-Wl,-soname,{library.name}", "-Wl,--allow-shlib-undefined"]
    command = [compiler, *options, str(ONE_BLAS), "-o", str(library), str(scipys[0])]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise BlasError(f"the C compiler refused {ONE_BLAS.name}: {done.stderr.strip()}")
    return {library.name: library}


def _closure(start: Iterable[Path], source: Installation) -> dict[str, Path]:
    """Return all libraries that some need, directly or not: name asked for -> file."""
    found: dict[str, Path] = {}
    waiting = list(start)
    while waiting:
        asking = waiting.pop()
        for name in needed(asking.read_bytes()):
            if name not in _GLIBC and name not in found:
                found[name] = _find(name, asking, source)
                waiting.append(found[name])
    return found


def _find(name: str, asking: Path, source: Installation) -> Path:
    own = [folder / f"{package}.libs" for package, folder in source.packages.items()]
    inside = [source.root / folder for folder in _ROOT_FOLDERS]
    system = [Path(folder) for folder in _SYSTEM_FOLDERS]
    for folder in (*own, *inside, *system):
        if (folder / name).is_file():
            return (folder / name).resolve()
    raise InstallationError(f"{asking} needs {name}, which is not on this machine; install it")


def _of_windows(source: Installation) -> Libraries:
    wheels = list(_wheel_libraries(source))
    files = {f"packages/{p.parent.name}/{p.name}": p for p in wheels}
    # Compiled modules of Python find their libraries (libffi) in their own folder.
    files |= {f"extensions/{p.name}": p for p in sorted(source.extensions.glob("libffi*.dll"))}
    # pythonfmu's library needs this one, which Python does without and wheels bring under another name.
    visual_c = next((p for p in wheels if p.name.startswith("msvcp140-")), None)
    first = {f"lib/{p.name}": p for p in sorted(source.root.glob("vcruntime*.dll"))}
    first |= {"lib/msvcp140.dll": visual_c} if visual_c else {}
    # Names of every version's library, which pythonfmu's asks for; they lead to the version's own.
    first |= {f"lib/{p.name}": p for p in source.root.glob("python3.dll")}
    python = f"lib/{source.library.name}"
    return Libraries({**files, **first, python: source.library}, python, tuple(first), "")


def _wheel_libraries(source: Installation) -> Iterable[Path]:
    for package in PACKAGES:
        yield from sorted((source.packages[package] / f"{package}.libs").glob("*.dll"))
