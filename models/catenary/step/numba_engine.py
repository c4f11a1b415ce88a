"""The step of a line in compiled kernels, where numba is there: the same figures, two to three times as fast."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray, IntArray
from models.catenary.contact_and_slack.contact_wire import ContactWire, Touch, WireInterval
from models.catenary.contact_and_slack.crossing import Crossing
from models.catenary.contact_and_slack.wire_response import Meeting, Point, Reaction
from models.catenary.linear_motion.attachment_solver import Banded
from models.catenary.linear_motion.interval_modes import IntervalModes
from models.catenary.linear_motion.line_motion import LineMotion
from models.catenary.step.numpy_engine import Stepper
from models.catenary.step.step_engine import Known, ReactionOf
from models.numerics.newmark import Newmark


class UnsuitedError(Exception):
    """A line that the kernels are not made for: it is too short."""


class CompiledStepper(Stepper):
    """A stepper whose two halves are compiled.

    Parameters
    ----------
    modes : IntervalModes
    newmark : Newmark
    module : module
        The kernels.
    """

    def __init__(self, modes: IntervalModes, newmark: Newmark, module: ModuleType) -> None:
        self.kernels: ModuleType = module
        super().__init__(modes, newmark)

    def _set_up(self, coupling: sp.csr_matrix) -> None:
        if coupling.shape[1] < self.kernels.ENDS:
            raise UnsuitedError("the line has too few intervals for them")
        modes, newmark = self.modes, self.newmark
        self._band = _Twisted(self.factor) if isinstance(self.factor, Banded) and _Twisted.suits(self.factor) else None
        units = self.units = _Units(self, coupling)
        own = sp.triu(-2.0 * modes.K + 1j * newmark.a2 * modes.M)  # both on one pattern
        rows, columns, entries = _pattern(own)
        self._first = *_pattern(modes.turn.T), rows, columns, np.stack([entries.real, entries.imag], axis=1)
        self._last = *_pattern(modes.turn), *units.layout, newmark.a1
        self._table = np.zeros(0)

    def begin(self, motion: LineMotion, pressed: FloatArray, known: Sequence[Known] = ()) -> None:
        """Find the changes of this step without what is found inside it; see `Stepper.begin`."""
        packed = self._packed(motion)
        self._table = table = packed.table
        for reaction, element, xi, force in known:
            interval = reaction.interval
            row, load = np.empty(interval.size), np.empty(len(interval.ends))
            self.kernels.push(
                interval.height, interval.height_static, reaction.slots, interval.ends, reaction.yielding,
                reaction.at_ends, element, xi, force, row, load, table, pressed,
            )  # fmt: skip
        self.kernels.load(*self._first, motion.attached, pressed, packed.pull, self._right)
        self.solve()

    def solve(self) -> None:
        """Find the change of the attachments' displacements from the forces on them."""
        if self._band is None:  # a line that closes on itself, or is very short
            super().solve()
        else:
            self.kernels.solve(*self._band.parts, self._right, self._band.work, self.attached)

    def press(self, span: slice, force: FloatArray) -> None:
        """Add a force on the modes of an interval, its attachments held."""
        self._table[self.units.held[span]] += force * self.inverse[span]

    def apply(self, point: Point, force: float) -> None:
        """Add what a force on a point of a wire changes in this step; see `Stepper.apply`."""
        reaction, touch, load, _ = point
        columns = reaction.columns
        self.kernels.apply(
            reaction.slots, touch.row, load, force, reaction.reached, columns.values, self._table, self.attached
        )

    def slots(self, span: slice) -> IntArray:
        """Return where the modes of an interval are kept while they are packed, shape (n_span,)."""
        return self.units.slots[span].astype(np.uint64)

    def local(self, interval: WireInterval, motion: LineMotion) -> tuple[FloatArray, FloatArray]:
        """Return an interval's local coordinates and rates, and their changes; see `Stepper.local`."""
        table, units, attached = self._table, self.units, motion.attached
        count, span = interval.count, interval.modes
        before, change = np.empty((2, interval.size)), np.empty(interval.size)
        before[0, :count], before[1, :count] = table[units.slots[span]], table[units.rate[span]]
        before[:, count:] = attached.take(interval.ends, axis=1)
        change[:count], change[count:] = table[units.held[span]], self.attached.take(interval.ends)
        return before, change

    def meet(
        self, wire: ContactWire, reaction: ReactionOf, strip: FloatArray, guess: int, motion: LineMotion
    ) -> Meeting | None:
        """Return where a strip crosses an interval or the one beside it; see `Stepper.meet`."""
        strip = wire.in_lap(strip)
        element = wire.start(guess, 0.5 * float(strip[0, 0, 0] + strip[1, 0, 0]))
        interval = wire.interval(element)
        found = self._meet(wire, reaction(interval), strip, element, motion)
        if found == self.kernels.BEYOND:
            element = interval.first + len(interval.height)
        elif found == self.kernels.BEFORE:
            element = interval.first - 1
        if not isinstance(found, Meeting) and found != self.kernels.NOWHERE and 0 <= element < wire.elements:
            found = self._meet(wire, reaction(wire.interval(element)), strip, element, motion)
        return found if isinstance(found, Meeting) else None

    def _meet(
        self, wire: ContactWire, reaction: Reaction, strip: FloatArray, element: int, motion: LineMotion
    ) -> Meeting | int:
        interval = reaction.interval
        local, row = np.empty((2, interval.size)), np.empty(interval.size)
        load, out = np.empty(len(interval.ends)), np.empty(6)
        found: int = self.kernels.meet(
            strip, element - interval.first,
            interval.plan, interval.plan_static, interval.height, interval.height_static,
            reaction.slots, interval.ends, reaction.yielding, reaction.at_ends, self.newmark.a1,
            self._table, self.attached, motion.attached, local, row, load, out,
        )  # fmt: skip
        if found < 0:
            return found
        xi, share, height, rise, rate, compliance = out.tolist()
        count = interval.count
        point = Point(reaction, Touch(interval, row, row[:count], row[count:], height), load, compliance)
        return Meeting(wire.crossing(strip, interval.first + found, xi, share), point, rise, rate)

    def place(self, crossing: Crossing, point: Point, motion: LineMotion, place: FloatArray) -> None:
        """Put a point of a wire into ``place``, shape (3,) [m]."""
        reaction, touch, _, _ = point
        interval = reaction.interval
        self.kernels.place(
            interval.plan, interval.plan_static, touch.row, touch.height, reaction.slots,
            interval.ends, self._table, motion.attached, crossing.element - interval.first, crossing.xi, place,
        )  # fmt: skip

    def finish(self, motion: LineMotion) -> None:
        """Let the intervals follow their attachments, and replace the motion by that at the end of the step."""
        packed = self._packed(motion)
        self.kernels.finish(*self._last, self.attached, self._ends, motion.attached, packed.table, packed.pull)
        packed.moved = True

    def _packed(self, motion: LineMotion) -> _Packed:
        """Return the modal part of a motion in the kernels' order, which it is kept in from now on."""
        found = motion.packed
        if isinstance(found, _Packed) and found.owner is self:
            return found
        prepared = motion.prepared
        packed = _Packed(self, *motion.plain(), prepared)
        if not prepared.size or prepared[0] != self.newmark.step:
            self.kernels.prepare(*self.units.layout, packed.table, packed.pull)
        motion.packed = packed
        return packed


class _Packed:
    """The modal part of a motion in units; see `models.catenary.step.step_kernels.finish`.

    Attributes
    ----------
    owner : CompiledStepper
    table, pull : ndarray
        See `models.catenary.step.step_kernels.finish`.
    moved : bool
        Whether the motion has changed since it was last unpacked.
    """

    def __init__(self, owner: CompiledStepper, modal: FloatArray, momentum: FloatArray, prepared: FloatArray) -> None:
        units = owner.units
        self.owner, self.moved = owner, False
        self.table = units.table.copy()
        self.table[units.slots], self.table[units.rate] = modal
        self.table[units.momentum] = momentum
        self.pull = np.zeros(owner.modes.coupling.shape[1])
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
        return np.concatenate(([self.owner.newmark.step], held, self.pull))


class _Units:
    """Modes in units of eight that move with the same ends of their interval.

    Attributes
    ----------
    layout : tuple of ndarray
        ``where``, ``rates``, ``more`` and ``more_coupling`` of `models.catenary.step.step_kernels.finish`.
    table : ndarray
        ``table`` there, of a line at rest.
    slots, rate, momentum, held : ndarray of int, shape (n_modes,)
        Where in it the amplitudes of the modes are, their rates, momenta and changes.
    """

    def __init__(self, stepper: CompiledStepper, coupling: sp.csr_matrix) -> None:
        kernels, modes, newmark = stepper.kernels, stepper.modes, stepper.newmark
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
        self.table[begin + kernels.INVERSE * lanes] = stepper.inverse


def _first_modes(modes: IntervalModes, lanes: int) -> tuple[IntArray, IntArray]:
    """Return the first mode of every unit, and the unit of every mode: no unit reaches into another block."""
    blocks = sorted((int(first), b.modes.shape[1]) for b in modes.blocks for first in b.modes[:, 0])
    first = [start for begin, count in blocks for start in range(begin, begin + count, lanes)]
    unit = np.zeros(len(modes.eigenvalue), dtype=np.int64)
    unit[first[1:]] = 1
    return np.array(first, dtype=np.int64), np.cumsum(unit)


_Pattern = tuple[Any, Any, FloatArray]


def _pattern(matrix: sp.spmatrix) -> _Pattern:
    """Return a matrix compressed by rows, with unsigned indices; short ones, as what is read sets the pace."""
    rows = sp.csr_matrix(matrix)
    rows.sort_indices()
    return rows.indptr.astype(np.uint32), rows.indices.astype(np.uint32), rows.data


class _Twisted:
    """A band factorised from both ends towards the middle.

    Attributes
    ----------
    parts : tuple of ndarray
        ``top``, ``bottom``, ``middle`` and ``size`` of `models.catenary.step.step_kernels.solve`.
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
