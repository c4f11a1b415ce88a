"""The licences of all that a runtime bundles; none is left out, or the runtime is not made."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from fmus.loader.python_installation import PACKAGES, Installation, InstallationError

FOLDER: Final = "licences"
#: Folder of libraries of our own.
COMPILED_HERE: Final = "compiled_here"
_COMMON: Final = Path("/usr/share/common-licenses")
_PYTHON_FILES: Final = ("LICENSE.txt", "LICENSE", "../../LICENSE.txt", "../LICENSE.txt")


def licences(source: Installation, files: Mapping[str, Path]) -> dict[str, bytes]:
    """Return the licence texts of a runtime's files: place in the runtime -> text.

    Parameters
    ----------
    source : Installation
    files : mapping
        Place in the runtime -> file that it was made from.

    Raises
    ------
    InstallationError
        If a text cannot be found: without it nothing may be redistributed.
    """
    found = {"python": _python_licence(source)}
    for package in PACKAGES:
        found |= _package_licences(source, package)
    for name, path in files.items():
        if name.startswith("lib/") and source.platform == "linux64" and not _has_other_licence(path, source):
            found |= _system_licences(path)
    return {f"{FOLDER}/{name}.txt": data for name, data in sorted(found.items())}


def _has_other_licence(library: Path, source: Installation) -> bool:
    """Whether the licence of Python, of a wheel or of the FMU itself (what is compiled here) covers a library."""
    wheels = {f"{package}.libs" for package in PACKAGES}
    return library == source.library or library.parent.name in {*wheels, COMPILED_HERE}


def _python_licence(source: Installation) -> bytes:
    for name in _PYTHON_FILES:
        if (source.modules / name).is_file():
            return (source.modules / name).read_bytes()
    for path in source.modules.parent.parent.glob(f"share/doc/*python{source.minor_version}*/copyright"):
        return path.read_bytes()
    raise InstallationError(f"the licence of the Python in {source.root} (LICENSE.txt) cannot be found")


def _package_licences(source: Installation, package: str) -> dict[str, bytes]:
    """Return a wheel's licences; they name those of the libraries in it too (OpenBLAS, LAPACK, GCC's runtime)."""
    folder = source.packages[package]
    found: dict[str, bytes] = {}
    for info in sorted(folder.glob(f"{package}-*.dist-info")):
        for path in sorted(p for p in info.rglob("*") if p.is_file() and p.name.upper().startswith("LICEN")):
            inner = path.relative_to(info).with_suffix("").as_posix().removeprefix("licenses/")
            found[f"{package}-{inner.replace('/', '-')}"] = path.read_bytes()
    if not found:
        raise InstallationError(f"the licence of {package} cannot be found in {folder}")
    return found


def _system_licences(library: Path) -> dict[str, bytes]:
    package = _debian_package(library) or _rpm_package(library)
    texts = dict(_texts(package)) if package else {}
    if not texts:
        raise InstallationError(
            f"the licence of {library} cannot be found among the system's packages; a standalone FMU may not carry "
            "a library without it"
        )
    return texts


def _debian_package(library: Path) -> str:
    # Packages know a file by the name that it had before /lib became a link to /usr/lib, or by the one after.
    names = [str(library), str(library).removeprefix("/usr")]
    answer = _ask("dpkg", "-S", *names)
    return answer.partition(":")[0].strip()


def _rpm_package(library: Path) -> str:
    return _ask("rpm", "-qf", "--queryformat", "%{NAME}", str(library))


def _ask(tool: str, *arguments: str) -> str:
    if shutil.which(tool) is None:
        return ""
    done = subprocess.run([tool, *arguments], capture_output=True, text=True, check=False)
    return done.stdout.strip()


def _texts(package: str) -> Iterator[tuple[str, bytes]]:
    copyright_file = Path("/usr/share/doc") / package / "copyright"
    if copyright_file.is_file():
        data = copyright_file.read_bytes()
        yield package, data
        # Debian's files refer to these instead of repeating them.
        for name in sorted(set(re.findall(rb"/usr/share/common-licenses/([\w.-]*\w)", data))):
            path = _COMMON / name.decode()
            if path.is_file():
                yield name.decode(), path.read_bytes()
    for path in sorted(p for p in (Path("/usr/share/licenses") / package).rglob("*") if p.is_file()):
        yield f"{package}-{path.name}", path.read_bytes()
