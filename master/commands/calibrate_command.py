"""The verb ``calibrate``."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from master.batch import calibration
from master.commands.command_options import overrides_of, say, say_warnings
from master.commands.run_command import run_shown
from master.errors import Problem, RequestError, ScenarioError
from master.results import run_results
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import find_parameter
from master.scenario.scenario_place import located, refuse_installed
from master.ssp.archive import SSD_NAME, Package, Sources
from master.ssp.run_settings import Calibration
from master.ssp.ssd import read_structure
from master.ssp.ssp_xml import Reader
from master.system.components import System


def calibrate_verb(options: argparse.Namespace) -> int:
    """Find the parameter value that gives the wanted mean force; store it unless told not to."""
    is_stored = not (options.dry_run or options.set)
    folder = located(options.scenario)
    if is_stored:
        refuse_installed(folder)
    is_folder = folder.is_dir()
    with calibration.unchanged(folder) if is_stored and is_folder else nullcontext(lambda: None) as check:
        return _calibrated(options, is_stored, check)


def _calibrated(options: argparse.Namespace, is_stored: bool, check: Callable[[], None]) -> int:
    with open_scenario(options.scenario, overrides_of(options), say, not options.no_build) as scenario:
        system = scenario.system
        say_warnings(system)
        task = calibration.task(system, options.parameter, options.mean, options.tolerance)
        place = _place(scenario.package, task.parameter) if is_stored else None
        found = _found(system, task)
        runs = f"{len(found.trials)} run{'s' if len(found.trials) > 1 else ''}"
        print(
            f"{task.parameter} = {found.value:.6g} gives a mean force of {found.result:.2f} N "
            f"({runs}; filter {_filter_of(system)})"
        )
        if place is not None:
            note = (
                f"mean force {found.result:.2f} N (wanted {task.mean_force:g} N) after {_filter_of(system)}, with "
                f"{system.settings.coupling.scheme}, macro step {system.step:g} s, "
                f"in {runs} of 'openpanto calibrate'"
            )
            check()
            calibration.store_value(*place, found.value, note)
            print(f"stored in {place[0]}")
        elif options.set:
            print("not stored: it is for the values of --set, which the scenario does not have")
    return 0


def _filter_of(system: System) -> str:
    return run_results.filter_of(system.settings.filter.model_dump()).short


def _found(system: System, task: Calibration) -> calibration.CalibrationResult:
    start = calibration.start_value(system, task.parameter)
    return calibration.find_value(lambda value: _trial(system, task, value), task.mean_force, start, task.tolerance)


def _trial(system: System, task: Calibration, value: float) -> float:
    index, variable = find_parameter(system.components, task.parameter)
    component = system.components[index]
    changed = replace(component, parameters={**component.parameters, variable.name: value})
    components = (*system.components[:index], changed, *system.components[index + 1 :])
    with tempfile.TemporaryDirectory(prefix="calibrate-") as folder:
        done = run_shown(replace(system, components=components), Path(folder), quiet=False)
        mean = calibration.mean_force(done, task)
    say(f"{task.parameter} = {value:.6g}: mean force {mean:.3f} N")
    return mean


def _place(package: Package, parameter: str) -> tuple[Path, str]:
    """Return the ``.ssv`` file that holds a parameter, and the name of the parameter there."""
    if not package.writable:
        raise RequestError(f"{package.origin} is an archive; calibrate its folder, or use --dry-run")
    structure = read_structure(Sources(package.root), Reader(SSD_NAME))
    for c in structure.components:
        for binding in c.bindings:
            for p in binding.parameters.parameters:
                if f"{c.name}.{binding.prefix}{p.name}" == parameter:
                    return package.root / p.file, p.name
    text = f"parameter '{parameter}' is not in the scenario's parameter files; add it, or use --dry-run"
    raise ScenarioError([Problem(SSD_NAME, 0, "calibration", text)])
