"""Events are found in what was recorded."""

from __future__ import annotations

import json

import numpy as np
import pytest

from master.commands.main import main
from master.evaluation.run_events import AT_END, LOST, SLACK, Event, find_events
from master.recording.recording import Recording
from master.system.contacts import Contact

CONTACT = Contact(1, "line", "pan", "line.pantograph[1].contact")
GEOMETRY = {"line": {"dropper[2].x": 31.5, "support[1].x": 0.0}}


def recording(step, **columns):
    names = tuple(n.replace("__", ".") for n in columns)
    values = np.array(list(columns.values()), dtype=float).T
    return Recording(step * np.arange(len(values)), names, ("",) * len(names), values)


def of_contact(force, y=None):
    """Contact forces at 80 m/s, the wire at ``y`` on a strip from -0.5 to 0.5 m."""
    n = len(force)
    y = np.zeros(n) if y is None else np.asarray(y)
    x = 80.0 * 0.01 * np.arange(n)
    table = {f"line.pantograph[1].contact.{k}": v for k, v in (("force", force), ("x", x), ("y", y))}
    table |= {f"pan.{end}.{k}": v for end, side in (("A", 0.5), ("B", -0.5)) for k, v in (("x", x), ("y", [side] * n))}
    return recording(0.01, **table)


def test_a_loss_of_contact_has_time_place_and_duration():
    found = find_events([of_contact([0, 0, 90, 90, 0, 0, 0, 80, 0, 70])], [CONTACT], {})
    assert [e.kind for e in found] == [LOST, LOST]
    assert [(e.time, e.duration, e.position) for e in found] == [
        pytest.approx((0.04, 0.03, 3.2)),
        pytest.approx((0.08, 0.01, 6.4)),
    ]
    assert {e.what for e in found} == {"pan"}
    assert not any(e.is_open for e in found)


def test_what_was_never_in_contact_has_not_lost_it():
    assert find_events([of_contact([0, 0, 0])], [CONTACT], {}) == ()


def test_a_loss_that_lasts_to_the_end_is_marked():
    (event,) = find_events([of_contact([90, 0, 0])], [CONTACT], {})
    assert event == Event(LOST, "pan", 0.01, pytest.approx(0.01), pytest.approx(0.8), True)


def test_the_wire_beyond_the_strips_end():
    found = find_events([of_contact([90, 90, 90, 0, 90], [0.4, 0.51, -0.6, 0.7, 0.5])], [CONTACT], {})
    assert [(e.kind, e.time) for e in found] == [(AT_END, 0.01), (LOST, pytest.approx(0.03))]
    assert found[0].duration == pytest.approx(0.02)


def test_slack_droppers_and_supports_by_their_names():
    table = {
        "line.dropper[2].force": [50, 0, 0, 40, 30],
        "line.support[1].force": [50, 50, 50, 0, 0],
        "line.support[1].uplift": [0, 0, 0, 0, 0],
        "line.dropper[3].force": [0, 0, 0, 0, 0],  # never was tight
    }
    found = find_events([recording(0.1, t=[0] * 5), recording(0.005, **table)], [], GEOMETRY)
    assert found == (
        Event(SLACK, "line.dropper[2]", pytest.approx(0.005), pytest.approx(0.01), 31.5, False),
        Event(SLACK, "line.support[1]", pytest.approx(0.015), pytest.approx(0.005), 0.0, True),
    )


def test_what_a_line_says_itself_counts_not_the_force():
    """Where a damper goes on acting a slack dropper carries something, and a taut one may be pushed for a moment."""
    table = {
        "line.dropper[2].force": [50, -20, 15, 40, -5],
        "line.dropper[2].slack": [0, 1, 1, 0, 0],
        "line.dropper[3].force": [50, 50, 0, 50, 50],  # of this one it says nothing
    }
    wanted = [("line.dropper[2]", 0.005, 0.01), ("line.dropper[3]", 0.01, 0.005)]
    forces = {name: values for name, values in table.items() if name.endswith("force")}
    apart = [recording(0.005, **forces), recording(0.005, **{"line.dropper[2].slack": [0, 1, 1, 0, 0]})]
    for recordings in ([recording(0.005, **table)], apart, apart[::-1]):
        found = find_events([recording(0.1, t=[0] * 5), *recordings], [], GEOMETRY)
        assert [(e.what, e.time, e.duration) for e in found] == [
            (what, pytest.approx(time), pytest.approx(duration)) for what, time, duration in wanted
        ]


def test_an_empty_recording_has_none():
    assert find_events([of_contact([])], [CONTACT], GEOMETRY) == ()


def test_events_stand_in_the_summary(toy, tmp_path):
    """A pantograph that is pushed too gently to stay in touch bounces."""
    folder = tmp_path / "out"
    options = ["--set", "pantograph.damping=0", "--set", "pantograph.ripple=400", "--stop", "0.9"]
    assert main([str(toy), "--no-build", "--quiet", "--no-report", "--out", str(folder), *options]) == 0
    found = json.loads((folder / "summary.json").read_text())
    assert found["events"]
    assert {e["kind"] for e in found["events"]} == {LOST}
    assert found["events_left_out"] == 0
    assert [e["time"] for e in found["events"]] == sorted(e["time"] for e in found["events"])
