"""Opening a scenario: an unpacked folder or a ``.ssp`` archive alike."""

from __future__ import annotations

import stat
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final

from master.errors import Problem, ScenarioError

SSD_NAME: Final = "SystemStructure.ssd"

#: Bounds on an archive's contents; generous for scenarios with a dozen FMUs.
MAX_BYTES: Final = 2 * 1024**3
MAX_FILES: Final = 10_000


@dataclass(frozen=True)
class Package:
    """A scenario's files on disk.

    Attributes
    ----------
    name : str
        The scenario's name: the folder's or archive's name without ``.ssp``.
    root : Path
        The folder that holds ``SystemStructure.ssd``.
    origin : Path
        What the user named.
    writable : bool
        Whether ``root`` is the user's own folder (FMUs may be built into it) and not a temporary copy.
    """

    name: str
    root: Path
    origin: Path
    writable: bool


@contextmanager
def open_package(path: Path) -> Iterator[Package]:
    """Give access to a scenario; an archive is extracted to a temporary folder and removed afterwards.

    Raises
    ------
    ScenarioError
        If there is no scenario at ``path`` or the archive is unsafe.
    """
    if path.is_dir():
        yield _checked(Package(_name(path), path.resolve(), path, writable=True))
    elif path.is_file():
        with tempfile.TemporaryDirectory(prefix="ssp-") as folder:
            extract(path, Path(folder))
            yield _checked(Package(_name(path), Path(folder), path, writable=False))
    else:
        raise _refusal(path, "scenario", "there is no such folder or .ssp archive")


def extract(archive: Path, folder: Path) -> None:
    """Extract ``archive`` into ``folder`` after checking every member.

    Raises
    ------
    ScenarioError
        If it is not a zip archive, is damaged or encrypted, is larger than `MAX_BYTES`, or has members that
        would land outside ``folder`` or are symbolic links.
    """
    try:
        with zipfile.ZipFile(archive) as file:
            for member in _checked_members(archive, file):
                file.extract(member, folder)
    except (zipfile.BadZipFile, zipfile.LargeZipFile, EOFError, NotImplementedError, RuntimeError) as error:
        raise _refusal(archive, "archive", f"is not a readable .ssp archive ({error})") from error
    except OSError as error:
        raise _refusal(archive, "archive", f"cannot be extracted ({error.strerror or error})") from error


def inside(root: Path, source: str) -> Path | None:
    """Return the file that a relative URI names, None if it is absolute or lies outside ``root``."""
    pure = PurePosixPath(source)
    if not _is_tame(pure) or ":" in source.split("/")[0] or "\\" in source:
        return None
    path = (root / pure).resolve()
    return path if path.is_relative_to(root.resolve()) else None


def _checked_members(archive: Path, file: zipfile.ZipFile) -> list[zipfile.ZipInfo]:
    members = file.infolist()
    if len(members) > MAX_FILES:
        raise _refusal(archive, "archive-size", f"has {len(members)} files, more than {MAX_FILES}")
    size = sum(m.file_size for m in members)
    if size > MAX_BYTES:
        raise _refusal(archive, "archive-size", f"would unpack to {size} bytes, more than {MAX_BYTES}")
    for member in members:
        _check_member(archive, member)
    return members


def _check_member(archive: Path, member: zipfile.ZipInfo) -> None:
    name = member.filename
    if not _is_tame(PurePosixPath(name)) or "\\" in name or ":" in name:
        raise _refusal(archive, "archive-path", f"member '{name}' would be written outside the folder")
    if stat.S_ISLNK(member.external_attr >> 16):
        raise _refusal(archive, "archive-link", f"member '{name}' is a symbolic link")
    if member.flag_bits & 0x1:
        raise _refusal(archive, "archive", f"member '{name}' is encrypted")


def _is_tame(path: PurePosixPath) -> bool:
    return not path.is_absolute() and ".." not in path.parts


def _checked(package: Package) -> Package:
    if not (package.root / SSD_NAME).is_file():
        raise _refusal(package.origin, "scenario", f"contains no {SSD_NAME}")
    return package


def _name(path: Path) -> str:
    name = path.resolve().name
    return name[: -len(".ssp")] if name.endswith(".ssp") else name


def _refusal(path: Path, rule: str, text: str) -> ScenarioError:
    return ScenarioError([Problem(str(path), 0, rule, text)])
