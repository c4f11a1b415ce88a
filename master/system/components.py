"""What is coupled to what: the checked, frozen description of a system of FMUs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

from master.errors import RequestError
from master.ssp.ssp_units import Unit
from master.ssp.ssv import Value
from master.system.connections import Connection
from master.system.contacts import Contact, find_contacts

if TYPE_CHECKING:  # the processes of isolated FMUs do without pydantic, a third of what they import
    from master.ssp.run_settings import RunSettings

#: Share of a step by which the stop time may miss a whole number of steps by rounding.
_ROUNDING: Final = 1e-6


@dataclass(frozen=True)
class Variable:
    """A variable of an FMU, as its modelDescription.xml declares it.

    ``initial`` is that of the standard where the file leaves it open; ``items`` are those of an enumeration;
    ``is_difference`` marks a relative quantity, to which the offset of its unit does not apply.
    """

    name: str
    reference: int
    type: str
    causality: str
    variability: str
    unit: str
    start: str | None
    minimum: float | None
    maximum: float | None
    description: str = ""
    initial: str = ""
    items: tuple[tuple[str, int], ...] = ()
    is_difference: bool = False


@dataclass(frozen=True)
class Fmu:
    """What the master needs to know of an FMU file.

    Attributes
    ----------
    path : Path
        The file.
    guid, identifier : str
        Of its co-simulation interface.
    variables : dict
        Declared variables by name.
    can_restore : bool
        Whether it can save and restore its state.
    can_serialise : bool
        Whether it can do so as bytes.
    sha256 : str
        Hash of the file.
    tool : str
        Generation tool.
    units : dict
        Units that it defines, by name.
    tolerance : float, optional
        Of its default experiment.
    is_single : bool
        Whether a process can hold only one instance of it.
    definition : str
        Definition file that one of ours was built from, as it says itself.
    description : str
        What it says that it is.
    """

    path: Path
    guid: str
    identifier: str
    variables: dict[str, Variable]
    can_restore: bool
    sha256: str
    tool: str
    can_serialise: bool = False
    units: dict[str, Unit] = field(default_factory=dict)
    tolerance: float | None = None
    is_single: bool = False
    definition: str = ""
    description: str = ""


@dataclass(frozen=True)
class Component:
    """An FMU in the system: its name, parameter values (in the FMU's units) and exchanged variables.

    ``tolerance`` is passed to the FMU when the experiment is set up; None for none.
    """

    name: str
    fmu: Fmu
    parameters: dict[str, Value]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    tolerance: float | None = None

    @property
    def texts(self) -> tuple[str, ...]:
        """Exchanged variables that are strings."""
        return tuple(n for n in (*self.inputs, *self.outputs) if self.fmu.variables[n].type == "String")


@dataclass(frozen=True)
class System:
    """A runnable system.

    Attributes
    ----------
    name : str
        The scenario's name.
    components : tuple of Component
        In the order of the SSD.
    connections : tuple of Connection
        In the order of the SSD.
    start, stop, step : float
        Start time, stop time and macro step [s].
    settings : RunSettings
        Coupling, interval of interest, calibration, recording.
    warnings : tuple of str
        What in the scenario can be run but may not be intended.
    may_stop_early : bool
        Whether the stop time may lie before the end of the interval of interest: nothing is judged then.
    title : str
        What the scenario says that it is.
    changes : mapping
        Parameter values that are not the scenario's own, as they were given.
    """

    name: str
    components: tuple[Component, ...]
    connections: tuple[Connection, ...]
    start: float
    stop: float
    step: float
    settings: RunSettings
    warnings: tuple[str, ...] = ()
    may_stop_early: bool = False
    title: str = ""
    changes: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def contacts(self) -> tuple[Contact, ...]:
        """Where pantographs meet the wire, in the order of the catenary's ports."""
        return find_contacts(self.connections)

    @property
    def discrete(self) -> frozenset[str]:
        """Names of exchanged outputs that are not Real, whose values cannot be interpolated."""
        return frozenset(
            f"{c.name}.{n}" for c in self.components for n in c.outputs if c.fmu.variables[n].type != "Real"
        )

    def component(self, name: str) -> Component:
        """Return a component by its name."""
        return next(c for c in self.components if c.name == name)

    @property
    def step_count(self) -> int:
        """Number of macro steps: the last one ends at the stop time, or less than a step before it."""
        return max(1, math.floor((self.stop - self.start) / self.step + _ROUNDING))


def without(system: System, names: Sequence[str]) -> System:
    """Return a system without some components; what they were connected to keeps its start values.

    Raises
    ------
    RequestError
        If there is no such component.
    """
    for name in names:
        if name not in {c.name for c in system.components}:
            raise RequestError(f"the scenario has no component '{name}', which a column of the table names")
    coupling = system.settings.coupling
    order = tuple(name for name in coupling.order if name not in names)
    settings = system.settings.model_copy(update={"coupling": coupling.model_copy(update={"order": order})})
    connections = tuple(c for c in system.connections if c.source not in names and c.target not in names)
    left = [c for c in system.components if c.name not in names]
    exchanged = {(c.source, c.output) for c in connections} | {(c.target, c.input) for c in connections}
    components = tuple(_trimmed(c, exchanged) for c in left)
    return replace(system, components=components, connections=connections, settings=settings)


def _trimmed(component: Component, exchanged: set[tuple[str, str]]) -> Component:
    inputs, outputs = (
        tuple(v for v in names if (component.name, v) in exchanged) for names in (component.inputs, component.outputs)
    )
    return replace(component, inputs=inputs, outputs=outputs)
