"""The text of a scenario's files: ``SystemStructure.ssd``, and the parameters of a component."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple
from xml.sax.saxutils import escape, quoteattr

from master.ssp.run_settings import NAMESPACE, OSP_TYPE
from master.ssp.ssp_xml import SSC, SSD, SSV

#: Definitions of the units that are written here.
_UNITS: Final = {
    "m": 'm="1"',
    "s": 's="1"',
    "m/s": 'm="1" s="-1"',
    "N": 'kg="1" m="1" s="-2"',
    "N.m": 'kg="1" m="2" s="-2"',
}


class WrittenConnector(NamedTuple):
    """A connector: name, kind (input or output) and unit."""

    name: str
    kind: str
    unit: str


class WrittenComponent(NamedTuple):
    """A component: name, FMU, connectors, and the file of its parameters or nothing."""

    name: str
    source: str
    connectors: Sequence[WrittenConnector]
    parameters: str = ""


class WrittenConnection(NamedTuple):
    """A connection from an output to an input."""

    start: str
    output: str
    end: str
    input: str


class WrittenParameter(NamedTuple):
    """A parameter: name, value (a whole number is one in the file too), unit, and what is said of it."""

    name: str
    value: float | int
    unit: str
    remark: str = ""


@dataclass(frozen=True)
class WrittenSystem:
    """A scenario as it is written.

    Attributes
    ----------
    name, description : str
    components, connections : sequences
    stop : float
        Stop time for other tools [s]
    interval : (float, float)
        Of interest [m].
    until_end : bool
        Whether our run lasts until the last pantograph has left the interval.
    calibrated : str
        Parameter that is calibrated; empty for none.
    mean_force : float
        What it has to give [N].
    supply : str
        Supply system whose limits apply.
    """

    name: str
    description: str
    components: Sequence[WrittenComponent]
    connections: Sequence[WrittenConnection]
    stop: float
    interval: tuple[float, float]
    until_end: bool
    calibrated: str
    mean_force: float
    supply: str = "AC"


def ssd_text(system: WrittenSystem) -> str:
    """Return the system structure description."""
    units = {c.unit for component in system.components for c in component.connectors}
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            "<ssd:SystemStructureDescription",
            f'    xmlns:ssc="{SSC}"',
            f'    xmlns:ssd="{SSD}"',
            '    xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations"',
            f'    version="1.0" name={quoteattr(system.name)}>',
            f"  <ssd:System name={quoteattr(system.name)} description={quoteattr(system.description)}>",
            "    <ssd:Elements>",
            *(line for component in system.components for line in _component(component)),
            "    </ssd:Elements>",
            "    <ssd:Connections>",
            *map(_connection, system.connections),
            "    </ssd:Connections>",
            "  </ssd:System>",
            *_units("ssd", units),
            f'  <ssd:DefaultExperiment startTime="0" stopTime="{system.stop:g}">',
            "    <ssd:Annotations>",
            f'      <ssc:Annotation type="{OSP_TYPE}">',
            "        <osp:Algorithm>",
            '          <osp:FixedStepAlgorithm baseStepSize="0.001"/>',
            "        </osp:Algorithm>",
            "      </ssc:Annotation>",
            "    </ssd:Annotations>",
            "  </ssd:DefaultExperiment>",
            *_annotation(system),
            "</ssd:SystemStructureDescription>",
            "",
        ]
    )


def ssv_text(name: str, parameters: Sequence[WrittenParameter]) -> str:
    """Return a set of parameter values."""
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            "<ssv:ParameterSet",
            f'    xmlns:ssc="{SSC}"',
            f'    xmlns:ssv="{SSV}"',
            f'    version="1.0" name={quoteattr(name)}>',
            "  <ssv:Parameters>",
            *(line for parameter in parameters for line in _parameter(parameter)),
            "  </ssv:Parameters>",
            *_units("ssv", {p.unit for p in parameters}),
            "</ssv:ParameterSet>",
            "",
        ]
    )


def _component(component: WrittenComponent) -> Iterator[str]:
    source = quoteattr(component.source)
    name = quoteattr(component.name)
    yield f'      <ssd:Component name={name} source={source} type="application/x-fmu-sharedlibrary">'
    yield "        <ssd:Connectors>"
    for c in component.connectors:
        unit = f" unit={quoteattr(c.unit)}" if c.unit else ""
        head = f"<ssd:Connector name={quoteattr(c.name)} kind={quoteattr(c.kind)}>"
        yield f"          {head}<ssc:Real{unit}/></ssd:Connector>"
    yield "        </ssd:Connectors>"
    if component.parameters:
        yield "        <ssd:ParameterBindings>"
        yield f"          <ssd:ParameterBinding source={quoteattr(component.parameters)}/>"
        yield "        </ssd:ParameterBindings>"
    yield "      </ssd:Component>"


def _connection(c: WrittenConnection) -> str:
    start = f"startElement={quoteattr(c.start)} startConnector={quoteattr(c.output)}"
    return f"      <ssd:Connection {start} endElement={quoteattr(c.end)} endConnector={quoteattr(c.input)}/>"


def _annotation(system: WrittenSystem) -> Iterator[str]:
    start, end = (f"{x:.9g}" for x in system.interval)
    until = ' until="end"' if system.until_end else ""
    yield "  <ssd:Annotations>"
    yield f'    <ssc:Annotation type="{NAMESPACE}">'
    yield f'      <panto:Run xmlns:panto="{NAMESPACE}">'
    yield '        <panto:Coupling scheme="jacobi"/>'
    yield f'        <panto:Interval start="{start}" end="{end}"{until}/>'
    if system.calibrated:
        values = f'meanForce="{system.mean_force:.6g}" tolerance="0.1"'
        yield f"        <panto:Calibration parameter={quoteattr(system.calibrated)} {values}/>"
    if system.supply != "AC":
        yield f"        <panto:Limits supply={quoteattr(system.supply)}/>"
    yield "      </panto:Run>"
    yield "    </ssc:Annotation>"
    yield "  </ssd:Annotations>"


def _parameter(parameter: WrittenParameter) -> Iterator[str]:
    unit = f" unit={quoteattr(parameter.unit)}" if parameter.unit else ""
    if parameter.remark:
        yield f"    <!-- {escape(parameter.remark).replace('--', '- -')} -->"
    kind = "Integer" if isinstance(parameter.value, int) else "Real"
    value = f'<ssv:{kind} value="{parameter.value:.15g}"{unit if kind == "Real" else ""}/>'
    yield f"    <ssv:Parameter name={quoteattr(parameter.name)}>{value}</ssv:Parameter>"


def _units(prefix: str, used: Iterable[str], known: Mapping[str, str] = _UNITS) -> Iterator[str]:
    """Yield the definitions of the units that are used; those of foreign FMUs are defined by these."""
    written = [name for name in known if name in set(used)]
    if written:
        yield f"  <{prefix}:Units>"
        yield from (f'    <ssc:Unit name="{name}"><ssc:BaseUnit {known[name]}/></ssc:Unit>' for name in written)
        yield f"  </{prefix}:Units>"
