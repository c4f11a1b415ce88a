"""Which variables a run records how often, and the recorders that do so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

from master.arrays import FloatArray
from master.coupling.network import Network
from master.recording.recorder import RecordedValues, Recorder
from master.recording.recording import TIMESERIES
from master.system.components import Component, System, Variable
from master.system.step_rounding import is_recordable, record_of, steps_in
from master.system.variable_names import ON_REQUEST, matcher


class Readable(Protocol):
    """Variables that are read together into an array."""

    values: FloatArray

    def read(self) -> None:
        """Fill `values`."""


@runtime_checkable
class Recordable(Protocol):
    """A slave with more variables than those that are exchanged."""

    name: str
    stepping_time: float

    def group(self, names: Sequence[str]) -> Readable:
        """Return a group for further variables."""


@runtime_checkable
class Companion(Protocol):
    """A slave that can read further variables together with its outputs."""

    def read_along(self, names: Sequence[str]) -> FloatArray:
        """Return where further variables are from now on."""


@dataclass(frozen=True)
class RecordingPlan:
    """Which variables are recorded how often.

    Attributes
    ----------
    every : int
        Steps between rows.
    names : dict
        Variable names by component.
    """

    every: int
    names: dict[str, list[str]]


def recording_plans(system: System) -> tuple[RecordingPlan, ...]:
    """Return what is recorded, and how often, besides the exchanged outputs; the plan for every step comes first.

    Exchanged outputs are always recorded at every step, all other outputs too unless an entry of the settings says
    otherwise, and local variables, and the outputs that are computed on request, only if an entry names them; texts
    are not recorded.
    """
    by_rate: dict[int, dict[str, list[str]]] = {1: {}}
    for component in system.components:
        for variable in component.fmu.variables.values():
            every = _steps_between_rows(component, variable, system)
            if every:
                by_rate.setdefault(every, {}).setdefault(component.name, []).append(variable.name)
    return tuple(RecordingPlan(rate, by_rate[rate]) for rate in sorted(by_rate))


def _steps_between_rows(component: Component, variable: Variable, system: System) -> int:
    """Return how often a variable is recorded, 0 for never (or with the exchanged ones)."""
    if not is_recordable(component, variable):
        return 0
    record = record_of(f"{component.name}.{variable.name}", system.settings.records)
    if record is None:
        return 1 if variable.causality == "output" and not _is_on_request(variable.name) else 0
    return steps_in(record.every, system.step)


def _is_on_request(name: str) -> bool:
    return any(matcher(pattern)(name) for pattern in ON_REQUEST)


def recording_name(plan: RecordingPlan, step: float) -> str:
    """Return the name of a plan's file."""
    return TIMESERIES if plan.every == 1 else f"timeseries_{1e3 * plan.every * step:g}ms.csv"


def make_recorder(
    system: System, network: Network, plan: RecordingPlan, folder: Path, made: int | None, is_steady: bool
) -> Recorder:
    """Return the recorder of a plan; ``made`` is the number of steps whose rows its file holds already."""
    sources = [_exchanged(system, network)] if plan.every == 1 else []
    units: dict[str, str] = {}
    for component, slave in zip(system.components, network.slaves, strict=True):
        units |= {f"{component.name}.{v.name}": v.unit for v in component.fmu.variables.values()}
        names = plan.names.get(component.name, [])
        full_names = [f"{component.name}.{n}" for n in names]
        if names and plan.every == 1 and isinstance(slave, Companion):
            sources.append(RecordedValues(full_names, slave.read_along(names)))
        elif names and isinstance(slave, Recordable):
            group = slave.group(names)
            sources.append(RecordedValues(full_names, group.values, group.read))
    keep = 0 if made is None else made // plan.every + 1
    return Recorder(folder / recording_name(plan, system.step), sources, units, plan.every, keep, is_steady)


def _exchanged(system: System, network: Network) -> RecordedValues:
    """Return the exchanged outputs; texts have no column."""
    texts = {f"{c.name}.{n}" for c in system.components for n in c.texts}
    places = [i for i, name in enumerate(network.output_names) if name not in texts]
    if len(places) == len(network.output_names):
        return RecordedValues(network.output_names, network.outputs)
    values = network.outputs[places]

    def read() -> None:
        values[:] = network.outputs[places]

    return RecordedValues([network.output_names[i] for i in places], values, read)
