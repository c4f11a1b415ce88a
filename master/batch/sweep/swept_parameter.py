"""A parameter that a sweep varies: its name, its unit and its values as texts on a command line give them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from master.errors import RequestError, hint
from master.scenario.overrides import find_parameter
from master.ssp.ssp_units import COMMON, Conversion, Unit, conversion, split_quantity
from master.system.components import Fmu, System, Variable
from master.system.pantograph_motion import pantographs, parameter_value

#: A value in the unit of its parameter, or the text of one that is no number.
SweptValue = float | str
#: What a run itself has, in seconds.
OF_THE_RUN: Final = ("stop", "step")
#: Units that bare numbers have where everybody means the same.
_USUAL: Final = {"speed": "km/h"}
#: Most values of one range.
_MOST: Final = 100_000


@dataclass(frozen=True)
class SweptParameter:
    """A parameter that a sweep varies.

    Attributes
    ----------
    name : str
        As the user writes it: ``component.parameter``, a parameter of every pantograph, ``stop`` or ``step``.
    targets : tuple of str
        The parameters, ``component.parameter``, that take its values; none for what the run itself has.
    unit : str
        Unit of its values; empty if they have none.
    """

    name: str
    targets: tuple[str, ...]
    unit: str

    @property
    def title(self) -> str:
        """Name and unit, as the head of a column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def text(self, value: SweptValue) -> str:
        """Return a value as text with its unit."""
        return f"{value!r} {self.unit}".strip() if isinstance(value, float) else value


class ParameterReader:
    """Reads the texts in which a user writes the values of one parameter.

    Parameters
    ----------
    system : System
        Of the scenario as it is.
    name : str
    unit : str
        Unit of values without one, such as that in the head of a table's column.

    Raises
    ------
    RequestError
        If there is no such parameter, with the name that may have been meant.
    """

    def __init__(self, system: System, name: str, unit: str = "") -> None:
        self.name = name
        self._system = system
        self._found = () if name in OF_THE_RUN else _found(system, name)
        self._unit = unit or (_USUAL.get(name, "") if self._declared else "")

    def parameter(self, unit: str) -> SweptParameter:
        """Return the parameter with the unit in which its values are given."""
        return SweptParameter(self.name, tuple(full for full, _, _ in self._found), unit)

    def listed(self, text: str) -> tuple[SweptParameter, tuple[SweptValue, ...]]:
        """Return the values of a list: ``18kN,20kN``, ``200:320:10`` or ``low,high``.

        A unit written last holds for the values before it that have none.
        """
        parts = [part.strip() for part in text.split(",")]
        if not self._is_real:
            values = [v for part in parts for v in (self._whole_numbers(part) if self._is_whole else [part])]
            self._check_distinct(values, text)
            return self.parameter(""), tuple(values)
        pieces = [[self._number(piece) for piece in part.split(":")] for part in parts]
        unit = self._common_unit([quantity for part in pieces for quantity in part], text)
        numbers_found: list[float] = []
        for part, written in zip(pieces, parts, strict=True):
            numbers = [self._converted(*quantity, unit) for quantity in part]
            numbers_found += numbers if len(numbers) == 1 else _range(numbers, f"{self.name}={written}")
        self._check_distinct(numbers_found, text)
        return self.parameter(unit), tuple(numbers_found)

    def _whole_numbers(self, part: str) -> list[SweptValue]:
        """Return the values of FIRST:LAST:STEP in whole numbers; any other text as it is."""
        try:
            numbers = [int(piece) for piece in part.split(":")]
        except ValueError:
            return [part]
        if len(numbers) == 1:
            return [part]
        return [str(int(v)) for v in _range(numbers, f"{self.name}={part}")]

    def _check_distinct(self, values: Sequence[SweptValue], text: str) -> None:
        if len(set(values)) < len(values):
            raise RequestError(f"{self.name}={text}: a value appears more than once")

    def cells(self, texts: Sequence[str]) -> tuple[SweptParameter, tuple[SweptValue | None, ...]]:
        """Return the values in a table's column, None where a cell is empty."""
        if not self._is_real:
            return self.parameter(""), tuple(text or None for text in texts)
        read = [self._number(text) if text else None for text in texts]
        written = [None if q is None else (q[0], q[1] or self._unit) for q in read]
        for text, quantity in zip(texts, written, strict=True):
            if quantity is not None:
                self._common_unit([quantity], text)
        unit = self._common_unit([q for q in written if q is not None], "")
        return self.parameter(unit), tuple(None if q is None else self._converted(*q, unit) for q in written)

    def arguments(self, text: str, widths: Sequence[bool]) -> tuple[SweptParameter, tuple[float, ...]]:
        """Return the arguments of a distribution; a width, such as a standard deviation, has no offset of its unit."""
        if not self._is_real:
            raise RequestError(
                f"{self.name} takes no real numbers, so it has neither distribution nor bounds; list values with --over"
            )
        parts = text.split(",") if text.strip() else []
        if len(parts) != len(widths):
            raise RequestError(f"{self.name}: {len(widths)} numbers are needed, '{text}' has {len(parts)}")
        quantities = [self._number(part) for part in parts]
        unit = self._common_unit(quantities, text)
        values = zip(quantities, widths, strict=True)
        return self.parameter(unit), tuple(self._converted(*q, unit, is_width=width) for q, width in values)

    def present(self, unit: str) -> float | None:
        """Return the value that the scenario has, in this unit; None if it has none. Of several the first counts."""
        if not self._found:
            return self._system.stop if self.name == "stop" else self._system.step
        full, variable, _ = self._found[0]
        value = parameter_value(self._system.component(full.partition(".")[0]), variable.name)
        return None if value is None else self._converted(value, self._declared, unit)

    @property
    def _is_real(self) -> bool:
        return all(variable.type == "Real" for _, variable, _ in self._found)

    @property
    def _is_whole(self) -> bool:
        return all(variable.type == "Integer" for _, variable, _ in self._found) and bool(self._found)

    @property
    def _declared(self) -> str:
        """The unit that the FMU declares, empty if it declares none or says that there is none."""
        unit = self._found[0][1].unit if self._found else "s"
        return "" if unit == "1" else unit

    @property
    def _units(self) -> dict[str, Unit]:
        return {**self._found[0][2].units, **COMMON} if self._found else COMMON

    def _number(self, text: str) -> tuple[float, str]:
        number, unit = split_quantity(text)
        if number is None or not math.isfinite(number):
            raise RequestError(f"{self.name}: '{text.strip()}' is not a number")
        return number, unit

    def _common_unit(self, quantities: Sequence[tuple[float, str]], text: str) -> str:
        """Return the unit of quantities: the last that is written."""
        written = [unit for _, unit in quantities if unit]
        unit = written[-1] if written else self._unit
        if not unit and self._found and self._declared and quantities:
            like = f"{quantities[-1][0]:g} {self._declared}"
            raise RequestError(f"{self.name}: '{text.strip()}' needs a unit, as in '{like}'")
        for other in dict.fromkeys([*written, unit]):
            self._check(other)
        return unit or ("" if self._found else "s")

    def _check(self, unit: str) -> None:
        """Refuse a unit that the parameter does not have."""
        if not unit or unit == self._declared:
            return
        known = self._units
        if unit not in known:
            raise RequestError(f"{self.name}: there is no unit '{unit}'{hint(unit, known)}")
        if self._declared not in known or conversion(known[unit], known[self._declared]) is None:
            wanted = f"a unit of {self._declared}" if self._declared else "no unit: the FMU declares none"
            raise RequestError(f"{self.name}: '{unit}' does not fit, give it in {wanted}")

    def _converted(self, number: float, unit: str, wanted: str, is_width: bool = False) -> float:
        if unit in ("", wanted):
            return number
        known = self._units
        found = conversion(known[unit], known[wanted])
        assert found is not None  # both were checked
        return (Conversion(found.factor) if is_width else found)(number)


def _found(system: System, name: str) -> tuple[tuple[str, Variable, Fmu], ...]:
    """Return the parameters that a name stands for: one of a component, or those of all pantographs."""
    if "." in name:
        index, variable = find_parameter(system.components, name)
        return ((name, variable, system.components[index].fmu),)
    trains = pantographs(system)
    found = tuple((f"{c.name}.{name}", c.fmu.variables[name], c.fmu) for c in trains if name in c.fmu.variables)
    if not found:
        known = {v.name for c in trains for v in c.fmu.variables.values() if v.causality == "parameter"}
        whole = "; a parameter of another component is written COMPONENT.PARAMETER"
        raise RequestError(
            f"no pantograph has a parameter '{name}'{hint(name, sorted({*known, *OF_THE_RUN})) or whole}"
        )
    return found


def _range(numbers: Sequence[float], text: str) -> list[float]:
    """Return the numbers of FIRST:LAST:STEP; the last is among them if a whole number of steps leads there."""
    if len(numbers) != 3:
        raise RequestError(f"{text}: a range is written FIRST:LAST:STEP")
    first, last, step = numbers
    if step == 0.0 or (last - first) / step < 0.0:
        raise RequestError(f"{text}: steps of {step:g} never lead from {first:g} to {last:g}")
    steps = (last - first) / step
    if steps > _MOST:
        raise RequestError(f"{text}: has {steps:.3g} values, more than {_MOST}")
    # Twelve digits: what a decimal step adds up to is what the user would have written.
    return [float(f"{first + k * step:.12g}") for k in range(math.floor(steps + 1e-9) + 1)]
