"""docs/pantographs.md: every kind and key that the reader takes has its place there, and the worked example holds."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import fsolve

from models.pantograph.lumped.lumped_definition import LumpedDefinition, Stage
from models.pantograph.multibody.analysis.mechanism_freedom import degrees_of_freedom
from models.pantograph.multibody.analysis.mechanism_rig import Rig
from models.pantograph.multibody.analysis.mechanism_statics import contact_force_at
from models.pantograph.multibody.analysis.posture import take_posture
from models.pantograph.multibody.elements.joints import JOINT_ROWS
from models.pantograph.multibody.mechanism import Mechanism
from models.pantograph.multibody.mechanism_assembly import assemble
from models.pantograph.multibody.mechanism_definition import (
    FORCES,
    JOINTS,
    ActuatorForce,
    ActuatorMoment,
    Assembly,
    Body,
    LiftingForce,
    LiftingMoment,
    MechanismDefinition,
    SlidingFriction,
    SpringDamper,
    Strip,
    TurningFriction,
    WeightSpring,
)
from models.pantograph.multibody.mechanism_reading import load_mechanism

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/pantographs.md").read_text(encoding="utf-8")
EXAMPLE = ROOT / "docs/examples/four_bar.toml"
#: Classes behind a kind, where that depends on the keys.
SEVERAL = {
    "spring_damper": (SpringDamper, WeightSpring),
    "actuator_force": (ActuatorForce, LiftingForce),
    "actuator_moment": (ActuatorMoment, LiftingMoment),
    "joint_friction": (SlidingFriction, TurningFriction),
}


def row(kind):
    return next(line for line in PAGE.splitlines() if line.startswith(f"| `{kind}` |"))


def keys(cls):
    return {f.name for f in fields(cls)} - {"name", "provenance", "bodies", "joints", "forces"}


@pytest.mark.parametrize("kind", JOINTS)
def test_every_kind_of_joint_has_its_row_with_its_keys(kind):
    assert set(re.findall(r"`(\w+)`", row(kind))) == keys(JOINTS[kind]) | {kind}


@pytest.mark.parametrize("kind", FORCES)
def test_every_kind_of_force_has_its_row_with_its_keys(kind):
    classes = SEVERAL.get(kind) or (FORCES[kind],)
    assert set().union(*map(keys, classes)) <= set(re.findall(r"`(\w+)", row(kind)))


def test_rows_of_joints_are_those_that_they_take():
    example = Mechanism(load_mechanism(EXAMPLE))
    for joint in dict.fromkeys(example.joint_of_row):
        taken = sum(j is joint for j in example.joint_of_row)
        assert row(joint.kind).split("|")[2].strip() == str(taken)
    assert {cls.kind for cls in JOINT_ROWS} | {"prescribed_motion"} == set(JOINTS)


@pytest.mark.parametrize("cls", [LumpedDefinition, Stage, MechanismDefinition, Body, Strip, Assembly])
def test_every_other_key_is_named(cls):
    named = set(re.findall(r"`\[*(\w+)", PAGE))
    assert keys(cls) <= named


def test_the_example_closes_as_two_circles_do():
    """Tail of the upper arm on the thrust rod's circle, head of the levelling rod on the carrier; no code of ours."""
    definition = load_mechanism(EXAMPLE)
    mechanism = Mechanism(definition)
    y = assemble(mechanism)
    s = mechanism.split(y)
    of = dict(zip(mechanism.names, s.r, strict=True))
    turn = dict(zip(mechanism.names, 2.0 * np.arcsin(s.p[:, 2]), strict=True))

    def along(angle, x, z=0.0):  # a rotation about +y lowers the +x end
        return np.array([x * np.cos(angle) + z * np.sin(angle), z * np.cos(angle) - x * np.sin(angle)])

    rods = {n: 2.0 * abs(next(j for j in definition.joints if j.name == n).point_j[0]) for n in ("thrust_lower",)}
    knee = np.array([0.20, 0.13]) + along(turn["lower_arm"], -1.6)

    def open_by(angle):
        tail = knee + along(angle[0], 0.95) + along(angle[0], -1.12, -0.12)
        return np.linalg.norm(tail - [-0.25, 0.0]) - rods["thrust_lower"]

    angle = fsolve(open_by, turn["upper_arm"] + 0.01, xtol=1e-14)[0]
    assert angle == pytest.approx(turn["upper_arm"], abs=1e-9)
    centre = knee + along(angle, 0.95)
    assert of["upper_arm"][[0, 2]] == pytest.approx(centre, abs=1e-9)
    wrist = knee + along(angle, 2.0)
    assert of["carrier"][[0, 2]] == pytest.approx(wrist, abs=1e-9)


def test_the_example_has_three_motions_and_holds_its_force():
    mechanism = Mechanism(load_mechanism(EXAMPLE))
    posture = take_posture(mechanism)
    assert degrees_of_freedom(mechanism, posture.reference) == 3
    assert mechanism.constraints.count == 33
    for height in (4.52, 5.52):
        found = contact_force_at(mechanism, height - posture.base_height, 120.0, start=posture.reference)
        assert found.inputs.force == pytest.approx(120.0, abs=0.01)


def test_what_the_page_prints_of_it_is_what_comes_out():
    motions = Rig(load_mechanism(EXAMPLE)).dynamics(5.02, np.array([1.0]), 120.0).motions
    printed = re.findall(r"^ +([\d.]+) +([\d.]+) +(head \w+)$", PAGE, re.M)
    assert len(printed) == 2
    for frequency, damping, name in printed:
        found = next(m for m in motions if m.name == name)
        assert f"{found.frequency:.3f}" == frequency
        assert f"{100.0 * found.damping:.2f}" == damping
    assert "neutral: rests at any height" in {m.remark for m in motions}
