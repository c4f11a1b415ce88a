"""A roof that sways, against rotation matrices written out and differentiated numerically."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.pantograph.multibody.base_motion import Sway
from models.pantograph.multibody.elements.base_frame import BaseFrame
from models.pantograph.multibody.elements.rotations import euler_parameters, rotation_matrices

R = np.array([[0.3, -0.7, 1.9], [0.0, 0.0, 0.0]])
P = euler_parameters(np.array([[0.1, -0.2, 0.3], [0.0, 0.0, 0.0]]))
WAVES = {"y": (0.04, 5.0), "z": (0.03, 7.0), "roll": (0.2, 6.0), "yaw": (0.3, 4.0)}


def motion(name, t):
    """Return value, rate and acceleration of a coordinate."""
    a, w = WAVES[name]
    return a * np.sin(w * t), a * w * np.cos(w * t), -a * w * w * np.sin(w * t)


def sway_at(t):
    return Sway(*(motion(name, t) for name in Sway._fields))


def placed(t):
    """Return positions and rotation matrices of the bodies, by scipy."""
    y, z, roll, yaw = (motion(name, t)[0] for name in ("y", "z", "roll", "yaw"))
    turn = Rotation.from_euler("z", yaw) * Rotation.from_euler("x", roll)
    own = Rotation.from_quat(P[:, [1, 2, 3, 0]])
    return turn.apply(R) + np.array([0.0, y, z]), (turn * own).as_matrix()


def test_bodies_move_as_the_roof_does():
    """Places as matrices say; rates and accelerations are their differences, of order 4 in the step."""
    t, h = 0.37, 2e-3
    found = BaseFrame.of(motion("z", t), sway_at(t)).carry(R, P)
    (r, A), near = placed(t), [placed(t + k * h) for k in (-2, -1, 1, 2)]
    np.testing.assert_allclose(found.r, r, atol=1e-14)
    np.testing.assert_allclose(rotation_matrices(found.p), A, atol=1e-14)
    first, second = np.array([1, -8, 8, -1]) / 12.0, np.array([-1, 16, 16, -1]) / 12.0
    rate = sum(c * p for c, (p, _) in zip(first, near, strict=True)) / h
    change = (sum(c * p for c, (p, _) in zip(second, near, strict=True)) - 2.5 * r) / h**2
    np.testing.assert_allclose(found.v, rate, atol=1e-8)
    np.testing.assert_allclose(found.acceleration, change, atol=1e-6)
    turning = sum(c * a for c, (_, a) in zip(first, near, strict=True)) / h
    spin = A.transpose(0, 2, 1) @ turning
    np.testing.assert_allclose(found.w, np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1), atol=1e-8)


def test_angular_accelerations_are_rates_of_the_angular_velocities():
    t, h = 0.8, 1e-5
    before, now, after = (BaseFrame.of(motion("z", s), sway_at(s)).carry(R, P) for s in (t - h, t, t + h))
    np.testing.assert_allclose((after.w - before.w) / (2 * h), now.turning, rtol=1e-7)


@pytest.mark.parametrize("name", ["roll", "yaw"])
def test_a_positive_angle_turns_the_right_way(name):
    """Roll lifts what lies to the left, yaw moves what lies ahead to the left."""
    still = (0.0, 0.0, 0.0)
    frame = BaseFrame.of(still, Sway(still, *((0.1, 0.0, 0.0) if n == name else still for n in ("roll", "yaw"))))
    ahead, left = frame.carry(np.array([[1.0, 0, 0], [0, 1.0, 0]]), P[1:].repeat(2, axis=0)).r
    assert (left[2] > 0.09, ahead[1] > 0.09) == (name == "roll", name == "yaw")
