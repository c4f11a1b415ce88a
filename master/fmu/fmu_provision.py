"""Provide the FMUs that a scenario names; ``python -m fmus`` builds those that are missing or stale.

The master needs nothing else from ``fmus``, and works without it: a foreign FMU, which ``fmus`` does not know, is used
as it is.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import subprocess
import sys
import time
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

from master.fmu.kept_fingerprints import Answer, keep_answer, kept_answer

#: Seconds after which asking for a fingerprint, or building, is given up.
_ASK_SECONDS: Final = 60
_BUILD_SECONDS: Final = 600
#: What identifies an FMU of ours; see docs/interoperability.md.
_MARK: Final = "resources/openpanto.txt"
_LONGEST_MARK: Final = 1 << 16
#: How what ``python -m fmus`` only remarks begins.
_NOTE: Final = "note: "
#: How a line begins that names what a fingerprint depends on.
_WATCHED: Final = "watched: "
#: What a damaged, encrypted or exotically compressed archive raises.
_UNREADABLE: Final = (
    OSError,
    EOFError,
    KeyError,
    ValueError,
    RuntimeError,
    NotImplementedError,
    zipfile.BadZipFile,
    zlib.error,
    ElementTree.ParseError,
)


def provide_fmu(
    path: Path,
    tell: Callable[[str], None],
    scratch: Callable[[], Path] | None = None,
    library: Path | None = None,
) -> Path:
    """Build the FMU at ``path`` if it is missing, or ours and older than the sources it is built from.

    An FMU without our mark, or changed since it was built, is kept, and ``tell`` is called.

    Parameters
    ----------
    path : Path
    tell : callable
        Called with what takes time, and what is kept.
    scratch : callable, optional
        Gives a folder to build into instead, where nothing may be written next to ``path``; what it holds is used if it
        fits. Asked for where something is to be built.
    library : Path, optional
        Folder in which, and in whose parents up to the project, definitions are looked up first.

    Returns
    -------
    Path
        The FMU to use.

    Raises
    ------
    ValueError
        With the builder's own words, if an FMU that is missing cannot be built.
    """
    if not has_builder():
        return path
    origin = _origin(path)
    lookup = Lookup(path.stem, library, origin)
    wanted = fingerprint(lookup, tell)
    if wanted is None and origin is not None:
        tell(f"{path.name} is used as it is: {origin.definition}, which it was built from, is missing")
    if wanted is None or (path.is_file() and _matches(wanted, stored_guid(path))):
        return path
    if path.exists() and (why := why_not_ours(path)):
        tell(f"{path.name} is used as it is: {why}; to have it rebuilt, remove it")
        return path
    place = scratch() / path.name if scratch else path
    if place.is_file() and _matches(wanted, stored_guid(place)):
        return place
    tell(f"building {path.name}" + (" again: what it is made of has changed" if place.is_file() else ""))
    build(place, lookup)
    return place


@dataclass(frozen=True)
class Origin:
    """A user's definition that an FMU was built from."""

    definition: Path
    pantographs: str


@dataclass(frozen=True)
class Lookup:
    """What is asked of ``python -m fmus``: an FMU's name, where to look for its definition first, and its origin."""

    name: str
    library: Path | None = None
    origin: Origin | None = None

    @property
    def arguments(self) -> list[str]:
        """Return it as the command line has it."""
        found = ["--library", str(self.library)] if self.library is not None else []
        if self.origin is not None:
            found += ["--built-from", self.origin.definition.as_posix()]
            if self.origin.pantographs not in ("", "1"):
                found += ["--pantographs", self.origin.pantographs]
        return [*found, "--", self.name]


def read_mark(path: Path) -> dict[str, str]:
    """Return what our mark in an FMU says, empty if it has none."""
    try:
        with zipfile.ZipFile(path) as file:
            text = file.read(_MARK)[:_LONGEST_MARK].decode("utf-8")
    except _UNREADABLE:
        return {}
    pairs = (line.partition("=") for line in text.splitlines())
    return {key: value for key, separator, value in pairs if separator}


def why_not_ours(path: Path) -> str:
    """Return why an FMU may be the user's own work; empty if it is ours, as we built it."""
    mark, guid = read_mark(path), stored_guid(path)
    if not guid:
        return "it is not an FMU that could be read"
    try:
        with zipfile.ZipFile(path) as file:
            if not mark:
                return "" if _is_older_build(file, path.stem, guid) else "it was not built by this project"
            if mark.get("guid") == guid.strip("{}") and mark.get("content") == _content_hash(file):
                return ""
    except _UNREADABLE:
        pass
    return "it was changed since it was built"


def _origin(path: Path) -> Origin | None:
    mark = read_mark(path) if path.is_file() else {}
    if not mark.get("definition"):
        return None
    return Origin(_beside(path, mark), mark.get("pantographs", "1"))


def _is_older_build(file: zipfile.ZipFile, name: str, guid: str) -> bool:
    """Whether it was built before marks existed: the script's name holds the beginning of the GUID."""
    script = f"{name}_{guid.strip('{}').replace('-', '')[:12]}"
    if {f"resources/{script}.py", "resources/slavemodule.txt"} <= set(file.namelist()):
        return file.read("resources/slavemodule.txt").decode("utf-8").strip() == script
    return False


def _content_hash(file: zipfile.ZipFile) -> str:
    """Return the hash that the mark should hold, over all other files (``content_hash`` of ``fmus``)."""
    whole = hashlib.sha256()
    for info in sorted(file.infolist(), key=lambda info: info.filename):
        if info.filename != _MARK and not info.is_dir():
            data = file.read(info)
            whole.update(f"{info.filename}\0{len(data)}\0".encode() + data)
    return whole.hexdigest()


def has_builder() -> bool:
    """Whether ``python -m fmus`` is available, without importing it."""
    spec = importlib.util.find_spec("fmus")
    folders = (spec.submodule_search_locations or ()) if spec is not None else ()
    return any((Path(folder) / "__main__.py").is_file() for folder in folders)


def fingerprint(lookup: Lookup, tell: Callable[[str], None] = lambda _: None) -> str | None:
    """Return the content hash that a build would have, None if ``fmus`` knows no such FMU.

    Parameters
    ----------
    lookup : Lookup
    tell : callable
        Called with its notes, as on two definitions of one name.

    Raises
    ------
    ValueError
        With the builder's own words, if it knows the name but cannot say.
    """
    arguments = ("fingerprint", "--if-known", "--watched", *lookup.arguments)
    question = (*arguments, *_surroundings(lookup))
    answer = kept_answer(question)
    if answer is None:
        asked = time.time()
        try:
            said = _fmus(*arguments, seconds=_ASK_SECONDS)
        except subprocess.TimeoutExpired:
            return None
        if said.returncode != 0:
            raise ValueError(f"cannot be built: {_reasons(said)}")
        answer, watched = _understood(said)
        keep_answer(question, answer, watched, asked)
    for note in answer.notes:
        tell(note)
    return answer.fingerprint


def _surroundings(lookup: Lookup) -> tuple[str, ...]:
    """Return what an answer of ``python -m fmus`` may depend on besides its arguments and files."""
    library = "" if lookup.library is None else os.path.realpath(lookup.library)
    named = os.environ.get("OPENPANTO_LIBRARY", "")
    return str(Path.cwd()), library, named, sys.executable, sys.version, *_places()


def _understood(said: subprocess.CompletedProcess[str]) -> tuple[Answer, list[str]]:
    """Return an answer, and the places that it depends on."""
    lines = said.stdout.splitlines()
    watched = [json.loads(line.removeprefix(_WATCHED)) for line in lines if line.startswith(_WATCHED)]
    found = [line.strip() for line in lines if line.strip() and not line.startswith(_WATCHED)]
    notes = tuple(line.removeprefix(_NOTE) for line in said.stderr.splitlines() if line.startswith(_NOTE))
    return Answer(found[-1] if found else None, notes), watched


def definition_of(path: Path) -> str:
    """Return the definition file that an FMU was built from, empty if it does not say."""
    mark = read_mark(path)
    if mark.get("definition"):
        return str(_beside(path, mark))
    return f"library: {mark['library']}" if mark.get("library") else ""


def _beside(path: Path, mark: Mapping[str, str]) -> Path:
    return Path(os.path.normpath(path.parent / mark["definition"]))


def stored_guid(path: Path) -> str:
    """Return the guid in the FMU's modelDescription.xml, empty if there is none."""
    try:
        with zipfile.ZipFile(path) as file, file.open("modelDescription.xml") as xml:
            for _, node in ElementTree.iterparse(xml, events=("start",)):
                return node.get("guid") or ""
    except _UNREADABLE:
        return ""
    return ""


def build(path: Path, lookup: Lookup) -> None:
    """Build ``path`` from the definition that ``lookup`` finds."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        advice = "XDG_CACHE_HOME names the folder for FMUs of the installed library"
        raise ValueError(f"could not be built: {path.parent} cannot be made ({error.strerror}); {advice}") from error
    try:
        answer = _fmus("build", "--out", str(path.parent), *lookup.arguments, seconds=_BUILD_SECONDS)
    except subprocess.TimeoutExpired as error:
        raise ValueError(f"could not be built: no answer within {_BUILD_SECONDS} s") from error
    if answer.returncode != 0 or not path.is_file():
        raise ValueError(f"could not be built: {_reasons(answer).removeprefix(f'{path.stem} cannot be built: ')}")


def write_runtime(folder: Path) -> None:
    """Write the Python that standalone FMUs run in into a folder.

    Raises
    ------
    ValueError
        With the builder's own words, if it cannot be made on this machine.
    """
    if not has_builder():
        raise ValueError("it needs the package fmus, which is not installed")
    try:
        answer = _fmus("runtime", "--out", str(folder), seconds=_BUILD_SECONDS)
    except subprocess.TimeoutExpired as error:
        raise ValueError(f"it could not be made: no answer within {_BUILD_SECONDS} s") from error
    if answer.returncode != 0:
        raise ValueError(_reasons(answer))


def _reasons(answer: subprocess.CompletedProcess[str]) -> str:
    """Return why it failed, a line for each mistake of a definition; of what is no such error, the last line."""
    said = (answer.stderr.strip() or answer.stdout.strip()).splitlines()
    begins = [number for number, line in enumerate(said) if line.startswith("error: ")]
    reasons = said[begins[-1] :] if begins else said[-1:]
    return "\n".join(reasons).removeprefix("error: ") or "the builder gave no reason"


def _matches(fingerprint: str, guid: str) -> bool:
    wanted, stored = (text.strip("{}").replace("-", "").lower() for text in (fingerprint, guid))
    return bool(stored) and (stored in wanted or wanted in stored)


def _fmus(*arguments: str, seconds: float) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-P", "-m", "fmus", *arguments]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(_places())}
    return subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=False, env=environment)


def _places() -> list[str]:
    """Return where modules come from: not the working folder, nor those (each with a pythonfmu) that FMUs have left."""
    own = str(Path(__file__).resolve().parents[2])
    places = [place for place in sys.path if place and not (Path(place) / "slavemodule.txt").is_file()]
    return places if own in places else [*places, own]
