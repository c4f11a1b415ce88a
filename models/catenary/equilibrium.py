"""Static equilibrium and form finding.

The wanted geometry is prescribed (the contact wire's height at every dropper, the auxiliary wire's at every
hanger); the unknowns are the droppers' forces and with them their unstrained lengths. For given reference
points this is one linear saddle-point system; the points are then moved to the solution and the system is
solved again, until the deformed mesh is the wanted one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from models.catenary.assembly import (
    Matrices,
    assemble,
    dropper_lengths,
    dropper_rows,
    dropper_stiffness,
)
from models.catenary.elements import NODE_DOFS
from models.catenary.mesh import CatenaryMesh
from models.catenary.parameters import GRAVITY, CatenaryDefinition
from models.part import FloatArray

#: Form finding ends when no reference point moves by more than this [m].
_TOLERANCE = 1e-9
_MAX_ITERATIONS = 30
#: First guess of the droppers' forces [N]; only the path to the solution depends on it.
_FIRST_FORCE = 80.0


class EquilibriumError(ValueError):
    """The line has no static equilibrium of the wanted shape; says which droppers, where."""


@dataclass(frozen=True)
class StaticState:
    """Static equilibrium of a line.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Reference positions, at the static shape [m].
    displacement : ndarray, shape (6 n,)
        Static displacement from the reference: axial stretch, rotations of the wires [m, rad].
    dropper_force, dropper_length, unstrained_length : ndarray, shape (n_droppers,)
        Tension [N], length under tension and without it [m].
    matrices : Matrices
        About ``points``.
    residual : float
        Largest unbalanced nodal force over the line's weight.
    """

    points: FloatArray
    displacement: FloatArray
    dropper_force: FloatArray
    dropper_length: FloatArray
    unstrained_length: FloatArray
    matrices: Matrices
    residual: float

    @property
    def positions(self) -> FloatArray:
        """Return the static positions of the nodes, shape (n, 3) [m]."""
        return self.points + self.displacement.reshape(-1, NODE_DOFS)[:, :3]


def find_form(definition: CatenaryDefinition, mesh: CatenaryMesh) -> StaticState:
    """Find the dropper lengths that give the wanted contact-wire profile.

    Returns
    -------
    StaticState

    Raises
    ------
    EquilibriumError
        If a dropper would have to push, or the iteration does not settle.
    """
    points = mesh.points.copy()
    movable = _movable(mesh)
    force = np.full(len(mesh.droppers), _FIRST_FORCE)
    for _ in range(_MAX_ITERATIONS):
        matrices = assemble(definition, mesh, points)
        displacement, force = _solve(mesh, points, matrices, force)
        move = np.where(movable, displacement.reshape(-1, NODE_DOFS)[:, :3], 0.0)
        if np.abs(move).max() < _TOLERANCE:
            return _static_state(definition, mesh, points, matrices, displacement, force)
        points = points + move
        _carry_arms(mesh, points, move)
    raise EquilibriumError(
        f"form finding of line '{definition.name}' has not settled after {_MAX_ITERATIONS} iterations: "
        f"a point still moves by {np.abs(move).max():.2g} m"
    )


def _movable(mesh: CatenaryMesh) -> np.ndarray:
    """Return which coordinates of the reference form finding may move.

    Not x (the wires' stretch stays a displacement), and not the lateral position of registered nodes, whose
    displacement is what loads the steady arm.
    """
    movable = ~mesh.fixed[:, :3]
    movable[:, 0] = False
    movable[mesh.arms[:, 1], 1] = False
    return movable


def _carry_arms(mesh: CatenaryMesh, points: FloatArray, move: FloatArray) -> None:
    """Move the registration ends with their wire, so that the arms keep angle and length."""
    points[mesh.arms[:, 0], 2] += move[mesh.arms[:, 1], 2]


def _solve(
    mesh: CatenaryMesh, points: FloatArray, matrices: Matrices, force: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Solve [[K, B^T], [S, 0]] [d; N] = [load; wanted - actual height of the droppers' lower ends]."""
    free = np.flatnonzero(~mesh.fixed.ravel())
    B = dropper_rows(mesh, points)[:, free]
    lower_z = mesh.droppers[:, 0] * NODE_DOFS + 2
    n = len(lower_z)
    S = sp.csr_matrix((np.ones(n), (np.arange(n), lower_z)), shape=(n, matrices.load.size))[:, free]
    K = (matrices.K + _swing(mesh, points, force))[free][:, free]
    # Scaled so that the rows of the constraints compare with those of the stiffness.
    scale = 1e4
    system = sp.bmat([[K, scale * B.T], [scale * S, None]], format="csc")
    height = mesh.target - points[mesh.droppers[:, 0], 2]
    solution = splu(system).solve(np.concatenate([matrices.load[free], scale * height]))
    displacement = np.zeros(matrices.load.size)
    displacement[free] = solution[: len(free)]
    return displacement, solution[len(free) :] * scale


def _swing(mesh: CatenaryMesh, points: FloatArray, force: FloatArray) -> sp.csc_matrix:
    """Return the lateral stiffness N/L of the droppers as pendulums.

    It guides the iteration where nothing but the droppers holds a wire laterally, and vanishes from its result:
    there the lateral displacements of the droppers' ends are zero.
    """
    stiffness = np.maximum(force, 1.0) / dropper_lengths(mesh, points)
    lower, upper = (mesh.droppers[:, k] * NODE_DOFS + 1 for k in (0, 1))
    rows = np.concatenate([lower, upper, lower, upper])
    columns = np.concatenate([lower, upper, upper, lower])
    values = np.concatenate([stiffness, stiffness, -stiffness, -stiffness])
    return sp.csc_matrix((values, (rows, columns)), shape=(mesh.fixed.size, mesh.fixed.size))


def _static_state(
    definition: CatenaryDefinition,
    mesh: CatenaryMesh,
    points: FloatArray,
    matrices: Matrices,
    displacement: FloatArray,
    force: FloatArray,
) -> StaticState:
    _check_tension(definition, mesh, points, force)
    length = dropper_lengths(mesh, points + displacement.reshape(-1, NODE_DOFS)[:, :3])
    return StaticState(
        points=points,
        displacement=displacement,
        dropper_force=force,
        dropper_length=length,
        unstrained_length=length - force / dropper_stiffness(definition, mesh, points),
        matrices=matrices,
        residual=_residual(mesh, points, matrices, displacement, force),
    )


def weight(matrices: Matrices) -> float:
    """Return the weight of the whole line [N]."""
    up = np.zeros((matrices.load.size // NODE_DOFS, NODE_DOFS))
    up[:, 2] = 1.0
    return float(GRAVITY * (up.ravel() @ (matrices.M @ up.ravel())))


def _check_tension(definition: CatenaryDefinition, mesh: CatenaryMesh, points: FloatArray, force: FloatArray) -> None:
    slack = np.flatnonzero(force <= 0.0)
    if slack.size:
        x = points[mesh.droppers[slack, 0], 0]
        listed = ", ".join(f"{a:.2f} m ({f:.1f} N)" for a, f in list(zip(x, force[slack], strict=True))[:8])
        raise EquilibriumError(
            f"line '{definition.name}': {slack.size} dropper(s) would have to push to give the wanted profile: "
            f"{listed}; reduce the pre-sag or the rise to the anchors, or move the droppers"
        )


def _residual(
    mesh: CatenaryMesh, points: FloatArray, matrices: Matrices, displacement: FloatArray, force: FloatArray
) -> float:
    unbalanced = matrices.K @ displacement + dropper_rows(mesh, points).T @ force - matrices.load
    translations = unbalanced.reshape(-1, NODE_DOFS)[:, :3][~mesh.fixed[:, :3]]
    return float(np.abs(translations).max() / weight(matrices))
