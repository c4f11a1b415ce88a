"""Friction of joints, and the test figure that it makes: the static force with the strip moved up and down."""

import numpy as np
import pytest

from models.commands import physics_main
from models.commands.cam_curves import write_cam
from models.definition_files.toml_reader import DefinitionError
from models.library.catalogue import load_pantograph
from models.pantograph.lumped import lumped_rig
from models.pantograph.multibody.analysis.mechanism_rig import Rig
from models.pantograph.multibody.analysis.mechanism_statics import contact_force_at
from models.pantograph.multibody.mechanism import Inputs
from tests.models.pantograph.multibody.mechanisms import body, joint, mechanism, mechanism_from, q
from tests.models.pantograph.multibody.test_broken_definitions import library_data

SPEED = 0.05


def angle(rig, height):
    found = contact_force_at(rig.mechanism, height - rig.base_height, rig.definition.lift, start=rig.reference)
    return rig.mechanism.forces.lift_place.at(rig.mechanism.kinematics(found.y))


@pytest.mark.parametrize("cam", [False, True])
def test_the_force_goes_up_and_down_by_the_moment_over_the_rise(cam):
    """By hand: F -+ M_f tanh(w / w0) / z', w = 0.05 / z', z' the rise of the strip per angle of the arm."""
    data = library_data("generic_multibody_cam" if cam else "generic_multibody")
    data["force"]["rub"] = {
        "kind": "joint_friction", "joint": "joint_1", "moment": q(20.0, "N.m"), "transition": q(0.02, "rad/s"),
    }  # fmt: skip
    for spring in ("raising_spring", "suspension_left", "suspension_right"):
        del data["force"][spring]["damping"]
    rig = Rig(mechanism_from(data))
    heights = np.array([4.8, 5.3])
    rise = np.array([2e-3 / (angle(rig, h + 1e-3) - angle(rig, h - 1e-3)) for h in heights])
    against = 20.0 * np.tanh(SPEED / rise / 0.02) / rise
    moved = rig.up_and_down(heights, SPEED)
    assert moved[:, 0] == pytest.approx(heights)
    assert moved[:, 1:].mean(axis=1) == pytest.approx(rig.statics(heights, 100.0).contact_force, abs=2e-3)
    assert 0.5 * (moved[:, 2] - moved[:, 1]) == pytest.approx(against, rel=1e-4)
    if cam:
        curve = rig.mechanism.forces.cam.per_lift
        assert rise == pytest.approx([curve.at(angle(rig, h)) for h in heights], rel=3e-3)


def test_masses_press_less_by_friction_damping_and_lag_on_the_way_up():
    cx = load_pantograph("CX").with_values({"stage[1].friction": 8.0, "follow_height": 1})
    (row,) = lumped_rig.up_and_down(cx, np.array([5.3]), SPEED)
    against = 8.0 + (108.39 + 178.45 * 0.5) * SPEED
    assert row.tolist() == pytest.approx([5.3, 168.0 - against, 168.0 + against])


def head(**friction):
    """Return a head that rolls and heaves on the base, with friction."""
    held = joint(
        "revolute_prismatic", "base", "head", point_i=(0, 0, 1), point_j=(0, 0, 0), axis_i=(1, 0, 0), axis_j=(0, 0, 1)
    )
    return mechanism(
        {"head": body(5.0, (1.0, 0.5, 0.6), (0, 0, 1))},
        {"held": held},
        {"rub": {"kind": "joint_friction", "joint": "held", **friction}},
        gravity=q(0.0, "m/s2"),
    )


SLIDE = {"force": q(12.0, "N"), "slide_transition": q(0.01, "m/s")}
TURN = {"moment": q(3.0, "N.m"), "transition": q(0.2, "rad/s")}


@pytest.mark.parametrize(
    ("friction", "force", "moment"), [(SLIDE, 12.0, 0.0), (TURN, 0.0, 3.0), (SLIDE | TURN, 12.0, 3.0)]
)
def test_a_head_rubs_as_it_slides_and_as_it_rolls(friction, force, moment):
    m = head(**friction)
    s = m.split(m.written_state())
    v, w = np.zeros((2, 3)), np.zeros((2, 3))
    v[1, 2], w[1, 0] = 0.008, -0.1
    moving = m.join(s.r, s.p, v, w)
    loads = m.loads(moving, m.kinematics(moving), Inputs())
    assert loads[1] == pytest.approx([0, 0, -force * np.tanh(0.8), moment * np.tanh(0.5), 0, 0])
    assert loads[0, [2, 3]] == pytest.approx(-loads[1, [2, 3]])


def test_a_head_that_has_rolled_rubs_along_its_own_axis():
    m = head(**SLIDE)
    s = m.split(m.written_state())
    p, v = s.p.copy(), np.zeros((2, 3))
    p[1] = [np.cos(0.2), np.sin(0.2), 0.0, 0.0]  # 0.4 rad about x
    along = np.array([0.0, -np.sin(0.4), np.cos(0.4)])
    v[1] = 0.008 * along
    moving = m.join(s.r, p, v, np.zeros((2, 3)))
    loads = m.loads(moving, m.kinematics(moving), Inputs())
    assert loads[1, :3] == pytest.approx(-12.0 * np.tanh(0.8) * along)
    assert loads[0, :3] == pytest.approx(-loads[1, :3])


@pytest.mark.parametrize(
    ("friction", "told"),
    [
        (
            {"force": q(1.0, "N"), "transition": q(0.1, "m/s")},
            r"rub\.transition: that of the slide .* 'slide_transition'",
        ),
        (SLIDE | {"moment": q(1.0, "N.m")}, r"force\.rub\.transition: is missing: the speed in rad/s"),
        (SLIDE | {"transition": q(1.0, "rad/s")}, r"force\.rub\.transition: does nothing without a 'moment'"),
        (
            SLIDE | {"joint": "joint_1"},
            r"rub\.slide_transition: is for a revolute_prismatic joint; 'joint_1' is revolute",
        ),
    ],
)
def test_friction_that_does_not_suit_its_joint(friction, told):
    data = library_data("generic_multibody")
    data["force"]["rub"] = {"kind": "joint_friction", "joint": "joint_8"} | friction
    with pytest.raises(DefinitionError, match=told):
        mechanism_from(data)


def test_the_command_prints_it_and_judges_by_a_limit_that_is_given(tmp_path, capsys):
    words = ["pantograph", "CX", "--set", "pantograph.follow_height=1", "--out", str(tmp_path / "out")]
    assert physics_main.main([*words, "--limit", "10"]) == 0
    said = capsys.readouterr().out
    assert "from 1." in said
    assert "moved up and down at 0.05 m/s" in said
    assert "largest half difference 9.88 N at 4.520 m: passed, limit 10 N" in said
    rows = np.loadtxt(tmp_path / "out" / "static_force_up_down.csv", delimiter=",", skiprows=1)
    assert rows[:, 4] == pytest.approx((178.45 * 0.5 + 108.39) * SPEED)


def test_values_that_do_nothing_are_told(capsys):
    words = ["pantograph", "CX", "--set", "pantograph.reference_time=0.7", "--set", "pantograph.stop_damping=1"]
    assert physics_main.main(words) == 0
    said = capsys.readouterr().err
    assert "reference_time does nothing without follow_height = 1" in said
    assert "stop_damping does nothing without lowest_height or highest_height" in said


@pytest.mark.parametrize(("time", "frequency", "less"), [(0.2, 1.70, 14.4), (0.5, 1.27, 19.8), (1.6, 0.89, 39.4)])
def test_the_trade_of_the_time_constant_is_the_documented_one(time, frequency, less):
    cx = load_pantograph("CX").with_values({"follow_height": 1, "reference_time": time})
    assert lumped_rig.alike_from(cx) == pytest.approx(frequency, abs=0.01)
    assert 0.1 * (cx.stage[0].stiffness * time + cx.stage[0].damping) == pytest.approx(less, abs=0.05)


def test_the_cam_is_written_with_the_place_and_the_height(tmp_path):
    rig = Rig(mechanism_from(library_data("generic_multibody_cam")))
    curves = rig.cam_curves(5)
    assert np.degrees(curves.place[[0, -1]]) == pytest.approx(
        np.degrees([rig.mechanism.forces.stops.stops[0].lowest, rig.mechanism.forces.stops.stops[0].highest])
    )
    assert np.all(np.diff(curves.height) > 0.0)
    # The rise of the strip per angle is what a newton takes, up to the head's tilt.
    slope = np.gradient(curves.height, curves.place)[2]
    assert slope == pytest.approx(curves.per_lift[2], rel=0.05)
    write_cam(tmp_path, "t", curves, 17)
    assert np.loadtxt(tmp_path / "cam.csv", delimiter=",", skiprows=1)[:, 1] == pytest.approx(curves.height)
