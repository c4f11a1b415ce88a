"""A line and a pantograph from their definitions, with values to look at and copies in which some are changed."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.section_definition import Span
from models.definition_files.given_value import in_si
from models.definition_files.parameter import Definition, Parameter, ParameterError
from models.library import catalogue
from models.library.search_path import Kind
from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.multibody.mechanism_definition import MechanismDefinition


@dataclass(frozen=True)
class Line:
    """An overhead contact line; `open_line` makes it, `set` returns changed copies.

    Attributes
    ----------
    definition : CatenaryDefinition
        Its whole description, in SI; no promise is kept for this attribute.
    """

    definition: CatenaryDefinition = field(repr=False)

    def __repr__(self) -> str:
        return f"<Line {self.name}: {self.title}>"

    @property
    def name(self) -> str:
        """Name, as in its file."""
        return self.definition.name

    @property
    def title(self) -> str:
        """What it is, in a line."""
        return self.definition.title

    @property
    def spans(self) -> tuple[Span, ...]:
        """Spans of the first section, each with ``start``, ``end`` and positions of ``droppers`` [m]."""
        return self.definition.sections[0].spans

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Every number that can be set, by name, with value and unit (SI), description and source."""
        return {p.name: p for p in self.definition.parameters()}

    def set(self, values: Mapping[str, float | str] | None = None, /, **parameters: float | str) -> Line:
        """Return the line with other values; this one stays as it is.

        Parameters
        ----------
        values : mapping, optional
            Numbers in SI, or texts with a unit, by name: ``{"contact_wire.tension": "22 kN"}``.
        **parameters
            The same for names without dots.

        Raises
        ------
        ParameterError
            If a name is unknown, or its value has a wrong unit or is out of range.

        Examples
        --------
        >>> line = open_line("LN2").set({"contact_wire.tension": "22 kN"})
        >>> line.parameters["contact_wire.tension"].value
        22000.0
        """
        return Line(self.definition.with_values(_in_si(self.definition, {**(values or {}), **parameters})))


@dataclass(frozen=True)
class Pantograph:
    """A pantograph, lumped or multibody; `open_pantograph` makes it, `set` returns changed copies.

    Attributes
    ----------
    definition : LumpedDefinition or MechanismDefinition
        Its whole description, in SI; no promise is kept for this attribute.
    """

    definition: LumpedDefinition | MechanismDefinition = field(repr=False)

    def __repr__(self) -> str:
        return f"<Pantograph {self.name}: {self.title}>"

    @property
    def name(self) -> str:
        """Name, as in its file."""
        return self.definition.name

    @property
    def title(self) -> str:
        """What it is, in a line."""
        return self.definition.title

    @property
    def is_lumped(self) -> bool:
        """Whether it is a chain of masses, which `couple` needs."""
        return isinstance(self.definition, LumpedDefinition)

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Every number that can be set, by name, with value and unit (SI), description and source."""
        return {p.name: p for p in self.definition.parameters()}

    def set(self, values: Mapping[str, float | str] | None = None, /, **parameters: float | str) -> Pantograph:
        """Return the pantograph with other values; this one stays as it is. See `Line.set`.

        Examples
        --------
        >>> open_pantograph("CX").set(static_force="0.16 kN").parameters["static_force"].value
        160.0
        """
        return Pantograph(self.definition.with_values(_in_si(self.definition, {**(values or {}), **parameters})))


def open_line(name: str | Path) -> Line:
    """Return a line by its name in the library, or by the path of its file.

    Raises
    ------
    UnknownNameError
        If there is none of the name.
    DefinitionError
        With every mistake in the file.

    Examples
    --------
    >>> line = open_line("LN2")
    >>> line.spans[0].length, line.parameters["contact_wire.tension"].unit
    (45.0, 'N')
    """
    _tell_doubts("lines", str(name))
    return Line(catalogue.load_line(str(name)))


def open_pantograph(name: str | Path) -> Pantograph:
    """Return a pantograph by its name in the library, or by the path of its file; raises as `open_line` does.

    Examples
    --------
    >>> open_pantograph("CX").is_lumped
    True
    """
    _tell_doubts("pantographs", str(name))
    return Pantograph(catalogue.load_pantograph(str(name)))


def _tell_doubts(kind: Kind, name: str) -> None:
    """Warn of what deserves a second look, as on two definitions of the name."""
    for text in catalogue.doubts(kind, name):
        warnings.warn(text, stacklevel=3)


def _in_si(definition: Definition, given: Mapping[str, float | str]) -> dict[str, float]:
    units = {p.name: p.unit for p in definition.parameters()}
    return {name: _value(name, value, units.get(name)) for name, value in given.items()}


def _value(name: str, value: float | str, unit: str | None) -> float:
    try:
        return in_si(value, unit)
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{name} = {value}: {error}") from error
