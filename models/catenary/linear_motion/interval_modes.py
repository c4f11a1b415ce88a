"""The line's motion as modes of its intervals and displacements of its attachments.

Between two attachments the nodes of a wire move as they would were the attachments displaced slowly (constraint
modes) plus as a sum of all modes of the interval with its ends clamped (fixed-interface modes) [1]_. With as many
modes as there are inner degrees of freedom nothing is left out: it is a change of coordinates, d = T s with
s = (q, x), modal amplitudes q and displacements x of the attachments. In these coordinates

    K = diag(lambda) + K_x,      M = I + G + G' + M_x,      C = diag(alpha lambda + beta) + beta G + (beta G)' + C_x:

intervals are diagonal, and feel their attachments through the mass coupling G alone. A step of the time integration
then needs two products with G and one band solution over the attachments, an order of magnitude smaller than the line.

A reduced line leaves out the modes above a natural frequency (`slower_than`). Its constraint modes stay, so that at
rest it carries what it did.

References
----------
.. [1] R. R. Craig, M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968) 1313-1319.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from models.arrays import BoolArray, FloatArray, IntArray
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.wire_intervals import Interval, turns, without_rounding
from models.definition_files.parameter import ParameterError

#: In-plane and out-of-plane degrees of freedom of a node, in axes along the wire.
_PLANES = ((0, 2, 4), (1, 3, 5))
#: Both ends of an interval.
_ENDS = 2 * NODE_DOFS
#: Columns below this share of the largest are what turning leaves of zeros.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class IntervalBlocks:
    """Parts of intervals with equally many inner degrees of freedom and modes: in plane, out of plane, or both.

    Attributes
    ----------
    inner : ndarray, shape (N, m)
        Inner degrees of freedom, counted over all nodes.
    modes : ndarray, shape (N, k)
        Places of the modal amplitudes in q; k = m unless modes are left out.
    ends : ndarray, shape (N, 12)
        Degrees of freedom of the attachments at the two ends, counted over all nodes.
    turn : ndarray, shape (N, 12, 12)
        From the ends' axes to the interval's.
    shapes : ndarray, shape (N, m, m)
        All modes, a column each in rising order, of unit modal mass; the first k are those in q.
    constraint : ndarray, shape (N, m, 12)
        How inner degrees of freedom follow the ends, in the interval's axes.
    """

    inner: IntArray
    modes: IntArray
    ends: IntArray
    turn: FloatArray
    shapes: FloatArray
    constraint: FloatArray


@dataclass(frozen=True)
class IntervalModes:
    """A line in the coordinates s = (q, x).

    Attributes
    ----------
    eigenvalue : ndarray, shape (n_modes,)
        Squares of the intervals' natural frequencies lambda [1/s^2].
    alpha, beta : ndarray, shape (n_modes,)
        Proportional damping of each mode: of stiffness [s], of mass [1/s].
    coupling : sparse, shape (n_modes, n_ends)
        Mass coupling with the intervals' ends in the intervals' axes, where only the ends' motion in its own plane
        moves a mode: G = coupling @ turn.
    turn : sparse, shape (n_ends, n_attached)
        Motion of the intervals' ends in the intervals' axes, from x.
    K, M, C : sparse, shape (n_attached, n_attached)
        Stiffness, mass and damping felt by the attachments.
    attached : ndarray, shape (n_attached,)
        Which degrees of freedom of the nodes the displacements x are, along the track.
    place : ndarray, shape (6 n,)
        Place of a degree of freedom in x, of an image that of its owner; -1 where it is held or inside an interval.
    spans : tuple of slice
        Modes of every interval.
    blocks : tuple of IntervalBlocks
        Those that have modes.
    followers : tuple of IntervalBlocks
        Those whose modes are all left out, which follow their ends and no more.
    """

    eigenvalue: FloatArray
    alpha: FloatArray
    beta: FloatArray
    coupling: sp.csr_matrix
    turn: sp.csr_matrix
    K: sp.csr_matrix
    M: sp.csr_matrix
    C: sp.csr_matrix
    attached: IntArray
    place: IntArray
    spans: tuple[slice, ...]
    blocks: tuple[IntervalBlocks, ...]
    followers: tuple[IntervalBlocks, ...] = ()

    def nodal(self, modal: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return T s: what modal amplitudes and attachments' displacements move the nodes by, in nodal axes.

        Parameters
        ----------
        modal : ndarray, shape (n_modes,)
        displacement : ndarray, shape (n_attached,)

        Returns
        -------
        ndarray, shape (6 n,)
            Zero at images.
        """
        result = np.zeros(len(self.place))
        result[self.attached] = displacement
        for block in (*self.blocks, *self.followers):
            following, shapes = _follow(block, result), block.shapes[:, :, : block.modes.shape[1]]
            result[block.inner] = following + np.einsum("nij,nj->ni", shapes, modal[block.modes])
        return result

    def coordinates(self, nodal: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return q and x of nodal displacements, the inverse of `nodal`.

        Of what modes that are left out would do nothing remains: modes are orthogonal in the mass.

        Parameters
        ----------
        nodal : ndarray, shape (6 n,)
            In nodal axes; what is held is taken as zero.
        """
        held = np.zeros_like(nodal)
        held[self.attached] = nodal[self.attached]
        modal = np.zeros(len(self.eigenvalue))
        for block in self.blocks:
            own = nodal[block.inner] - _follow(block, held)
            modal[block.modes] = np.linalg.solve(block.shapes, own[:, :, None])[:, : block.modes.shape[1], 0]
        return modal, nodal[self.attached]


class IntervalMotion:
    """What single intervals' nodes are moved by: by their own modes and by their two attachments.

    Parameters
    ----------
    modes : IntervalModes
    """

    def __init__(self, modes: IntervalModes) -> None:
        self._place = modes.place
        blocks = (*modes.blocks, *modes.followers)
        self._by_inner = {int(first): (block, i) for block in blocks for i, first in enumerate(block.inner[:, 0])}

    def rows(self, part: Interval, span: slice) -> tuple[tuple[IntArray, IntArray], FloatArray]:
        """Return the local coordinates of an interval and what they do.

        Parameters
        ----------
        span : slice
            Its modes.

        Returns
        -------
        sides : (ndarray, ndarray)
            Places in x of its two attachments' displacements that are free, e in all.
        rows : ndarray, shape (6 (k + 2), n_span + e)
            Displacements of its nodes in nodal axes over its modes and ``sides``.
        """
        nodes = part.nodes
        place = self._place[nodes[[0, -1], None] * NODE_DOFS + np.arange(NODE_DOFS)].ravel()
        free = np.flatnonzero(place >= 0)
        count = span.stop - span.start
        rows = np.zeros((NODE_DOFS * len(nodes), count + len(free)))
        at_end = np.concatenate([np.arange(NODE_DOFS), np.arange(-NODE_DOFS, 0) + len(rows)])
        rows[at_end[free], count + np.arange(len(free))] = 1.0
        position = {int(dof): i for i, dof in enumerate((nodes[:, None] * NODE_DOFS + np.arange(NODE_DOFS)).ravel())}
        for block, i in (self._by_inner[dof] for dof in position if dof in self._by_inner):
            inner = [position[int(dof)] for dof in block.inner[i]]
            own = block.modes[i] - span.start
            rows[np.ix_(inner, own)] = block.shapes[i][:, : len(own)]
            rows[inner, count:] = (block.constraint[i] @ block.turn[i])[:, free]
        first = free < NODE_DOFS
        return (place[free[first]], place[free[~first]]), rows


def _follow(block: IntervalBlocks, nodal: FloatArray) -> FloatArray:
    """Return how the insides follow their ends, shape (N, m)."""
    ends = np.einsum("nij,nj->ni", block.turn, nodal[block.ends])
    return np.einsum("nij,nj->ni", block.constraint, ends)


def interval_modes(
    matrices: tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix],
    parts: Sequence[Interval],
    damping: Sequence[tuple[float, float]],
    angles: FloatArray,
    fixed: BoolArray,
    owner: IntArray,
) -> IntervalModes:
    """Change to modes of intervals and displacements of attachments.

    Parameters
    ----------
    matrices : (K, M, C) of shape (6 n, 6 n)
        In nodal axes; between the ends of an interval C = alpha K + beta M.
    parts : sequence of Interval
        All intervals.
    damping : sequence of (alpha, beta)
        Proportional damping of every interval.
    angles : ndarray, shape (n,)
        Direction in plan of the nodal axes at inner nodes [rad].
    fixed : ndarray of bool, shape (6 n,)
        Degrees of freedom that are held.
    owner : ndarray, shape (n,)
        Node whose degrees of freedom a node has; see `CatenaryMesh`.
    """
    inside = np.zeros(len(fixed), dtype=bool)
    for part in parts:
        inside.reshape(-1, NODE_DOFS)[part.nodes[1:-1]] = True
    attached = np.flatnonzero(~fixed & ~inside)
    place = np.full(len(fixed), -1)
    place[attached] = np.arange(len(attached))
    place = place.reshape(-1, NODE_DOFS)[owner].ravel()
    K, M, _ = matrices
    spans, layouts = _layout(_planes_apart(abs(K) + abs(M), parts), parts, angles, owner)
    batches = [_batch(matrices, place, layout) for layout in layouts]
    n = spans[-1].stop if spans else 0
    eigenvalue, alpha, beta = np.empty(n), np.empty(n), np.empty(n)
    for span, (a, b) in zip(spans, damping, strict=True):
        alpha[span], beta[span] = a, b
    for batch in batches:
        eigenvalue[batch.block.modes] = batch.eigenvalue
    coupling, turn = _coupling(batches, place, n, len(attached))
    felt = [_felt_by_all(matrix, k, batches, attached, place) for k, matrix in enumerate(matrices)]
    return IntervalModes(
        eigenvalue=eigenvalue,
        alpha=alpha,
        beta=beta,
        coupling=coupling,
        turn=turn,
        K=felt[0],
        M=felt[1],
        C=felt[2],
        attached=attached,
        place=place,
        spans=spans,
        blocks=tuple(batch.block for batch in batches),
    )


def slower_than(modes: IntervalModes, highest: float) -> IntervalModes:
    """Return a line without the modes of intervals above a natural frequency.

    Parameters
    ----------
    modes : IntervalModes
        With all modes.
    highest : float
        [Hz]

    Raises
    ------
    ParameterError
        If no interval has a mode left.
    """
    kept = modes.eigenvalue <= (2.0 * math.pi * highest) ** 2
    if kept.all():
        return modes
    if not kept.any():
        slowest = math.sqrt(modes.eigenvalue.min()) / (2.0 * math.pi)
        raise ParameterError(
            f"parameter 'dynamics.highest_frequency': {highest:g} Hz leaves no mode; the slowest has {slowest:.3g} Hz"
        )
    place = np.concatenate([[0], np.cumsum(kept)])
    blocks = [part for block in modes.blocks for part in _slow_parts(block, kept, place)]
    coupling = modes.coupling[kept]
    felt = np.unique(coupling.indices)
    return replace(
        modes,
        eigenvalue=modes.eigenvalue[kept],
        alpha=modes.alpha[kept],
        beta=modes.beta[kept],
        coupling=coupling[:, felt],
        turn=modes.turn[felt],
        spans=tuple(slice(int(place[span.start]), int(place[span.stop])) for span in modes.spans),
        blocks=tuple(block for block in blocks if block.modes.size),
        followers=tuple(block for block in blocks if not block.modes.size),
    )


def _slow_parts(block: IntervalBlocks, kept: BoolArray, place: IntArray) -> Iterator[IntervalBlocks]:
    """Split blocks by how many modes they keep, their first ones; ``place`` is where these come in q."""
    counts = kept[block.modes].sum(axis=1)
    for count in np.unique(counts).tolist():
        own = counts == count
        arrays = {name: array[own] for name, array in vars(block).items()}
        yield IntervalBlocks(**arrays | {"modes": place[block.modes[own, :count]]})


@dataclass(frozen=True)
class _Layout:
    """Blocks of one size: inner degrees of freedom, modes, ends and directions, arrays over the blocks."""

    inner: IntArray
    modes: IntArray
    ends: IntArray
    angle: FloatArray


def _layout(
    planes_apart: bool, parts: Sequence[Interval], angles: FloatArray, owner: IntArray
) -> tuple[tuple[slice, ...], list[_Layout]]:
    """Number the modes interval by interval, those in plane first."""
    planes = _PLANES if planes_apart else (tuple(range(NODE_DOFS)),)
    spans: list[slice] = []
    by_size: dict[int, list[tuple[IntArray, IntArray, IntArray, float]]] = {}
    start = 0
    for part in parts:
        begin = start
        ends = (owner[part.nodes[[0, -1], None]] * NODE_DOFS + np.arange(NODE_DOFS)).ravel()
        for plane in planes if len(part.nodes) > 2 else ():
            inner = (part.nodes[1:-1, None] * NODE_DOFS + np.array(plane)).ravel()
            modes = np.arange(start, start + inner.size)
            by_size.setdefault(inner.size, []).append((inner, modes, ends, float(angles[part.nodes[1]])))
            start += inner.size
        spans.append(slice(begin, start))
    return tuple(spans), [_Layout(*(np.array(c) for c in zip(*rows, strict=True))) for rows in by_size.values()]


def _planes_apart(pattern: sp.spmatrix, parts: Sequence[Interval]) -> bool:
    """Return whether inner nodes move in plane and out of plane independently."""
    inner = np.concatenate([np.zeros(0, dtype=np.int64), *(part.nodes[1:-1] for part in parts)])
    first, second = ((inner[:, None] * NODE_DOFS + np.array(plane)).ravel() for plane in _PLANES)
    return bool(pattern.tocsr()[first][:, second].nnz == 0)


@dataclass(frozen=True)
class _Batch:
    """Blocks of one size: modes, coupling (N, m, 12), and what their ends feel of K, M, C, each (N, 12, 12)."""

    block: IntervalBlocks
    eigenvalue: FloatArray
    coupling: FloatArray
    felt: tuple[FloatArray, ...]


def _batch(matrices: tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix], place: IntArray, layout: _Layout) -> _Batch:
    turn = _to_interval(layout.angle)
    inner, ends = layout.inner, layout.ends
    K, M, C = (_dense(matrix, inner, inner) for matrix in matrices)
    free = (place[ends] >= 0)[:, None, :]
    K_end, M_end, C_end = (
        _without_rounding((_dense(matrix, inner, ends) * free) @ turn.transpose(0, 2, 1)) for matrix in matrices
    )
    constraint = np.asarray(-np.linalg.solve(K, K_end), dtype=np.float64)
    eigenvalue, shapes = _modes(K, M)
    coupling = shapes.transpose(0, 2, 1) @ (M @ constraint + M_end)
    back = turn.transpose(0, 2, 1)
    felt = tuple(back @ _felt(*pair, constraint) @ turn for pair in ((K, K_end), (M, M_end), (C, C_end)))
    block = IntervalBlocks(inner, layout.modes, ends, turn, shapes, constraint)
    return _Batch(block, eigenvalue, coupling, felt)


def _to_interval(angle: FloatArray) -> FloatArray:
    """Return the turns of both ends from global axes to the intervals', shape (N, 12, 12)."""
    result = np.zeros((len(angle), _ENDS, _ENDS))
    for first in range(0, _ENDS, 3):
        result[:, first : first + 3, first : first + 3] = turns(-angle)
    return result


def _without_rounding(ends: FloatArray) -> FloatArray:
    """Return the coupling with the ends without columns that are zero up to rounding: the other plane's."""
    size = np.abs(ends).max(axis=1, keepdims=True)
    ends[np.broadcast_to(size <= _ROUNDING * size.max(axis=2, keepdims=True), ends.shape)] = 0.0
    return ends


def _felt(full: FloatArray, end: FloatArray, constraint: FloatArray) -> FloatArray:
    """Return what the ends feel of a matrix when the inside follows them."""
    across = end.transpose(0, 2, 1) @ constraint
    return across + across.transpose(0, 2, 1) + constraint.transpose(0, 2, 1) @ full @ constraint


def _modes(K: FloatArray, M: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return eigenvalues (N, m) and modes (N, m, m) of unit modal mass."""
    inverse = np.linalg.inv(np.linalg.cholesky(M))
    standard = inverse @ K @ inverse.transpose(0, 2, 1)
    eigenvalue, vectors = np.linalg.eigh(0.5 * (standard + standard.transpose(0, 2, 1)))
    return eigenvalue, inverse.transpose(0, 2, 1) @ vectors


def _dense(matrix: sp.csr_matrix, rows: IntArray, columns: IntArray) -> FloatArray:
    """Return sub-matrices, shape (N, m, k), of rows (N, m) and columns (N, k)."""
    shape = (*rows.shape, columns.shape[1])
    at = (np.broadcast_to(rows[:, :, None], shape).ravel(), np.broadcast_to(columns[:, None, :], shape).ravel())
    return np.asarray(matrix[at], dtype=np.float64).reshape(shape)


def _felt_by_all(
    matrix: sp.csr_matrix, which: int, batches: Sequence[_Batch], attached: IntArray, place: IntArray
) -> sp.csr_matrix:
    """Return what the attachments feel of K, M or C: their own, and that of the intervals that follow them."""
    result = matrix[attached][:, attached]
    for batch in batches:
        at = place[batch.block.ends]
        row, column = np.repeat(at, _ENDS, axis=1).ravel(), np.tile(at, (1, _ENDS)).ravel()
        kept = (row >= 0) & (column >= 0)
        value = batch.felt[which].ravel()[kept]
        result = result + sp.csr_matrix((value, (row[kept], column[kept])), shape=result.shape)
    scale = np.sqrt(np.abs(result.diagonal()))
    return without_rounding(result, scale)


def _coupling(
    batches: Sequence[_Batch], place: IntArray, modes: int, attached: int
) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Return the coupling of the modes with the intervals' ends, and the turns that lead there."""
    couplings, turns = [sp.csr_matrix((modes, 0))], [sp.csr_matrix((0, attached))]
    for batch in batches:
        block, (count, size) = batch.block, batch.block.inner.shape
        moved = np.abs(batch.coupling).max(axis=1) > 0.0
        column = (np.cumsum(moved.ravel()) - 1).reshape(count, _ENDS)
        k, i, j = np.nonzero(np.broadcast_to(moved[:, None, :], (count, size, _ENDS)))
        entries = (batch.coupling[k, i, j], (block.modes[k, i], column[k, j]))
        couplings.append(sp.csr_matrix(entries, shape=(modes, int(moved.sum()))))
        turned = place[block.ends][:, None, :]
        k, i, j = np.nonzero((block.turn != 0.0) & moved[:, :, None] & (turned >= 0))
        entries = (block.turn[k, i, j], (column[k, i], turned[k, 0, j]))
        turns.append(sp.csr_matrix(entries, shape=(int(moved.sum()), attached)))
    return sp.hstack(couplings, format="csr"), sp.vstack(turns, format="csr")
