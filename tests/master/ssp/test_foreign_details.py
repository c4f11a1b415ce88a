"""What FMUs and systems of others say in passing: units, limits, aliases, types on the way. Nothing of it is lost."""

# ruff: noqa: E501 (XML, a thing a line)

from __future__ import annotations

import fmpy
import pytest

from master.errors import RunError
from master.fmu.isolation.isolated_instance import Isolation
from master.run_session import RunOptions
from master.ssp.pack import pack
from tests.foreign_fmus import (
    compile_library,
    component,
    connector,
    connectors,
    description,
    opened,
    problems,
    ran,
    ssd,
    system,
    values,
    wire,
    write_fmu,
)  # fmt: skip

U, K, Y = connector("u", "input"), connector("k", "parameter"), connector("y", "output")
X = connector("x", "output")
KELVIN, CELSIUS = (
    '<Unit name="K"><BaseUnit K="1"/></Unit>',
    '<Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>',
)


def changed(*pairs, **options):
    """A description with other texts in places."""
    text = description(**options)
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def typed(attributes):
    """A type ``T`` of Real variables."""
    return "<TypeDefinitions>", f'<TypeDefinitions><SimpleType name="T"><Real {attributes}/></SimpleType>'


def two(bound="1"):
    """y of ``a`` to u of ``b``, each of an FMU of its own."""
    first = component("a", Y, source="resources/one.fmu", bindings=values(("u", f'Real value="{bound}"')))
    return ssd(system(first + component("b", U, Y, source="resources/other.fmu"), wire("a.y", "b.u")))


# Relative quantities and limits, of variables and of their types.

OWN = changed(('<Real unit="degC"/>', '<Real unit="degC" relativeQuantity="true"/>'), units=("", "degC"))
OF_TYPE = changed(
    ('continuous"><Real/>', 'continuous"><Real declaredType="T"/>'), typed('unit="degC" relativeQuantity="true"')
)
OWN_NOT = changed(
    ('continuous"><Real/>', 'continuous"><Real declaredType="T" relativeQuantity="false"/>'),
    typed('unit="degC" relativeQuantity="true"'),
)


@pytest.mark.parametrize(
    ("reported", "wanted"), [(OWN, 2.0), (OF_TYPE, 2.0), (OWN_NOT, 275.15), (description(("", "degC")), 275.15)]
)
def test_the_offset_of_a_unit_falls_out_of_a_difference(scenario, tmp_path, reported, wanted):
    folder = scenario(two("2"), one=reported, other=description(("K", "")))
    assert ran(folder, tmp_path)["b.y"][-1] == pytest.approx(wanted, rel=1e-9)


def test_so_it_does_from_a_value_of_the_scenario(scenario):
    reported = changed(('<Real start="1"/>', '<Real start="1" unit="K" relativeQuantity="1"/>'))
    bound = values(("k", 'Real value="20" unit="degC"'), ("u", 'Real value="20" unit="degC"'))
    folder = scenario(
        ssd(system(component("a", Y, bindings=bound))), panel=reported.replace('start="0.5"', 'start="0.5" unit="K"')
    )
    assert opened(folder).components[0].parameters == pytest.approx({"k": 20.0, "u": 293.15})


def test_limits_of_a_type_hold(scenario):
    reported = changed(('<Real start="1"/>', '<Real start="1" declaredType="T"/>'), typed('min="0" max="2" unit="m"'))
    text = ssd(system(component("a", Y, bindings=values(("k", 'Real value="3"')))))
    assert problems(scenario(text, panel=reported)) == [
        "SystemStructure.ssd:3: parameter 'a.k' = 3 m is above its maximum 2; a value without a unit is in m: check its size, or write its unit [range]"
    ]


# Units of FMUs: one name, one meaning.


def unit(name, attributes):
    return f'<Unit name="{name}"><BaseUnit {attributes}/></Unit>'


@pytest.mark.parametrize(
    ("name", "first", "second", "reported"),
    [
        ("pace", 'm="1" s="-1"', 'm="1" s="-1" factor="0.5"', "component 'b': unit 'pace' of its FMU has another meaning than in the FMU of 'a': it is declared with factor 0.5, there with factor 1"),
        ("pace", 'm="1" s="-1"', 'kg="1"', "component 'b': unit 'pace' of its FMU has another meaning than in the FMU of 'a': it measures something else"),
        ("km/h", 'm="1" s="-1" factor="0.5"', 'm="1" s="-1" factor="0.5"', "component 'a': unit 'km/h' of its FMU is declared with factor 0.5; everywhere else it has factor 0.277778"),
        ("degC", 'K="1"', 'K="1"', "component 'a': unit 'degC' of its FMU is declared with factor 1; everywhere else it has factor 1 and offset 273.15"),
        ("m", 'kg="1"', 'kg="1"', "component 'a': unit 'm' of its FMU is declared to measure something else than everywhere"),
    ],
)  # fmt: skip
def test_a_unit_of_two_fmus_has_one_meaning(scenario, name, first, second, reported):
    one, other = (description((name, name), unit(name, attributes)) for attributes in (first, second))
    assert problems(scenario(two(), one=one, other=other)) == [f"SystemStructure.ssd:3: {reported} [unit]"]


@pytest.mark.parametrize(
    ("name", "first", "second"),
    [("deg", 'rad="1" factor="0.0174533"', 'factor="0.0174533"'), ("pace", 'm="1"', ""), ("%", "", 'factor="0.01"'),
     ("N.m", 'kg="1" m="2" s="-2" rad="-1"', 'kg="1" m="2" s="-2"')],
)  # fmt: skip
def test_what_is_a_matter_of_taste_is_none(scenario, name, first, second):
    one, other = (description((name, name), unit(name, attributes)) for attributes in (first, second))
    assert opened(scenario(two(), one=one, other=other)).connections[0].conversion.is_identity


def test_units_that_nobody_uses_may_differ(scenario):
    one, other = (description(("", ""), unit("pace", f'm="1" factor="{f}"')) for f in (1, 2))
    assert opened(scenario(two(), one=one, other=other)).connections


# Bindings: what is written beside what is read.

SET = '<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters><ssv:Parameter name="k"><ssv:Real value="7"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>'
ENTRY = '<ssm:ParameterMapping version="1.0"><ssm:MappingEntry source="k" target="k"/></ssm:ParameterMapping>'
SSV = SET.replace(" version", ' xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version', 1)


def inline(content=SET, attributes="", mapping=""):
    return f"<ssd:ParameterBindings><ssd:ParameterBinding{attributes}><ssd:ParameterValues>{content}</ssd:ParameterValues>{mapping}</ssd:ParameterBinding></ssd:ParameterBindings>"


def mapping(content, attributes=""):
    return inline(mapping=f"<ssd:ParameterMapping{attributes}>{content}</ssd:ParameterMapping>")


@pytest.mark.parametrize(
    ("bound", "reported"),
    [
        (inline(attributes=' source="p.ssv"'), "the ParameterBinding has a source, 'p.ssv', and content as well; remove one of them [binding]"),
        (inline(SET + SET.replace("7", "9")), "the ParameterBinding holds 2 elements; one is allowed [binding]"),
        ('<ssd:ParameterBindings><ssd:ParameterBinding type="text/csv" source="p.ssv"/></ssd:ParameterBindings>', "the ParameterBinding is of type 'text/csv'; only application/x-ssp-parameter-set is supported [unsupported]"),
        (mapping(ENTRY, ' source="p.ssm"'), "the ParameterMapping has a source, 'p.ssm', and content as well; remove one of them [binding]"),
        (mapping(ENTRY + ENTRY), "the ParameterMapping holds 2 elements; one is allowed [binding]"),
        (mapping(ENTRY, ' type="text/csv"'), "the ParameterMapping is of type 'text/csv'; only application/x-ssp-parameter-mapping is supported [unsupported]"),
    ],
)  # fmt: skip
def test_a_binding_is_of_one_content(scenario, bound, reported):
    folder = scenario(ssd(system(component("a", Y, bindings=bound))), {"p.ssv": SSV})
    assert problems(folder) == [f"SystemStructure.ssd:3: {reported}"]


def test_an_empty_source_is_none(scenario):
    """SSP 1.0 says of an inline set that the source must be empty."""
    bound = inline(attributes=' source=""', mapping=f'<ssd:ParameterMapping source="">{ENTRY}</ssd:ParameterMapping>')
    assert opened(scenario(ssd(system(component("a", Y, bindings=bound))))).components[0].parameters == {"k": 7.0}


# Connectors of systems: their types and units count, wherever they lead.

OWN_Y = connector("y", "output", 'Real unit="m"')


def through(what, out=""):
    """y of ``a`` through an input of a system to u of ``b`` in it, and on to an output of the whole, each in its line."""
    inner = system(component("b", U, Y), "\n" + wire(".w", "b.u"), connectors(connector("w", "input", what)), name="in")
    wires = wire("a.y", "in.w") + "\n" + (wire("a.y", ".o") if out else "")
    return ssd(system(component("a", OWN_Y) + inner, wires, connectors(connector("o", "output", out)) if out else ""))


ITEMS = '<ssd:Enumerations><ssc:Enumeration name="Speed"><ssc:Item name="off" value="0"/></ssc:Enumeration></ssd:Enumerations>'
E_OUT = '<ssd:Connector name="e_out" kind="output"/>'


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        (through("Integer"), "SystemStructure.ssd:4: 'a.y' is Real and 'w' is Integer; only variables of the same type can be connected [type]"),
        (through("Real", "Boolean"), "SystemStructure.ssd:5: 'a.y' is Real and 'o' is Boolean; only variables of the same type can be connected [type]"),
        (through("Real", 'Real unit="kg"'), "SystemStructure.ssd:5: 'a.y' to 'o': 'm' and 'kg' do not measure the same thing [unit]"),
        (ssd(system(component("a", Y) + component("b", Y), wire("a.y", ".o") + "\n" + wire("b.y", ".o"), connectors(connector("o", "output")))), "SystemStructure.ssd:3: connector 'o' of system 'whole' has 2 connections; one is allowed [connection]"),
        (ssd(system(component("a", Y) + system(component("c", Y), wire(".i", ".o"), connectors(connector("i", "input"), connector("o", "output")), name="in"), "\n" + wire("in.o", "in.i"))), "SystemStructure.ssd:4: connector 'i' of system 'in' is fed by itself: the connections of systems form a circle, into which no component leads [connection]"),
        (ssd(system(component("a", E_OUT), wire("a.e_out", ".o"), connectors(connector("o", "output", 'Enumeration name="Speed"'))), ITEMS), "SystemStructure.ssd:3: 'a.e_out' has the items off = 1, low = 2, high = 3, 'o' off = 0; connected enumerations must have the same ones [enumeration]"),
        (ssd(system(component("a", E_OUT), wire("a.e_out", ".o"), connectors(connector("o", "output", 'Enumeration name="Speed"')))), "SystemStructure.ssd:3: connector 'o': enumeration 'Speed' is not declared in ssd:Enumerations [enumeration]"),
    ],
)  # fmt: skip
def test_mistakes_at_connectors_of_systems(scenario, text, reported):
    assert problems(scenario(text)) == [reported]


def test_a_chain_through_connectors_without_a_type(scenario):
    text = through("Real", "Real").replace('kind="input"><ssc:Real/>', 'kind="input">')
    assert [c.target for c in opened(scenario(text)).connections] == ["in.b"]


# What FMUs say of themselves.

SECOND_K = '<ScalarVariable name="k2" valueReference="1" causality="parameter" variability="fixed"><Real start="1"/></ScalarVariable>'
SECOND_U = '<ScalarVariable name="u2" valueReference="0" causality="input" variability="continuous"><Real start="0.5"/></ScalarVariable>'
ALIASES = changed(('<ScalarVariable name="y"', f'{SECOND_K}{SECOND_U}<ScalarVariable name="y"'))
DOUBLE = '<ssc:LinearTransformation factor="2"/>'


@pytest.mark.parametrize("second", [3, 5])
def test_two_names_of_one_variable_are_given_one_value(scenario, second):
    bound = values(("k", 'Real value="3"'), ("k2", f'Real value="{second}"'))
    folder = scenario(ssd(system(component("a", Y, bindings=bound))), panel=ALIASES)
    if second == 3:
        assert opened(folder).components[0].parameters == {"k": 3.0, "k2": 3.0}
    else:
        assert problems(folder) == [
            "SystemStructure.ssd:3: 'k' and 'k2' of component 'a' are one variable in the FMU, but are given 3.0 and 5.0; leave out one of them [alias]"
        ]


@pytest.mark.parametrize("inside", ["", DOUBLE])
def test_and_take_one(scenario, inside):
    elements = component("a", Y) + component("b", U, connector("u2", "input"))
    folder = scenario(ssd(system(elements, wire("a.y", "b.u") + wire("a.y", "b.u2", inside))), panel=ALIASES)
    if inside:
        assert problems(folder) == [
            "SystemStructure.ssd:3: 'u' and 'u2' of component 'b' are one variable in the FMU, but take 'a.y' and 'a.y' x 2 + 0; leave out one of them [alias]"
        ]
    else:
        assert len(opened(folder).connections) == 2


def test_one_instance_in_a_process(scenario, tmp_path):
    reported = changed(("<CoSimulation ", '<CoSimulation canBeInstantiatedOnlyOncePerProcess="true" '))
    folder = scenario(ssd(system(component("a", Y) + component("b", Y))), panel=reported)
    with pytest.raises(
        RunError, match=r"'a' and 'b': both are of panel.fmu, of which a process can hold only one; --isolate"
    ):
        ran(folder, tmp_path)
    assert ran(folder, tmp_path, RunOptions(isolation=Isolation()))["b.y"][-1] == 0.5


EARLY = ("    m->r[3] += h", "    if (t > 0.45) return 2;\n    m->r[3] += h")
ENDS = (
    "GetBooleanStatus(void *c, int k, int *w) { return 2; }",
    "GetBooleanStatus(void *c, int k, int *w) { *w = k == 3; return 0; }",
)
LAST = (
    "GetRealStatus(void *c, int k, double *w) { return 2; }",
    "GetRealStatus(void *c, int k, double *w) { if (k != 2) return 3; *w = 0.53; return 0; }",
)


@pytest.mark.parametrize("isolation", [None, Isolation()])
@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ((EARLY,), r"failed in a step at t = 0\.5 s, status discard: the FMU gave no reason"),
        ((EARLY, ENDS), r"failed in a step at t = 0\.5 s, status discard: the FMU has ended the simulation at t = 0\.5 s, before the stop time"),
        ((EARLY, ENDS, LAST), r"failed in a step at t = 0\.5 s, status discard: the FMU has ended the simulation at t = 0\.53 s, before the stop time"),
    ],
)  # fmt: skip
def test_an_fmu_that_ends_early_says_so(scenario, tmp_path, changes, reported, isolation):
    """FMPy ends in silence; here the run has not reached its stop time, and is not called complete."""
    folder = scenario(ssd(system(component("a", Y, X))))
    write_fmu(folder / "resources/panel.fmu", compile_library(tmp_path, *changes), description())
    with pytest.raises(
        RunError, match=rf"component 'a' \(panel\.fmu\) {reported}\. What was computed up to t = 0\.5 s"
    ):
        ran(folder, tmp_path, None if isolation is None else RunOptions(isolation=isolation))


# Times, sources, digits.


def test_up_to_a_stop_time_between_steps_a_run_is_that_of_fmpy(scenario, tmp_path):
    folder = scenario(ssd(system(component("a", X))))
    ours, path = ran(folder, tmp_path, step=0.3), str(folder / "resources/panel.fmu")
    theirs = fmpy.simulate_fmu(path, stop_time=1.0, output_interval=0.3, output=["x"])  # which shortens its last step
    assert ours["a.x"] == pytest.approx(theirs["x"][:-1], rel=1e-9)
    assert len(theirs) == len(ours["a.x"]) + 1


@pytest.mark.parametrize(
    ("source", "reported"),
    [
        ("", "component 'a' has an empty source [source]"),
        ("resources", "component 'a': resources is a folder, not an FMU [fmu]"),
    ],
)
def test_sources_that_are_no_files(scenario, source, reported):
    assert problems(scenario(ssd(system(component("a", Y, source=source))))) == [f"SystemStructure.ssd:3: {reported}"]


def test_a_missing_source_is_told_once(scenario):
    text = ssd(system(component("a", Y))).replace(' source="resources/panel.fmu"', "")
    assert [p.endswith("[schema]") for p in problems(scenario(text))] == [True]


def test_blanks_around_values_are_none(scenario):
    bound = values(("b_in", 'Boolean value=" 1 "'), ("i_in", 'Integer value=" 5 "'), ("u", 'Real value=" 1e1 "'))
    given = opened(scenario(ssd(system(component("a", Y, bindings=bound))))).components[0].parameters
    assert given == {"b_in": True, "i_in": 5, "u": 10.0}


def test_annotations_of_other_tools_are_noted(scenario):
    steps = '<ssd:Annotations><ssc:Annotation type="org.openmodelica"><x:FixedStepMaster xmlns:x="urn:x" stepSize="0.5"/></ssc:Annotation></ssd:Annotations>'
    text = ssd(system(component("a", Y)).replace("</ssd:System>", f"{steps}</ssd:System>"))
    reported = "SystemStructure.ssd:3: annotations of type 'org.openmodelica' are not read; what they say of steps, solvers and events has no effect [note]"
    assert opened(scenario(text), strict=True).warnings == (reported,)  # a note is no mistake


def test_a_connection_leads_to_elements_of_its_system(scenario):
    nested = system(component("b", U), name="in")
    inward = wire("a.y", "b.u").replace('endElement="b"', 'endElement="in.b"')
    assert problems(scenario(ssd(system(component("a", Y) + nested, "\n" + inward)))) == [
        "SystemStructure.ssd:4: 'in.b' is not a component or system in system 'whole'; connect the system that holds it [connection]"
    ]


def test_names_are_one_line(scenario):
    text = ssd(system(component("a", Y)))
    assert problems(scenario(text.replace('Component name="a"', 'Component name="a&#10;b"'))) == [
        "SystemStructure.ssd:3: element 'a\\nb': a name is one line of text [name]"
    ]
    reported = description().replace('name="x"', 'name="x&#10;y"')
    assert "the variable name 'x\\ny' is not one line of text" in problems(scenario(text, panel=reported))[0]


def test_an_archive_names_what_lies_beside_it_as_a_folder_would(scenario, tmp_path):
    folder = scenario(ssd(system(component("a", Y, source="../shared/panel.fmu"))))
    shared = tmp_path / "shared"
    shared.mkdir()
    (folder / "resources/panel.fmu").rename(shared / "panel.fmu")
    archive = pack(folder, tmp_path / "packed.ssp")
    assert opened(archive, outside=(shared,)).components[0].fmu.path == shared / "panel.fmu"
    assert "does not lie inside the scenario" in problems(archive)[0]
    assert "does not lie inside the scenario" in problems(archive, outside=(folder,))[0]
