"""Checking a scenario as a whole: structure, FMUs, connections, units, parameters.

Problems are collected in a list (file, line, rule, text) instead of stopping at the first.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from master.errors import Problem
from master.ssp.archive import SSD_NAME
from master.ssp.elements import Binding, Component, Connection, Connector, Leg
from master.ssp.ssd import Structure, parameter_names
from master.ssp.ssv import Parameter, Value, fits_integer
from master.ssp.units import COMMON, Conversion, Unit, conversion
from master.system import Component as SystemComponent
from master.system import Connection as SystemConnection
from master.system import Fmu, Variable

#: Which FMI causalities a connector kind may stand for.
_CAUSALITIES = {
    "input": ("input",),
    "output": ("output",),
    "parameter": ("parameter",),
    "calculatedParameter": ("calculatedParameter",),
    "inout": (),
}
_SETTABLE = ("parameter", "input", "structuralParameter")


@dataclass(frozen=True)
class _Endpoint:
    component: Component
    connector: Connector

    @property
    def full_name(self) -> str:
        return f"{self.component.name}.{self.connector.name}"


class Checker:
    """Turns a structure and its FMUs into components and connections, collecting problems on the way."""

    def __init__(self, structure: Structure, fmus: Mapping[str, Fmu], problems: list[Problem]) -> None:
        self._structure = structure
        self._fmus = fmus
        self._problems = problems
        # The first of a name counts; that there is a second one is reported elsewhere.
        self._named = {c.name: c for c in reversed(structure.components)}
        self._connectors = {(c.name, x.name): x for c in self._named.values() for x in reversed(c.connectors)}

    def connections(self) -> tuple[SystemConnection, ...]:
        """Return the connections that are sound, in the order of the SSD."""
        self._check_names()
        checked = (self._connection(c) for c in self._structure.connections)
        sound = tuple(c for c in checked if c is not None)
        self._check_inputs(sound)
        return sound

    def components(self, connections: tuple[SystemConnection, ...]) -> tuple[SystemComponent, ...]:
        """Return the components whose FMUs could be read, with their parameters and exchanged variables."""
        known = [c for c in self._structure.components if c.name in self._fmus]
        for component in known:
            for connector in component.connectors:
                self._check_connector(component, connector)
        return tuple(self._component(c, connections) for c in known)

    def _component(self, c: Component, connections: tuple[SystemConnection, ...]) -> SystemComponent:
        outputs = dict.fromkeys(x.output for x in connections if x.source == c.name)
        inputs = dict.fromkeys(x.input for x in connections if x.target == c.name)
        return SystemComponent(c.name, self._fmus[c.name], self._parameters(c), tuple(inputs), tuple(outputs))

    def _report(self, line: int, rule: str, text: str, file: str = SSD_NAME) -> None:
        self._problems.append(Problem(file, line, rule, text))

    def _check_names(self) -> None:
        counts = Counter(c.name for c in self._structure.components)
        for component in self._structure.components:
            if counts[component.name] > 1:
                self._report(
                    component.line,
                    "name",
                    f"component name '{component.name}' is used {counts[component.name]} times",
                )
        if not self._structure.components:
            self._report(0, "system", "the system has no components")

    def _check_connector(self, component: Component, connector: Connector) -> None:
        variable = self._fmus[component.name].variables.get(connector.name)
        where = f"connector '{component.name}.{connector.name}'"
        if variable is None:
            self._report(connector.line, "connector", f"{where}: the FMU {component.source} has no such variable")
            return
        if connector.kind == "inout":
            self._report(connector.line, "unsupported", f"{where}: kind 'inout' is not supported")
        elif variable.causality not in _CAUSALITIES.get(connector.kind, ()):
            self._report(
                connector.line,
                "connector",
                f"{where}: kind is '{connector.kind}', in the FMU '{variable.causality}'",
            )
        if connector.type and connector.type != variable.type:
            self._report(connector.line, "type", f"{where}: type is {connector.type}, in the FMU {variable.type}")
        if connector.unit and variable.unit:
            self._convert(connector.unit, variable.unit, self._structure.units, connector.line, where)

    def _connection(self, c: Connection) -> SystemConnection | None:
        source = self._endpoint(c.start_element, c.start_connector, c.line)
        target = self._endpoint(c.end_element, c.end_connector, c.line)
        if source is None or target is None:
            return None
        if source.connector.kind == "input" and target.connector.kind == "output":
            source, target = target, source
        if (source.connector.kind, target.connector.kind) != ("output", "input"):
            kinds = f"'{source.connector.kind}' to '{target.connector.kind}'"
            self._report(c.line, "connection", f"connects kind {kinds}; an output must be connected to an input")
            return None
        return self._directed(c, source, target)

    def _endpoint(self, element: str, name: str, line: int) -> _Endpoint | None:
        component = self._named.get(element)
        if component is None:
            what = f"'{element}' is not a component" if element else f"connector '{name}' belongs to no component"
            self._report(line, "connection", what)
            return None
        connector = self._connectors.get((element, name))
        if connector is None:
            self._report(line, "connection", f"component '{element}' declares no connector '{name}'")
            return None
        return _Endpoint(component, connector)

    def _directed(self, c: Connection, source: _Endpoint, target: _Endpoint) -> SystemConnection | None:
        variables = [self._variable(end) for end in (source, target)]
        for end, variable in zip((source, target), variables, strict=True):
            if (variable.type if variable else end.connector.type) not in ("Real", ""):
                name = f"'{end.full_name}'"
                self._report(c.line, "unsupported", f"{name} is not Real; only Real variables can be connected")
                return None
        total = self._conversion(c, source, target, variables)
        return SystemConnection(
            source.component.name, source.connector.name, target.component.name, target.connector.name, total
        )

    def _conversion(
        self, c: Connection, source: _Endpoint, target: _Endpoint, variables: list[Variable | None]
    ) -> Conversion:
        where = f"'{source.full_name}' to '{target.full_name}'"
        # The FMU's own unit is what the number is in; the connector's unit is what the SSD talks in.
        fmu_units = [v.unit if v else "" for v in variables]
        written = [end.connector.unit or u for end, u in zip((source, target), fmu_units, strict=True)]
        units = self._structure.units
        total = self._convert(fmu_units[0], written[0], units, c.line, where)
        unit = written[0]
        for leg in (*c.before, Leg(written[1], c.transformation, c.suppress_unit_conversion, c.line)):
            wanted = leg.unit or unit
            if not leg.suppress_unit_conversion:
                total = total.then(self._convert(unit, wanted, units, leg.line, where))
            total, unit = total.then(leg.transformation), wanted
        total = total.then(self._convert(unit, fmu_units[1], units, c.line, where))
        if not (math.isfinite(total.factor) and math.isfinite(total.offset)):
            text = f"{where}: factor {total.factor:g} and offset {total.offset:g} are not finite"
            self._report(c.line, "number", text)
        return total

    def _variable(self, end: _Endpoint) -> Variable | None:
        fmu = self._fmus.get(end.component.name)
        return fmu.variables.get(end.connector.name) if fmu else None

    def _convert(self, source: str, target: str, units: Mapping[str, Unit], line: int, where: str) -> Conversion:
        if source == target or not source or not target:
            return Conversion()
        known = {**COMMON, **units}
        for name in (source, target):
            if name not in known:
                self._report(line, "unit", f"{where}: unit '{name}' is not declared in ssd:Units")
                return Conversion()
        found = conversion(known[source], known[target])
        if found is None:
            self._report(line, "unit", f"{where}: '{source}' and '{target}' do not measure the same thing")
            return Conversion()
        return found

    def _check_inputs(self, connections: tuple[SystemConnection, ...]) -> None:
        counts = Counter((c.target, c.input) for c in connections)
        for component in self._structure.components:
            for connector in component.connectors:
                count = counts[component.name, connector.name]
                where = f"input '{component.name}.{connector.name}'"
                if connector.kind == "input" and count == 0:
                    self._report(connector.line, "connection", f"{where} is declared but not connected")
                if count > 1:
                    self._report(connector.line, "connection", f"{where} has {count} connections; one is allowed")

    def _parameters(self, component: Component) -> dict[str, Value]:
        values: dict[str, Value] = {}
        for binding in component.bindings:
            self._apply(component, binding, parameter_names(binding), values)
        for binding in self._structure.bindings:  # the system's bindings take priority [SSP 1.0, ParameterBindings]
            self._apply(component, binding, self._of_component(component, binding), values)
        return values

    def _of_component(self, component: Component, binding: Binding) -> dict[str, Parameter]:
        start = f"{component.name}."
        full = parameter_names(binding)
        names = [c.name for c in self._structure.components]
        if component is self._structure.components[0]:
            for name, parameter in full.items():
                if not any(name.startswith(f"{n}.") for n in names):
                    self._report(parameter.line, "parameter", f"'{name}' belongs to no component", parameter.file)
        return {name[len(start) :]: p for name, p in full.items() if name.startswith(start)}

    def _apply(
        self,
        component: Component,
        binding: Binding,
        parameters: Mapping[str, Parameter],
        values: dict[str, Value],
    ) -> None:
        units = {**self._structure.units, **binding.parameters.units}
        for name, parameter in parameters.items():
            value = self._parameter(component, name, parameter, units)
            if value is not None:
                values[name] = value

    def _parameter(self, component: Component, name: str, p: Parameter, units: Mapping[str, Unit]) -> Value | None:
        variable = self._fmus[component.name].variables.get(name)
        where = f"parameter '{component.name}.{name}'"
        if variable is None:
            self._report(p.line, "parameter", f"{where}: the FMU {component.source} has no such variable", p.file)
            return None
        text = settable(variable, p.type)
        if text:
            self._report(p.line, "parameter", f"{where} {text}", p.file)
            return None
        if isinstance(p.value, str | bool):
            return p.value
        before = len(self._problems)
        unit = "" if p.suppress_unit_conversion else p.unit
        value = p.transformation(self._convert(unit, variable.unit, units, p.line, where)(p.value))
        if len(self._problems) > before:
            return None
        text = out_of_range(variable, value)
        if text:
            self._report(p.line, "range", f"{where} {text}", p.file)
            return None
        return value if variable.type == "Real" else int(value)


def settable(variable: Variable, kind: str) -> str:
    """Return why a parameter of type ``kind`` cannot be set on the variable, empty if it can."""
    if variable.causality not in _SETTABLE:
        return f"cannot be set: in the FMU it is of causality '{variable.causality}'"
    if variable.variability == "constant":
        return "cannot be set: in the FMU it is constant"
    accepted = {"Real": ("Real", "Integer"), "Integer": ("Integer",), "Enumeration": ("Integer",)}
    if kind not in accepted.get(variable.type, (variable.type,)):
        return f"is written as {kind}, in the FMU it is {variable.type}"
    return ""


def out_of_range(variable: Variable, value: float) -> str:
    """Return how a value violates its type, the declared minimum or maximum; empty if it does not."""
    if variable.type != "Real" and not (fits_integer(value) and float(value).is_integer()):
        return f"= {value} is not a whole number of 32 bits"
    if not math.isfinite(value):
        return f"= {value:g} is not finite"
    if variable.minimum is not None and value < variable.minimum:
        return f"= {value:g} {variable.unit} is below its minimum {variable.minimum:g}{_hint(variable)}"
    if variable.maximum is not None and value > variable.maximum:
        return f"= {value:g} {variable.unit} is above its maximum {variable.maximum:g}{_hint(variable)}"
    return ""


def _hint(variable: Variable) -> str:
    """Return what to do about a value out of range: most such values are in another unit."""
    if not variable.unit or variable.unit == "1":
        return "; give one between them"
    return f"; a value without a unit is in {variable.unit}: check its size, or write its unit"
