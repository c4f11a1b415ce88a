"""Whole optimisations: known optima, constraints, failed runs, the files, and going on after an end in their midst."""

import csv
import json
from dataclasses import replace

import pytest

from master.batch.optimisation.optimisation_goal import OptimisationRequest
from master.batch.optimisation.optimisation_page import command, lines, page
from master.batch.optimisation.optimisation_session import PreparedOptimisation, optimise
from master.batch.sweep.sweep_engines import HereEngine
from master.commands.main import main
from master.errors import InterruptedRunError, MasterError
from master.run_session import run
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from tests.master.batch.optimisation.conftest import Computed


def test_the_bottom_of_a_bowl_is_found(optimised, tmp_path):
    shown = []
    done = optimised(show=shown.append, max_runs=30)
    best = done.best
    assert done.point(best) == pytest.approx([0.3], abs=5e-3)
    assert done.value(best) == pytest.approx(10.0, abs=1e-4)
    assert done.start == pytest.approx(10.0 + 4.0 * 0.36)
    assert done.improvement == pytest.approx(1.44 / 11.44, abs=1e-4)
    assert done.at_bounds == {}
    assert (done.status, len(done.runs) <= 30, done.failures) == ("complete", True, {})
    data = json.loads((tmp_path / "out" / "optimise.json").read_text())
    assert data["best"]["value"] == done.value(best)
    assert data["parameters"][0]["best"] == done.point(best)[0]
    rows = list(csv.DictReader((tmp_path / "out" / "optimise.csv").open()))
    assert [int(row["run"]) for row in rows] == list(range(1, len(done.runs) + 1))
    assert float(rows[best.number - 1]["f.depth end [1]"]) == done.value(best)
    assert str(shown[-1]) == f"{len(rows)} of at most 30 runs done, 0 failed, best f.depth end 10.00"


def test_runs_of_the_fmu_give_what_was_worked_out(optimised):
    computed, made = optimised("computed", max_runs=10), optimised("run", HereEngine(), max_runs=10)
    assert [computed.point(r) for r in computed.runs] == [made.point(r) for r in made.runs]
    values = [computed.value(r) for r in computed.runs]
    assert [made.value(r) for r in made.runs] == pytest.approx(values, rel=1e-9)
    assert made.best.number == computed.best.number


def test_a_constraint_is_kept_and_a_bound_is_told(optimised):
    done = optimised(vary={"f.a": "0.25:1", "f.b": "0:1"}, subject_to=["f.sum end>=1.3"], max_runs=70)
    a, b = done.point(done.best)
    assert a + b >= 1.3
    # 4 (a - 0.3)^2 + (b - 0.62)^2 on the line a + b = 1.3: a = 0.3 + 0.38 / 5
    assert (a, b) == pytest.approx((0.376, 0.924), abs=0.03)
    assert done.value(done.best) == pytest.approx(10.0 + 0.38**2 * 0.8, abs=3e-3)
    edge = optimised("edge", vary={"f.a": "0.5:1"}, max_runs=25)
    assert edge.at_bounds == {"f.a": "lower"}
    assert any("at its lower bound" in line for line in lines(edge))


def test_failed_runs_are_rows_and_the_search_goes_round_them(optimised, tmp_path):
    done = optimised(parameters={"f.fail_below": "0.4"}, max_runs=25)
    assert done.point(done.best) == pytest.approx([0.4], abs=0.01)
    assert done.failures
    assert all("a is too small" in reason for reason in done.failures.values())
    assert "too small" in (tmp_path / "out" / "optimise.csv").read_text()
    assert "Runs that failed" in page(done)


def test_greatest_is_the_other_way_round(optimised):
    done = optimised(minimise=None, maximise="f.depth mean", max_runs=12)
    assert done.value(done.best) == max(done.value(r) for r in done.runs)
    assert done.improvement >= 0.0


def test_what_no_run_keeps_is_said(optimised):
    done = optimised(subject_to=["f.sum end>=5"], max_runs=8)
    assert done.best is None
    assert next(lines(done)).startswith("no run keeps f.sum end >= 5; the nearest misses by ")
    assert "no run keeps" in page(done)


def test_after_an_interruption_the_best_is_there_and_the_rest_is_made(optimised, tmp_path):
    whole = Computed()
    optimised("whole", whole, max_runs=14)
    with pytest.raises(
        InterruptedRunError, match=r"interrupted\. 9 runs are finished, best f\.depth end 1\d\.\d+, in "
    ):
        optimised("cut", Computed(interrupt_at=9), max_runs=14)
    data = json.loads((tmp_path / "cut" / "optimise.json").read_text())
    assert (data["status"], data["runs"]) == ("interrupted", 9)
    assert data["best"]["value"] < data["start"]
    rest = Computed()
    optimised("cut", rest, max_runs=14)
    assert rest.made == whole.made - 9
    assert (tmp_path / "cut" / "optimise.csv").read_bytes() == (tmp_path / "whole" / "optimise.csv").read_bytes()


def test_another_folder_is_left_alone(optimised, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("mine")
    with pytest.raises(MasterError, match="is no optimisation of this tool"):
        optimised(max_runs=8)


def test_an_optimisation_of_another_scenario_is_left_alone(optimised, tmp_path):
    optimised(max_runs=8)
    file = tmp_path / "out" / "optimise.json"
    before = file.read_text().replace('"scenario": "bowl"', '"scenario": "plate"')
    file.write_text(before)
    with pytest.raises(MasterError, match="holds an optimisation of the scenario 'plate', this one is of 'bowl'"):
        optimised(max_runs=8)
    assert file.read_text() == before


def test_the_command_that_is_told_makes_the_best_run_again(toy_system, toy, tmp_path):
    """With the mean force held: the static force that was found is part of the command."""
    request = {"minimise": "sigma", "vary": {"pantograph.damping": "100:400"}, "subject_to": ["mean=120N"]}
    prepared = PreparedOptimisation.of(toy_system, OptimisationRequest.read({**request, "max_runs": 1}), str(toy))
    done = optimise(prepared, tmp_path / "out", page)
    best = done.best
    assert done.rows_of(best)[0]["mean [N]"] == pytest.approx(120.0, abs=0.2)
    assert done.value(best) == min(done.value(r) for r in done.runs)
    words = command(done, best).split(" --set ")
    assert words[0] == f"openpanto run {toy}"
    values = dict(word.strip("'").split("=") for word in words[1:])
    assert set(values) == {"pantograph.damping", "pantograph.static_force"}
    with open_scenario(toy, Overrides(parameters=values), build=False) as found:
        again = run(found.system, tmp_path / "again").assessments()[0].quality
    assert again.sigma == done.value(best)


def test_what_all_runs_were_given_is_kept_and_part_of_the_command(toy, tmp_path):
    request = {"minimise": "sigma", "vary": {"pantograph.damping": "100:400"}, "max_runs": 1}
    overrides = Overrides(parameters={"catenary.stiffness": "5000"}, step=0.002, scheme="gauss-seidel")
    with open_scenario(toy, overrides, build=False) as found:
        wanted = OptimisationRequest.read(request)
        prepared = PreparedOptimisation.of(found.system, wanted, str(toy), overrides.options)
        done = optimise(prepared, tmp_path / "out", page)
    told = command(done, done.best)
    assert told.startswith(f"openpanto run {toy} --set catenary.stiffness=5000 --set ")
    assert told.endswith(" --step 0.002 --scheme gauss-seidel")
    assert json.loads((tmp_path / "out" / "optimise.json").read_text())["changes"] == {"catenary.stiffness": "5000"}
    assert "In all runs: catenary.stiffness = 5000." in (tmp_path / "out" / "optimise.html").read_text()
    with open_scenario(toy, Overrides(stop=1.5), build=False) as found:
        stopped = OptimisationRequest.read({**request, "stop": 1.5})
        begun = PreparedOptimisation.of(found.system, stopped, str(toy)).outcome
    assert "--stop 1.5" in command(replace(done, request=begun.request), done.best)


def test_runs_that_end_too_soon_to_have_figures_have_failed_and_the_reason_is_told(toy, tmp_path, capsys):
    wanted = ["--minimise", "sigma", "--vary", "catenary.stiffness=4000:5000", "--out", str(tmp_path / "out")]
    assert main(["optimise", str(toy), *wanted, "--stop", "0.3", "--max-runs", "1", "--no-build"]) == 1
    said = capsys.readouterr().out
    assert "no run has the figure sigma (1 runs, 1 failed); run 1: " in said
    assert "before the end of the interval of interest" in said
