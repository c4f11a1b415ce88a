"""The system structure description (``SystemStructure.ssd``): one parse function per XML node.

What the master does not honour is reported with its line, never skipped silently.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from master.ssp.annotation import Annotations, RunSettings, parse_annotations
from master.ssp.archive import SSD_NAME, inside
from master.ssp.ssv import Parameter, ParameterSet, parse_parameter_set, read_parameter_file
from master.ssp.units import Conversion, Unit, parse_units
from master.ssp.xml import SSC, SSD, SSV, Reader, child, children, elements, tag

FMU_TYPES: Final = ("application/x-fmu-sharedlibrary",)
CONNECTOR_TYPES: Final = ("Real", "Integer", "Boolean", "String", "Enumeration", "Binary")
TRANSFORMATIONS: Final = (
    "BooleanMappingTransformation",
    "IntegerMappingTransformation",
    "EnumerationMappingTransformation",
)


@dataclass(frozen=True)
class Connector:
    """A declared variable of a component; ``type`` is empty when the file leaves it to the FMU."""

    name: str
    kind: str
    type: str
    unit: str
    line: int


@dataclass(frozen=True)
class Binding:
    """A parameter binding: values for parameters named relative to its element, after ``prefix``."""

    prefix: str
    parameters: ParameterSet
    line: int


@dataclass(frozen=True)
class Component:
    """An FMU in the system."""

    name: str
    source: str
    connectors: tuple[Connector, ...]
    bindings: tuple[Binding, ...]
    line: int


@dataclass(frozen=True)
class Connection:
    """Connection of two connectors as written: its direction follows from the connectors' kinds."""

    start_element: str
    start_connector: str
    end_element: str
    end_connector: str
    transformation: Conversion
    suppress_unit_conversion: bool
    line: int


@dataclass(frozen=True)
class Structure:
    """A whole system structure description, as written."""

    name: str
    components: tuple[Component, ...]
    connections: tuple[Connection, ...]
    bindings: tuple[Binding, ...]
    units: dict[str, Unit]
    start: float
    stop: float | None
    annotations: Annotations


EMPTY: Final = Structure("", (), (), (), {}, 0.0, None, Annotations(RunSettings(), None))


def read_structure(root: Path, reader: Reader) -> Structure:
    """Read ``SystemStructure.ssd`` in the folder ``root``; problems are collected in ``reader``."""
    node = reader.parse(root / SSD_NAME)
    if node is None:
        return EMPTY
    reader.check_schema(node, "ssd")
    if tag(node) != "SystemStructureDescription" or node.get("version") != "1.0":
        reader.problem(
            node,
            "version",
            f"is not an SSP 1.0 description (version='{node.get('version')}'); only 1.0 is supported",
        )
    return parse_structure(node, root, reader)


def parse_structure(node: Any, root: Path, reader: Reader) -> Structure:
    """Parse ``ssd:SystemStructureDescription``."""
    system = child(node, SSD, "System")
    experiment = child(node, SSD, "DefaultExperiment")
    if child(node, SSD, "Enumerations") is not None:
        reader.problem(child(node, SSD, "Enumerations"), "unsupported", "enumerations are not supported")
    refuse_in_system(system, reader)
    annotated = [a for n in (experiment, node) if n is not None for a in children(n, SSD, "Annotations")]
    return Structure(
        reader.text(node, "name"),
        parse_elements(child(system, SSD, "Elements"), root, reader),
        tuple(parse_connection(c, reader) for c in children(child(system, SSD, "Connections"), SSD, "Connection")),
        parse_bindings(system, root, reader),
        parse_units(child(node, SSD, "Units"), reader),
        0.0 if experiment is None else reader.number(experiment, "startTime", 0.0),
        None if experiment is None or experiment.get("stopTime") is None else reader.number(experiment, "stopTime"),
        parse_annotations(annotated, reader),
    )


def refuse_in_system(system: Any | None, reader: Reader) -> None:
    """Report what a system may contain by the standard but the master does not honour."""
    for name, what in (
        ("Connectors", "connectors of the system as a whole are not supported; connect components directly"),
        ("SignalDictionaries", "signal dictionaries are not supported; connect components directly"),
    ):
        if (found := child(system, SSD, name)) is not None:
            reader.problem(found, "unsupported", what)


def parse_elements(node: Any | None, root: Path, reader: Reader) -> tuple[Component, ...]:
    """Parse ``ssd:Elements``; nested systems and signal dictionaries are refused."""
    components = []
    for element in elements(node):
        if tag(element) == "Component":
            components.append(parse_component(element, root, reader))
        else:
            what = f"element '{element.get('name')}' is a {tag(element)}, which is not supported"
            reader.problem(element, "unsupported", f"{what}; use a flat list of components")
    return tuple(components)


def parse_component(node: Any, root: Path, reader: Reader) -> Component:
    """Parse ``ssd:Component``."""
    name = reader.text(node, "name")
    if (kind := reader.text(node, "type", FMU_TYPES[0])) not in FMU_TYPES:
        reader.problem(
            node,
            "unsupported",
            f"component '{name}' is of type '{kind}'; only FMUs ({FMU_TYPES[0]}) are supported",
        )
    if reader.text(node, "implementation", "any") == "ModelExchange":
        reader.problem(
            node,
            "unsupported",
            f"component '{name}' asks for model exchange; only co-simulation is supported",
        )
    connectors = children(child(node, SSD, "Connectors"), SSD, "Connector")
    return Component(
        name,
        reader.text(node, "source"),
        tuple(parse_connector(c, reader) for c in connectors),
        parse_bindings(node, root, reader),
        int(node.sourceline or 0),
    )


def parse_connector(node: Any, reader: Reader) -> Connector:
    """Parse ``ssd:Connector``."""
    typed = next((e for t in CONNECTOR_TYPES if (e := child(node, SSC, t)) is not None), None)
    return Connector(
        reader.text(node, "name"),
        reader.text(node, "kind"),
        "" if typed is None else tag(typed),
        "" if typed is None else reader.text(typed, "unit"),
        int(node.sourceline or 0),
    )


def parse_connection(node: Any, reader: Reader) -> Connection:
    """Parse ``ssd:Connection``."""
    for name in TRANSFORMATIONS:
        if (found := child(node, SSC, name)) is not None:
            reader.problem(found, "unsupported", f"{name} is not supported")
    return Connection(
        reader.text(node, "startElement"),
        reader.text(node, "startConnector"),
        reader.text(node, "endElement"),
        reader.text(node, "endConnector"),
        parse_transformation(child(node, SSC, "LinearTransformation"), reader),
        reader.flag(node, "suppressUnitConversion"),
        int(node.sourceline or 0),
    )


def parse_transformation(node: Any | None, reader: Reader) -> Conversion:
    """Parse ``ssc:LinearTransformation``: factor (default 1) times the value plus offset (default 0)."""
    if node is None:
        return Conversion()
    return Conversion(reader.number(node, "factor", 1.0), reader.number(node, "offset", 0.0))


def parse_bindings(node: Any | None, root: Path, reader: Reader) -> tuple[Binding, ...]:
    """Parse the ``ssd:ParameterBindings`` of a component or system, in order."""
    nodes = children(child(node, SSD, "ParameterBindings"), SSD, "ParameterBinding")
    parsed = (parse_binding(b, root, reader) for b in nodes)
    return tuple(b for b in parsed if b is not None)


def parse_binding(node: Any, root: Path, reader: Reader) -> Binding | None:
    """Parse ``ssd:ParameterBinding``, inline or with its ``.ssv`` file."""
    if (mapping := child(node, SSD, "ParameterMapping")) is not None:
        reader.problem(
            mapping, "unsupported", "parameter mappings are not supported; use the FMU's own parameter names"
        )
    if reader.text(node, "sourceBase", "SSD") != "SSD":
        reader.problem(node, "unsupported", "sourceBase='component' is not supported; put the file beside the SSD")
        return None
    found = _inline_set(node, reader) if node.get("source") is None else _file_set(node, root, reader)
    return None if found is None else Binding(reader.text(node, "prefix"), found, int(node.sourceline or 0))


def parameter_names(binding: Binding) -> dict[str, Parameter]:
    """Return the parameters of a binding by their full name, later ones winning."""
    return {binding.prefix + p.name: p for p in binding.parameters.parameters}


def _inline_set(node: Any, reader: Reader) -> ParameterSet | None:
    inline = child(child(node, SSD, "ParameterValues"), SSV, "ParameterSet")
    if inline is None:
        reader.problem(node, "binding", "the parameter binding has neither a source nor an inline ssv:ParameterSet")
        return None
    return parse_parameter_set(inline, reader)


def _file_set(node: Any, root: Path, reader: Reader) -> ParameterSet | None:
    source = reader.text(node, "source")
    path = inside(root, source)
    if path is None or not path.is_file():
        reader.problem(node, "binding", f"parameter file '{source}' does not exist in the scenario")
        return None
    return read_parameter_file(path, Reader(source, reader.problems))
