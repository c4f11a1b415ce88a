"""Parameter mappings (``.ssm`` files, or inline in a parameter binding): names and values on their way to the FMU."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from master.ssp.ssv import Parameter
from master.ssp.units import Conversion
from master.ssp.xml import SSC, SSM, Reader, child, children

_REFUSED: Final = (
    "BooleanMappingTransformation",
    "IntegerMappingTransformation",
    "EnumerationMappingTransformation",
)


@dataclass(frozen=True)
class Entry:
    """One line of a mapping: the parameter ``source`` of the set becomes ``target`` of the component or system."""

    source: str
    target: str
    transformation: Conversion
    suppress_unit_conversion: bool
    file: str
    line: int


def read_mapping_file(path: Path, reader: Reader) -> tuple[Entry, ...] | None:
    """Read and check an ``.ssm`` file; None if it is not XML."""
    root = reader.parse(path)
    if root is None:
        return None
    reader.check_schema(root, "ssm")
    return parse_mapping(root, reader)


def parse_mapping(node: Any, reader: Reader) -> tuple[Entry, ...]:
    """Parse ``ssm:ParameterMapping``."""
    return tuple(parse_entry(e, reader) for e in children(node, SSM, "MappingEntry"))


def parse_entry(node: Any, reader: Reader) -> Entry:
    """Parse ``ssm:MappingEntry``."""
    for name in _REFUSED:
        if (found := child(node, SSC, name)) is not None:
            reader.problem(found, "unsupported", f"{name} is not supported")
    return Entry(
        reader.text(node, "source"),
        reader.text(node, "target"),
        parse_transformation(child(node, SSC, "LinearTransformation"), reader),
        reader.flag(node, "suppressUnitConversion"),
        reader.file,
        int(node.sourceline or 0),
    )


def parse_transformation(node: Any | None, reader: Reader) -> Conversion:
    """Parse ``ssc:LinearTransformation``: factor (default 1) times the value plus offset (default 0)."""
    if node is None:
        return Conversion()
    return Conversion(reader.number(node, "factor", 1.0), reader.number(node, "offset", 0.0))


def _check_targets(entries: tuple[Entry, ...], reader: Reader) -> None:
    seen: set[str] = set()
    for entry in entries:
        if entry.target in seen:
            text = f"'{entry.target}' is the target of two entries; remove one"
            reader.report(entry.line, "mapping", text, entry.file)
        seen.add(entry.target)


def apply(entries: tuple[Entry, ...], parameters: Mapping[str, Parameter], reader: Reader) -> tuple[Parameter, ...]:
    """Return the parameters that a mapping makes of a set; what it does not name is not used.

    Parameters
    ----------
    entries : tuple of Entry
    parameters : mapping
        The set's parameters by name, prefix included.
    reader : Reader
        Is told of entries without a parameter, and of transformations of what is no number.
    """
    mapped = []
    _check_targets(entries, reader)
    for entry in entries:
        parameter = parameters.get(entry.source)
        if parameter is None:
            reader.report(entry.line, "mapping", f"the parameter set holds no '{entry.source}'", entry.file)
        elif not entry.transformation.is_identity and isinstance(parameter.value, str | bool):
            text = f"'{entry.source}' is {parameter.type}, which cannot be transformed"
            reader.report(entry.line, "mapping", text, entry.file)
        else:
            mapped.append(
                replace(
                    parameter,
                    name=entry.target,
                    transformation=entry.transformation,
                    suppress_unit_conversion=entry.suppress_unit_conversion,
                )
            )
    return tuple(mapped)
