"""Wires between their attachments: where an interval begins and ends, and axes that decouple its motion.

Between two attachments (droppers, supports, arms, clamps) a wire is straight in plan. In axes that follow it, in-plane
motion (u, w, ry) and out-of-plane motion (v, rx, rz) do not act on each other.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from models.arrays import BoolArray, FloatArray, IntArray
from models.catenary.shape.line_mesh import CatenaryMesh, Chain

#: Entries below this share of their diagonal are zeros, up to the rounding of a rotation.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Interval:
    """A wire from one attachment to the next.

    Attributes
    ----------
    component : str
        Component type of the wire.
    nodes : ndarray, shape (k + 2,)
        Its nodes, including the two attachments; k may be 0.
    """

    component: str
    nodes: IntArray


def attachments(mesh: CatenaryMesh) -> BoolArray:
    """Return which nodes are attachments: ends, droppers, supports, arms, clamps, held or shared; shape (n,)."""
    result = mesh.fixed.any(axis=1) | (mesh.clamp_mass > 0.0)
    for nodes in (mesh.droppers, mesh.arms, mesh.sprung, mesh.support_nodes):
        result[nodes.ravel()] = True
    for chain in mesh.chains:
        result[chain.nodes[[0, -1]]] = True
    return result


def intervals(chain: Chain, attached: BoolArray) -> list[Interval]:
    """Return the intervals of a wire, from end to end.

    Parameters
    ----------
    attached : ndarray of bool, shape (n,)
        Which nodes of the mesh are attachments.
    """
    at = np.flatnonzero(attached[chain.nodes])
    return [Interval(chain.component, chain.nodes[a : b + 1]) for a, b in pairwise(at)]


def plan_angles(parts: Iterable[Interval], points: FloatArray) -> FloatArray:
    """Return the direction in plan of the wire at its inner nodes [rad], shape (n,); 0 at attachments.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Reference positions [m].
    """
    result = np.zeros(len(points))
    for part in parts:
        along = points[part.nodes[-1], :2] - points[part.nodes[0], :2]
        result[part.nodes[1:-1]] = np.arctan2(along[1], along[0])
    return result


def turns(angles: FloatArray) -> FloatArray:
    """Return the turns about z from nodal axes to global ones, shape (n, 3, 3)."""
    result = np.zeros((len(angles), 3, 3))
    result[:, 0, 0] = result[:, 1, 1] = np.cos(angles)
    result[:, 1, 0] = np.sin(angles)
    result[:, 0, 1] = -result[:, 1, 0]
    result[:, 2, 2] = 1.0
    return result


def plan_rotation(angles: FloatArray) -> sp.csr_matrix:
    """Return Q with d_global = Q d_nodal, for nodal axes turned by ``angles`` about z; shape (6 n, 6 n)."""
    n = 2 * len(angles)
    result = sp.bsr_matrix((np.repeat(turns(angles), 2, axis=0), np.arange(n), np.arange(n + 1))).tocsr()
    result.eliminate_zeros()
    return result


def without_rounding(matrix: sp.spmatrix, scale: FloatArray) -> sp.csr_matrix:
    """Return a matrix without the entries that are zero up to rounding.

    Parameters
    ----------
    scale : ndarray, shape (n,)
        Square roots of the diagonal, with which entries are compared.
    """
    entries = matrix.tocoo()
    kept = np.abs(entries.data) > _ROUNDING * scale[entries.row] * scale[entries.col]
    values = entries.data[kept]
    return sp.csr_matrix((values, (entries.row[kept], entries.col[kept])), shape=matrix.shape)
