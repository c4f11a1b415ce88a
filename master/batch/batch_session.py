"""The skeleton of verification and study: tasks are run one after the other, and the state is on disk after each.

A batch consists of a state, a sequence of tasks, and a function that adds the result of a task to the state. Its files
are written before the first task and after each, so whatever ends it, the folder shows what was finished and says so.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, Generic, Literal, TypeVar

from master.coupling.fmu_warnings import FmuWarningObserver
from master.coupling.macro_steps import Observer
from master.errors import InterruptedRunError
from master.results import results_folder, run_summary
from master.results.run_results import Results
from master.run_session import run
from master.safety.supervision import unfinished
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from master.system.components import System
from master.system.step_rounding import adjustments

#: Least time between two writings of files [s], and most of the time that may be spent on writing.
_LEAST_PAUSE: Final = 1.0
_SHARE: Final = 0.05
#: Makes the observers of a run and removes them afterwards.
ObserverFactory = Callable[[System], AbstractContextManager[Sequence[Observer]]]


@contextmanager
def no_observers(_: System) -> Iterator[Sequence[Observer]]:
    """Observe nothing."""
    yield ()


@dataclass(frozen=True)
class Runner:
    """Opens scenarios and makes runs.

    Attributes
    ----------
    observers : callable
        System -> context manager that yields the observers of its run (progress).
    tell : callable
        Shows the user what takes time and the warnings of FMUs.
    build : bool
        Whether missing or stale FMUs are built.
    """

    observers: ObserverFactory = no_observers
    tell: Callable[[str], None] = lambda _: None
    build: bool = True

    @contextmanager
    def opened(self, scenario: Path, overrides: Overrides) -> Iterator[System]:
        """Yield the system of a scenario; its FMUs may lie in a folder that is gone afterwards.

        Raises
        ------
        ScenarioError, RequestError
            If scenario and overrides do not go together.
        """
        with open_scenario(scenario, overrides, self.tell, self.build) as opened:
            yield opened.system

    def run(self, system: System, folder: Path) -> Results:
        """Run one system."""
        for text in adjustments(system):
            self.tell(f"{system.name}: warning: {text}")
        warnings = FmuWarningObserver(lambda warning: self.tell(f"{system.name}: {warning}"))
        with self.observers(system) as observers:
            return run(system, folder, [warnings, *observers])


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


@dataclass(frozen=True, kw_only=True)
class BatchState:
    """The part of the state that all batches share.

    Attributes
    ----------
    date : str
        When it began.
    versions : dict
        Versions of the programs that compute it.
    status : str
        running, complete or interrupted.
    """

    date: str = field(default_factory=_now)
    versions: Mapping[str, str] = field(default_factory=run_summary.versions)
    status: Literal["running", "complete", "interrupted"] = "running"


State = TypeVar("State", bound=BatchState)
Task = TypeVar("Task")


@dataclass(frozen=True)
class BatchFiles(Generic[State]):
    """The files that a batch leaves in its folder.

    Attributes
    ----------
    kind, generator : str
        Its name in messages, and in the JSON file, by which a later batch recognises the folder.
    json : str
        Name of the JSON file.
    data : callable
        State -> its contents, but for the generator.
    texts : dict
        State -> contents, by the names of the other files.
    """

    kind: str
    generator: str
    json: str
    data: Callable[[State], Mapping[str, Any]]
    texts: Mapping[str, Callable[[State], str]]

    def write(self, state: State, folder: Path) -> None:
        """Write the files of a state."""
        results_folder.write_json(folder / self.json, {"generator": self.generator, **self.data(state)})
        for name, text in self.texts.items():
            results_folder.write_text(folder / name, text(state))


class PacedFiles(BatchFiles[State]):
    """Files that are written as tasks finish, but not so often that writing takes more than a share of the time."""

    def write(self, state: State, folder: Path) -> None:
        """Write the files of a state, unless they were written just now and more is to come."""
        began = time.monotonic()
        if state.status == "running" and began < self.__dict__.get("_due", began):
            return
        self.write_now(state, folder)
        now = time.monotonic()
        self.__dict__["_due"] = now + max(_LEAST_PAUSE, (now - began) / _SHARE)

    def write_now(self, state: State, folder: Path) -> None:
        """Write the files of a state."""
        super().write(state, folder)


def run_tasks(
    state: State, tasks: Iterable[Task], finish: Callable[[State, Task], State], files: BatchFiles[State], folder: Path
) -> State:
    """Run tasks one after the other and return the last state.

    Parameters
    ----------
    state : BatchState
        Before the first task.
    tasks : iterable
    finish : callable
        State and task -> the state with the result of the task.
    files : BatchFiles
    folder : Path
        Created, or taken over from an earlier batch of the same kind.

    Raises
    ------
    InterruptedRunError, KeyboardInterrupt
        If the user stops it; the files then hold the finished tasks.
    MasterError
        If the folder holds something else.
    """
    taken = results_folder.taken_over(folder, files.json, files.generator, files.kind)
    with taken, unfinished(folder / files.json):
        files.write(state, folder)
        try:
            for task in tasks:
                state = finish(state, task)
                files.write(state, folder)
        except (InterruptedRunError, KeyboardInterrupt):
            files.write(replace(state, status="interrupted"), folder)
            raise
        state = replace(state, status="complete")
        files.write(state, folder)
        return state
