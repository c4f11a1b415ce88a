"""Grids, samples and tables, together and apart; everything is checked before anything runs."""

import re

import pytest

from master.batch.sweep.sweep_plan import SweepRequest, check_overridden, listed_faults, make_plan, stored_request
from master.errors import RequestError
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides


def _plan(system, **request):
    return make_plan(system, SweepRequest.read(request))


def test_a_grid_has_every_value_with_every_other(toy_system):
    plan = _plan(toy_system, over={"speed": "40,50", "catenary.stiffness": "1:3:1"})
    assert plan.points == tuple((v, k) for v in (40.0, 50.0) for k in (1.0, 2.0, 3.0))


def test_samples_are_repeated_at_every_point_of_the_grid(toy_system):
    plan = _plan(toy_system, over={"speed": "40,50"}, vary={"catenary.stiffness": "normal(5000, 10)"}, samples=4)
    assert [p[0] for p in plan.points] == [40.0] * 4 + [50.0] * 4
    assert [p[1] for p in plan.points[:4]] == [p[1] for p in plan.points[4:]]
    assert len({p[1] for p in plan.points}) == 4


def test_a_table_names_its_rows_and_has_units_in_heads_or_cells(toy_system, tmp_path):
    table = tmp_path / "t.csv"
    table.write_text("variant,stop [ms],catenary.stiffness\nsoft,1500,4000\nhard,2 s,8000\n")
    plan = _plan(toy_system, table=table)
    assert [p.unit for p in plan.parameters] == ["s", ""]
    assert plan.variants == ("soft", "hard")
    assert plan.points == ((1.5, 4000.0), (2.0, 8000.0))
    assert len(_plan(toy_system, table=table, over={"speed": "40,50"}).variants) == 4


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        ({}, "nothing is varied"),
        ({"vary": {"speed": "normal(1, 1)"}}, "samples need --samples"),
        (
            {"samples": 3},
            "--samples without --vary varies seeds, and there is none; or say with --vary what else varies",
        ),
        ({"faults": (3,)}, "--faults: no component is a line FMU of ours"),
        ({"over": {"speed": "1,2", "pantograph.speed": "1,2"}}, "'pantograph.speed' is varied twice"),
        ({"over": {"speed": "1:1000:1", "catenary.stiffness": "1:1000:1"}}, "more than 100000"),
        ({"over": {"speed": "1,2"}, "colour": "red"}, "colour"),
        ({"over": {"speed": "1,2"}, "samples": 0}, "samples"),
        ({"over": {"speed": "1,2"}, "method": "dice"}, "method"),
        ({"over": {"speed": "1,2"}, "method": "sobol"}, "--seed and --method are of samples"),
        ({"over": {"speed": "1,2"}, "seed": 2}, "--seed and --method are of samples"),
        ({"over": {"speed": "1,2"}, "tolerance": 2.0}, "--mean-tolerance is of --mean-force"),
        ({"over": {"speed": "1,2"}, "check": 2}, "--check is of --engine lanes"),
        ({"over": {"stop": "1,2"}, "stop": 1.0}, "the stop time is varied"),
        ({"over": {"static_force": "1,2"}, "static_force": "70 N"}, "leave out one, or --static-force"),
        ({"over": {"pantograph.static_force": "1,2"}, "mean_force": "70 N"}, "leave out one, or --mean-force"),
        ({"vary": {"speed": "uniform(1, 2)"}, "samples": 3, "sensitivity": "morris"}, "needs at least 4 samples"),
    ],
)
def test_what_cannot_be_is_one_sentence(toy_system, request_, said):
    with pytest.raises(RequestError) as caught:
        _plan(toy_system, **request_)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "has no row"),
        ("catenary.stiffness\n", "has no row"),
        ("variant\nsoft\n", "has no column of values"),
        ("catenary.stifness\n1\n", "did you mean 'catenary.stiffness'"),
        ("catenary.stiffness,speed\n1\n", "line 2: has 1 cells, the head has 2"),
        ("catenary.stiffness,speed\n\n1,2\n\n1\n", "line 5: has 1 cells, the head has 2"),
        ("catenary.stiffness;speed\n4000,5;1\n", "its cells are separated by semicolons; separate them by commas"),
        ("catenary.stiffness\n\ud800\n", "is not UTF-8 text (line 2): save it as UTF-8"),
        ("catenary.stiffness\nmuch\n", "'much' is not a number"),
        ("catenary.stiffness,catenary.stiffness\n1,2\n", "more than once"),
        ("catenary.stiffness,stop [s]\n1,\n", "has an empty cell"),
        ("variant,catenary.stiffness\na,1\nb,2\na,3\n", "two rows are named 'a'"),
        ("variant,catenary.stiffness\na,1\n,2\n", "column 'variant' has an empty cell; name every row"),
    ],
)
def test_a_table_that_cannot_be_used_is_one_sentence(toy_system, tmp_path, text, said):
    table = tmp_path / "t.csv"
    table.write_text(text, encoding="utf-8", errors="surrogatepass")
    with pytest.raises(RequestError) as caught:
        _plan(toy_system, table=table)
    assert said in str(caught.value)
    assert str(table) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_all_runs_are_given_cannot_be_varied(toy_system):
    plan = _plan(toy_system, over={"speed": "40,50", "step": "0.001,0.002"})
    check_overridden(plan, ["pantograph.static_force"])
    for name in ("pantograph.speed", "step"):
        with pytest.raises(RequestError, match=f"'{name}' is varied, so it cannot be given"):
            check_overridden(plan, [name])


def test_a_study_may_hold_a_sweep(toy_system, toy):
    (toy / "study.toml").write_text('title = "t"\n[sweep]\nkeep = "failed"\n[sweep.over]\nspeed = "40,50"\n')
    assert len(_plan(toy_system, **stored_request(toy)).points) == 2
    (toy / "study.toml").write_text("sweep = 1\n")
    with pytest.raises(RequestError, match="must be a table"):
        stored_request(toy)


@pytest.fixture(scope="module")
def faulted():
    with open_scenario("cx_ln2", Overrides(faults=(3,), stop=1.0, may_stop_early=True)) as scenario:
        yield scenario.system


def test_droppers_break_one_after_the_other_the_first_run_has_none_broken(faulted):
    plan = _plan(faulted, faults=(3,))
    assert [p.name for p in plan.parameters] == [f"catenary.fault[{k}].active" for k in range(1, 8)]
    assert plan.points[0] == ("0",) * 7
    assert [point.index("1") for point in plan.points[1:]] == list(range(7))
    assert {point.count("1") for point in plan.points[1:]} == {1}
    assert plan.variants[:2] == ("healthy", "catenary.fault[1].active")
    assert len(_plan(faulted, faults=(3,), over={"speed": "70,80"}).points) == 16


def test_samples_alone_are_those_of_seeds_that_draw_something(faulted):
    """More of them add to those that there are; another --seed shares none; each has its place in a grid beside it."""
    grid = {"catenary.irregularity.stagger_sigma": "0,10mm"}
    plan = _plan(faulted, over=grid, samples=3)
    assert [p.name for p in plan.parameters] == [*grid, "catenary.irregularity.seed"]
    assert [p[1] for p in plan.points] == ["1", "2", "3"] * 2
    assert [p[1] for p in _plan(faulted, over=grid, samples=2, seed=3).points[:2]] == ["200001", "200002"]
    with pytest.raises(RequestError, match=r"catenary\.irregularity\.seed: nothing is drawn while all sigmas are 0"):
        _plan(faulted, samples=3)
    for seed in (0, 21475):
        with pytest.raises(RequestError, match=f"--seed {seed}: samples of seeds take one from 1 to 21474"):
            _plan(faulted, over=grid, samples=3, seed=seed)
    with pytest.raises(RequestError, match="there is none"):
        _plan(faulted, over={"catenary.irregularity.seed": "1:4:1"}, samples=3)


def test_faults_are_of_droppers_or_arms_of_spans():
    assert listed_faults((3, 4), ()) == {"faults": (3, 4)}
    assert listed_faults(3, ()) == {"faults": (3,)}
    assert listed_faults("each-dropper", 3) == {"faults": (3,), "faults_of": "each-dropper"}
    assert listed_faults("each-arm", (3, 4)) == {"faults": (3, 4), "faults_of": "each-arm"}
    name = Overrides(faults=(3, 4), faults_of="each-arm").source("resources/Catenary_LN2_P2.fmu")
    assert name == "resources/Catenary_LN2_P2_A3A4.fmu"


@pytest.mark.parametrize(
    ("faults", "span", "said"),
    [
        ("each-arm", (), "--faults each-arm needs --span K: of which span of the line?"),
        ((3,), (4,), "--span is of --faults each-dropper and --faults each-arm: give one of them too"),
        ((), 4, "--span is of --faults each-dropper"),
        ("each-drooper", 3, "'each-drooper' is none of each-dropper, each-arm; did you mean 'each-dropper'?"),
    ],
)
def test_faults_without_a_span_or_of_nothing_are_refused(faults, span, said):
    with pytest.raises(RequestError, match=re.escape(said)):
        listed_faults(faults, span)


def test_faults_and_a_table_both_list_runs(faulted, tmp_path):
    (tmp_path / "t.csv").write_text("speed\n70\n")
    with pytest.raises(RequestError, match="--faults and --from-csv both list runs"):
        _plan(faulted, faults=(3,), table=tmp_path / "t.csv")
