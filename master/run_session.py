"""One run of a scenario: claim the folder, load, couple, record, conclude."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
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
from master.coupling.stopwatch import Stopwatch
from master.errors import ForeignResultsError, InterruptedRunError, MasterError, RunError
from master.evaluation.interval_coverage import not_judgeable
from master.fmu.isolation.isolated_instance import Isolation
from master.fmu.loading import loaded_fmus
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
from master.recording.recorder import RERUN_ADVICE
from master.recording.recording import Recording
from master.recording.recording_plan import Recordable, make_recorder, recording_name, recording_plans
from master.recording.static_geometry import GeometryObserver
from master.results import run_summary
from master.results.kept_definitions import write_definitions
from master.results.results_folder import RunFolder, claimed_for_run, write_forces
from master.results.run_results import Results
from master.safety.interruption import interruptible
from master.safety.supervision import unfinished
from master.system.components import System
from master.system.step_rounding import adjustments


@dataclass(frozen=True)
class RunOptions:
    """How a system is run; no option changes a figure.

    Attributes
    ----------
    checkpoint : float, optional
        When the whole state is written to the folder [s].
    checkpoint_every : float, optional
        Simulated time after which it is written again and again [s].
    continuation : Continuation, optional
        Where the run continues from, instead of its beginning.
    isolation : Isolation, optional
        Given if every FMU is to have its own process.
    real_time : float, optional
        Simulated seconds per second of wall clock; as fast as possible if not given.
    keep_definitions : bool
        Whether the definitions of the components are copied into the folder.
    """

    checkpoint: float | None = None
    checkpoint_every: float | None = None
    continuation: Continuation | None = None
    isolation: Isolation | None = None
    real_time: float | None = None
    keep_definitions: bool = True

    def schedule(self, system: System) -> CheckpointSchedule:
        """Return after which macro steps checkpoints are written; refuses what does not fit the system."""
        once, every = self.checkpoint, self.checkpoint_every
        return CheckpointSchedule(
            None if once is None else index_at(system, once),
            None if every is None else steps_between(system, every),
        )


_DEFAULT: Final = RunOptions()


def run(system: System, folder: Path, observers: Sequence[Observer] = (), options: RunOptions = _DEFAULT) -> Results:
    """Run a system and leave its results in ``folder``.

    Parameters
    ----------
    system : System
        What to run.
    folder : Path
        Results folder; made, or emptied if it is ours, or continued in if the options say so.
    observers : sequence of Observer
        Further observers (progress).
    options : RunOptions

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
    schedule = options.schedule(system)
    if options.continuation is not None:
        options.continuation.check(system)
    with claimed_for_run(folder, options.continuation) as own, unfinished(own.summary_file, own.run):
        description = run_summary.describe(system, own.run)
        own.write_summary({**description, "status": "running"})
        if options.keep_definitions:
            write_definitions(own.path, system.components)
        troubles: dict[str, str] = {}
        with (
            interruptible() as stop_wanted,
            _failure_noted(own, description, stop_wanted),
            connected_fmus(system, options.isolation, troubles) as network,
        ):
            session = RunSession(system, network, own, description, options, schedule)
            outcome = session.simulate(observers, stop_wanted)
        session.warn_of(troubles)
        return session.conclude(outcome)


@contextmanager
def connected_fmus(
    system: System, isolation: Isolation | None = None, troubles: dict[str, str] | None = None
) -> Iterator[Network]:
    """Load the FMUs of a system and connect them; they are freed at the end.

    Parameters
    ----------
    system : System
    isolation : Isolation, optional
        Given if each is to have its own process.
    troubles : dict, optional
        Takes what goes wrong when they are freed, by component.
    """
    with loaded_fmus(system.components, isolation, troubles) as instances:
        yield Network(instances, system.connections, system.discrete)


@contextmanager
def _failure_noted(folder: RunFolder, description: dict[str, Any], stop_wanted: Callable[[], bool]) -> Iterator[None]:
    """Mark the folder's summary as failed, or interrupted, if the run does not even begin."""
    try:
        yield
    except (MasterError, KeyboardInterrupt) as error:
        # An FMU in Python takes the interruption for its own failure.
        is_interrupted = isinstance(error, KeyboardInterrupt) or stop_wanted()
        cause = None if isinstance(error, KeyboardInterrupt) or is_interrupted else error
        start = description["settings"]["start"]
        outcome = RunOutcome("interrupted" if is_interrupted else "failed", 0, start, cause)
        if folder.holds_this_run:
            folder.write_summary({**description, **run_summary.ending(outcome)})
        if is_interrupted:
            raise InterruptedRunError(_what_happened(outcome, folder.path)) from error
        raise


class RunSession:
    """The observers of a run, and what is made of what they saw.

    Parameters
    ----------
    system : System
    network : Network
        Its FMUs, connected.
    folder : RunFolder
        Where the results go.
    description : dict
        What the summary says of the run from its beginning.
    options : RunOptions
    schedule : CheckpointSchedule
        When checkpoints are written.
    """

    def __init__(
        self,
        system: System,
        network: Network,
        folder: RunFolder,
        description: dict[str, Any],
        options: RunOptions,
        schedule: CheckpointSchedule,
    ) -> None:
        self._system, self._network, self._folder = system, network, folder
        self._description, self._options, self._schedule = description, options, schedule
        self._contacts = system.contacts
        self._algorithm = make_algorithm(system.settings.coupling)
        whole = TimeGrid(system.start, system.step, system.step_count)
        self._grid = whole if options.continuation is None else options.continuation.grid(system)
        self._geometry = GeometryObserver(system, folder.write_geometry)
        self._power = CouplingPowerObserver(self._contacts, network)
        self._loss_stop = ContactLossStop(self._contacts, network)
        self._off_wire_stop = OffWireStop(system, self._contacts, network, lambda: self._geometry.geometry)
        self._warnings = [FmuWarningObserver()]
        self._stateful: tuple[StatefulObserver, ...] = (self._power, self._loss_stop)
        self._stopwatch = Stopwatch()
        self._pacer = None if options.real_time is None else WallClockPacer(self._grid, options.real_time)
        self._plans = recording_plans(system)
        made, is_steady = self._restored(), options.real_time is not None
        self._recorders = [make_recorder(system, network, p, folder.path, made, is_steady) for p in self._plans]

    def _restored(self) -> int | None:
        """Restore the observers of the run that continues; return the macro steps that it had made, if any."""
        continuation = self._options.continuation
        if continuation is None or not continuation.is_same_run:
            return None
        checkpoint = continuation.checkpoint
        for observer in self._stateful:
            observer.restore(checkpoint.observers[observer.name])
        return checkpoint.index

    def simulate(self, observers: Sequence[Observer], stop_wanted: Callable[[], bool]) -> RunOutcome:
        """Step over the grid, watched by the run's observers and by further ones."""
        self._warnings += [o for o in observers if isinstance(o, FmuWarningObserver)]
        everyone: list[Observer] = [self._geometry, *self._recorders, self._power, self._stopwatch]
        everyone += [self._loss_stop, self._off_wire_stop, self._warnings[0], *observers]
        # These have to see a step after all others: checkpoints, and at the very last the clock.
        if self._schedule:
            everyone.append(CheckpointObserver(self._checkpoint, self._folder.checkpoint_file, self._schedule))
        if self._pacer:
            everyone.append(self._pacer)
        continuation = self._options.continuation
        way_in = {} if continuation is None else {"prepare": continuation.prepare}
        return simulate(self._network, self._algorithm, self._grid, everyone, stop_wanted, **way_in)

    def _checkpoint(self, network: Network, index: int) -> Checkpoint:
        for recorder in self._recorders:
            recorder.sync()  # no checkpoint is ahead of the rows that a run continues from
        return take(self._system, network, self._algorithm, index, self._stateful, self._folder.run)

    def warn_of(self, troubles: dict[str, str]) -> None:
        """Add what went wrong when FMUs were freed to what they have warned of."""
        for observer in self._warnings:
            for component, text in troubles.items():
                observer.add(FmuWarning(component, text, is_own=False))

    def conclude(self, outcome: RunOutcome) -> Results:
        """Write the summary and return the results, of what is in the files.

        Raises
        ------
        ForeignResultsError
            If the files are no longer those that this run wrote.
        RunError
            If the run did not come to its end, or the summary cannot be written.
        """
        try:
            recordings = self._recordings(outcome.status == "complete")
            outcome, not_judged = self._judged(outcome, recordings[0])
            done = self._written(outcome, not_judged, recordings)
        except ForeignResultsError as error:
            if self._folder.holds_this_run:
                self._folder.write_summary({**self._description, "status": "failed", "reason": str(error)})
            raise ForeignResultsError(f"{outcome.error}. {error}" if outcome.error else str(error)) from error
        except MasterError as error:  # no room for the summary, say
            cause = outcome.error or error
            kept = f"What was written before is in {self._folder.path}, marked running"
            raise RunError(f"{cause}. {kept}") from error
        if outcome.status != "complete":
            kind = InterruptedRunError if outcome.status == "interrupted" else RunError
            raise kind(_what_happened(outcome, self._folder.path)) from outcome.error
        return done

    def _recordings(self, is_complete: bool) -> tuple[Recording, ...]:
        """Read what was recorded, if it is still this run's."""
        if not self._folder.holds_this_run:
            text = f"the results in {self._folder.path} were removed or taken by another run"
            raise ForeignResultsError(f"{text} {RERUN_ADVICE}")
        return tuple(recorder.read_back(is_complete) for recorder in self._recorders)

    def _judged(self, outcome: RunOutcome, recording: Recording) -> tuple[RunOutcome, str]:
        """Return how the run ended if it has to cover its interval of interest, and why it cannot be judged, if so."""
        if outcome.status != "complete":
            return outcome, ""
        interval = self._system.settings.interval
        reason = not_judgeable(recording, self._contacts, (interval.start, interval.end))
        continuation = self._options.continuation
        is_part = continuation is not None and not continuation.is_same_run
        if not reason or self._system.may_stop_early or is_part:
            return outcome, reason
        error = RunError(f"{reason}; run it longer, or ask for a part of it with --stop")
        return replace(outcome, status="incomplete", error=error), ""

    def _written(self, outcome: RunOutcome, not_judged: str, recordings: tuple[Recording, ...]) -> Results:
        description = {
            **self._description,
            **run_summary.ending(outcome),
            **({"not_judged": not_judged} if not_judged else {}),
        }
        done = Results(self._folder.path, description, recordings, self._geometry.geometry)
        summary = {
            **description,
            **run_summary.origin(self._options.continuation),
            **run_summary.figures(done),
            "interface_power": [asdict(p) for p in self._power.summary(self._system.step)],
            "performance": self._performance(outcome),
            "recordings": [recording_name(p, self._system.step) for p in self._plans],
            "adjustments": list(adjustments(self._system, self._options.checkpoint_every)),
            "warnings": [{"component": w.component, "text": w.text} for w in self._warnings[0].warnings],
            "scenario_warnings": list(self._system.warnings),
        }
        write_forces(self._folder.path, done.signals)
        self._folder.write_summary(summary)
        return replace(done, summary=summary)

    def _performance(self, outcome: RunOutcome) -> dict[str, Any]:
        punctuality = self._pacer.punctuality if self._pacer else None
        return {
            **run_summary.performance(self._stopwatch.timing, outcome.time - self._grid.begin),
            "isolated": self._options.isolation is not None,
            "component_time": {s.name: s.stepping_time for s in self._network.slaves if isinstance(s, Recordable)},
            **({"real_time": asdict(punctuality)} if punctuality else {}),
        }


def _what_happened(outcome: RunOutcome, folder: Path) -> str:
    kept = f"What was computed up to t = {outcome.time:.6g} s is in {folder}, marked {outcome.status}"
    if outcome.status == "interrupted":
        return f"interrupted. {kept}"
    return f"{outcome.error}. {kept}"
