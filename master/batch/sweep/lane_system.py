"""What of a scenario can be stepped side by side without FMUs, and the jobs that are made of it."""

from __future__ import annotations

import json
import re
import tomllib
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from master.batch.sweep.swept_systems import SweepRun
from master.errors import RequestError
from master.fmu.fmu_provision import why_not_ours
from master.recording.recording_plan import RecordingPlan, recording_plans
from master.system.components import Component, Fmu, System
from master.system.contacts import Contact
from master.system.pantograph_motion import USE_TRAIN

#: Version of the job; see ``models/commands/lanes_files.py``.
_FORMAT: Final = 1
_DEFINITION: Final = "resources/definition.toml"
#: What an FMU has beside it, where the line's running surface was measured.
_PROFILE: Final = "running_surface.csv"
_DROPPER: Final = "dropper["
#: Parameters of pantographs that runs side by side do not know, if they are there at all or are not 0.
_NOT_IN_LANES: Final = ("lowest_height", "highest_height", "start_height")
_FRICTION: Final = re.compile(r"stage\[\d+\]\.friction")
_INSTEAD: Final = "use --engine fmu"


@dataclass(frozen=True)
class LaneGroup:
    """Runs of one line.

    Attributes
    ----------
    base : System
        Of the scenario.
    runs : tuple of SweepRun
    """

    base: System
    runs: tuple[SweepRun, ...]

    def write(self, folder: Path) -> None:
        """Write the job of these runs, ``job.json``, with the definitions that it needs."""
        system = self.runs[0].system(self.base)
        contacts = _in_order(system)
        line, trains = system.component(contacts[0].catenary), [system.component(c.pantograph) for c in contacts]
        names = [f"pantograph_{i}.toml" for i in range(1, len(trains) + 1)]
        for name, component in (("line.toml", line), *zip(names, trains, strict=True)):
            (folder / name).write_bytes(_definition(component.fmu))
        if (profile := _profile(line.fmu)) is not None:
            (folder / _PROFILE).write_bytes(profile)
        plans = recording_plans(system)
        data = {
            "format": _FORMAT,
            "line": "line.toml",
            "line_values": line.parameters,
            "pantographs": names,
            "start": system.start,
            "step": system.step,
            "every": dropper_rate(plans, line.name),
            "dropper_forces": _has_forces(plans, line.name),
            "lanes": [_lane(run.system(self.base)) for run in self.runs],
        }
        (folder / "job.json").write_text(json.dumps(data, allow_nan=False), encoding="utf-8")


def _lane(system: System) -> dict[str, Any]:
    trains = [system.component(c.pantograph).parameters for c in _in_order(system)]
    return {"steps": system.step_count, "pantographs": trains}


def _in_order(system: System) -> Sequence[Contact]:
    return sorted(system.contacts, key=lambda c: c.index)


def dropper_rate(plans: Sequence[RecordingPlan], line: str) -> int:
    """Return after how many steps droppers are recorded, the most often if that differs; 0 if they are not."""
    rates = [p.every for p in plans if any(name.startswith(_DROPPER) for name in p.names.get(line, ()))]
    return min(rates, default=0)


def _has_forces(plans: Sequence[RecordingPlan], line: str) -> bool:
    return any(n.startswith(_DROPPER) and n.endswith(".force") for p in plans for n in p.names.get(line, ()))


def grouped(base: System, runs: Sequence[SweepRun]) -> Iterator[LaneGroup]:
    """Yield groups of runs with the same line, macro step and components."""
    groups: dict[str, list[SweepRun]] = {}
    lines = {c.catenary for c in base.contacts}
    for run in runs:
        own = [sorted(run.parameters.get(name, {}).items()) for name in sorted(lines)]
        groups.setdefault(repr((own, run.step, sorted(run.absent))), []).append(run)
    for found in groups.values():
        yield LaneGroup(base, tuple(found))


def check_scenario(system: System) -> None:
    """Refuse a scenario whose runs cannot be stepped side by side.

    Raises
    ------
    RequestError
        Naming the first thing in the way.
    """
    scheme = system.settings.coupling.scheme
    if scheme != "jacobi":
        raise RequestError(f"--engine lanes couples by the scheme jacobi, and the scenario by {scheme}; {_INSTEAD}")
    contacts = _in_order(system)
    lines = {c.catenary for c in contacts}
    if len(lines) != 1:
        raise RequestError(f"--engine lanes needs one line with pantographs, the scenario has {len(lines)}; {_INSTEAD}")
    trains = [c.pantograph for c in contacts]
    others = [c.name for c in system.components if c.name not in {*lines, *trains}]
    if others or len(set(trains)) < len(trains):
        what = others[0] if others else trains[0]
        text = f"steps one line and pantographs with a contact each; '{what}' is something else"
        raise RequestError(f"--engine lanes {text}; {_INSTEAD}")
    _check_connections(system, contacts)
    for component in system.components:
        _check_component(component, is_pantograph=component.name not in lines)


def _check_connections(system: System, contacts: Sequence[Contact]) -> None:
    """Refuse connections other than those of the contacts, and those that convert what they lead."""
    wanted = {pair for c in contacts for pair in _pairs(c)}
    found = {(f"{c.source}.{c.output}", f"{c.target}.{c.input}"): c for c in system.connections}
    for pair, connection in found.items():
        if pair not in wanted:
            raise RequestError(f"--engine lanes has no connection from {pair[0]} to {pair[1]}; {_INSTEAD}")
        if connection.conversion.factor != 1.0 or connection.conversion.offset != 0.0:
            raise RequestError(f"--engine lanes does not convert what goes from {pair[0]} to {pair[1]}; {_INSTEAD}")
    for pair in sorted(wanted - set(found)):
        raise RequestError(f"--engine lanes always leads {pair[0]} to {pair[1]}, the scenario does not; {_INSTEAD}")


def _pairs(contact: Contact) -> Iterator[tuple[str, str]]:
    port = contact.prefix.removesuffix(".contact")
    yield contact.force, f"{contact.pantograph}.contact.force"
    for axis in "xyz":
        yield contact.point(axis), f"{contact.pantograph}.contact.{axis}"
        for end in "AB":
            yield f"{contact.pantograph}.{end}.{axis}", f"{port}.{end}.{axis}"
            yield f"{contact.pantograph}.{end}.v{axis}", f"{port}.{end}.v{axis}"


def _check_component(component: Component, *, is_pantograph: bool) -> None:
    if why := why_not_ours(component.fmu.path):
        raise RequestError(f"--engine lanes cannot look into the FMU of '{component.name}': {why}; {_INSTEAD}")
    found = tomllib.loads(_definition(component.fmu).decode("utf-8-sig")).get("type")
    if is_pantograph and found != "lumped":
        text = f"steps lumped pantographs, and '{component.name}' is of type {found}"
        raise RequestError(f"--engine lanes {text}; {_INSTEAD}")
    for name in component.parameters:
        variable = component.fmu.variables[name]
        if variable.causality != "parameter":
            text = f"{component.name}.{name}: it sets no start value of an {variable.causality}"
            raise RequestError(f"--engine lanes, {text}; {_INSTEAD}")
    for name in component.fmu.variables:
        if name in _NOT_IN_LANES or (_FRICTION.fullmatch(name) and _chosen(component, name)):
            text = f"has pantographs without stops, friction and start_height ({component.name}.{name})"
            raise RequestError(f"--engine lanes {text}; {_INSTEAD}")
    if _chosen(component, "follow_height"):
        text = f"has no pantograph that follows the height: set {component.name}.follow_height=0 (spring on the roof)"
        raise RequestError(f"--engine lanes {text}, or {_INSTEAD}")
    if _chosen(component, USE_TRAIN):
        raise RequestError(f"--engine lanes runs at constant speed ({component.name}.{USE_TRAIN}); {_INSTEAD}")
    if _chosen(component, "monitor_energy"):
        raise RequestError(f"--engine lanes keeps no balance of energy ({component.name}.monitor_energy); {_INSTEAD}")


def _chosen(component: Component, name: str) -> bool:
    """Whether a parameter that is 0 or 1 is not 0; False if there is none."""
    variable = component.fmu.variables.get(name)
    return variable is not None and bool(float(component.parameters.get(name, variable.start or 0.0)))


def _profile(fmu: Fmu) -> bytes | None:
    with zipfile.ZipFile(fmu.path) as file:
        place = f"resources/{_PROFILE}"
        return file.read(place) if place in file.namelist() else None


def _definition(fmu: Fmu) -> bytes:
    try:
        with zipfile.ZipFile(fmu.path) as file:
            return file.read(_DEFINITION)
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        raise RequestError(f"--engine lanes: {fmu.path.name} holds no definition ({error}); {_INSTEAD}") from error
