"""Spans and radii in the wind: ADIF's published column, the largest span, the string against its own shape."""

import math

import numpy as np
import pytest

from models.catenary.definition.wind_definition import DesignWind
from models.catenary.statics.span_table import LENGTHS, String, radii


@pytest.fixture(scope="module")
def ca160():
    """CA-160 A, ADIF NAE 300 (2024)."""
    wind = DesignWind(speed=29.0, air_density=1.2697, gust_factor=1.8)
    assert wind.pressure == pytest.approx(961.04, abs=0.01)
    return String(10290.0, wind.force(0.01224))


#: Span, stagger at its ends [cm], smallest radius as printed (rounded up) and by the formula on the grid of 5 m.
PRINTED = [
    (60, 20, -20, 3100, 3100),
    (60, 20, 20, 1300, 1240),
    (55, 20, 20, 900, 890),
    (50, 20, 20, 650, 650),
    (45, 20, 20, 500, 475),
    (40, 20, 20, 350, 350),
    (35, 20, 20, 250, 250),
    (30, 20, 20, 175, 175),
]


@pytest.mark.parametrize(("length", "start", "end", "printed", "formula"), PRINTED)
def test_the_smallest_radius_of_ca160(ca160, length, start, end, printed, formula):
    found = ca160.smallest_radius(lambda _: 0.55, length, start / 100.0, end / 100.0)
    assert found == formula
    assert formula <= printed


def test_the_largest_span_of_ca160(ca160):
    assert ca160.largest_span(0.55, 1 / 800, 0.2, 0.2) == pytest.approx(53.36, abs=5e-3)
    assert ca160.offset(60.0, 0.0, 0.2, -0.2) == pytest.approx(0.412, abs=5e-4)


@pytest.mark.parametrize(("start", "end"), [(0.2, -0.2), (0.1, 0.25), (-0.2, -0.1), (0.3, 0.3)])
@pytest.mark.parametrize("curvature", [0.0, 1 / 3000, 1 / 700])
def test_the_offset_is_the_largest_of_both_winds(ca160, start, end, curvature):
    x = np.linspace(0.0, 47.0, 20001)
    lie = start + (end - start) * x / 47.0
    bow = x * (47.0 - x) / (2.0 * ca160.tension)
    pull = ca160.tension * curvature
    worst = max(((ca160.wind - pull) * bow + lie).max(), ((ca160.wind + pull) * bow - lie).max())
    assert ca160.offset(47.0, curvature, start, end) == pytest.approx(worst, abs=1e-8)


@pytest.mark.parametrize(("start", "end"), [(0.2, -0.2), (0.2, 0.2), (0.1, 0.2)])
def test_the_largest_span_is_blown_to_the_limit(ca160, start, end):
    for curvature in (0.0, 1 / 2000, 1 / 600):
        length = ca160.largest_span(0.55, curvature, start, end)
        assert ca160.offset(length, curvature, start, end) == pytest.approx(0.55, abs=1e-9)


def test_what_cannot_be(ca160):
    assert math.isnan(ca160.largest_span(0.15, 0.0, 0.2, 0.2))
    assert math.isnan(ca160.smallest_radius(lambda _: 0.15, 40.0, 0.2, -0.2))
    assert len(radii(ca160, lambda _: 0.55, 0.2, 0.2)) == len(LENGTHS) == 41
