"""A scenario opened from Python: its parameters with units, and copies of it in which some of them are changed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from numbers import Integral, Real
from pathlib import Path

from master.errors import RequestError
from master.scenario import open_scenario as scenario_files
from master.scenario.overrides import Overrides, with_values
from master.scenario.start_values import settable
from master.ssp.run_settings import Scheme
from master.ssp.ssp_units import COMMON, conversion, split_quantity
from master.system.components import Component, System, Variable

#: A value from Python: a number in the unit that is declared, or a text with or without a unit (``12 kN``).
Value = float | int | bool | str


@dataclass(frozen=True)
class Parameter:
    """A parameter of a scenario.

    Attributes
    ----------
    name : str
        ``component.parameter``.
    value : float, int, bool or str
        As it will be used, in ``unit``.
    unit : str
        As the FMU declares it, empty if it declares none.
    description : str
    is_set : bool
        Whether the scenario, or a change to it, sets it; otherwise the value is the FMU's own.
    """

    name: str
    value: Value
    unit: str
    description: str
    is_set: bool


@dataclass(frozen=True)
class Scenario:
    """A scenario that has been checked and can be run; `open_scenario` makes it, `set` returns changed copies.

    Attributes
    ----------
    path : Path
        Where it lies, as it was asked for.
    system : System
        What it describes, for a look at it; no promise is kept for this attribute.
    overrides : Overrides
        What differs from the files; likewise.
    """

    path: Path
    system: System = field(repr=False)
    overrides: Overrides = field(repr=False)

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.system.name

    @property
    def warnings(self) -> tuple[str, ...]:
        """What can be run but may not be intended."""
        return self.system.warnings

    @property
    def pantographs(self) -> tuple[str, ...]:
        """Component names of the pantographs, in the order of their contacts."""
        return tuple(c.pantograph for c in self.system.contacts)

    @property
    def interval(self) -> tuple[float | None, float | None]:
        """Interval of interest along the track [m]; None where it is open."""
        return self.system.settings.interval.start, self.system.settings.interval.end

    @property
    def stop(self) -> float:
        """Stop time [s]."""
        return self.system.stop

    @property
    def step(self) -> float:
        """Macro step [s]."""
        return self.system.step

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Every parameter that can be set, by name."""
        found = (
            _parameter(c, v)
            for c in self.system.components
            for v in c.fmu.variables.values()
            if v.causality == "parameter" and not settable(v, v.type)
        )
        return {p.name: p for p in found}

    def set(self, values: Mapping[str, Value] | None = None, /, **parameters: Value) -> Scenario:
        """Return the scenario with other parameter values.

        Parameters
        ----------
        values : mapping, optional
            Values by ``component.parameter``.
        **parameters
            Values by the parameter's name alone, where only one component has it.

        Returns
        -------
        Scenario
            A copy; this one stays as it is. A number is in the FMU's own unit, a text may have one (``160 N``).

        Raises
        ------
        RequestError
            If there is no such parameter, several components have it, or it cannot take the value.
        """
        if values is not None and not isinstance(values, Mapping):
            text = "write set(static_force='120 N') or set({'pantograph.static_force': '120 N'})"
            raise RequestError(f"set({values!r}) says no parameter with its value: {text}")
        if wrong := [name for name in values or {} if not isinstance(name, str)]:
            raise RequestError(f"set: {wrong[0]!r} is not the name of a parameter, such as 'pantograph.static_force'")
        short = {self._full(name): value for name, value in parameters.items()}
        if twice := sorted(short.keys() & (values or {})):
            raise RequestError(f"parameter '{twice[0]}' is given twice, in full and in short: give it once")
        given = {**(values or {}), **short}
        texts = {**self.overrides.parameters, **{name: _text(name, value) for name, value in given.items()}}
        components = with_values(self.system.components, texts)
        changed = replace(self.overrides, parameters=texts)
        return replace(self, system=replace(self.system, components=components, changes=texts), overrides=changed)

    def _full(self, name: str) -> str:
        owners = [c.name for c in self.system.components if name in c.fmu.variables]
        if len(owners) > 1:
            text = f"{' and '.join(owners)} have a parameter '{name}'"
            raise RequestError(f"{text}; name one of them: set({{'{owners[0]}.{name}': ...}})")
        longer = [full for full in self.parameters if not owners and full.endswith(f".{name}")]
        if longer:
            text = f"no component has a parameter '{name}', but there are {', '.join(longer)}"
            raise RequestError(f"{text}; name one of them: set({{'{longer[0]}': ...}})")
        return f"{owners[0]}.{name}" if owners else name  # for an unknown one, `with_values` says which are like it


def open_scenario(
    scenario: str | Path,
    *,
    stop: Value | None = None,
    step: Value | None = None,
    scheme: Scheme | None = None,
    energy: bool = False,
    build: bool = True,
) -> Scenario:
    """Open and check a scenario; FMUs of the library that it lacks are built.

    Parameters
    ----------
    scenario : str or Path
        As the command line takes it: the path of a folder or archive ``NAME.ssp``, the folder of a project, or a name
        in the library.
    stop, step : float or str, optional
        Stop time and macro step, in seconds or with a unit (``0.5 ms``). A run that stops before the end of the
        interval of interest is not judged.
    scheme : str, optional
        Coupling scheme: ``jacobi``, ``gauss-seidel`` or ``iterative``.
    energy : bool
        Whether the balance of energy is kept and recorded.
    build : bool
        Whether missing or stale FMUs are built.

    Raises
    ------
    ScenarioError
        With every problem found.
    RequestError
        If something impossible is asked for.

    Examples
    --------
    >>> open_scenario("no_such.ssp")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    master.errors.ScenarioError: no_such.ssp...
    """
    if not isinstance(scenario, str | Path) or not str(scenario).strip():
        raise RequestError(f"open_scenario({scenario!r}): give the path of a scenario, or a name in the library")
    stop_time, time_step = _seconds("stop", stop), _seconds("step", step)
    overrides = Overrides(stop_time, time_step, scheme, energy=energy, may_stop_early=stop is not None)
    with scenario_files.open_scenario(Path(scenario), overrides, build=build) as opened:
        return Scenario(Path(scenario), opened.system, overrides)


def _parameter(component: Component, variable: Variable) -> Parameter:
    is_set = variable.name in component.parameters
    value = component.parameters[variable.name] if is_set else _start(variable)
    return Parameter(f"{component.name}.{variable.name}", value, variable.unit, variable.description, is_set)


def _start(variable: Variable) -> Value:
    text = variable.start or ""
    if variable.type == "Real":
        return float(text or 0.0)
    if variable.type == "Boolean":
        return text in ("true", "1")
    return text if variable.type == "String" else int(text or 0)


def _text(name: str, value: Value) -> str:
    """Return a value as text that is read back to the same bits."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Integral):
        return str(int(value))
    if isinstance(value, Real):
        return repr(float(value))
    raise RequestError(f"parameter '{name}': give a number, a text or True or False, not a {type(value).__name__}")


def _seconds(name: str, value: Value | None) -> float | None:
    if value is None:
        return None
    number, unit = split_quantity(_text(name, value))
    known = COMMON.get(unit or "s")
    found = conversion(known, COMMON["s"]) if known else None
    if number is None or found is None or not math.isfinite(number):
        raise RequestError(f"{name}: '{value}' is not a time; give seconds, or a number with its unit ('0.5 ms')")
    return found(number)
