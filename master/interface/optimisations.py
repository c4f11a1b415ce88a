"""Optimisation from Python: the values of a few parameters for which a figure is least or greatest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from master.batch.optimisation.optimisation_goal import OptimisationRequest
from master.batch.optimisation.optimisation_page import page, verdict
from master.batch.optimisation.optimisation_session import PLACE, OptimisationOutcome, PreparedOptimisation, check_place
from master.batch.optimisation.optimisation_session import optimise as run_optimisation
from master.batch.sweep.engine_selection import engine_of
from master.batch.sweep.sweep_table import typed_columns
from master.interface.data_frames import columns_frame
from master.interface.scenario_runs import by_parameter, check_out, keep_apart, teller
from master.interface.scenario_view import Scenario, open_scenario
from master.scenario import open_scenario as scenario_files

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Optimisation:
    """An optimisation that was made.

    Attributes
    ----------
    folder : Path
        Holds page and table.
    outcome : OptimisationOutcome
        All that is known of it; no promise is kept for this attribute.
    """

    folder: Path
    outcome: OptimisationOutcome

    def __str__(self) -> str:
        return verdict(self.outcome)

    @property
    def best(self) -> dict[str, float]:
        """Values of the parameters in the best run, named with their units; empty if none keeps the constraints."""
        run = self.outcome.best
        if run is None:
            return {}
        names = [b.parameter.title for b in self.outcome.bounds]
        return dict(zip(names, self.outcome.point(run), strict=True))

    @property
    def value(self) -> float | None:
        """The figure in the best run, None if none keeps the constraints."""
        return None if self.outcome.best is None else self.outcome.value(self.outcome.best)

    @property
    def start(self) -> float | None:
        """The figure where the search began, None if that run failed."""
        return self.outcome.start

    @property
    def at_bounds(self) -> dict[str, str]:
        """Which parameters of the best run lie at their ``lower`` or ``upper`` bound."""
        return self.outcome.at_bounds

    @property
    def table(self) -> pandas.DataFrame:
        """Inputs and figures, a row for each run and pantograph (needs pandas)."""
        return columns_frame(typed_columns(self.outcome.rows))


def optimise(
    scenario: Scenario | str | Path,
    out: str | Path | None = None,
    *,
    minimise: str | None = None,
    maximise: str | None = None,
    vary: Mapping[str, str],
    subject_to: Sequence[str] = (),
    max_runs: int = 60,
    seed: int = 1,
    mean_tolerance: float | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: bool = False,
) -> Optimisation:
    """Find the values of a few parameters for which a figure is least or greatest.

    Parameters
    ----------
    scenario : Scenario, str or Path
        From `open_scenario`, or what it takes.
    out : str or Path, optional
        Folder of the optimisation, ``results/optimise/NAME`` by default; what is in it already is not run again.
    minimise, maximise : str, optional
        The figure, one of the two: ``sigma``, or what else the table has.
    vary : mapping
        Bounds by parameter: ``{"pantograph.stage[3].stiffness": "3000:12000 N/m"}``.
    subject_to : sequence of str
        ``mean=157.5 N`` (by the static force), ``maximum<=350 N``, ``minimum>=0 N``.
    max_runs : int
        Most points that are tried.
    seed : int
    mean_tolerance : float, optional
        How near to a mean force that is held is enough, 0.2 N by default.
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
    asked: dict[str, object] = {
        "minimise": minimise,
        "maximise": maximise,
        "vary": by_parameter("vary", vary),
        "subject_to": [subject_to] if isinstance(subject_to, str) else list(subject_to),
    }
    asked |= {} if mean_tolerance is None else {"tolerance": mean_tolerance}
    request = OptimisationRequest.read({**asked, "max_runs": max_runs, "seed": seed, "stop": chosen.overrides.stop})
    tell = teller(progress)
    check_out(out)
    check_place(None if out is None else Path(out))
    with scenario_files.open_scenario(chosen.path, replace(chosen.overrides, may_stop_early=False)) as opened:
        folder = Path(out) if out is not None else PLACE / opened.system.name
        keep_apart(folder, opened.package)
        prepared = PreparedOptimisation.of(opened.system, request, str(chosen.path), chosen.overrides.options)
        engine = engine_of(jobs, scheduler, tell, is_script=True)
        return Optimisation(folder, run_optimisation(prepared, folder, page, engine, tell, tell))
