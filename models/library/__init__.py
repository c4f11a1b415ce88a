"""Definitions of lines and pantographs, one readable file each."""

from __future__ import annotations

from pathlib import Path

from models.catenary.parameters import CatenaryDefinition
from models.catenary.parameters import load as load_line_file
from models.pantograph.parameters import LumpedDefinition, load_lumped

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


def load_pantograph(name: str) -> LumpedDefinition:
    """Read a lumped pantograph by its name or file; raises ``UnknownNameError`` or ``DefinitionError``."""
    return load_lumped(pantograph_path(name))


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
