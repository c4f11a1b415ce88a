"""Parameter mappings (``.ssm`` files, or inline in a parameter binding): names and values on their way to the FMU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from master.ssp.ssp_units import Conversion
from master.ssp.ssp_xml import SSC, SSM, Reader, child, children
from master.ssp.ssv import Parameter, ParameterSet

#: Rule of a mere note, which is no problem in a strict check either.
NOTE: Final = "note"
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
    return parse_mapping(root, reader)


def parse_mapping(node: Any, reader: Reader) -> tuple[Entry, ...]:
    """Check and parse ``ssm:ParameterMapping``, of a file or inline."""
    reader.check_schema(node, "ssm")
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


def apply(entries: tuple[Entry, ...], given: ParameterSet, prefix: str, reader: Reader) -> tuple[Parameter, ...]:
    """Return the parameters that a mapping makes of a set; parameters that it does not name are not used.

    Parameters
    ----------
    entries : tuple of Entry
    given : ParameterSet
    prefix : str
        Put before the names of the set's parameters.
    reader : Reader
        Receives a problem for every transformation of what is no number, and one warning each for entries without a
        parameter and for parameters without an entry.
    """
    mapped = []
    _check_targets(entries, reader)
    parameters = {prefix + p.name: p for p in given.parameters}
    for entry in entries:
        parameter = parameters.get(entry.source)
        if parameter is None:
            continue
        if not entry.transformation.is_identity and isinstance(parameter.value, str | bool):
            text = f"'{entry.source}' is {parameter.type}, which cannot be transformed"
            reader.report(entry.line, "mapping", text, entry.file)
        else:
            mapped.append(
                replace(
                    parameter,
                    name=entry.target,
                    transformation=entry.transformation,
                    suppress_unit_conversion=entry.suppress_unit_conversion,
                    name_file=entry.file,
                    name_line=entry.line,
                )
            )
    _warn_of_rest(entries, {*parameters, *(prefix + name for name in given.unreadable)}, reader)
    return tuple(mapped)


def _warn_of_rest(entries: tuple[Entry, ...], known: set[str], reader: Reader) -> None:
    """Warn of entries whose source is empty or not in the set, and of parameters that no entry names."""
    without = [e for e in entries if e.source not in known]
    if without:
        targets = several([e.target for e in without])
        text = f"the parameter set holds no {several([e.source for e in without])}: nothing is set for {targets}"
        reader.warn(without[0].line, "mapping", text, without[0].file)
    unused = sorted(known - {e.source for e in entries})
    if unused and entries and not without:
        text = f"the mapping names no {several(unused)} of the parameter set: not used"
        reader.warn(entries[0].line, NOTE, text, entries[0].file)


def several(names: Sequence[str], most: int = 5) -> str:
    """Return names in quotes, the first few of many.

    Examples
    --------
    >>> several(["a", ""]), several(["a", "b", "c"], most=1)
    ("'a', ''", "'a' and 2 more")
    """
    shown = ", ".join(f"'{name}'" for name in names[:most])
    return shown + (f" and {len(names) - most} more" if len(names) > most else "")
