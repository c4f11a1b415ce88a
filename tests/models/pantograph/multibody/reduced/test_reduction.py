"""What can be reduced, and what is told where it cannot."""

from __future__ import annotations

from dataclasses import replace

import pytest

from models.commands.physics_main import main
from models.library.catalogue import load_pantograph
from models.pantograph.multibody.analysis.mechanism_statics import settle_springs
from models.pantograph.multibody.mechanism import Mechanism
from models.pantograph.multibody.mechanism_assembly import assemble
from models.pantograph.multibody.mechanism_definition import Bushing, SpringDamper, Universal
from models.pantograph.multibody.reduced.reduced_motion import reduced_if_possible
from models.pantograph.multibody.reduced.reduction import reduction_of, unsuitable_drive
from models.pantograph.operation import NO_DRIVE, Drive
from models.pantograph.train_motion import SpeedProfile


def found(name):
    mechanism = Mechanism(load_pantograph(name))
    return reduction_of(mechanism, settle_springs(mechanism))


def test_the_generic_pantograph_is_an_arm_with_a_head():
    reduction = found("generic_multibody")
    assert reduction.carrier == "stabilisation_arm"
    assert [link.body for link in reduction.head] == ["pan_head"]
    assert reduction.driver.name == "joint_1"
    assert reduction.arm.names[0] == "base"
    assert len(reduction.arm.names) == 6


def test_masses_on_slides_are_an_arm_of_one_and_two_more():
    reduction = found("CX_multibody")
    assert reduction.carrier == "m1"
    assert [link.body for link in reduction.head] == ["m2", "m3"]


def form_of(definition):
    mechanism = Mechanism(definition)
    return reduced_if_possible(mechanism, assemble(mechanism))


def changed(**changes):
    return replace(load_pantograph("generic_multibody"), **changes)


def test_the_form_is_told_in_words():
    model, text = form_of(changed())
    assert model is not None
    assert text == (
        "reduced form of the equations of motion, in coordinates of the arm, the roll of the head and one displacement"
    )


def beside():
    d = load_pantograph("generic_multibody")
    here = {"point_i": (0.0, 0.0, 0.0), "point_j": (0.0, 0.0, 0.0)}
    across = SpringDamper(name="far", body_i="lower_arm", body_j="pan_head", stiffness=10.0, **here)
    soft = Bushing(name="soft", body_i="stabilisation_arm", body_j="pan_head", **here)
    joints = tuple(
        Universal(
            name="joint_8", body_i=j.body_i, body_j=j.body_j, point_i=j.point_i, point_j=j.point_j,
            axis_i=(1.0, 0.0, 0.0), axis_j=(0.0, 1.0, 0.0),
        )
        if j.name == "joint_8"
        else j
        for j in d.joints
    )  # fmt: skip
    return d, across, soft, joints


def reasons():
    d, across, soft, joints = beside()
    return {
        "general": (replace(d, formulation="general"), "the definition says so (formulation)"),
        "energy": (replace(d, monitor_energy=1), "the balance of energy is kept of the bodies (monitor_energy)"),
        "train": (replace(d, use_train=1), "its speed changes (speed_profile, use_train)"),
        "profile": (
            replace(d, speed_profile=SpeedProfile(time=(0.0, 1.0), speed=(20.0, 30.0))),
            "its speed changes (speed_profile, use_train)",
        ),
        "lift": (replace(d, lift_input=1), "its lift is an input (lift_input)"),
        "across": (
            replace(d, forces=(*d.forces, across)),
            "force 'far' acts between head and arm (lower_arm, pan_head)",
        ),
        "bushing": (
            replace(d, forces=(*d.forces, soft)),
            "force 'soft' is of a kind that the reduced form does not have (bushing)",
        ),
        "universal": (
            replace(d, joints=joints, assembly=replace(d.assembly, largest_gap=0.2)),
            "its closed part has 3 degrees of freedom",
        ),
    }


@pytest.mark.parametrize("kind", sorted(reasons()))
def test_what_does_not_fit_stays_in_the_general_form_and_is_told_why(kind):
    definition, reason = reasons()[kind]
    model, text = form_of(definition)
    assert model is None
    assert text == f"general form of the equations of motion: {reason}"


def test_inputs_that_the_reduced_form_does_not_know_are_named():
    assert unsuitable_drive(NO_DRIVE) == ""
    assert unsuitable_drive(Drive(air=3.0, uplift=20.0, lift=1.0, train=(3.0, 50.0))) == ""
    assert "(sway)" in unsuitable_drive(Drive(sway=(0.0, 0.0, 0.1, 0.0, 0.0, 0.0)))


def test_a_head_on_a_crooked_arm_is_no_plane_one():
    """The carrier has to stay in the plane of the track: here its hinge is askew, and the arm moves sideways."""
    d = load_pantograph("CX_multibody")
    joints = tuple(replace(j, axis_i=(0.0, 0.3, 1.0)) if j.name == "slide_1" else j for j in d.joints)
    model, text = form_of(replace(d, joints=joints, assembly=replace(d.assembly, largest_gap=0.2)))
    assert model is None
    assert text.endswith("body 'm1' does not stay in the plane of the track")


def test_the_command_prints_the_form(capsys):
    assert main(["pantograph", "CX_multibody"]) == 0
    said = "reduced form of the equations of motion, in coordinates of the arm and 2 displacements"
    assert said in capsys.readouterr().out
