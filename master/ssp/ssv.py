"""Parameter sets (``.ssv`` files, or inline in a parameter binding)."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from master.ssp.ssp_enumerations import Items, parse_enumerations, whole
from master.ssp.ssp_units import Conversion, Unit, parse_units
from master.ssp.ssp_xml import SSV, Reader, child, children, elements, tag

Value = float | int | bool | str

SUPPORTED_TYPES: Final = ("Real", "Integer", "Boolean", "String", "Enumeration")


@dataclass(frozen=True)
class Parameter:
    """A named value as written in a parameter set.

    Attributes
    ----------
    name, type : str
        Variable name and SSP type (Real, Integer, Boolean, String, Enumeration).
    value : float, int, bool or str
        Its value, in ``unit``; of an enumeration the item's name.
    unit : str
        Unit, empty when none is given.
    file, line : str, int
        Where it is written.
    transformation : Conversion
        Of the value in the FMU's unit, by a parameter mapping.
    suppress_unit_conversion : bool
        Whether a mapping wants the number as it is written.
    enumeration : str
        Name of the enumeration that the value is an item of, empty when none is given.
    name_file, name_line : str, int
        Where the name is written, if a mapping gives it.
    """

    name: str
    type: str
    value: Value
    unit: str
    file: str
    line: int
    transformation: Conversion = field(default_factory=Conversion)
    suppress_unit_conversion: bool = False
    enumeration: str = ""
    name_file: str = ""
    name_line: int = 0

    @property
    def named_at(self) -> tuple[str, int]:
        """File and line in which the name is written."""
        return (self.name_file, self.name_line) if self.name_file else (self.file, self.line)


@dataclass(frozen=True)
class ParameterSet:
    """A parameter set with the units and enumerations it declares.

    ``unreadable`` are the names of parameters whose values could not be read, which has been reported.
    """

    name: str
    parameters: tuple[Parameter, ...]
    units: dict[str, Unit]
    enumerations: dict[str, Items] = field(default_factory=dict)
    unreadable: tuple[str, ...] = ()


def read_parameter_file(path: Path, reader: Reader) -> ParameterSet | None:
    """Read and check an ``.ssv`` file; None if it is not XML."""
    root = reader.parse(path)
    if root is None:
        return None
    return parse_parameter_set(root, reader)


def parse_parameter_set(node: Any, reader: Reader) -> ParameterSet:
    """Check and parse ``ssv:ParameterSet``, of a file or inline."""
    reader.check_schema(node, "ssv")
    nodes = list(children(child(node, SSV, "Parameters"), SSV, "Parameter"))
    reader.unique(nodes, "parameter")
    read = [(reader.text(p, "name"), parse_parameter(p, reader)) for p in nodes]
    return ParameterSet(
        reader.text(node, "name"),
        tuple(p for _, p in read if p is not None),
        parse_units(child(node, SSV, "Units"), reader),
        parse_enumerations(child(node, SSV, "Enumerations"), reader),
        tuple(name for name, p in read if p is None),
    )


def parse_parameter(node: Any, reader: Reader) -> Parameter | None:
    """Parse ``ssv:Parameter``; None (and a problem) if its type or value cannot be honoured."""
    name = reader.text(node, "name")
    typed = next((e for e in elements(node) if tag(e) in SUPPORTED_TYPES), None)
    if typed is None:
        reader.problem(node, "unsupported", f"parameter '{name}' has no value of type {', '.join(SUPPORTED_TYPES)}")
        return None
    value = _value(typed, reader, name)
    if value is None:
        return None
    return Parameter(
        name,
        tag(typed),
        value,
        reader.text(typed, "unit"),
        reader.file,
        int(node.sourceline or 0),
        enumeration=reader.text(typed, "name"),
    )


def _value(node: Any, reader: Reader, name: str) -> Value | None:
    kind = tag(node)
    if kind == "Real":
        number = reader.number(node, "value")
        return number if number == number else None
    if kind == "Boolean":
        return reader.flag(node, "value")
    raw = reader.text(node, "value")
    if kind in ("String", "Enumeration"):
        return raw
    return _whole(node, reader, name, raw)


def _whole(node: Any, reader: Reader, name: str, raw: str) -> int | None:
    value = whole(raw)
    if value is None:
        reader.replace_problem(node, raw, "number", f"parameter '{name}': '{raw}' is not a whole number")
        return None
    if not fits_integer(value):
        text = f"parameter '{name}': {raw} does not fit into an Integer of 32 bits"
        reader.replace_problem(node, raw, "number", text)
        return None
    return value


def fits_integer(value: float) -> bool:
    """Whether a number is one that an FMI Integer can hold."""
    return -(2**31) <= value < 2**31
