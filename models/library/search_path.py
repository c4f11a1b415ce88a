"""Where definitions are looked up before the library: the project one stands in, and folders named by the user.

Each folder may hold ``lines/NAME.toml`` and ``pantographs/NAME.toml``.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Final, Literal, get_args

from models.definition_files.message_text import one_line

Kind = Literal["lines", "pantographs"]
#: The definitions that come along.
LIBRARY: Final = Path(__file__).resolve().parent
#: The file that marks a project's folder.
PROJECT_FILE: Final = "openpanto.toml"
#: The environment variable that names further folders, separated as in ``PATH``.
VARIABLE: Final = "OPENPANTO_LIBRARY"


def project_folder(start: Path) -> Path | None:
    """Return the folder of the project that ``start`` lies in, None if it lies in none."""
    start = start.resolve()
    return next((folder for folder in (start, *start.parents) if (folder / PROJECT_FILE).is_file()), None)


def search_path(*starts: Path) -> tuple[Path, ...]:
    """Return the folders in which definitions are looked up before the library, the first one first.

    Each of ``starts`` (by default the working directory) with its parents up to the project, if it lies in one; then
    those of ``OPENPANTO_LIBRARY``.
    """
    found: list[Path] = []
    for start in starts or (Path(),):
        folder, project = start.resolve(), project_folder(start)
        found.append(folder)
        if project is not None:
            found += [parent for parent in folder.parents if parent.is_relative_to(project)]
    named = os.environ.get(VARIABLE, "").split(os.pathsep)
    return tuple(dict.fromkeys([*found, *(Path(name).resolve() for name in named if name)]))


def definition_files(kind: Kind, name: str, folders: Iterable[Path]) -> list[Path]:
    """Return the definitions of a name in these folders; the first one counts."""
    # Looked up, not made into a path: a name could lead out of the folder.
    return [path for folder in folders for path in _files(folder / kind) if path.stem == name]


def definition_names(kind: Kind, folders: Iterable[Path]) -> tuple[str, ...]:
    """Return the names that these folders have definitions for."""
    return tuple(sorted({path.stem for folder in folders for path in _files(folder / kind)}))


def doubles(files: list[Path]) -> str:
    """Return which of several definitions of one name is used, empty if there is one.

    Examples
    --------
    >>> doubles([Path("demo/lines/A.toml"), Path("lines/A.toml")])
    "two definitions are named 'A': demo/lines/A.toml is used, lines/A.toml is not"
    """
    if len(files) < 2:
        return ""
    rest = " and ".join(map(str, files[1:]))
    number = "two" if len(files) == 2 else f"{len(files)}"
    return f"{number} definitions are named '{files[0].stem}': {files[0]} is used, {rest} {_verb(files[1:])} not"


def doubts(kind: Kind, name: str, folders: Iterable[Path]) -> list[str]:
    """Return what deserves a second look when a definition is called by its name, a sentence each.

    That are several definitions of the name, one whose ``name`` is another than its file's, and folders named in
    ``OPENPANTO_LIBRARY`` that are not there, or have none of the folders that definitions lie in.
    """
    found = definition_files(kind, name, folders)
    return [text for text in (doubles(found), *map(named_otherwise, found[:1]), absent_folders()) if text]


def named_otherwise(path: Path) -> str:
    """Return that a definition is named otherwise than its file, empty if not or if it cannot be read."""
    try:
        name = tomllib.loads(path.read_text(encoding="utf-8-sig")).get("name")
    except (OSError, ValueError):
        return ""  # reading the definition says why
    if not isinstance(name, str) or name == path.stem:
        return ""
    return f"{path} is called '{path.stem}', as its file is, not {one_line(repr(name))}, its name: give both the same"


def absent_folders() -> str:
    """Return which folders in ``OPENPANTO_LIBRARY`` are not there, or hold no definitions; empty if all do."""
    named = [name for name in os.environ.get(VARIABLE, "").split(os.pathsep) if name]
    if absent := [name for name in named if not Path(name).is_dir()]:
        return f"{VARIABLE} names no folder with {', '.join(map(repr, absent))}: correct it"
    if bare := [name for name in named if not any(Path(name, kind).is_dir() for kind in get_args(Kind))]:
        return f"{VARIABLE} names {', '.join(map(repr, bare))}, with no folder lines or pantographs in it: correct it"
    return ""


def _files(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.toml"))


def _verb(files: list[Path]) -> str:
    return "is" if len(files) == 1 else "are"
