"""Nested systems, their connectors, mappings, units and version 2.0: what others write runs like our flat scenarios."""

from __future__ import annotations

import re

import pytest

from master.errors import ScenarioError
from master.run_session import connected_fmus, run
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from master.ssp.ssp_units import Conversion

FORCE = "catenary.pantograph[1].contact.force"
INPUT = '<ssd:Connector name="{}" kind="input"><ssc:Real{}/></ssd:Connector>'
OUTPUT = '<ssd:Connector name="{}" kind="output"><ssc:Real{}/></ssd:Connector>'
WIRE = '<ssd:Connection startElement="{}" startConnector="{}" endElement="{}" endConnector="{}"{}'
ENDS = [f"{end}.{kind}{axis}" for end in "AB" for kind in ("", "v") for axis in "xyz"]
POINT = [f"contact.{n}" for n in ("force", "x", "y", "z")]

#: What the toy pantograph passes in 0.2 s.
PASSED = '<panto:Interval start="2" end="9"/>'


def nest(text, attribute="", body="/>", before=""):
    """The toy scenario with its pantograph in a system ``train``, in a system ``consist``.

    ``attribute`` is that of the inner system's connectors, ``body`` the rest of the connections inside of it.
    """
    start = text.index('<ssd:Component name="pantograph"')
    end = text.index("</ssd:Component>", start) + len("</ssd:Component>")
    component = text[start:end]

    def connectors(unit):
        outputs = [OUTPUT.format(n, unit) for n in ENDS]
        return f"<ssd:Connectors>{''.join(outputs + [INPUT.format(n, unit) for n in POINT])}</ssd:Connectors>"

    def system(name, inner, element, unit, body, bindings=""):
        out = [WIRE.format(element, n, "", n, body) for n in ENDS]
        into = [WIRE.format("", n, element, n, body) for n in POINT]
        wires = "".join(out + into).replace(' startElement=""', "").replace(' endElement=""', "")
        if "LinearTransformation" in body:  # what goes out is doubled, what comes in is halved
            wires = wires.replace("FACTOR", "2", len(ENDS)).replace("FACTOR", "0.5")
        return (
            f'<ssd:System name="{name}">{connectors(unit)}{bindings}<ssd:Elements>{inner}</ssd:Elements>'
            f"<ssd:Connections>{wires}</ssd:Connections></ssd:System>"
        )

    inner = system("train", component, "pantograph", attribute, body, before)
    outer = system("consist", inner, "train", attribute, "/>")
    return (text[:start] + outer + text[end:]).replace(*_outside(text))


def _outside(text):
    """The connections of the whole system, to its element ``consist`` instead of the pantograph."""
    wires = re.search(r"<ssd:Connections>\s.*?</ssd:Connections>", text, re.DOTALL)[0]
    return wires, wires.replace('Element="pantograph"', 'Element="consist"')


def force(folder, out):
    with open_scenario(folder, build=False) as scenario:
        return run(scenario.system, out).recordings[0][FORCE]


@pytest.fixture
def flat(toy, toy_text, tmp_path):
    (toy / "SystemStructure.ssd").write_text(toy_text(PASSED, stop="0.2"))
    return force(toy, tmp_path / "flat").tolist()


def rewrite(toy, text):
    (toy / "SystemStructure.ssd").write_text(text)
    return toy


def problems(folder):
    with pytest.raises(ScenarioError) as caught, open_scenario(folder, build=False):
        pass
    return [str(p) for p in caught.value.problems]


def test_nested_systems_give_the_same_numbers(toy, toy_text, flat, tmp_path):
    rewrite(toy, nest(toy_text(PASSED, stop="0.2")))
    assert force(toy, tmp_path / "nested").tolist() == flat
    with open_scenario(toy, build=False) as scenario:
        assert [c.name for c in scenario.system.components] == ["catenary", "consist.train.pantograph"]
        assert scenario.system.components[1].parameters == {"static_force": 140.0, "ripple": 20.0}


def test_transformations_on_the_way_are_applied_in_turn(toy, toy_text, flat, tmp_path):
    """What leaves the train is doubled: halved again outside, it is the same."""
    twice = '><ssc:LinearTransformation factor="FACTOR"/></ssd:Connection>'
    text = nest(toy_text(PASSED, stop="0.2"), body=twice)
    whole, wires = text, re.search(r"<ssd:Connections>\s.*</ssd:Connections>", text, re.DOTALL)[0]
    half, double = (f'><ssc:LinearTransformation factor="{f}"/></ssd:Connection>' for f in ("0.5", "2"))
    lines = wires.splitlines()
    changed = [
        line.replace("/>", half if 'startElement="consist"' in line else double)
        if line.startswith("<ssd:Connection ") and "consist" in line
        else line
        for line in lines
    ]
    rewrite(toy, whole.replace(wires, "\n".join(changed)))
    with open_scenario(toy, build=False) as scenario:
        assert {c.conversion for c in scenario.system.connections} == {Conversion()}
    assert force(toy, tmp_path / "out").tolist() == flat


def test_bindings_of_systems_reach_inside_and_the_outer_one_counts(toy, toy_text):
    value = (
        '<ssd:ParameterBindings><ssd:ParameterBinding prefix="{}"><ssd:ParameterValues><ssv:ParameterSet '
        'version="1.0" name="p"><ssv:Parameters><ssv:Parameter name="{}"><ssv:Real value="{}"/></ssv:Parameter>'
        "</ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>"
    )
    text = toy_text().replace(
        "xmlns:ssd=", 'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" xmlns:ssd=', 1
    )
    inner = nest(text, before=value.format("pantograph.", "static_force", "111"))
    rewrite(toy, inner)
    with open_scenario(toy, build=False) as scenario:
        assert scenario.system.components[1].parameters == {"static_force": 111.0, "ripple": 20.0}
    outer = value.format("consist.train.", "pantograph.static_force", "222")
    rewrite(toy, inner.replace('<ssd:System name="toy">', f'<ssd:System name="toy">{outer}'))
    with open_scenario(toy, build=False) as scenario:
        assert scenario.system.components[1].parameters["static_force"] == 222.0


MAPPING = """<?xml version="1.0" encoding="UTF-8"?>
<ssm:ParameterMapping xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"
    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" version="1.0">
  <ssm:MappingEntry source="static_force" target="static_force">
    <ssc:LinearTransformation factor="0.5" offset="10"/>
  </ssm:MappingEntry>
  <ssm:MappingEntry source="{}" target="speed"/>
</ssm:ParameterMapping>
"""
BINDING = '<ssd:ParameterBinding source="parameters.ssv"/>'
MAPPED = f'{BINDING[:-2]}><ssd:ParameterMapping source="m.ssm"/></ssd:ParameterBinding>'


def test_a_mapping_renames_and_transforms_and_leaves_out_the_rest(toy, toy_text):
    (toy / "m.ssm").write_text(MAPPING.format("ripple"))
    rewrite(toy, toy_text().replace(BINDING, MAPPED))
    with open_scenario(toy, build=False) as scenario:
        assert scenario.system.components[1].parameters == {"static_force": 80.0, "speed": 20.0}


def test_an_inline_mapping_after_a_prefix(toy, toy_text):
    inline = (
        '<ssd:ParameterMapping><ssm:ParameterMapping xmlns:ssm="http://ssp-standard.org/SSP1/'
        'SystemStructureParameterMapping" version="1.0"><ssm:MappingEntry source="x.ripple" target="ripple"/>'
        "</ssm:ParameterMapping></ssd:ParameterMapping>"
    )
    rewrite(toy, toy_text().replace(BINDING, f'{BINDING[:-2]} prefix="x.">{inline}</ssd:ParameterBinding>'))
    with open_scenario(toy, build=False) as scenario:
        assert scenario.system.components[1].parameters == {"ripple": 20.0}


def test_mistakes_in_a_mapping_are_found_with_file_and_line(toy, toy_text):
    (toy / "m.ssm").write_text(MAPPING.format("mass"))
    rewrite(toy, toy_text().replace(BINDING, MAPPED))
    with open_scenario(toy, build=False) as scenario:
        reported = "m.ssm:7: the parameter set holds no 'mass': nothing is set for 'speed' [mapping]"
        assert scenario.system.warnings == (reported,)
    (toy / "m.ssm").write_text(re.sub('.*"{}".*\n', "", MAPPING))
    with open_scenario(toy, Overrides(strict=True), build=False) as scenario:  # a note is not even strictly a mistake
        reported = "m.ssm:4: the mapping names no 'ripple' of the parameter set: not used [note]"
        assert scenario.system.warnings == (reported,)
    (toy / "m.ssm").write_text(MAPPING.format("ripple").replace('target="speed"', 'target="static_force"'))
    assert problems(toy) == ["m.ssm:7: 'static_force' is the target of two entries; remove one [mapping]"]


def test_version_2_with_what_1_had(toy, toy_text, flat, tmp_path):
    text = nest(toy_text(PASSED, stop="0.2")).replace('version="1.0" name="toy"', 'version="2.0" name="toy"')
    rewrite(toy, text)
    ssv = toy / "parameters.ssv"
    ssv.write_text(ssv.read_text().replace('version="1.0" name=', 'version="2.0" name='))
    assert force(toy, tmp_path / "second").tolist() == flat


def test_what_version_2_adds_is_refused_with_its_line(toy, toy_text):
    text = toy_text().replace('version="1.0" name="toy"', 'version="2.0" name="toy"')
    text = text.replace('name="A.x" kind="output"><ssc:Real/>', 'name="A.x" kind="output"><ssc:Float32/>')
    rewrite(toy, text)
    found = problems(toy)
    line = 1 + text[: text.index("ssc:Float32")].count("\n")
    assert any(f"SystemStructure.ssd:{line}:" in p and "ssc:Float32" in p for p in found)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ('startElement="pantograph" startConnector="A.x" endConnector="A.x"', "", "declared but not connected"),
        ('startElement="pantograph" startConnector="A.x" endConnector="A.x"',
         'startElement="pantograph" startConnector="A.x" endConnector="nix"', "the system has no connector 'nix'"),
        ('startElement="pantograph" startConnector="A.x" endConnector="A.x"',
         'startConnector="contact.x" endConnector="contact.y"', "both give values"),
        ('startConnector="contact.x" endElement="pantograph"',
         'startConnector="contact.x" endElement="driver"', "'driver' has no connector 'contact.x'"),
    ],
)  # fmt: skip
def test_mistakes_in_nested_systems_are_found(toy, toy_text, old, new, text):
    nested = nest(toy_text())
    assert old in nested
    wire = f"<ssd:Connection {old}" if not new else old
    rest = nested[nested.index(wire) :]
    whole = rest[: rest.index("/>") + 2] if not new else old
    rewrite(toy, nested.replace(whole, new, 1))
    assert any(text in p for p in problems(toy)), problems(toy)


def test_a_pantograph_is_not_fed_from_outside(toy, toy_text):
    """Nothing feeds the whole system's own inputs, which no contact can do with."""
    text = toy_text().replace(
        '<ssd:System name="toy">',
        f'<ssd:System name="toy"><ssd:Connectors>{INPUT.format("wind", "")}</ssd:Connectors>',
    )
    wire = WIRE.format("catenary", "pantograph[1].contact.x", "pantograph", "contact.x", "/>")
    assert wire in text
    rewrite(
        toy,
        text.replace(wire, '<ssd:Connection startConnector="wind" endElement="pantograph" endConnector="contact.x"/>'),
    )
    found = problems(toy)
    assert ["input 'pantograph.contact.x' is declared but not connected" in p for p in found] == [True]


def test_validate_lists_all_problems_at_once(toy, toy_text, capsys):
    from master.commands.main import main

    text = nest(toy_text()).replace('endConnector="A.y"', 'endConnector="nix"', 1)
    text = text.replace('stopTime="1.0"', 'stopTime="-1"').replace(BINDING, MAPPED)
    (toy / "m.ssm").write_text(MAPPING.format("ripple").replace('target="speed"', 'target="static_force"'))
    rewrite(toy, text)
    assert main(["validate", str(toy), "--no-build"]) == 1
    said = capsys.readouterr().err
    assert all(rule in said for rule in ("[connection]", "[stop]", "[mapping]"))


def test_unused_root_outputs_do_no_harm(toy, toy_text, flat, tmp_path):
    text = toy_text(PASSED, stop="0.2").replace(
        '<ssd:System name="toy">', f'<ssd:System name="toy"><ssd:Connectors>{OUTPUT.format("f", "")}</ssd:Connectors>'
    )
    wire = '<ssd:Connection startElement="catenary" startConnector="pantograph[1].contact.force" endConnector="f"/>'
    rewrite(toy, text.replace("</ssd:Connections>", f"{wire}</ssd:Connections>"))
    assert force(toy, tmp_path / "out").tolist() == flat
    with open_scenario(toy, build=False) as scenario, connected_fmus(scenario.system) as network:
        assert len(network.input_names) == 16
