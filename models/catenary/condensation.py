"""Solving the effective stiffness fast: wires between their attachments are condensed out.

Between two attachments (droppers, supports, arms, clamps) a wire is straight in plan. In axes that follow it,
its in-plane motion (u, w, ry) and its out-of-plane motion (v, rx, rz) do not act on each other, so the nodes inside
an interval fall apart into small blocks of one size each, coupled only to the attachments. Their inverses are
dense and small; a whole batch of them is one matrix product. What remains is a band of the attachments' degrees
of freedom, an order of magnitude smaller than the line's.

The solution is the exact one: condensation is block elimination in another order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from scipy.linalg.lapack import dpbtrf, dpbtrs
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from models.catenary.elements import NODE_DOFS
from models.catenary.mesh import CatenaryMesh
from models.part import BoolArray, FloatArray, IntArray

#: Half-bandwidth up to which a band solver is used.
_WIDEST_BAND = 64
#: Entries below this share of their diagonal are what rotating a matrix leaves of zeros.
_ROUNDING = 1e-12


class Factor(Protocol):
    """A factorised matrix."""

    def solve(self, load: FloatArray) -> FloatArray:
        """Return the solution for loads of shape (n,) or (n, m)."""


@dataclass(frozen=True)
class Blocks:
    """Decoupled blocks at the beginning of an ordering of degrees of freedom.

    Attributes
    ----------
    batches : tuple of (int, int)
        Number and size of blocks of equal size, in order.
    """

    batches: tuple[tuple[int, int], ...]

    @property
    def total(self) -> int:
        """Return the number of degrees of freedom in all blocks."""
        return sum(count * size for count, size in self.batches)


def attachments(mesh: CatenaryMesh) -> BoolArray:
    """Return which nodes are attachments: ends, droppers, supports, arms, clamps, held or shared nodes; shape (n,)."""
    result = mesh.fixed.any(axis=1) | (mesh.clamp_mass > 0.0)
    for nodes in (mesh.droppers, mesh.arms, mesh.sprung, mesh.support_nodes):
        result[nodes.ravel()] = True
    for chain in mesh.chains:
        result[chain.nodes[[0, -1]]] = True
    return result


def plan_angles(mesh: CatenaryMesh, points: FloatArray) -> FloatArray:
    """Return the direction in plan of the wire at its inner nodes [rad], shape (n,); 0 at attachments.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Reference positions [m].
    """
    result = np.zeros(len(points))
    held = attachments(mesh)
    for chain in mesh.chains:
        at = np.flatnonzero(held[chain.nodes])
        ends = points[chain.nodes[at]]
        along = np.diff(ends[:, :2], axis=0)
        angle = np.arctan2(along[:, 1], along[:, 0])
        for first, last, value in zip(at[:-1], at[1:], angle, strict=True):
            result[chain.nodes[first + 1 : last]] = value
    return result


def plan_rotation(angles: FloatArray) -> sp.csr_matrix:
    """Return Q with d_global = Q d_nodal, for nodal axes turned by ``angles`` about z; shape (6 n, 6 n)."""
    n = len(angles)
    c, s = np.repeat(np.cos(angles), 2), np.repeat(np.sin(angles), 2)
    first = (np.arange(n)[:, None] * NODE_DOFS + np.array([0, 3])).ravel()
    rows = np.concatenate([first, first, first + 1, first + 1, first + 2])
    columns = np.concatenate([first, first + 1, first, first + 1, first + 2])
    values = np.concatenate([c, -s, s, c, np.ones(2 * n)])
    return sp.csr_matrix((values, (rows, columns)), shape=(n * NODE_DOFS, n * NODE_DOFS))


def without_rounding(matrix: sp.spmatrix, scale: FloatArray) -> sp.csr_matrix:
    """Return a matrix without the entries that are zero up to rounding.

    Parameters
    ----------
    scale : ndarray, shape (n,)
        Roots of the diagonal that entries are compared with.
    """
    entries = matrix.tocoo()
    kept = np.abs(entries.data) > _ROUNDING * scale[entries.row] * scale[entries.col]
    values = entries.data[kept]
    return sp.csr_matrix((values, (entries.row[kept], entries.col[kept])), shape=matrix.shape)


def order_by_blocks(pattern: sp.csr_matrix, inner: BoolArray) -> tuple[IntArray, Blocks]:
    """Return an order of degrees of freedom with decoupled blocks first, attachments last.

    Parameters
    ----------
    pattern : sparse, shape (n, n)
        Non-zero where two degrees of freedom act on each other; its own order runs along the track.
    inner : ndarray of bool, shape (n,)
        Degrees of freedom to be condensed out.

    Returns
    -------
    order : ndarray, shape (n,)
    blocks : Blocks
    """
    candidates = np.flatnonzero(inner)
    _, label = connected_components(pattern[candidates][:, candidates], directed=False)
    sizes = np.bincount(label)
    by_block = np.lexsort((candidates, label, sizes[label]))
    counts = [(int((sizes == size).sum()), int(size)) for size in np.unique(sizes)]
    return np.concatenate([candidates[by_block], np.flatnonzero(~inner)]), Blocks(tuple(counts))


class Condensed:
    """Solver that condenses blocks out.

    Parameters
    ----------
    matrix : sparse, shape (n, n)
        Symmetric positive definite, the blocks' degrees of freedom first.
    blocks : Blocks
    """

    def __init__(self, matrix: sp.csr_matrix, blocks: Blocks) -> None:
        self._inner = blocks.total
        self._inverses = _block_inverses(matrix[: self._inner][:, : self._inner], blocks)
        self._coupling = matrix[: self._inner][:, self._inner :].tocsr()
        self._transposed = self._coupling.T.tocsr()
        inverse = sp.block_diag([b for batch in self._inverses for b in batch], format="csr")
        condensed = matrix[self._inner :][:, self._inner :] - self._transposed @ inverse @ self._coupling
        self._attachments = factorised(condensed.tocsc())

    def solve(self, load: FloatArray) -> FloatArray:
        """Return the solution for loads of shape (n,) or (n, m)."""
        inner, outer = load[: self._inner], load[self._inner :]
        attached = self._attachments.solve(outer - self._transposed @ self._apply(inner))
        result = np.empty_like(load)
        result[self._inner :] = attached
        result[: self._inner] = self._apply(inner - self._coupling @ attached)
        return result

    def _apply(self, load: FloatArray) -> FloatArray:
        """Return the blocks' inverse times a load."""
        columns = 1 if load.ndim == 1 else load.shape[1]
        result = np.empty((len(load), columns))
        start = 0
        for inverse in self._inverses:
            count, size, _ = inverse.shape
            stop = start + count * size
            shape = (count, size, columns)
            np.matmul(inverse, load[start:stop].reshape(shape), out=result[start:stop].reshape(shape))
            start = stop
        return result.reshape(load.shape)


class _Banded:
    """Cholesky factor of a band."""

    def __init__(self, matrix: sp.coo_matrix, width: int) -> None:
        lower = matrix.row >= matrix.col
        band = np.zeros((width + 1, matrix.shape[0]), order="F")
        band[(matrix.row - matrix.col)[lower], matrix.col[lower]] = matrix.data[lower]
        self._band, failed = dpbtrf(band, lower=1)
        if failed:
            raise np.linalg.LinAlgError(f"the effective stiffness is not positive definite (row {failed})")

    def solve(self, load: FloatArray) -> FloatArray:
        result: FloatArray = dpbtrs(self._band, load, lower=1)[0]
        return result


def factorised(matrix: sp.csc_matrix) -> Factor:
    """Factorise a symmetric positive definite matrix whose degrees of freedom are numbered along the track.

    Its own order is banded and fills in least. Up to a certain width the band solver, which works on
    contiguous memory, is faster than the general sparse one.
    """
    entries = matrix.tocoo()
    width = int(np.abs(entries.row - entries.col).max())
    if width <= _WIDEST_BAND:
        return _Banded(entries, width)
    factor: Factor = splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return factor


def _block_inverses(matrix: sp.csr_matrix, blocks: Blocks) -> list[FloatArray]:
    """Return the inverses of the diagonal blocks, one array (count, size, size) a batch."""
    result, start = [], 0
    for count, size in blocks.batches:
        stop = start + count * size
        entries = matrix[start:stop][:, start:stop].tocoo()
        dense = np.zeros((count, size, size))
        dense[entries.row // size, entries.row % size, entries.col % size] = entries.data
        inverse = np.linalg.inv(dense)
        result.append(np.ascontiguousarray(0.5 * (inverse + inverse.transpose(0, 2, 1))))
        start = stop
    return result
