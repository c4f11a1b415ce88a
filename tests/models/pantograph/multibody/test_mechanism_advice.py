"""Warnings about a multibody pantograph under a wire, and values that were written in another unit."""

import numpy as np
import pytest

from models.definition_files.parameter import ParameterError
from models.library.catalogue import load_pantograph
from models.pantograph.multibody.analysis.mechanism_rig import Rig
from models.pantograph.multibody.multibody_part import MultibodyPantographPart
from models.pantograph.working_height import Raised


def said(name, x, z, **values):
    definition = load_pantograph(name).with_values({"start_position": 250.0} | values)
    part = MultibodyPantographPart(definition)
    return part.working_height_warning(x, z)


def test_masses_on_slides_are_left_what_the_springs_leave():
    """By hand: the lowest spring takes k1 from the force for every metre; the springs above it add to the rise."""
    k1, softness, rise = 178.45, 1.0 / 15487.0 + 1.0 / 7000.0, 5.30 - 5.02
    left = (178.0 - k1 * rise) / (1.0 + k1 * softness)
    text = said("CX_multibody", 250.0, 5.30, static_force=178.0)
    assert text == (
        "the static force of 178 N is that at the reference height, 5.02 m; at the wire's, 5.30 m, "
        f"{left:.0f} N are left: set reference_height to the wire's height, or find another static_force"
    )


def test_a_moment_is_told_with_the_force_that_the_rig_finds():
    definition = load_pantograph("generic_multibody")
    left = Rig(definition).statics(np.array([5.02, 5.30]))
    text = said("generic_multibody", 250.0, 5.30)
    assert "the static moment of 1313.7 N.m is that at the reference height" in text
    assert f"5.30 m, {left.contact_force[-1]:.0f} N are left" in text
    assert "find another static_moment" in text
    assert left.contact_force[-1] < 0.85 * left.contact_force[0]


def test_a_wire_out_of_reach_is_told():
    assert "nothing is left, and the strip does not reach it" in said("CX_multibody", 250.0, 7.5)
    assert "nothing is left, and the strip does not reach it" in said("generic_multibody", 250.0, 6.6)
    raised = Raised("static_moment", 1313.7, "N.m", 5.02, 250.0)
    assert "at the wire's, 7.00 m, the pantograph has no equilibrium: set reference" in raised.warning(7.0, None, 157.5)


@pytest.mark.parametrize(("x", "z"), [(250.0, 5.08), (250.0, 5.0), (0.0, 5.6), (252.0, 5.6), (250.0, 0.0)])
@pytest.mark.parametrize("name", ["CX_multibody", "generic_multibody"])
def test_the_usual_height_and_another_place_are_not(name, x, z):
    assert said(name, x, z) == ""


def test_a_lifting_value_that_an_input_replaces_is_not_judged():
    assert said("CX_multibody", 250.0, 5.30, static_force=178.0, lift_input=1) == ""


def test_reference_height_at_the_wire_is_the_cure():
    assert said("generic_multibody", 250.0, 5.35, reference_height=5.30) == ""


@pytest.mark.parametrize("value", [0.0, -1.0])
def test_a_spring_that_carries_the_weights_keeps_a_stiffness(value):
    with pytest.raises(ParameterError, match=r"'force\.stage_1\.stiffness': .* must be greater than 0"):
        load_pantograph("CX_multibody").with_values({"force.stage_1.stiffness": value})


@pytest.mark.parametrize(
    ("name", "value", "unit"),
    [
        ("body.m1.mass", 5580.0, "kg"),
        ("body.m1.inertia.xx", 1e5, "kg.m2"),
        ("joint.slide_1.point_i.x", 200.0, "m"),
        ("force.stage_1.stiffness", 1.7845e9, "N/m"),
        ("force.stage_1.damping", 1.1e6, "N.s/m"),
        ("force.stage_1.damping", -1.0, "N.s/m"),
        ("static_force", 1.68e5, "N"),
    ],
)
def test_values_in_another_unit_are_refused(name, value, unit):
    definition = load_pantograph("CX_multibody")
    known = {p.name: p for p in definition.parameters()}
    limits = rf"{known[name].minimum:g} \.\.\. {known[name].maximum:g} {unit}"
    with pytest.raises(ParameterError, match=rf"is outside {limits}".replace("+", r"\+")):
        definition.with_values({name: value})


def test_every_number_of_a_body_and_of_a_force_has_a_range():
    for name in ("CX_multibody", "generic_multibody"):
        for p in load_pantograph(name).parameters():
            assert None not in (p.minimum, p.maximum), p.name
            assert p.minimum <= p.value <= p.maximum, p.name
