"""Checks across structure and FMUs: connections, units, parameters, ranges."""

import dataclasses
from pathlib import Path

import pytest

from master.scenario.scenario_checks import ScenarioChecks
from master.ssp.run_settings import Annotations, RunSettings
from master.ssp.ssd import Component, Connection, Structure
from master.ssp.ssd_elements import Binding, Connector
from master.ssp.ssp_units import COMMON, Conversion
from master.ssp.ssv import Parameter, ParameterSet
from master.system.components import Fmu, Variable


def variable(name, causality, unit="", kind="Real", minimum=None, maximum=None, variability="tunable"):
    return Variable(name, 0, kind, causality, variability, unit, None, minimum, maximum)


def fmu(*variables):
    found = {v.name: dataclasses.replace(v, reference=i) for i, v in enumerate(variables)}
    return Fmu(Path("x.fmu"), "", "", found, True, "", "")


def component(name, connectors, parameters=(), prefix=""):
    bindings = (Binding(prefix, ParameterSet("p", tuple(parameters), {}), 9),) if parameters else ()
    return Component(name, "resources/x.fmu", tuple(connectors), bindings, 1)


NONE = Conversion()


def wire(suppress=False, transformation=NONE, start=("a", "y"), end=("b", "u")):
    return Connection(*start, *end, transformation, suppress, 7)


def structure(components, connections, bindings=()):
    return Structure(
        "s",
        tuple(components),
        tuple(connections),
        tuple(bindings),
        {},
        0.0,
        1.0,
        Annotations(RunSettings(), None),
    )


def check(written, fmus):
    problems = []
    checker = ScenarioChecks(written, fmus, problems)
    connections = checker.connections()
    return connections, checker.components(connections), problems


def pair(source_unit="", target_unit="", written=("", ""), **options):
    a = component("a", [Connector("y", "output", "Real", written[0], 2)])
    b = component("b", [Connector("u", "input", "Real", written[1], 3)])
    fmus = {"a": fmu(variable("y", "output", source_unit)), "b": fmu(variable("u", "input", target_unit))}
    return check(structure([a, b], [wire(**options)]), fmus)


@pytest.mark.parametrize(
    ("source", "target", "value", "expected"),
    [
        ("mm", "m", 1500.0, 1.5),
        ("km/h", "m/s", 300.0, 83.3333333333),
        ("kN", "N", 2.0, 2000.0),
        ("degC", "K", 20.0, 293.15),
    ],
)
def test_units_of_connected_variables_are_converted(source, target, value, expected):
    connections, _, problems = pair(source, target)
    assert problems == []
    assert connections[0].conversion(value) == pytest.approx(expected)


def test_connectors_that_restate_the_units_change_nothing():
    connections, _, problems = pair("mm", "m", ("mm", "m"))
    assert problems == []
    assert connections[0].conversion(1500.0) == pytest.approx(1.5)


def test_a_connector_in_another_unit_than_its_variable_is_converted_too():
    """The FMU gives mm, the SSD calls it m, the other FMU wants m: once converted, not twice or never."""
    connections, _, problems = pair("mm", "m", ("m", "m"))
    assert problems == []
    assert connections[0].conversion(1500.0) == pytest.approx(1.5)


def test_suppressed_conversion_leaves_only_the_transformation():
    connections, _, _ = pair("mm", "m", suppress=True, transformation=Conversion(0.5, 1.0))
    assert connections[0].conversion(10.0) == pytest.approx(6.0)


def test_transformation_comes_after_the_unit_conversion():
    """SSP 1.0: the linear transformation applies to the value in the target's unit."""
    connections, _, _ = pair("mm", "m", transformation=Conversion(2.0, 1.0))
    assert connections[0].conversion(1500.0) == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("units", "text"),
    [(("N", "m"), "do not measure the same thing"), (("furlong", "m"), "'furlong' is not declared")],
)
def test_units_that_do_not_fit_are_refused(units, text):
    _, _, problems = pair(*units)
    assert [p.rule for p in problems] == ["unit"]
    assert text in problems[0].text
    assert problems[0].line == 7


def test_direction_follows_from_the_kinds():
    connections, _, problems = pair(start=("b", "u"), end=("a", "y"))
    assert problems == []
    assert (connections[0].source, connections[0].target) == ("a", "b")


@pytest.mark.parametrize(
    ("connection", "text"),
    [
        (wire(start=("c", "y")), "'c' is not a component"),
        (wire(start=("a", "z")), "declares no connector 'z'"),
        (wire(start=("", "y")), "belongs to no component"),
        (wire(start=("b", "u")), "an output must be connected to an input"),
    ],
)
def test_connections_that_lead_nowhere_are_refused(connection, text):
    a = component("a", [Connector("y", "output", "Real", "", 2)])
    b = component("b", [Connector("u", "input", "Real", "", 3)])
    fmus = {"a": fmu(variable("y", "output")), "b": fmu(variable("u", "input"))}
    _, _, problems = check(structure([a, b], [wire(), connection]), fmus)
    assert any(text in p.text and p.line == 7 for p in problems)


def test_a_connector_left_out_of_the_description_is_told_from_a_wrong_name():
    a = component("a", [Connector("y", "output", "Real", "", 2)])
    b = component("b", [Connector("u", "input", "Real", "", 3)])
    fmus = {"a": fmu(variable("y", "output")), "b": fmu(variable("u", "input"), variable("w", "input"))}
    _, _, problems = check(structure([a, b], [wire(), wire(end=("b", "w"))]), fmus)
    assert [p.text for p in problems if "'w'" in p.text] == [
        "component 'b' declares no connector 'w'; its FMU has it: add a Connector of kind 'input' to the component"
    ]


def test_doubly_connected_inputs_are_refused_and_unconnected_ones_told():
    a = component("a", [Connector("y", "output", "Real", "", 2)])
    b = component("b", [Connector("u", "input", "Real", "", 3), Connector("w", "input", "Real", "", 4)])
    fmus = {"a": fmu(variable("y", "output")), "b": fmu(variable("u", "input"), variable("w", "input"))}
    problems, warnings = [], []
    checker = ScenarioChecks(structure([a, b], [wire(), wire()]), fmus, problems, warnings)
    checker.components(checker.connections())
    assert [(p.line, p.text) for p in problems] == [(3, "input 'b.u' has 2 connections; one is allowed")]
    reported = "input 'b.w' is declared but not connected; it keeps its start value of the FMU"
    assert [(w.line, w.text) for w in warnings] == [(4, reported)]


@pytest.mark.parametrize(
    ("connector", "text"),
    [
        (Connector("none", "output", "Real", "", 5), "has no such variable"),
        (Connector("y", "input", "Real", "", 5), "kind is 'input', in the FMU 'output'"),
        (Connector("y", "output", "Integer", "", 5), "type is Integer, in the FMU Real"),
        (Connector("y", "output", "Real", "m", 5), "do not measure the same thing"),
        (Connector("y", "inout", "Real", "", 5), "'inout' is not supported"),
    ],
)
def test_connectors_must_agree_with_the_fmu(connector, text):
    _, _, problems = check(structure([component("a", [connector])], []), {"a": fmu(variable("y", "output", "N"))})
    assert any(text in p.text and p.line == 5 for p in problems)


@pytest.mark.parametrize("kind", ["Integer", "Boolean", "String", "Enumeration"])
def test_variables_of_one_type_can_be_connected(kind):
    a = component("a", [Connector("y", "output", kind, "", 2)])
    b = component("b", [Connector("u", "input", "", "", 3)])
    fmus = {"a": fmu(variable("y", "output", kind=kind)), "b": fmu(variable("u", "input", kind=kind))}
    connections, _, problems = check(structure([a, b], [wire()]), fmus)
    assert (len(connections), problems) == (1, [])
    fmus["b"] = fmu(variable("u", "input"))
    _, _, problems = check(structure([a, b], [wire()]), fmus)
    assert ["only variables of the same type can be connected" in p.text for p in problems] == [True]


def test_binary_values_are_not_exchanged():
    a = component("a", [Connector("y", "output", "Binary", "", 2)])
    b = component("b", [Connector("u", "input", "Binary", "", 3)])
    _, _, problems = check(structure([a, b], [wire()]), {})
    assert ["'a.y' is Binary, which cannot be exchanged" in p.text for p in problems] == [True]


def parameter(name, value, unit="", kind="Real"):
    return Parameter(name, kind, value, unit, "parameters.ssv", 11)


def parameters_of(given, *variables, prefix="", system=()):
    binding = [Binding("", ParameterSet("s", tuple(system), {}), 1)] if system else []
    written = structure([component("a", [], given, prefix)], [], binding)
    _, components, problems = check(written, {"a": fmu(*variables)})
    return components[0].parameters, problems


def test_parameters_are_converted_to_the_fmus_unit():
    values, problems = parameters_of([parameter("f", 2.0, "kN")], variable("f", "parameter", "N"))
    assert problems == []
    assert values == {"f": 2000.0}


def test_a_prefix_is_put_before_the_names():
    values, problems = parameters_of([parameter("b", 1.0)], variable("a.b", "parameter"), prefix="a.")
    assert problems == []
    assert values == {"a.b": 1.0}


def test_the_systems_binding_takes_priority():
    values, problems = parameters_of([parameter("f", 1.0)], variable("f", "parameter"), system=[parameter("a.f", 2.0)])
    assert problems == []
    assert values == {"f": 2.0}


def test_a_later_binding_takes_priority():
    first = component("a", [], [parameter("f", 1.0), parameter("g", 5.0)])
    both = dataclasses.replace(
        first, bindings=(*first.bindings, Binding("", ParameterSet("q", (parameter("f", 3.0),), {}), 2))
    )
    fmus = {"a": fmu(variable("f", "parameter"), variable("g", "parameter"))}
    _, components, problems = check(structure([both], []), fmus)
    assert problems == []
    assert components[0].parameters == {"f": 3.0, "g": 5.0}


@pytest.mark.parametrize(
    ("given", "declared", "text"),
    [
        (parameter("x", 1.0), variable("f", "parameter"), "has no such variable"),
        (
            parameter("speed", 1.0),
            variable("start_position", "parameter"),
            "no such variable; its speed is given otherwise (by a speed profile, say): take the parameter out",
        ),
        (parameter("f", 1.0), variable("f", "output"), "causality 'output'"),
        (parameter("f", 1.0), variable("f", "parameter", variability="constant"), "it is constant"),
        (
            parameter("f", 1.0),
            variable("f", "parameter", kind="Integer"),
            "written as Real, in the FMU it is Integer",
        ),
        (parameter("f", True, kind="Boolean"), variable("f", "parameter"), "written as Boolean"),
        (parameter("f", 1.0, "m"), variable("f", "parameter", "N"), "do not measure the same thing"),
        (parameter("f", 1.0), variable("f", "parameter", "N", minimum=2.0), "= 1 N is below its minimum 2"),
        (
            parameter("f", 9.0, "kN"),
            variable("f", "parameter", "N", maximum=800.0),
            "= 9000 N is above its maximum 800",
        ),
    ],
)
def test_parameters_that_cannot_be_set_are_refused(given, declared, text):
    _, problems = parameters_of([given], declared)
    assert len(problems) == 1
    assert text in problems[0].text
    if problems[0].rule != "unit":
        assert (problems[0].file, problems[0].line) == ("parameters.ssv", 11)


@pytest.mark.parametrize("bound", [[], [parameter("a.start_height", 4000.0, "mm")]])
def test_a_strip_that_starts_beyond_its_stops_is_told_where_that_is_written(bound):
    stops = [dataclasses.replace(variable("lowest_height", "parameter", "m"), start="4.5")]
    given = [] if bound else [parameter("start_height", 4.0, "m")]
    _, (problem,) = parameters_of(given, variable("start_height", "parameter", "m"), *stops, system=bound)
    assert (problem.file, problem.line) == ("parameters.ssv", 11)
    assert problem.text == "a.start_height = 4 m is below the lowest_height of 4.5 m"


def test_system_parameters_of_nobody_are_refused():
    _, problems = parameters_of([], variable("f", "parameter"), system=[parameter("c.f", 2.0)])
    assert ["'c.f' belongs to no component" in p.text for p in problems] == [True]


def test_component_names_must_differ():
    a = component("a", [])
    _, _, problems = check(structure([a, a], []), {"a": fmu()})
    assert any("is used 2 times" in p.text for p in problems)


def test_common_units_are_consistent():
    """A unit's square check: kN.m / m = kN and so on, by dimension and factor."""
    assert COMMON["kN.m"].factor == COMMON["kN"].factor * COMMON["m"].factor
    assert [a + b for a, b in zip(COMMON["N/m"].dimension, COMMON["m"].dimension, strict=True)] == list(
        COMMON["N"].dimension
    )
    assert [a + b for a, b in zip(COMMON["W"].dimension, COMMON["s"].dimension, strict=True)] == list(
        COMMON["J"].dimension
    )
