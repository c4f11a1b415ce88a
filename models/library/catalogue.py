"""A name on the search path or in the library, or the path of a file, as a definition."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Final

from models.catenary.definition.line_definition import LINE_TYPES, CatenaryDefinition
from models.catenary.definition.line_reading import read as read_line
from models.definition_files.message_text import hint
from models.definition_files.toml_reader import DefinitionError, Problem, Table
from models.library import search_path
from models.library.search_path import LIBRARY, Kind, definition_files, definition_names
from models.pantograph.lumped.lumped_definition import LumpedDefinition, read_lumped
from models.pantograph.multibody.mechanism_definition import MechanismDefinition
from models.pantograph.multibody.mechanism_reading import read_mechanism

#: Types of pantograph that a definition can be of.
_TYPES: Final = ("lumped", "multibody")


class UnknownNameError(LookupError):
    """There is no line or pantograph of this name."""


def line_names() -> tuple[str, ...]:
    """Return the names of all lines of the library."""
    return definition_names("lines", [LIBRARY])


def pantograph_names() -> tuple[str, ...]:
    """Return the names of all pantographs of the library."""
    return definition_names("pantographs", [LIBRARY])


def line_path(name: str, folders: Iterable[Path] | None = None) -> Path:
    """Return the definition file of a line; ``name`` may also be the path of a file.

    Parameters
    ----------
    name : str
    folders : iterable of Path, optional
        Searched before the library; by default the search path of the working directory.

    Raises
    ------
    UnknownNameError
        If there is none; lists the known names.
    """
    return _path("lines", name, folders)


def pantograph_path(name: str, folders: Iterable[Path] | None = None) -> Path:
    """Return the definition file of a pantograph; parameters as for `line_path`.

    Raises
    ------
    UnknownNameError
        If there is none; lists the known names.
    """
    return _path("pantographs", name, folders)


def load_line(name: str) -> CatenaryDefinition:
    """Read a line by its name or file; raises ``UnknownNameError`` or ``DefinitionError``."""
    table = Table.load(line_path(name))
    if (kind := table.data.get("type")) in _TYPES:  # read as a line, every other key would be wrong
        raise DefinitionError([Problem(table.file, "type", f"'{kind}' is a pantograph's: name a line here")])
    return read_line(table)


def load_pantograph(name: str) -> LumpedDefinition | MechanismDefinition:
    """Read a pantograph of any kind by its name or file; raises ``UnknownNameError`` or ``DefinitionError``."""
    table = Table.load(pantograph_path(name))
    kind = table.data.get("type", "")
    if isinstance(kind, str) and kind and kind not in _TYPES:  # read as one of these, every other key would be wrong
        other = "; it is a line's: name a pantograph here" if kind in LINE_TYPES else hint(kind, _TYPES)
        text = f"'{kind}' is none of {', '.join(_TYPES)}{other}"
        raise DefinitionError([Problem(table.file, "type", text)])
    return read_mechanism(table) if kind == "multibody" else read_lumped(table)


def load_lumped(name: str) -> LumpedDefinition:
    """Read a lumped pantograph by its name or file.

    Raises
    ------
    UnknownNameError
        If there is none of the name, or it is of another kind.
    DefinitionError
        With every mistake of the file.
    """
    definition = load_pantograph(name)
    if not isinstance(definition, LumpedDefinition):
        raise UnknownNameError(f"pantograph '{name}' is a multibody model where a lumped one is needed")
    return definition


def doubts(kind: Kind, name: str) -> list[str]:
    """Return what deserves a second look when a definition is called by its name, or by its file."""
    if name.lower().endswith(".toml"):
        return [text for text in (search_path.named_otherwise(Path(name)),) if text]
    return search_path.doubts(kind, name, [*search_path.search_path(), LIBRARY])


def _path(kind: Kind, name: str, folders: Iterable[Path] | None) -> Path:
    if name.lower().endswith(".toml"):
        return Path(name)
    searched = [*(search_path.search_path() if folders is None else folders), LIBRARY]
    found = definition_files(kind, name, searched)
    if not found:
        known = definition_names(kind, searched)
        other: Kind = "pantographs" if kind == "lines" else "lines"
        advice = f"; it is a {other[:-1]}" if definition_files(other, name, searched) else hint(name, known)
        if name and (inside := definition_names(kind, [Path(name)])):
            advice = f"; {name} is a project: name its file, {Path(name, kind, inside[0]).as_posix()}.toml"
        text = f"no {kind.removesuffix('s')} '{name}' in the library; known: {', '.join(known)}{advice}"
        if absent := search_path.absent_folders():
            text += f"; {absent}"
        raise UnknownNameError(text)
    return found[0]
