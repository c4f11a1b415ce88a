"""What the kernels read of intervals and droppers: records, made when a strip comes near or a dropper goes slack."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from models.arrays import FloatArray, IntArray
from models.catenary.contact_and_slack.contact_wire import ContactWire
from models.catenary.contact_and_slack.wire_response import interval_response
from models.catenary.linear_motion.compliance import Columns, Compliance
from models.catenary.linear_motion.step_matrices import StepMatrices

#: Numbers of records that are kept: 4 MB, some forty intervals.
_KEPT = 2**19
#: Steps between two clearances, below which more is kept.
_SELDOM = 100


class StepRecords:
    """Records of intervals and droppers in one array.

    Parameters
    ----------
    wires : sequence of ContactWire
    matrices : StepMatrices
    compliance : Compliance
        Of the attachments.
    slots : ndarray of int, shape (n_modes,)
        Numbers of the modes in the kernels' units.

    Attributes
    ----------
    wires : tuple of ndarray
        `Wires` of `models.catenary.step.contact_kernels`.
    arrays : (ndarray, ndarray, ndarray, ndarray)
        `Records` there.
    """

    def __init__(
        self, wires: Sequence[ContactWire], matrices: StepMatrices, compliance: Compliance, slots: IntArray
    ) -> None:
        self._matrices, self._compliance, self._slots = matrices, compliance, slots
        self._intervals = [interval for wire in wires for interval in wire.intervals]
        counts = np.array([len(interval.height) for interval in self._intervals])
        self.wires = (
            np.cumsum([0, *(wire.elements for wire in wires)]),
            np.concatenate([wire.starts for wire in wires]),
            np.array([wire.period for wire in wires]),
            np.repeat(np.arange(len(counts)), counts),
            np.array([interval.first for interval in self._intervals]),
        )
        self._size, self._most, self._steps = 0, _KEPT, 0
        data = np.zeros(2**12)
        self.arrays: tuple[FloatArray, IntArray, IntArray, IntArray] = (
            data,
            data.view(np.int64),
            np.full(len(counts), -1),
            np.full(compliance.droppers, -1),
        )

    def begin(self) -> None:
        """Begin a step: forget all records if there are too many."""
        self._steps += 1
        if self._size > self._most:
            if self._steps < _SELDOM:  # all of them are needed
                self._most *= 2
                return
            self._size = self._steps = 0
            for places in self.arrays[2:]:
                places[:] = -1

    def prepare(self, number: int) -> None:
        """Find a part of an interval's response before a strip gets there: no step shall take long."""
        if self._compliance.prepare(self._intervals[number].ends):
            self.add_interval(number)

    def add_interval(self, number: int) -> None:
        """Make the record of an interval, counted over all wires; see `Interval` of the kernels."""
        interval = self._intervals[number]
        columns = self._compliance.units(interval.ends)
        response = interval_response(self._matrices, interval, columns)
        slots = self._slots[interval.modes]
        size = len(slots), len(interval.ends), len(interval.height), len(columns.values), _first(columns)
        whole = (*size, len(columns.dropper_index)), slots, interval.ends, columns.dropper_index
        places = interval.plan, interval.plan_static, interval.height, interval.height_static
        moved = response.yielding, response.at_ends, columns.values.T, columns.dropper_force.T
        self._add(self.arrays[2], number, whole, (*self._of_modes(interval.modes), *places, *moved))

    def _of_modes(self, span: slice) -> tuple[FloatArray, ...]:
        """Return how modes give way to a force, to a displacement of their own and to a velocity of their ends."""
        matrices, inverse = self._matrices, self._matrices.inverse[span]
        return inverse, -2.0 * matrices.modes.eigenvalue[span] * inverse, matrices.newmark.a2 / matrices.mu[span]

    def add_dropper(self, index: int) -> None:
        """Make the record of a dropper; see `Dropper` of the kernels."""
        columns = self._compliance.dropper_columns[index]
        whole = (len(columns.values), _first(columns), len(columns.dropper_index)), columns.dropper_index
        self._add(self.arrays[3], index, whole, (columns.values, columns.dropper_force))

    def _add(
        self, places: IntArray, index: int, whole: Sequence[Sequence[int] | IntArray], numbers: Sequence[FloatArray]
    ) -> None:
        record = np.concatenate(
            [np.asarray(part, dtype=np.int64).view(np.float64) for part in whole] + [part.ravel() for part in numbers]
        )
        data, end = self.arrays[0], self._size + len(record)
        if end > len(data):
            data = np.zeros(max(end, 2 * len(data)))
            data[: self._size] = self.arrays[0][: self._size]
            self.arrays = data, data.view(np.int64), *self.arrays[2:]
        data[self._size : end] = record
        places[index], self._size = self._size, end


def _first(columns: Columns) -> int:
    """Return the first row that columns reach."""
    return int(columns.rows.start if isinstance(columns.rows, slice) else columns.rows[0])
