"""What describes a lumped pantograph on a test rig: statics over the working height, modes, response of the strip."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import ComplexArray, FloatArray
from models.pantograph.lumped.following_reference import link_stiffness
from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.lumped.lumped_model import LumpedModel

#: Change of a modulus that counts as none.
_ALIKE: Final = 0.02


@dataclass(frozen=True)
class LumpedMode:
    """A free motion of a lumped pantograph, its strip free.

    Attributes
    ----------
    frequency : float
        |s| / 2 pi of the eigenvalue s if it oscillates, else 0 [Hz].
    damping : float
        -Re s / |s|.
    """

    frequency: float
    damping: float


def chain_stiffness(
    frequency: FloatArray,
    masses: FloatArray,
    dampings: FloatArray,
    stiffnesses: FloatArray,
    reference_time: float | FloatArray = math.inf,
) -> ComplexArray:
    """Return the dynamic stiffness at the top of a chain of masses on fixed ground, shape (f,) [N/m].

    Parameters
    ----------
    frequency : ndarray, shape (f,)
        [Hz]
    masses, dampings, stiffnesses : ndarray, shape (n,)
        Bottom to top; damper and spring i connect mass i to the one below. Of shape (n, p, 1) they are those of p
        chains, and the result has shape (p, f).
    reference_time : float or ndarray, shape (p, 1)
        Time constant of a lowest spring that hangs on a reference following the height [s]; infinite: on the ground.
    """
    s = 2j * np.pi * np.asarray(frequency)
    total: ComplexArray | None = None
    for m, c, k in zip(masses, dampings, stiffnesses, strict=True):
        link = k + s * c
        if total is None and np.isfinite(reference_time).all():
            link = link_stiffness(np.asarray(frequency), k, c, reference_time)
        total = s**2 * m + (link if total is None else link * total / (link + total))
    if total is None:
        raise ValueError("a chain needs at least one stage")
    return total


def contact_force_over_height(definition: LumpedDefinition, heights: FloatArray) -> FloatArray:
    """Return the static contact force that holds the strip at given heights above top of rail [N].

    The static force itself where the lowest spring follows the height.

    Parameters
    ----------
    heights : ndarray, shape (h,)
        [m]

    Returns
    -------
    ndarray, shape (h,)
    """
    if definition.follow_height:
        return np.full(len(heights), definition.static_force)
    flexibility = np.linalg.inv(LumpedModel(definition).K)
    free_rise = flexibility[-1, 0] * definition.static_force
    result: FloatArray = (free_rise - (heights - definition.reference_height)) / flexibility[-1, -1]
    return result


def contact_force_over_speed(definition: LumpedDefinition, speeds: FloatArray) -> FloatArray:
    """Return the static contact force at the reference height over the speed against the air [N].

    Parameters
    ----------
    speeds : ndarray, shape (s,)
        [m/s]

    Returns
    -------
    ndarray, shape (s, 2)
        With the knuckle leading, and trailing.
    """
    squares, shares = np.abs(speeds) * speeds, np.array(definition.air_shares)
    reaching = np.ones(len(shares))  # what comes of a force on each mass at the strip
    if not definition.follow_height:
        flexibility = np.linalg.inv(LumpedModel(definition).K)
        reaching = flexibility[-1] / flexibility[-1, -1]
    uplift = np.outer(squares, np.array(definition.aerodynamic_uplift)) * float(reaching @ shares)
    result: FloatArray = reaching[0] * definition.static_force + uplift
    return result


def up_and_down(definition: LumpedDefinition, heights: FloatArray, speed: float) -> FloatArray:
    """Return strip heights [m] and the forces with which the strip presses as it goes up and down through them [N].

    All masses move alike, slowly and for long, so that of dampers and friction those against the roof count, and a
    reference that follows lags by speed times time constant.

    Parameters
    ----------
    heights : ndarray, shape (h,)
    speed : float
        [m/s]

    Returns
    -------
    ndarray, shape (h, 3)
    """
    lowest = definition.stage[0]
    lag = lowest.stiffness * definition.reference_time if definition.follow_height else 0.0
    against = lowest.friction + (lowest.damping + lag) * speed
    force = contact_force_over_height(definition, heights)
    return np.stack([heights, force - against, force + against], axis=1)


def alike_from(definition: LumpedDefinition) -> float:
    """Return the frequency from which a following reference changes the strip's apparent mass by less than 2 % [Hz]."""
    frequency = np.geomspace(0.01, 100.0, 4001)
    fixed, following = (apparent_mass(definition.with_values({"follow_height": k}), frequency) for k in (0, 1))
    differs = np.abs(np.abs(following) / np.abs(fixed) - 1.0) > _ALIKE
    return float(frequency[np.flatnonzero(differs)[-1]]) if differs.any() else 0.0


def modes(definition: LumpedDefinition) -> tuple[LumpedMode, ...]:
    """Return the modes with a free strip, slowest first."""
    eigenvalues = np.linalg.eigvals(_motion(definition))
    kept = [s for s in eigenvalues if s.imag > 0.0 or abs(s.imag) < 1e-9]
    found = [LumpedMode(float(abs(s)) / (2.0 * np.pi) if s.imag > 0.0 else 0.0, _damping(complex(s))) for s in kept]
    return tuple(sorted(found, key=lambda mode: mode.frequency))


def _damping(s: complex) -> float:
    return -s.real / abs(s) if abs(s) > 1e-9 else 0.0


def _motion(definition: LumpedDefinition) -> FloatArray:
    """Return the matrix of the free motion: displacements, velocities, and the reference if it follows the height."""
    model = LumpedModel(definition)
    n, inverse = model.size, np.linalg.inv(model.M)
    system = np.zeros((2 * n + 1, 2 * n + 1))
    system[:n, n : 2 * n] = np.eye(n)
    system[n : 2 * n, :n] = -inverse @ model.K
    system[n : 2 * n, n : 2 * n] = -inverse @ model.C
    if not model.follows:
        return system[:-1, :-1]
    system[n : 2 * n, -1] = inverse[:, 0] * definition.stage[0].stiffness
    system[-1, 0], system[-1, -1] = np.array([1.0, -1.0]) / definition.reference_time
    return system


def apparent_mass(definition: LumpedDefinition, frequency: FloatArray) -> ComplexArray:
    """Return force over acceleration of the strip, shape (f,) [kg], at ``frequency`` [Hz], greater than 0."""
    stages = definition.stage
    stiffness = chain_stiffness(
        frequency,
        np.array([s.mass for s in stages]),
        np.array([s.damping for s in stages]),
        np.array([s.stiffness for s in stages]),
        definition.reference_time if definition.follow_height else math.inf,
    )
    return -stiffness / (2.0 * np.pi * np.asarray(frequency)) ** 2
