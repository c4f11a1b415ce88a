"""Steady arms whose side is not given stand where they pull, also where the formula for the side is wrong."""

import dataclasses

import numpy as np
import pytest

from models.catenary.definition.track_definition import Track
from models.catenary.shape.form_finding import EquilibriumError, find_form
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.catenary.shape.support_places import SupportPlaces

AGAINST = {"listed": [[0.2, -0.2, -0.1, -0.2, 0.2], "m", "test"], "anchor": [0.0, "m", "test"]}


@pytest.fixture(scope="module")
def between(line_maker):
    """A canted curve with a support that gives its wire little: -8 N by the formula, of the wire alone; 35 N indeed."""
    stagger = {"listed": [[-0.2, -0.2, 0.26, -0.2, -0.2], "m", "x"], "anchor": [-0.2, "m", "x"]}
    line = line_maker(stagger=stagger)
    flat = dataclasses.replace(line.steady_arm, angle=-0.03)
    return dataclasses.replace(line, track=Track(positions=(0.0,), radius=(3000.0,), cant=(0.1,)), steady_arm=flat)


def sides(state, mesh):
    end, node = mesh.arms.T
    return np.sign(state.shape.points[end, 1] - state.shape.points[node, 1]).tolist()


def test_an_arm_that_pushes_in_a_curve_is_turned(between):
    mesh = build_mesh(between)
    support = between.sections[0].supports[3]
    assert SupportPlaces(between, between.sections[0]).side(support) == -1.0
    state = find_form(between, mesh)
    assert sides(state, mesh) == [-1.0, -1.0, 1.0, -1.0, -1.0]
    assert state.arm_force[2] == pytest.approx(34.5, abs=0.5)
    assert state.arm_force.min() > 0.0
    end, node = mesh.arms[2]
    arm = state.shape.points[end] - state.shape.points[node]
    assert np.linalg.norm(arm) == pytest.approx(between.steady_arm.length)


def test_an_arm_on_the_side_of_its_stagger_is_turned_on_straight_track(line_maker):
    """Its neighbours lie further out on the same side: it stands on the right, and has to pull to the left."""
    line = line_maker(stagger=AGAINST)
    state = find_form(line, mesh := build_mesh(line))
    assert sides(state, mesh) == [1.0, -1.0, 1.0, -1.0, 1.0]
    assert state.arm_force.min() > 70.0


def test_a_turned_arm_is_kept_with_its_form(between, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("OPENPANTO_CACHE", raising=False)
    found, again = (kept_form(between, build_mesh(between)) for _ in range(2))
    np.testing.assert_array_equal(again.shape.mesh.points, found.shape.mesh.points)
    np.testing.assert_array_equal(again.positions, found.positions)


def test_a_side_that_is_given_is_not_changed(line_maker):
    given = {"arm_side": [[1, -1, -1, -1, 1], "1", "x"]}
    line = line_maker(stagger=AGAINST, supports=given)
    with pytest.raises(EquilibriumError) as raised:
        find_form(line, build_mesh(line))
    assert "the arm at 150.00 m pushes with 81.9 N" in str(raised.value)
    assert "an arm must pull; change its side (arm_side in [supports]) or the stagger" in str(raised.value)
