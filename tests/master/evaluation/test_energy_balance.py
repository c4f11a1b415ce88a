"""Energy balances found in recordings, and asked for on the command line."""

import json

import numpy as np
import pytest

from master.commands.main import main
from master.evaluation.energy_balance import COUPLING_LIMIT, DRIFT, PART_LIMIT, drift_events, find_balances
from master.recording.recording import Recording
from master.report.run_inputs import quality_rows
from master.system.contacts import Contact

CONTACT = Contact(1, "line", "pan", "line.pantograph[1].contact")
WORK = "line.pantograph[1].contact.work"


def recording(spacing, **columns):
    values = np.array(list(columns.values()), dtype=float).T
    return Recording(spacing * np.arange(len(values)), tuple(columns), ("",) * len(columns), values)


def every_step(n=101):
    """A force of 100 N on a strip that rises and falls at 0.1 m/s."""
    speed = 0.1 * (-1.0) ** (np.arange(n) // 10)
    return recording(0.01, **{CONTACT.force: np.full(n, 100.0), "pan.A.vz": speed, "pan.B.vz": speed})


def balance(drift, work=200.0):
    share = np.linspace(0.0, 1.0, len(drift))
    table = {"stored": 0.25 * work * share, "dissipated": 0.75 * work * share, "work": work * share, "drift": drift}
    return {f"line.energy.{name}": values for name, values in table.items()}


def test_a_part_s_drift_is_judged_by_what_has_passed_through_it():
    off = 1.5 * PART_LIMIT * 200.0
    (fine,) = find_balances([every_step(), recording(0.1, **balance([0.0, 1e-12, -2e-12]))], [])
    assert (fine.what, fine.drift, fine.largest, fine.passed) == ("line", -2e-12, 2e-12, 200.0)
    assert fine.exceeded is None
    assert fine.share == pytest.approx(1e-14)
    (bad,) = find_balances([every_step(), recording(0.1, **balance([0.0, 0.0, off, off, 0.0]))], [])
    assert bad.exceeded == pytest.approx(0.2)
    (event,) = drift_events([fine, bad], 0.5)
    assert (event.kind, event.what, event.is_open) == (DRIFT, "line", True)
    assert (event.time, event.duration) == (pytest.approx(0.2), pytest.approx(0.3))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_energy_that_is_lost_is_as_bad_as_energy_that_is_made_up(sign):
    off = sign * 2.0 * PART_LIMIT * 200.0
    (found,) = find_balances([every_step(), recording(0.1, **balance([0.0, 0.0, off, off]))], [])
    assert (found.exceeded, found.largest, found.drift) == (pytest.approx(0.2), abs(off), off)


def test_a_coupling_s_drift_is_what_both_sides_differ_by():
    """Beside the work that goes back and forth: 100 N at 0.1 m/s for a second are 10 J, which add up to next to 0."""
    line = np.array([7.0, 9.0, 8.0])  # it has been running before
    for error, expected in ((0.5 * COUPLING_LIMIT, None), (1.5 * COUPLING_LIMIT, 1.0)):
        table = {WORK: line, "pan.contact.work": line - 7.0 - np.array([0.0, 0.0, 10.0 * error])}
        (found,) = find_balances([every_step(), recording(0.5, **table)], [CONTACT])
        assert found.what == "pan - line"
        assert found.passed == pytest.approx(10.0)
        assert found.drift == pytest.approx(10.0 * error)
        assert found.exceeded == expected


def test_without_velocities_the_line_s_own_work_is_what_has_passed():
    table = {WORK: [0.0, 4.0, -2.0], "pan.contact.work": [0.0, 4.0, -2.0]}
    (found,) = find_balances([recording(0.5, t=[0, 0, 0]), recording(0.5, **table)], [CONTACT])
    assert (found.passed, found.drift) == (4.0, 0.0)


@pytest.mark.parametrize("rows", [0, 3])
def test_what_is_not_watched_has_no_balance(rows):
    """The variables are there, and are 0."""
    table = balance([0.0] * rows, work=0.0) | {WORK: [0.0] * rows, "pan.contact.work": [0.0] * rows}
    assert find_balances([every_step(), recording(0.1, **table)], [CONTACT]) == ()


def test_balances_have_a_row_in_the_report():
    found = find_balances([every_step(), recording(0.1, **balance([0.0, 1.0, 1.0]))], [])
    rows = dict(quality_rows({"energy": [{"what": b.what, "text": b.text} for b in found]}))
    assert rows["energy drift, line"] == "drift 1 J, at most 0.005 of 200 J, beyond 1e-06 from t = 0.1 s on"


def test_asking_for_it_of_fmus_that_cannot_is_refused(toy, tmp_path, capsys):
    assert main([str(toy), "--no-build", "--quiet", "--energy", "--out", str(tmp_path / "out")]) == 1
    assert "no FMU of the scenario has the parameter 'monitor_energy'" in capsys.readouterr().err


def test_without_it_the_summary_has_none(toy, tmp_path):
    folder = tmp_path / "out"
    assert main([str(toy), "--no-build", "--quiet", "--no-report", "--stop", "0.05", "--out", str(folder)]) == 0
    assert json.loads((folder / "summary.json").read_text())["energy"] == []
