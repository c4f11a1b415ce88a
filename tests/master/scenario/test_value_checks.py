"""What the numbers of a scenario rule out before anything is run, shown by hand-made components, without FMUs."""

from pathlib import Path

import pytest

from master.scenario.value_checks import empty_cells, half_empty_rows, problems, stop_after_interval, uncovered
from master.ssp.run_settings import EvaluationInterval, RunSettings
from master.system.components import Component, Fmu, System, Variable
from master.system.connections import Connection
from master.system.pantograph_motion import final_position, parameter_value


def parameter(name, start, unit="m", causality="parameter", kind="Real"):
    return Variable(name, 0, kind, causality, "fixed", unit, start, None, None)


def pantograph(name="train", values=None, **starts):
    starts = {"start_position": "30", "speed": "80", "static_force": "160"} | starts
    units = {"static_force": "N", "static_moment": "N.m", "speed": "m/s"}
    variables = {n: parameter(n, s, units.get(n, "m")) for n, s in starts.items() if s != "none"}
    fmu = Fmu(Path("train.fmu"), "", "", variables, can_restore=True, sha256="", tool="")
    return Component(name, fmu, dict(values or {}), ("contact.force",), ("A.x",))


LINE = Component("line", Fmu(Path("line.fmu"), "", "", {}, can_restore=True, sha256="", tool=""), {}, (), ())


def system(*trains, stop=5.0, start=0.0, step=0.001, first=100.0, last=390.0):
    trains = trains or (pantograph(),)
    reported = [(t.name, f"pantograph[{i}].contact.force") for i, t in enumerate(trains, 1)]
    connections = tuple(Connection("line", output, name, "contact.force") for name, output in reported)
    settings = RunSettings(interval=EvaluationInterval(start=first, end=last))
    return System("one", (LINE, *trains), connections, start, stop, step, settings)


def test_values_come_from_the_scenario_first_then_from_the_fmu():
    assert parameter_value(pantograph(), "speed") == 80.0
    assert parameter_value(pantograph(values={"speed": 70.0}), "speed") == 70.0


@pytest.mark.parametrize(
    "variable",
    [
        parameter("speed", "80", causality="calculatedParameter"),
        parameter("speed", "80", kind="Integer"),
        parameter("speed", None),
        parameter("speed", "inf"),
        parameter("speed", "quick"),
    ],
)
def test_what_is_no_real_parameter_with_a_value_has_none(variable):
    fmu = Fmu(Path("train.fmu"), "", "", {"speed": variable}, can_restore=True, sha256="", tool="")
    assert parameter_value(Component("train", fmu, {}, (), ()), "speed") is None
    assert parameter_value(Component("train", fmu, {}, (), ()), "height") is None


def test_the_way_begins_at_the_start_time():
    assert final_position(system(start=2.0, stop=5.0), pantograph()) == pytest.approx(30.0 + 80.0 * 3.0)
    assert final_position(system(), pantograph(speed="none")) is None
    assert final_position(system(), pantograph(start_position="none")) is None


@pytest.mark.parametrize(
    ("stop", "ends"),
    [
        (4.5, False),  # 30 + 80 * 4.5 = 390 m, where the interval ends
        (4.4995, False),  # within a step of it
        (4.49, True),
        (4.0, True),
    ],
)
def test_a_stop_time_must_cover_the_interval(stop, ends):
    found = list(problems(system(stop=stop)))
    assert bool(found) == ends
    if found:
        assert f"ends at {stop:g} s with 'train' at {30 + 80 * stop:.6g} m, before the end of the interval" in found[0]
        assert 'stop at 4.5 s or later, or write until="end" into Interval, or run a part of it with --stop' in found[0]
    assert uncovered(system(stop=stop)) == "".join(found).removesuffix(", or run a part of it with --stop")


def test_the_cure_counts_from_the_start_time_and_rounds_up():
    (found,) = problems(system(start=2.0, stop=5.0, last=391.0))
    assert "stop at 6.6 s or later" in found  # 2 + 361 / 80 = 6.5125


def test_one_that_stands_is_told_its_speed():
    (found,) = problems(system(pantograph(speed="0")))
    assert "its speed is 0 m/s" in found


@pytest.mark.parametrize(("position", "begins"), [("100", False), ("100.05", False), ("100.2", True), ("500", True)])
def test_the_interval_begins_no_earlier_than_the_pantograph(position, begins):
    found = list(problems(system(pantograph(start_position=position))))
    assert bool(found) == begins
    if found:
        assert f"'train' starts at {position} m, beyond the start of the interval of interest, 100 m" in found[0]


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"start_height": 4.4}, "train.start_height = 4.4 m is below the lowest_height of 4.5 m"),
        ({"start_height": 6.3}, "train.start_height = 6.3 m is above the highest_height of 6.2 m"),
        ({"highest_height": 5.0}, "train.reference_height = 5.02 m is above the highest_height of 5 m"),
        ({"start_height": 4.5}, ""),
    ],
)
def test_a_strip_starts_between_its_stops(values, said):
    heights = {"start_height": "5", "reference_height": "5.02", "lowest_height": "4.5", "highest_height": "6.2"}
    found = list(problems(system(pantograph(values=values, **heights))))
    assert [text.partition(": between its stops the strip goes from 4.5 to ")[0] for text in found] == [said] * bool(
        said
    )
    low = [n for n in heights if n != "lowest_height"]
    (alone,) = problems(system(pantograph(values={"start_height": 7.0}, **{n: heights[n] for n in low})))
    assert alone == "train.start_height = 7 m is above the highest_height of 6.2 m"


def test_a_part_that_was_asked_for_may_end_early_but_not_be_idle():
    assert list(problems(system(stop=1.0), may_stop_early=True)) == []
    (found,) = problems(system(pantograph(static_force="0"), stop=1.0), may_stop_early=True)
    assert "train.static_force = 0 N never lifts the strip" in found


@pytest.mark.parametrize(("name", "unit"), [("static_force", "N"), ("static_moment", "N.m")])
@pytest.mark.parametrize("value", [0.0, -5.0])
def test_nothing_that_lifts_is_told(name, unit, value):
    starts = {"static_force": "none", name: "100"}
    assert list(problems(system(pantograph(**starts)))) == []
    (found,) = problems(system(pantograph(values={name: value}, **starts)))
    assert found == f"train.{name} = {value:g} {unit} never lifts the strip to the wire: give it more than 0"


def test_of_several_each_is_looked_at():
    second = pantograph("second", start_position="-70")
    (found,) = problems(system(pantograph("first"), second, stop=5.0))
    assert "with 'second' at 330 m" in found


def test_a_foreign_pantograph_is_not_judged_beforehand():
    assert list(problems(system(pantograph(speed="none", static_force="none"), stop=0.1))) == []


def test_the_run_goes_on_until_the_last_one_has_left_and_half_a_second_more():
    assert stop_after_interval(system()) == pytest.approx(4.5 + 0.5)
    second = pantograph("second", start_position="-70")
    for trains in ((pantograph("first"), second), (second, pantograph("first"))):
        assert stop_after_interval(system(*trains, start=2.0)) == pytest.approx(2.0 + 5.75 + 0.5)


def test_that_is_a_whole_number_of_steps_and_not_one_too_many():
    stop = stop_after_interval(system(step=0.3))
    assert stop == pytest.approx(5.1)  # 5.0 s are 16.67 steps
    assert stop_after_interval(system(step=0.5)) == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("train", "last", "said"),
    [
        (pantograph(), None, "has no end that the run could end at; give it one, or a stop time"),
        (
            pantograph(speed="none"),
            390.0,
            "the FMU of 'train' gives no speed, so when it leaves the interval is not known; give a stop time",
        ),
        (pantograph(speed="0"), 390.0, "train.speed = 0 m/s never leads to the end of the interval, 390 m"),
    ],
)
def test_why_there_is_no_such_time(train, last, said):
    assert said in stop_after_interval(system(train, last=last))


def test_without_a_pantograph_there_is_none():
    alone = System("one", (LINE,), (), 0.0, 1.0, 0.001, RunSettings(interval=EvaluationInterval(start=1.0, end=2.0)))
    assert "no pantograph receives a contact force" in stop_after_interval(alone)


def test_an_empty_cell_of_the_line_is_told_and_one_of_a_pantograph_is_not():
    assert empty_cells(system(), ["train.static_force"]) == ""
    found = empty_cells(system(), ["train.static_force", "line.tension", "liner.x"])
    assert found == "the table has no value for line.tension: write one into every row"


def test_a_row_that_fills_some_cells_of_a_pantograph_or_none_of_any_is_told():
    assert half_empty_rows(system(), [], []) == ""
    found = half_empty_rows(system(), ["train.static_force"], [])
    assert found.startswith("the table has no value for train.static_force: write one, or leave all cells")
    found = half_empty_rows(system(), ["train.static_force", "train.start_position"], ["train"])
    assert found == "the table leaves out every pantograph (train): write the values of one of them"
