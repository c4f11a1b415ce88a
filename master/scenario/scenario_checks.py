"""Checks of the structure: FMUs, connectors, connections, units, start values; the result is what is coupled.

Problems are collected in a list (file, line, rule, text) instead of stopping at the first, and what only follows from
one of them is not reported besides.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from master.errors import Problem, hint
from master.scenario.start_values import StartValues, listed
from master.scenario.unit_checks import UnitChecks, unit_problems
from master.ssp.archive import SSD_NAME
from master.ssp.ssd import Structure
from master.ssp.ssd_elements import Component, Connection, Connector, Joint, Leg
from master.ssp.ssp_enumerations import Items
from master.ssp.ssp_units import Conversion
from master.system.components import Component as SystemComponent
from master.system.components import Fmu, Variable
from master.system.connections import Connection as SystemConnection

#: Which FMI causalities a connector kind may stand for.
_CAUSALITIES = {
    "input": ("input",),
    "output": ("output",),
    "parameter": ("parameter",),
    "calculatedParameter": ("calculatedParameter",),
    "inout": (),
}
#: Types of variables that can be connected.
_EXCHANGED: Final = ("Real", "Integer", "Boolean", "String", "Enumeration")
#: A pantograph's input for the force, and a line's inputs for the strip.
_FORCE: Final = re.compile(r"contact\.(?:force|[xyz])")
_STRIP: Final = re.compile(r"(?P<port>(?:pantograph\[\d+\]\.)?)[AB]\.v?[xyz]")
#: Unconnected inputs of a component that are listed by name.
_MOST_LISTED: Final = 5


@dataclass(frozen=True)
class _Endpoint:
    component: Component
    connector: Connector

    @property
    def full_name(self) -> str:
        return f"{self.component.name}.{self.connector.name}"


class ScenarioChecks:
    """Turn a structure and its FMUs into components and connections, collecting problems on the way.

    Parameters
    ----------
    structure : Structure
    fmus : mapping
        FMUs that could be read, by components' names.
    problems, warnings : list of Problem
    """

    def __init__(
        self,
        structure: Structure,
        fmus: Mapping[str, Fmu],
        problems: list[Problem],
        warnings: list[Problem] | None = None,
    ) -> None:
        self._structure = structure
        self._fmus = fmus
        self._problems = problems
        self._warnings = [] if warnings is None else warnings
        # The first of a name counts; a second one is reported elsewhere.
        self._named = {c.name: c for c in reversed(structure.components)}
        self._connectors = {(c.name, x.name): x for c in self._named.values() for x in reversed(c.connectors)}
        self._units = UnitChecks(structure, fmus.values(), problems)
        self._faulty: set[Connector] = set()
        self._ill_typed: set[int] = set()  # lines of connections that have been reported

    def connections(self) -> tuple[SystemConnection, ...]:
        """Return the connections that are sound, in the order of the SSD."""
        self._check_names()
        self._problems += unit_problems(self._structure, self._fmus)
        for component in self._known:
            for connector in component.connectors:
                self._check_connector(component, connector)
        self._check_system_connectors()
        for joint in self._structure.joints:
            self._check_joint(joint)
        checked = (self._connection(c) for c in self._structure.connections)
        sound = tuple(c for c in checked if c is not None)
        self._check_counts(sound)
        return sound

    def components(self, connections: tuple[SystemConnection, ...]) -> tuple[SystemComponent, ...]:
        """Return the components whose FMUs could be read, with their start values and exchanged variables."""
        values = StartValues(self._structure, self._fmus, self._units, self._problems, self._warnings)
        found = tuple(self._component(c, connections, values) for c in self._known)
        self._check_inputs(found)
        return found

    @property
    def _known(self) -> list[Component]:
        return [c for c in self._structure.components if c.name in self._fmus]

    def _component(
        self, c: Component, connections: tuple[SystemConnection, ...], values: StartValues
    ) -> SystemComponent:
        outputs = dict.fromkeys(x.output for x in connections if x.source == c.name)
        inputs = dict.fromkeys(x.input for x in connections if x.target == c.name)
        fmu, given = self._fmus[c.name], values.of(c)
        self._check_aliases(c, {n: repr(value) for n, value in given.items()}, "are given")
        self._check_aliases(c, {x.input: _told(x) for x in connections if x.target == c.name}, "take")
        return SystemComponent(c.name, fmu, given, tuple(inputs), tuple(outputs), fmu.tolerance)

    def _check_aliases(self, c: Component, given: Mapping[str, str], verb: str) -> None:
        """Report names of one variable of the FMU that are given different values: the last one would count."""
        first: dict[tuple[str, int], str] = {}
        for name, what in given.items():
            variable = self._fmus[c.name].variables[name]
            place = ("Integer" if variable.type == "Enumeration" else variable.type, variable.reference)
            other = first.setdefault(place, name)
            if what != given[other]:
                text = f"'{other}' and '{name}' of component '{c.name}' are one variable in the FMU, but {verb}"
                self._report(c.line, "alias", f"{text} {given[other]} and {what}; leave out one of them")

    def _report(self, line: int, rule: str, text: str, file: str = SSD_NAME) -> None:
        self._problems.append(Problem(file, line, rule, text))

    def _check_names(self) -> None:
        # Elements of one system with one name are reported where they are read.
        known = any(p.rule == "name" for p in self._problems)
        counts = Counter() if known else Counter(c.name for c in self._structure.components)
        for name, count in counts.items():
            if count > 1:
                line = next(c.line for c in self._structure.components if c.name == name)
                self._report(line, "name", f"component name '{name}' is used {count} times")
        if not self._structure.components:
            self._report(0, "system", "the system has no components")

    def _check_connector(self, component: Component, connector: Connector) -> None:
        variable = self._fmus[component.name].variables.get(connector.name)
        where = f"connector '{component.name}.{connector.name}'"
        before = len(self._problems)
        if variable is None:
            near = hint(connector.name, self._fmus[component.name].variables)
            self._report(connector.line, "connector", f"{where}: the FMU {component.source} has no such variable{near}")
        else:
            self._compare(connector, variable, where)
        if len(self._problems) > before:
            self._faulty.add(connector)

    def _compare(self, connector: Connector, variable: Variable, where: str) -> None:
        if connector.kind == "inout":
            self._report(connector.line, "unsupported", f"{where}: kind 'inout' is not supported")
        elif variable.causality not in _CAUSALITIES.get(connector.kind, ()):
            text = f"{where}: kind is '{connector.kind}', in the FMU '{variable.causality}'"
            self._report(connector.line, "connector", text)
        if connector.type and connector.type != variable.type:
            self._report(connector.line, "type", f"{where}: type is {connector.type}, in the FMU {variable.type}")
        elif connector.enumeration:
            self._compare_items(connector, variable, where)
        if connector.unit and variable.unit:
            self._units.convert(connector.unit, variable.unit, where, connector.line)

    def _compare_items(self, connector: Connector, variable: Variable, where: str) -> None:
        name = connector.enumeration
        declared = self._structure.enumerations.get(name)
        if declared is None:
            text = f"{where}: enumeration '{name}' is not declared in ssd:Enumerations"
            self._report(connector.line, "enumeration", text)
        elif variable.items and declared != dict(variable.items):
            text = f"{where}: enumeration '{name}' has the items {listed(declared)}"
            self._report(connector.line, "enumeration", f"{text}, the FMU's type {listed(dict(variable.items))}")

    def _check_system_connectors(self) -> None:
        for name, connector in self._structure.connectors.items():
            declared = connector.enumeration in self._structure.enumerations
            if connector.enumeration and not declared:
                text = f"connector '{name}': enumeration '{connector.enumeration}' is not declared in ssd:Enumerations"
                self._report(connector.line, "enumeration", text)
                self._faulty.add(connector)

    def _check_joint(self, joint: Joint) -> None:
        """Report connectors of systems that are not of the type or unit of what they are connected to, each once."""
        ends = ((joint.component, joint.connector), (joint.other_component, joint.other))
        if self._faulty.intersection(connector for _, connector in ends):
            self._ill_typed.add(joint.line)
            return
        variables = [self._fmus[c].variables.get(x.name) if c in self._fmus else None for c, x in ends]
        kinds = [v.type if v else x.type for v, (_, x) in zip(variables, ends, strict=True)]
        names = [f"'{c}.{x.name}'" if c else f"'{x.name}'" for c, x in ends]
        items = [self._known_items(x, v) for v, (_, x) in zip(variables, ends, strict=True)]
        if all(kinds) and kinds[0] != kinds[1]:
            text = f"{names[0]} is {kinds[0]} and {names[1]} is {kinds[1]}; only variables of the same type can be"
            self._report(joint.line, "type", f"{text} connected")
        elif kinds[0] == "Enumeration" and items[0] and items[1] and items[0] != items[1]:
            text = f"{names[0]} has the items {listed(items[0])}, {names[1]} {listed(items[1])}"
            self._report(joint.line, "enumeration", f"{text}; connected enumerations must have the same ones")
        else:
            if not joint.suppress_unit_conversion:
                units = [x.unit or (v.unit if v else "") for v, (_, x) in zip(variables, ends, strict=True)]
                self._units.convert(units[0], units[1], f"{names[0]} to {names[1]}", joint.line)
            return
        self._ill_typed.add(joint.line)
        self._faulty.update(x for c, x in ends if not c)  # its other connections are no second mistake

    def _known_items(self, connector: Connector, variable: Variable | None) -> Items | None:
        if variable is not None and variable.items:
            return dict(variable.items)
        return self._structure.enumerations.get(connector.enumeration)

    def _connection(self, c: Connection) -> SystemConnection | None:
        source = self._endpoint(c.start_element, c.start_connector, c.line)
        target = self._endpoint(c.end_element, c.end_connector, c.line)
        if source is None or target is None or self._faulty & {source.connector, target.connector}:
            return None  # what is wrong with a connector is reported there
        if source.connector.kind == "input" and target.connector.kind == "output":
            source, target = target, source
        kinds = (source.connector.kind, target.connector.kind)
        if "calculatedParameter" in kinds and "parameter" in kinds:
            text = "connections from calculated parameters to parameters are not supported; bind a value instead"
            self._report(c.line, "unsupported", text)
            return None
        if kinds != ("output", "input"):
            text = f"connects kind '{kinds[0]}' to '{kinds[1]}'; an output must be connected to an input"
            self._report(c.line, "connection", text)
            return None
        return self._directed(c, source, target)

    def _endpoint(self, element: str, name: str, line: int) -> _Endpoint | None:
        component = self._named.get(element)
        if component is None:
            near = hint(element, self._named)
            what = f"'{element}' is not a component{near}" if element else f"connector '{name}' belongs to no component"
            self._report(line, "connection", what)
            return None
        connector = self._connectors.get((element, name))
        if connector is None:
            near = hint(name, (x for owner, x in self._connectors if owner == element))
            if element in self._fmus and (variable := self._fmus[element].variables.get(name)):
                near = f"; its FMU has it: add a Connector of kind '{variable.causality}' to the component"
            self._report(line, "connection", f"component '{element}' declares no connector '{name}'{near}")
            return None
        return _Endpoint(component, connector)

    def _directed(self, c: Connection, source: _Endpoint, target: _Endpoint) -> SystemConnection | None:
        variables = [self._variable(end) for end in (source, target)]
        if not self._has_one_type(c, source, target, variables):
            return None
        total = self._conversion(c, source, target, variables)
        return SystemConnection(
            source.component.name, source.connector.name, target.component.name, target.connector.name, total
        )

    def _has_one_type(
        self, c: Connection, source: _Endpoint, target: _Endpoint, variables: list[Variable | None]
    ) -> bool:
        """Whether both ends are of the same, exchangeable type; report what is not."""
        ends = [(end, v.type if v else end.connector.type) for end, v in zip((source, target), variables, strict=True)]
        kinds = [kind for _, kind in ends if kind]
        if self._ill_typed.intersection((c.line, *(leg.line for leg in c.before))):
            return False
        if len(set(kinds)) > 1:
            text = " and ".join(f"'{end.full_name}' is {kind}" for end, kind in ends)
            self._report(c.line, "type", f"{text}; only variables of the same type can be connected")
            return False
        kind = kinds[0] if kinds else "Real"
        if kind not in _EXCHANGED:
            self._report(c.line, "unsupported", f"'{source.full_name}' is {kind}, which cannot be exchanged")
            return False
        changed = any(not x.is_identity for x in (c.transformation, *(leg.transformation for leg in c.before)))
        if kind != "Real" and changed:
            text = f"'{source.full_name}' is {kind}; only Real values can have a LinearTransformation"
            self._report(c.line, "type", text)
            return False
        return kind != "Enumeration" or self._has_same_items(c, source, target, variables)

    def _has_same_items(
        self, c: Connection, source: _Endpoint, target: _Endpoint, variables: list[Variable | None]
    ) -> bool:
        known = [self._known_items(end.connector, v) for end, v in zip((source, target), variables, strict=True)]
        if known[0] is None or known[1] is None or known[0] == known[1]:
            return True
        text = f"'{source.full_name}' has the items {listed(known[0])}, '{target.full_name}' {listed(known[1])}"
        self._report(c.line, "enumeration", f"{text}; connected enumerations must have the same ones")
        return False

    def _conversion(
        self, c: Connection, source: _Endpoint, target: _Endpoint, variables: list[Variable | None]
    ) -> Conversion:
        where = f"'{source.full_name}' to '{target.full_name}'"
        # The number is in the FMU's own unit; the SSD uses the connector's unit.
        fmu_units = [v.unit if v else "" for v in variables]
        written = [end.connector.unit or u for end, u in zip((source, target), fmu_units, strict=True)]
        is_difference = any(v is not None and v.is_difference for v in variables)
        total = self._units.convert(fmu_units[0], written[0], where, c.line, is_difference=is_difference)
        legs = (*c.before, Leg(written[1], c.transformation, c.suppress_unit_conversion, c.line))
        way, unit = self._units.along(written[0], legs, where, is_difference)
        way_in = self._units.convert(unit, fmu_units[1], where, c.line, is_difference=is_difference)
        total = total.then(way).then(way_in)
        if not (math.isfinite(total.factor) and math.isfinite(total.offset)):
            text = f"{where}: factor {total.factor:g} and offset {total.offset:g} are not finite"
            self._report(c.line, "number", text)
        return total

    def _variable(self, end: _Endpoint) -> Variable | None:
        fmu = self._fmus.get(end.component.name)
        return fmu.variables.get(end.connector.name) if fmu else None

    def _check_counts(self, connections: tuple[SystemConnection, ...]) -> None:
        counts = Counter((c.target, c.input) for c in connections)
        counts.update((f.element, f.connector) for f in self._structure.feeds if not f.is_fed)
        for component in self._structure.components:
            for connector in component.connectors:
                count = counts[component.name, connector.name]
                if count > 1:
                    what = f"{connector.kind} '{component.name}.{connector.name}'"
                    self._report(connector.line, "connection", f"{what} has {count} connections; one is allowed")

    def _inputs(self) -> Iterator[tuple[Component, Connector]]:
        for component in self._structure.components:
            for connector in component.connectors:
                if connector.kind == "input":
                    yield component, connector

    def _check_inputs(self, components: tuple[SystemComponent, ...]) -> None:
        """Warn of inputs that nothing feeds; a pantograph without its line, or the reverse, is a problem."""
        touched = {(c.start_element, c.start_connector) for c in self._structure.connections}
        touched |= {(c.end_element, c.end_connector) for c in self._structure.connections}
        outside = {(f.element, f.connector): f.stops[0].full_name for f in self._structure.feeds if not f.is_fed}
        for component in components:
            open_inputs = [x for c, x in self._inputs() if c.name == component.name and (c.name, x.name) not in touched]
            # What is wrong with a connector is reported already.
            sound = [x for x in open_inputs if x not in self._faulty]
            free = [x for x in sound if not self._is_own_port(component, x)]
            self._warn_of(component, [x for x in free if (component.name, x.name) not in outside])
            self._warn_of_outside(component, [x for x in free if (component.name, x.name) in outside], outside)

    def _is_own_port(self, component: SystemComponent, connector: Connector) -> bool:
        """Report an input by which a pantograph and its line are coupled; return whether it is one."""
        name, strip = connector.name, _STRIP.fullmatch(connector.name)
        partner = f"{strip['port']}contact.force" if strip else "A.z" if _FORCE.fullmatch(name) else ""
        variable = component.fmu.variables.get(partner)
        if variable is None or variable.causality != "output":
            return False
        if any(p.rule == "connection" for p in self._problems):
            return True  # a faulty connection may be the one
        text = f"input '{component.name}.{name}' is declared but not connected; pantograph and line need each other"
        self._report(connector.line, "connection", text)
        return True

    def _warn_of(self, component: SystemComponent, free: list[Connector]) -> None:
        if len(free) == 1:
            what = f"input '{component.name}.{free[0].name}' is declared but not connected; it keeps"
            self._warn(free[0].line, f"{what} {_start(component, free[0])}")
        elif free:
            listed = ", ".join(f"'{x.name}' {_start(component, x)}" for x in free[:_MOST_LISTED])
            more = f" and {len(free) - _MOST_LISTED} more" if len(free) > _MOST_LISTED else ""
            self._warn(free[0].line, f"inputs of '{component.name}' are declared but not connected; {listed}{more}")

    def _warn_of_outside(
        self, component: SystemComponent, free: list[Connector], outside: Mapping[tuple[str, str], str]
    ) -> None:
        for x in free:
            source = outside[component.name, x.name]
            connector = self._structure.connectors[source]
            text = f"nothing feeds '{source}', an {connector.kind} of a system; '{component.name}.{x.name}' keeps"
            self._warn(connector.line, f"{text} {_start(component, x)}")

    def _warn(self, line: int, text: str) -> None:
        self._warnings.append(Problem(SSD_NAME, line, "connection", text))


def _told(c: SystemConnection) -> str:
    """Return in words what an input receives."""
    factor, offset = c.conversion.factor, c.conversion.offset
    converted = "" if c.conversion.is_identity else f" x {factor:g} + {offset:g}"
    return f"'{c.source}.{c.output}'{converted}"


def _start(component: SystemComponent, connector: Connector) -> str:
    """Return in words which value an input keeps, and where it comes from."""
    if connector.name in component.parameters:
        value = component.parameters[connector.name]
        return f"its start value {str(value).lower() if isinstance(value, bool) else value} of the scenario"
    start = component.fmu.variables[connector.name].start
    return "its start value of the FMU" if start is None else f"its start value {start} of the FMU"
