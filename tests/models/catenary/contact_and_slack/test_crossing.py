"""Strip and wire in plan."""

import numpy as np
import pytest

from models.catenary.contact_and_slack.crossing import crossing


def test_crossing_of_a_staggered_wire():
    share, xi = crossing(np.array([3.0, 0.7, 5.0]), np.array([3.0, -0.7, 5.0]), (2.0, 0.1), (4.0, -0.1))
    assert (share, xi) == pytest.approx((0.5, 0.5))


def test_crossing_of_a_skewed_strip_satisfies_both_lines():
    a, b = np.array([3.2, 0.7, 5.0]), np.array([2.9, -0.7, 5.1])
    i, j = (2.0, 0.25), (4.0, -0.1)
    share, xi = crossing(a, b, i, j)
    on_strip = a[:2] + share * (b - a)[:2]
    on_wire = np.array(i) + xi * (np.array(j) - np.array(i))
    assert on_strip == pytest.approx(on_wire)


def test_parallel_lines_do_not_cross():
    assert crossing(np.array([0.0, 0.0]), np.array([1.0, 0.0]), (0.0, 1.0), (1.0, 1.0)) is None
