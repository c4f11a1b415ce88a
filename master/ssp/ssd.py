"""The system structure description (``SystemStructure.ssd``): one parse function per XML node.

What the master does not honour is reported with its line, never skipped silently.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Final

from master.ssp.archive import SSD_NAME, Sources
from master.ssp.flatten import flatten
from master.ssp.run_settings import Annotations, RunSettings, check_places, parse_annotations
from master.ssp.ssd_elements import NO_SYSTEM, Binding, Component, Connection, Connector, Feed, Joint, SystemNode
from master.ssp.ssm import Entry, apply, parse_mapping, parse_transformation, read_mapping_file
from master.ssp.ssp_enumerations import Items, parse_enumerations
from master.ssp.ssp_units import Unit, parse_units
from master.ssp.ssp_xml import SSC, SSD, SSM, SSV, VERSIONS, Reader, child, children, elements, tag
from master.ssp.ssv import Parameter, ParameterSet, parse_parameter_set, read_parameter_file

FMU_TYPES: Final = ("application/x-fmu-sharedlibrary",)
SET_TYPE: Final = "application/x-ssp-parameter-set"
MAPPING_TYPE: Final = "application/x-ssp-parameter-mapping"
CONNECTOR_TYPES: Final = ("Real", "Integer", "Boolean", "String", "Enumeration", "Binary")
TRANSFORMATIONS: Final = (
    "BooleanMappingTransformation",
    "IntegerMappingTransformation",
    "EnumerationMappingTransformation",
)


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
    enumerations: dict[str, Items] = field(default_factory=dict)
    feeds: tuple[Feed, ...] = ()
    connectors: dict[str, Connector] = field(default_factory=dict)
    joints: tuple[Joint, ...] = ()
    title: str = ""


EMPTY: Final = Structure("", (), (), (), {}, 0.0, None, Annotations(RunSettings(), None))


def read_structure(sources: Sources, reader: Reader) -> Structure:
    """Read the ``SystemStructure.ssd`` of a scenario; problems are collected in ``reader``."""
    node = reader.parse(sources.root / SSD_NAME)
    if node is None:
        return EMPTY
    if tag(node) != "SystemStructureDescription" or node.get("version") not in VERSIONS:
        text = f"is not an SSP description of version {' or '.join(VERSIONS)} (version='{node.get('version')}')"
        reader.problem(node, "version", text)
        return EMPTY  # the meaning of another version's words would be a guess
    reader.check_schema(node, "ssd")
    return parse_structure(node, sources, reader)


def parse_structure(node: Any, sources: Sources, reader: Reader) -> Structure:
    """Parse ``ssd:SystemStructureDescription``; nested systems are flattened."""
    system = child(node, SSD, "System")
    experiment = child(node, SSD, "DefaultExperiment")
    annotated = [a for n in (experiment, node) if n is not None for a in children(n, SSD, "Annotations")]
    check_places(node, annotated, reader)
    flat = flatten(NO_SYSTEM if system is None else parse_system(system, sources, reader), reader)
    return Structure(
        reader.text(node, "name"),
        flat.components,
        flat.connections,
        flat.bindings,
        parse_units(child(node, SSD, "Units"), reader),
        0.0 if experiment is None else reader.number(experiment, "startTime", 0.0),
        None if experiment is None or experiment.get("stopTime") is None else reader.number(experiment, "stopTime"),
        parse_annotations(annotated, reader),
        parse_enumerations(child(node, SSD, "Enumerations"), reader),
        flat.feeds,
        flat.connectors,
        flat.joints,
        reader.text(node, "description") or ("" if system is None else reader.text(system, "description")),
    )


def parse_system(node: Any, sources: Sources, reader: Reader) -> SystemNode:
    """Parse ``ssd:System``; signal dictionaries are refused."""
    if (found := child(node, SSD, "SignalDictionaries")) is not None:
        reader.problem(found, "unsupported", "signal dictionaries are not supported; connect components directly")
    inside_it = list(elements(child(node, SSD, "Elements")))
    reader.unique(inside_it, "element")
    for element in inside_it:
        if tag(element) not in ("Component", "System"):
            what = f"element '{element.get('name')}' is a {tag(element)}, which is not supported"
            reader.problem(element, "unsupported", f"{what}; use components and systems")
    return SystemNode(
        reader.text(node, "name"),
        parse_connectors(node, reader),
        tuple(parse_component(e, sources, reader) for e in inside_it if tag(e) == "Component"),
        tuple(parse_system(e, sources, reader) for e in inside_it if tag(e) == "System"),
        tuple(parse_connection(c, reader) for c in children(child(node, SSD, "Connections"), SSD, "Connection")),
        parse_bindings(node, sources, reader),
        int(node.sourceline or 0),
    )


def parse_component(node: Any, sources: Sources, reader: Reader) -> Component:
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
    return Component(
        name,
        reader.text(node, "source"),
        parse_connectors(node, reader),
        parse_bindings(node, sources, reader),
        int(node.sourceline or 0),
    )


def parse_connectors(node: Any, reader: Reader) -> tuple[Connector, ...]:
    """Parse the ``ssd:Connectors`` of a component or system."""
    found = list(children(child(node, SSD, "Connectors"), SSD, "Connector"))
    reader.unique(found, f"'{reader.text(node, 'name')}': connector")
    return tuple(parse_connector(c, reader) for c in found)


def parse_connector(node: Any, reader: Reader) -> Connector:
    """Parse ``ssd:Connector``."""
    typed = next((e for t in CONNECTOR_TYPES if (e := child(node, SSC, t)) is not None), None)
    return Connector(
        reader.text(node, "name"),
        reader.text(node, "kind"),
        "" if typed is None else tag(typed),
        "" if typed is None else reader.text(typed, "unit"),
        int(node.sourceline or 0),
        "" if typed is None or tag(typed) != "Enumeration" else reader.text(typed, "name"),
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


def parse_bindings(node: Any | None, sources: Sources, reader: Reader) -> tuple[Binding, ...]:
    """Parse the ``ssd:ParameterBindings`` of a component or system, in order."""
    nodes = children(child(node, SSD, "ParameterBindings"), SSD, "ParameterBinding")
    parsed = (parse_binding(b, sources, reader) for b in nodes)
    return tuple(b for b in parsed if b is not None)


def parse_binding(node: Any, sources: Sources, reader: Reader) -> Binding | None:
    """Parse ``ssd:ParameterBinding``, inline or with its ``.ssv`` file, and apply its mapping if it has one."""
    if not _is_plain(node, child(node, SSD, "ParameterValues"), SET_TYPE, reader):
        return None
    found = _inline_set(node, reader) if not node.get("source") else _file_set(node, sources, reader)
    if found is None:
        return None
    binding = Binding(reader.text(node, "prefix"), found, int(node.sourceline or 0))
    mapping = child(node, SSD, "ParameterMapping")
    return binding if mapping is None else _mapped(binding, mapping, sources, reader)


def _mapped(binding: Binding, node: Any, sources: Sources, reader: Reader) -> Binding | None:
    """Return the binding with its parameters under the names that the mapping gives them."""
    entries = _mapping(node, sources, reader)
    if entries is None:
        return None
    parameters = replace(binding.parameters, parameters=apply(entries, binding.parameters, binding.prefix, reader))
    return replace(binding, prefix="", parameters=parameters)


def _mapping(node: Any, sources: Sources, reader: Reader) -> tuple[Entry, ...] | None:
    if not _is_plain(node, node, MAPPING_TYPE, reader):
        return None
    source = node.get("source")
    if not source:
        inline = child(node, SSM, "ParameterMapping")
        if inline is None:
            reader.problem(node, "mapping", "the mapping has neither a source nor an inline ssm:ParameterMapping")
            return None
        return parse_mapping(inline, reader)
    path = sources.find(source)
    if path is None or not path.is_file():
        reader.problem(node, "mapping", f"mapping file '{source}' does not exist in the scenario")
        return None
    return read_mapping_file(path, reader.beside(source))


def _is_plain(node: Any, holder: Any | None, kind: str, reader: Reader) -> bool:
    """Whether a binding or mapping is of the type that is read, in a file or else once inside ``holder``."""
    what, inside = tag(node), list(elements(holder))
    if reader.text(node, "sourceBase", "SSD") != "SSD":
        reader.problem(node, "unsupported", "sourceBase='component' is not supported; put the file next to the SSD")
    elif (stated := reader.text(node, "type", kind)) != kind:
        reader.problem(node, "unsupported", f"the {what} is of type '{stated}'; only {kind} is supported")
    elif inside and node.get("source"):
        text = f"the {what} has a source, '{node.get('source')}', and content as well; remove one of them"
        reader.problem(inside[0], "binding", text)
    elif len(inside) > 1:
        reader.problem(inside[1], "binding", f"the {what} holds {len(inside)} elements; one is allowed")
    else:
        return True
    return False


def parameter_names(binding: Binding) -> dict[str, Parameter]:
    """Return the parameters of a binding by their full name, later ones winning."""
    return {binding.prefix + p.name: p for p in binding.parameters.parameters}


def _inline_set(node: Any, reader: Reader) -> ParameterSet | None:
    inline = child(child(node, SSD, "ParameterValues"), SSV, "ParameterSet")
    if inline is None:
        reader.problem(node, "binding", "the parameter binding has neither a source nor an inline ssv:ParameterSet")
        return None
    return parse_parameter_set(inline, reader)


def _file_set(node: Any, sources: Sources, reader: Reader) -> ParameterSet | None:
    source = reader.text(node, "source")
    path = sources.find(source)
    if path is None or not path.is_file():
        reader.problem(node, "binding", f"parameter file '{source}' does not exist in the scenario")
        return None
    return read_parameter_file(path, reader.beside(source))
