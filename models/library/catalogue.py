"""A name in the library, or the path of a file, as a definition."""

from __future__ import annotations

from pathlib import Path

from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.line_reading import load as load_line_file
from models.definition_files.toml_reader import Table
from models.pantograph.lumped.lumped_definition import LumpedDefinition, read_lumped
from models.pantograph.multibody.mechanism_definition import MechanismDefinition
from models.pantograph.multibody.mechanism_reading import read_mechanism

_HERE = Path(__file__).parent


class UnknownNameError(LookupError):
    """The library has no line or pantograph of this name."""


def line_names() -> tuple[str, ...]:
    """Return the names of all lines."""
    return _names("lines")


def pantograph_names() -> tuple[str, ...]:
    """Return the names of all pantographs."""
    return _names("pantographs")


def line_path(name: str) -> Path:
    """Return the definition file of a line; ``name`` may also be the path of a file.

    Raises
    ------
    UnknownNameError
        If there is none; lists the known names.
    """
    return _path("lines", "line", name)


def pantograph_path(name: str) -> Path:
    """Return the definition file of a pantograph; ``name`` may also be the path of a file.

    Raises
    ------
    UnknownNameError
        If there is none; lists the known names.
    """
    return _path("pantographs", "pantograph", name)


def load_line(name: str) -> CatenaryDefinition:
    """Read a line by its name or file; raises ``UnknownNameError`` or ``DefinitionError``."""
    return load_line_file(line_path(name))


def load_pantograph(name: str) -> LumpedDefinition | MechanismDefinition:
    """Read a pantograph of any kind by its name or file; raises ``UnknownNameError`` or ``DefinitionError``."""
    table = Table.load(pantograph_path(name))
    return read_mechanism(table) if table.data.get("type") == "multibody" else read_lumped(table)


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


def _names(folder: str) -> tuple[str, ...]:
    return tuple(sorted(p.stem for p in (_HERE / folder).glob("*.toml")))


def _path(folder: str, kind: str, name: str) -> Path:
    path = Path(name)
    if path.suffix == ".toml":
        return path
    path = _HERE / folder / f"{name}.toml"
    if name not in _names(folder):
        raise UnknownNameError(f"no {kind} '{name}' in the library; known: {', '.join(_names(folder))}")
    return path
