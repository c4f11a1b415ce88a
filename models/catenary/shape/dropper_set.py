"""The droppers of a line between given points: rows, lengths and stiffnesses, made once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition, Dropper
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.line_mesh import CatenaryMesh


@dataclass(frozen=True)
class DropperSet:
    """Droppers and hangers between given points, in the order of the mesh.

    Attributes
    ----------
    rows : sparse, shape (n_droppers, 6 n)
        Elongation of dropper j = rows[j] . d.
    length : ndarray, shape (n_droppers,)
        Distance between the ends [m].
    stiffness : ndarray, shape (n_droppers,)
        Axial stiffness, as given or EA/L; 0 where broken [N/m].
    compression_ratio : ndarray, shape (n_droppers,)
        Stiffness in compression over that in tension.
    slack_delay : ndarray, shape (n_droppers,)
        Weight of the rate of elongation in the condition for slack [s]: alpha under the law "tension", by which spring
        and damper go slack together, k (e + alpha e') < 0; 0 under "elastic_only", by which the spring does alone.
    mass : ndarray, shape (n_droppers,)
        Of the distance between its ends; a broken one's is left to its wires [kg].
    """

    rows: sp.csr_matrix
    length: FloatArray
    stiffness: FloatArray
    compression_ratio: FloatArray
    slack_delay: FloatArray
    mass: FloatArray


def dropper_set(definition: CatenaryDefinition, mesh: CatenaryMesh, points: FloatArray) -> DropperSet:
    """Hang the droppers of a line between the points of a mesh, shape (n, 3) [m]."""
    length = dropper_lengths(mesh, points)
    alpha = definition.damping.of("dropper").alpha

    def each(value: Callable[[Dropper], float | FloatArray]) -> FloatArray:
        return np.where(mesh.is_hanger, value(definition.hanger or definition.dropper), value(definition.dropper))

    return DropperSet(
        rows=_rows(mesh, points),
        length=length,
        stiffness=np.where(mesh.broken, 0.0, each(lambda dropper: _stiffness(dropper, length))),
        compression_ratio=each(lambda dropper: dropper.compression_ratio),
        slack_delay=each(lambda dropper: alpha if dropper.slack_law == "tension" else 0.0),
        mass=each(lambda dropper: dropper.mass) * length,
    )


def dropper_lengths(mesh: CatenaryMesh, points: FloatArray) -> FloatArray:
    """Return the distance between the ends of every dropper [m]."""
    lower, upper = mesh.droppers.T
    return np.linalg.norm(points[upper] - points[lower], axis=1)


def turned_over(mesh: CatenaryMesh, positions: FloatArray) -> str:
    """Return in words where the upper end of a dropper would hang below its lower one; empty if nowhere does."""
    lower, upper = mesh.droppers.T
    height = np.where(np.isnan(mesh.given_length), positions[upper, 2] - positions[lower, 2], np.inf)
    over = np.flatnonzero(height < 0.0)
    if not over.size:
        return ""
    worst = over[height[over].argmin()]
    place = f"at {positions[lower[worst], 0]:.2f} m by {-1e3 * height[worst]:.0f} mm"
    return (
        f"the upper ends of {over.size} dropper(s) would hang below the lower ones, {place}; give more encumbrance or "
        "tension above them, or shorter spans"
    )


def _rows(mesh: CatenaryMesh, points: FloatArray) -> sp.csr_matrix:
    lower, upper = mesh.droppers.T
    direction = points[upper] - points[lower]
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    n = len(mesh.droppers)
    axes = np.arange(3)
    columns = np.hstack([lower[:, None] * NODE_DOFS + axes, upper[:, None] * NODE_DOFS + axes])
    values = np.hstack([-direction, direction])
    rows = np.repeat(np.arange(n), 6)
    return sp.csr_matrix((values.ravel(), (rows, columns.ravel())), shape=(n, NODE_DOFS * len(points)))


def _stiffness(dropper: Dropper, length: FloatArray) -> FloatArray:
    if dropper.stiffness is not None:
        return np.full_like(length, dropper.stiffness)
    assert dropper.area is not None
    assert dropper.youngs_modulus is not None
    return dropper.youngs_modulus * dropper.area / length
