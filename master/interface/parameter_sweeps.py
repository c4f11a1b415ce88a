"""Sweeps from Python: many runs of a scenario with other values, and their table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from master.batch.sweep.distributions import Method
from master.batch.sweep.engine_selection import engine_of
from master.batch.sweep.sensitivity import SensitivityMethod
from master.batch.sweep.sensitivity_table import sensitivity_heads, sensitivity_rows
from master.batch.sweep.sweep_plan import Engine, Keep, SweepRequest, listed_faults
from master.batch.sweep.sweep_session import PAGE, PLACE, PreparedSweep, SweepOutcome, check_place
from master.batch.sweep.sweep_session import sweep as run_sweep
from master.batch.sweep.sweep_table import typed_columns
from master.errors import RequestError
from master.interface.data_frames import columns_frame, table_frame
from master.interface.results_view import Results, read_results
from master.interface.scenario_runs import by_parameter, check_out, keep_apart, teller
from master.interface.scenario_view import Scenario, open_scenario
from master.scenario import open_scenario as scenario_files

if TYPE_CHECKING:
    import pandas

#: Values of a parameter from Python: a text as on the command line, or a sequence of numbers or texts.
Values = str | Sequence[float | str]


@dataclass(frozen=True)
class Sweep:
    """A sweep that was made.

    Attributes
    ----------
    folder : Path
        Holds the table, and the runs that were kept.
    outcome : SweepOutcome
        All that is known of it; no promise is kept for this attribute.
    """

    folder: Path
    outcome: SweepOutcome

    @property
    def failures(self) -> dict[int, str]:
        """Why runs failed, by their numbers."""
        return self.outcome.failures

    @property
    def page(self) -> Path:
        """The page of its charts, a single HTML file."""
        return self.folder / PAGE

    @property
    def table(self) -> pandas.DataFrame:
        """Inputs and figures, a row for each run and pantograph (needs pandas)."""
        return columns_frame(typed_columns(self.outcome.rows))

    @property
    def sensitivity(self) -> pandas.DataFrame:
        """Indices of every figure with their intervals, a row for each figure and parameter (needs pandas).

        It has no rows if none were asked for, or no figure varies.
        """
        return table_frame(sensitivity_heads(), sensitivity_rows(self.outcome.sensitivity))

    def results(self, run: int) -> Results:
        """Return the results of a run by its number, if all of it was kept.

        Raises
        ------
        RequestError
            If there is no such run, or its time series were not kept.
        """
        found = next((r for r in self.outcome.runs if r.number == run), None)
        if found is None:
            raise RequestError(f"there is no run {run}; there are {len(self.outcome.runs)}")
        folder = self.folder / "runs" / found.key
        if self.outcome.request.keep != "all" or not folder.is_dir():
            raise RequestError(f"the time series of run {run} were not kept; sweep with keep='all'")
        return read_results(folder)


def sweep(
    scenario: Scenario | str | Path,
    out: str | Path | None = None,
    *,
    over: Mapping[str, Values] | None = None,
    vary: Mapping[str, str] | None = None,
    samples: int | None = None,
    seed: int = 1,
    method: Method | None = None,
    sensitivity: SensitivityMethod | None = None,
    table: str | Path | None = None,
    faults: str | Sequence[int] = (),
    span: int | Sequence[int] = (),
    static_force: str | None = None,
    mean_force: str | None = None,
    mean_tolerance: float | None = None,
    keep: Keep = "figures",
    engine: Engine = "fmu",
    check: int = 1,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: bool = False,
) -> Sweep:
    """Run a scenario over a grid, a sample or a table of values; what is in the folder already is not run again.

    Parameters
    ----------
    scenario : Scenario, str or Path
        From `open_scenario`, or what it takes.
    out : str or Path, optional
        Folder of the sweep, ``results/sweep/NAME`` by default.
    over : mapping, optional
        Values of a grid by parameter: ``{"speed": "200:320:20"}``, ``{"catenary.contact_wire.tension": ["18 kN",
        "20 kN"]}``. A name without component is that of every pantograph's parameter.
    vary : mapping, optional
        Distributions by parameter: ``{"catenary.contact_wire.tension": "normal(20 kN, 0.2 kN)"}``.
    samples, seed, method
        How many samples of the distributions, from which seed, and how: ``lhs`` (default) or ``sobol``.
    sensitivity : str, optional
        ``sobol`` or ``morris``: as many blocks of runs as ``samples`` says, for indices of what matters.
    table : str or Path, optional
        CSV file with a row for each run.
    faults : str or sequence of int
        ``each-dropper`` or ``each-arm``: droppers of ``span`` that break one after the other, or arms at its ends that
        come off; the first run has no fault. Spans alone are those of droppers.
    span : int or sequence of int
        Spans of the line, from 1.
    static_force, mean_force : str, optional
        Static force over the speed, ``70 N + 0.00097 v^2`` with v in km/h; or the mean force that it is found for.
    mean_tolerance : float, optional
        How near to the mean force is enough, 0.2 N by default.
    keep : str
        What stays beside the table: ``all``, ``thinned``, ``figures`` or ``failed``.
    engine, check
        ``lanes`` makes runs with lumped pantographs side by side without FMUs, and ``check`` of them as FMUs as well.
    jobs : int, optional
        Runs at a time, each in a process; a script that gives it begins with ``if __name__ == "__main__":``.
    scheduler : str, optional
        Address of a Dask scheduler whose workers make the runs instead.
    progress : bool
        Whether what happens is printed to standard error.

    Raises
    ------
    RequestError
        If something impossible is asked for; nothing is run then.
    MasterError
        If the folder holds something else, or the workers are gone.
    """
    chosen = scenario if isinstance(scenario, Scenario) else open_scenario(scenario)
    grid = {name: _listed(name, values) for name, values in by_parameter("over", over).items()}
    asked: dict[str, object] = {"over": grid, "vary": by_parameter("vary", vary), "samples": samples, "seed": seed}
    asked |= {} if method is None else {"method": method}
    asked |= {} if mean_tolerance is None else {"tolerance": mean_tolerance}
    given = {
        "sensitivity": sensitivity,
        "table": table,
        **listed_faults(faults, span),
        "static_force": static_force,
        "mean_force": mean_force,
        "keep": keep,
        "engine": engine,
        "check": check,
    }
    request = SweepRequest.read({**asked, **given, "stop": chosen.overrides.stop})
    tell = teller(progress)
    overrides = replace(chosen.overrides, faults=request.faults, faults_of=request.faults_of)
    check_out(out)
    check_place(None if out is None else Path(out))
    with scenario_files.open_scenario(chosen.path, overrides) as opened:
        folder = Path(out) if out is not None else PLACE / opened.system.name
        keep_apart(folder, opened.package)
        prepared = PreparedSweep.of(opened.system, request)
        return Sweep(
            folder,
            run_sweep(prepared, folder, engine_of(jobs, scheduler, tell, request=request, is_script=True), tell, tell),
        )


def _listed(name: str, values: Values) -> str:
    if isinstance(values, str):
        return values
    try:
        return ",".join(map(_written, values))
    except (TypeError, ValueError) as error:
        raise RequestError(f"{name}: {values!r} is neither a text nor a list of numbers or texts") from error


def _written(value: object) -> str:
    """Return a value as on the command line, that of numpy too."""
    if isinstance(value, str):
        return value
    plain = getattr(value, "item", lambda: value)()
    if isinstance(plain, bool):
        return str(plain).lower()
    return str(plain) if isinstance(plain, int) else repr(float(plain))  # type: ignore[arg-type]
