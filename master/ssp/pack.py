"""Writing a scenario folder as a ``.ssp`` archive: what its description names; the same files give the same bytes."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from master.errors import MasterError
from master.ssp.archive import SSD_NAME, Sources
from master.ssp.xml import XmlError, safe_root

#: Time stamp of every member: the earliest that zip can express.
_EPOCH: Final = (1980, 1, 1, 0, 0, 0)
_UNIX: Final = 3
_PLAIN_FILE: Final = 0o100644 << 16


def pack(root: Path, archive: Path) -> Path:
    """Write the system structure description and the files that it names into ``archive``; return it.

    Sorted, with fixed times and modes. Whatever else lies in the folder stays out (`left_out`): the FMU of a pantograph
    that was replaced must not travel along.

    Raises
    ------
    MasterError
        If the archive cannot be written, or ``root`` holds symbolic links.
    """
    members = _members(root)
    temporary = archive.with_name(f".{archive.name}.{os.getpid()}.part")  # two that pack do not mix
    try:
        archive.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as file:
            for path in members:
                file.writestr(_info(path.relative_to(root.resolve()).as_posix()), path.read_bytes())
        temporary.replace(archive)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise MasterError(f"{archive} cannot be written ({error.strerror})") from error
    return archive


def left_out(root: Path) -> tuple[str, ...]:
    """Return the files under ``root`` that `pack` leaves out, as paths within it."""
    kept = {path.resolve() for path in _members(root)}
    files = (p for p in root.rglob("*") if p.is_file() and p.resolve() not in kept)
    return tuple(sorted(p.relative_to(root).as_posix() for p in files))


def _members(root: Path) -> list[Path]:
    for path in root.rglob("*"):
        if path.is_symlink():
            raise MasterError(f"{path} is a symbolic link; put the file itself into the scenario")
    sources = Sources(root)
    named = (sources.find(source) for source in _sources(root / SSD_NAME))
    found = {(root / SSD_NAME).resolve(), *(path for path in named if path is not None and path.is_file())}
    return sorted(found, key=lambda p: p.relative_to(root.resolve()).as_posix())


def _sources(description: Path) -> Iterator[str]:
    """Yield what a description names: FMUs, parameter sets, mappings, and whatever else has a ``source``."""
    try:
        node = safe_root(description.read_bytes())
    except (OSError, XmlError) as error:
        raise MasterError(f"{description} cannot be read ({error})") from error
    for element in node.iter():
        source = element.get("source") if isinstance(element.tag, str) else None
        if source is not None:
            yield source


def _info(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name, _EPOCH)
    info.compress_type = zipfile.ZIP_DEFLATED
    info.create_system = _UNIX
    info.external_attr = _PLAIN_FILE
    return info
