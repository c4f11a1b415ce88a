"""A mechanism with a joint too few, a body that cannot exist, or a strip along the track says so."""

import re

import numpy as np
import pytest

from models.definition_files.toml_reader import DefinitionError
from models.pantograph.multibody.analysis.mechanism_freedom import FreeMotion, degrees_of_freedom
from models.pantograph.multibody.analysis.mechanism_rig import Rig
from models.pantograph.multibody.analysis.mechanism_statics import equilibrium, settle_springs
from models.pantograph.multibody.mechanism import Mechanism, MechanismError
from models.pantograph.multibody.mechanism_advice import inertia_warning
from models.pantograph.multibody.multibody_part import MultibodyPantographPart
from tests.models.pantograph.multibody.mechanisms import library, library_data, mechanism_from, q


def generic_without(*joints):
    data = library_data("generic_multibody")
    for name in joints:
        del data["joint"][name]
    return mechanism_from(data)


@pytest.mark.parametrize("name", ["joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6", "joint_8"])
def test_a_joint_left_out_has_no_equilibrium_that_counts(name):
    with pytest.raises(MechanismError, match=r"a joint is missing or too free \(\d degrees of freedom") as told:
        MultibodyPantographPart(generic_without(name)).mechanism_warning()
    assert f"{name} " not in str(told.value)


def test_the_strip_beside_its_place_is_told_with_its_height():
    text = r"'pan_head' 2\.64 m and 136 degrees from where it was put together, -0\.964 m above the base"
    with pytest.raises(MechanismError, match=text):
        Rig(generic_without("joint_1"))


def test_a_missing_link_lets_the_head_fall_over():
    """An inverted pendulum: s^2 = (m g h + F h) / J about joint 3, h and J those of the head on its arm."""
    definition = generic_without("joint_7")
    text = MultibodyPantographPart(definition).mechanism_warning()
    assert "the joints leave 6 degrees of freedom, a pantograph has 3" in text
    grown = float(re.search(r"pan_head spins about its y axis at ([\d.]+) 1/s", text)[1])
    head, arm = (next(b for b in definition.bodies if b.name == n) for n in ("pan_head", "stabilisation_arm"))
    force = float(re.search(r"under ([\d.]+) N", text)[1])
    mechanism = Mechanism(definition)
    at_rest = settle_springs(mechanism)
    pressed = equilibrium(mechanism, mechanism.strip_height(at_rest), contact_force=force, start=at_rest)
    z = mechanism.split(pressed.y).r[:, 2]
    height = z[mechanism.numbers["pan_head"]] - z[mechanism.numbers["stabilisation_arm"]]
    inertia = head.inertia[1] + arm.inertia[1] + head.mass * height**2
    assert grown == pytest.approx(np.sqrt((head.mass * 9.81 + force) * height / inertia), rel=0.05)


def test_two_locks_less_are_two_motions_more_and_one_of_them_grows():
    definition = generic_without("lock_4", "lock_6")
    mechanism = Mechanism(definition)
    assert degrees_of_freedom(mechanism, settle_springs(mechanism)) == 5
    text = MultibodyPantographPart(definition).mechanism_warning()
    assert "the joints leave 5 degrees of freedom" in text
    assert "lower_link spins about its x axis" in text


@pytest.mark.parametrize("name", ["generic_multibody", "CX_multibody"])
def test_pantographs_of_the_library_have_three_motions_and_none_grows(name):
    rig = Rig(library(name))
    assert rig.freedom == 3
    assert rig.warning(157.5) == ""
    found = rig.dynamics(5.02, np.array([1.0]))
    assert next(m.name for m in found.motions if m.frequency > 0.0) == "raise"
    assert "head heave" in {m.name for m in found.motions}
    assert MultibodyPantographPart(library(name)).mechanism_warning() == ""


def test_modes_of_the_generic_one_are_named_after_what_moves():
    found = Rig(library("generic_multibody")).dynamics(5.02, np.array([1.0]))
    named = {m.name: m.frequency for m in found.motions if m.frequency > 0.0}
    assert named == pytest.approx({"raise": 0.338, "head roll": 1.602, "head heave": 5.044}, abs=2e-3)


def test_neutral_and_growing_are_different_words():
    assert FreeMotion("raise", -1e-5 + 0j, 0.0, 1.0).remark == "neutral: rests at any height"
    assert FreeMotion("raise", -0.007 + 0j, 0.0, 1.0).remark == ""
    assert FreeMotion("head heave", 0.3 + 2j, 0.3, -0.1).remark == "grows at 0.3 1/s"


def test_a_cam_on_an_arm_without_a_damper_is_neutral_too():
    """s^2 = -k / m: of a stiffness as small as 0.01 N leave it, s itself is not small."""
    data = library_data("generic_multibody_cam")
    del data["force"]["raising_spring"]
    motions = [m for m in Rig(mechanism_from(data)).dynamics(5.02, np.array([1.0])).motions if m.name == "raise"]
    assert {m.remark for m in motions} == {"neutral: rests at any height"}


def test_a_bushing_is_untwisted_where_the_mechanism_was_put_together():
    """Beside a ball joint it does nothing there: the moment for the weights stays that of the ideal mechanism."""
    lifts = []
    for k in (0.0, 1e3, 1e4):
        data = library_data("generic_multibody")
        data["force"]["bushing"] = {
            "kind": "bushing",
            "body_i": "base",
            "body_j": "lower_link",
            "point_i": q([-0.259, 0.0, 0.0], "m"),
            "point_j": q([0.688, 0.0, 0.0], "m"),
            "rotation_stiffness": q([0.0, k, 0.0], "N.m/rad"),
        }
        mechanism = Mechanism(mechanism_from(data))
        lifts.append(equilibrium(mechanism, start=settle_springs(mechanism)).lift)
    assert lifts == pytest.approx([936.1028] * 3, rel=1e-6)


def test_a_strip_along_the_track_is_refused_before_anything_is_balanced():
    data = library_data("generic_multibody")
    data["body"]["pan_head"]["euler"] = q([0.0, 0.0, np.sqrt(0.5)], "1")
    data["assembly"]["largest_gap"] = q(5.0, "m")
    with pytest.raises(
        MechanismError, match=r"the strip lies along the track, 90 degrees .* check `euler` of body 'pan"
    ):
        MultibodyPantographPart(mechanism_from(data)).mechanism_warning()


def test_moments_of_inertia_that_no_body_has():
    data = library_data("generic_multibody")
    data["body"]["pan_head"]["inertia"] = q([0.23, 6.62, 16.87], "kg.m2")
    with pytest.raises(DefinitionError, match=r"body\.pan_head\.inertia: moments 0\.23, 6\.62, 16\.87 kg\.m2: no body"):
        mechanism_from(data)
    text = inertia_warning(library("generic_multibody"))
    assert "stabilisation_arm by 43 %, pan_head by 0.29 %" in text
    assert inertia_warning(library("CX_multibody")) == ""
