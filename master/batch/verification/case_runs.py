"""The runs that cases need: each is made once per verification, identified by content, and never reused later."""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Final, NamedTuple

from master.batch.batch_session import Runner
from master.batch.verification.case import Case
from master.errors import InterruptedRunError, MasterError
from master.results.run_results import Results
from master.scenario.overrides import Overrides
from master.system.components import System

#: Subfolder of the runs.
RUNS: Final = "runs"


def content_key(system: System) -> str:
    """Return a hash of everything on which a run depends: FMUs, values, connections, times and settings."""
    content = (
        [(c.name, c.fmu.sha256, sorted(c.parameters.items()), c.inputs, c.outputs) for c in system.components],
        [asdict(c) for c in system.connections],
        (system.start, system.stop, system.step),
        system.settings.model_dump_json(),
    )
    return hashlib.sha256(repr(content).encode()).hexdigest()


def first_instant(system: System) -> System:
    """Return the system with a run of a single step, which suffices for static figures."""
    return replace(system, stop=system.start + system.step, may_stop_early=True)


class _Wanted(NamedTuple):
    """A run as a case requests it: scenario, whether the first instant suffices, and values of parameters."""

    path: Path
    start_only: bool
    values: tuple[tuple[str, float], ...]


@dataclass
class Runs:
    """Makes runs and keeps their results while the verification lasts.

    Attributes
    ----------
    folder : Path
        Holds the folders of the runs.
    runner : Runner
        Opens scenarios and makes the runs.
    """

    folder: Path
    runner: Runner
    _done: dict[str, Results | MasterError] = field(default_factory=dict)
    _opened: dict[_Wanted, str] = field(default_factory=dict)
    _names: set[str] = field(default_factory=set)

    def get(self, case: Case, name: str) -> Results:
        """Return the results of a case's run, making it unless one of the same content was made.

        Raises
        ------
        MasterError
            If it fails, and again at every later request.
        InterruptedRunError
            If the user stops it.
        """
        wanted = _Wanted(case.scenario_path(name), case.runs[name].start_only, tuple(case.runs[name].set.items()))
        if wanted not in self._opened:
            self._opened[wanted] = self._make(wanted)
        outcome = self._done[self._opened[wanted]]
        if isinstance(outcome, MasterError):
            raise outcome
        return outcome

    def _make(self, wanted: _Wanted) -> str:
        """Make a run, unless there is one, and return the key of its results."""
        try:
            overrides = Overrides(parameters={name: f"{value:.17g}" for name, value in wanted.values})
            with self.runner.opened(wanted.path, overrides) as system:
                return self._run(system, wanted.start_only)
        except InterruptedRunError:
            raise
        except MasterError as error:
            key = str(wanted)
            self._done[key] = error
            return key

    def _run(self, whole: System, start_only: bool) -> str:
        system = first_instant(whole) if start_only else whole
        for key in (content_key(whole), content_key(system)):
            if key in self._done:
                return key
        key = content_key(system)
        folder = self._folder_of(f"{system.name}-start" if start_only else system.name, key)
        self.runner.tell(f"running {system.name}")
        self._done[key] = self.runner.run(system, folder)
        return key

    def _folder_of(self, name: str, key: str) -> Path:
        """Return a new folder for a run, with part of its key in the name if the name is taken."""
        own = f"{name}-{key[:8]}" if name in self._names else name
        self._names.add(own)
        return self.folder / own
