"""Values that a scenario gives to variables before the run: from parameter bindings, to components and systems."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

from master.errors import Problem, hint
from master.scenario.unit_checks import UnitChecks
from master.scenario.value_checks import beyond_stops
from master.ssp.ssd import Structure, parameter_names
from master.ssp.ssd_elements import Binding, Component, Feed, Stop
from master.ssp.ssp_enumerations import Items
from master.ssp.ssp_units import Conversion
from master.ssp.ssv import Parameter, ParameterSet, Value, fits_integer
from master.system.components import Component as SystemComponent
from master.system.components import Fmu, Variable

#: Causalities of variables that take a value whatever their `initial` is.
_GIVEN = ("parameter", "input", "structuralParameter")
#: Values of `initial` with which the others take one before initialization [FMI 2.0.4, section 2.2.7].
_GUESSED = ("exact", "approx")
#: Which SSP types a variable of a type accepts, if more than its own.
_ACCEPTED = {"Real": ("Real", "Integer"), "Enumeration": ("Enumeration", "Integer")}
_TAKING = ("input", "parameter")
#: What to do about a speed that an FMU does not take.
_PROFILE = "; its speed is given otherwise (by a speed profile, say): take the parameter out"


@dataclass(frozen=True)
class Given:
    """A parameter with the set that it stands in."""

    parameter: Parameter
    within: ParameterSet


class StartValues:
    """Find the start values of components, collecting problems and warnings on the way.

    A component's own bindings count least, then those of the systems around it from the inside out [SSP 1.0,
    ParameterBindings]; what a connector of a system is bound to goes along its connections, and counts most, as what
    a connection brings does.
    """

    def __init__(
        self,
        structure: Structure,
        fmus: Mapping[str, Fmu],
        units: UnitChecks,
        problems: list[Problem],
        warnings: list[Problem],
    ) -> None:
        self._structure = structure
        self._fmus = fmus
        self._units = units
        self._problems = problems
        self._warnings = warnings
        self._at_systems = self._of_connectors()

    def of(self, component: Component) -> dict[str, Value]:
        """Return the values of a component's variables, in the FMU's units."""
        values: dict[str, Value] = {}
        written: dict[str, Parameter] = {}
        for binding in component.bindings:
            self._apply(component, own := parameter_names(binding), binding, values)
            written |= own
        for binding in self._structure.bindings:
            self._apply(component, own := self._of_component(component, binding), binding, values)
            written |= own
        for feed in self._structure.feeds:
            if feed.element == component.name:
                self._follow(component, feed, values)
        self._check_heights(component, values, written)
        return values

    def _check_heights(
        self, component: Component, values: Mapping[str, Value], written: Mapping[str, Parameter]
    ) -> None:
        """Report a height beyond a pantograph's stops where one of them is written; others are seen later."""
        found = beyond_stops(SystemComponent(component.name, self._fmus[component.name], dict(values), (), ()))
        names = (found[0], "lowest_height", "highest_height") if found else ()
        if found and (place := next((written[n] for n in names if n in written), None)):
            self._report(place, "range", found[1])

    def _of_connectors(self) -> dict[str, Given]:
        """Return what is bound to connectors of systems; the outermost binding counts."""
        found: dict[str, Given] = {}
        reached = {stop.full_name for feed in self._structure.feeds for stop in feed.stops}
        components = tuple(f"{c.name}." for c in self._structure.components)
        for binding in self._structure.bindings:
            for name, p in parameter_names(binding).items():
                connector = self._structure.connectors.get(name)
                if connector is None:
                    if not name.startswith(components):
                        known = (f"{c}.{v}" for c, fmu in self._fmus.items() for v in fmu.variables)
                        near = hint(name, (*known, *self._structure.connectors))
                        self._report_name(p, f"'{name}' belongs to no component and no connector of a system{near}")
                    continue
                found[name] = Given(p, binding.parameters)
                if connector.kind not in _TAKING:
                    self._warn(p, f"'{name}' is of kind '{connector.kind}', which gives values: this one is not used")
                elif name not in reached:
                    self._warn(p, f"'{name}' is a connector that leads to no component: its value is not used")
        return found

    def _of_component(self, component: Component, binding: Binding) -> dict[str, Parameter]:
        start, own = f"{component.name}.", self._structure.connectors
        full = parameter_names(binding)
        return {n[len(start) :]: p for n, p in full.items() if n.startswith(start) and n not in own}

    def _apply(
        self, component: Component, parameters: Mapping[str, Parameter], binding: Binding, values: dict[str, Value]
    ) -> None:
        for name, p in parameters.items():
            given = Given(p, binding.parameters)
            value = self._value(component, name, given, partial(self._direct, given))
            if value is not None:
                values[name] = value

    def _follow(self, component: Component, feed: Feed, values: dict[str, Value]) -> None:
        """Take the value of the outermost connector on the way that has one."""
        stop = next((s for s in feed.stops if s.full_name in self._at_systems), None)
        if stop is None or component.name not in self._fmus:
            return
        given = self._at_systems[stop.full_name]
        if feed.connector not in self._fmus[component.name].variables:
            return  # reported where the connector is declared
        value = self._value(component, feed.connector, given, partial(self._along, component, given, stop))
        if value is not None:
            values[feed.connector] = value

    def _value(
        self, component: Component, name: str, given: Given, way: Callable[[Variable, str], Conversion]
    ) -> Value | None:
        """Return a parameter's value as the variable takes it, None (and a problem) if it does not."""
        p = given.parameter
        variable = self._fmus[component.name].variables.get(name)
        where = f"parameter '{component.name}.{name}'"
        if variable is None:
            known = self._fmus[component.name].variables
            near = _PROFILE if name == "speed" and "start_position" in known else hint(name, known)
            self._report_name(p, f"{where}: the FMU {component.source} has no such variable{near}")
            return None
        if text := settable(variable, p.type):
            self._report_name(p, f"{where} {text}")
            return None
        before = len(self._problems)
        conversion = way(variable, where)
        value = self._item(variable, where, given) if p.type == "Enumeration" else p.value
        if len(self._problems) > before or value is None:
            return None
        if isinstance(value, str | bool):
            if not conversion.is_identity:
                self._report(p, "mapping", f"{where} is {p.type}, which cannot be transformed")
                return None
            return value
        return self._in_range(variable, where, p, conversion(value))

    def _in_range(self, variable: Variable, where: str, p: Parameter, value: float) -> Value | None:
        if text := out_of_range(variable, value):
            self._report(p, "range", f"{where} {text}")
            return None
        return value if variable.type == "Real" else int(value)

    def _direct(self, given: Given, variable: Variable, where: str) -> Conversion:
        p = given.parameter
        unit = "" if p.suppress_unit_conversion else p.unit
        found = self._units.convert(
            unit, variable.unit, where, p.line, p.file, given.within.units, variable.is_difference
        )
        return found.then(p.transformation)

    def _along(self, component: Component, given: Given, stop: Stop, variable: Variable, where: str) -> Conversion:
        """Return the conversion of a value that is bound to a system's connector, whose unit it has from there on."""
        p, legs = given.parameter, stop.legs
        unit, is_difference = stop.connector.unit or p.unit, variable.is_difference
        first = Conversion()
        if not p.suppress_unit_conversion:
            first = self._units.convert(p.unit, unit, where, p.line, p.file, given.within.units, is_difference)
        own = next((x.unit for x in component.connectors if x.name == variable.name), "") or variable.unit
        way, unit = self._units.along(unit, legs[:-1], where, is_difference)
        way_in, unit = self._units.along(unit, [replace(legs[-1], unit=own)], where, is_difference)
        end = self._units.convert(unit, variable.unit, where, legs[-1].line, is_difference=is_difference)
        return first.then(p.transformation).then(way).then(way_in).then(end)

    def _item(self, variable: Variable, where: str, given: Given) -> int | None:
        """Return the number of an enumeration's item: the variable's own items decide [SSP 1.0, ssv:Enumeration]."""
        p = given.parameter
        declared = {**self._structure.enumerations, **given.within.enumerations}
        if p.enumeration and p.enumeration not in declared:
            self._report(p, "enumeration", f"{where}: enumeration '{p.enumeration}' is declared nowhere")
            return None
        own = dict(variable.items)
        for items, whose in ((declared.get(p.enumeration), f"enumeration '{p.enumeration}'"), (own, "the FMU's type")):
            if items is not None and p.value not in items:
                self._report(p, "enumeration", f"{where}: '{p.value}' is no item of {whose} ({listed(items)})")
                return None
        return own[str(p.value)]

    def _report(self, p: Parameter, rule: str, text: str) -> None:
        self._problems.append(Problem(p.file, p.line, rule, text))

    def _report_name(self, p: Parameter, text: str) -> None:
        file, line = p.named_at
        self._problems.append(Problem(file, line, "parameter", text))

    def _warn(self, p: Parameter, text: str) -> None:
        file, line = p.named_at
        self._warnings.append(Problem(file, line, "parameter", text))


def listed(items: Items) -> str:
    """Return an enumeration's items with their values."""
    return ", ".join(f"{name} = {value}" for name, value in items.items()) or "none"


def settable(variable: Variable, kind: str) -> str:
    """Return why a parameter of type ``kind`` cannot be set on the variable, empty if it can."""
    if variable.variability == "constant":
        return "cannot be set: in the FMU it is constant"
    if variable.causality not in _GIVEN and (variable.initial not in _GUESSED or variable.causality == "independent"):
        how = f" with initial='{variable.initial}'" if variable.initial else ""
        return f"cannot be set: in the FMU it is of causality '{variable.causality}'{how}"
    if kind not in _ACCEPTED.get(variable.type, (variable.type,)):
        return f"is written as {kind}, in the FMU it is {variable.type}"
    return ""


def out_of_range(variable: Variable, value: float) -> str:
    """Return how a value violates its type, the declared minimum or maximum; empty if it does not."""
    if variable.type != "Real" and not (fits_integer(value) and float(value).is_integer()):
        return f"= {value} is not a whole number of 32 bits"
    if not math.isfinite(value):
        return f"= {value:g} is not finite"
    if variable.items and value not in dict(variable.items).values():
        return f"= {value:g} is no item of its type ({listed(dict(variable.items))})"
    shown = f"{value:g} {variable.unit}".strip()
    if variable.minimum is not None and value < variable.minimum:
        return f"= {shown} is below its minimum {variable.minimum:g}{_hint(variable)}"
    if variable.maximum is not None and value > variable.maximum:
        return f"= {shown} is above its maximum {variable.maximum:g}{_hint(variable)}"
    return ""


def _hint(variable: Variable) -> str:
    """Return what to do about a value out of range: most such values are in another unit."""
    if not variable.unit or variable.unit == "1":
        return "; give one between them"
    return f"; a value without a unit is in {variable.unit}: check its size, or write its unit"
