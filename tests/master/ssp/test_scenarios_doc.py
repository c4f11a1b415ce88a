"""The list of what is honoured and refused in docs/scenarios.md is true: every row of it has a case here."""

# ruff: noqa: E501 (XML, a thing a line)

from __future__ import annotations

import re
from pathlib import Path

import pytest

from master.errors import ScenarioError
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from tests.foreign_fmus import (
    binding,
    compile_library,
    component,
    connector,
    connectors,
    description,
    ssd,
    system,
    values,
    wire,
    write_fmu,
)  # fmt: skip

DOC = Path(__file__).parents[3] / "docs" / "scenarios.md"
U, K, Y = connector("u", "input"), connector("k", "parameter"), connector("y", "output")
A, B = component("a", Y), component("b", U)
AB = wire("a.y", "b.u")
KN = '<ssc:Unit name="kN"><ssc:BaseUnit kg="1" m="1" s="-2" factor="{}"/></ssc:Unit>'
ENUMERATION = '<ssd:Enumerations><ssc:Enumeration name="Speed"><ssc:Item name="off" value="1"/><ssc:Item name="low" value="2"/><ssc:Item name="high" value="3"/></ssc:Enumeration></ssd:Enumerations>'
MAPPING = '<ssd:ParameterMapping><ssm:ParameterMapping version="1.0"><ssm:MappingEntry source="a" target="k"><ssc:LinearTransformation factor="2"/></ssm:MappingEntry><ssm:MappingEntry source="" target="u"/></ssm:ParameterMapping></ssd:ParameterMapping>'


def rows(head):
    """The first cells of the table with this head."""
    text = DOC.read_text(encoding="utf-8")
    table = re.search(rf"\| {head} \|.*?\n\|---\|---\|\n(.*?)\n\n", text, re.DOTALL)[1]
    return [line.split("|")[1].strip() for line in table.splitlines()]


def typed(kind, source, target, what=""):
    what = what or kind
    return component("a", connector(source, "output", what)) + component("b", connector(target, "input", what)), wire(
        f"a.{source}", f"b.{target}"
    )


def of(*parts, **options):
    """A description of one system."""
    return ssd(system(*parts), **options)


own_in, own_k = connectors(connector("w", "input")), connectors(connector("w", "parameter"))
HONOURED = {
    "nested systems": (of(A + system(B, wire(".w", "b.u"), own_in, name="in"), wire("a.y", "in.w")), [("a.y", "in.b.u")]),
    "connections in either direction": (of(A + B, wire("b.u", "a.y")), [("a.y", "b.u")]),
    "Integer, Boolean, String and Enumeration": (ssd(system(*typed("Enumeration", "e_out", "e_in", 'Enumeration name="Speed"')), ENUMERATION), [("a.e_out", "b.e_in")]),
    "`ssc:LinearTransformation`": (of(A + B, wire("a.y", "b.u", '<ssc:LinearTransformation factor="2"/>')), [("a.y", "b.u", 2.0)]),
    "units": (of(component("a", connector("y", "output", 'Real unit="kN"')) + component("b", connector("u", "input", 'Real unit="N"')), AB), [("a.y", "b.u", 1000.0)]),
    "inputs that nothing feeds": (of(B), {"b": {}}),
    "inputs of systems that nothing feeds": (of(B, wire(".w", "b.u"), own_in), {"b": {}}),
    "parameter connectors of systems": (of(component("a", K) + component("b", K), wire(".w", "a.k") + wire(".w", "b.k"), own_k, values(("w", 'Real value="2"'))), {"a": {"k": 2.0}, "b": {"k": 2.0}}),
    "values bound to connectors of systems": (of(B, wire(".w", "b.u"), own_in, values(("w", 'Real value="2"'))), {"b": {"u": 2.0}}),
    "enumeration values": (of(component("a", Y, bindings=values(("e_in", 'Enumeration value="high"')))), {"a": {"e_in": 3}}),
    "start values of outputs and local variables": (of(component("a", Y, bindings=values(("guess", 'Real value="2"')))), {"a": {"guess": 2.0}}),
    "parameter mappings": (of(component("a", Y, bindings=values(("a", 'Real value="2"'), mapping=MAPPING))), {"a": {"k": 4.0}}),
    "percent-encoded sources": (of(component("a", Y, source="resources/pan%65l.fmu")), {"a": {}}),
    "names of SSP 2.0": (of(A.replace("Real", "Float64") + B.replace("Real", "Float64"), AB, version="2.0"), [("a.y", "b.u")]),
}  # fmt: skip
HONOURED["annotations of other tools"] = (
    of(A + B, AB).replace(
        "</ssd:System>", '<ssd:Annotations><ssc:Annotation type="other"/></ssd:Annotations></ssd:System>'
    ),
    [("a.y", "b.u")],
)
TWICE = binding(("k", 'Real value="2"')) + binding(("k", 'Real value="3"'))
HONOURED["parameter bindings"] = (
    of(component("a", Y, bindings=f"<ssd:ParameterBindings>{TWICE}</ssd:ParameterBindings>")),
    {"a": {"k": 3.0}},
)

FORCE = component("p", connector("contact.force", "input"), source="resources/pantograph.fmu")
REFUSED = {
    "signal dictionaries": (of(A, "").replace("</ssd:System>", '<ssd:SignalDictionaries><ssd:SignalDictionary name="d"/></ssd:SignalDictionaries></ssd:System>'), "signal dictionaries are not supported"),
    '`sourceBase="component"`': (of(component("a", Y, bindings='<ssd:ParameterBindings><ssd:ParameterBinding source="p.ssv" sourceBase="component"/></ssd:ParameterBindings>')), "sourceBase='component' is not supported"),
    "mapping transformations": (of(*(lambda e, _: (e, wire("a.b_out", "b.b_in", '<ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/></ssc:BooleanMappingTransformation>')))(*typed("Boolean", "b_out", "b_in"))), "BooleanMappingTransformation is not supported"),
    "components that are SSP packages": (of(A.replace("<ssd:Component ", '<ssd:Component type="application/x-ssp-package" ')), "only FMUs"),
    "model exchange": (of(A.replace("<ssd:Component ", '<ssd:Component implementation="ModelExchange" ')), "only co-simulation is supported"),
    "Binary variables in connections": (of(component("a", connector("y", "output", "Binary")) + component("b", connector("u", "input", "Binary")), AB), "type is Binary, in the FMU Real"),
    "connectors of kind `inout`": (of(component("a", connector("y", "inout"))), "kind 'inout' is not supported"),
    "calculated parameters connected to parameters": (of(component("a", connector("c", "calculatedParameter"), source="resources/calculated.fmu") + component("b", K), wire("a.c", "b.k")), "connections from calculated parameters to parameters are not supported"),
    "variables of different types connected": (of(component("a", connector("i_out", "output", "Integer")) + B, wire("a.i_out", "b.u")), "only variables of the same type"),
    "enumerations with other items connected": (of(component("a", '<ssd:Connector name="e_out" kind="output"/>') + component("b", '<ssd:Connector name="e_in" kind="input"/>', source="resources/other.fmu"), wire("a.e_out", "b.e_in")), "connected enumerations must have the same ones"),
    "a unit with two meanings": (ssd(system(A), f"<ssd:Units>{KN.format(1)}</ssd:Units>"), "everywhere else it has factor 1000"),
    "connectors of systems of another type": (of(A, wire("a.y", ".o"), connectors(connector("o", "output", "Integer"))), "only variables of the same type"),
    "parameters that no variable takes": (of(component("a", Y, bindings=values(("nix", 'Real value="1"')))), "the FMU resources/panel.fmu has no such variable"),
    "two contents of a binding": (of(component("a", Y, bindings=values(("k", 'Real value="1"')).replace("<ssd:ParameterBinding>", '<ssd:ParameterBinding source="p.ssv">'))), "has a source, 'p.ssv', and content as well"),
    "two names of one variable": (of(component("a", Y, source="resources/alias.fmu", bindings=values(("k", 'Real value="1"'), ("k2", 'Real value="2"')))), "are one variable in the FMU"),
    "force and strip of a pantograph left open": (of(FORCE), "pantograph and line need each other"),
    "files outside the scenario": (of(component("a", Y, source="../panel.fmu")), "does not lie inside the scenario"),
    "types that SSP 2.0 added": (of(A.replace("Real", "Float32"), version="2.0"), "ssc:Float32"),
}  # fmt: skip


def test_every_row_has_its_case():
    assert sorted(rows("honoured")) == sorted(HONOURED)
    assert sorted(rows("refused")) == sorted(REFUSED)


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return compile_library(tmp_path_factory.mktemp("doc"))


@pytest.fixture
def folder(tmp_path, library):
    found = tmp_path / "doc.ssp"
    own = description()
    fmus = {
        "panel": own,
        "other": description(items=(("off", 0), ("low", 1), ("high", 2))),
        "calculated": own.replace('name="k" valueReference="1" causality="parameter"', 'name="c" valueReference="1" causality="calculatedParameter" initial="exact"'),
        "alias": own.replace('<ScalarVariable name="y"', '<ScalarVariable name="k2" valueReference="1" causality="parameter" variability="fixed"><Real start="1"/></ScalarVariable><ScalarVariable name="y"'),
        "pantograph": own.replace('name="u"', 'name="contact.force"').replace('name="y"', 'name="A.z"'),
    }  # fmt: skip
    for name, text in fmus.items():
        write_fmu(found / "resources" / f"{name}.fmu", library, text)
    return found


def opened(folder, text):
    (folder / "SystemStructure.ssd").write_text(text)
    with open_scenario(folder, Overrides(), build=False) as scenario:
        return scenario.system


@pytest.mark.parametrize("row", sorted(HONOURED))
def test_what_is_honoured(folder, row):
    text, wanted = HONOURED[row]
    system = opened(folder, text)
    if isinstance(wanted, dict):
        assert {c.name: c.parameters for c in system.components} == wanted
        return
    found = [(f"{c.source}.{c.output}", f"{c.target}.{c.input}", c.conversion.factor) for c in system.connections]
    assert found == [(*w, 1.0)[:3] for w in wanted]


@pytest.mark.parametrize("row", sorted(REFUSED))
def test_what_is_refused(folder, row):
    text, reason = REFUSED[row]
    with pytest.raises(ScenarioError) as caught:
        opened(folder, text)
    reported = [str(p) for p in caught.value.problems]
    assert any(reason in p for p in reported), reported
    assert all(re.match(r"SystemStructure\.ssd:\d+: ", p) for p in reported), reported
