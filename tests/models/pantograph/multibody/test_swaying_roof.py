"""Mechanisms on a roof that sways: equations of motion, energy, the part between communication points."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from models.pantograph.multibody.base_motion import SwayMotion
from models.pantograph.multibody.mechanism import Inputs
from models.pantograph.multibody.mechanism_assembly import assemble
from models.pantograph.multibody.multibody_part import MultibodyPantographPart
from models.pantograph.operation import Drive, OperationError
from tests.models.pantograph.multibody.elements.test_base_frame import motion, sway_at
from tests.models.pantograph.multibody.mechanisms import body, joint, library, mechanism
from tests.models.pantograph.multibody.test_mechanisms import run

G = 9.81
PIVOT = np.array([0.4, 1.2])
REST = np.zeros(2)


def inputs_at(t):
    return Inputs(motion("z", t), sway=sway_at(t))


def roll_inputs(t):
    sway = sway_at(t)
    return Inputs(motion("z", t), sway=sway._replace(yaw=(0.0, 0.0, 0.0)))


def pivot_acceleration(t):
    """Return the acceleration in the plane y, z of a point of a roof that rolls, y and z of its origin moving too."""
    roll, rate, change = motion("roll", t)
    c, s = np.cos(roll), np.sin(roll)
    turned = np.array([[c, -s], [s, c]]) @ PIVOT
    own = np.array([motion("y", t)[2], motion("z", t)[2]])
    return own + change * np.array([-turned[1], turned[0]]) - rate**2 * turned


def test_a_pendulum_across_the_track_swings_as_its_pivot_makes_it():
    """Rod of length 2 l about an axis along the track: (J + m l2) a'' = -m l (r x (acceleration of the pivot + g))."""
    m, J, length = 2.0, 0.2, 0.5
    rod = body(m, (J, 0.01, J), (0.0, PIVOT[0] + length, PIVOT[1]))
    axis = {"axis_i": (1, 0, 0), "axis_j": (1, 0, 0)}
    hinge = joint("revolute", "base", "rod", point_i=(0, *PIVOT), point_j=(0, -length, 0), **axis)
    made = mechanism({"rod": rod}, {"hinge": hinge})
    start = made.standing_on(assemble(made), roll_inputs(0.0))

    def slope(t, u):
        down = pivot_acceleration(t) + np.array([0.0, G])
        moment = np.cos(u[0]) * down[1] - np.sin(u[0]) * down[0]
        return [u[1], -m * length * moment / (J + m * length**2)]

    rate = motion("roll", 0.0)[1]  # it begins at rest against the roof
    exact = solve_ivp(slope, (0.0, 0.25), [0.0, rate], rtol=1e-11, atol=1e-13).y[:, -1]
    end = made.split(run(made, start, 0.25, inputs=roll_inputs))
    angle = 2.0 * np.arctan2(end.p[1, 1], end.p[1, 0])
    assert np.cos(angle - exact[0]) == pytest.approx(1.0, abs=1e-12)
    assert end.w[1, 0] == pytest.approx(exact[1], abs=1e-6)


def test_a_rotating_pendulum_hangs_where_the_centrifugal_force_says():
    """Steady yaw at w about its pivot: cos a = m g l / ((J_y + m l2 - J_x) w2), a from the vertical."""
    m, J, length, w = 2.0, 0.2, 0.5, 6.0
    share = m * G * length / ((J + m * length**2 - 0.01) * w**2)
    down = 0.5 * np.pi - np.arccos(share)  # below the horizontal
    half = np.sin(0.5 * down)
    rod = body(m, (0.01, J, J), (length * np.cos(down), 0.0, -length * np.sin(down)), (0.0, half, 0.0))
    axis = {"axis_i": (0, 1, 0), "axis_j": (0, 1, 0)}
    hinge = joint("revolute", "base", "rod", point_i=(0, 0, 0), point_j=(-length, 0, 0), **axis)
    made = mechanism({"rod": rod}, {"hinge": hinge})
    still = (0.0, 0.0, 0.0)
    turning = lambda t: Inputs(sway=sway_at(0.0)._replace(y=still, roll=still, yaw=(w * t, w, 0.0)))  # noqa: E731
    start = made.standing_on(assemble(made), turning(0.0))
    end = made.split(run(made, start, 0.2, inputs=turning))
    assert end.r[1, 2] == pytest.approx(made.split(start).r[1, 2], abs=1e-7)
    ahead = np.array([np.cos(0.2 * w), np.sin(0.2 * w)])
    np.testing.assert_allclose(end.r[1, :2], length * np.cos(down) * ahead, atol=1e-6)


def swayed(part, duration, step=1e-3, force=150.0, start=0):
    for n in range(start, start + round(duration / step)):
        sway = tuple(v for m in sway_at(n * step) for v in m[:2])
        base = np.array(motion("z", n * step)[:2])
        part.step(force, np.array([part.strip[0, 0, 0], 0.0, 5.0]), base, step, Drive(sway=sway))
    return part


def start(name="generic_multibody", **values):
    part = MultibodyPantographPart(library(name).with_values(values))
    sway = tuple(v for m in sway_at(0.0) for v in m[:2])
    part.initialise(0.0, 150.0, np.zeros(3), np.array(motion("z", 0.0)[:2]), Drive(sway=sway))
    return part


def test_what_the_roof_does_is_in_the_balance():
    """Its drift is the error of the integration: small, and falling with the step."""
    coarse, fine = (swayed(start(monitor_energy=1), 0.06, h).energy for h in (1e-3, 5e-4))
    assert abs(coarse[0]) > 1.0
    assert abs(coarse[3]) < 1e-5 * np.abs(coarse).max()
    assert abs(fine[3]) < abs(coarse[3]) / 5.0


def test_joints_stay_closed_and_the_strip_goes_with_the_roof():
    part = swayed(start(), 0.15)
    found = dict(zip([name for name, _, _ in part.observed], part.observation_values(), strict=True))
    assert found["joints.violation"] < 1e-7
    before = part.strip.copy()
    swayed(part, 1e-3, start=150)
    np.testing.assert_allclose(
        (part.strip[:, 0] - before[:, 0]) / 1e-3, 0.5 * (before[:, 1] + part.strip[:, 1]), atol=2e-3
    )


def test_a_swaying_part_goes_on_from_a_snapshot_bit_for_bit():
    part = swayed(start(), 0.02)
    kept = part.snapshot()
    other = MultibodyPantographPart(part.definition)
    other.restore(kept)
    ends = [swayed(p, 0.02, start=20).snapshot() for p in (part, other)]
    assert all(np.array_equal(value, ends[1][name]) for name, value in ends[0].items())


def test_a_roof_that_has_never_swayed_has_no_frame():
    motion_of = SwayMotion()
    motion_of.start((0.0,) * 6)
    motion_of.receive((0.0,) * 6, 1e-3)
    assert motion_of.at(0.0) is None
    motion_of.receive((0.0, 0.0, 0.1, 0.0, 0.0, 0.0), 1e-3)
    assert motion_of.at(0.0).roll[:2] == (0.0, 0.0)
    assert motion_of.at(1e-3).roll[0] == pytest.approx(0.1)


@pytest.mark.parametrize("name", ["generic_multibody", "generic_multibody_cam"])
def test_the_lift_that_is_given_is_all_that_lifts(name):
    part = MultibodyPantographPart(library(name).with_values({"lift_input": 1, "speed": 0.0}))
    part.initialise(0.0, 100.0, np.zeros(3), REST, Drive(lift=1100.0))
    part.step(100.0, np.zeros(3), REST, 1e-3, Drive(lift=1175.0))
    found = dict(zip([n for n, _, _ in part.observed], part.observation_values(), strict=True))
    assert found["lift.moment"] == 1175.0
    if name.endswith("cam"):  # what the cam would hold with this moment
        own = MultibodyPantographPart(library(name).with_values({"static_force": found["uplift.force"]}))
        own.initialise(0.0, 0.0, np.zeros(3), REST)
        built = own._built
        assert built.mechanism.lift_value(part._y, Inputs(lift=found["uplift.force"])) == pytest.approx(1175.0)
    with pytest.raises(OperationError, match="uplift_force is 10 N, but with lift_input = 1"):
        part.step(100.0, np.zeros(3), REST, 1e-3, Drive(lift=1175.0, uplift=10.0))


def test_the_moment_that_the_statics_find_holds_the_pantograph_as_an_input_too():
    part = MultibodyPantographPart(library("generic_multibody").with_values({"lift_input": 1, "speed": 0.0}))
    part.initialise(0.0, 0.0, np.zeros(3), REST, Drive(lift=part._ready().balance))
    for _ in range(200):
        part.step(0.0, np.zeros(3), REST, 1e-3, Drive(lift=part._ready().balance))
    assert part.strip[0, 0, 2] == pytest.approx(5.02, abs=1e-9)
