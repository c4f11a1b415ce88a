"""From a family's table to runnable systems, and their runs."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from master import results
from master.calibrate import Found, find_values
from master.caution import CautionObserver
from master.errors import MasterError, UsageError
from master.results import Results
from master.run import run
from master.scenario import Overrides, find_parameter, open_scenario
from master.simulation import Observer
from master.study.family import Calibration, Family, Interval, Variant
from master.system import Component, System

#: Makes the observers of one run, and takes them away after it.
Watching = Callable[[System], AbstractContextManager[Sequence[Observer]]]


@contextmanager
def unwatched(_: System) -> Iterator[Sequence[Observer]]:
    """Watch nothing."""
    yield ()


@dataclass(frozen=True)
class Runner:
    """How runs are made.

    Attributes
    ----------
    watching : callable
        System -> context manager that gives its observers (progress).
    tell : callable
        Is told what takes time, and what FMUs warn of.
    build : bool
        Whether missing or stale FMUs are built.
    """

    watching: Watching = unwatched
    tell: Callable[[str], None] = lambda _: None
    build: bool = True

    def run(self, system: System, folder: Path) -> Results:
        """Run one system."""
        cautions = CautionObserver(lambda caution: self.tell(f"{system.name}: {caution}"))
        with self.watching(system) as observers:
            return run(system, folder, [cautions, *observers])

    @contextmanager
    def opened(self, family: Family, variant: Variant) -> Iterator[System]:
        """Give the system of a variant; its FMUs may be in a folder that is gone afterwards.

        Raises
        ------
        ScenarioError, UsageError
            If scenario and table do not go together.
        """
        overrides = Overrides(stop=variant.stop, step=variant.step, parameters=variant.values)
        with open_scenario(family.folder, overrides, self.tell, self.build) as scenario:
            system = without(scenario.system, variant.absent)
            yield replace(system, name=f"{family.name}: {variant.name}")


def without(system: System, names: Sequence[str]) -> System:
    """Return a system without some components; what they were connected to keeps its start values.

    Raises
    ------
    UsageError
        If there is no such component.
    """
    for name in names:
        if name not in {c.name for c in system.components}:
            raise UsageError(f"the scenario has no component '{name}', which a column of the table names")
    coupling = system.settings.coupling
    order = tuple(name for name in coupling.order if name not in names)
    settings = system.settings.model_copy(update={"coupling": coupling.model_copy(update={"order": order})})
    connections = tuple(c for c in system.connections if c.source not in names and c.target not in names)
    left = [c for c in system.components if c.name not in names]
    exchanged = {(c.source, c.output) for c in connections} | {(c.target, c.input) for c in connections}
    components = tuple(_trimmed(c, exchanged) for c in left)
    return replace(system, components=components, connections=connections, settings=settings)


def _trimmed(component: Component, exchanged: set[tuple[str, str]]) -> Component:
    inputs, outputs = (
        tuple(v for v in names if (component.name, v) in exchanged) for names in (component.inputs, component.outputs)
    )
    return replace(component, inputs=inputs, outputs=outputs)


def finished(folder: Path, system: System) -> Results | None:
    """Return the results in a folder if they are those of just this system, complete."""
    if not results.is_ours(folder):
        return None
    found = results.read(folder)
    return found if found.summary.get("status") == "complete" and _is_of(found.summary, system) else None


def _is_of(summary: dict[str, Any], system: System) -> bool:
    """Whether a run had the same FMUs, values, times and settings."""
    components = [[c.name, c.fmu.sha256, c.parameters] for c in system.components]
    times = {"start": system.start, "stop": system.stop, "step": system.step}
    wanted = [components, {**times, **system.settings.model_dump(mode="json")}]
    found = [[c["name"], c["sha256"], c["parameters"]] for c in summary.get("components", [])]
    return bool(json.loads(json.dumps(wanted)) == [found, summary.get("settings")])


def calibrate_variant(family: Family, variant: Variant, runner: Runner) -> dict[str, Found]:
    """Find the pantographs' parameters that give each the wanted mean force, by ``component.parameter``.

    Raises
    ------
    MasterError
        If the family says nothing about calibration, or it does not succeed.
    """
    wanted = family.settings.calibration
    if wanted is None:
        raise UsageError(f"study '{family.name}' has no [calibration]")
    interval = next(i for i in family.settings.interval if i.name == wanted.interval)
    with runner.opened(family, variant) as system:
        names = _calibrated(system, wanted)
        starts = [float(variant.values.get(name, _start_value(system, name))) for name in names]

        def means(values: tuple[float, ...]) -> tuple[float, ...]:
            changed = _with_values(system, dict(zip(names, values, strict=True)))
            found = _means(changed, interval, [n.partition(".")[0] for n in names], runner)
            runner.tell(", ".join(f"{n} = {v:.5g}: {m:.2f} N" for n, v, m in zip(names, values, found, strict=True)))
            return found

        runner.tell(f"filter: {results.filter_of(system.settings.filter.model_dump()).sentence}")
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
