"""Writing a scenario folder as a ``.ssp`` archive: what its description names; the same files give the same bytes."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from master.errors import MasterError, said
from master.safety.safe_files import atomic_file, cannot_write
from master.ssp.archive import SSD_NAME, Sources
from master.ssp.ssp_xml import XmlError, safe_root

#: Time stamp of every member: the earliest that zip can express.
_EPOCH: Final = (1980, 1, 1, 0, 0, 0)
_UNIX: Final = 3
_PLAIN_FILE: Final = 0o100644 << 16
_NOTHING: Final[Mapping[str, Path]] = {}


def pack(root: Path, archive: Path, added: Mapping[str, Path] = _NOTHING) -> Path:
    """Write the system structure description and the files that it names into ``archive``; return it.

    Sorted, with fixed times and modes. Whatever else lies in the folder stays out (`left_out`): the FMU of a pantograph
    that was replaced must not travel along.

    Parameters
    ----------
    root, archive : Path
    added : mapping
        Folder in the archive -> folder whose files are written into it besides.

    Raises
    ------
    MasterError
        If the archive cannot be written, or ``root`` holds symbolic links.
    """
    members = {path.relative_to(root.resolve()).as_posix(): path for path in _members(root)}
    for place, folder in added.items():
        files = (path for path in folder.rglob("*") if path.is_file())
        members |= {f"{place}/{path.relative_to(folder).as_posix()}": path for path in files}
    try:
        archive.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(archive, error) from error
    with (
        atomic_file(archive) as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as file,
    ):
        for name, path in sorted(members.items()):
            file.writestr(_info(name), _content(path))
    return archive


def left_out(root: Path) -> tuple[str, ...]:
    """Return the files under ``root`` that `pack` leaves out, as paths within it."""
    kept = {path.resolve() for path in _members(root)}
    files = (p for p in root.rglob("*") if p.is_file() and p.resolve() not in kept)
    return tuple(sorted(p.relative_to(root).as_posix() for p in files))


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise MasterError(f"{path} cannot be read ({said(error)})") from error


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
