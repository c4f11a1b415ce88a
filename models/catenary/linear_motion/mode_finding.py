"""Finding the modes of the intervals and what the attachments feel: from matrices in nodal axes to `IntervalModes`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from models.arrays import BoolArray, FloatArray, IntArray
from models.catenary.linear_motion.interval_modes import IntervalBlocks, IntervalModes, slower_than
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.form_finding import StaticState
from models.catenary.shape.wire_intervals import Interval, plan_rotation, turns, without_rounding

#: In-plane and out-of-plane degrees of freedom of a node, in axes along the wire.
_PLANES = ((0, 2, 4), (1, 3, 5))
#: Both ends of an interval.
_ENDS = 2 * NODE_DOFS
#: Columns below this share of the largest are zeros but for the rounding of a turn.
_ROUNDING = 1e-12


def line_modes(static: StaticState, parts: Sequence[Interval], angles: FloatArray) -> IntervalModes:
    """Return a line's coordinates and matrices about its static shape, droppers included.

    Parameters
    ----------
    static : StaticState
    parts : sequence of Interval
        All intervals.
    angles : ndarray, shape (n,)
        Direction in plan of the nodal axes at inner nodes [rad].
    """
    shape, droppers, Q = static.shape, static.droppers, plan_rotation(angles)
    matrices, definition, mesh = shape.matrices, shape.definition, shape.mesh
    springs = droppers.rows.T @ sp.diags(droppers.stiffness) @ droppers.rows
    damping = definition.damping
    C = matrices.C + damping.of("dropper").alpha * springs
    stiffness = matrices.K + springs
    if definition.dynamics.geometric_stiffness:
        # Not in C: alpha times it would be a damping that nothing has.
        stiffness = stiffness + static.pendulum_stiffness()
    K, M, C = ((Q.T @ matrix @ Q).tocsr() for matrix in (stiffness, matrices.M, C))
    K, M, C = (without_rounding(m, np.sqrt(np.maximum(m.diagonal(), 0.0))) for m in (K, M, C))
    rates = [(damping.of(part.component).alpha, damping.of(part.component).beta) for part in parts]
    modes = interval_modes((K, M, C), parts, rates, angles, mesh.fixed.ravel(), mesh.owner)
    highest = definition.dynamics.highest_frequency
    return slower_than(modes, highest) if highest else modes


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
