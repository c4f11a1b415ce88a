"""A line at rest from Python: what the command line finds, as tables, and what cannot be meant in words."""

import dataclasses

import numpy as np
import pytest

from models import in_wind, over_temperature, span_table, statics
from models.catenary.definition.fault_definition import FAULT_KINDS
from models.catenary.definition.overbridge_definition import Overbridge
from models.catenary.definition.tensioning_definition import Tensioning, TensioningDevice
from models.catenary.shape.form_finding import EquilibriumError
from models.catenary.statics import temperature_table
from models.definition_files.parameter import ParameterError
from models.interface.line_and_pantograph import Line

BRIDGE = Overbridge(name="A-4", start=110.0, end=130.0, underside=6.75)


@pytest.fixture(scope="module")
def line(line_maker):
    tensioning = Tensioning(
        temperature=288.15, reference_temperature=288.15, messenger_wire=TensioningDevice(kind="fixed")
    )
    return Line(dataclasses.replace(line_maker(), tensioning=tensioning, overbridge=(BRIDGE,)))


@pytest.fixture(scope="module")
def rest(line):
    return statics(line, speed="160 km/h")


def test_the_line_at_rest_is_taken_as_it_is(line, rest):
    blown, again = in_wind(rest, speed="29 m/s", head=1600), in_wind(line, speed=29.0, head="1600")
    assert blown.offset.tobytes() == again.offset.tobytes()
    assert blown.pressure == pytest.approx(0.5 * 1.25 * 29.0**2)
    over, same = over_temperature(rest, ["40 degC"]), over_temperature(line, [313.15], speed="160 km/h")
    assert over.states[0].waves == same.states[0].waves
    assert repr(over) == "<LineOverTemperature of short, 1 temperatures>"


def test_tables_have_the_rows_of_what_was_asked_for(line, rest):
    pytest.importorskip("pandas", reason="the extra 'pandas' is not installed")
    blown = in_wind(rest, pressure="500 Pa", limit="40 cm")
    assert blown.frame()["limit [m]"].tolist()[1:-1] == [0.4] * 4
    assert len(blown.frame("arms")) == 5
    assert (blown.frame("plan")["y, wind to the left [m]"] >= blown.frame("plan")["y [m]"] - 1e-9).all()
    over = over_temperature(rest, ["-20 degC", "40 degC"])
    assert over.frame()["temperature [degC]"].tolist() == pytest.approx([-20.0, 40.0])
    assert len(over.frame("tension")) == 2 * 2 * 6
    assert rest.frame("overbridges")["lift [m]"][0] > 0.01
    assert list(rest.frame()) == list(rest.tables["droppers"][0])
    table = span_table(line, speed=29.0, head=1600, radii=["1 km"])
    assert table.frame("spans").index.tolist() == [1000.0]
    assert table.frame().shape == (41, 2)


def test_a_head_leaves_less_room_in_curves(line_maker):
    """The working range less sway, half the gauge's play and 2.5 m2 / R, or the cap of 0.4 m (EN 15273, TSI)."""
    definition = line_maker()
    high = dataclasses.replace(definition, profile=dataclasses.replace(definition.profile, contact_wire_height=6.2))
    found = span_table(Line(high), speed=29.0, head=1600, radii=[300.0, 2000.0], staggers=[(0.2, 0.2)])
    assert np.array(found.limits) == pytest.approx([0.6 - (0.11 + 0.04 * 1.45) - 0.0275 - 2.5 / 300.0, 0.4])
    given = [
        span_table(Line(high), speed=29.0, limit=limit, radii=[R], staggers=[(0.2, 0.2)]).largest_span[0, 0]
        for limit, R in zip(found.limits, found.radii, strict=True)
    ]
    assert found.largest_span[0].tolist() == given
    for length, R in zip(found.lengths[::10], found.smallest_radius[0, ::10].tolist(), strict=True):
        beside = span_table(Line(high), speed=29.0, head=1600, radii=[R - 5.0, R], staggers=[(0.2, 0.2)])
        assert beside.largest_span[0, 0] < length <= beside.largest_span[0, 1]


def test_clearances_are_judged_at_rest_lifted_and_where_it_is_coldest(rest):
    found = {j.what: j for j in rest.judgements}
    at_rest = found["clearance under A-4, at rest [m]"]
    (lifted,) = (j for what, j in found.items() if "lifted" in what)
    assert at_rest.passed
    assert float(lifted.figure) == pytest.approx(float(at_rest.figure) - rest.overbridges.lift[0], abs=1e-3)
    assert "from memory" in at_rest.source
    over = over_temperature(rest, ["40 degC", "-20 degC"])
    cold = next(j for j in over.judgements if "clearance" in j.what)
    assert cold.what == "clearance under A-4, at -20 degC [m]"
    assert float(cold.figure) < float(at_rest.figure)
    left = over.tables["temperature"][1][-1]
    assert left[1] == pytest.approx(float(cold.figure), abs=1e-3)


def test_a_verdict_in_the_wind_counts_the_spans_beyond(rest):
    (kept,) = in_wind(rest, pressure=300.0, limit=0.5).judgements
    assert (kept.word, kept.limit, kept.source) == ("passed", "500 there", "as asked for")
    (beyond,) = in_wind(rest, pressure=3000.0, limit=0.3).judgements
    assert not beyond.passed
    assert "4 of 4 spans beyond" in beyond.figure
    assert in_wind(rest, pressure=300.0).judgements == ()
    assert np.isnan(in_wind(rest, pressure=300.0).limit).all()


def test_what_a_line_does_not_stand_is_told_with_its_temperature(line, monkeypatch):
    def refuse(design):
        raise EquilibriumError("line 'short': the arm at 50.00 m pushes")

    monkeypatch.setattr(temperature_table, "find_condition", refuse)
    with pytest.raises(EquilibriumError, match=r"^at -20 degC: line 'short': the arm at 50\.00 m pushes$"):
        over_temperature(line, ["-20 degC", "40 degC"])


def test_spans_have_the_tension_that_the_devices_leave(line):
    tensioning = Tensioning(
        temperature=288.15,
        reference_temperature=288.15,
        direction=1,
        contact_wire=TensioningDevice(efficiency=0.9),
        messenger_wire=TensioningDevice(kind="fixed"),
    )
    rubbed = span_table(Line(dataclasses.replace(line.definition, tensioning=tensioning)), limit=0.4)
    assert span_table(line, limit=0.4).tension == line.definition.contact_wire.tension
    assert rubbed.tension == pytest.approx(0.9 * line.definition.contact_wire.tension)


def test_a_loss_of_tension_counts_over_temperature_and_in_spans(line):
    lost = FAULT_KINDS["tension_loss"](kind="tension_loss", wire="contact_wire", value=0.2)
    weak = Line(dataclasses.replace(line.definition, fault=(lost,)))
    left = 0.8 * line.definition.contact_wire.tension
    assert span_table(weak, limit=0.4).tension == pytest.approx(left)
    titles, columns = over_temperature(weak, ["15 degC"]).tables["temperature"]
    assert columns[titles.index("contact_wire at the tensioner [N]")][0] == pytest.approx(left)
    sound = over_temperature(line, ["15 degC"]).states[0].waves.speed
    assert over_temperature(weak, ["15 degC"]).states[0].waves.speed == pytest.approx(0.8**0.5 * sound, rel=2e-3)


@pytest.fixture(scope="module")
def only_span(line_maker):
    return Line(line_maker(spans=1, ends={"spans": 0, "rise": [0.1, "m", "test"]}))


def test_a_line_of_one_span_has_no_supports_between_its_anchors(only_span):
    titles, columns = statics(only_span).tables["supports"]
    assert [len(column) for column in columns] == [0] * len(titles)
    assert span_table(only_span, head=1600).staggers == ((0.0, 0.0),)


@pytest.mark.parametrize(
    ("ask", "answer"),
    [
        (lambda line: in_wind(line, speed=29.0, pressure=500.0), "speed and pressure both say how strong the wind is"),
        (lambda line: in_wind(line, speed="104 m/s"), "speed 104: no wind is stronger than 100 m/s"),
        (lambda line: in_wind(line, speed="29 kg"), "speed: "),
        (lambda line: in_wind(line, limit=0.4, head=1600), "limit and head both say how far"),
        (lambda line: in_wind(line, head=1700), "head 1700: there are 1600, 1950"),
        (lambda line: in_wind(line, limit=-0.4), "limit: -0.4 must be greater than 0 m"),
        (lambda line: in_wind(line, section=2), "section 2: the line has sections 1 to 1"),
        (
            lambda line: over_temperature(line, [15.0]),
            "temperature 15.0 (a number is in K; write '15 degC'): is outside",
        ),
        (lambda line: over_temperature(line, ["warm"]), "temperature: 'warm' is not a number"),
        (lambda line: over_temperature(line, []), "temperatures: give at least one"),
        (lambda line: over_temperature(line, [288.0], section=0), "section 0: the line has sections 1 to 1"),
        (lambda line: span_table(line, speed=29.0), "how far may the wire be blown? give limit, in m, or head"),
        (lambda line: span_table(line, limit=0.4, radii=[0.0]), "radius: 0.0 must be greater than 0 m"),
        (lambda line: span_table(line, limit=0.4, staggers=[(0.2, "x")]), "stagger: 'x' is not a number"),
        (lambda line: in_wind(line, limit=400), "limit 400 m: no wire may be as far from the middle of the track"),
        (lambda line: in_wind(line, section="1"), "section: '1' is not a whole number"),
        (lambda line: statics(line, span=1.5), "span: 1.5 is not a whole number"),
        (lambda line: statics(line, force="20 kN"), "force 20000 N is more than any pantograph pushes with"),
        (lambda line: over_temperature(line, ["15 degC"], section=1.5), "section: 1.5 is not a whole number"),
        (lambda line: over_temperature(line, "15 degC"), "temperatures: '15 degC' is not a list"),
        (lambda line: over_temperature(line, [None]), "temperature: None is neither a number nor a text"),
        (lambda line: span_table(line, limit=400), "limit 400 m: no wire may be as far from the middle of the track"),
        (lambda line: span_table(line, limit=0.4, radii=800), "radii: 800 is not a list; write [800, 1200]"),
        (lambda line: span_table(line, limit=0.4, radii=[3]), "radius 3 m: no track is as tight; 15 m or more"),
        (lambda line: span_table(line, limit=0.4, staggers=(0.2, 0.1)), "staggers: 0.2 is not a pair"),
        (lambda line: span_table(line, limit=0.4, staggers=[(20, 20)]), "stagger 20 m is outside -1 ... 1 m"),
        (lambda line: in_wind(line).frame("winds"), "there is no table 'winds'; there are wind, plan, arms"),
    ],
)
def test_what_cannot_be_meant_is_told(line, ask, answer):
    with pytest.raises(ParameterError) as caught:
        ask(line)
    assert answer in str(caught.value)
