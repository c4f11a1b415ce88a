"""Whole runs with toy FMUs: files, figures, failures, interruption."""

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from master.errors import MasterError, RunError
from master.evaluation.contact_positions import strip_centre, track_position
from master.recording.recording import load
from master.results import run_results
from master.run_session import run
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from tests import forked_commands

ROOT = Path(__file__).parents[2]
FORCE = "catenary.pantograph[1].contact.force"


def go(toy, folder, **overrides):
    asked = Overrides(**overrides, may_stop_early="stop" in overrides)
    with open_scenario(toy, asked, build=False) as scenario:
        return run(scenario.system, folder)


@pytest.fixture
def done(toy, tmp_path):
    return go(toy, tmp_path / "out")


def test_files_and_header(done):
    assert {p.name for p in done.folder.iterdir()} == {
        "timeseries.csv",
        "timeseries_5ms.csv",
        "summary.json",
        "geometry.json",
        "contact_force.csv",
    }
    titles = (done.folder / "timeseries.csv").read_text().splitlines()[0].split(",")
    assert titles[:2] == ["time [s]", FORCE]
    assert "pantograph.mass[1].z" in titles
    coarse = load(done.folder / "timeseries_5ms.csv")
    assert coarse.names == tuple(
        f"catenary.{kind}[{i}].{what}"
        for i in (1, 2, 3)
        for kind, what in (("support", "uplift"), ("dropper", "force"))
    )
    assert coarse.time == pytest.approx(np.arange(201) * 0.005)


def test_values_stand_beside_the_time_at_which_they_hold(done):
    """The toy pantograph moves at 50 m/s from 0: its position is its clock; the catenary lags by one step."""
    recording = load(done.folder / "timeseries.csv")
    assert len(recording.time) == 1001
    assert recording["pantograph.A.x"] == pytest.approx(50.0 * recording.time, abs=1e-7)
    lagged = recording["catenary.pantograph[1].contact.x"]
    assert lagged[1:] == pytest.approx(50.0 * recording.time[:-1], abs=1e-7)


def test_summary_says_what_was_run(done):
    summary = json.loads((done.folder / "summary.json").read_text())
    assert summary["status"] == "complete"
    assert summary["steps"] == 1000
    assert summary["settings"]["coupling"]["scheme"] == "jacobi"
    assert summary["components"][1]["parameters"] == {"static_force": 140.0, "ripple": 20.0}
    assert all(len(c["sha256"]) == 64 for c in summary["components"])
    assert {"python", "fmpy", "numpy"} <= set(summary["versions"])
    assert summary["performance"]["wall_time"] > 0
    assert summary["performance"]["peak_memory"] > 1
    assert summary["quality"][0]["start"] == pytest.approx(20.0, abs=0.06)
    assert summary["quality"][0]["end"] == pytest.approx(45.0, abs=0.06)


def test_reading_back_gives_the_same_figures(done):
    again = run_results.read(done.folder)
    first, second = done.assessments()[0].quality, again.assessments()[0].quality
    assert second.mean == pytest.approx(first.mean, rel=1e-8)
    assert second.sigma == pytest.approx(first.sigma, rel=1e-7)
    assert [u.maximum for u in again.uplifts] == pytest.approx([u.maximum for u in done.uplifts], rel=1e-8)


def test_uplift_is_the_largest_over_the_whole_run(done):
    largest = [u.maximum for u in done.uplifts]
    assert [u.x for u in done.uplifts] == [0.0, 50.0, 100.0]
    assert largest[1] / largest[0] == pytest.approx(2.0)  # the toy's supports rise in proportion to their number
    force = done.recordings[0][FORCE]
    assert largest[0] == pytest.approx(0.5 * force.max() / 5000.0, rel=1e-3)


def test_parameters_reach_the_fmu(toy, tmp_path):
    """In the steady state the mean contact force is the static force."""
    found = go(
        toy,
        tmp_path / "out",
        stop=4.0,
        parameters={"pantograph.static_force": "99", "pantograph.ripple": "0"},
    )
    assert found.recordings[0][FORCE][-1] == pytest.approx(99.0, abs=0.5)


def test_position_during_loss_is_the_strips(toy, tmp_path):
    found = go(toy, tmp_path / "out", stop=0.1, parameters={"catenary.height": "5.02"})
    recording, contact = found.recordings[0], found.contacts[0]
    lost = recording[FORCE] <= 0
    assert lost[:5].all()
    assert not lost.all()
    where = track_position(recording, contact)
    assert (where[lost] == strip_centre(recording, contact, "x")[lost]).all()
    assert (where[~lost] == recording[contact.point("x")][~lost]).all()


def test_schemes_converge_to_each_other(toy, tmp_path):
    """Jacobi's distance from the iterated run shrinks in proportion to the step."""
    distances = []
    for step in (2e-3, 1e-3):
        forces = [
            go(toy, tmp_path / f"{scheme}{step}", scheme=scheme, step=step, stop=0.5).recordings[0][FORCE][-1]
            for scheme in ("jacobi", "iterative")
        ]
        distances.append(abs(forces[0] - forces[1]))
    assert distances[0] / distances[1] == pytest.approx(2.0, rel=0.25)


def test_iterated_coupling_conserves_interface_power(toy, tmp_path):
    power = {
        scheme: go(toy, tmp_path / scheme, scheme=scheme, stop=0.5).summary["interface_power"][0]
        for scheme in ("jacobi", "gauss-seidel", "iterative")
    }
    assert power["jacobi"]["energy"] > power["gauss-seidel"]["energy"] > 0.0
    assert abs(power["iterative"]["energy"]) < 1e-6 * power["jacobi"]["energy"]
    assert power["jacobi"]["transferred"] > 1.0


def test_a_failing_fmu_leaves_what_was_computed(toy, tmp_path):
    with pytest.raises(RunError) as caught:
        go(toy, tmp_path / "out", parameters={"catenary.fail_at": "0.5"})
    text = str(caught.value)
    assert "component 'catenary' (ToyCatenary.fmu) failed in a step at t = 0.5 s" in text
    assert "the wire broke at 100 percent load" in text
    left = run_results.read(tmp_path / "out")
    assert left.summary["status"] == "failed"
    assert "the wire broke" in left.summary["reason"]
    assert left.recordings[0].time[-1] == pytest.approx(0.5)
    assert len(left.recordings[0].time) == 501
    assert left.assessments()  # 20 m to 25 m of the interval were reached


def test_nan_stops_the_run_with_its_name_time_and_last_good_value(toy, tmp_path):
    with pytest.raises(RunError) as caught:
        go(toy, tmp_path / "out", parameters={"catenary.nan_at": "0.25"})
    left = run_results.read(tmp_path / "out")
    last = left.recordings[0][FORCE][-1]
    assert f"'{FORCE}' became nan at t = 0.251 s" in str(caught.value)
    assert f"its last good value was {last:.6g}" in str(caught.value)
    assert np.isfinite(left.recordings[0].values).all()


def long_run(scenario, out):
    """Return the command of a run that is still at work when it is interrupted."""
    return ["master", scenario, "--stop", "1e4", "--out", out, "--no-build"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_loses_nothing(toy, tmp_path, number):
    process = forked_commands.start(*long_run(toy, tmp_path / "out"), stderr=subprocess.PIPE)
    series = tmp_path / "out" / "timeseries.csv"
    deadline = time.monotonic() + 60
    while not (series.exists() and series.stat().st_size > 50_000) and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "interrupted" in said
    assert "Traceback" not in said
    left = run_results.read(tmp_path / "out")
    assert left.summary["status"] == "interrupted"
    assert "<b>Incomplete.</b> This run was interrupted" in (tmp_path / "out" / "report.html").read_text()
    assert left.recordings[0].time[-1] == pytest.approx(left.summary["time_reached"])
    assert len(left.recordings[0].time) == left.summary["steps"] + 1


def test_a_killed_run_is_readable_up_to_its_last_rows(toy, tmp_path):
    process = forked_commands.start(*long_run(toy, tmp_path / "out"))
    series = tmp_path / "out" / "timeseries.csv"
    deadline = time.monotonic() + 60
    while not (series.exists() and series.stat().st_size > 200_000) and time.monotonic() < deadline:
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGKILL)
    process.wait(timeout=60)
    left = run_results.read(tmp_path / "out")
    assert left.summary["status"] == "running"
    assert len(left.recordings[0].time) >= 500


def test_foreign_folders_are_left_alone_and_own_ones_replaced(toy, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "thesis.tex").write_text("years of work")
    with pytest.raises(MasterError, match="left alone"):
        go(toy, folder)
    assert [p.name for p in folder.iterdir()] == ["thesis.tex"]
    own = go(toy, tmp_path / "own", stop=0.9).folder
    (own / "notes.txt").write_text("mine")
    (own / "contact_force.png").write_text("old")
    go(toy, own, stop=0.5)
    assert load(own / "timeseries.csv").time[-1] == pytest.approx(0.5)
    assert (own / "notes.txt").read_text() == "mine"
    assert not (own / "contact_force.png").exists()


def test_two_runs_give_the_same_numbers(toy, tmp_path):
    texts = [(go(toy, tmp_path / n).folder / "timeseries.csv").read_bytes() for n in "ab"]
    assert texts[0] == texts[1]
