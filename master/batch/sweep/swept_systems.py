"""The runs of a sweep: the scenario's system with the values of each, checked before the first is made."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from master.batch.sweep.sweep_plan import SweepPlan, SweepRequest
from master.batch.sweep.swept_parameter import SweptParameter, SweptValue
from master.errors import RequestError
from master.scenario import value_checks
from master.scenario.overrides import with_values
from master.ssp.ssp_units import COMMON, conversion
from master.ssp.ssv import Value
from master.system.components import Component, System, without
from master.system.contacts import find_contacts
from master.system.pantograph_motion import STATIC_FORCE, constant_speed, pantographs, parameter_value
from master.system.step_rounding import ROUNDING

#: Swept values that the title of a run names.
_MOST_NAMED: Final = 4
_NUMBER: Final = r"\d+(?:\.\d+)?(?:[eE][+-]?\d+)?"
_LAW: Final = re.compile(rf"\s*({_NUMBER})\s*N?\s*(?:\+\s*({_NUMBER})\s*\*?\s*v(?:\^2|\*\*2|²)\s*)?", re.ASCII)


@dataclass(frozen=True)
class ForceLaw:
    """A force over the speed: F_0 + c v^2, as EN 50367 writes mean contact forces.

    Attributes
    ----------
    constant : float
        F_0 [N].
    factor : float
        c [N/(km/h)^2].
    """

    constant: float
    factor: float = 0.0

    @classmethod
    def read(cls, text: str) -> ForceLaw:
        """Return the law that a text states.

        Raises
        ------
        RequestError

        Examples
        --------
        >>> ForceLaw.read("70 N + 0.00097 v^2")(300.0)
        157.3
        """
        match = _LAW.fullmatch(text)
        if match is None:
            raise RequestError(f"'{text}' is not a force over the speed, such as '70 N + 0.00097 v^2' or '157.5 N'")
        return cls(float(match[1]), float(match[2] or 0.0))

    def __call__(self, speed: float) -> float:
        """Return the force at a speed [km/h]."""
        return self.constant + self.factor * speed**2


@dataclass(frozen=True)
class SweepRun:
    """One run of a sweep: what differs from the scenario's own system.

    Attributes
    ----------
    number : int
        From 1, in the order of the plan.
    key : str
        Identity of what is computed: equal for equal FMUs, values, times and settings.
    parameters : dict
        Values by component, in the FMUs' units.
    stop, step : float
        Of the run [s].
    absent : tuple of str
        Components that take no part.
    target : float, optional
        Mean contact force that the static force of every pantograph is found for [N].
    tolerance : float
        How near is enough [N].
    inputs : dict
        The swept values by the titles of their columns.
    variant : str
        Name of its row, if the values come from a table.
    is_rehearsal : bool
        Whether it is only to show how long others take: it may stop before it can be judged.
    """

    number: int
    key: str
    parameters: Mapping[str, Mapping[str, Value]]
    stop: float
    step: float
    absent: tuple[str, ...] = ()
    target: float | None = None
    tolerance: float = 0.2
    inputs: Mapping[str, SweptValue | None] = field(default_factory=dict)
    variant: str = ""
    is_rehearsal: bool = False

    def system(self, base: System) -> System:
        """Return the system of the run, from the scenario's own."""
        changed = tuple(replace(c, parameters=dict(self.parameters.get(c.name, c.parameters))) for c in base.components)
        name = f"{base.name}: run {self.number}"
        # The scenario's own title may say a speed that this run does not have.
        title = f"{base.title or base.name}, with {text}" if (text := self._differences()) else base.title
        whole = replace(base, name=name, title=title, components=changed, stop=self.stop)
        changed_whole = replace(whole, step=self.step, may_stop_early=whole.may_stop_early or self.is_rehearsal)
        return without(changed_whole, self.absent)

    def _differences(self) -> str:
        """Return the swept values as text, the first few of many."""
        given = [(title.partition(" ["), value) for title, value in self.inputs.items() if value is not None]
        texts = [
            f"{name} = {value:g} {unit[:-1]}".strip() if isinstance(value, float) else f"{name} = {value}"
            for (name, _, unit), value in given
        ]
        return ", ".join(texts[:_MOST_NAMED]) + (f" and {n} more" if (n := len(texts) - _MOST_NAMED) > 0 else "")

    def rehearsal(self, start: float, steps: int) -> SweepRun:
        """Return its first steps, as a run of its own that nothing is found for."""
        stop = min(self.stop, start + steps * self.step)
        return replace(self, key=f"rehearsal-{self.key}", stop=stop, target=None, is_rehearsal=True)


def make_runs(base: System, plan: SweepPlan, request: SweepRequest) -> tuple[SweepRun, ...]:
    """Return the runs of a plan, all checked.

    Parameters
    ----------
    base : System
        Of the scenario as it is.
    plan : SweepPlan
    request : SweepRequest

    Raises
    ------
    RequestError
        Naming the first run that cannot be made, and why.
    """
    return tuple(_runs(base, plan, _Choices.read(base, request)))


def _runs(base: System, plan: SweepPlan, choices: _Choices) -> Iterator[SweepRun]:
    origin = _fingerprint(base)
    for number, point in enumerate(plan.points, 1):
        values = dict(zip(plan.parameters, point, strict=True))
        try:
            run = _run(base, number, values, choices)
            system = run.system(base)
            problem = next(value_checks.problems(system, system.may_stop_early), "")
        except RequestError as error:
            raise RequestError(f"run {number} ({_told(values)}): {error}") from error
        if problem:
            raise RequestError(f"run {number} ({_told(values)}): {problem}")
        variant = plan.variants[number - 1] if plan.variants else ""
        yield replace(run, key=_key(origin, run), variant=variant)


def scenario_setting(base: System, plan: SweepPlan) -> dict[str, Any]:
    """Return what the page of a sweep needs to know of its scenario, as plain data."""
    settings = base.settings
    limits = settings.limits.model_dump()
    described = {
        name: variable.description
        for p in plan.parameters
        for name in p.targets
        if (variable := base.component(name.partition(".")[0]).fmu.variables[name.partition(".")[2]]).description
    }
    return {
        "interval": [settings.interval.start, settings.interval.end],
        "limits": {"supply": limits.pop("supply"), "own": limits},
        "speeds": {c.name: v for c in pantographs(base) if (v := _speed(c)) is not None},
        "contacts": {c.pantograph: c.prefix for c in reversed(find_contacts(base.connections))},
        "places": described,
        **({"changes": dict(base.changes)} if base.changes else {}),
    }


@dataclass(frozen=True)
class _Choices:
    """What of a request concerns every run."""

    stop: float | None
    static_force: ForceLaw | None
    mean_force: ForceLaw | None
    tolerance: float

    @classmethod
    def read(cls, base: System, request: SweepRequest) -> _Choices:
        static, mean = (None if t is None else ForceLaw.read(t) for t in (request.static_force, request.mean_force))
        if static is not None and mean is not None:
            raise RequestError("the static force is given or found for a mean force, not both")
        chosen = static or mean
        if mean is not None and mean.constant <= 0.0 and mean.factor <= 0.0:
            raise RequestError(f"the mean force '{request.mean_force}' must be greater than 0")
        if chosen is not None:
            trains = pantographs(base)
            if not trains:
                raise RequestError("the scenario has no pantograph whose static force could follow the speed")
            for c in trains:
                if parameter_value(c, STATIC_FORCE) is None:
                    raise RequestError(f"the FMU of '{c.name}' has no parameter '{STATIC_FORCE}'")
                if chosen.factor and _speed(c) is None:
                    raise RequestError(f"the FMU of '{c.name}' has no speed in km/h or m/s for the force to follow")
        return cls(request.stop, static, mean, request.tolerance)


def _told(values: Mapping[SweptParameter, SweptValue | None]) -> str:
    return ", ".join(f"{p.name} = {'none' if v is None else p.text(v)}" for p, v in values.items())


def _run(base: System, number: int, values: Mapping[SweptParameter, SweptValue | None], choices: _Choices) -> SweepRun:
    """Return a run, as yet without its identity."""
    texts = {target: p.text(v) for p, v in values.items() if v is not None for target in p.targets}
    components = with_values(base.components, texts)
    own = {p.name: float(v) for p, v in values.items() if not p.targets and v is not None}
    changed = replace(base, components=components, step=own.get("step", base.step))
    empty = tuple(target for p, v in values.items() if v is None for target in p.targets)
    given = {target.partition(".")[0] for target in texts}
    absent = tuple(dict.fromkeys(c for name in empty if (c := name.partition(".")[0]) not in given))
    if text := value_checks.empty_cells(base, empty) or value_checks.half_empty_rows(base, empty, absent):
        raise RequestError(text)
    changed = replace(changed, components=_with_forces(changed, absent, choices.static_force))
    stop = own.get("stop", choices.stop)
    changed = replace(changed, stop=_stop(base, without(changed, absent)) if stop is None else stop)
    if not changed.start < changed.stop < math.inf or not 0.0 < changed.step <= changed.stop - changed.start:
        raise RequestError(f"stop = {changed.stop:g} s and step = {changed.step:g} s do not go together")
    law, trains = choices.mean_force, pantographs(without(changed, absent))
    return SweepRun(
        number=number,
        key="",
        parameters={c.name: c.parameters for c in changed.components},
        stop=changed.stop,
        step=changed.step,
        absent=absent,
        target=None if law is None else law(_speed(trains[0]) or 0.0),
        tolerance=choices.tolerance,
        inputs={p.title: v for p, v in values.items()},
    )


def _with_forces(system: System, absent: Sequence[str], law: ForceLaw | None) -> tuple[Component, ...]:
    """Return the components with the static force that follows the speed."""
    if law is None:
        return system.components
    trains = pantographs(without(system, absent))
    units = {c.name: " N" if c.fmu.variables[STATIC_FORCE].unit else "" for c in trains}
    forces = {f"{c.name}.{STATIC_FORCE}": f"{law(_speed(c) or 0.0)!r}{units[c.name]}" for c in trains}
    return with_values(system.components, forces)


def _speed(component: Component) -> float | None:
    """Return the speed of a pantograph [km/h], None if its FMU does not say."""
    value = constant_speed(component)
    if value is None:
        return None
    unit = component.fmu.variables["speed"].unit or "m/s"
    known = {**component.fmu.units, **COMMON}
    found = conversion(known[unit], COMMON["km/h"]) if unit in known else None
    return None if found is None else found(value)


def _stop(base: System, changed: System) -> float:
    """Return the stop time [s]: every pantograph comes as far as in the scenario, and leaves the interval."""
    if _moves_alike(base, changed):
        return base.stop
    slowness = max(_slowness(base.component(c.name), c) for c in pantographs(changed))
    steps = math.ceil(slowness * (base.stop - base.start) / changed.step - ROUNDING)
    found, after = base.start + steps * changed.step, value_checks.stop_after_interval(changed)
    return found if isinstance(after, str) else max(found, after)


def _moves_alike(base: System, changed: System) -> bool:
    return all(
        parameter_value(c, name) == parameter_value(base.component(c.name), name)
        for c in pantographs(changed)
        for name in ("speed", "start_position")
    )


def _slowness(before: Component, after: Component) -> float:
    """Return how many times as long as before a pantograph takes for the same way."""
    old, new = (constant_speed(c) for c in (before, after))
    return old / new if old and new and old > 0.0 < new else 1.0


def _fingerprint(base: System) -> list[Any]:
    fmus = [[c.name, c.fmu.sha256, c.tolerance] for c in base.components]
    return [fmus, base.start, base.settings.model_dump(mode="json")]


def _key(origin: Sequence[Any], run: SweepRun) -> str:
    own = [{name: dict(values) for name, values in run.parameters.items()}, run.stop, run.step, run.absent]
    found = [] if run.target is None else [run.target, run.tolerance]
    return hashlib.sha256(json.dumps([origin, own, found], sort_keys=True).encode()).hexdigest()[:16]
