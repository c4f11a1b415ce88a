"""One time step of a line in compiled kernels, to be fast: the same figures in a third to half of the time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray, IntArray
from models.catenary.contact_and_slack.contact_wire import ContactWire, WireInterval
from models.catenary.contact_and_slack.crossing import Crossing
from models.catenary.contact_and_slack.wire_response import (
    IntervalResponse,
    Met,
    ResponseOf,
    WirePoint,
    interval_response,
    walk,
)
from models.catenary.linear_motion.attachment_solver import Banded
from models.catenary.linear_motion.compliance import Columns
from models.catenary.linear_motion.interval_modes import IntervalModes
from models.catenary.linear_motion.line_motion import LineMotion
from models.catenary.linear_motion.step_matrices import StepMatrices
from models.catenary.step.step_engine import AppliedForce


class UnsuitedError(Exception):
    """A line that the kernels are not made for: it is too short."""


@dataclass(frozen=True, eq=False)
class _PackedResponse(IntervalResponse):
    """A response with what the kernels read of it.

    Attributes
    ----------
    record : ndarray
        See `models.catenary.step.step_kernels.unpacked`.
    """

    record: FloatArray


class NumbaEngine:
    """Steps of one size in compiled kernels; see `StepEngine`.

    Parameters
    ----------
    matrices : StepMatrices
    kernels : module
        `models.catenary.step.step_kernels`, compiled.

    Attributes
    ----------
    attached : ndarray, shape (n_attached,)
        Change of the attachments' displacements in this step [m].

    Raises
    ------
    UnsuitedError
        If the line is too short.
    """

    def __init__(self, matrices: StepMatrices, kernels: ModuleType) -> None:
        modes, newmark, factor = matrices.modes, matrices.newmark, matrices.factor
        n_ends, n_attached = modes.turn.shape
        if n_ends < kernels.ENDS:
            raise UnsuitedError("the line has too few intervals for them")
        self.kernels, self.matrices = kernels, matrices
        self.units = _Units(matrices, kernels)
        self._band = _Twisted(factor) if isinstance(factor, Banded) and _Twisted.suits(factor) else None
        rows, columns, entries = _pattern(sp.triu(-2.0 * modes.K + 1j * newmark.a2 * modes.M))  # both on one pattern
        self._own = rows, columns, np.stack([entries.real, entries.imag], axis=1)
        self._back, self._turn = _pattern(modes.turn.T), _pattern(modes.turn)
        self.attached, self._right, self._ends = np.empty(n_attached), np.empty(n_attached), np.empty(n_ends)
        self._table = np.zeros(0)

    def response(self, interval: WireInterval, columns: Columns) -> IntervalResponse:
        """Return how a wire gives way about an interval; see `StepEngine`."""
        plain = interval_response(self.matrices, interval, columns)
        slots, reached = self.units.slots[interval.modes], np.arange(len(self.attached))[columns.rows]
        sizes = len(slots), len(interval.ends), len(interval.height), len(reached)
        whole = np.concatenate((sizes, slots, interval.ends, reached)).astype(np.int64).view(np.float64)
        places = interval.plan, interval.plan_static, interval.height, interval.height_static
        numbers = [part.ravel() for part in (*places, plain.yielding, plain.at_ends, columns.values)]
        return _PackedResponse(**vars(plain), record=np.concatenate((whole, *numbers)))

    def begin(self, motion: LineMotion, pressed: FloatArray, applied: Sequence[AppliedForce] = ()) -> None:
        """Find the changes of this step without what is found inside it; see `StepEngine`."""
        packed = self._packed(motion)
        self._table = table = packed.table
        for response, element, xi, force in applied:
            self.kernels.push(_record(response), element - response.interval.first, xi, force, table, pressed)
        self.kernels.load(self._back, self._own, motion.attached, pressed, packed.pull, self._right)
        self.solve()

    def solve(self) -> None:
        """Find the change of the attachments' displacements from the forces on them."""
        if self._band is None:  # a line that closes on itself, or is very short
            self.attached[...] = self.matrices.factor.solve(self._right)
        else:
            self.kernels.solve(self._band.parts, self._right, self._band.work, self.attached)

    def meet(
        self, wire: ContactWire, response_of: ResponseOf, strip: FloatArray, guess: int, motion: LineMotion
    ) -> Met | None:
        """Return where a strip crosses a wire at the end of the step; see `StepEngine`.

        It mostly does so in the interval of ``guess`` or in the one beside it.
        """
        in_lap = wire.in_lap(strip)
        element = wire.start(guess, 0.5 * float(in_lap[0, 0, 0] + in_lap[1, 0, 0]))
        interval = wire.interval(element)
        found = self._meet(wire, response_of(interval), in_lap, element, motion)
        if found == self.kernels.BEYOND:
            element = interval.first + len(interval.height)
        elif found == self.kernels.BEFORE:
            element = interval.first - 1
        if isinstance(found, int) and found != self.kernels.NOWHERE and 0 <= element < wire.elements:
            found = self._meet(wire, response_of(wire.interval(element)), in_lap, element, motion)
        if not isinstance(found, int):
            return found
        return walk(wire, response_of, lambda i: self._motion_of(response_of(i), motion), strip, guess)

    def _meet(
        self, wire: ContactWire, response: IntervalResponse, strip: FloatArray, element: int, motion: LineMotion
    ) -> Met | int:
        """Return where a strip crosses an interval, or NOWHERE, BEFORE or BEYOND of the kernels."""
        interval = response.interval
        size, first = interval.size, interval.first
        result = np.empty(6 + size + len(interval.ends))
        a1, record = self.matrices.newmark.a1, _record(response)
        found: int = self.kernels.meet(
            record, strip, element - first, a1, self._table, self.attached, motion.attached, result
        )
        if found < 0:
            return found
        xi, share, height, rise, rate, compliance = result[:6].tolist()
        point = WirePoint(response, result[6 : 6 + size], height, result[6 + size :], compliance)
        return wire.crossing(strip, first + found, xi, share), point, rise, rate

    def _motion_of(self, response: IntervalResponse, motion: LineMotion) -> FloatArray:
        """Return an interval's local coordinates and rates at the end of the step, shape (2, m)."""
        table, units, interval = self._table, self.units, response.interval
        count, span = interval.count, interval.modes
        before, change = np.empty((2, interval.size)), np.empty(interval.size)
        before[0, :count], before[1, :count] = table[units.slots[span]], table[units.rate[span]]
        before[:, count:] = motion.attached.take(interval.ends, axis=1)
        change[:count], change[count:] = table[units.held[span]], self.attached.take(interval.ends)
        return response.advance(before, change, self.matrices.newmark.a1)

    def apply(self, point: WirePoint, force: float) -> None:
        """Add what a force on a point of a wire changes in this step; see `StepEngine`."""
        response, row, _, load, _ = point
        self.kernels.apply(_record(response), row, load, force, self._table, self.attached)

    def finish(self, motion: LineMotion) -> None:
        """Let the intervals follow their attachments, and replace the motion; see `StepEngine`."""
        packed, a1 = self._packed(motion), self.matrices.newmark.a1
        self.kernels.finish(
            self._turn, self.units.layout, a1, self.attached, self._ends, motion.attached, packed.table, packed.pull
        )
        packed.moved = True

    def place(self, crossing: Crossing, point: WirePoint, motion: LineMotion, place: FloatArray) -> None:
        """Put the place of a point of a wire into ``place``; see `StepEngine`."""
        response, row, height, _, _ = point
        element = crossing.element - response.interval.first
        self.kernels.place(_record(response), row, height, self._table, motion.attached, element, crossing.xi, place)

    def _packed(self, motion: LineMotion) -> _Packed:
        """Return the modal part of a motion in the kernels' order, which it is kept in from now on."""
        found = motion.packed
        if isinstance(found, _Packed) and found.owner is self:
            return found
        prepared = motion.prepared
        packed = _Packed(self, *motion.plain(), prepared)
        if not prepared.size or prepared[0] != self.matrices.newmark.step:
            self.kernels.prepare(self.units.layout, packed.table, packed.pull)
        motion.packed = packed
        return packed


def _record(response: IntervalResponse) -> FloatArray:
    """Return what the kernels read of a response that this engine has made."""
    assert isinstance(response, _PackedResponse)
    return response.record


class _Packed:
    """The modal part of a motion in units; see `models.catenary.step.step_kernels.finish`.

    Attributes
    ----------
    owner : NumbaEngine
    table, pull : ndarray
        See `models.catenary.step.step_kernels.finish`.
    moved : bool
        Whether the motion has changed since it was last unpacked.
    """

    def __init__(self, owner: NumbaEngine, modal: FloatArray, momentum: FloatArray, prepared: FloatArray) -> None:
        units = owner.units
        self.owner, self.moved = owner, False
        self.table = units.table.copy()
        self.table[units.slots], self.table[units.rate] = modal
        self.table[units.momentum] = momentum
        self.pull = np.zeros(owner.matrices.coupling.shape[1])
        if prepared.size:
            self.table[units.held], self.pull[:] = np.split(prepared[1:], [len(momentum)])

    def unpack(self, modal: FloatArray, momentum: FloatArray) -> None:
        """Put it into the arrays of a `LineMotion`."""
        if self.moved:
            units = self.owner.units
            np.take(self.table, units.slots, out=modal[0])
            np.take(self.table, units.rate, out=modal[1])
            np.take(self.table, units.momentum, out=momentum)
            self.moved = False

    def prepared(self) -> FloatArray:
        """Return what has been found for the next step: step size, changes of the modes, forces on the ends."""
        held = self.table[self.owner.units.held]
        return np.concatenate(([self.owner.matrices.newmark.step], held, self.pull))


class _Units:
    """Modes in units of eight that move with the same ends of their interval.

    Attributes
    ----------
    layout : tuple of ndarray
        ``units`` of `models.catenary.step.step_kernels.finish`.
    table : ndarray
        ``table`` there, of a line at rest.
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
        mu = newmark.a0 + newmark.a1 * modes.beta[first]
        # K_hat = lambda (1 + a1 alpha) + mu
        stiff = -2.0 / (1.0 + newmark.a1 * modes.alpha[first])
        a2 = np.full(n_units, newmark.a2)
        rates = np.stack([newmark.a1 / mu, a2, newmark.a2 / mu, stiff, -stiff * mu], axis=1)
        at_more = np.stack([pairs[:, 0], end], axis=1).astype(np.uint64)
        self.layout = where.astype(np.uint64), rates, at_more, more
        begin = unit * kernels.ROWS * lanes + lane
        self.slots, self.rate, self.momentum, self.held = (
            begin + row * lanes for row in (kernels.AMPLITUDE, kernels.RATE, kernels.MOMENTUM, kernels.HELD)
        )
        self.table = table.ravel()
        self.table[begin + kernels.INVERSE * lanes] = matrices.inverse


def _first_modes(modes: IntervalModes, lanes: int) -> tuple[IntArray, IntArray]:
    """Return the first mode of every unit, and the unit of every mode: no unit reaches into another block."""
    blocks = sorted((int(first), b.modes.shape[1]) for b in modes.blocks for first in b.modes[:, 0])
    first = [start for begin, count in blocks for start in range(begin, begin + count, lanes)]
    unit = np.zeros(len(modes.eigenvalue), dtype=np.int64)
    unit[first[1:]] = 1
    return np.array(first, dtype=np.int64), np.cumsum(unit)


_Pattern = tuple[Any, Any, FloatArray]


def _pattern(matrix: sp.spmatrix) -> _Pattern:
    """Return a matrix compressed by rows, with indices of 32 bits: the amount that is read sets the pace."""
    rows = sp.csr_matrix(matrix)
    rows.sort_indices()
    return rows.indptr.astype(np.uint32), rows.indices.astype(np.uint32), rows.data


class _Twisted:
    """A band factorised from both ends towards the middle.

    Attributes
    ----------
    parts : tuple of ndarray
        ``band`` of `models.catenary.step.step_kernels.solve`.
    work : ndarray
        As there.
    """

    def __init__(self, factor: Banded) -> None:
        matrix, width = factor.matrix, factor.factor.shape[0] - 1
        n = matrix.shape[0]
        p = (n - width + 1) // 2
        q = n - width - p
        between = slice(p, p + width)
        upper, lower = matrix[: p + width, : p + width], matrix[p:, p:][::-1, ::-1]
        first, last = self._half(upper, width), self._half(lower, width)
        left = _lower(first[p:])
        right = _lower(last[q:])[::-1, ::-1]
        rest = left @ left.T + right @ right.T - matrix[between, between].toarray()
        inverse = np.linalg.inv(rest)
        middle = np.ascontiguousarray(0.5 * (inverse + inverse.T))
        size = np.array([p, q, width, width + 1], dtype=np.uint64)
        self.parts = _inverted(first[:p]), _inverted(last[:q]), middle, size
        self.work = np.zeros((2, p + width))

    @staticmethod
    def suits(factor: Banded) -> bool:
        """Return whether a band is long enough to have a middle."""
        return factor.matrix.shape[0] >= 2 * factor.factor.shape[0]

    @staticmethod
    def _half(part: sp.spmatrix, width: int) -> FloatArray:
        """Return the Cholesky factor of a part, row j its column from the diagonal down, shape (n, width + 1)."""
        return np.ascontiguousarray(Banded(part.tocoo(), width).factor.T)


def _lower(rows: FloatArray) -> FloatArray:
    """Return the last rows of a band factor as a dense lower triangle."""
    n = len(rows)
    result = np.zeros((n, n))
    for j, column in enumerate(rows):
        result[j:, j] = column[: n - j]
    return result


def _inverted(rows: FloatArray) -> FloatArray:
    """Return the rows with the inverse of the diagonal in its place."""
    result = rows.copy()
    result[:, 0] = 1.0 / result[:, 0]
    return result.ravel()
