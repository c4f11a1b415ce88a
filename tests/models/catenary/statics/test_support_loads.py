"""Supports of a line at rest: forces of their arms, gradients of the wire."""

import dataclasses

import numpy as np
import pytest

from models.catenary.definition.track_definition import Track
from models.catenary.line_model import CatenaryModel
from models.catenary.statics.rest_profile import arm_loads
from models.catenary.statics.support_loads import support_loads


@pytest.fixture(scope="module")
def model(line_maker):
    heights = {"contact_wire_height": [[5.3, 5.3, 5.2, 5.2, 5.2], "m", "x"]}
    line = line_maker(spans=6, supports=heights, ends={"spans": 1, "rise": [0.1, "m", "x"]})
    return CatenaryModel(dataclasses.replace(line, track=Track(positions=(0.0,), curvature=(-1 / 900,), cant=(-0.05,))))


def test_forces_are_those_of_the_arms_with_their_side(model):
    found, arms = support_loads(model), arm_loads(model)
    np.testing.assert_array_equal(found.side, 1.0)  # to the right the wire pulls, to the left the arms
    np.testing.assert_allclose(found.lateral, arms.lateral)
    np.testing.assert_allclose(found.lift, arms.lift)
    np.testing.assert_allclose(found.pendulum, arms.pendulum)
    np.testing.assert_allclose(np.hypot(found.lateral, found.lift), found.tension)


def test_the_wires_pull_towards_the_inside_by_the_tension_over_the_radius(model):
    """Over the three inner supports, stagger to and fro: T L / R each, and 2 T 2a / L in turn."""
    lateral = support_loads(model).lateral[1:4]
    assert lateral[0] + 2.0 * lateral[1] + lateral[2] == pytest.approx(4.0 * 20e3 * 50.0 / 900.0, rel=0.03)


def test_gradients_between_the_supports_that_are_at_the_working_height(model):
    found = support_loads(model)
    np.testing.assert_allclose(found.gradient, [0.0, -0.002, 0.0, 0.0, np.nan], atol=1e-12)
    np.testing.assert_allclose(found.change, [np.nan, 0.002, 0.002, 0.0, np.nan], atol=1e-12)


def test_a_ring_is_level_all_around(ring_maker):
    found = support_loads(CatenaryModel(ring_maker(spans=4)))
    np.testing.assert_array_equal(found.gradient, 0.0)
    np.testing.assert_array_equal(found.change, 0.0)


def test_where_nothing_registers_the_wire_there_is_no_arm(line_maker):
    found = support_loads(CatenaryModel(line_maker(spans=8, ends={"spans": 2, "rise": [0.1, "m", "x"]})))
    assert np.isnan(found.lateral).tolist() == [True] + [False] * 5 + [True]
    assert np.isnan(found.side).tolist() == np.isnan(found.tension).tolist()
