"""An optimisation: points are tried as runs of a sweep are made, and best, table and page are on disk as they come."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from master.arrays import FloatArray
from master.batch.batch_session import PacedFiles
from master.batch.optimisation.candidate_search import SearchEnd, search
from master.batch.optimisation.optimisation_goal import (
    BoundedParameter,
    Goal,
    OptimisationRequest,
    read_bounds,
    sweep_request,
)
from master.batch.sweep.sweep_engines import HereEngine, MakeRuns, SweepEngine
from master.batch.sweep.sweep_journal import SweepJournal
from master.batch.sweep.sweep_plan import SweepPlan, SweepRequest
from master.batch.sweep.sweep_run import Row, RunPlace, SweepResult
from master.batch.sweep.sweep_table import MadeRuns, as_csv, has_parquet, write_parquet
from master.batch.sweep.swept_systems import SweepRun, make_runs
from master.errors import InterruptedRunError, RequestError
from master.results import results_folder
from master.safety.supervision import unfinished
from master.system.components import System

JSON: Final = "optimise.json"
CSV: Final = "optimise.csv"
PARQUET: Final = "optimise.parquet"
PAGE: Final = "optimise.html"
GENERATOR: Final = "openpanto optimise"
#: Where optimisations lie unless another folder is given, each in one named after its scenario.
PLACE: Final = Path("results") / "optimise"
#: Version of ``optimise.json``.
FORMAT: Final = 1
#: Parameters up to which every corner of the bounds is checked before the first run.
_MOST_CORNERS: Final = 8


@dataclass(frozen=True)
class OptimisationOutcome(MadeRuns):
    """The state of an optimisation.

    Attributes
    ----------
    scenario : str
        Its name.
    request : OptimisationRequest
    goal : Goal
    bounds : tuple of BoundedParameter
    runs : tuple of SweepRun
        The points that were tried, in their order; the first is where the search began.
    found : dict
        What has become of them, by key.
    place : str
        Where the scenario is, as a command names it.
    ended : str
        Why the search ended, empty if it has not.
    changes : mapping
        Values that all runs have in place of the scenario's (``--set``), as given, by ``component.parameter``.
    options : tuple of str
        Other options of all runs, as the command ``run`` takes them.
    """

    scenario: str
    request: OptimisationRequest
    goal: Goal
    bounds: tuple[BoundedParameter, ...]
    place: str = ""
    ended: str = ""
    changes: Mapping[str, str] = field(default_factory=dict)
    options: tuple[str, ...] = ()

    @property
    def start(self) -> float | None:
        """The figure where the search began."""
        return self.value(self.runs[0]) if self.runs else None

    @property
    def best(self) -> SweepRun | None:
        """The best run that keeps the constraints; of equal ones the first."""
        kept = [r for r in self.finished if self.goal.keeps(self.found[r.key])]
        return min(kept, key=lambda r: self.goal.merit(self.found[r.key]), default=None)

    def value(self, run: SweepRun) -> float | None:
        """Return the figure of a run, None if it has none."""
        return self.goal.value(self.found[run.key]) if run.key in self.found else None

    def rows_of(self, run: SweepRun) -> Sequence[Row]:
        """Return the figures of a run, a row for each pantograph."""
        return self.found[run.key].rows if run.key in self.found else ()

    @property
    def improvement(self) -> float | None:
        """By which share of its magnitude at the start the figure has become better; None if it cannot be said."""
        best = None if self.best is None else self.value(self.best)
        if best is None or not self.start:
            return None
        better = self.start - best if self.goal.is_least else best - self.start
        return better / abs(self.start)

    def point(self, run: SweepRun) -> list[float]:
        """Return the values of the varied parameters in a run."""
        return [float(run.inputs[b.parameter.title] or 0.0) for b in self.bounds]

    @property
    def at_bounds(self) -> dict[str, str]:
        """Which parameters of the best run lie at a bound, and at which."""
        if self.best is None:
            return {}
        places = {
            b.parameter.name: b.bound_at(value) for b, value in zip(self.bounds, self.point(self.best), strict=True)
        }
        return {name: place for name, place in places.items() if place}


@dataclass(frozen=True)
class OptimisationProgress:
    """How far an optimisation is: runs made, failed and allowed, the best figure so far in words."""

    done: int
    failed: int
    most: int
    best: str

    def __str__(self) -> str:
        return f"{self.done} of at most {self.most} runs done, {self.failed} failed, best {self.best or 'none yet'}"


def as_data(outcome: OptimisationOutcome) -> dict[str, Any]:
    """Return the contents of ``optimise.json``."""
    best = outcome.best
    values = [None] * len(outcome.bounds) if best is None else outcome.point(best)
    return {
        "format": FORMAT,
        "scenario": outcome.scenario,
        "status": outcome.status,
        "ended": outcome.ended,
        "date": outcome.date,
        "versions": dict(outcome.versions),
        "request": outcome.request.model_dump(mode="json", exclude_none=True),
        **({"changes": dict(outcome.changes)} if outcome.changes else {}),
        "goal": outcome.goal.text,
        "figure": outcome.goal.figure,
        "unit": outcome.goal.unit,
        "start": outcome.start,
        "best": None if best is None else {"run": best.number, "key": best.key, "value": outcome.value(best)},
        "improvement": outcome.improvement,
        "parameters": [
            {
                "name": b.parameter.name,
                "unit": b.parameter.unit,
                "low": b.low,
                "high": b.high,
                "start": b.start,
                "best": value,
                "at bound": outcome.at_bounds.get(b.parameter.name),
            }
            for b, value in zip(outcome.bounds, values, strict=True)
        ],
        "runs": len(outcome.finished),
        "failures": {str(number): reason for number, reason in outcome.failures.items()},
    }


class OptimisationFiles(PacedFiles[OptimisationOutcome]):
    """The files of an optimisation."""

    def __init__(self, page: Callable[[OptimisationOutcome], str]) -> None:
        texts = {CSV: lambda outcome: as_csv(outcome.rows), PAGE: page}
        super().__init__("optimisation", GENERATOR, JSON, as_data, texts)

    def write_now(self, state: OptimisationOutcome, folder: Path) -> None:
        """Write the files of a state."""
        super().write_now(state, folder)
        if has_parquet() and state.found:
            write_parquet(state.rows, folder / PARQUET)


@dataclass(frozen=True)
class PreparedOptimisation:
    """An optimisation of which everything is checked and nothing is run.

    Attributes
    ----------
    base : System
        Of the scenario as it is.
    sweep : SweepRequest
        What is asked for of each run.
    outcome : OptimisationOutcome
        Before the first run.
    """

    base: System
    sweep: SweepRequest
    outcome: OptimisationOutcome

    @classmethod
    def of(
        cls, base: System, request: OptimisationRequest, place: str = "", options: tuple[str, ...] = ()
    ) -> PreparedOptimisation:
        """Return the optimisation that a request asks for.

        Parameters
        ----------
        base : System
        request : OptimisationRequest
        place : str
            How a command names the scenario.
        options : tuple of str
            What the command ``run`` is to be told besides values, for runs like these.

        Raises
        ------
        RequestError
            Naming what cannot be done: the start and the corners of the bounds are checked as runs.
        """
        bounds = read_bounds(base, request)
        goal = Goal.read(base, request)
        asked = sweep_request(request, goal, bounds)
        corners = itertools.product(*((b.low, b.high) for b in bounds)) if len(bounds) <= _MOST_CORNERS else ()
        points = (tuple(b.start for b in bounds), *corners)
        make_runs(base, SweepPlan(tuple(b.parameter for b in bounds), points), asked)
        begun = OptimisationOutcome(
            base.name, request, goal, bounds, place=place or base.name, changes=base.changes, options=options
        )
        return cls(base, asked, begun)


def check_place(out: Path | None) -> None:
    """Refuse a folder, or that of all optimisations, in which none can be kept, before FMUs are built for one.

    Raises
    ------
    MasterError
    """
    results_folder.check_place(out, PLACE, JSON, GENERATOR, "optimisation")


def optimise(
    prepared: PreparedOptimisation,
    folder: Path,
    page: Callable[[OptimisationOutcome], str],
    engine: SweepEngine | None = None,
    tell: Callable[[str], None] = lambda _: None,
    show: Callable[[OptimisationProgress], None] = lambda _: None,
    again: bool = False,
) -> OptimisationOutcome:
    """Try points until the best is found; a point that was tried before in the same folder is not run again.

    Parameters
    ----------
    prepared : PreparedOptimisation
    folder : Path
        Created, or taken over from an earlier optimisation.
    page : callable
        Outcome -> the text of its page.
    engine : SweepEngine, optional
        Makes the runs; by default here, one after the other.
    tell, show : callable
        Show the user what is to be done, and the progress after each run.
    again : bool
        Whether runs that failed are made again.

    Raises
    ------
    InterruptedRunError
        If the user stops it; the files then have the finished runs and the best of them.
    MasterError
        If the folder holds something else, or the engine ends.
    """
    chosen, files = engine or HereEngine(), OptimisationFiles(page)
    state = prepared.outcome
    trial = None
    try:
        with (
            results_folder.taken_over(folder, JSON, files.generator, files.kind, state.scenario),
            unfinished(folder / JSON),
            closing(SweepJournal(folder)) as journal,
            chosen.opened(prepared.base, RunPlace(folder / "runs", "figures")) as make,
        ):
            tell(f"{state.goal.text}: at most {state.request.max_runs} runs")
            trial = _Trial(prepared, make, journal, lambda found: files.write(found, folder), show, again)
            files.write(state, folder)
            try:
                start = np.array([b.share(b.start) for b in state.bounds])
                ended = search(trial, start, state.request.max_runs, state.request.seed)
            except (InterruptedRunError, KeyboardInterrupt):
                files.write(replace(trial.outcome, status="interrupted"), folder)
                raise
            done = replace(trial.outcome, status="complete", ended=ended)
            files.write(done, folder)
            return done
    except (InterruptedRunError, KeyboardInterrupt) as error:
        made = 0 if trial is None else len(trial.outcome.finished)
        best = "" if trial is None else trial.told_best
        text = f"interrupted. {made} runs are finished{f', best {best}' if best else ''}, in {folder}"
        raise InterruptedRunError(f"{text}; the same command goes on") from error


class _Trial:
    """Tries points: makes the runs that were not made before, and keeps the state."""

    def __init__(
        self,
        prepared: PreparedOptimisation,
        make: MakeRuns,
        journal: SweepJournal,
        write: Callable[[OptimisationOutcome], None],
        show: Callable[[OptimisationProgress], None],
        again: bool,
    ) -> None:
        self._prepared, self._make, self._journal, self._write, self._show = prepared, make, journal, write, show
        self._known = {k: r for k, r in journal.found.items() if not (again and r.failed)}
        self._runs: dict[str, SweepRun] = {}
        self._found: dict[str, SweepResult] = {}

    @property
    def outcome(self) -> OptimisationOutcome:
        """The state so far."""
        return replace(self._prepared.outcome, runs=tuple(self._runs.values()), found=self._found)

    @property
    def told_best(self) -> str:
        """The best figure so far in words, empty if there is none."""
        outcome = self.outcome
        value = None if outcome.best is None else outcome.value(outcome.best)
        return "" if value is None else f"{outcome.goal.figure} {told(value, outcome.goal.unit)}"

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the merits of points of the unit cube, shape (n, D)."""
        wanted: list[SweepRun] = []
        room = True
        for point in points:
            run = self._run(point)
            if run.key not in self._runs:
                if len(self._runs) >= self._prepared.outcome.request.max_runs:
                    room = False
                    break
                self._runs[run.key] = run
            wanted.append(self._runs[run.key])
        self._carry_out(list({r.key: r for r in wanted if r.key not in self._found}.values()))
        if not room:
            raise SearchEnd
        return np.array([self._prepared.outcome.goal.merit(self._found[r.key]) for r in wanted])

    def _carry_out(self, runs: Sequence[SweepRun]) -> None:
        for run in runs:
            if run.key in self._known:
                self._found[run.key] = self._known[run.key]
        for result in self._make([r for r in runs if r.key not in self._found]):
            self._journal.add(result)
            self._found[result.key] = result
            self._write(self.outcome)
            self._tell_progress()
        self._tell_progress()

    def _tell_progress(self) -> None:
        outcome = self.outcome
        most = outcome.request.max_runs
        self._show(OptimisationProgress(len(outcome.finished), len(outcome.failures), most, self.told_best))

    def _run(self, point: FloatArray) -> SweepRun:
        """Return the run of a point; one that cannot be made has failed already."""
        bounds, asked = self._prepared.outcome.bounds, self._prepared.sweep
        values = tuple(b.value(float(share)) for b, share in zip(bounds, point, strict=True))
        number = len(self._runs) + 1
        try:
            plan = SweepPlan(tuple(b.parameter for b in bounds), (values,))
            (run,) = make_runs(self._prepared.base, plan, asked)
        except RequestError as error:
            key = hashlib.sha256(json.dumps([*values, str(error)]).encode()).hexdigest()[:16]
            base = self._prepared.base
            inputs = {b.parameter.title: value for b, value in zip(bounds, values, strict=True)}
            run = SweepRun(number, key, {}, base.stop, base.step, inputs=inputs)
            self._known[key] = SweepResult(key, reason=str(error).partition("): ")[2] or str(error))
        return replace(run, number=number)


def told(value: float, unit: str) -> str:
    """Return a figure in four digits with its unit."""
    digits = 0 if value == 0.0 else max(0, 3 - math.floor(math.log10(abs(value))))
    return f"{value:.{min(digits, 9)}f} {unit}".removesuffix(" 1")
