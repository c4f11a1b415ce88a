"""Systems as others write them: what is accepted gives the values it must, what is not is reported once, with its place."""

# ruff: noqa: E501 (XML, a thing a line)

from __future__ import annotations

import fmpy
import numpy as np
import pytest

from master.commands.main import main
from master.coupling.coupling_schemes import make_algorithm
from master.coupling.macro_steps import TimeGrid, simulate
from master.errors import RequestError, SlaveError
from master.fmu.isolation.isolated_instance import Isolation
from master.fmu.typed_values import TEXTS
from master.run_session import RunOptions, connected_fmus
from tests.foreign_fmus import (
    binding,
    component,
    connector,
    connectors,
    description,
    opened,
    parameters,
    problems,
    ran,
    ssd,
    system,
    values,
    wire,
    write_fmu,
)  # fmt: skip

U, K, Y = connector("u", "input"), connector("k", "parameter"), connector("y", "output")
T, X = connector("t", "output"), connector("x", "output")
BASE = '<ssc:Unit name="{}"><ssc:BaseUnit {}/></ssc:Unit>'


def exchanged(system):
    """The outputs of a system after its run, by name."""
    with connected_fmus(system) as network:
        grid = TimeGrid(system.start, system.step, system.step_count)
        outcome = simulate(network, make_algorithm(system.settings.coupling), grid)
        assert outcome.error is None
        return dict(zip(network.output_names, network.outputs.tolist(), strict=True))


# What nothing feeds.


def test_an_input_that_is_not_connected_keeps_the_start_value_of_its_fmu(scenario, tmp_path):
    folder = scenario(ssd(system(component("a", U, Y, bindings=values(("k", 'Real value="3"'))))))
    warnings = opened(folder).warnings
    assert len(warnings) == 1
    assert "input 'a.u' is declared but not connected; it keeps its start value 0.5 of the FMU" in warnings[0]
    assert warnings[0].startswith("SystemStructure.ssd:3:")
    assert ran(folder, tmp_path)["a.y"].tolist() == [1.5] * 11
    assert problems(folder, strict=True) == list(warnings)


def test_or_that_of_the_scenario(scenario, tmp_path):
    folder = scenario(
        ssd(system(component("a", U, Y, bindings=values(("u", 'Real value="2"'), ("k", 'Real value="3"')))))
    )
    assert "keeps its start value 2.0 of the scenario" in opened(folder).warnings[0]
    assert ran(folder, tmp_path)["a.y"].tolist() == [6.0] * 11


def test_inputs_of_a_system_that_nothing_feeds(scenario, tmp_path):
    inner = system(component("a", U, Y), wire(".in", "a.u"), connectors(connector("in", "input")), name="inner")
    outer = system(inner, wire(".wind", "inner.in"), connectors(connector("wind", "input")))
    folder = scenario(ssd(outer))
    assert (
        "nothing feeds 'wind', an input of a system; 'inner.a.u' keeps its start value 0.5"
        in opened(folder).warnings[0]
    )
    assert len(opened(folder).warnings) == 1
    assert ran(folder, tmp_path)["inner.a.y"].tolist() == [0.5] * 11


@pytest.mark.parametrize("port", ["contact.force", "contact.z"])
def test_a_pantograph_without_its_line_is_refused(toy, toy_text, port):
    wanted = f'<ssd:Connection startElement="catenary" startConnector="pantograph[1].{port}" endElement="pantograph" endConnector="{port}"/>'
    assert wanted in toy_text()
    (toy / "SystemStructure.ssd").write_text(toy_text().replace(wanted, ""))
    found = problems(toy)
    assert len(found) == 1
    assert f"'pantograph.{port}' is declared but not connected; pantograph and line need each other" in found[0]


def test_and_a_line_without_its_strip(toy, toy_text):
    wanted = '<ssd:Connection startElement="pantograph" startConnector="A.z" endElement="catenary" endConnector="pantograph[1].A.z"/>'
    (toy / "SystemStructure.ssd").write_text(toy_text().replace(wanted, ""))
    assert ["'catenary.pantograph[1].A.z' is declared but not connected" in p for p in problems(toy)] == [True]


# Values of systems.


def fan_out(bound, inner=""):
    own = connectors(connector("gain", "parameter"), connector("level", "input"))
    both = component("a", U, K, Y, bindings=values(("k", 'Real value="9"'))) + component("b", U, K, Y)
    wires = wire(".gain", "a.k") + wire(".gain", "b.k", '<ssc:LinearTransformation factor="2" offset="1"/>')
    wires += wire(".level", "a.u") + wire(".level", "b.u")
    nested = system(both, wires, own, inner, name="pair")
    return system(nested, wire(".g", "pair.gain"), connectors(connector("g", "parameter")), bound)


def test_parameters_of_systems_fan_out(scenario, tmp_path):
    bound = values(("g", 'Real value="5"'), ("pair.level", 'Real value="2"'))
    found = ran(scenario(ssd(fan_out(bound))), tmp_path)
    assert found["pair.a.y"][-1] == 2 * 5
    assert found["pair.b.y"][-1] == 2 * (2 * 5 + 1)


def test_the_outermost_connector_with_a_value_counts(scenario):
    inner = values(("gain", 'Real value="3"'), ("level", 'Real value="4"'))
    components = opened(scenario(ssd(fan_out("", inner)))).components
    assert [c.parameters["k"] for c in components] == [3.0, 7.0]
    outer = values(("g", 'Real value="5"'), ("pair.level", 'Real value="6"'))
    components = opened(scenario(ssd(fan_out(outer, inner)))).components
    assert [c.parameters for c in components] == [{"k": 5.0, "u": 6.0}, {"k": 11.0, "u": 6.0}]


def test_a_value_goes_through_the_units_of_the_connectors(scenario):
    own = connectors(connector("speed", "input", 'Real unit="km/h"'))
    text = system(component("a", U), wire(".speed", "a.u"), own, values(("speed", 'Real value="36000" unit="m/h"')))
    unit = BASE.format("m/h", 'm="1" s="-1" factor="0.000277777777777778"')
    folder = scenario(ssd(text, f"<ssd:Units>{unit}</ssd:Units>"), panel=description(("m/s", "")))
    assert opened(folder).components[0].parameters["u"] == pytest.approx(10.0, rel=1e-12)


def test_conversions_on_the_way_are_applied_in_turn(scenario):
    """4 kN by a mapping 2 x + 10 N, then to mN, 3 x + 5 mN, to N and half of it and 1 N more: by hand."""
    linear = '<ssc:LinearTransformation factor="{}" offset="{}"/>'
    inner = system(component("a", U, connector("k", "parameter", 'Real unit="N"')), wire(".k", "a.k", linear.format(0.5, 1)),
                   connectors(connector("k", "parameter", 'Real unit="mN"')), name="inner")  # fmt: skip
    mapping = f'<ssd:ParameterMapping><ssm:ParameterMapping version="1.0"><ssm:MappingEntry source="s" target="g">{linear.format(2, 10)}</ssm:MappingEntry></ssm:ParameterMapping></ssd:ParameterMapping>'
    outer = system(inner, wire(".g", "inner.k", linear.format(3, 5)), connectors(connector("g", "parameter", 'Real unit="N"')),
                   values(("s", 'Real value="4" unit="kN"'), mapping=mapping))  # fmt: skip
    units = f"<ssd:Units>{BASE.format('mN', 'kg=' + chr(34) + '1' + chr(34) + ' m=' + chr(34) + '1' + chr(34) + ' s=' + chr(34) + '-2' + chr(34) + ' factor=' + chr(34) + '0.001' + chr(34))}</ssd:Units>"
    folder = scenario(ssd(outer, units))
    millinewton = 3 * 1000 * (2 * 4000 + 10) + 5
    assert opened(folder).components[0].parameters["k"] == pytest.approx(0.5 * (millinewton / 1000) + 1, rel=1e-12)
    for leg in ("", ' suppressUnitConversion="true"'):
        stated = ssd(
            outer.replace(
                'endConnector="k"><ssc:LinearTransformation factor="0.5"',
                f'endConnector="k"{leg}><ssc:LinearTransformation factor="0.5"',
            ),
            units,
        )
        scale = 1 if leg else 1000
        assert opened(scenario(stated)).components[0].parameters["k"] == pytest.approx(
            0.5 * (millinewton / scale) + 1, rel=1e-12
        )


@pytest.mark.parametrize(("kind", "end"), [("parameter", "k"), ("input", "u")])
def test_two_connectors_of_systems_do_not_lead_to_one_place(scenario, kind, end):
    own = connectors(connector("v", kind), connector("w", kind))
    bound = values(("v", 'Real value="2"'), ("w", 'Real value="3"'))
    wires = wire(".v", f"a.{end}") + wire(".w", f"a.{end}")
    found = problems(scenario(ssd(system(component("a", U, K), wires, own, bound))))
    assert [f"{kind} 'a.{end}' has 2 connections; one is allowed" in p for p in found] == [True]


def test_a_unit_that_does_not_fit_is_told_once(scenario):
    inner = system(component("a", U) + component("b", U), wire(".v", "a.u") + wire(".v", "b.u"),
                   connectors(connector("v", "input", 'Real unit="m"')), name="inner")  # fmt: skip
    outer = system(component("c", connector("y", "output", 'Real unit="N"')) + inner, wire("c.y", "inner.v"))
    found = problems(scenario(ssd(outer)))
    assert ["'N' and 'm' do not measure the same thing" in p for p in found] == [True]


def test_values_that_reach_nothing_are_told(scenario):
    own = connectors(connector("idle", "parameter"), connector("out", "output"))
    bound = values(("idle", 'Real value="1"'), ("out", 'Real value="1"'))
    warnings = opened(scenario(ssd(system(component("a", Y), wire("a.y", ".out"), own, bound)))).warnings
    assert any("'idle' is a connector that leads to no component" in w for w in warnings)
    assert any("'out' is of kind 'output', which gives values" in w for w in warnings)
    nobody = values(("nobody.k", 'Real value="1"'))
    assert "'nobody.k' belongs to no component" in problems(scenario(ssd(system(component("a", Y), "", "", nobody))))[0]


# Types.


def pair(kind, source, target, bound, what=None, rest="", **others):
    what = what or kind
    elements = component("a", connector(target, "input", what), connector(source, "output", what), bindings=bound)
    elements += component("b", connector(target, "input", what), connector(source, "output", what),
                          source="resources/other.fmu" if "other" in others else "resources/panel.fmu")  # fmt: skip
    return ssd(system(elements, wire(f"a.{source}", f"b.{target}")), rest)


def test_integers_are_exchanged(scenario, tmp_path):
    bound = values(("i_in", 'Integer value="-2147483648"'), ("i_set", 'Integer value="7"'))
    folder = scenario(pair("Integer", "i_out", "i_in", bound))
    found = ran(folder, tmp_path)
    assert found["b.i_out"][-1] == found["a.i_out"][-1] == -(2**31) + 7


def test_booleans_are_exchanged(scenario, tmp_path):
    found = ran(scenario(pair("Boolean", "b_out", "b_in", values(("b_in", 'Boolean value="true"')))), tmp_path)
    assert (found["a.b_out"][-1], found["b.b_out"][-1]) == (0.0, 1.0)


def test_texts_are_exchanged(scenario, tmp_path):
    folder = scenario(pair("String", "s_out", "s_in", values(("s_in", 'String value="Fahrdraht \u00fc"'))))
    found = exchanged(opened(folder))
    assert TEXTS.text(found["a.s_out"]).decode() == "Fahrdraht \u00fc"
    with connected_fmus(opened(folder)) as network:
        simulate(network, make_algorithm(opened(folder).settings.coupling), TimeGrid(0.0, 0.1, 3))
        assert TEXTS.text(network.inputs[0]).decode() == "Fahrdraht \u00fc"
    assert "a.s_out" not in ran(folder, tmp_path)
    with pytest.raises(SlaveError, match="between processes only numbers are exchanged"):
        ran(folder, tmp_path, RunOptions(isolation=Isolation()))
    with pytest.raises(RequestError, match=r"'a\.s_out' is a text"):
        ran(folder, tmp_path, RunOptions(checkpoint=0.5))


SPEED = '<ssc:Enumeration name="Speed">{}</ssc:Enumeration>'
ITEM = '<ssc:Item name="{}" value="{}"/>'
DECLARED = f"<ssd:Enumerations>{SPEED.format(''.join(ITEM.format(n, v) for n, v in (('off', 1), ('low', 2), ('high', 3))))}</ssd:Enumerations>"


@pytest.mark.parametrize(
    "value", ['Enumeration value="high" name="Speed"', 'Enumeration value="high"', 'Integer value="3"']
)
def test_enumerations_are_exchanged(scenario, tmp_path, value):
    text = pair("Enumeration", "e_out", "e_in", values(("e_in", value)), 'Enumeration name="Speed"', DECLARED)
    assert ran(scenario(text), tmp_path)["b.e_out"][-1] == 3.0


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (
            'Enumeration value="full" name="Speed"',
            "'full' is no item of enumeration 'Speed' (off = 1, low = 2, high = 3)",
        ),
        ('Enumeration value="full"', "'full' is no item of the FMU's type"),
        ('Enumeration value="high" name="Gear"', "enumeration 'Gear' is declared nowhere"),
        ('Integer value="4"', "= 4 is no item of its type"),
    ],
)
def test_items_that_are_none_are_refused(scenario, value, text):
    stated = pair("Enumeration", "e_out", "e_in", values(("e_in", value)), 'Enumeration name="Speed"', DECLARED)
    found = problems(scenario(stated))
    assert len(found) == 1
    assert text in found[0]


def test_enumerations_with_other_items_are_not_connected(scenario):
    text = pair("Enumeration", "e_out", "e_in", "", 'Enumeration name="Speed"', DECLARED, other=True)
    found = problems(scenario(text, other=description(items=(("off", 0), ("low", 1), ("high", 2)))))
    stated = "has the items off = 1, low = 2, high = 3, the FMU's type off = 0, low = 1, high = 2"
    assert [stated in p for p in found] == [True, True]  # b's two connectors
    bare = pair("Enumeration", "e_out", "e_in", "", other=True).replace("<ssc:Enumeration/>", "")
    found = problems(scenario(bare, other=description(items=(("off", 0), ("low", 1), ("high", 2)))))
    assert ["connected enumerations must have the same ones" in p for p in found] == [True]
    undeclared = pair("Enumeration", "e_out", "e_in", "", 'Enumeration name="Speed"')
    assert all("'Speed' is not declared in ssd:Enumerations" in p for p in problems(scenario(undeclared)))


def test_types_that_differ_are_not_connected(scenario):
    elements = component("a", connector("i_out", "output", "Integer")) + component("b", U)
    found = problems(scenario(ssd(system(elements, wire("a.i_out", "b.u")))))
    assert ["'a.i_out' is Integer and 'b.u' is Real; only variables of the same type" in p for p in found] == [True]


def test_only_real_values_are_transformed(scenario):
    elements = component("a", connector("i_out", "output", "Integer")) + component(
        "b", connector("i_in", "input", "Integer")
    )
    text = ssd(system(elements, wire("a.i_out", "b.i_in", '<ssc:LinearTransformation factor="2"/>')))
    assert ["only Real values can have a LinearTransformation" in p for p in problems(scenario(text))] == [True]


def test_all_types_isolated_and_iterated(scenario, tmp_path):
    """Between processes, and with half weights, whole numbers stay whole."""
    text = pair("Integer", "count", "i_in", values(("i_set", 'Integer value="4"')))
    text = text.replace(
        "</ssd:Connectors></ssd:Component><ssd:Component",
        f"{connector('i_out', 'output', 'Integer')}</ssd:Connectors></ssd:Component><ssd:Component",
    )
    text = text.replace(
        "</ssd:Connectors></ssd:Component></ssd:Elements>",
        f"{connector('i_out', 'output', 'Integer')}</ssd:Connectors></ssd:Component></ssd:Elements>",
    )
    plain = ran(scenario(text), tmp_path)
    isolated = ran(scenario(text), tmp_path, RunOptions(isolation=Isolation()))
    assert {n: v.tolist() for n, v in plain.items()} == {n: v.tolist() for n, v in isolated.items()}
    run_settings = '<ssd:Annotations><ssc:Annotation type="urn:openpanto:ssp"><panto:Run xmlns:panto="urn:openpanto:ssp"><panto:Coupling scheme="iterative" weight="0.5"/></panto:Run></ssc:Annotation></ssd:Annotations></ssd:SystemStructureDescription>'
    iterated = ran(scenario(text.replace("</ssd:SystemStructureDescription>", run_settings)), tmp_path)
    assert plain["b.i_out"].tolist() == [0.0, *range(10)]  # received at the beginning of a step
    assert iterated["b.i_out"].tolist() == [*range(11)]  # and at its end


# Start values of what is calculated.


def test_start_values_where_fmi_allows_them(scenario, tmp_path):
    text = ssd(system(component("a", X, bindings=values(("guess", 'Real value="7"')))))
    assert ran(scenario(text), tmp_path)["a.x"][0] == 7.0
    refused = ssd(system(component("a", X, bindings=values(("x", 'Real value="7"')))))
    found = problems(scenario(refused))
    assert "cannot be set: in the FMU it is of causality 'output' with initial='calculated'" in found[0]
    approximate = description().replace('name="x" valueReference="3" causality="output" variability="continuous"><Real/>',
        'name="x" valueReference="3" causality="output" variability="continuous" initial="approx"><Real start="0"/>')  # fmt: skip
    assert opened(scenario(refused, panel=approximate)).components[0].parameters == {"x": 7.0}


# Files.


SSV = (
    '<?xml version="1.0"?>\n<ssv:ParameterSet version="{}" name="p" xmlns:ssv="http://ssp-standard.org/SSP1/'
    'SystemStructureParameterValues" xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon">\n{}\n</ssv:ParameterSet>'
)
SSM = (
    '<?xml version="1.0"?>\n<ssm:ParameterMapping version="1.0" xmlns:ssm="http://ssp-standard.org/SSP1/'
    'SystemStructureParameterMapping" xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon">\n{}\n</ssm:ParameterMapping>'
)
BOUND = '<ssd:ParameterBindings><ssd:ParameterBinding source="{}"/></ssd:ParameterBindings>'


def mapped(source, mapping):
    return f'<ssd:ParameterBindings><ssd:ParameterBinding source="{source}"><ssd:ParameterMapping source="{mapping}"/></ssd:ParameterBinding></ssd:ParameterBindings>'


def test_sources_are_decoded(scenario, library):
    entry = '<ssm:MappingEntry source="a" target="k"/>'
    files = {
        "my values \u00fc.ssv": SSV.format("1.0", parameters(("a", 'Real value="4"'))),
        "my map.ssm": SSM.format(entry),
    }
    folder = scenario(ssd(system(component("a", Y, source="resources/my%20FMU%231.fmu",
        bindings=mapped("my%20values%20%C3%BC.ssv", "my%20map.ssm")))), files)  # fmt: skip
    write_fmu(folder / "resources" / "my FMU#1.fmu", library, description())
    assert opened(folder).components[0].parameters == {"k": 4.0}


@pytest.mark.parametrize("source", ["..%2Fshared%2Fpanel.fmu", "../shared/panel.fmu", "FILE"])
def test_folders_outside_need_leave(scenario, library, tmp_path, source):
    shared = write_fmu(tmp_path / "shared" / "panel.fmu", library, description())
    source = shared.as_uri() if source == "FILE" else source
    folder = scenario(ssd(system(component("a", Y, source=source))))
    found = problems(folder)
    assert len(found) == 1
    assert "does not lie inside the scenario; --allow-outside DIR allows" in found[0]
    assert problems(folder, outside=(tmp_path / "elsewhere",)) == found
    assert opened(folder, outside=(tmp_path / "shared",)).components[0].fmu.path == shared
    assert main(["validate", str(folder), "--no-build", "--allow-outside", str(tmp_path / "shared")]) == 0


def test_a_link_does_not_lead_outside(scenario, library, tmp_path):
    shared = write_fmu(tmp_path / "shared" / "panel.fmu", library, description())
    folder = scenario(ssd(system(component("a", Y, source="resources/link.fmu"))))
    (folder / "resources/link.fmu").symlink_to(shared)
    assert "does not lie inside" in problems(folder)[0]


def test_empty_and_absent_sources_of_a_mapping_are_one_warning(scenario):
    entries = [
        '<ssm:MappingEntry source="a" target="k"><ssc:LinearTransformation factor="2" offset="-1"/></ssm:MappingEntry>'
    ]
    entries += ['<ssm:MappingEntry source="" target="u"/>', '<ssm:MappingEntry source="nothing" target="guess"/>']
    files = {"p.ssv": SSV.format("1.0", parameters(("a", 'Real value="4"'))), "m.ssm": SSM.format("\n".join(entries))}
    folder = scenario(ssd(system(component("a", Y, bindings=mapped("p.ssv", "m.ssm")))), files)
    found = opened(folder)
    assert found.components[0].parameters == {"k": 7.0}
    assert found.warnings == (
        "m.ssm:4: the parameter set holds no '', 'nothing': nothing is set for 'u', 'guess' [mapping]",
    )


def test_a_bad_name_is_told_where_it_is_written(scenario):
    files = {
        "p.ssv": SSV.format("1.0", parameters(("a", 'Real value="4"'))),
        "m.ssm": SSM.format('\n<ssm:MappingEntry source="a" target="nix"/>'),
    }
    folder = scenario(ssd(system(component("a", Y, bindings=mapped("p.ssv", "m.ssm")))), files)
    assert problems(folder) == [
        "m.ssm:4: parameter 'a.nix': the FMU resources/panel.fmu has no such variable [parameter]"
    ]


def test_a_unit_of_an_fmu_is_not_declared_otherwise(scenario):
    own = '<Unit name="fur"><BaseUnit m="1" factor="201.168"/></Unit>'
    unit = f"<ssd:Units>{BASE.format('fur', 'm=' + chr(34) + '1' + chr(34))}</ssd:Units>"
    found = problems(scenario(ssd(system(component("a", Y)), unit), panel=description(("", "fur"), own)))
    assert len(found) == 1
    assert "'fur' is declared with factor 1 here, with factor 201.168 in panel.fmu (modelDescription.xml)" in found[0]


def test_a_bad_unit_is_told_where_it_is_written(scenario):
    files = {"p.ssv": SSV.format("1.0", parameters(("u", 'Real value="4" unit="furlong"')))}
    folder = scenario(
        ssd(system(component("a", Y, bindings=BOUND.format("p.ssv")))), files, panel=description(("m", ""))
    )
    (said,) = problems(folder)
    assert said.startswith("p.ssv:3: parameter 'a.u': unit 'furlong' is not declared in the ssv:Units of this file")
    assert "(known without it: 1, %, m, mm" in said
    assert said.endswith("[unit]")


def test_an_unknown_unit_is_told_once(scenario):
    elements = "\n".join(component(n, connector("u", "input", 'Real unit="furlong"'), Y) for n in "abc")
    folder = scenario(ssd(system(elements, wire("a.y", "b.u") + wire("b.y", "c.u"))), panel=description(("m", "m")))
    assert len(problems(folder)) == 1


@pytest.mark.parametrize(
    ("first", "second", "text"),
    [
        ('kg="1" m="1" s="-2" factor="1000"', 'kg="1" m="1" s="-2" factor="1"', "factor 1 here, with factor 1000 in"),
        ('kg="1" m="1" s="-2" factor="1000"', 'm="1"', "measures something else in"),
        (None, 'kg="1" m="1" s="-2" factor="1"', "everywhere else it has factor 1000"),
    ],
)
def test_a_unit_has_one_meaning(scenario, first, second, text):
    declared = f"<ssd:Units>{BASE.format('kN', first)}</ssd:Units>" if first else ""
    units = f"<ssv:Units>{BASE.format('kN', second)}</ssv:Units>"
    files = {"p.ssv": SSV.format("1.0", parameters(("u", 'Real value="4" unit="kN"')) + units)}
    folder = scenario(ssd(system(component("a", U, Y, bindings=BOUND.format("p.ssv"))), declared), files)
    found = problems(folder)
    assert len(found) == 1
    assert found[0].startswith("p.ssv:3: unit 'kN'")
    assert text in found[0]


def test_the_same_unit_written_twice_is_none(scenario):
    kmh = (BASE.format("km/h", f'm="1" s="-1" factor="{f}"') for f in ("0.27777777777777778", "0.277778"))
    first, second = kmh
    files = {
        "p.ssv": SSV.format(
            "1.0", parameters(("u", 'Real value="36" unit="km/h"')) + f"<ssv:Units>{second}</ssv:Units>"
        )
    }
    stated = ssd(system(component("a", U, Y, bindings=BOUND.format("p.ssv"))), f"<ssd:Units>{first}</ssd:Units>")
    assert opened(scenario(stated, files, panel=description(("m/s", "")))).components[0].parameters[
        "u"
    ] == pytest.approx(10, rel=1e-5)


def test_units_that_only_an_fmu_defines_are_known(scenario):
    own = '<Unit name="furlong"><BaseUnit m="1" factor="201.168"/></Unit>'
    elements = component("a", Y) + component("b", U, source="resources/other.fmu")
    folder = scenario(
        ssd(system(elements, wire("a.y", "b.u"))), panel=description(("", "furlong"), own), other=description(("m", ""))
    )
    assert opened(folder).connections[0].conversion(1.0) == 201.168


def test_inline_sets_are_held_to_the_schema(scenario):
    twice = '<ssv:Parameter name="k"><ssv:Real value="1"/><ssv:Real value="2"/></ssv:Parameter>'
    stated = values(("u", 'Real value="1"')).replace("</ssv:Parameters>", f"{twice}</ssv:Parameters>")
    found = problems(scenario(ssd(system(component("a", U, Y, bindings=stated)))))
    assert len(found) == 1
    assert found[0].endswith("[schema]")
    again = values(("k", 'Real value="1"'), ("k", 'Real value="2"'))
    assert [
        "parameter 'k' is there twice" in p for p in problems(scenario(ssd(system(component("a", Y, bindings=again)))))
    ] == [True]


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("urn:openpanto:SSP", "an annotation of type 'urn:openpanto:SSP'"),
        ("com.example", "an annotation of type 'com.example'"),
    ],
)
def test_our_settings_in_an_annotation_of_another_type_are_told(scenario, name, written):
    ours = f'<ssd:Annotations><ssc:Annotation type="{name}"><panto:Run xmlns:panto="urn:openpanto:ssp"><panto:Coupling scheme="iterative"/></panto:Run></ssc:Annotation></ssd:Annotations>'
    text = ssd(system(component("a", Y))).replace(
        "</ssd:SystemStructureDescription>", f"{ours}</ssd:SystemStructureDescription>"
    )
    found = problems(scenario(text))
    assert len(found) == 1
    assert f"Run of urn:openpanto:ssp stands in {written}" in found[0]


@pytest.mark.parametrize(
    "change",
    [
        ("<ssd:System ", "<ssd:Sistem "), ('version="1.0" name="foreign"', 'version="3.0" name="foreign"'),
        ('stopTime="1"', 'stopTime="soon"'), ('source="resources/panel.fmu"', 'source="resources/none.fmu"'),
        ('name="y" kind="output"', 'name="y" kind="parameter"'), ('<ssc:Real/></ssd:Connector></ssd:Connectors></ssd:Component><ssd:Component name="b"',
         '<ssc:Integer/></ssd:Connector></ssd:Connectors></ssd:Component><ssd:Component name="b"'),
        ('value="3"', 'value="three"'), ('<ssd:Component name="b"', '<ssd:Component name="a" source="resources/panel.fmu"/><ssd:Component name="b"'),
    ],
)  # fmt: skip
def test_one_mistake_is_one_message(scenario, change):
    elements = component("a", Y) + component("b", U, Y, bindings=values(("k", 'Real value="3"')))
    text = ssd(system(elements, wire("a.y", "b.u")))
    assert change[0] in text
    assert opened(scenario(text)).warnings == ()
    assert len(problems(scenario(text.replace(change[0], change[1], 1)))) == 1, problems(
        scenario(text.replace(*change, 1))
    )


# Version 2.0.


def test_types_of_version_2_under_their_new_names(scenario, tmp_path):
    whole = connector("i_in", "input", "Int32"), connector("i_out", "output", "Int32")
    elements = component("a", connector("y", "output", "Float64"), *whole, bindings=BOUND.format("p.ssv"))
    elements += component("b", connector("u", "input", "Float64"), connector("i_in", "input", "Int32"))
    meta = '<ssc:MetaData kind="general" type="text/plain" source="readme.txt"/>'
    text = ssd(system(elements, wire("a.y", "b.u") + wire("a.i_out", "b.i_in")), version="2.0")
    text = text.replace("<ssd:System ", f"{meta}<ssd:System ", 1)
    files = {"p.ssv": SSV.format("2.0", parameters(("u", 'Float64 value="4"'), ("i_set", 'Int32 value="5"')))}
    found = ran(scenario(text, files), tmp_path)
    assert (found["a.y"][-1], found["a.i_out"][-1]) == (4.0, 5.0)
    assert any("ssc:Int64" in p for p in problems(scenario(text.replace("ssc:Int32", "ssc:Int64", 1), files)))
    first = text.replace('version="2.0"', 'version="1.0"', 1).replace(meta, "")
    assert any("Float64" in p for p in problems(scenario(first, files)))


# Tolerance, step and stop.


def test_the_tolerance_of_the_default_experiment_is_passed_on(scenario, tmp_path, capsys):
    stated = connector("tolerance", "output")
    folder = scenario(ssd(system(component("a", stated))), panel=description(tolerance="1e-5"))
    assert set(ran(folder, tmp_path)["a.tolerance"]) == {1e-5}
    assert set(ran(folder, tmp_path, tolerance=1e-8)["a.tolerance"]) == {1e-8}
    assert set(ran(folder, tmp_path, RunOptions(isolation=Isolation()))["a.tolerance"]) == {1e-5}
    assert set(ran(scenario(ssd(system(component("a", stated)))), tmp_path)["a.tolerance"]) == {-1.0}
    assert main(["validate", str(folder), "--no-build", "--tolerance", "1e-7"]) == 0
    assert "tolerance 1e-07 for all FMUs" in " ".join(capsys.readouterr().out.split())


def test_validate_takes_stop_and_step(scenario, capsys):
    folder = scenario(ssd(system(component("a", Y)), stop=""))
    assert main(["validate", str(folder), "--no-build"]) == 1
    assert "give --stop" in capsys.readouterr().err
    assert main(["validate", str(folder), "--no-build", "--stop", "2", "--step", "0.5"]) == 0
    assert "0 s to 2 s in steps of 0.5 s" in capsys.readouterr().out


# A run without a pantograph.


def test_a_run_without_a_pantograph_shows_its_outputs(scenario, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    elements = component("a", T, Y) + component("b", U, X, connector("i_out", "output", "Integer"))
    folder = scenario(ssd(system(elements, wire("a.t", "b.u"))), panel=description(("m", "m")))
    assert main([str(folder), "--no-build", "--out", "out"]) == 0
    said = capsys.readouterr().out
    assert "Outputs" in said
    assert "a.t" in said
    assert "contact" not in said
    page = (tmp_path / "out" / "report.html").read_text()
    assert "<title>foreign: outputs of the run</title>" in page
    assert "pantograph-catenary" not in page
    assert "No contact-quality figures" not in page
    assert (tmp_path / "out" / "outputs1.png").is_file()


# Single FMUs.


@pytest.mark.parametrize("step", [0.1, 0.03])
def test_a_single_fmu_behaves_as_in_fmpy(scenario, tmp_path, step):
    bound = values(("k", 'Real value="3"'), ("u", 'Real value="2"'), ("guess", 'Real value="-1"'))
    folder = scenario(ssd(system(component("a", U, Y, X, T, bindings=bound))), panel=description(tolerance="1e-4"))
    ours = ran(folder, tmp_path, step=step, stop=0.9)
    theirs = fmpy.simulate_fmu(
        str(folder / "resources/panel.fmu"), stop_time=0.9, output_interval=step,
        start_values={"k": 3.0, "u": 2.0, "guess": -1.0}, output=["x", "y", "t", "tolerance"],
    )  # fmt: skip
    for name in ("x", "y", "t", "tolerance"):
        assert np.allclose(ours[f"a.{name}"], theirs[name], rtol=1e-9, atol=0.0), name
    exact = (2 / 3) - (5 / 3) * (1 - 3 * step) ** np.arange(len(theirs))
    assert ours["a.x"] == pytest.approx(exact, rel=1e-9)


def test_bindings_and_prefixes_of_a_system_still_count(scenario):
    bound = f"<ssd:ParameterBindings>{binding(('k', 'Real value=' + chr(34) + '4' + chr(34)), prefix='a.')}</ssd:ParameterBindings>"
    assert opened(scenario(ssd(system(component("a", Y), "", "", bound)))).components[0].parameters == {"k": 4.0}
