"""Runs of scenarios from Python: one run, and the search for the static force that gives a mean contact force."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from master.batch import calibration
from master.coupling.macro_steps import Observer
from master.errors import RequestError
from master.fmu.isolation.isolated_instance import Isolation
from master.interface.results_view import Results
from master.interface.scenario_view import Scenario, open_scenario
from master.report import report_files
from master.report.progress import ProgressObserver
from master.report.terminal_summary import Terminal
from master.results import parquet_export, results_folder, run_results
from master.run_session import RunOptions
from master.run_session import run as run_system
from master.scenario import open_scenario as scenario_files
from master.ssp.archive import Package
from master.system.components import System

T = TypeVar("T")


def run(
    scenario: Scenario | str | Path,
    out: str | Path | None = None,
    *,
    report: bool = False,
    parquet: bool = False,
    progress: bool = False,
    isolate: bool = False,
) -> Results:
    """Run a scenario and return its results, which are in the folder too.

    Parameters
    ----------
    scenario : Scenario, str or Path
        From `open_scenario`, or what it takes.
    out : str or Path, optional
        Results folder, ``results/NAME`` by default; an earlier run in it is replaced.
    report : bool
        Whether ``report.html`` and its charts are written.
    parquet : bool
        Whether the time series are written as Parquet too (needs pyarrow).
    progress : bool
        Whether a terminal shows how far the run is.
    isolate : bool
        Whether every FMU has a process to itself, so that one that crashes ends the run in a sentence.

    Raises
    ------
    ScenarioError
        With every problem of the scenario.
    RunError
        If the run stops before its end; what was computed is in the folder then.
    MasterError
        If the folder is something else, or another process works in it.
    """
    chosen = scenario if isinstance(scenario, Scenario) else open_scenario(scenario)
    options = RunOptions(isolation=Isolation() if isolate else None)
    check_out(out)
    with scenario_files.open_scenario(chosen.path, chosen.overrides) as opened:
        system = opened.system
        folder = Path(out) if out is not None else Path("results") / system.name
        keep_apart(folder, opened.package)
        with results_folder.claimed(folder):
            done = _shown(system, folder, options) if progress else run_system(system, folder, (), options)
            if report:
                report_files.write(done)
            if parquet:
                parquet_export.write_parquet(folder)
    return Results(done)


def check_out(out: object) -> None:
    """Refuse what cannot be the path of a results folder.

    Raises
    ------
    RequestError
    """
    if out is not None and (not isinstance(out, str | Path) or not str(out).strip()):
        raise RequestError(f"out: {out!r} is not the path of a results folder")


def teller(progress: bool) -> Callable[[object], None]:
    """Return what prints a text to standard error, if what happens is to be printed."""
    console = Terminal(stderr=True)

    def tell(text: object) -> None:
        if progress:
            console.print(str(text), markup=False, highlight=False)

    return tell


def by_parameter(name: str, given: Mapping[str, T] | None) -> dict[str, T]:
    """Return what an argument gives by parameter, as a dict of its own.

    Raises
    ------
    RequestError
        If it is no mapping.
    """
    if given is not None and not isinstance(given, Mapping):
        raise RequestError(f"{name}: {given!r} is not a mapping, such as {{'speed': '200:320:20'}}")
    return dict(given or {})


def keep_apart(folder: Path, package: Package) -> None:
    """Refuse a results folder that lies inside the scenario, or the other way round.

    Raises
    ------
    RequestError
    """
    if folder.resolve().is_relative_to(package.root) or package.root.is_relative_to(folder.resolve()):
        raise RequestError(
            f"the results folder {folder} and the scenario lie inside each other; choose another one (--out)"
        )


def _shown(system: System, folder: Path, options: RunOptions) -> run_results.Results:
    bar = ProgressObserver(Terminal(stderr=True), system.start, system.stop)
    observers: list[Observer] = [bar]
    try:
        return run_system(system, folder, observers, options)
    finally:
        bar.finish()


@dataclass(frozen=True)
class Calibrated:
    """What a calibration has found.

    Attributes
    ----------
    scenario : Scenario
        The scenario with the value set.
    parameter : str
        ``component.parameter``.
    value : float
        In the FMU's unit.
    mean_force : float
        The mean contact force that it gives [N].
    trials : tuple of (float, float)
        Value and mean force of every run.
    """

    scenario: Scenario
    parameter: str
    value: float
    mean_force: float
    trials: tuple[tuple[float, float], ...]


def calibrate(
    scenario: Scenario | str | Path,
    *,
    parameter: str | None = None,
    mean: float | None = None,
    tolerance: float | None = None,
) -> Calibrated:
    """Find the value of a parameter that gives a wanted mean contact force; nothing is stored in the scenario.

    Parameters
    ----------
    scenario : Scenario, str or Path
        From `open_scenario`, or what it takes.
    parameter : str, optional
        ``component.parameter`` to change; by default as the scenario says.
    mean, tolerance : float, optional
        Wanted mean force, and how near to it is enough [N]; by default as the scenario says.

    Raises
    ------
    RequestError
        If neither the scenario nor the call says what to calibrate.
    MasterError
        If no value is found, or the mean force does not depend on it.
    """
    chosen = scenario if isinstance(scenario, Scenario) else open_scenario(scenario)
    task = calibration.task(chosen.system, parameter, mean, tolerance)

    def mean_of(value: float) -> float:
        with tempfile.TemporaryDirectory(prefix="calibrate-") as folder:
            done = run(chosen.set({task.parameter: value}), folder)
            return calibration.mean_force(done.stored, task)

    start = calibration.start_value(chosen.system, task.parameter)
    found = calibration.find_value(mean_of, task.mean_force, start, task.tolerance)
    trials = tuple((t.value, t.result) for t in found.trials)
    return Calibrated(chosen.set({task.parameter: found.value}), task.parameter, found.value, found.result, trials)
