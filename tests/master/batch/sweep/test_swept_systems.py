"""The runs of a plan: stop times and forces that follow the speed, identities, and what no run can have."""

from dataclasses import replace

import pytest

from master.batch.sweep.sweep_plan import SweepRequest, make_plan
from master.batch.sweep.swept_systems import ForceLaw, SweepRun, make_runs, scenario_setting
from master.errors import RequestError
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides


def _runs(system, **request):
    wanted = SweepRequest.read(request)
    return make_runs(system, make_plan(system, wanted), wanted)


def test_the_stop_time_follows_the_speed(toy_system):
    assert [r.stop for r in _runs(toy_system, over={"speed": "25,50,100"})] == pytest.approx([2.0, 1.0, 0.5])
    assert [r.stop for r in _runs(toy_system, over={"catenary.stiffness": "1,2"})] == [1.0, 1.0]
    assert [r.stop for r in _runs(toy_system, over={"speed": "50,55"}, stop=0.95)] == [0.95, 0.95]
    assert [r.stop for r in _runs(toy_system, over={"speed": "50", "stop": "1,2"})] == [1.0, 2.0]


def test_values_of_all_runs_are_kept_as_they_were_given(toy, toy_system):
    request = SweepRequest.read({"over": {"speed": "50"}})
    with open_scenario(toy, Overrides(parameters={"catenary.stiffness": "5000"}), build=False) as found:
        setting = scenario_setting(found.system, make_plan(found.system, request))
    assert setting["changes"] == {"catenary.stiffness": "5000"}
    assert "changes" not in scenario_setting(toy_system, make_plan(toy_system, request))


def test_the_title_of_a_run_names_its_values(toy_system):
    base = replace(toy_system, title="toy at 36 km/h")
    runs = _runs(base, over={"speed": "72", "catenary.stiffness": "4000,8000"})
    assert [run.system(base).title for run in runs] == [
        "toy at 36 km/h, with speed = 72, catenary.stiffness = 4000",
        "toy at 36 km/h, with speed = 72, catenary.stiffness = 8000",
    ]
    many = SweepRun(1, "key", {}, 1.0, 0.001, inputs={f"p[{k}] [N/m]": float(k) for k in range(6)} | {"absent": None})
    assert (
        many.system(base).title
        == "toy at 36 km/h, with " + ", ".join(f"p[{k}] = {k} N/m" for k in range(4)) + " and 2 more"
    )
    assert SweepRun(1, "key", {}, 1.0, 0.001).system(base).title == "toy at 36 km/h"


@pytest.mark.parametrize(
    ("text", "speed", "force"),
    [
        ("70 N + 0.00097 v^2", 300.0, 157.3),
        ("70+0.00047*v²", 100.0, 74.7),
        ("157.5 N", 200.0, 157.5),
        ("60 N + 1e-3 v**2", 200.0, 100.0),
    ],
)
def test_a_force_over_the_speed(text, speed, force):
    assert ForceLaw.read(text)(speed) == pytest.approx(force)


@pytest.mark.parametrize("text", ["", "much", "70 N + v", "-3 N", "70 kg"])
def test_no_force_over_the_speed(text):
    with pytest.raises(RequestError, match="is not a force over the speed"):
        ForceLaw.read(text)


def test_the_static_force_follows_the_speed(toy_system):
    runs = _runs(toy_system, over={"speed": "50,75"}, static_force="70 N + 0.001 v^2")
    forces = [r.system(toy_system).component("pantograph").parameters["static_force"] for r in runs]
    assert forces == pytest.approx([70.0 + 0.001 * 180.0**2, 70.0 + 0.001 * 270.0**2])
    assert [r.target for r in _runs(toy_system, over={"speed": "50"}, mean_force="100 N")] == [100.0]
    with pytest.raises(RequestError, match="not both"):
        _runs(toy_system, over={"speed": "50"}, mean_force="100 N", static_force="100 N")


def test_equal_runs_have_equal_keys_whatever_else_is_in_the_plan(toy_system):
    few = {r.inputs["catenary.stiffness"]: r.key for r in _runs(toy_system, over={"catenary.stiffness": "4000,5000"})}
    many = {
        r.inputs["catenary.stiffness"]: r.key for r in _runs(toy_system, over={"catenary.stiffness": "3000:6000:500"})
    }
    assert few.items() <= many.items()
    assert len(set(many.values())) == len(many)
    longer = _runs(toy_system, over={"catenary.stiffness": "4000"}, stop=1.2)
    assert longer[0].key not in many.values()


@pytest.mark.parametrize(
    ("over", "said"),
    [
        ({"pantograph.static_force": "100,-5"}, "run 2 (pantograph.static_force = -5.0): "),
        ({"stop": "1,-1"}, "run 2 (stop = -1.0 s): stop = -1 s and step = 0.001 s do not go together"),
        ({"step": "1,5"}, "run 2 (step = 5.0 s): "),
    ],
)
def test_the_first_run_that_cannot_be_made_is_named(toy_system, over, said):
    with pytest.raises(RequestError) as caught:
        _runs(toy_system, over=over)
    assert str(caught.value).startswith(said)


def test_a_mean_force_of_nothing_is_one_sentence(toy_system):
    with pytest.raises(RequestError, match="the mean force '0 N' must be greater than 0"):
        _runs(toy_system, over={"speed": "40"}, mean_force="0 N")
