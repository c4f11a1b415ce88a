"""Conversions between the units that a scenario uses, and what is wrong with its units."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from master.errors import Problem, hint
from master.ssp.archive import SSD_NAME
from master.ssp.ssd import Structure, parameter_names
from master.ssp.ssd_elements import Binding, Component, Leg
from master.ssp.ssp_units import COMMON, Conversion, Unit, contradictions, conversion, unlike, unusual
from master.system.components import Fmu


class UnitChecks:
    """Find conversions; what cannot be converted becomes a problem, an unknown unit once.

    Parameters
    ----------
    structure : Structure
    fmus : iterable of Fmu
        Their own units are known too.
    problems : list of Problem
    """

    def __init__(self, structure: Structure, fmus: Iterable[Fmu], problems: list[Problem]) -> None:
        self._declared = structure.units
        self._of_fmus: dict[str, Unit] = {}
        for fmu in fmus:
            self._of_fmus = {**fmu.units, **self._of_fmus}
        self._problems = problems
        self._unknown: set[str] = set()
        self._unlike: set[tuple[str, int, str, str]] = set()

    def convert(
        self,
        source: str,
        target: str,
        where: str,
        line: int,
        file: str = SSD_NAME,
        own: Mapping[str, Unit] | None = None,
        is_difference: bool = False,
    ) -> Conversion:
        """Return the conversion from one unit to another, none where either is empty.

        Parameters
        ----------
        source, target : str
            Names of units.
        where : str
            What is converted, for the message.
        line, file : int, str
            Where that is written.
        own : mapping, optional
            Units that the file itself declares.
        is_difference : bool
            Whether it is the difference of two values, from which offsets fall out.
        """
        if source == target or not source or not target:
            return Conversion()
        known = {**self._of_fmus, **COMMON, **self._declared, **(own or {})}
        unknown = [name for name in (source, target) if name not in known]
        if unknown:
            if not self._unknown.issuperset(unknown):
                declare = "ssd:Units" if file == SSD_NAME else "the ssv:Units of this file"
                text = f"unit '{unknown[0]}' is not declared in {declare} (known without it: {', '.join(COMMON)})"
                self._report(line, f"{where}: {text}{hint(unknown[0], known)}", file)
            self._unknown.update(unknown)
            return Conversion()
        found = conversion(known[source], known[target])
        if found is None:
            # A connection that reaches many components is reported once.
            if (file, line, source, target) not in self._unlike:
                self._report(line, f"{where}: '{source}' and '{target}' do not measure the same thing", file)
            self._unlike.add((file, line, source, target))
            return Conversion()
        return Conversion(found.factor) if is_difference else found

    def along(self, unit: str, legs: Sequence[Leg], where: str, is_difference: bool = False) -> tuple[Conversion, str]:
        """Return the conversion of a value in ``unit`` along connections, and the unit that it has at their end."""
        total = Conversion()
        for leg in legs:
            wanted = leg.unit or unit
            if not leg.suppress_unit_conversion:
                total = total.then(self.convert(unit, wanted, where, leg.line, is_difference=is_difference))
            total, unit = total.then(leg.transformation), wanted
        return total, unit

    def _report(self, line: int, text: str, file: str) -> None:
        self._problems.append(Problem(file, line, "unit", text))


def unit_problems(structure: Structure, fmus: Mapping[str, Fmu]) -> Iterator[Problem]:
    """Yield a problem for every unit that is declared twice with different meanings; ``fmus`` by components' names."""
    bindings: list[Binding] = [*structure.bindings, *(b for c in structure.components for b in c.bindings)]
    declared = [*structure.units.values(), *(u for b in bindings for u in b.parameters.units.values())]
    known = {unit.name for unit in declared}
    of_fmus = [u for fmu in fmus.values() for u in fmu.units.values() if u.name in known]
    for unit, text in contradictions([*of_fmus, *dict.fromkeys(declared)]):
        if unit.line:
            yield Problem(unit.file, unit.line, "unit", f"unit '{unit.name}' {text}")
    yield from _among_fmus(structure, fmus, known)


def _among_fmus(structure: Structure, fmus: Mapping[str, Fmu], declared: Collection[str]) -> Iterator[Problem]:
    """Yield a problem for every unit that is used and which FMUs, or an FMU and common usage, define differently."""
    first: dict[str, tuple[Unit, str]] = {}
    seen: set[Unit] = set()
    for c in structure.components:
        of_fmu = fmus[c.name].units if c.name in fmus else {}
        for unit in (of_fmu[name] for name in sorted(_used(c, structure, fmus)) if name in of_fmu):
            if unit in seen or unit.name in declared:
                continue
            seen.add(unit)
            other, owner = first.setdefault(unit.name, (unit, c.name))
            text = unusual(unit)
            if not text and (unlikeness := unlike(unit, other)):
                text = f"has another meaning than in the FMU of '{owner}': it {unlikeness}"
            if text:
                yield Problem(SSD_NAME, c.line, "unit", f"component '{c.name}': unit '{unit.name}' of its FMU {text}")


def _used(c: Component, structure: Structure, fmus: Mapping[str, Fmu]) -> set[str]:
    """Return the units of the variables of a component that are connected, or given values."""
    if c.name not in fmus:
        return set()
    start = f"{c.name}."
    outer = (n.removeprefix(start) for b in structure.bindings for n in parameter_names(b) if n.startswith(start))
    own = (n for b in c.bindings for n in parameter_names(b))
    variables = fmus[c.name].variables
    return {variables[n].unit for n in (*(x.name for x in c.connectors), *own, *outer) if n in variables}
