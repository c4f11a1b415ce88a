"""The modes of a line in units of eight, as the kernels take them."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray, IntArray
from models.catenary.linear_motion.interval_modes import IntervalModes
from models.catenary.linear_motion.line_motion import LineMotion
from models.catenary.linear_motion.step_matrices import StepMatrices
from models.catenary.step.array_book import ArrayBook
from models.catenary.step.attachment_lanes import AttachmentLanes, aligned


class ModeUnits:
    """Modes in units of eight that move with the same ends of their interval.

    Parameters
    ----------
    matrices : StepMatrices
    attachments : AttachmentLanes
    kernels : module

    Attributes
    ----------
    arrays : Modes
        See `models.catenary.step.mode_kernels`.
    carried : ndarray, shape (kinds,)
        a2 / mu for every kind of damping.
    table : ndarray
        See `models.catenary.step.mode_kernels.advance`; of a line at rest.
    slots : ndarray of int, shape (n_modes,)
        Number of every mode, counted over all lanes of all units.
    amplitude, rate : ndarray of int, shape (n_modes,)
        Where in the table the amplitudes of the modes are, and their rates.
    """

    def __init__(self, matrices: StepMatrices, attachments: AttachmentLanes, kernels: ModuleType) -> None:
        modes, newmark, coupling = matrices.modes, matrices.newmark, matrices.coupling
        lanes, width = kernels.LANES, kernels.ENDS
        first, unit = _first_modes(modes, lanes)
        n_units, n_ends = len(first), coupling.shape[1]
        lane = np.arange(len(unit)) - first[unit]
        entries = coupling.tocoo()
        of_entry = unit[entries.row]
        where = np.full(n_units, n_ends - width)
        np.minimum.at(where, of_entry, entries.col)
        chunk = (entries.col - where[of_entry]) // width
        table = np.zeros((n_units, kernels.ROWS, lanes))
        own = chunk == 0
        table[of_entry[own], (entries.col - where[of_entry])[own], lane[entries.row[own]]] = entries.data[own]
        pairs, of_pair = np.unique(np.stack([of_entry, chunk], axis=1)[~own], axis=0, return_inverse=True)
        end = np.minimum(where[pairs[:, 0]] + width * pairs[:, 1], n_ends - width)
        more = np.zeros((len(pairs), width, lanes))
        more[of_pair.ravel(), entries.col[~own] - end[of_pair.ravel()], lane[entries.row[~own]]] = entries.data[~own]
        damping = np.stack([modes.alpha[first], modes.beta[first]], axis=1)
        # A new group where the ends or the damping are others.
        is_new = (np.diff(where, prepend=-1) != 0) | (np.diff(damping, axis=0, prepend=np.nan) != 0.0).any(axis=1)
        groups, group = np.flatnonzero(is_new), np.cumsum(is_new) - 1
        of_kinds, kinds = np.unique(damping[groups], axis=0, return_inverse=True)
        kinds, (alpha, beta) = kinds.ravel(), of_kinds.T
        # K_hat = lambda (1 + a1 alpha) + mu
        mu, stiff = newmark.a0 + newmark.a1 * beta, -2.0 / (1.0 + newmark.a1 * alpha)
        kinds_of_rows = np.concatenate([kinds, kinds[group[pairs[:, 0]]]])
        rows = np.concatenate([where[groups], end])[:, None] + np.arange(width)
        turned, ends, places, shares = _turned(sp.csr_matrix(modes.turn), rows, kinds_of_rows, lanes)
        self.rows_of_ends = len(rows) + 1
        self.carried = newmark.a2 / mu
        self.arrays = kernels.Modes(
            first=np.append(groups, n_units).astype(np.uint64),
            rates=np.stack([np.full(len(mu), newmark.a2), self.carried, stiff, -stiff * mu], axis=1).ravel(),
            more=np.stack([pairs[:, 0], group[pairs[:, 0]]], axis=1).astype(np.uint64).ravel(),
            coupling=aligned(more),
            kinds=kinds.astype(np.uint64),
            turned=turned.astype(np.uint64),
            ends=ends.astype(np.uint32).ravel(),
            places=attachments.slots[places].astype(np.uint32).ravel(),
            shares=shares.ravel(),
        )
        self.slots, begin = unit * lanes + lane, unit * kernels.ROWS * lanes + lane
        self.amplitude, self.rate = begin + kernels.AMPLITUDE * lanes, begin + kernels.RATE * lanes
        self.table = table.ravel()
        self.table[begin + kernels.INVERSE * lanes] = matrices.inverse
        self.step, self.rows = newmark.step, kernels.ROWS
        self.attachments, self._matrices, self._kernels = attachments, matrices, kernels

    def pull(self, modal: FloatArray) -> FloatArray:
        """Return ``pull`` of the kernels' `advance` for a motion of the modes."""
        of, a2 = self._matrices, self._matrices.newmark.a2
        held = of.inverse * (a2 * modal[1] - 2.0 * of.modes.eigenvalue * modal[0])
        return self.attachments.laid_out(of.modes.turn.T @ (of.coupling.T @ (a2 / of.mu * modal[1] - held)))

    def momentum(self, velocity: FloatArray, table: FloatArray) -> FloatArray:
        """Return the momenta of all modes from velocities of the attachments in lanes and the table of the modes."""
        ends, result = np.empty(self.rows_of_ends * self._kernels.LANES), np.empty(table.size // self.rows)
        self._kernels.momenta(self.arrays, velocity, table, ends, result)
        return result[self.slots]


def _first_modes(modes: IntervalModes, lanes: int) -> tuple[IntArray, IntArray]:
    """Return the first mode of every unit, and the unit of every mode: no unit reaches into another block."""
    blocks = sorted((int(first), b.modes.shape[1]) for b in modes.blocks for first in b.modes[:, 0])
    first = [start for begin, count in blocks for start in range(begin, begin + count, lanes)]
    unit = np.zeros(len(modes.eigenvalue), dtype=np.int64)
    unit[first[1:]] = 1
    return np.array(first, dtype=np.int64), np.cumsum(unit)


def _turned(turn: sp.csr_matrix, rows: IntArray, kinds: IntArray, lanes: int) -> tuple[IntArray, Any, Any, FloatArray]:
    """Return ``turned``, ``ends``, ``places`` and ``shares`` of `Modes`.

    Two ends in the axes of their interval, x and y, are two displacements turned: (c, s) and (-s, c). Others, which
    move as one displacement, make pairs with a sine of 0; one that is left over makes one with what is not needed.

    Parameters
    ----------
    turn : sparse, shape (n_ends, n_attached)
    rows : ndarray of int, shape (N, 6)
        Which ends are in the rows.
    kinds : ndarray of int, shape (N,)
        Of the damping of what moves with them.
    """
    number = (np.arange(len(rows))[:, None] * lanes + np.arange(rows.shape[1])).ravel()
    kind, end = np.repeat(kinds, rows.shape[1]), rows.ravel()
    count, begin = np.diff(turn.indptr)[end], turn.indptr[end]
    assert count.max(initial=0) <= 2, "an interval is turned in plan alone"
    place, share = np.zeros((len(end), 2), dtype=np.int64), np.zeros((len(end), 2))
    for k in range(2):
        place[count > k, k], share[count > k, k] = turn.indices[begin[count > k] + k], turn.data[begin[count > k] + k]
    single, second = count < 2, (np.abs(share[:, 1]) > np.abs(share[:, 0])).astype(np.int64)
    share[second == 1] = share[second == 1][:, ::-1] * (1.0, -1.0)
    keys = np.column_stack([kind, np.where(single[:, None], -1, place), share])
    key = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    second[single] = _ranks(key)[single] % 2
    ranks = _ranks(2 * key + second)
    whole, pair = np.unique(np.column_stack([key, ranks]), axis=0, return_inverse=True)
    pair = pair.ravel()
    ends, places = np.full((len(whole), 2), len(rows) * lanes), np.zeros((len(whole), 2), dtype=np.int64)
    shares, of_kind = np.zeros((len(whole), 2)), np.zeros(len(whole), dtype=np.int64)
    ends[pair, second], shares[pair], of_kind[pair] = number, share, kind
    places[pair[~single]] = place[~single]
    places[pair[single], second[single]] = place[single, 0]
    return np.searchsorted(of_kind, np.arange(kinds.max() + 2)), ends, places, shares


def _ranks(values: IntArray) -> IntArray:
    """Return how many of the values before each are the same."""
    order = np.argsort(values, kind="stable")
    first = np.diff(values[order], prepend=values.min() - 1) != 0
    result = np.empty_like(values)
    result[order] = np.arange(len(values)) - np.flatnonzero(first)[np.cumsum(first) - 1]
    return result


class PackedMotion:
    """A motion in units and lanes, kept so from step to step.

    Parameters
    ----------
    units : ModeUnits
    motion : LineMotion
        What it is made of, and what its attachments' motion is copied to.

    Attributes
    ----------
    units
        The parameter.
    book : ArrayBook
        Of `Moving` of the kernels.
    moved : bool
        Whether the motion has changed since it was last unpacked.
    """

    def __init__(self, units: ModeUnits, motion: LineMotion) -> None:
        self.units, self.moved = units, False
        prepared, (modal, _) = motion.prepared, motion.plain()
        self._table = aligned(units.table)
        self._table[units.amplitude], self._table[units.rate] = modal
        is_known = prepared.size and prepared[0] == units.step
        self._pull = aligned(prepared[1:]) if is_known else units.pull(modal)
        x, self._v = (units.attachments.laid_out(part) for part in motion.attached)
        self.book = ArrayBook((x, self._v, self._table, np.zeros(units.table.size // units.rows), self._pull), ())

    def unpack(self, modal: FloatArray, momentum: FloatArray) -> None:
        """Put it into the arrays of a `LineMotion`."""
        if self.moved:
            np.take(self._table, self.units.amplitude, out=modal[0])
            np.take(self._table, self.units.rate, out=modal[1])
            momentum[...] = self.units.momentum(self._v, self._table)
            self.moved = False

    def prepared(self) -> FloatArray:
        """Return what has been found for the next step: step size, and forces on the attachments."""
        return np.concatenate(([self.units.step], self._pull))
