"""The systems of a family's variants, their earlier results and their calibration."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from master.batch.batch_session import Runner
from master.batch.calibration import CalibrationResult, find_values
from master.batch.study.family import Calibration, Family, Interval, Variant
from master.errors import MasterError, RequestError
from master.results import results_folder, run_results
from master.results.run_results import Results
from master.scenario.overrides import Overrides, find_parameter
from master.system.components import System


@contextmanager
def opened_variant(family: Family, variant: Variant, runner: Runner) -> Iterator[System]:
    """Yield the system of a variant; its FMUs may lie in a folder that is gone afterwards.

    Raises
    ------
    ScenarioError, RequestError
        If scenario and table do not go together.
    """
    v = variant
    overrides = Overrides(v.stop, v.step, parameters=v.values, absent=v.absent, empty=v.empty)
    with runner.opened(family.folder, overrides) as system:
        yield replace(system, name=f"{family.name}: {variant.name}")


def finished(folder: Path, system: System) -> Results | None:
    """Return the results in a folder if they are complete and of this very system, else None."""
    if not results_folder.is_ours(folder):
        return None
    found = run_results.read(folder)
    return found if found.summary.get("status") == "complete" and _is_of(found.summary, system) else None


def _is_of(summary: dict[str, Any], system: System) -> bool:
    """Return whether a run had the same FMUs, values, times and settings."""
    components = [[c.name, c.fmu.sha256, c.parameters] for c in system.components]
    times = {"start": system.start, "stop": system.stop, "step": system.step}
    wanted = [components, {**times, **system.settings.model_dump(mode="json")}]
    found = [[c["name"], c.get("sha256"), c.get("parameters")] for c in summary.get("components", [])]
    return bool(json.loads(json.dumps(wanted)) == [found, summary.get("settings")])


def calibrate_variant(family: Family, variant: Variant, runner: Runner) -> dict[str, CalibrationResult]:
    """Find the parameters, by ``component.parameter``, with which each pantograph has the target mean force.

    Raises
    ------
    MasterError
        If the family has no calibration, or it does not succeed.
    """
    wanted = family.settings.calibration
    if wanted is None:
        raise RequestError(f"study '{family.name}' has no [calibration]")
    interval = next(i for i in family.settings.interval if i.name == wanted.interval)
    with opened_variant(family, variant, runner) as system:
        names = _calibrated(system, wanted)
        starts = [float(variant.values.get(name, _start_value(system, name))) for name in names]

        def means(values: tuple[float, ...]) -> tuple[float, ...]:
            changed = _with_values(system, dict(zip(names, values, strict=True)))
            found = _means(changed, interval, [n.partition(".")[0] for n in names], runner)
            runner.tell(", ".join(f"{n} = {v:.5g}: {m:.2f} N" for n, v, m in zip(names, values, found, strict=True)))
            return found

        runner.tell(f"filter: {run_results.filter_of(system.settings.filter.model_dump()).sentence}")
        return dict(zip(names, find_values(means, wanted.mean_force, starts, wanted.tolerance), strict=True))


def _calibrated(system: System, wanted: Calibration) -> list[str]:
    pantographs = dict.fromkeys(c.target for c in system.connections if c.input == "contact.force")
    return [f"{name}.{wanted.parameter}" for name in pantographs]


def _start_value(system: System, name: str) -> float:
    index, variable = find_parameter(system.components, name)
    return float(system.components[index].parameters.get(variable.name, variable.start or 0.0))


def _with_values(system: System, values: dict[str, float]) -> System:
    components = list(system.components)
    for name, value in values.items():
        index, variable = find_parameter(system.components, name)
        changed = {**components[index].parameters, variable.name: value}
        components[index] = replace(components[index], parameters=changed)
    return replace(system, components=tuple(components))


def _means(system: System, interval: Interval, pantographs: Sequence[str], runner: Runner) -> tuple[float, ...]:
    with tempfile.TemporaryDirectory(prefix="calibrate-") as folder:
        done = runner.run(system, Path(folder))
        found = done.assessments_in((interval.start, interval.end))
    means = {a.contact.pantograph: a.quality.mean for a in found}
    missing = [p for p in pantographs if p not in means]
    if missing:
        where = f"'{interval.name}', {interval.start:g} m to {interval.end:g} m"
        raise MasterError(f"{system.name}: {', '.join(missing)} has no contact in {where}; check the stop time")
    return tuple(means[p] for p in pantographs)
