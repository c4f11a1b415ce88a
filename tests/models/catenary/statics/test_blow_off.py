"""A line in the wind: the mesh beside the string, both sides, in curves and on straight track."""

import dataclasses

import numpy as np
import pytest

from models.catenary.definition.track_definition import Track
from models.catenary.line_model import CatenaryModel
from models.catenary.statics.blow_off import blow_off

PRESSURE = 961.04


def blown(line, **changes):
    return blow_off(CatenaryModel(dataclasses.replace(line, **changes)), PRESSURE)


def test_the_mesh_stays_one_per_cent_below_the_string(ln2):
    """Of clamps that bend the wire; N/L takes another half a per cent of LN2, whose messenger wire is blown less."""
    free = dataclasses.replace(ln2.dynamics, geometric_stiffness=0)
    ratio = [(b := blown(ln2, dynamics=d)).blown / b.string_blown for d in (free, ln2.dynamics)]
    assert ratio[0][5:-5] == pytest.approx(0.99, abs=0.005)
    assert ratio[1][5:-5] == pytest.approx(0.984, abs=0.005)


def test_a_curve_changes_nothing_of_what_the_wind_moves(short_line):
    """Tensions stay: a wire that is bowed already is not held by its length."""
    straight = blown(short_line)
    curved = blown(short_line, track=Track(positions=(0.0,), curvature=(1 / 2500,)))
    np.testing.assert_allclose(curved.blown[2:4], straight.blown[2:4], rtol=5e-3)


def test_offsets_are_those_of_the_string_within_its_accuracy(short_line):
    for curvature in (0.0, 1 / 1500, -1 / 1500):
        found = blown(short_line, track=Track(positions=(0.0,), curvature=(curvature,)))
        np.testing.assert_allclose(found.offset[1:-1], found.string[1:-1], rtol=0.03)
        assert np.isnan(found.string[[0, -1]]).all()  # there the wire is free in plan at one end


def test_both_winds(short_line):
    found = blown(short_line)
    np.testing.assert_allclose(found.to_left + found.to_right, 2.0 * found.still)
    middle = np.interp(125.0, found.x, found.to_left) - np.interp(125.0, found.x, found.still)
    assert middle > 0.05
    assert found.lift.sum(axis=1) == pytest.approx(0.0, abs=1e-12)
    # An arm on the left, its end above the wire: wind to the left takes pull and with it lift from it.
    assert found.lift[0, 0] < -0.002
    assert found.lift[1, 0] > 0.002


def test_twice_the_pressure_moves_twice_as_far(short_line):
    model = CatenaryModel(short_line)
    once, twice = (blow_off(model, p) for p in (400.0, 800.0))
    np.testing.assert_allclose(twice.blown, 2.0 * once.blown)
