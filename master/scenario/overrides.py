"""What the command line changes in a scenario, and the settings and values that result."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from master.errors import Problem, RequestError, hint
from master.scenario.start_values import out_of_range, settable
from master.ssp.archive import SSD_NAME
from master.ssp.run_settings import DEFAULT_RECORDS, Record, RunSettings, Scheme
from master.ssp.ssd import Structure
from master.ssp.ssp_units import COMMON, conversion, number_advice, split_quantity
from master.system.components import Component, Fmu, Variable
from master.system.step_rounding import MEASURED
from master.system.variable_names import ENERGY_INTERVAL, ENERGY_MONITOR, ENERGY_VARIABLES, matcher

#: Of what a line FMU of ours lists faults.
FaultsOf = Literal["each-dropper", "each-arm"]


@dataclass(frozen=True)
class Overrides:
    """What the command line changes in a scenario.

    Attributes
    ----------
    stop, step : float, optional
        Stop time and macro step [s].
    scheme : str, optional
        Coupling scheme.
    parameters : dict
        Values as text by ``component.parameter``, with a unit (``12 kN``) or in the FMU's own.
    energy : bool
        Whether every FMU that can is to keep its energy balance, and that is to be recorded.
    tolerance : float, optional
        Relative tolerance for all FMUs, instead of that of their default experiments.
    strict : bool
        Whether a warning is a problem.
    outside : tuple of Path
        Folders outside the scenario whose files it may name.
    absent : tuple of str
        Components that take no part.
    empty : tuple of str
        Parameters, ``component.parameter``, of a table that has no value for them; a line's must have one.
    may_stop_early : bool
        Whether the stop time may lie before the end of the interval of interest.
    faults : tuple of int
        Spans for whose droppers a line FMU of ours lists a fault each, none of them active.
    faults_of : str
        ``each-dropper``, or ``each-arm``: the steady arms at both ends of these spans instead.
    """

    stop: float | None = None
    step: float | None = None
    scheme: Scheme | None = None
    parameters: Mapping[str, str] = field(default_factory=dict)
    energy: bool = False
    tolerance: float | None = None
    strict: bool = False
    outside: tuple[Path, ...] = ()
    absent: tuple[str, ...] = ()
    empty: tuple[str, ...] = ()
    may_stop_early: bool = False
    faults: tuple[int, ...] = ()
    faults_of: FaultsOf = "each-dropper"

    @property
    def options(self) -> tuple[str, ...]:
        """Step and scheme as the command ``run`` takes them, as far as they are given.

        Examples
        --------
        >>> Overrides(step=0.0005, scheme="jacobi").options
        ('--step', '0.0005', '--scheme', 'jacobi')
        """
        given = {"--step": self.step, "--scheme": self.scheme}
        return tuple(word for name, value in given.items() if value is not None for word in (name, str(value)))

    def source(self, written: str) -> str:
        """Return the source of a component, which is another for a line FMU of ours that lists faults.

        Examples
        --------
        >>> Overrides(faults=(14, 15)).source("resources/Catenary_LN2.fmu")
        'resources/Catenary_LN2_F14F15.fmu'
        """
        folder, separator, name = written.rpartition("/")
        if not self.faults or not (name.startswith("Catenary_") and name.endswith(".fmu")):
            return written
        letter = {"each-dropper": "F", "each-arm": "A"}[self.faults_of]
        return f"{folder}{separator}{name.removesuffix('.fmu')}_{''.join(f'{letter}{n}' for n in self.faults)}.fmu"


def effective_settings(
    structure: Structure, overrides: Overrides, components: tuple[Component, ...], problems: list[Problem]
) -> RunSettings:
    """Return the settings of a run; adds what in them cannot be met to ``problems``."""
    settings = structure.annotations.settings
    if overrides.scheme is not None:
        coupling = settings.coupling.model_copy(update={"scheme": overrides.scheme})
        settings = settings.model_copy(update={"coupling": coupling})
    names = sorted(c.name for c in structure.components)
    order = settings.coupling.order
    if order and sorted(order) != names:
        text = f"Coupling order '{' '.join(order)}' must name every component once: {' '.join(names)}"
        problems.append(Problem(SSD_NAME, 0, "annotation", text))
    if settings.coupling.scheme == "iterative":
        problems.extend(
            Problem(
                SSD_NAME,
                0,
                "fmu",
                f"scheme iterative: the FMU of '{c.name}' cannot save and restore its state",
            )
            for c in components
            if not c.fmu.can_restore
        )
    if len(components) == len(structure.components):  # of an FMU that cannot be read nobody knows the variables
        problems.extend(Problem(SSD_NAME, 0, "annotation", text) for text in _unknown(settings, components))
    return settings


def _unknown(settings: RunSettings, components: tuple[Component, ...]) -> Iterator[str]:
    """Yield what the settings name and no component has; a pattern that matches nothing is a typing error."""
    variables = {f"{c.name}.{v.name}": v for c in components for v in c.fmu.variables.values()}
    recordable = [n for n, v in variables.items() if v.type != "String" and v.causality in MEASURED]
    for record in settings.records:
        for pattern in record.variables if record not in DEFAULT_RECORDS else ():
            if not any(map(matcher(pattern), recordable)):
                near = hint(pattern, recordable)
                yield f"Record variables: '{pattern}' fits no output or local variable of the components{near}"
    wanted = settings.calibration
    if wanted is not None and (wanted.parameter not in variables or settable(variables[wanted.parameter], "Real")):
        near = hint(wanted.parameter, variables)
        yield f"Calibration parameter: '{wanted.parameter}' is no Real parameter of the components{near}"


def with_values(components: tuple[Component, ...], values: Mapping[str, str]) -> tuple[Component, ...]:
    """Return components with other parameter values.

    Parameters
    ----------
    components : tuple of Component
    values : mapping
        Values as text, with a unit or in the FMU's own, by ``component.parameter``.

    Raises
    ------
    RequestError
        If there is no such parameter, or it cannot take the value.
    """
    for full, text in values.items():
        index, variable = find_parameter(components, full)
        old = components[index]
        changed = replace(old, parameters={**old.parameters, variable.name: _typed(old.fmu, variable, full, text)})
        components = (*components[:index], changed, *components[index + 1 :])
    return components


def with_energy(components: tuple[Component, ...], settings: RunSettings) -> tuple[tuple[Component, ...], RunSettings]:
    """Make the components that can keep their energy balance do so, and record it."""
    able = [ENERGY_MONITOR in c.fmu.variables for c in components]
    if not any(able):
        raise RequestError(f"--energy: no FMU of the scenario has the parameter '{ENERGY_MONITOR}'; build them again")
    watched = tuple(
        replace(c, parameters={**c.parameters, ENERGY_MONITOR: 1}) if can else c
        for c, can in zip(components, able, strict=True)
    )
    record = Record(variables=ENERGY_VARIABLES, every=ENERGY_INTERVAL)
    return watched, settings.model_copy(update={"records": (*settings.records, record)})


def find_parameter(components: tuple[Component, ...], full: str) -> tuple[int, Variable]:
    """Find ``component.parameter``; returns the component's index and the variable.

    Raises
    ------
    RequestError
        Naming the nearest parameters, if there is no such one.
    """
    for index, component in enumerate(components):
        variable = component.fmu.variables.get(full[len(component.name) + 1 :])
        if full.startswith(f"{component.name}.") and variable is not None:
            return index, variable
    settables = [
        f"{c.name}.{v.name}" for c in components for v in c.fmu.variables.values() if v.causality == "parameter"
    ]
    raise RequestError(f"there is no parameter '{full}' in the scenario{hint(full, settables, most=3)}")


def _typed(fmu: Fmu, variable: Variable, full: str, text: str) -> float | int | bool | str:
    reason = settable(variable, variable.type if variable.type != "Enumeration" else "Integer")
    if reason:
        raise RequestError(f"parameter '{full}' {reason}")
    if variable.type == "String":
        return text
    if variable.type == "Boolean":
        if text.lower() not in ("true", "false", "1", "0"):
            raise RequestError(f"parameter '{full}': '{text}' is neither true nor false")
        return text.lower() in ("true", "1")
    items = dict(variable.items)
    number = items[text] if text in items else _number(fmu, variable, full, text)
    reason = out_of_range(variable, number)
    if reason:
        raise RequestError(f"parameter '{full}' {reason}")
    return number


def _number(fmu: Fmu, variable: Variable, full: str, text: str) -> float:
    return _quantity(fmu, variable, full, text) if variable.type == "Real" else _whole(full, text)


def _whole(full: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise RequestError(f"parameter '{full}': '{text}' is not a whole number") from None


def _quantity(fmu: Fmu, variable: Variable, full: str, text: str) -> float:
    """Return a number in the FMU's unit from a text with or without a unit."""
    advice = number_advice(text) if "," in text else ""
    number, unit = split_quantity(text)
    if number is None or advice:
        example = f", or a number with its unit ('{variable.start or 1} {variable.unit}')" if variable.unit else ""
        raise RequestError(f"parameter '{full}': '{text}' is not a number{advice or example}")
    if not unit or unit == variable.unit:
        return number
    known = {**fmu.units, **COMMON}
    if unit not in known:
        listed = f"(known: {', '.join(known)}){hint(unit, known)}"
        raise RequestError(f"parameter '{full}' = {text}: unit '{unit}' is not known {listed}")
    found = conversion(known[unit], known[variable.unit]) if variable.unit in known else None
    if found is None:
        own = known.get(variable.unit)
        same = [name for name, other in known.items() if own is not None and conversion(other, own) is not None]
        wanted = ", ".join(same) or variable.unit or "no unit: the FMU declares none"
        raise RequestError(f"parameter '{full}' = {text}: give it in {wanted}")
    return found(number)
