"""Writing a scenario folder as a ``.ssp`` archive: the same files give the same bytes."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from master.durable import cannot_write, whole_file
from master.errors import MasterError

#: Time stamp of every member: the earliest that zip can express.
_EPOCH: Final = (1980, 1, 1, 0, 0, 0)
_UNIX: Final = 3
_PLAIN_FILE: Final = 0o100644 << 16
_NOTHING: Final[Mapping[str, Path]] = {}


def pack(root: Path, archive: Path, added: Mapping[str, Path] = _NOTHING) -> Path:
    """Write all files under ``root`` into ``archive``, sorted, with fixed times and modes; return it.

    Hidden files and files that editors leave behind stay out.

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
    members = {path.relative_to(root).as_posix(): path for path in _members(root)}
    for place, folder in added.items():
        members |= {f"{place}/{path.relative_to(folder).as_posix()}": path for path in _members(folder)}
    try:
        archive.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(archive, error) from error
    with (
        whole_file(archive) as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as file,
    ):
        for name, path in sorted(members.items()):
            file.writestr(_info(name), _content(path))
    return archive


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise MasterError(f"{path} cannot be read ({error.strerror or error})") from error


def _members(root: Path) -> list[Path]:
    found = [p for p in root.rglob("*") if p.is_file() and not _is_hidden(p.relative_to(root))]
    for path in found:
        if path.is_symlink():
            raise MasterError(f"{path} is a symbolic link; put the file itself into the scenario")
    return sorted(found, key=lambda p: p.relative_to(root).as_posix())


def _is_hidden(path: Path) -> bool:
    return any(part.startswith(".") or part.endswith("~") for part in path.parts)


def _info(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name, _EPOCH)
    info.compress_type = zipfile.ZIP_DEFLATED
    info.create_system = _UNIX
    info.external_attr = _PLAIN_FILE
    return info
