"""The modes of a line in units of eight, as the kernels take them."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray, IntArray
from models.catenary.linear_motion.interval_modes import IntervalModes
from models.catenary.linear_motion.step_matrices import StepMatrices
from models.catenary.step.attachment_lanes import aligned


class ModeUnits:
    """Modes in units of eight that move with the same ends of their interval.

    Parameters
    ----------
    matrices : StepMatrices
    kernels : module

    Attributes
    ----------
    arrays : Modes
        See `models.catenary.step.mode_kernels`.
    table : ndarray
        See `models.catenary.step.mode_kernels.advance`; of a line at rest.
    slots, rate, momentum, held : ndarray of int, shape (n_modes,)
        Where in it the amplitudes of the modes are, their rates, momenta and changes.
    """

    def __init__(self, matrices: StepMatrices, kernels: ModuleType) -> None:
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
        (alpha, beta), a2 = damping[groups].T, np.full(len(groups), newmark.a2)
        # K_hat = lambda (1 + a1 alpha) + mu
        mu, stiff = newmark.a0 + newmark.a1 * beta, -2.0 / (1.0 + newmark.a1 * alpha)
        places, shares = _turned(modes.turn, np.concatenate([where[groups], end])[:, None] + np.arange(width))
        self.arrays = kernels.Modes(
            first=np.append(groups, n_units).astype(np.uint64),
            rates=np.stack([newmark.a1 / mu, a2, newmark.a2 / mu, stiff, -stiff * mu], axis=1).ravel(),
            places=places[: len(groups)].ravel(),
            shares=shares[: len(groups)].ravel(),
            more=np.stack([pairs[:, 0], group[pairs[:, 0]]], axis=1).astype(np.uint64).ravel(),
            more_coupling=aligned(more),
            more_places=places[len(groups) :].ravel(),
            more_shares=shares[len(groups) :].ravel(),
        )
        begin = unit * kernels.ROWS * lanes + lane
        self.slots, self.rate, self.momentum, self.held = (
            begin + row * lanes for row in (kernels.AMPLITUDE, kernels.RATE, kernels.MOMENTUM, kernels.HELD)
        )
        self.table = table.ravel()
        self.table[begin + kernels.INVERSE * lanes] = matrices.inverse
        self.step, self._matrices = newmark.step, matrices

    def prepared(self, modal: FloatArray, momentum: FloatArray) -> FloatArray:
        """Return what a motion does in the next step, were the attachments held; see `PackedMotion.prepared`."""
        of, a2 = self._matrices, self._matrices.newmark.a2
        held = of.inverse * (a2 * momentum - 2.0 * of.modes.eigenvalue * modal[0])
        pull = of.modes.turn.T @ (of.coupling.T @ (a2 / of.mu * modal[1] - held))
        return np.concatenate(([self.step], held, pull))


def _first_modes(modes: IntervalModes, lanes: int) -> tuple[IntArray, IntArray]:
    """Return the first mode of every unit, and the unit of every mode: no unit reaches into another block."""
    blocks = sorted((int(first), b.modes.shape[1]) for b in modes.blocks for first in b.modes[:, 0])
    first = [start for begin, count in blocks for start in range(begin, begin + count, lanes)]
    unit = np.zeros(len(modes.eigenvalue), dtype=np.int64)
    unit[first[1:]] = 1
    return np.array(first, dtype=np.int64), np.cumsum(unit)


def _turned(turn: sp.csr_matrix, ends: IntArray) -> tuple[Any, FloatArray]:
    """Return which two displacements of attachments each end moves with, and how, both of shape (N, 2 n_ends)."""
    rows = sp.csr_matrix(turn)
    counts = np.diff(rows.indptr)
    assert counts.max(initial=0) <= 2, "an interval is turned in plan alone"
    places, shares = np.zeros((rows.shape[0], 2), dtype=np.uint32), np.zeros((rows.shape[0], 2))
    for k in (1, 0):  # where there is one alone, it is written to both places, and counts once
        has = counts > k
        at = rows.indptr[:-1][has]
        places[has, k], shares[has, k] = rows.indices[at + k], rows.data[at + k]
    places[counts == 1, 1] = places[counts == 1, 0]
    return places[ends].reshape(len(ends), -1), shares[ends].reshape(len(ends), -1)


class PackedMotion:
    """The modal part of a motion in units, kept so from step to step.

    Attributes
    ----------
    units : ModeUnits
    table, pull : ndarray
        See `models.catenary.step.mode_kernels.advance`.
    moved : bool
        Whether the motion has changed since it was last unpacked.
    """

    def __init__(self, units: ModeUnits, modal: FloatArray, momentum: FloatArray, prepared: FloatArray) -> None:
        self.units, self.moved = units, False
        self.table = aligned(units.table)
        self.table[units.slots], self.table[units.rate] = modal
        self.table[units.momentum] = momentum
        if not prepared.size or prepared[0] != units.step:
            prepared = units.prepared(modal, momentum)
        self.table[units.held], self.pull = np.split(prepared[1:], [len(momentum)])

    def unpack(self, modal: FloatArray, momentum: FloatArray) -> None:
        """Put it into the arrays of a `LineMotion`."""
        if self.moved:
            np.take(self.table, self.units.slots, out=modal[0])
            np.take(self.table, self.units.rate, out=modal[1])
            np.take(self.table, self.units.momentum, out=momentum)
            self.moved = False

    def prepared(self) -> FloatArray:
        """Return what has been found for the next step: step size, changes of the modes, forces on the attachments."""
        return np.concatenate(([self.units.step], self.table[self.units.held], self.pull))
