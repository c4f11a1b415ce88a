"""Warnings about a lumped pantograph under a wire."""

import pytest

from models.library.catalogue import load_lumped
from models.pantograph.lumped.lumped_advice import working_height_warning


@pytest.fixture
def cx():
    return load_lumped("CX").with_values({"static_force": 178.0, "reference_height": 5.02, "start_position": 250.0})


def test_a_wire_at_another_working_height_is_told_with_what_is_left(cx):
    """By hand: the lowest spring takes k1 from the force for every metre; the springs above it add to the rise."""
    k = [s.stiffness for s in cx.stage]
    softness = sum(1.0 / upper for upper in k[1:])
    left = (178.0 - k[0] * (5.30 - 5.02)) / (1.0 + k[0] * softness)
    said = working_height_warning(cx, 250.0, 5.30)
    assert f"at the wire's, 5.30 m, {left:.0f} N are left: set reference_height" in said


def test_a_wire_out_of_reach_is_told(cx):
    assert "nothing is left, and the strip does not reach it" in working_height_warning(cx, 250.0, 7.5)


@pytest.mark.parametrize(("x", "z"), [(250.0, 5.08), (250.0, 5.0), (0.0, 5.6), (250.0, 0.0)])
def test_the_usual_height_and_another_place_are_not(cx, x, z):
    assert working_height_warning(cx, x, z) == ""
