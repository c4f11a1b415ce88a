"""The line's motion as modes of its intervals and displacements of its attachments.

Between two attachments the nodes of a wire move as they would if the attachments were displaced slowly (constraint
modes), plus as a sum of all modes of the interval with its ends clamped (fixed-interface modes) [1]_. With as many
modes as there are inner degrees of freedom nothing is left out: it is a change of coordinates, d = T s with
s = (q, x), modal amplitudes q and displacements x of the attachments. In these coordinates

    K = diag(lambda) + K_x,      M = I + G + G' + M_x,      C = diag(alpha lambda + beta) + beta G + (beta G)' + C_x:

intervals are diagonal, and feel their attachments through the mass coupling G alone. A step of the time integration
then needs two products with G and one band solution over the attachments, an order of magnitude smaller than the line.

A reduced line leaves out the modes above a natural frequency (`slower_than`). Its constraint modes stay, so that at
rest it is the full line.

References
----------
.. [1] R. R. Craig, M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968) 1313-1319.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from models.arrays import BoolArray, FloatArray, IntArray
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.wire_intervals import Interval
from models.definition_files.parameter import ParameterError


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
        """Return T s: how modal amplitudes and displacements of attachments move the nodes, in nodal axes.

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

        Nothing remains of what omitted modes would do: modes are orthogonal with respect to the mass.

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
    """How the nodes of single intervals move: with their own modes and with their two attachments.

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
