"""Who runs ahead, and the follower's figures against its."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from master.evaluation.contact_positions import leading_first
from master.evaluation.following_pantograph import follower_effects
from master.recording.recording import Recording
from master.system.contacts import Contact

TIME = np.linspace(0.0, 1.0, 11)


def _run(speed, **starts):
    """Strips that begin at these places, without recorded contact points."""
    contacts = [Contact(i, "line", name, f"line.pantograph[{i}].contact") for i, name in enumerate(starts, 1)]
    columns = {f"{name}.{end}.x": x + speed * TIME for name, x in starts.items() for end in "AB"}
    columns |= {contact.force: np.full(len(TIME), 100.0) for contact in contacts}
    values = np.array(list(columns.values())).T
    return Recording(TIME, tuple(columns), ("",) * len(columns), values), contacts


@pytest.mark.parametrize(("speed", "expected"), [(80.0, ["b", "c", "a"]), (-80.0, ["a", "c", "b"])])
def test_who_runs_ahead_depends_on_the_way_they_go(speed, expected):
    recording, contacts = _run(speed, a=0.0, b=200.0, c=100.0)
    assert [c.pantograph for c in leading_first(recording, contacts)] == expected


@pytest.mark.parametrize("speed", [80.0, -80.0])
def test_differences_are_the_follower_s_minus_the_leader_s(speed):
    recording, contacts = _run(speed, one=0.0, two=200.0)
    quality = {
        "one": SimpleNamespace(mean=100.0, sigma=20.0, minimum=50.0, maximum=160.0),
        "two": SimpleNamespace(mean=101.0, sigma=25.0, minimum=40.0, maximum=190.0),
    }
    assessed = [SimpleNamespace(contact=c, quality=quality[c.pantograph]) for c in contacts]
    (found,) = follower_effects(recording, assessed)
    sign = -1.0 if speed > 0.0 else 1.0  # "two" leads where they go forward
    assert (found.leading, found.trailing) == (("two", "one") if speed > 0.0 else ("one", "two"))
    assert found.distance == 200.0
    figures = (found.mean, found.sigma, found.minimum, found.maximum)
    assert figures == pytest.approx([sign * d for d in (1.0, 5.0, -10.0, 30.0)])
