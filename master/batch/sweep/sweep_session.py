"""A sweep: what is missing is run, and the table is written as runs finish."""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from master.batch.batch_session import BatchFiles, BatchState, run_tasks
from master.batch.sweep.sweep_engines import HereEngine, MakeRuns, SweepEngine
from master.batch.sweep.sweep_journal import SweepJournal
from master.batch.sweep.sweep_plan import SweepPlan, SweepRequest, make_plan
from master.batch.sweep.sweep_run import WORK, Row, RunPlace, SweepResult
from master.batch.sweep.sweep_table import as_csv, has_parquet, table_rows, write_parquet
from master.batch.sweep.swept_systems import SweepRun, make_runs
from master.errors import InterruptedRunError, MasterError
from master.results import results_folder
from master.run_session import run as run_system
from master.system.components import System

JSON: Final = "sweep.json"
CSV: Final = "sweep.csv"
PARQUET: Final = "sweep.parquet"
RUNS: Final = "runs"
#: Version of ``sweep.json`` and of the table.
FORMAT: Final = 1
#: Least time between two writings of the table [s], and most of the time that may be spent on writing.
_LEAST_PAUSE: Final = 1.0
_SHARE: Final = 0.05
#: Steps of the rehearsal that the estimate of time comes from.
_REHEARSED: Final = 100


@dataclass(frozen=True)
class SweepProgress:
    """How far a sweep is.

    Attributes
    ----------
    done, failed, running, total : int
        Numbers of runs; those that failed are among those that are done.
    left : float, optional
        Time left [s], once it is known.
    """

    done: int
    failed: int
    running: int
    total: int
    left: float | None = None

    def __str__(self) -> str:
        left = "" if self.left is None else f", {duration(self.left)} left"
        return f"{self.done} of {self.total} runs done, {self.running} running, {self.failed} failed{left}"


@dataclass(frozen=True)
class SweepOutcome(BatchState):
    """The state of a sweep.

    Attributes
    ----------
    scenario : str
        Its name.
    request : SweepRequest
    plan : SweepPlan
    runs : tuple of SweepRun
        All of the plan.
    found : dict
        What has become of runs, by key.
    checks : sequence of dict
        Runs that were made in two ways, and by how much these differ; see `SweepEngine`.
    """

    scenario: str
    request: SweepRequest
    plan: SweepPlan
    runs: tuple[SweepRun, ...]
    found: Mapping[str, SweepResult] = field(default_factory=dict)
    checks: Sequence[Mapping[str, Any]] = ()

    @property
    def finished(self) -> tuple[SweepRun, ...]:
        """The runs of the plan that are finished."""
        return tuple(r for r in self.runs if r.key in self.found)

    @property
    def failures(self) -> dict[int, str]:
        """Reasons why runs failed, by their numbers."""
        return {r.number: self.found[r.key].reason for r in self.finished if self.found[r.key].failed}

    @property
    def rows(self) -> list[Row]:
        """The table so far."""
        return table_rows(self.runs, self.found)


def as_data(outcome: SweepOutcome) -> dict[str, Any]:
    """Return the contents of ``sweep.json``."""
    sampled = {d.parameter.name: d.text for d in outcome.plan.distributions}
    return {
        "format": FORMAT,
        "scenario": outcome.scenario,
        "status": outcome.status,
        "date": outcome.date,
        "versions": dict(outcome.versions),
        "request": outcome.request.model_dump(mode="json", exclude_none=True),
        "parameters": [
            {"name": p.name, "unit": p.unit, "column": p.title, "targets": p.targets, "sampled": sampled.get(p.name)}
            for p in outcome.plan.parameters
        ],
        "runs": len(outcome.runs),
        "finished": len(outcome.finished),
        "checks": list(outcome.checks),
        "failures": {str(number): reason for number, reason in outcome.failures.items()},
    }


class SweepFiles(BatchFiles[SweepOutcome]):
    """The files of a sweep: written after every run, but not so often that writing takes more than a share of time."""

    def __init__(self) -> None:
        super().__init__("sweep", "openpanto sweep", JSON, as_data, {CSV: lambda outcome: as_csv(outcome.rows)})
        self.__dict__["_due"] = 0.0

    def write(self, state: SweepOutcome, folder: Path) -> None:
        """Write the files of a state, unless they were written just now and more is to come."""
        began = time.monotonic()
        if state.status == "running" and began < self.__dict__["_due"]:
            return
        super().write(state, folder)
        if has_parquet() and state.found:
            write_parquet(state.rows, folder / PARQUET)
        now = time.monotonic()
        self.__dict__["_due"] = now + max(_LEAST_PAUSE, (now - began) / _SHARE)


@dataclass(frozen=True)
class PreparedSweep:
    """A sweep of which everything is checked and nothing is run.

    Attributes
    ----------
    base : System
        Of the scenario as it is.
    outcome : SweepOutcome
        Before the first run.
    """

    base: System
    outcome: SweepOutcome

    @classmethod
    def of(cls, base: System, request: SweepRequest) -> PreparedSweep:
        """Return the sweep that a request asks for.

        Raises
        ------
        RequestError
            Naming what cannot be done.
        """
        plan = make_plan(base, request)
        runs = make_runs(base, plan, request)
        return cls(base, SweepOutcome(scenario=base.name, request=request, plan=plan, runs=runs))


def sweep(
    prepared: PreparedSweep,
    folder: Path,
    engine: SweepEngine | None = None,
    tell: Callable[[str], None] = lambda _: None,
    show: Callable[[SweepProgress], None] = lambda _: None,
    again: bool = False,
) -> SweepOutcome:
    """Run what is missing of a sweep; JSON file and table are written as runs finish.

    A run that an earlier sweep in the same folder finished, with the same FMUs and values, is not made again.

    Parameters
    ----------
    prepared : PreparedSweep
    folder : Path
        Created, or taken over from an earlier sweep.
    engine : SweepEngine, optional
        Makes the runs; by default here, one after the other.
    tell : callable
        Shows the user how much there is to do.
    show : callable
        Called with the progress after each run.
    again : bool
        Whether runs that failed are made again.

    Raises
    ------
    InterruptedRunError
        If the user stops it; the table then has the finished runs.
    MasterError
        If the folder holds something else, or the engine ends.
    """
    state, chosen = prepared.outcome, engine or HereEngine()
    place = RunPlace(folder / RUNS, state.request.keep)
    files = SweepFiles()
    found: dict[str, SweepResult] = {}
    try:
        with results_folder.taken_over(folder, JSON, files.generator, files.kind):
            _remove_leftovers(place)
            with closing(SweepJournal(folder)) as journal:
                old = {k: r for k, r in journal.found.items() if not (again and r.failed) and _is_there(r, place)}
                found |= {r.key: old[r.key] for r in state.runs if r.key in old}
                missing = list({r.key: r for r in state.runs if r.key not in found}.values())
                state = replace(state, found=found, checks=chosen.checks)

                def finish(so_far: SweepOutcome, result: SweepResult) -> SweepOutcome:
                    journal.add(result)
                    found[result.key] = result  # a copy each time would be long for many runs
                    return so_far

                with chosen.opened(prepared.base, place) as make_runs_of:
                    tell(_announcement(prepared.base, missing, len(state.runs), chosen))
                    results = _shown(make_runs_of, missing, state, chosen, show)
                    return run_tasks(state, results, finish, files, folder)
    except (InterruptedRunError, KeyboardInterrupt) as error:
        done = f"{len([r for r in state.runs if r.key in found])} of {len(state.runs)} runs are finished"
        raise InterruptedRunError(f"interrupted. {done} and in {folder}; the same command makes the others") from error


def _remove_leftovers(place: RunPlace) -> None:
    for path in place.folder.glob(f"{WORK}*"):
        shutil.rmtree(path, ignore_errors=True)


def _is_there(result: SweepResult, place: RunPlace) -> bool:
    """Whether what shall stay of a finished run is still there; of a failed one there may never have been anything."""
    return result.failed or place.keep in ("figures", "failed") or place.of(result.key).is_dir()


def _shown(
    make: MakeRuns, missing: Sequence[SweepRun], state: SweepOutcome, engine: SweepEngine, show: Callable[[Any], None]
) -> Iterator[SweepResult]:
    """Yield results and show the progress after each."""
    began, count = time.monotonic(), {r.key: 0 for r in state.runs}
    for run in state.runs:
        count[run.key] += 1
    total = len(state.runs)
    done = sum(count[key] for key in state.found)
    failed = sum(count[key] for key, r in state.found.items() if r.failed)
    show(SweepProgress(done, failed, min(engine.width, len(missing)), total))
    for made, result in enumerate(make(missing), 1):
        yield result
        done, failed = done + count[result.key], failed + count[result.key] * result.failed
        open_runs = len(missing) - made
        left = open_runs * (time.monotonic() - began) / made
        show(SweepProgress(done, failed, min(engine.width, open_runs), total, left))


def _announcement(base: System, missing: Sequence[SweepRun], total: int, engine: SweepEngine) -> str:
    """Return how many runs there are to make, and how long that may take."""
    if not missing:
        return f"{total} runs, all finished"
    begun = f"{total} runs" if len(missing) == total else f"{total} runs, {len(missing)} of them missing"
    if any(r.target is not None for r in missing):
        return f"{begun}; the static force of each is found in several trials"
    width = min(engine.width, len(missing))
    if not engine.is_rehearsed:
        return f"{begun}, {width} at a time"
    try:
        each = _rehearsed(base, missing)
    except InterruptedRunError:
        raise
    except MasterError:  # the run itself will say so
        return begun
    about = duration(each * -(-len(missing) // width))
    return f"{begun}, {width} at a time, about {about}"


def _rehearsed(base: System, missing: Sequence[SweepRun]) -> float:
    """Return about how long a run takes on average [s]: from the first steps of the middle one."""
    middle = missing[len(missing) // 2]
    system = middle.system(base)
    steps = min(system.step_count, _REHEARSED)
    short = replace(system, stop=system.start + steps * system.step, may_stop_early=True)
    with tempfile.TemporaryDirectory(prefix="sweep-") as name:
        began = time.perf_counter()
        done = run_system(short, Path(name) / "rehearsal")
        whole = time.perf_counter() - began
    stepping = float(done.summary["performance"]["wall_time"])
    mean = sum((r.stop - base.start) / r.step for r in missing) / len(missing)
    return whole - stepping + stepping / steps * mean


def duration(seconds: float) -> str:
    """Return a time in words.

    Examples
    --------
    >>> duration(42.3), duration(250.0), duration(9000.0)
    ('42 s', '4 min', '2.5 h')
    """
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
