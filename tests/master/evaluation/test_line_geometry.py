"""Uplifts of supports, and where a line that closes on itself is met."""

from __future__ import annotations

import numpy as np
import pytest

from master.evaluation.filters import stands_in
from master.evaluation.line_geometry import indexed, laps, met, support_uplifts
from master.recording.recording import Recording

RING = {"period": 100.0, "support[1].x": 0.0, "support[2].x": 50.0}


def _recording(**uplifts):
    values = np.array(list(uplifts.values()), dtype=float).T
    names = tuple(f"line.support[{name[1:]}].uplift" for name in uplifts)
    return Recording(0.1 * np.arange(len(values)), names, ("m",) * len(names), values)


def test_an_uplift_is_the_highest_rise_and_when_it_was():
    """Neither the last value nor the largest movement: wires swing down as well, and that is no uplift."""
    recording = _recording(s1=[0.0, 0.02, 0.05, 0.01], s2=[0.0, -0.09, 0.03, 0.03])
    first, second = support_uplifts((recording,), {"line": {"support[1].x": 50.0, "support[2].x": 100.0}})
    assert (first.maximum, first.time, first.x) == (0.05, pytest.approx(0.2), 50.0)
    assert (second.maximum, second.time, second.x) == (0.03, pytest.approx(0.2), 100.0)


def test_uplifts_know_section_and_period_of_their_line():
    known = {"support[1].x": 10.0, "support[1].section": 2.0, "period": 400.0}
    (found,) = support_uplifts((_recording(s1=[0.0, 0.01]),), {"line": known})
    assert (found.section, found.period, found.place) == (2, 400.0, "10 m (section 2)")


@pytest.mark.parametrize("limits", [(120.0, 310.0), (0.0, 99.0), (100.0, 100.0), (-30.0, 60.0), (299.0, 301.0)])
def test_supports_of_a_ring_are_met_once_a_lap(limits):
    """Against counting: a support stands at every 50 m, on and on."""
    every = 50.0 * np.arange(-10, 20)
    expected = every[(every >= limits[0]) & (every <= limits[1])]
    assert met(RING, "support", limits) == pytest.approx(expected)
    assert len(laps(RING, limits)) >= 1


@pytest.mark.parametrize("x", [0.0, 20.0, 49.0, 99.9])
@pytest.mark.parametrize("interval", [(110.0, 150.0), (205.0, 215.0), (30.0, 60.0), (595.0, 603.0)])
def test_a_place_of_a_ring_is_in_an_interval_if_one_of_its_images_is(x, interval):
    images = x + 100.0 * np.arange(-5, 12)
    inside = bool(((images >= interval[0] - 1.0) & (images <= interval[1] + 1.0)).any())
    assert stands_in(x, interval, 100.0) == inside


def test_a_place_of_a_line_that_ends_is_where_it_is():
    assert stands_in(151.0, (110.0, 150.0))
    assert not stands_in(152.0, (110.0, 150.0))
    assert stands_in(109.5, (110.0, None))
    assert stands_in(-1e6, (None, 150.0))
    assert not stands_in(None, (None, None))


def test_indexed_values_come_in_numerical_order():
    geometry = {f"support[{i}].x": float(i) for i in (10, 9, 1, 2)} | {
        "support[1].xx": 7.0,
        "dropper[1].x": 8.0,
    }
    assert indexed(geometry, "support", "x").tolist() == [1.0, 2.0, 9.0, 10.0]
    assert indexed(geometry, "support", "y").size == 0


def test_uplifts_are_sorted_by_support():
    names = tuple(f"c.support[{i}].uplift" for i in (10, 2))
    recording = Recording(np.array([0.0, 1.0]), names, ("m", "m"), np.array([[0.0, 0.3], [0.1, 0.2]]))
    found = support_uplifts((recording,), {"c": {"support[2].x": 90.0}})
    assert [(u.support, u.x, u.maximum, u.time) for u in found] == [(2, 90.0, 0.3, 0.0), (10, None, 0.1, 1.0)]
