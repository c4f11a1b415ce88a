"""One run of a scenario: load, couple, record, assess, write."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from master import results
from master.algorithm import make_algorithm
from master.checkpoint import NAME as CHECKPOINT
from master.checkpoint import CheckpointObserver, Continuation, index_at
from master.contacts import Contact, find_contacts
from master.errors import InterruptedRunError, MasterError, RunError
from master.instance import Instance
from master.interface import PowerObserver
from master.line import GeometryObserver
from master.network import Network
from master.recorder import Recorder, Source, matcher
from master.results import Results
from master.simulation import Observer, Outcome, TimeGrid, interruptible, simulate
from master.ssp.annotation import Record
from master.system import Component, System, Variable
from master.watch import ContactWatch

_MEASURED: Final = ("output", "local")


@dataclass(frozen=True)
class Plan:
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


@dataclass(frozen=True)
class Timing:
    """Wall time of a run [s]: initialization, and stepping with recording."""

    initialisation: float
    stepping: float


def run(
    system: System,
    folder: Path,
    observers: Sequence[Observer] = (),
    checkpoint: float | None = None,
    continuation: Continuation | None = None,
) -> Results:
    """Run a system and leave its results in ``folder``.

    Parameters
    ----------
    system : System
        What to run.
    folder : Path
        Results folder; made, or emptied if it is ours.
    observers : sequence of Observer
        Further observers (progress).
    checkpoint : float, optional
        When the whole state is to be written to the folder [s].
    continuation : Continuation, optional
        Where the run goes on from, instead of its beginning.

    Raises
    ------
    RunError
        If the run stops before its end; what was computed is in the folder then.
    UsageError
        If checkpoint or continuation do not fit the system.
    """
    save_at = None if checkpoint is None else index_at(system, checkpoint)
    if continuation is not None:
        continuation.check(system)
    results.prepare(folder)
    results.write_json(folder / results.SUMMARY, {**_description(system, ()), "status": "running"})
    with _failure_noted(system, folder), loaded(system) as network, interruptible() as stop_wanted:
        session = _Session(system, network, folder, continuation)
        algorithm = make_algorithm(system.settings.coupling)
        watchers = [*session.observers, *observers]
        if save_at is not None:
            watchers.append(CheckpointObserver(system, algorithm, folder / CHECKPOINT, save_at))
        way_in = {} if continuation is None else {"prepare": continuation.prepare}
        outcome = simulate(network, algorithm, session.grid, watchers, stop_wanted, **way_in)
    done = session.conclude(outcome)
    if outcome.status != "complete":
        kind = InterruptedRunError if outcome.status == "interrupted" else RunError
        raise kind(_what_happened(outcome, folder)) from outcome.error
    return done


@contextmanager
def _failure_noted(system: System, folder: Path) -> Iterator[None]:
    """Mark the folder's summary as failed if the run does not even begin."""
    try:
        yield
    except MasterError as error:
        ending = _ending(Outcome("failed", 0, system.start, error))
        results.write_json(folder / results.SUMMARY, {**_description(system, ()), **ending})
        raise


@contextmanager
def loaded(system: System) -> Iterator[Network]:
    """Load the FMUs of a system and connect them; they are freed afterwards."""
    instances: list[Instance] = []
    try:
        for component in system.components:
            instances.append(Instance(component))  # noqa: PERF401 - those loaded so far must be freed on failure
        yield Network(instances, system.connections)
    finally:
        for instance in reversed(instances):
            instance.close()


def recording_plans(system: System) -> tuple[Plan, ...]:
    """Return what is recorded how often besides the exchanged outputs; the plan for every step comes first.

    Exchanged outputs are always recorded at every step, all other Real outputs too unless an entry of the
    settings says otherwise, and local variables only if an entry names them.
    """
    by_rate: dict[int, dict[str, list[str]]] = {1: {}}
    for component in system.components:
        for variable in component.fmu.variables.values():
            every = _steps_between_rows(component, variable, system)
            if every:
                by_rate.setdefault(every, {}).setdefault(component.name, []).append(variable.name)
    return tuple(Plan(rate, by_rate[rate]) for rate in sorted(by_rate))


def _steps_between_rows(component: Component, variable: Variable, system: System) -> int:
    """Return how often a variable is recorded, 0 for never (or with the exchanged ones)."""
    if variable.type != "Real" or variable.causality not in _MEASURED or variable.name in component.outputs:
        return 0
    record = _last_match(f"{component.name}.{variable.name}", system.settings.records)
    if record is None:
        return 1 if variable.causality == "output" else 0
    return max(1, round(record.every / system.step))


def recording_name(plan: Plan, step: float) -> str:
    """Return the name of a plan's file."""
    return results.TIMESERIES if plan.every == 1 else f"timeseries_{1e3 * plan.every * step:g}ms.csv"


class Stopwatch:
    """Observer that measures the wall time of initialization and of stepping."""

    def __init__(self) -> None:
        self._created = time.perf_counter()
        self._began: float | None = None
        self._ended: float | None = None

    def begin(self, start: float, network: Network) -> None:
        """Stepping begins."""
        self._began = time.perf_counter()

    def observe(self, index: int, end: float, network: Network) -> None:
        """Nothing to measure."""

    def finish(self) -> None:
        """Stepping has ended."""
        self._ended = time.perf_counter()

    @property
    def timing(self) -> Timing:
        """What was measured."""
        ended = self._ended if self._ended is not None else time.perf_counter()
        began = self._began if self._began is not None else ended
        return Timing(began - self._created, ended - began)


class _Session:
    """The observers of a run and what is made of them in the end."""

    def __init__(
        self, system: System, network: Network, folder: Path, continuation: Continuation | None = None
    ) -> None:
        self._system = system
        self._continuation = continuation
        whole = TimeGrid(system.start, system.step, system.step_count)
        self.grid = whole if continuation is None else continuation.grid(system)
        self._network = network
        self._folder = folder
        self._contacts = find_contacts(system.connections)
        self._plans = recording_plans(system)
        self._recorders = [_recorder(system, network, plan, folder) for plan in self._plans]
        self._geometry = GeometryObserver(system)
        self._power = PowerObserver(self._contacts, network, system.step_count)
        self._contact_watch = ContactWatch(self._contacts, network)
        self._stopwatch = Stopwatch()

    @property
    def observers(self) -> list[Observer]:
        """All of them."""
        return [self._geometry, *self._recorders, self._power, self._stopwatch, self._contact_watch]

    def conclude(self, outcome: Outcome) -> Results:
        """Write geometry and summary and return the results."""
        recordings = tuple(r.recording for r in self._recorders)
        description = _description(self._system, self._contacts)
        done = Results(self._folder, description, recordings, self._geometry.geometry)
        summary = {
            **description,
            **_ending(outcome),
            **_origin(self._continuation),
            **results.figures(done.assessments(), done.uplifts, done.followings),
            "interface_power": [asdict(p) for p in self._power.summary(self._system.step)],
            "performance": {
                **_performance(self._stopwatch.timing, outcome.time - self.grid.begin),
                "component_time": {s.name: s.stepping_time for s in self._network.slaves if isinstance(s, Instance)},
            },
            "recordings": [recording_name(p, self._system.step) for p in self._plans],
        }
        results.write_json(self._folder / results.GEOMETRY, self._geometry.geometry)
        results.write_json(self._folder / results.SUMMARY, summary)
        return replace(done, summary=summary)


def _origin(continuation: Continuation | None) -> dict[str, Any]:
    if continuation is None:
        return {}
    c = continuation
    return {"resumed": {"file": c.file, "time": c.checkpoint.time, "renewed": list(c.renewed)}}


def _performance(timing: Timing, simulated: float) -> dict[str, float]:
    return {
        "initialisation_time": timing.initialisation,
        "wall_time": timing.stepping,
        "real_time_factor": simulated / timing.stepping if timing.stepping > 0 else 0.0,
        "peak_memory": results.peak_memory(),
    }


def _recorder(system: System, network: Network, plan: Plan, folder: Path) -> Recorder:
    sources = [Source(network.output_names, network.outputs)] if plan.every == 1 else []
    units: dict[str, str] = {}
    for component, slave in zip(system.components, network.slaves, strict=True):
        units |= {f"{component.name}.{v.name}": v.unit for v in component.fmu.variables.values()}
        names = plan.names.get(component.name, [])
        if names and isinstance(slave, Instance):
            group = slave.group(names)
            sources.append(Source([f"{component.name}.{n}" for n in names], group.values, group.read))
    rows = system.step_count // plan.every + 1
    return Recorder(folder / recording_name(plan, system.step), sources, units, rows, plan.every)


def _last_match(name: str, records: Sequence[Record]) -> Record | None:
    fits = [r for r in records if any(matcher(p)(name) for p in r.variables)]
    return fits[-1] if fits else None


def _description(system: System, contacts: Sequence[Contact]) -> dict[str, Any]:
    return {
        "generator": results.GENERATOR,
        "scenario": system.name,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": results.versions(),
        "settings": {
            "start": system.start,
            "stop": system.stop,
            "step": system.step,
            **system.settings.model_dump(mode="json"),
        },
        "components": [_component(c) for c in system.components],
        "contacts": [asdict(c) for c in contacts],
    }


def _component(component: Component) -> dict[str, Any]:
    fmu = component.fmu
    return {
        "name": component.name,
        "fmu": fmu.path.name,
        "guid": fmu.guid,
        "sha256": fmu.sha256,
        "tool": fmu.tool,
        "parameters": component.parameters,
        "inputs": [_input(component, v) for v in fmu.variables.values() if v.causality == "parameter"],
    }


def _input(component: Component, variable: Variable) -> dict[str, Any]:
    return {
        "name": variable.name,
        "value": component.parameters.get(variable.name, variable.start),
        "unit": variable.unit,
        "description": variable.description,
        "changed": variable.name in component.parameters,
    }


def _ending(outcome: Outcome) -> dict[str, Any]:
    return {
        "status": outcome.status,
        "reason": str(outcome.error) if outcome.error else "",
        "steps": outcome.steps,
        "time_reached": outcome.time,
    }


def _what_happened(outcome: Outcome, folder: Path) -> str:
    kept = f"What was computed up to t = {outcome.time:.6g} s is in {folder}, marked {outcome.status}"
    if outcome.status == "interrupted":
        return f"interrupted. {kept}"
    return f"{outcome.error}. {kept}"
