"""The tunable numbers of a definition: value, unit, range and source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class Parameter:
    """A number in a definition that a user may change.

    Attributes
    ----------
    name : str
        Dotted name, the key of the definition file (``contact_wire.tension``).
    value : float
        Start value, in ``unit``.
    unit : str
        SI unit, a key of ``models.definition_files.si_units.SI`` that maps to itself.
    description : str
        What it is, in one line.
    minimum, maximum : float or None
        Allowed range, if any.
    source : str
        Source of the start value; begins with ``choice`` where the data leave it open.
    is_integer : bool
        Whether only whole numbers make sense.
    """

    name: str
    value: float
    unit: str
    description: str
    minimum: float | None = None
    maximum: float | None = None
    source: str = ""
    is_integer: bool = False


class ParameterError(ValueError):
    """A parameter value that the model cannot accept; the message gives name, value and allowed range."""


class Definition(Protocol):
    """A checked, frozen description of a line or a pantograph, in SI."""

    @property
    def name(self) -> str:
        """Return the name, as in the library and in the FMU's name."""

    def parameters(self) -> tuple[Parameter, ...]:
        """Return every tunable number."""

    def with_values(self, values: Mapping[str, float]) -> Definition:
        """Return a copy with some parameters changed; raises ``ParameterError``."""
