"""The parts of a system structure description, as written."""

from __future__ import annotations

from dataclasses import dataclass, field

from master.ssp.ssp_units import Conversion
from master.ssp.ssv import ParameterSet


@dataclass(frozen=True)
class Connector:
    """A declared variable of a component or system; ``type`` is empty when the file leaves it to the FMU.

    ``enumeration`` names the declared enumeration that an Enumeration is of.
    """

    name: str
    kind: str
    type: str
    unit: str
    line: int
    enumeration: str = ""


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
class Stop:
    """A system's connector that leads to a component's.

    Attributes
    ----------
    system : str
        Path of the system, empty for the whole.
    connector : Connector
    legs : tuple of Leg
        From there to the component; the last one ends at the component's connector.
    """

    system: str
    connector: Connector
    legs: tuple[Leg, ...]

    @property
    def full_name(self) -> str:
        """Name of the connector as parameter sets write it."""
        return f"{self.system}.{self.connector.name}" if self.system else self.connector.name


@dataclass(frozen=True)
class Feed:
    """What leads to a component's input or parameter through connectors of systems.

    Attributes
    ----------
    element, connector : str
        Component, and its connector.
    stops : tuple of Stop
        Connectors of systems on the way, the outermost first.
    is_fed : bool
        Whether a component's output stands at its beginning.
    """

    element: str
    connector: str
    stops: tuple[Stop, ...]
    is_fed: bool


@dataclass(frozen=True)
class Joint:
    """A connection as written that touches a system's connector: the connectors at both ends.

    ``component`` and ``other_component`` name the components that they belong to, empty for a system's.
    """

    component: str
    connector: Connector
    other_component: str
    other: Connector
    suppress_unit_conversion: bool
    line: int


@dataclass(frozen=True)
class SystemNode:
    """A system with what is in it."""

    name: str
    connectors: tuple[Connector, ...]
    components: tuple[Component, ...]
    systems: tuple[SystemNode, ...]
    connections: tuple[Connection, ...]
    bindings: tuple[Binding, ...]
    line: int = 0


NO_SYSTEM = SystemNode("", (), (), (), (), ())
