"""The generic pantograph with more elements than it has in the library."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from models.library.catalogue import load_pantograph
from models.pantograph.multibody.mechanism_definition import (
    ActuatorForce,
    ActuatorMoment,
    AngleStop,
    BumpStop,
    Fixed,
    Prismatic,
    Revolute,
    SlideAndTurnFriction,
    SlidingFriction,
    SpringDamper,
    TurningFriction,
)


def unit(*vector):
    """A direction as the reader makes it."""
    return tuple((np.array(vector) / np.linalg.norm(vector)).tolist())


def with_everything():
    """The generic pantograph with every element that the reduced form knows, each where it acts."""
    d = load_pantograph("generic_multibody")
    head = {"body_i": "stabilisation_arm", "body_j": "pan_head"}
    arm = {"body_i": "base", "body_j": "lower_arm"}
    y = (0.0, 1.0, 0.0)
    roll = Revolute(
        name="joint_8", body_i="frame", body_j="pan_head", point_i=(0.01, 0.0, 0.02), point_j=(0.0, 0.0, 0.02),
        axis_i=unit(1.0, 0.2, 0.1), axis_j=unit(1.0, 0.2, 0.1),
    )  # fmt: skip
    slide = Prismatic(
        name="slide", body_i="stabilisation_arm", body_j="frame", point_i=(0.0, 0.0, 0.0), point_j=(0.0, 0.0, 0.0),
        axis_i=unit(0.1, 0.0, 1.0),
    )  # fmt: skip
    frame = replace(next(b for b in d.bodies if b.name == "pan_head"), name="frame", mass=3.0, inertia=(0.1, 0.2, 0.15))
    horn = replace(frame, name="horn", mass=0.7, position=(0.6, 0.3, 1.6))
    held = Fixed(name="held", body_i="pan_head", body_j="horn", point_i=(0.0, 0.3, 0.1), point_j=(-0.047, 0.0, -0.002))
    sprung = {"point_i": (0.1, 0.3, 0.0), "point_j": (0.0, 0.3, 0.02), "stiffness": 900.0, "damping": 30.0}
    forces = (
        *(f for f in d.forces if not f.name.startswith("suspension")),
        TurningFriction(name="f1", joint="joint_1", moment=30.0, transition=0.2),
        TurningFriction(name="f2", joint="joint_4", moment=5.0, transition=0.3),
        TurningFriction(name="f3", joint="joint_8", moment=4.0, transition=0.3),
        SlidingFriction(name="f4", joint="slide", force=6.0, transition=0.1),
        ActuatorMoment(name="m1", body_i="lower_arm", body_j="upper_arm", axis_i=y, moment=12.0),
        ActuatorMoment(name="m2", body_i="frame", body_j="pan_head", axis_i=unit(0.5, 0.0, 0.3), moment=3.0),
        AngleStop(name="a1", **arm, axis_i=y, lowest=-0.05, highest=0.05, stiffness=900.0, damping=40.0),
        BumpStop(
            name="b1", **arm, point_i=(-0.2, 0.0, 0.0), point_j=(0.8, 0.0, -0.1), shortest=0.5, longest=0.6,
            stiffness=800.0, damping=20.0,
        ),
        ActuatorForce(name="p1", **arm, point_i=(-0.2, 0.0, 0.1), point_j=(0.5, 0.0, -0.1), force=40.0),
        SpringDamper(name="s1", **head, **sprung, free_length=0.1),
        SpringDamper(name="s2", **head, **sprung, free_length=0.1, direction=unit(0.0, 0.1, 1.0)),
        BumpStop(
            name="b2", body_i="frame", body_j="horn", point_i=(0.1, 0.2, 0.0), point_j=(0.0, 0.0, 0.0), shortest=0.16,
            longest=0.17, stiffness=2e3, damping=20.0,
        ),
        ActuatorForce(name="p2", **head, point_i=(0.1, 0.3, 0.0), point_j=(0.0, 0.3, 0.02), force=15.0),
    )  # fmt: skip
    joints = (*(j for j in d.joints if j.name != "joint_8"), slide, roll, held)
    assembly = replace(d.assembly, largest_gap=0.2)
    return replace(d, bodies=(*d.bodies, frame, horn), joints=joints, forces=forces, assembly=assembly)


def pitching_head():
    """A head that pitches about y on a slide of its own, with a stop about its hinge."""
    d = with_everything()
    y = (0.0, 1.0, 0.0)
    hinge = Revolute(
        name="joint_8", body_i="pan_head", body_j="frame", point_i=(0.01, 0.0, 0.02), point_j=(0.0, 0.0, 0.02),
        axis_i=y, axis_j=y,
    )  # fmt: skip
    stop = AngleStop(
        name="a2", body_i="frame", body_j="pan_head", axis_i=y, lowest=-0.04, highest=0.06, stiffness=700.0, damping=9.0
    )
    joints = tuple(hinge if j.name == "joint_8" else j for j in d.joints)
    return replace(d, joints=joints, forces=(*d.forces, stop))


def rubbing_head():
    """The generic head, whose joint slides and turns, with friction of both."""
    d = load_pantograph("generic_multibody")
    friction = SlideAndTurnFriction(
        name="f", joint="joint_8", force=9.0, slide_transition=0.1, moment=4.0, transition=0.3
    )  # fmt: skip
    return replace(d, forces=(*d.forces, friction))
