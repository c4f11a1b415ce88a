"""Reading system structure descriptions: what is honoured, and what is refused with its line."""

from pathlib import Path

import pytest

from master.ssp.archive import Sources
from master.ssp.ssd import read_structure
from master.ssp.ssp_units import Conversion
from master.ssp.ssp_xml import Reader

SCENARIOS = Path(__file__).parents[3] / "ssp_scenarios"


def read(folder, text, ssv=None):
    (folder / "SystemStructure.ssd").write_text(text)
    if ssv is not None:
        (folder / "parameters.ssv").write_text(ssv)
    reader = Reader("SystemStructure.ssd")
    return read_structure(Sources(folder), reader), reader.problems


def line_of(text, part):
    return text[: text.index(part)].count("\n") + 1


@pytest.fixture
def base(toy_text, tmp_path):
    namespace = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
    (tmp_path / "parameters.ssv").write_text(
        f'<ssv:ParameterSet xmlns:ssv="{namespace}" version="1.0" name="p"><ssv:Parameters/></ssv:ParameterSet>'
    )
    return toy_text()


def test_the_toy_is_read_without_problems(base, tmp_path):
    structure, problems = read(tmp_path, base)
    assert problems == []
    assert [c.name for c in structure.components] == ["catenary", "pantograph"]
    assert len(structure.connections) == 16
    assert (structure.start, structure.stop, structure.annotations.step) == (0.0, 1.0, 0.001)


@pytest.mark.parametrize("folder", sorted(SCENARIOS.glob("*.ssp")), ids=lambda p: p.name)
def test_our_scenarios_are_valid_against_the_official_schemas(folder):
    reader = Reader("SystemStructure.ssd")
    structure = read_structure(Sources(folder), reader)
    assert reader.problems == []
    assert structure.annotations.step == pytest.approx(1e-3)
    assert (folder / "README.md").is_file()


@pytest.mark.parametrize("folder", sorted(SCENARIOS.glob("*.ssp")), ids=lambda p: p.name)
def test_our_scenarios_keep_to_the_profile_that_other_tools_run(folder):
    structure = read_structure(Sources(folder), Reader("x"))
    names = [c.name for c in structure.components]
    assert not any(a != b and b.startswith(a) for a in names for b in names)
    assert structure.bindings == ()
    assert all(len(c.bindings) == 1 and not c.bindings[0].prefix for c in structure.components)
    assert len({c.bindings[0].parameters.name for c in structure.components}) == 1
    parameters = [p for c in structure.components for p in c.bindings[0].parameters.parameters]
    assert all(p.type != "String" for p in parameters)
    assert all(c.transformation.is_identity for c in structure.connections)
    connected = {(c.end_element, c.end_connector) for c in structure.connections}
    declared = {(c.name, x.name) for c in structure.components for x in c.connectors if x.kind == "input"}
    assert connected == declared
    assert all(x.type for c in structure.components for x in c.connectors)
    text = (folder / "SystemStructure.ssd").read_text()
    assert "<ssd:SystemStructureDescription" in text
    assert "<ssc:Real" in text
    # libcosim takes an attribute here, be it a namespace declaration, for another algorithm
    assert "<osp:Algorithm>" in text


COMPONENT = '<ssd:Component name="pantograph" source="resources/ToyPantograph.fmu">'
CONNECTION = (
    '<ssd:Connection startElement="pantograph" startConnector="A.x" '
    'endElement="catenary" endConnector="pantograph[1].A.x"/>'
)


@pytest.mark.parametrize(
    ("old", "new", "rule", "text"),
    [
        (
            "</ssd:Elements>",
            '<ssd:SignalDictionaryReference name="bus" dictionary="d"/></ssd:Elements>',
            "unsupported",
            "element 'bus' is a SignalDictionaryReference, which is not supported",
        ),
        (
            COMPONENT,
            COMPONENT[:-1] + ' type="application/x-ssp-package">',
            "unsupported",
            "'application/x-ssp-package'; only FMUs",
        ),
        (COMPONENT, COMPONENT[:-1] + ' implementation="ModelExchange">', "unsupported", "model exchange"),
        (
            CONNECTION,
            CONNECTION[:-2] + "><ssc:IntegerMappingTransformation><ssc:MapEntry source='1' target='2'/>"
            "</ssc:IntegerMappingTransformation></ssd:Connection>",
            "unsupported",
            "IntegerMappingTransformation is not supported",
        ),
        (
            '<ssd:ParameterBinding source="parameters.ssv"/>',
            '<ssd:ParameterBinding source="parameters.ssv">'
            '<ssd:ParameterMapping source="a.ssm"/></ssd:ParameterBinding>',
            "mapping",
            "mapping file 'a.ssm' does not exist",
        ),
        (
            '<ssd:ParameterBinding source="parameters.ssv"/>',
            '<ssd:ParameterBinding source="parameters.ssv" sourceBase="component"/>',
            "unsupported",
            "sourceBase='component'",
        ),
        (
            '<ssd:ParameterBinding source="parameters.ssv"/>',
            '<ssd:ParameterBinding source="../parameters.ssv"/>',
            "binding",
            "'../parameters.ssv' does not exist in the scenario",
        ),
        (
            '<ssd:ParameterBinding source="parameters.ssv"/>',
            "<ssd:ParameterBinding/>",
            "binding",
            "neither a source",
        ),
        ('stopTime="1.0"', 'stopTime="soon"', "number", "stopTime='soon' is not a finite number"),
        ('baseStepSize="0.001"', 'baseStepSize="-1"', "step", "must be greater than 0"),
        (
            '<panto:Interval start="20"',
            '<panto:Interval start="50"',
            "annotation",
            "start 50 m must lie before end 45 m",
        ),
        (
            '<panto:Interval start="20"',
            '<panto:Interval begin="20"',
            "annotation",
            "Interval has no attribute 'begin' (known: start, end, until)",
        ),
        (
            "<panto:Interval",
            '<panto:Coupling scheme="magic"/><panto:Interval',
            "annotation",
            "Coupling scheme",
        ),
        ("<panto:Interval", "<panto:Colour/><panto:Interval", "annotation", "unknown element 'Colour'"),
        (
            "<panto:Interval",
            '<panto:Interval end="3"/><panto:Interval',
            "annotation",
            "Interval is given 2 times",
        ),
    ],
)
def test_what_cannot_be_honoured_is_refused_with_its_line(base, tmp_path, old, new, rule, text):
    changed = base.replace(old, new, 1)
    assert changed != base
    _, problems = read(tmp_path, changed)
    fitting = [p for p in problems if text in p.text and p.rule == rule]
    assert fitting, problems
    assert fitting[0].file == "SystemStructure.ssd"
    assert abs(fitting[0].line - line_of(changed, new.split(">")[0])) <= 3


def test_several_mistakes_are_all_reported(base, tmp_path):
    changed = base.replace('stopTime="1.0"', 'stopTime="x"').replace("<panto:Interval", "<panto:Bogus/><panto:Interval")
    _, problems = read(tmp_path, changed)
    assert {"number", "annotation"} <= {p.rule for p in problems}


def test_other_versions_are_refused(base, tmp_path):
    _, problems = read(tmp_path, base.replace('version="1.0" name', 'version="3.0" name', 1))
    assert any(p.rule == "version" for p in problems)


def test_broken_xml_is_refused_with_its_line(base, tmp_path):
    _, problems = read(tmp_path, base.replace("</ssd:System>", "", 1))
    assert [p.rule for p in problems] == ["xml"]
    assert problems[0].line > 10


def test_entities_are_refused(tmp_path):
    (tmp_path / "secret").write_text("treasure")
    text = f'<!DOCTYPE a [<!ENTITY x SYSTEM "file://{tmp_path}/secret">]>\n<a>&x;</a>'
    _, problems = read(tmp_path, text)
    assert [p.rule for p in problems] == ["xml"]
    assert "treasure" not in str(problems)


@pytest.mark.parametrize(
    ("attributes", "expected"),
    [
        ("", (1.0, 0.0)),
        ('offset="3"', (1.0, 3.0)),
        ('factor="2"', (2.0, 0.0)),
        ('factor="2" offset="-1"', (2.0, -1.0)),
    ],
)
def test_linear_transformation_and_its_defaults(base, tmp_path, attributes, expected):
    new = CONNECTION[:-2] + f"><ssc:LinearTransformation {attributes}/></ssd:Connection>"
    structure, problems = read(tmp_path, base.replace(CONNECTION, new))
    assert problems == []
    assert structure.connections[0].transformation == Conversion(*expected)


def test_run_settings(toy_text, tmp_path, base):
    run = (
        '<panto:Coupling scheme="gauss-seidel" order="pantograph catenary" maxIterations="7"/>'
        '<panto:Calibration parameter="pantograph.static_force" meanForce="157.5"/>'
        '<panto:Record variables="*.mass[*].z a.b" every="0.01"/>'
    )
    structure, problems = read(tmp_path, toy_text(run))
    assert problems == []
    settings = structure.annotations.settings
    assert settings.coupling.order == ("pantograph", "catenary")
    assert settings.coupling.max_iterations == 7
    assert settings.calibration.mean_force == 157.5
    assert settings.records[-1].variables == ("*.mass[*].z", "a.b")
    assert (settings.interval.start, settings.interval.end) == (None, None)
