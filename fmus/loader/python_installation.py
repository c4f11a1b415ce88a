"""A Python installation on disk, of this machine or another: what a bundled runtime is taken from."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

Platform = Literal["linux64", "win64"]
#: What an FMU needs besides Python itself.
PACKAGES: Final = ("numpy", "scipy")
_HERE: Final = f"{sys.version_info.major}.{sys.version_info.minor}"
_LIBRARY_FOLDERS: Final = ("lib", "lib64", "lib/x86_64-linux-gnu")


class InstallationError(ValueError):
    """A folder that no runtime can be taken from; says what is missing."""


@dataclass(frozen=True)
class Installation:
    """Where the parts of a Python lie.

    Attributes
    ----------
    root : Path
    platform : {"linux64", "win64"}
    version : str
        In full, ``3.11.7``.
    library : Path
        The shared library: ``libpython3.11.so.1.0``, ``python311.dll``.
    modules, extensions : Path
        Folders of the standard library's Python files and of its compiled ones.
    packages : mapping
        Package -> the folder that it lies in.
    """

    root: Path
    platform: Platform
    version: str
    library: Path
    modules: Path
    extensions: Path
    packages: Mapping[str, Path]

    @property
    def minor_version(self) -> str:
        """Return the version without its last number, ``3.11``."""
        return ".".join(self.version.split(".")[:2])

    def package_version(self, package: str) -> str:
        """Return the version that a package's own ``version.py`` states.

        Raises
        ------
        InstallationError
        """
        path = self.packages[package] / package / "version.py"
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        found = re.search(r'^(?:short_)?version = "([^"]+)"', text, re.MULTILINE)
        if found is None:
            raise InstallationError(f"{path} does not state the version of {package}")
        return found[1]


def own() -> Installation:
    """Return the Python that runs this, with the packages that it imports.

    Raises
    ------
    InstallationError
        If it has no shared library.
    """
    import numpy
    import scipy

    files = {"numpy": numpy.__file__, "scipy": scipy.__file__}
    packages = {name: Path(file).resolve().parent.parent for name, file in files.items()}
    return _read(Path(sys.base_prefix), packages)


def installed_at(folder: Path) -> Installation:
    """Return the Python in a folder, which may be one of another machine or system, or a virtual environment.

    Raises
    ------
    InstallationError
        If something is missing in it that a runtime needs.
    """
    if not folder.is_dir():
        raise InstallationError(f"{folder} is not a folder; name that of a Python")
    base = _base_of(folder)
    _read(base, {})  # whether it is a Python at all comes before what it lacks
    candidates = [*_package_folders(folder), *_package_folders(base)]
    packages = {name: _package_folder(name, candidates, folder) for name in PACKAGES}
    return _read(base, packages)


def _base_of(folder: Path) -> Path:
    settings = folder / "pyvenv.cfg"
    if not settings.is_file():
        return folder
    found = re.search(r"^home\s*=\s*(.+)$", settings.read_text(encoding="utf-8"), re.MULTILINE)
    if found is None:
        raise InstallationError(f"{settings} does not say where its Python is (home = ...)")
    home = Path(found[1].strip())
    return home if (home / "Lib").is_dir() else home.parent


def _package_folders(root: Path) -> Iterator[Path]:
    yield root / "Lib" / "site-packages"
    yield from root.glob(f"lib/python{_HERE}/site-packages")
    yield from root.glob(f"local/lib/python{_HERE}/dist-packages")
    yield root / "lib" / "python3" / "dist-packages"


def _package_folder(name: str, candidates: Iterable[Path], folder: Path) -> Path:
    for candidate in candidates:
        if (candidate / name / "__init__.py").is_file():
            return candidate
    raise InstallationError(f"{folder} has no {name}; install it into that Python first (pip install --target)")


def _read(root: Path, packages: Mapping[str, Path]) -> Installation:
    if (root / "Lib" / "os.py").is_file():
        return _windows(root, packages)
    modules = root / "lib" / f"python{_HERE}"
    if not (modules / "os.py").is_file():
        raise InstallationError(
            f"{root} holds no Python {_HERE} (neither lib/python{_HERE} nor Lib); name the folder that Python "
            f"{_HERE}, the version that builds the FMU, is installed in"
        )
    library = _linux_library(root)
    return Installation(root, "linux64", _version(library), library, modules, modules / "lib-dynload", packages)


def _linux_library(root: Path) -> Path:
    places = [root / folder / f"libpython{_HERE}.so.1.0" for folder in _LIBRARY_FOLDERS]
    for place in places:
        if place.is_file():
            return place.resolve()
    raise InstallationError(
        f"the Python in {root} has no shared library (libpython{_HERE}.so.1.0), which a standalone FMU needs; install "
        f"it (Debian: apt-get install libpython{_HERE}), take a Python built with --enable-shared, or name another "
        "with --runtime"
    )


def _windows(root: Path, packages: Mapping[str, Path]) -> Installation:
    library = root / f"python{_HERE.replace('.', '')}.dll"
    if not library.is_file():
        raise InstallationError(
            f"{root} holds no {library.name}; name the folder that Python {_HERE}, the version that builds the FMU, is "
            "installed in"
        )
    return Installation(root, "win64", _version(library), library, root / "Lib", root / "DLLs", packages)


def _version(library: Path) -> str:
    found = re.search(rb"(?<![\w.])" + re.escape(_HERE.encode()) + rb"\.\d+(?:rc\d+)?\+?(?=\0)", library.read_bytes())
    if found is None:
        raise InstallationError(f"{library} does not state its version; is it the library of a Python {_HERE}?")
    return found[0].decode()
