"""The parts of a system structure description, as written."""

from __future__ import annotations

from dataclasses import dataclass, field

from master.ssp.ssv import ParameterSet
from master.ssp.units import Conversion


@dataclass(frozen=True)
class Connector:
    """A declared variable of a component or system; ``type`` is empty when the file leaves it to the FMU."""

    name: str
    kind: str
    type: str
    unit: str
    line: int


@dataclass(frozen=True)
class Binding:
    """A parameter binding: values for parameters named relative to its element, after ``prefix``."""

    prefix: str
    parameters: ParameterSet
    line: int


@dataclass(frozen=True)
class Component:
    """An FMU in the system."""

    name: str
    source: str
    connectors: tuple[Connector, ...]
    bindings: tuple[Binding, ...]
    line: int


@dataclass(frozen=True)
class Leg:
    """A part of a connection that leads through connectors of systems.

    Attributes
    ----------
    unit : str
        Unit of the connector that it ends at, empty if that leaves it open.
    transformation : Conversion
        Of the value in that unit.
    suppress_unit_conversion : bool
    line : int
    """

    unit: str
    transformation: Conversion
    suppress_unit_conversion: bool
    line: int


@dataclass(frozen=True)
class Connection:
    """Connection of two connectors as written: its direction follows from the connectors' kinds.

    ``before`` holds what comes before its last part, if it leads through connectors of systems.
    """

    start_element: str
    start_connector: str
    end_element: str
    end_connector: str
    transformation: Conversion
    suppress_unit_conversion: bool
    line: int
    before: tuple[Leg, ...] = field(default=())


@dataclass(frozen=True)
class SystemNode:
    """A system with what is in it."""

    name: str
    connectors: tuple[Connector, ...]
    components: tuple[Component, ...]
    systems: tuple[SystemNode, ...]
    connections: tuple[Connection, ...]
    bindings: tuple[Binding, ...]


NO_SYSTEM = SystemNode("", (), (), (), (), ())
