"""The library's curve and its mixed section, whole runs: contact is kept, and the force is held over height."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.long
FORCE = "catenary.pantograph[1].contact.force"


#: Of CX: the spring on the roof, and how far the two above it give way [N/m, m/N].
ROOF, ABOVE = 178.45, 1.0 / 15487.0 + 1.0 / 7000.0


def mean(run, start, end, of=FORCE):
    """Mean of a column, the force by default [N], while the strip is between two places."""
    x = run["pantograph.A.x"]
    return float(run[of][(x >= start) & (x < end)].mean())


def test_a_curve_presses_no_more_than_straight_track(simulate):
    run = simulate("cx_ac_curve")
    assert run.quality["losses"]["count"] == 0
    assert run.quality["mean"] == pytest.approx(100.0, abs=0.1)
    assert mean(run, 330.0, 550.0) == pytest.approx(mean(run, 165.0, 715.0), abs=1.0)
    lateral = run["catenary.pantograph[1].contact.y"][run[FORCE] > 0.0]
    assert np.abs(lateral).max() == pytest.approx(0.2, abs=0.005)


def test_a_pantograph_that_follows_presses_alike_at_all_heights(simulate):
    """A spring on the roof presses with less by its stiffness times what its lowest mass is higher."""
    run = simulate("cx_ac_mixed")
    assert run.quality["losses"]["count"] == 0
    assert run.quality["mean"] == pytest.approx(95.0, abs=0.1)
    assert mean(run, 650.0, 850.0) == pytest.approx(mean(run, 900.0, 1000.0), abs=3.0)
    spring = simulate("cx_ac_mixed", "--set", "pantograph.follow_height=0")
    (low, at_low), (high, at_high) = (
        (mean(spring, *place), mean(spring, *place, of="pantograph.A.z")) for place in ((700.0, 750.0), (950.0, 1000.0))
    )
    risen = at_high + ABOVE * high - at_low - ABOVE * low
    # But for the momentum that 22 kg have more at the end of 1.5 s than at the beginning, at 0.2 m/s.
    assert low - high == pytest.approx(ROOF * risen, abs=22.0 * 0.2 / 1.5)
    assert low - high > 75.0
