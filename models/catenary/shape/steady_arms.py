"""Steady arms as form finding moves them: carried along with the wire, turned where they push."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.catenary.definition.line_definition import GRAVITY, CatenaryDefinition
from models.catenary.shape.line_mesh import CatenaryMesh
from models.catenary.shape.line_shape import LineShape


def arms_without_side(definition: CatenaryDefinition) -> BoolArray:
    """Return which steady arms stand where they pull, their side not being given, shape (n_arms,)."""
    if definition.steady_arm is None:
        return np.zeros(0, dtype=np.bool_)
    supports = [s for section in definition.sections for s in section.supports if s.has_steady_arm]
    return np.array([s.arm_side is None for s in supports], dtype=np.bool_)


def pushing_arms(shape: LineShape, force: FloatArray) -> BoolArray:
    """Return which arms push by more than their own weight, which says nothing of the pull of the wire, (n_arms,).

    Parameters
    ----------
    force : ndarray, shape (n_arms,)
        Tension [N].
    """
    arm = shape.definition.steady_arm
    if arm is None:
        return np.zeros(0, dtype=np.bool_)
    end, node = shape.mesh.arms.T
    length = np.linalg.norm(shape.points[node] - shape.points[end], axis=1)
    pushes: BoolArray = force < -GRAVITY * arm.mass * length
    return pushes


def with_arms_turned(mesh: CatenaryMesh, turning: BoolArray) -> CatenaryMesh:
    """Return a mesh with the registration ends of some arms on the other side of the wire.

    Parameters
    ----------
    turning : ndarray, shape (n_arms,)
    """
    end, node = mesh.arms[turning].T
    points = mesh.points.copy()
    points[end, 1] = 2.0 * points[node, 1] - points[end, 1]
    return replace(mesh, points=points)


def carry_arms(mesh: CatenaryMesh, points: FloatArray, move: FloatArray) -> None:
    """Move the registration ends with the wire, so that the arms keep their angle and length.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Reference positions, changed [m].
    move : ndarray, shape (n, 3)
        What the others have moved by [m].
    """
    points[mesh.arms[:, 0], 2] += move[mesh.arms[:, 1], 2]
