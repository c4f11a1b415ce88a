"""Times that are no whole number of steps are not changed without a word."""

from __future__ import annotations

import json

import pytest

from master.commands.main import main
from master.recording.checkpoint import scheme_options
from master.ssp.run_settings import Coupling, Record, RunSettings
from master.system.components import System
from master.system.step_rounding import adjustments, steps_in
from tests.master.scenario.test_scenario_advice import LINE


def system(stop=0.5, step=1e-3, start=0.0, **settings):
    return System("s", (LINE,), (), start, stop, step, RunSettings.model_validate(settings))


@pytest.mark.parametrize(("stop", "step"), [(0.5, 1e-3), (0.3, 0.1), (1.0, 1.0 / 3.0), (600.0, 1e-3), (0.7, 7e-4)])
def test_whole_numbers_of_steps_are_kept_to_however_they_round(stop, step):
    assert adjustments(system(stop, step)) == ()


@pytest.mark.parametrize(("start", "end"), [(0.0, "0.498"), (10.0, "10.498")])
def test_an_end_between_two_steps_is_told(start, end):
    (said,) = adjustments(system(start + 0.5, 0.003, start))
    assert said.startswith(f"the run ends at {end} s, not at ")
    assert said.endswith("which is no whole number of steps of 0.003 s")


def test_a_period_of_checkpoints_is_told():
    assert adjustments(system(), 0.1) == ()
    (said,) = adjustments(system(), 0.0102)
    assert said.startswith("checkpoints are written every 0.01 s, not 0.0102 s")


@pytest.mark.parametrize(("period", "step", "steps"), [(0.005, 0.003, 2), (1e-9, 1e-3, 1), (0.005, 0.001, 5)])
def test_a_period_is_at_least_one_step(period, step, steps):
    assert steps_in(period, step) == steps


def test_a_run_tells_it_in_words_and_in_its_summary(toy, tmp_path, capsys):
    times = ["--stop", "0.5", "--step", "0.003"]
    assert main([str(toy), "--no-build", "--no-report", *times, "--out", str(tmp_path / "out")]) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert "warning: the run ends at 0.498 s, not at 0.5 s, which is no whole number of steps of 0.003 s" in said
    assert "recorded every 0.006 s, not 0.005 s" in said
    found = json.loads((tmp_path / "out/summary.json").read_text())
    assert len(found["adjustments"]) == 2
    assert (tmp_path / "out" / "timeseries_6ms.csv").is_file()
    assert main(["report", str(tmp_path / "out")]) == 0
    assert "not at 0.5 s" in (tmp_path / "out" / "report.html").read_text()


def test_a_run_that_keeps_to_its_times_says_nothing(toy, tmp_path, capsys):
    assert main([str(toy), "--no-build", "--no-report", "--stop", "0.1", "--out", str(tmp_path / "out")]) == 0
    assert "warning" not in capsys.readouterr().err
    assert json.loads((tmp_path / "out/summary.json").read_text())["adjustments"] == []


def test_only_rates_at_which_something_is_recorded_are_told():
    records = [Record(variables=("*.nothing",), every=0.0052)]
    assert adjustments(system(records=records)) == ()


def test_validate_tells_it(toy, capsys):
    text = (toy / "SystemStructure.ssd").read_text()
    (toy / "SystemStructure.ssd").write_text(text.replace('stopTime="1.0"', 'stopTime="1.0005"'))
    assert main(["validate", str(toy), "--no-build"]) == 0
    assert "the run ends at 1 s, not at 1.0005 s" in " ".join(capsys.readouterr().err.split())


def test_options_of_a_scheme_as_a_checkpoint_keeps_them():
    def options(**coupling):
        return scheme_options(system(coupling=Coupling.model_validate(coupling)))

    assert options(scheme="jacobi", order=("line",)) == {}
    assert options(scheme="gauss-seidel") == {"order": ["line"]} == options(scheme="gauss-seidel", order=("line",))
    assert options(scheme="iterative", maxIterations=7)["max_iterations"] == 7


@pytest.mark.parametrize(
    ("first", "then", "said"),
    [
        (
            'scheme="gauss-seidel" order="catenary pantograph"',
            'scheme="gauss-seidel" order="pantograph catenary"',
            "the order of its scheme was catenary pantograph, is pantograph catenary",
        ),
        (
            'scheme="iterative" tolerance="1e-6"',
            'scheme="iterative" tolerance="1e-4"',
            "the tolerance of its scheme was 1e-06, is 0.0001",
        ),
        ('scheme="jacobi" order="catenary pantograph"', 'scheme="jacobi" order="pantograph catenary"', ""),
        ('scheme="gauss-seidel"', 'scheme="gauss-seidel" order="catenary pantograph"', ""),
    ],
)
def test_a_run_does_not_go_on_with_other_options_of_its_scheme(toy, tmp_path, capsys, first, then, said):
    ssd, folder = toy / "SystemStructure.ssd", tmp_path / "out"
    text = ssd.read_text()

    def couple(options):
        ssd.write_text(text.replace("<panto:Interval", f"<panto:Coupling {options}/><panto:Interval", 1))

    couple(first)
    plain = ["--no-build", "--no-report", "--quiet", "--stop"]
    assert main([str(toy), *plain, "0.1", "--checkpoint-every", "0.05", "--out", str(folder)]) == 0
    couple(then)
    code = main([str(toy), *plain, "0.2", "--resume", str(folder)])
    assert code == (1 if said else 0)
    assert said in " ".join(capsys.readouterr().err.split())
