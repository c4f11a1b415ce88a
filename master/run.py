"""One run of a scenario: load, couple, record, assess, write."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from master.coupling.contact_loss_stop import ContactLossStop
from master.coupling.coupling_power import CouplingPowerObserver
from master.coupling.coupling_schemes import make_algorithm
from master.coupling.fmu_warnings import FmuWarning, FmuWarningObserver
from master.coupling.macro_steps import Observer, RunOutcome, TimeGrid, simulate
from master.coupling.network import Network
from master.coupling.off_wire_stop import OffWireStop
from master.coupling.real_time import WallClockPacer
from master.coupling.stopwatch import Stopwatch, Timing
from master.errors import ForeignResultsError, InterruptedRunError, MasterError, RequestError, RunError
from master.evaluation.interval_coverage import never_touched, shortfall
from master.fmu.instance import Instance
from master.fmu.isolation.isolated_instance import IsolatedInstance, Isolation
from master.recording.checkpoint import NAME as CHECKPOINT
from master.recording.checkpoint import Checkpoint
from master.recording.checkpoint_writer import (
    CheckpointObserver,
    CheckpointSchedule,
    StatefulObserver,
    index_at,
    steps_between,
    take,
)
from master.recording.continuation import Continuation
from master.recording.recording import Recording
from master.recording.recording_plan import Recordable, make_recorder, recording_name, recording_plans
from master.recording.static_geometry import GeometryObserver
from master.results import results_folder, run_results, run_summary
from master.results.run_results import Results
from master.safety.interruption import heeded_at_once, interruptible
from master.safety.supervision import phase, unfinished
from master.system.components import Component, System, Variable
from master.system.contacts import find_contacts
from master.system.step_rounding import adjustments


@dataclass(frozen=True)
class Manner:
    """How a system is run, which changes none of its figures.

    Attributes
    ----------
    checkpoint : float, optional
        When the whole state is to be written to the folder [s].
    checkpoint_every : float, optional
        After how much simulated time again and again [s].
    continuation : Continuation, optional
        Where the run goes on from, instead of its beginning.
    isolation : Isolation, optional
        Given if every FMU is to have a process of its own.
    real_time : float, optional
        Simulated seconds per second of wall clock; as fast as it goes if not given.
    """

    checkpoint: float | None = None
    checkpoint_every: float | None = None
    continuation: Continuation | None = None
    isolation: Isolation | None = None
    real_time: float | None = None


_PLAIN: Final = Manner()


def run(system: System, folder: Path, observers: Sequence[Observer] = (), manner: Manner = _PLAIN) -> Results:
    """Run a system and leave its results in ``folder``.

    Parameters
    ----------
    system : System
        What to run.
    folder : Path
        Results folder; made, or emptied if it is ours, or gone on with if the manner says so.
    observers : sequence of Observer
        Further observers (progress).
    manner : Manner

    Raises
    ------
    RunError
        If the run stops before its end; what was computed is in the folder then.
    FolderInUseError
        If another process works in the folder.
    MasterError
        If the folder is not ours, or was removed or taken over meanwhile.
    RequestError
        If checkpoint or continuation do not fit the system.
    """
    schedule = _schedule(system, manner)
    with results_folder.claimed(folder):
        identity = _take_folder(system, folder, manner.continuation)
        with unfinished(folder / results_folder.SUMMARY, identity):
            results_folder.write_json(
                folder / results_folder.SUMMARY, {**_description(system, identity), "status": "running"}
            )
            return _run(system, folder, observers, manner, schedule, identity)


def _run(
    system: System,
    folder: Path,
    observers: Sequence[Observer],
    manner: Manner,
    schedule: CheckpointSchedule,
    identity: str,
) -> Results:
    farewells: list[FmuWarning] = []
    with (
        interruptible() as stop_wanted,
        _failure_noted(system, folder, identity, stop_wanted),
        loaded(system, manner.isolation, farewells) as network,
    ):
        session = _Session(system, network, folder, manner, identity)
        watchers = [*session.observers, *observers, *session.last_observers(schedule)]
        continuation = manner.continuation
        way_in = {} if continuation is None else {"prepare": continuation.prepare}
        outcome = simulate(network, session.algorithm, session.grid, watchers, stop_wanted, **way_in)
    for observer in watchers:
        if isinstance(observer, FmuWarningObserver):
            for farewell in farewells:
                observer.add(farewell)
    return _concluded(session, outcome, folder)


def _concluded(session: _Session, outcome: RunOutcome, folder: Path) -> Results:
    try:
        recordings = session.recordings(outcome)
        outcome = session.checked(outcome, recordings[0])
        done = session.conclude(outcome, recordings)
    except ForeignResultsError as error:
        session.disown(error)
        raise ForeignResultsError(f"{outcome.error}. {error}" if outcome.error else str(error)) from error
    except MasterError as error:  # no room for the summary, say
        cause = outcome.error or error
        raise RunError(f"{cause}. What was written before is in {folder}, marked running") from error
    if outcome.status != "complete":
        kind = InterruptedRunError if outcome.status == "interrupted" else RunError
        raise kind(_what_happened(outcome, folder)) from outcome.error
    return done


def _schedule(system: System, manner: Manner) -> CheckpointSchedule:
    once, every = manner.checkpoint, manner.checkpoint_every
    return CheckpointSchedule(
        None if once is None else index_at(system, once),
        None if every is None else steps_between(system, every),
    )


def _take_folder(system: System, folder: Path, continuation: Continuation | None) -> str:
    """Make the folder ready and return the identity of the run in it: a new one, or that of the run that goes on."""
    if continuation is not None:
        continuation.check(system)
        if continuation.is_same_run:
            known = results_folder.identity(folder)
            if not known or known != continuation.checkpoint.run:
                raise RequestError(f"{continuation.file} comes from another run than the results beside it")
            return known
    results_folder.prepare(folder, None if continuation is None else Path(continuation.file))
    return uuid.uuid4().hex


@contextmanager
def _failure_noted(system: System, folder: Path, identity: str, stop_wanted: Callable[[], bool]) -> Iterator[None]:
    """Mark the folder's summary as failed, or interrupted, if the run does not even begin."""
    try:
        yield
    except (MasterError, KeyboardInterrupt) as error:
        # An FMU in Python takes the interruption for a failure of its own.
        is_interrupted = isinstance(error, KeyboardInterrupt) or stop_wanted()
        cause = None if isinstance(error, KeyboardInterrupt) or is_interrupted else error
        outcome = RunOutcome("interrupted" if is_interrupted else "failed", 0, system.start, cause)
        if _is_still(folder, identity):
            results_folder.write_json(
                folder / results_folder.SUMMARY, {**_description(system, identity), **_ending(outcome)}
            )
        if is_interrupted:
            raise InterruptedRunError(_what_happened(outcome, folder)) from error
        raise


@contextmanager
def loaded(
    system: System, isolation: Isolation | None = None, farewells: list[FmuWarning] | None = None
) -> Iterator[Network]:
    """Load the FMUs of a system and connect them; they are freed at last.

    Parameters
    ----------
    system : System
    isolation : Isolation, optional
        Given if each is to have a process of its own.
    farewells : list of FmuWarning, optional
        Takes what goes wrong when they are freed.
    """
    instances: list[Instance | IsolatedInstance] = []
    if isolation is None:
        _check_single(system)
    try:
        with phase("loading"), heeded_at_once():
            for component in system.components:
                # One by one: those loaded so far must be freed on failure.
                instance = Instance(component) if isolation is None else IsolatedInstance(component, isolation)
                instances.append(instance)
        yield Network(instances, system.connections, system.discrete)
    finally:
        with phase("closing"):
            _free(instances, [] if farewells is None else farewells)


def _check_single(system: System) -> None:
    """Refuse several instances of an FMU of which a process can hold only one."""
    first: dict[str, str] = {}
    for c in system.components:
        if c.fmu.is_single and (other := first.setdefault(c.fmu.sha256, c.name)) != c.name:
            text = f"both are of {c.fmu.path.name}, of which a process can hold only one; --isolate gives each its own"
            raise RunError(f"components '{other}' and '{c.name}': {text}")


def _free(instances: Sequence[Instance | IsolatedInstance], farewells: list[FmuWarning]) -> None:
    """Free all, also after one at which the user lost patience."""
    interruption = None
    for instance in reversed(instances):
        try:
            with heeded_at_once():
                said = instance.close()
        except KeyboardInterrupt as error:
            interruption = error
            continue
        if said:
            farewells.append(FmuWarning(instance.name, said, is_own=False))
    if interruption is not None:
        raise interruption


def _is_still(folder: Path, identity: str) -> bool:
    """Whether it is the run of this identity whose results lie in the folder."""
    with suppress(MasterError):
        return results_folder.identity(folder) == identity
    return False


class _Session:
    """The observers of a run and what is made of them in the end."""

    def __init__(self, system: System, network: Network, folder: Path, manner: Manner, identity: str) -> None:
        self._system = system
        self._manner = manner
        self._identity = identity
        self._network = network
        self._folder = folder
        self._contacts = find_contacts(system.connections)
        self._plans = recording_plans(system)
        self.algorithm = make_algorithm(system.settings.coupling)
        whole = TimeGrid(system.start, system.step, system.step_count)
        self.grid = whole if manner.continuation is None else manner.continuation.grid(system)
        self._geometry = GeometryObserver(
            system, lambda g: results_folder.write_json(folder / results_folder.GEOMETRY, g)
        )
        self._power = CouplingPowerObserver(self._contacts, network)
        self._contact_loss_stop = ContactLossStop(self._contacts, network)
        self._off_wire_stop = OffWireStop(system, self._contacts, network, lambda: self._geometry.geometry)
        self._cautions = FmuWarningObserver()
        self._stateful: tuple[StatefulObserver, ...] = (self._power, self._contact_loss_stop)
        self._stopwatch = Stopwatch()
        self._pacer = None if manner.real_time is None else WallClockPacer(self.grid, manner.real_time)
        made = self._take_up(manner.continuation)
        self._recorders = [
            make_recorder(system, network, plan, folder, made, manner.real_time is not None) for plan in self._plans
        ]

    def _take_up(self, continuation: Continuation | None) -> int | None:
        """Go on with what the observers of the same run remembered; returns the steps that it had made, if any."""
        if continuation is None or not continuation.is_same_run:
            return None
        checkpoint = continuation.checkpoint
        for observer in self._stateful:
            observer.restore(checkpoint.observers[observer.name])
        return checkpoint.index

    @property
    def observers(self) -> list[Observer]:
        """Those that belong to every run."""
        return [
            self._geometry,
            *self._recorders,
            self._power,
            self._stopwatch,
            self._contact_loss_stop,
            self._off_wire_stop,
            self._cautions,
        ]

    def last_observers(self, schedule: CheckpointSchedule) -> list[Observer]:
        """Those that have to see a step after all others: checkpoints, and at the very last the clock."""
        path = self._folder / CHECKPOINT
        checkpoints = [CheckpointObserver(self._checkpoint, path, schedule)] if schedule else []
        return [*checkpoints, *([self._pacer] if self._pacer else [])]

    def _checkpoint(self, network: Network, index: int) -> Checkpoint:
        for recorder in self._recorders:
            recorder.sync()  # no checkpoint is ahead of the rows that it goes on from
        return take(self._system, network, self.algorithm, index, self._stateful, self._identity)

    def conclude(self, outcome: RunOutcome, recordings: tuple[Recording, ...]) -> Results:
        """Write the summary and return the results, of what is in the files."""
        description = {
            **_description(self._system, self._identity),
            **_ending(outcome),
            **self._not_judged(outcome, recordings[0]),
        }
        done = Results(self._folder, description, recordings, self._geometry.geometry)
        summary = {
            **description,
            **_origin(self._manner.continuation),
            **run_summary.figures(done),
            "interface_power": [asdict(p) for p in self._power.summary(self._system.step)],
            "performance": self._performance(outcome),
            "recordings": [recording_name(p, self._system.step) for p in self._plans],
            "adjustments": list(adjustments(self._system, self._manner.checkpoint_every)),
            "warnings": [{"component": w.component, "text": w.text} for w in self._cautions.warnings],
            "scenario_warnings": list(self._system.warnings),
        }
        run_results.write_forces(done)
        results_folder.write_json(self._folder / results_folder.SUMMARY, summary)
        return replace(done, summary=summary)

    def disown(self, error: ForeignResultsError) -> None:
        """Mark results that are not what was written, if they are this run's at all."""
        if _is_still(self._folder, self._identity):
            data = {**_description(self._system, self._identity), "status": "failed", "reason": str(error)}
            results_folder.write_json(self._folder / results_folder.SUMMARY, data)

    def recordings(self, outcome: RunOutcome) -> tuple[Recording, ...]:
        """Read what was recorded.

        Raises
        ------
        ForeignResultsError
            If the files are no longer those that this run wrote.
        """
        advice = "while the run went on; run it again, in a folder of its own (--out)"
        if not _is_still(self._folder, self._identity):
            raise ForeignResultsError(f"the results in {self._folder} were removed or taken by another run {advice}")
        for recorder in self._recorders:
            if not recorder.path.is_file():
                raise ForeignResultsError(f"{recorder.path} was removed {advice}")
        recordings = tuple(r.recording for r in self._recorders)
        for recorder, recording in zip(self._recorders, recordings, strict=True):
            if outcome.status == "complete" and len(recording.time) != recorder.rows:
                found = f"has {len(recording.time)} rows, {recorder.rows} were written"
                raise ForeignResultsError(f"{recorder.path} {found}: it was changed {advice}")
            if outcome.status == "complete" and not recorder.is_as_written:
                raise ForeignResultsError(f"{recorder.path} is not what was written: it was changed {advice}")
        return recordings

    def checked(self, outcome: RunOutcome, recording: Recording) -> RunOutcome:
        """Return how the run ended once it is seen whether it has covered what it was to cover."""
        reason = self._lacking(recording) if outcome.status == "complete" else ""
        if not reason or self._may_lack:
            return outcome
        error = RunError(f"{reason}; run it longer, or ask for a part of it with --stop")
        return replace(outcome, status="incomplete", error=error)

    @property
    def _may_lack(self) -> bool:
        """Whether the user has asked for less than the interval of interest."""
        continuation = self._manner.continuation
        begins_anew = continuation is not None and not continuation.is_same_run
        return self._system.may_stop_early or begins_anew

    def _lacking(self, recording: Recording) -> str:
        interval = self._system.settings.interval
        if reason := shortfall(recording, self._contacts, (interval.start, interval.end)):
            return reason
        silent = never_touched(recording, self._contacts)
        return f"'{silent}' never touches the wire" if silent else ""

    def _not_judged(self, outcome: RunOutcome, recording: Recording) -> dict[str, str]:
        reason = self._lacking(recording) if outcome.status == "complete" else ""
        return {"not_judged": reason} if reason else {}

    def _performance(self, outcome: RunOutcome) -> dict[str, Any]:
        punctuality = self._pacer.punctuality if self._pacer else None
        return {
            **_performance(self._stopwatch.timing, outcome.time - self.grid.begin),
            "isolated": self._manner.isolation is not None,
            "component_time": {s.name: s.stepping_time for s in self._network.slaves if isinstance(s, Recordable)},
            **({"real_time": asdict(punctuality)} if punctuality else {}),
        }


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
        "peak_memory": run_summary.peak_memory(),
    }


def _description(system: System, identity: str) -> dict[str, Any]:
    return {
        "generator": results_folder.GENERATOR,
        "format": results_folder.FORMAT,
        "run": identity,
        "scenario": system.name,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": run_summary.versions(),
        "settings": {
            "start": system.start,
            "stop": system.stop,
            "step": system.step,
            **system.settings.model_dump(mode="json"),
        },
        "components": [_component(c) for c in system.components],
        "contacts": [asdict(c) for c in find_contacts(system.connections)],
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
        "tolerance": component.tolerance,
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


def _ending(outcome: RunOutcome) -> dict[str, Any]:
    return {
        "status": outcome.status,
        "reason": str(outcome.error) if outcome.error else "",
        "steps": outcome.steps,
        "time_reached": outcome.time,
    }


def _what_happened(outcome: RunOutcome, folder: Path) -> str:
    kept = f"What was computed up to t = {outcome.time:.6g} s is in {folder}, marked {outcome.status}"
    if outcome.status == "interrupted":
        return f"interrupted. {kept}"
    return f"{outcome.error}. {kept}"
