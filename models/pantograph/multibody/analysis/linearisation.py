"""Small motions about an equilibrium: M, C, K in the motions that the joints allow, and what follows from them.

About a state of rest the loads of the joints, -Phi_q^T lambda, change with the configuration although lambda is
held: that derivative, lambda . d2Phi/dq2, belongs to K. The derivatives are differences of fourth order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import ComplexArray, FloatArray
from models.pantograph.multibody.mechanism import Inputs, Mechanism
from models.pantograph.multibody.mechanism_assembly import null_space

#: Difference step, in scaled coordinates of the size of the motion below [m, rad].
_STEP: Final = 1e-3


@dataclass(frozen=True)
class LinearModel:
    """M eta'' + C eta' + K eta = b F + ... of a mechanism at rest.

    Attributes
    ----------
    M, C, K : ndarray, shape (d, d)
    contact : ndarray, shape (d,)
        Load of a unit upward force on the strip; by symmetry the point's vertical displacement is contact . eta.
    basis : ndarray, shape (6 n, d)
        Motions, in scaled body coordinates.
    y : ndarray, shape (13 n,)
        The equilibrium.
    """

    M: FloatArray
    C: FloatArray
    K: FloatArray
    contact: FloatArray
    basis: FloatArray
    y: FloatArray


@dataclass(frozen=True)
class Mode:
    """A free motion exp(s t).

    Attributes
    ----------
    eigenvalue : complex
        s [1/s].
    frequency : float
        |s| / 2 pi if it oscillates, else 0 [Hz].
    damping : float
        -Re s / |s|: 1 and more dies out without oscillation, below 0 grows.
    shape : ndarray, shape (n, 6)
        Displacements and body-fixed rotations of the bodies, largest entry 1.
    """

    eigenvalue: complex
    frequency: float
    damping: float
    shape: ComplexArray


def linearise(mechanism: Mechanism, y: FloatArray, inputs: Inputs) -> LinearModel:
    """Linearise about a state of rest.

    Parameters
    ----------
    y : ndarray, shape (13 n,)
        An equilibrium.
    inputs : Inputs
        What holds it; the contact force stays constant and follows its lateral position.
    """
    basis = null_space(mechanism, y)
    kinematics = mechanism.kinematics(y)
    unit = np.zeros((mechanism.count, 6))
    if mechanism.definition.strip is not None:
        k = mechanism.numbers[mechanism.definition.strip.body]
        unit[k] = mechanism.contact_load(y, inputs._replace(force=-1.0))
    contact = basis.T @ (unit[:, None, :] @ mechanism.roots(kinematics.frames)).ravel()
    return LinearModel(
        basis.T @ _free_mass(mechanism) @ basis,
        damping(mechanism, y, inputs, basis),
        stiffness(mechanism, y, inputs, basis),
        contact,
        basis,
        y,
    )


def stiffness(mechanism: Mechanism, y: FloatArray, inputs: Inputs, basis: FloatArray) -> FloatArray:
    """Return K, shape (d, d): the change of the joints' and applied loads, with opposite sign, along the basis."""
    return stiffness_under(mechanism, y, inputs, basis, static_multipliers(mechanism, y, inputs))


def stiffness_under(
    mechanism: Mechanism, y: FloatArray, inputs: Inputs, basis: FloatArray, multipliers: FloatArray
) -> FloatArray:
    """Return K under known loads of the joints, multipliers of shape (m,).

    Away from an equilibrium, under those that balance the applied loads best, it suits Newton's method there.
    """

    def load(scaled: FloatArray) -> FloatArray:
        moved = mechanism.moved(y, scaled)
        kinematics = mechanism.kinematics(moved)
        W = mechanism.roots(kinematics.frames)
        vectors = mechanism.pool.evaluate(kinematics)
        jacobian = mechanism.constraints.evaluate(vectors).jacobian
        loads = mechanism.loads(moved, kinematics, inputs, vectors)
        loads = loads - (multipliers @ jacobian.reshape(len(multipliers), -1)).reshape(loads.shape)
        reduced: FloatArray = basis.T @ (loads[:, None, :] @ W).ravel()
        return reduced

    return -_derivative(mechanism, load, basis)


def damping(mechanism: Mechanism, y: FloatArray, inputs: Inputs, basis: FloatArray) -> FloatArray:
    """Return C, shape (d, d): the change of the applied loads with velocity, with opposite sign."""

    def load(scaled: FloatArray) -> FloatArray:
        moving = mechanism.with_velocity(y, scaled)
        kinematics = mechanism.kinematics(moving)
        loads = mechanism.loads(moving, kinematics, inputs)
        reduced: FloatArray = basis.T @ (loads[:, None, :] @ mechanism.roots(kinematics.frames)).ravel()
        return reduced

    return -_derivative(mechanism, load, basis)


def static_multipliers(mechanism: Mechanism, y: FloatArray, inputs: Inputs) -> FloatArray:
    """Return the lambda that balance the applied loads best, shape (m,); exactly in an equilibrium."""
    placed = mechanism.placed(y)
    loads = mechanism.loads(y, placed.kinematics, inputs, placed.vectors)
    return balancing_multipliers(placed.scaled, (loads[:, None, :] @ placed.roots).ravel())


def balancing_multipliers(scaled: FloatArray, loads: FloatArray) -> FloatArray:
    """Return them for the constraints' Jacobian (m, 6 n) and the loads (6 n,), both in scaled coordinates."""
    multipliers: FloatArray = np.linalg.solve(scaled @ scaled.T, scaled @ loads).view(np.float64)
    return multipliers


def _derivative(mechanism: Mechanism, load: object, basis: FloatArray) -> FloatArray:
    """Return d load / d eta by differences of fourth order, shape (d, d)."""
    assert callable(load)
    columns = []
    for column in basis.T:
        shifts, turns = mechanism.unscaled(column)
        h = _STEP / max(float(np.abs(shifts).max()), float(np.abs(turns).max()), 1e-12)
        near = load(h * column) - load(-h * column)
        far = load(2.0 * h * column) - load(-2.0 * h * column)
        columns.append((8.0 * near - far) / (12.0 * h))
    return np.array(columns).T.reshape(basis.shape[1], basis.shape[1])


def _free_mass(mechanism: Mechanism) -> FloatArray:
    """Return the mass matrix in scaled coordinates: 1 for free bodies."""
    diagonal = np.ones(6 * mechanism.count)
    diagonal[: 6 * mechanism.driven] = 0.0
    return np.diag(diagonal)


def modes(mechanism: Mechanism, model: LinearModel) -> tuple[Mode, ...]:
    """Return the free motions, slowest first; of a conjugate pair the one with positive frequency."""
    d = len(model.M)
    inverse = np.linalg.inv(model.M)
    system = np.block([[np.zeros((d, d)), np.eye(d)], [-inverse @ model.K, -inverse @ model.C]])
    values, vectors = np.linalg.eig(system)
    kept = sorted((k for k in range(2 * d) if values[k].imag >= 0.0), key=lambda k: abs(values[k]))
    return tuple(_mode(mechanism, model, complex(values[k]), vectors[:d, k]) for k in kept)


def _mode(mechanism: Mechanism, model: LinearModel, s: complex, eta: ComplexArray) -> Mode:
    parts = [mechanism.unscaled(model.basis @ part) for part in (eta.real, eta.imag)]
    shape = np.concatenate(parts[0], axis=1) + 1j * np.concatenate(parts[1], axis=1)
    largest = shape.ravel()[np.argmax(np.abs(shape))]
    oscillates = s.imag > 1e-9 * abs(s)
    frequency = abs(s) / (2.0 * np.pi) if oscillates else 0.0
    return Mode(s, frequency, -s.real / abs(s) if s else 0.0, shape / largest)


def receptance(model: LinearModel, frequencies: FloatArray) -> ComplexArray:
    """Return the contact point's vertical displacement per unit vertical force on it, shape (f,) [m/N].

    Parameters
    ----------
    frequencies : ndarray, shape (f,)
        [Hz]
    """
    s = 2j * np.pi * np.asarray(frequencies)[:, None, None]
    dynamic = model.K + s * model.C + s**2 * model.M
    force = np.broadcast_to(model.contact.astype(np.complex128)[:, None], (len(dynamic), len(model.contact), 1))
    response: ComplexArray = np.linalg.solve(dynamic, force)[:, :, 0] @ model.contact
    return response


def apparent_mass(model: LinearModel, frequencies: FloatArray) -> ComplexArray:
    """Return force per acceleration of the contact point, shape (f,) [kg]; what EN 50318 compares.

    Parameters
    ----------
    frequencies : ndarray, shape (f,)
        [Hz], greater than 0.
    """
    omega = 2.0 * np.pi * np.asarray(frequencies)
    mass: ComplexArray = -1.0 / (omega**2 * receptance(model, frequencies))
    return mass


def base_transmission(mechanism: Mechanism, model: LinearModel, frequencies: FloatArray) -> ComplexArray:
    """Return the contact point's vertical displacement per vertical displacement of the base, shape (f,) [1].

    The contact force stays as it is: the strip follows the base as the mechanism lets it.
    """
    count, d = mechanism.count, mechanism.driven
    lifted = np.zeros((count, 6))
    lifted[d:, 2] = np.sqrt(mechanism.mass[d:])
    inertia = model.basis.T @ lifted.ravel()
    s = 2j * np.pi * np.asarray(frequencies)[:, None, None]
    dynamic = model.K + s * model.C + s**2 * model.M
    right = -(s**2) * inertia[None, :, None]
    relative: ComplexArray = np.linalg.solve(dynamic, right)[:, :, 0] @ model.contact
    return 1.0 + relative
