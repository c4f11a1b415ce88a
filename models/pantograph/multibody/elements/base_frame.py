"""How a roof that moves carries the bodies that stand on it.

The roof yaws by psi about z and rolls by phi about its own x axis: with R = R_z(psi) R_x(phi) a point r_0 of it is at
o + R r_0, o being where the base's origin is. Its angular velocity in its own axes is (phi', psi' sin phi,
psi' cos phi).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from models.arrays import FloatArray
from models.pantograph.multibody.base_motion import Sway
from models.pantograph.multibody.elements.rotations import cross, rotation_matrices


class Carried(NamedTuple):
    """Bodies as the roof carries them: positions, Euler parameters, velocities, body-fixed angular velocities; then
    accelerations, linear ones and body-fixed angular ones.
    """

    r: FloatArray
    p: FloatArray
    v: FloatArray
    w: FloatArray
    acceleration: FloatArray
    turning: FloatArray


class BaseFrame(NamedTuple):
    """Where the roof is and how it moves at one instant.

    Attributes
    ----------
    p : ndarray, shape (4,)
        Euler parameters.
    origin, velocity, acceleration : ndarray, shape (3,)
        Of the base's origin, from where it is at rest [m, m/s, m/s2].
    w, turning : ndarray, shape (3,)
        Angular velocity and acceleration in the roof's axes [rad/s, rad/s2].
    """

    p: FloatArray
    origin: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    w: FloatArray
    turning: FloatArray

    @classmethod
    def of(cls, base: tuple[float, float, float], sway: Sway) -> BaseFrame:
        """Return the frame of a roof that sways and whose height, its rate and its acceleration are ``base``."""
        (roll, roll_rate, roll_change), (yaw, yaw_rate, yaw_change) = sway.roll, sway.yaw
        c, s = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
        d, t = math.cos(0.5 * roll), math.sin(0.5 * roll)
        sine, cosine = math.sin(roll), math.cos(roll)
        mixed = yaw_rate * roll_rate
        origin, velocity, acceleration = (np.array([0.0, side, up]) for side, up in zip(sway.y, base, strict=True))
        return cls(
            np.array([c * d, c * t, s * t, s * d]),
            origin,
            velocity,
            acceleration,
            np.array([roll_rate, yaw_rate * sine, yaw_rate * cosine]),
            np.array([roll_change, yaw_change * sine + mixed * cosine, yaw_change * cosine - mixed * sine]),
        )

    @property
    def angular_velocity(self) -> FloatArray:
        """The roof's angular velocity in the axes of the track, shape (3,) [rad/s]."""
        velocity: FloatArray = rotation_matrices(self.p[None])[0] @ self.w
        return velocity

    def carry(self, r: FloatArray, p: FloatArray) -> Carried:
        """Return bodies that stand on the roof, at rest against it.

        Parameters
        ----------
        r, p : ndarray, shape (n, 3), (n, 4)
            Where they are while the roof is at rest: positions [m], Euler parameters.
        """
        turn, w, turning = rotation_matrices(self.p[None])[0], self.w, self.turning
        around = cross(w, r)
        own = rotation_matrices(p)
        return Carried(
            self.origin + r @ turn.T,
            _product(self.p, p),
            self.velocity + around @ turn.T,
            w @ own,
            self.acceleration + (cross(turning, r) + cross(w, around)) @ turn.T,
            turning @ own,
        )


def _product(first: FloatArray, p: FloatArray) -> FloatArray:
    """Return the Euler parameters of one rotation after others, shape (n, 4)."""
    a, b = first[0], first[1:]
    vector = a * p[:, 1:] + p[:, :1] * b + cross(b[None], p[:, 1:])
    return np.concatenate([a * p[:, :1] - (p[:, 1:] @ b)[:, None], vector], axis=1)
