"""The force with which the strip presses as a wire moves it up and down: what friction and dampers take or add.

Quasi-static, without inertia: the strip goes through the states of rest at a constant speed, and the power of all
forces but the wire's is what the wire takes.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from models.arrays import FloatArray
from models.pantograph.multibody.analysis.mechanism_statics import contact_force_at
from models.pantograph.multibody.elements.force_elements import rotation_vector
from models.pantograph.multibody.elements.rotations import rotation_matrices
from models.pantograph.multibody.mechanism import Inputs, Mechanism

#: Half the way over which the states of rest are compared [m].
_NEAR: Final = 1e-3


class MovedForces(NamedTuple):
    """Contact forces as the strip goes up and down through a place [N]; the state of rest there, shape (13 n,)."""

    up: float
    down: float
    y: FloatArray


def moved_forces(mechanism: Mechanism, height: float, lift: float, speed: float, start: FloatArray) -> MovedForces:
    """Return the contact forces as the strip moves up and as it moves down through a height.

    Parameters
    ----------
    mechanism : Mechanism
    height : float
        Of the strip's middle above the base's origin [m].
    lift : float
        What is set of the lifting element [N, N.m or 1].
    speed : float
        [m/s]
    start : ndarray, shape (13 n,)
        A state of rest nearby.

    Raises
    ------
    MechanismError
        If there is no equilibrium.
    """
    y = contact_force_at(mechanism, height, lift, start=start).y
    below, above = (contact_force_at(mechanism, height + side, lift, start=y).y for side in (-_NEAR, _NEAR))
    v, turning = _tangent(mechanism, below, above)
    up, down = (_force(mechanism, y, lift, way * speed * v, way * speed * turning) for way in (1.0, -1.0))
    return MovedForces(up, down, y)


def _tangent(mechanism: Mechanism, below: FloatArray, above: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return velocities and global angular velocities of all bodies per speed of the strip, shape (n, 3) each."""
    low, high = mechanism.split(below), mechanism.split(above)
    turns = zip(rotation_matrices(high.p), rotation_matrices(low.p), strict=True)
    turning = np.array([rotation_vector(a @ b.T) for a, b in turns])
    return (high.r - low.r) / (2.0 * _NEAR), turning / (2.0 * _NEAR)


def _force(mechanism: Mechanism, y: FloatArray, lift: float, v: FloatArray, turning: FloatArray) -> float:
    s = mechanism.split(y)
    w = (rotation_matrices(s.p).transpose(0, 2, 1) @ turning[:, :, None])[:, :, 0]
    moving = mechanism.join(s.r, s.p, v, w)
    kinematics = mechanism.kinematics(moving)
    motion = np.concatenate([v, turning], axis=1)
    free = slice(mechanism.driven, None)
    given = float((mechanism.loads(moving, kinematics, Inputs(lift=lift)) * motion)[free].sum())
    taken = float(mechanism.contact_load(moving, Inputs(force=1.0)) @ motion[mechanism.strip_body])
    return -given / taken
