"""What describes a lumped pantograph on a test rig: statics over the working height, modes, response of the strip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arrays import ComplexArray, FloatArray
from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.lumped.lumped_model import LumpedModel


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
    frequency: FloatArray, masses: FloatArray, dampings: FloatArray, stiffnesses: FloatArray
) -> ComplexArray:
    """Return the dynamic stiffness at the top of a chain of masses on fixed ground, shape (f,) [N/m].

    Parameters
    ----------
    frequency : ndarray, shape (f,)
        [Hz]
    masses, dampings, stiffnesses : ndarray, shape (n,)
        Bottom to top; damper and spring i connect mass i to the one below.
    """
    s = 2j * np.pi * np.asarray(frequency)
    total: ComplexArray | None = None
    for m, c, k in zip(masses, dampings, stiffnesses, strict=True):
        link = k + s * c
        total = s**2 * m + (link if total is None else link * total / (link + total))
    if total is None:
        raise ValueError("a chain needs at least one stage")
    return total


def contact_force_over_height(definition: LumpedDefinition, heights: FloatArray) -> FloatArray:
    """Return the static contact force that holds the strip at given heights above top of rail [N].

    Parameters
    ----------
    heights : ndarray, shape (h,)
        [m]

    Returns
    -------
    ndarray, shape (h,)
    """
    flexibility = np.linalg.inv(LumpedModel(definition).K)
    free_rise = flexibility[-1, 0] * definition.static_force
    result: FloatArray = (free_rise - (heights - definition.reference_height)) / flexibility[-1, -1]
    return result


def modes(definition: LumpedDefinition) -> tuple[LumpedMode, ...]:
    """Return the modes with a free strip, slowest first."""
    model = LumpedModel(definition)
    inverse = np.linalg.inv(model.M)
    n = model.size
    system = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ model.K, -inverse @ model.C]])
    eigenvalues = np.linalg.eigvals(system)
    kept = [s for s in eigenvalues if s.imag > 0.0 or abs(s.imag) < 1e-9]
    found = [LumpedMode(float(abs(s)) / (2.0 * np.pi) if s.imag > 0.0 else 0.0, float(-s.real / abs(s))) for s in kept]
    return tuple(sorted(found, key=lambda mode: mode.frequency))


def apparent_mass(definition: LumpedDefinition, frequency: FloatArray) -> ComplexArray:
    """Return force over acceleration of the strip, shape (f,) [kg], at ``frequency`` [Hz], greater than 0."""
    stages = definition.stage
    stiffness = chain_stiffness(
        frequency,
        np.array([s.mass for s in stages]),
        np.array([s.damping for s in stages]),
        np.array([s.stiffness for s in stages]),
    )
    return -stiffness / (2.0 * np.pi * np.asarray(frequency)) ** 2
