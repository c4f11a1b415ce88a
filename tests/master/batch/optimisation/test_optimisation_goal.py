"""What can be asked of an optimisation, and what is refused in one sentence before anything runs."""

import math

import pytest

from master.batch.optimisation.optimisation_goal import Goal, OptimisationRequest, read_bounds, sweep_request
from master.batch.optimisation.optimisation_session import PreparedOptimisation
from master.batch.sweep.sweep_run import SweepResult
from master.errors import RequestError

STIFFNESS = {"vary": {"catenary.stiffness": "4000:6000"}}


def goal_of(system, **request):
    return Goal.read(system, OptimisationRequest.read({"minimise": "sigma", **request}))


def result(*rows):
    return SweepResult("k", tuple(rows))


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        ({"minimise": "sigam"}, "there is no figure 'sigam'; did you mean 'sigma'?; known: mean, sigma"),
        ({"maximise": "mean"}, "give --minimise or --maximise"),
        ({"minimise": None}, "give --minimise or --maximise"),
        ({"vary": {}}, "nothing is varied: give --vary NAME=LOW:HIGH"),
        ({"vary": {"catenary.stifness": "1:2"}}, "did you mean 'catenary.stiffness'"),
        ({"vary": {"catenary.stiffness": "6000:4000"}}, "catenary.stiffness: the bounds 6000:4000 must rise"),
        ({"vary": {"catenary.stiffness": "1:1"}}, "must rise"),
        ({"vary": {"catenary.stiffness": "1:2:3"}}, "bounds are written LOW:HIGH, not '1:2:3'"),
        ({"vary": {"catenary.stiffness": "uniform(1, 2)"}}, "bounds are written LOW:HIGH"),
        ({"vary": {"catenary.stiffness": "a:2"}}, "'a' is not a number"),
        ({"vary": {"catenary.stiffness": "1:2 kN"}}, "'kN' does not fit"),
        ({"vary": {"speed": "40:60", "pantograph.speed": "40:60"}}, "'pantograph.speed' is varied twice"),
        ({"vary": {"pantograph.static_force": "-5:150"}}, "run 2 (pantograph.static_force = -5.0): "),
        ({"subject_to": ["sigma=3N"]}, "only the mean force can be held at a value; bound sigma by <= or >="),
        ({"subject_to": ["mean=1N", "mean=2N"]}, "held at two values"),
        ({"subject_to": ["mean=much"]}, "is not a force over the speed"),
        ({"minimise": "mean", "subject_to": ["mean=100N"]}, "so it cannot be optimised as well"),
        ({"subject_to": ["mean=100N"], "vary": {"static_force": "100:150"}}, "so it cannot be varied as well"),
        ({"subject_to": ["maximum<=350"]}, "'maximum<=350' needs a unit, as in '350 N'"),
        ({"subject_to": ["maximum<=350 mm"]}, "'mm' does not fit, give it in a unit of N"),
        ({"subject_to": ["maximum<=nan N"]}, "'nan N' is not a number"),
        ({"subject_to": ["maximal<=350N"]}, "there is no figure 'maximal'; did you mean 'maximum'"),
        ({"subject_to": ["maximum"]}, "is no constraint, such as 'mean=157.5 N' or 'maximum<=350 N'"),
        (
            {"subject_to": ["maximum<=100N", "maximum>=200N"]},
            "nothing can keep both maximum >= 200 N and",
        ),
        ({"max_runs": 0}, "max_runs"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_what_cannot_be_is_one_sentence(toy_system, request_, said):
    with pytest.raises(RequestError) as caught:
        PreparedOptimisation.of(toy_system, OptimisationRequest.read({"minimise": "sigma", **STIFFNESS, **request_}))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_bounds_have_the_unit_that_is_written_and_start_where_the_scenario_is(toy_system):
    request = OptimisationRequest.read({"vary": {"speed": "150:200", "static_force": "100:130"}})
    speed, force = read_bounds(toy_system, request)
    assert (speed.parameter.unit, speed.low, speed.high) == ("", 150.0, 200.0)
    assert force.start == 115.0, "140 N lie outside"
    assert speed.start == 175.0
    assert [force.value(s) for s in (0.0, 0.5, 1.0)] == [100.0, 115.0, 130.0]
    assert [force.bound_at(v) for v in (100.0, 100.2, 129.9)] == ["lower", "", "upper"]


def test_figures_of_a_scenario_without_a_contact_are_those_of_its_outputs(bowl_system):
    goal = goal_of(bowl_system, minimise="f.depth end", subject_to=["f.sum maximum<=1.5"])
    assert (goal.figure, goal.unit) == ("f.depth end", "1")
    with pytest.raises(RequestError, match=r"no figure 'sigma'; known: f\.depth end"):
        goal_of(bowl_system)
    with pytest.raises(RequestError, match="there is no figure 'mean'"):
        goal_of(bowl_system, minimise="f.depth end", subject_to=["mean=100N"])


def test_the_worst_pantograph_counts(toy_system):
    rows = {"sigma [N]": 20.0}, {"sigma [N]": 30.0}
    assert goal_of(toy_system).value(result(*rows)) == 30.0
    assert goal_of(toy_system, minimise=None, maximise="sigma").value(result(*rows)) == 20.0
    assert goal_of(toy_system).value(result({"sigma [N]": 20.0}, {"sigma [N]": None})) is None


def test_merits_rank_failed_below_broken_below_kept(toy_system):
    goal = goal_of(toy_system, subject_to=["maximum<=300 N", "uplift>=0.01 m"])

    def row(sigma, maximum, uplift=50.0):
        return {"sigma [N]": sigma, "maximum [N]": maximum, "uplift [mm]": uplift}

    kept, worse, near, far = (
        goal.merit(result(row(*v))) for v in ((20.0, 300.0), (40.0, 200.0), (10.0, 301.0), (1.0, 400.0))
    )
    assert kept == 20.0
    assert kept < worse < near < far < math.inf
    assert goal.merit(SweepResult("k", reason="broke")) == math.inf
    assert goal.merit(result({"sigma [N]": 20.0})) == math.inf
    assert goal.excess(result(row(1.0, 330.0), row(1.0, 100.0, 5.0))) == pytest.approx(0.1 + 0.5)
    assert goal_of(toy_system, minimise=None, maximise="mean").merit(result({"mean [N]": 7.0})) == -7.0


def test_what_is_held_is_found_in_each_run(toy_system):
    goal = goal_of(toy_system, subject_to=["mean = 70 N + 0.00097 v^2"])
    request = OptimisationRequest.read({"tolerance": 0.5, **STIFFNESS})
    assert sweep_request(request, goal, read_bounds(toy_system, request)).mean_force == "70 N + 0.00097 v^2"
    assert goal.text == "least sigma with mean = 70 N + 0.00097 v^2"
