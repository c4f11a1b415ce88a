"""A sweep: what is missing is run, and the table is written as runs finish."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from master.batch.batch_session import PacedFiles, run_tasks
from master.batch.sweep.earlier_sweep import check_earlier, run_settings
from master.batch.sweep.held_fmus import held_fmus
from master.batch.sweep.pages import sweep_page
from master.batch.sweep.pages.criticality import unseen_note
from master.batch.sweep.pages.sweep_view import read_view, view_of
from master.batch.sweep.sensitivity import SensitivityIndices, described
from master.batch.sweep.sensitivity_table import failed_note, sensitivity_csv, sensitivity_data, sensitivity_of
from master.batch.sweep.sweep_engines import HereEngine, MakeRuns, SweepEngine
from master.batch.sweep.sweep_journal import SweepJournal
from master.batch.sweep.sweep_plan import SweepPlan, SweepRequest, make_plan
from master.batch.sweep.sweep_run import RunPlace, SweepResult
from master.batch.sweep.sweep_table import MadeRuns, as_csv, has_parquet, no_figures, unjudged_note, write_parquet
from master.batch.sweep.swept_systems import SweepRun, make_runs, scenario_setting
from master.errors import InterruptedRunError
from master.report.report_files import write_charts
from master.results import results_folder
from master.scenario.value_checks import uncovered
from master.system.components import System

JSON: Final = "sweep.json"
CSV: Final = "sweep.csv"
PARQUET: Final = "sweep.parquet"
PAGE: Final = "sweep.html"
GENERATOR: Final = "openpanto sweep"
SENSITIVITY_CSV: Final = "sensitivity.csv"
SENSITIVITY_JSON: Final = "sensitivity.json"
RUNS: Final = "runs"
#: Where sweeps lie unless another folder is given, each in one named after its scenario.
PLACE: Final = Path("results") / "sweep"
#: Version of ``sweep.json`` and of the table.
FORMAT: Final = 1
#: Files of a run that was kept whole, and of none that was thinned.
TIME_SERIES: Final = "timeseries*.csv"
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
class SweepOutcome(MadeRuns):
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
    setting : dict
        What the page needs to know of the scenario, as in ``sweep.json``.
    settings : dict
        What all runs have in common besides values, as in ``sweep.json``.
    checks : sequence of dict
        Runs that were made in two ways, and by how much these differ; see `SweepEngine`.
    """

    scenario: str
    request: SweepRequest
    plan: SweepPlan
    setting: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    checks: Sequence[Mapping[str, Any]] = ()

    @cached_property
    def sensitivity(self) -> tuple[SensitivityIndices, ...]:
        """Indices of every figure that varies; none if they were not asked for, or as long as runs are missing."""
        return sensitivity_of(self.request, self.plan, self.runs, self.found)


def as_data(outcome: SweepOutcome) -> dict[str, Any]:
    """Return the contents of ``sweep.json``."""
    sampled = {d.parameter.name: d.text for d in outcome.plan.distributions}
    return {
        "format": FORMAT,
        "scenario": outcome.scenario,
        "status": outcome.status,
        "date": outcome.date,
        "versions": dict(outcome.versions),
        "settings": dict(outcome.settings),
        "setting": dict(outcome.setting),
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


class SweepFiles(PacedFiles[SweepOutcome]):
    """The files of a sweep."""

    def __init__(self) -> None:
        super().__init__("sweep", GENERATOR, JSON, as_data, {CSV: lambda outcome: as_csv(outcome.rows)})

    def write_now(self, state: SweepOutcome, folder: Path) -> None:
        """Write the files of a state; the page at the end."""
        super().write_now(state, folder)
        if has_parquet() and state.found:
            write_parquet(state.rows, folder / PARQUET)
        if state.status != "running":
            indices = sensitivity_data(state.sensitivity)["indices"]
            view = view_of(as_data(state), state.rows, folder, indices)
            results_folder.write_text(folder / PAGE, sweep_page.page(view))


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
        setting, settings = scenario_setting(base, plan), run_settings(base, plan)
        return cls(base, SweepOutcome(base.name, request, plan, runs=runs, setting=setting, settings=settings))

    @property
    def announced(self) -> str:
        """Why there are as many runs as there are, empty if that is plain."""
        request, plan = self.outcome.request, self.outcome.plan
        if request.sensitivity is None:
            return ""
        return described(request.sensitivity, len(plan.parameters), request.samples or 0)

    @cached_property
    def unjudged(self) -> Mapping[int, str]:
        """Why runs will have no figures, by their numbers, as far as that is known: they end too soon."""
        if not self.base.may_stop_early:  # such runs are refused
            return {}
        found = ((run.number, uncovered(run.system(self.base))) for run in self.outcome.runs)
        return {number: why for number, why in found if why}

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user is to be told before the first run."""
        return tuple(filter(None, (self.announced, self.unseen, no_figures(self.unjudged, "will have"))))

    @property
    def unseen(self) -> str:
        """Which faults lie where no run is judged, empty if none does."""
        setting = self.outcome.setting
        return unseen_note(setting.get("places", {}), setting.get("interval", (None, None)))


def check_place(out: Path | None) -> None:
    """Refuse a folder, or that of all sweeps, in which no sweep can be kept, before FMUs are built for one.

    Raises
    ------
    MasterError
    """
    results_folder.check_place(out, PLACE, JSON, GENERATOR, "sweep")


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
        If the folder holds something else, another sweep or that of another scenario included, or the engine ends.
    """
    state, chosen = prepared.outcome, engine or HereEngine()
    place = RunPlace(folder / RUNS, state.request.keep)
    files = SweepFiles()
    found: dict[str, SweepResult] = {}
    try:
        with results_folder.taken_over(folder, JSON, files.generator, files.kind, state.scenario):
            check_earlier(folder / JSON, prepared.base, state.request, state.plan, state.runs)
            _remove_leftovers(folder)
            with closing(SweepJournal(folder)) as journal:
                old = {k: r for k, r in journal.found.items() if not (again and r.failed) and _is_there(r, place)}
                found |= {r.key: old[r.key] for r in state.runs if r.key in old}
                missing = list({r.key: r for r in state.runs if r.key not in found}.values())
                state = replace(state, found=found, checks=chosen.checks)

                def finish(so_far: SweepOutcome, result: SweepResult) -> SweepOutcome:
                    journal.add(result)
                    found[result.key] = result  # a copy each time would be long for many runs
                    return so_far

                for text in prepared.notes:
                    tell(text)
                with held_fmus(prepared.base, folder) as held, chosen.opened(held, place) as make_runs_of:
                    tell(_announcement(make_runs_of, prepared.base.start, missing, state, chosen))
                    results = _shown(make_runs_of, missing, state, chosen, show)
                    ended = run_tasks(state, results, finish, files, folder)
                _write_sensitivity(ended, folder, tell)
                if note := unjudged_note(row for row in ended.rows if row["run"] not in prepared.unjudged):
                    tell(note)
                return ended
    except (InterruptedRunError, KeyboardInterrupt) as error:
        done = f"{len([r for r in state.runs if r.key in found])} of {len(state.runs)} runs are finished"
        raise InterruptedRunError(f"interrupted. {done} and in {folder}; the same command makes the others") from error


def write_report(folder: Path, formats: Collection[str] = ()) -> list[Path]:
    """Write the page of the sweep in a folder again, and its charts as files in some formats; return their paths.

    Raises
    ------
    MasterError
        If its files cannot be read.
    """
    view = read_view(folder / JSON, folder / CSV, folder / SENSITIVITY_JSON)
    results_folder.write_text(folder / PAGE, sweep_page.page(view))
    return [folder / PAGE, *write_charts(sweep_page.file_charts(view), folder, formats)]


def _write_sensitivity(done: SweepOutcome, folder: Path, tell: Callable[[str], None]) -> None:
    """Write the indices of a finished sweep; those of an earlier one are not left beside its table."""
    found = done.sensitivity
    if not found:
        for name in (SENSITIVITY_CSV, SENSITIVITY_JSON):
            (folder / name).unlink(missing_ok=True)
    else:
        results_folder.write_text(folder / SENSITIVITY_CSV, sensitivity_csv(found))
        results_folder.write_json(folder / SENSITIVITY_JSON, sensitivity_data(found))
    if text := failed_note(done.request, found, len(done.failures)):
        tell(text)


def _remove_leftovers(folder: Path) -> None:
    for place in (folder, folder / RUNS):
        for path in place.glob(f"{results_folder.WORK}*"):
            shutil.rmtree(path, ignore_errors=True)


def _is_there(result: SweepResult, place: RunPlace) -> bool:
    """Whether what shall stay of a finished run is still there; of a failed one there may never have been anything."""
    if result.failed or place.keep in ("figures", "failed"):
        return True
    folder = place.of(result.key)
    return any(folder.glob(TIME_SERIES)) if place.keep == "all" else folder.is_dir()


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


def _announcement(
    make: MakeRuns, start: float, missing: Sequence[SweepRun], state: SweepOutcome, engine: SweepEngine
) -> str:
    """Return how many runs there are to make, and how long that may take."""
    total = len(state.runs)
    if not missing:
        return f"{total} runs, all finished"
    which = f"{len(missing)} of them {'missing' if state.found else 'different'}"
    begun = f"{total} runs" if len(missing) == total else f"{total} runs, {which}"
    if any(r.target is not None for r in missing):
        return f"{begun}; the static force of each is found in several trials"
    if not engine.is_rehearsed:
        return f"{begun}, {min(engine.width, len(missing))} at a time"
    seconds = _rehearsed(make, start, missing, engine)
    if seconds is None:  # the runs themselves will say why
        return begun
    about = duration(seconds)
    return f"{begun}, {min(engine.width, len(missing))} at a time, about {about}"


def _rehearsed(make: MakeRuns, start: float, missing: Sequence[SweepRun], engine: SweepEngine) -> float | None:
    """Return about how long runs take [s], from the first steps of the middle one; None if they fail.

    They are made twice: a process loads FMUs and compiles in its first run alone.
    """
    short = missing[len(missing) // 2].rehearsal(start, _REHEARSED)
    first = next(iter(make([short])))
    if not first.stepping:
        return None
    then = next(iter(make([short])))
    mean = sum((r.stop - start) / r.step for r in missing) / len(missing)
    each = then.seconds - then.stepping + then.stepping * mean * short.step / (short.stop - start)
    others = max(0.0, first.seconds - then.seconds) if engine.width > 1 else 0.0
    return others + each * -(-len(missing) // engine.width)


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
