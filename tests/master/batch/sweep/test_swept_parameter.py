"""What a user may write for the values of a parameter, and what is refused in one sentence."""

import pytest

from master.batch.sweep.swept_parameter import ParameterReader
from master.errors import RequestError
from master.ssp.run_settings import RunSettings
from master.ssp.ssp_units import COMMON
from master.system.components import Component, Fmu, System, Variable
from master.system.connections import Connection


def _variable(name, unit, kind="Real", items=()):
    return Variable(name, 0, kind, "parameter", "fixed", unit, "1", None, None, items=items)


@pytest.fixture
def line_and_pantograph(tmp_path):
    def component(name, *variables):
        fmu = Fmu(tmp_path / f"{name}.fmu", "", name, {v.name: v for v in variables}, True, "", "", units={})
        return Component(name, fmu, {}, (), ())

    line = component(
        "line", _variable("tension", "N"), _variable("temperature", "degC"), _variable("law", "", "String")
    )
    train = component("train", _variable("speed", "m/s"), _variable("share", "1"), _variable("count", "", "Integer"))
    wires = tuple(
        Connection("line", f"pantograph[1].contact.{n}", "train", f"contact.{n}") for n in ("force", "x", "y", "z")
    )
    return System("s", (line, train), wires, 0.0, 1.0, 0.001, RunSettings())


@pytest.mark.parametrize(
    ("name", "text", "unit", "values"),
    [
        ("line.tension", "18kN,20kN,22kN", "kN", (18.0, 20.0, 22.0)),
        ("line.tension", "18,20,22 kN", "kN", (18.0, 20.0, 22.0)),
        ("line.tension", "18kN, 20000 N", "N", (18000.0, 20000.0)),
        ("line.tension", "18kN:22kN:2kN", "kN", (18.0, 20.0, 22.0)),
        ("line.tension", "1:1.3:0.1 kN", "kN", (1.0, 1.1, 1.2, 1.3)),
        ("line.tension", "3:1:-1N", "N", (3.0, 2.0, 1.0)),
        ("speed", "200:320:60", "km/h", (200.0, 260.0, 320.0)),
        ("train.speed", "50 m/s", "m/s", (50.0,)),
        ("train.share", "0.1,0.2", "", (0.1, 0.2)),
        ("stop", "2,3", "s", (2.0, 3.0)),
        ("line.law", "soft,hard", "", ("soft", "hard")),
        ("train.count", "1,2", "", ("1", "2")),
        ("train.count", "1:7:3,9", "", ("1", "4", "7", "9")),
    ],
)
def test_values(line_and_pantograph, name, text, unit, values):
    parameter, found = ParameterReader(line_and_pantograph, name).listed(text)
    assert (parameter.unit, found) == (unit, values)


def test_a_name_without_component_is_that_of_every_pantograph(line_and_pantograph):
    assert ParameterReader(line_and_pantograph, "speed").parameter("km/h").targets == ("train.speed",)
    assert ParameterReader(line_and_pantograph, "stop").parameter("s").targets == ()


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("line.tensoin", "1N", "did you mean 'line.tension'"),
        ("sped", "1", "did you mean 'speed'"),
        ("line.tension", "18,20", "'18,20' needs a unit, as in '20 N'"),
        ("line.tension", "18 kM", "there is no unit 'kM'; did you mean 'km'"),
        ("line.tension", "18 mm", "'mm' does not fit, give it in a unit of N"),
        ("train.share", "18 mm", "'mm' does not fit, give it in no unit"),
        ("line.tension", "much", "'much' is not a number"),
        ("line.tension", "nan N", "'nan N' is not a number"),
        ("line.tension", "1:2N", "a range is written FIRST:LAST:STEP"),
        ("line.tension", "1:2:-1N", "never lead from 1 to 2"),
        ("line.tension", "1:2:0N", "never lead from 1 to 2"),
        ("line.tension", "0:1:1e-9N", "more than 100000"),
        ("line.tension", "1N,1N", "appears more than once"),
        ("train.count", "1:3:1,2", "appears more than once"),
        ("train.count", "1:3", "a range is written FIRST:LAST:STEP"),
        ("train.count", "0:1000000:1", "more than 100000"),
    ],
)
def test_what_cannot_be_is_one_sentence(line_and_pantograph, name, text, said):
    with pytest.raises(RequestError) as caught:
        ParameterReader(line_and_pantograph, name).listed(text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_cell_without_a_unit_where_one_is_needed_is_one_sentence(line_and_pantograph):
    with pytest.raises(RequestError, match=r"^line\.tension: '18' needs a unit, as in '18 N'$"):
        ParameterReader(line_and_pantograph, "line.tension").cells(("20 kN", "18"))
    assert ParameterReader(line_and_pantograph, "line.tension", "kN").cells(("20", "18"))[1] == (20.0, 18.0)


def test_the_value_of_the_scenario_comes_in_the_unit_that_is_asked_for(line_and_pantograph):
    line_and_pantograph.component("line").parameters["tension"] = 19000.0
    assert ParameterReader(line_and_pantograph, "line.tension").present("kN") == pytest.approx(19.0)
    assert ParameterReader(line_and_pantograph, "line.temperature").present("degC") == 1.0
    assert ParameterReader(line_and_pantograph, "stop").present("s") == 1.0


def test_a_width_has_no_offset_of_its_unit(line_and_pantograph):
    reader = ParameterReader(line_and_pantograph, "line.temperature")
    _, (mean, sd) = reader.arguments("20 degC, 10 K", (False, True))
    assert COMMON["degC"].offset == 273.15
    assert (round(mean, 6), sd) == (293.15, 10.0)
