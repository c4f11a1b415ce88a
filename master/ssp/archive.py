"""Opening a scenario: an unpacked folder or a ``.ssp`` archive alike."""

from __future__ import annotations

import lzma
import os
import stat
import struct
import tempfile
import unicodedata
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final
from urllib.parse import unquote, urlsplit

from master.errors import Problem, ScenarioError

SSD_NAME: Final = "SystemStructure.ssd"

#: Bounds on an archive's contents; generous for scenarios with a dozen FMUs.
MAX_BYTES: Final = 2 * 1024**3
MAX_FILES: Final = 10_000
#: Largest factor by which a member may grow, once it is larger than this [bytes]: files of a scenario, and an FMU's,
#: stay below 100; a bomb is 1000 times as large as what holds it.
MAX_RATIO: Final = 200
_SMALL: Final = 10 * 1024**2
#: What reading a damaged or unusual archive raises: zipfile documents only the first two.
_UNREADABLE: Final = (
    zipfile.BadZipFile,
    zipfile.LargeZipFile,
    zlib.error,
    lzma.LZMAError,
    struct.error,
    EOFError,
    NotImplementedError,
    RuntimeError,
    ValueError,
    OverflowError,
    MemoryError,
)


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
        If it is not a zip archive, is damaged or unsafe (`check_members`).
    """
    try:
        with zipfile.ZipFile(archive) as file:
            members = file.infolist()
            check_members(members)
            for member in members:
                file.extract(member, folder)
    except UnsafeArchiveError as error:
        raise _refusal(archive, error.rule, str(error)) from error
    except _UNREADABLE as error:
        raise _refusal(archive, "archive", f"is not a readable .ssp archive ({error})") from error
    except OSError as error:
        # The system's errors have a number and a text; bzip2's own, of damaged data, has neither.
        what = "cannot be extracted" if error.strerror else "is not a readable .ssp archive"
        raise _refusal(archive, "archive", f"{what} ({error.strerror or error})") from error


def read_member(archive: Path, name: str) -> bytes:
    """Return a member of an archive, none of whose members is unsafe.

    Raises
    ------
    ValueError
        With the reason, if it is not a readable zip archive, is unsafe, or has no such member.
    """
    try:
        with zipfile.ZipFile(archive) as file:
            check_members(file.infolist())
            return file.read(name)
    except UnsafeArchiveError as error:
        raise ValueError(str(error)) from error
    except KeyError:
        raise ValueError(f"holds no {name}") from None
    except (*_UNREADABLE, OSError) as error:
        raise ValueError(f"is not a readable archive ({error})") from error


@dataclass(frozen=True)
class Sources:
    """Where the files lie that a scenario may name.

    Attributes
    ----------
    root : Path
        The scenario's own folder, to which URIs are relative.
    outside : tuple of Path
        Further folders that the user has allowed.
    archive : Path, optional
        The archive that the folder was extracted from: what lies beside it is named as from a folder in its place.
    """

    root: Path
    outside: tuple[Path, ...] = ()
    archive: Path | None = None

    def find(self, source: str) -> Path | None:
        """Return the file that a URI names, None if it lies neither in the scenario nor in an allowed folder.

        The URI is relative, or of scheme ``file``; ``%20`` and the like stand for the characters they encode. A name
        that no file can have (too long, a circle of links) is one that lies nowhere.
        """
        try:
            name = _decoded(source)
            path = (self.root / PurePosixPath(name)).resolve()
            if self.archive is not None and not self.is_inside(path):
                path = Path(os.path.normpath(self.archive.absolute() / PurePosixPath(name))).resolve()
            path.is_file()
            homes = [folder.resolve() for folder in (self.root, *self.outside)]
        except (OSError, RuntimeError, ValueError):
            return None
        return path if any(path.is_relative_to(home) for home in homes) else None

    def is_inside(self, path: Path) -> bool:
        """Whether a file is one of the scenario's own."""
        return path.is_relative_to(self.root.resolve())


def _decoded(source: str) -> str:
    """Return the path that a URI names; ValueError if it names no file."""
    parts = urlsplit(source)
    if parts.scheme not in ("", "file") or parts.netloc not in ("", "localhost"):
        raise ValueError(source)
    name = unquote(source.partition(":")[2] if parts.scheme else source, errors="strict")
    if parts.scheme or parts.netloc:
        name = name.removeprefix("//localhost").removeprefix("//")
    if "\\" in name or "\0" in name or ":" in name.split("/")[0]:
        raise ValueError(source)
    return name


class UnsafeArchiveError(Exception):
    """An archive that must not be extracted; ``rule`` is a short name of what it violates."""

    def __init__(self, rule: str, text: str) -> None:
        self.rule = rule
        super().__init__(text)


def check_members(members: Sequence[zipfile.ZipInfo]) -> None:
    """Check an archive's list of contents, before anything is extracted.

    Raises
    ------
    UnsafeArchiveError
        If there are more than `MAX_FILES` members, more than `MAX_BYTES` to unpack or `MAX_RATIO` times what is
        packed, if members would land outside the folder or in each other's place, are links or are encrypted.
    """
    if len(members) > MAX_FILES:
        raise UnsafeArchiveError("archive-size", f"has {len(members)} files, more than {MAX_FILES}")
    size = sum(m.file_size for m in members)
    if size > MAX_BYTES:
        raise UnsafeArchiveError("archive-size", f"would unpack to {size} bytes, more than {MAX_BYTES}")
    taken: dict[str, str] = {}
    for member in members:
        _check_member(member)
        # Letters of either case are the same file on some systems: which member would win is left to chance.
        key = unicodedata.normalize("NFC", PurePosixPath(member.filename).as_posix()).casefold()
        if key in taken:
            text = f"members '{taken[key]}' and '{member.filename}' would be written to the same place"
            raise UnsafeArchiveError("archive-name", text)
        taken[key] = member.filename


def _check_member(member: zipfile.ZipInfo) -> None:
    name = member.filename
    if not name.strip("/.") or not _is_tame(PurePosixPath(name)) or "\\" in name or ":" in name:
        raise UnsafeArchiveError("archive-path", f"member '{name}' would be written outside the folder")
    if stat.S_ISLNK(member.external_attr >> 16):
        raise UnsafeArchiveError("archive-link", f"member '{name}' is a symbolic link")
    if member.flag_bits & 0x1:
        raise UnsafeArchiveError("archive", f"member '{name}' is encrypted")
    if member.file_size > _SMALL and member.file_size > MAX_RATIO * max(member.compress_size, 1):
        text = f"member '{name}' would grow from {member.compress_size} to {member.file_size} bytes"
        raise UnsafeArchiveError("archive-size", f"{text}, more than {MAX_RATIO} times")


def _is_tame(path: PurePosixPath) -> bool:
    return not path.is_absolute() and ".." not in path.parts


def _checked(package: Package) -> Package:
    if not (package.root / SSD_NAME).is_file():
        raise _refusal(package.origin, "scenario", f"contains no {SSD_NAME}; give the folder NAME.ssp that has one")
    return package


def _name(path: Path) -> str:
    name = path.resolve().name
    return name[: -len(".ssp")] if name.endswith(".ssp") else name


def _refusal(path: Path, rule: str, text: str) -> ScenarioError:
    return ScenarioError([Problem(str(path), 0, rule, text)])
