"""The cubic spline against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from models.numerics.cubic_curve import CubicCurve


@pytest.mark.parametrize("count", [3, 4, 5, 40])
def test_it_is_the_spline_of_scipy(count):
    draw = np.random.default_rng(count)
    x, y = np.cumsum(0.1 + draw.random(count)), draw.normal(size=count)
    ours, theirs = CubicCurve(x, y), CubicSpline(x, y)
    places = np.linspace(x[0], x[-1], 200)
    assert [ours.at(p) for p in places] == pytest.approx(theirs(places), abs=1e-11)
    assert ours.at(x[0] - 1) == y[0]
    assert ours.at(x[-1] + 1) == y[-1]
    assert ours.range == (x[0], x[-1])
