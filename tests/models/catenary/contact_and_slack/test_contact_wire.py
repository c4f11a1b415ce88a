"""The contact wire as a strip meets it."""

import dataclasses

import numpy as np
import pytest

from models.catenary.definition.surface_definition import RunningSurface
from models.catenary.line_model import CatenaryModel


def test_a_running_surface_takes_its_height_and_its_slope_times_the_speed(short_line):
    """Where the strip crosses, not where its ends are: it stands askew, and one end runs faster."""
    points = tuple((x, 1e-3 * np.sin(x)) for x in np.linspace(100.0, 140.0, 801).tolist())
    worn = dataclasses.replace(short_line, running_surface=RunningSurface(profile="wear.csv", points=points))
    (smooth,), (wire,) = CatenaryModel(short_line).wires, CatenaryModel(worn).wires
    strip = np.array([[[120.0, 0.7, 5.0], [80.0, 0.0, 0.2]], [[121.0, -0.7, 5.1], [84.0, 0.0, 0.3]]])
    before = smooth.penetration(0.25, 4.9, 0.1, strip, 0.02)
    assert before == pytest.approx((0.145, 0.125))
    delta, velocity = wire.penetration(0.25, 4.9, 0.1, strip, 0.02)
    assert delta - before[0] == pytest.approx(-1e-3 * np.sin(120.25), abs=1e-8)
    assert velocity - before[1] == pytest.approx(-81.0 * 1e-3 * np.cos(120.25), abs=1e-4)
