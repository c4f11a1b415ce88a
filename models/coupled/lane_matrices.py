"""A line's matrices as the kernels of lanes read them: made once for a step size, shared by all lanes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from types import ModuleType
from typing import Any

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray, IntArray
from models.catenary.contact_and_slack.wire_response import interval_response
from models.catenary.line_model import CatenaryModel
from models.catenary.linear_motion.attachment_solver import Banded
from models.catenary.linear_motion.compliance import Columns, Compliance
from models.catenary.linear_motion.interval_modes import IntervalModes
from models.catenary.linear_motion.step_matrices import StepMatrices
from models.numerics.newmark import Newmark

#: Rows, columns and values of a matrix compressed by rows, indices unsigned.
_Compressed = tuple[Any, Any, Any]


class LaneMatrices:
    """What the kernels read of a line.

    Parameters
    ----------
    model : CatenaryModel
    step : float
        Step of the line [s].
    linear, contact : module
        `lanes_linear_kernels` and `lanes_contact_kernels`, compiled.

    Attributes
    ----------
    linear, droppers : tuple
        Of the linear step; see the kernels.
    wires, law, loads : tuple
        Of contacts and slack droppers; ``loads`` are elongations of droppers, compressed, and what those that are slack
        at rest do to the attachments.
    unilateral : ndarray, shape (n_droppers,)
        1 - r of `DropperLaw`.
    factor : Factor or None
        Solves for the attachments where the kernels do not, as on a line that closes on itself.
    ends : int
        Of all intervals.
    most : tuple of int
        Largest numbers of an interval's local coordinates, of its ends, and of the rows that a response reaches.
    """

    def __init__(self, model: CatenaryModel, step: float, linear: ModuleType, contact: ModuleType) -> None:
        newmark = Newmark(step)
        matrices = StepMatrices(model.modes, newmark)
        modes, law, contact_law = model.modes, model.dropper_law, model.definition.contact
        slots = _Slots(matrices, linear)
        self.ends = slots.ends
        self.factor = None if isinstance(matrices.factor, Banded) else matrices.factor
        lower, upper = self._band(matrices)
        self.linear = linear.Linear(
            a1=newmark.a1,
            first=slots.first,
            end=slots.end,
            rates=slots.rates,
            modes=slots.modes,
            slot_end=slots.slot_end,
            turn=_compressed(_widened(modes.turn, slots.ends)),
            back=_compressed(_widened(modes.turn, slots.ends).T),
            own=_own(modes, newmark),
            lower=lower,
            upper=upper,
        )
        by_change = law.by_change(newmark)
        self.droppers = linear.Droppers(
            *_pulls(law.B, law.stiffness, law.slack_delay, by_change), model.static.elastic_force
        )
        self.loads = (*_compressed(law.B), law.rest_load)
        self.unilateral = law.unilateral
        radii = contact_law.wire_radius + contact_law.strip_radius
        self.law = contact.Law(contact_law.stiffness, contact_law.exponent, contact_law.restitution, radii)
        responses = _Responses(model, matrices, Compliance(matrices.factor, law.B, by_change), slots.of_mode)
        self.wires, self.most = contact.Wires(*responses.wires), responses.most

    @staticmethod
    def _band(matrices: StepMatrices) -> tuple[FloatArray, FloatArray]:
        """Return the factor's rows and columns, divided by its diagonal, each after the inverse of that."""
        if not isinstance(matrices.factor, Banded):
            nothing = np.zeros((len(matrices.modes.attached), 2))
            return nothing, nothing
        factor = matrices.factor.factor
        width, n = max(factor.shape[0] - 1, 1), factor.shape[1]
        lower, upper = np.zeros((2, n, width + 1))
        lower[:, 0] = upper[:, 0] = 1.0 / factor[0]
        for k in range(1, len(factor)):
            lower[k:, k] = factor[k, : n - k] / factor[0, k:]
            upper[: n - k, k] = factor[k, : n - k] / factor[0, : n - k]
        return lower, upper


class _Slots:
    """Modes in the order of the kernels: those that move with few ends, then others.

    Attributes
    ----------
    of_mode : ndarray of int, shape (n_modes,)
        Where a mode is.
    ends : int
        Ends of intervals, at least as many as a mode may move with.
    first, end, rates, modes, slot_end : ndarray
        See the kernels.
    """

    def __init__(self, matrices: StepMatrices, kernels: ModuleType) -> None:
        coupling, newmark = matrices.coupling.tocsr(), matrices.newmark
        coupling.sort_indices()
        groups = sorted((_Group(row, coupling) for row in _rows(matrices.modes)), key=lambda g: g.modes[0])
        widest = max((g.width for g in groups), default=0)
        slow = max(widest, kernels.ENDS)
        self.ends = max(coupling.shape[1], slow)
        few = [g for g in groups if g.width <= kernels.ENDS]
        many = [g for g in groups if g.width > kernels.ENDS]
        sizes = [len(g.modes) for g in few]
        self.first = np.concatenate([[0], np.cumsum(sizes)]).astype(np.uint64)
        begins = [
            *self.first[:-1].tolist(),
            *(int(self.first[-1]) + np.cumsum([0, *(len(g.modes) for g in many)])[:-1]),
        ]
        count = int(self.first[-1]) + sum(len(g.modes) for g in many)
        self.end = np.array([min(g.begin, self.ends - kernels.ENDS) for g in few], dtype=np.uint64)
        self.of_mode = np.zeros(coupling.shape[0], dtype=np.int64)
        self.modes, self.rates = np.zeros((count, kernels.OWN + slow)), np.zeros((count, 2))
        self.slot_end = np.zeros(count, dtype=np.uint64)
        inverse, mu, modes = matrices.inverse, matrices.mu, matrices.modes
        stiff = -2.0 * modes.eigenvalue * inverse
        for group, begin in zip((*few, *many), begins, strict=True):
            here = slice(int(begin), int(begin) + len(group.modes))
            own = group.modes
            self.of_mode[own] = np.arange(here.start, here.stop)
            width = kernels.ENDS if group.width <= kernels.ENDS else slow
            end = min(group.begin, self.ends - width)
            self.slot_end[here] = end
            self.modes[here, : kernels.OWN] = np.stack([inverse[own], stiff[own], newmark.a2 * inverse[own]], axis=1)
            columns = slice(kernels.OWN + group.begin - end, kernels.OWN + group.begin - end + group.width)
            self.modes[here, columns] = coupling[own, group.begin : group.begin + group.width].toarray()
            self.rates[here] = np.stack([newmark.a1 / mu[own], newmark.a2 / mu[own]], axis=1)


class _Group:
    """Modes that move with the same ends."""

    def __init__(self, modes: IntArray, coupling: sp.csr_matrix) -> None:
        columns = coupling.indices[coupling.indptr[modes[0]] : coupling.indptr[modes[-1] + 1]]
        self.modes = modes
        self.begin = int(columns.min(initial=coupling.shape[1])) if columns.size else 0
        self.width = int(columns.max()) + 1 - self.begin if columns.size else 0


def _rows(modes: IntervalModes) -> Iterator[IntArray]:
    """Yield the modes of every block of an interval."""
    for block in modes.blocks:
        yield from block.modes


class _Responses:
    """Records of the contact wires' intervals and of the droppers, for `lanes_contact_kernels.Wires`."""

    def __init__(self, model: CatenaryModel, matrices: StepMatrices, compliance: Compliance, slots: IntArray) -> None:
        starts, of_element, first = [], [], [0]
        records: list[FloatArray] = []
        numbers: list[list[int]] = []
        chains = [chain for chain in model.mesh.chains if chain.component == "contact_wire"]
        at, coordinates, ends = 0, 1, 1
        for wire, chain in zip(model.wires, chains, strict=True):
            for interval in wire.intervals:
                columns = compliance.units(interval.ends)
                found = interval_response(matrices, interval, columns)
                near, reached = columns.dropper_index, columns.values
                parts = (slots[interval.modes], interval.ends, interval.plan, interval.plan_static, interval.height,
                         interval.height_static, found.yielding, found.at_ends, reached.T, near,
                         columns.dropper_force.T)  # fmt: skip
                record = np.concatenate([np.asarray(part, dtype=np.float64).ravel() for part in parts])
                elements = len(interval.height)
                numbers.append(
                    [interval.count, len(interval.ends), elements, len(reached), len(near), interval.first,
                     _begin(columns), at]
                )  # fmt: skip
                of_element += [len(numbers) - 1] * elements
                records.append(record)
                at += len(record)
                coordinates, ends = max(coordinates, interval.size), max(ends, len(interval.ends))
            of_element.append(-1)  # beyond the last element
            starts.append(model.static.positions[chain.nodes, 0])
            first.append(len(of_element))
        slack_records, slack_numbers = self._droppers(compliance.dropper_columns)
        self.wires = (
            np.concatenate(starts),
            np.array(first),
            np.array([wire.period for wire in model.wires]),
            np.array(of_element),
            np.concatenate(records),
            np.array(numbers),
            slack_records,
            slack_numbers,
        )
        self.most = coordinates, ends, max(row[3] for row in numbers)

    @staticmethod
    def _droppers(columns: Sequence[Columns]) -> tuple[FloatArray, IntArray]:
        records, numbers, at = [np.zeros(0)], [], 0
        for column in columns:
            near = column.dropper_index
            record = np.concatenate([column.values[:, 0], near.astype(np.float64), column.dropper_force[:, 0]])
            numbers.append([len(column.values), _begin(column), len(near), at])
            records.append(record)
            at += len(record)
        return np.concatenate(records), np.array(numbers, dtype=np.int64).reshape(-1, 4)


def _begin(columns: Columns) -> int:
    rows = columns.rows
    return int(rows.start if isinstance(rows, slice) else rows[0])


def _widened(matrix: sp.csr_matrix, rows: int) -> sp.csr_matrix:
    """Return a matrix with rows of zeros after its own."""
    return sp.vstack([matrix, sp.csr_matrix((rows - matrix.shape[0], matrix.shape[1]))], format="csr")


def _compressed(matrix: sp.spmatrix) -> _Compressed:
    rows = sp.csr_matrix(matrix)
    rows.sort_indices()
    return rows.indptr.astype(np.uint64), rows.indices.astype(np.uint64), rows.data.astype(np.float64)


def _own(modes: IntervalModes, newmark: Newmark) -> _Compressed:
    """Return -2 K and a2 M of the attachments on one pattern; values (k, 2)."""
    known = sp.csr_matrix(-2.0 * modes.K + 1j * newmark.a2 * modes.M)
    known.sort_indices()
    values = np.stack([known.data.real, known.data.imag], axis=1)
    return known.indptr.astype(np.uint64), known.indices.astype(np.uint64), values


def _pulls(B: sp.csr_matrix, stiffness: FloatArray, delay: FloatArray, by_change: FloatArray) -> _Compressed:
    """Return what displacements, velocities and changes of the attachments add to the droppers' pulls."""
    rows, columns, stretch = _compressed(B)
    of = np.repeat(np.arange(len(stiffness)), np.diff(rows.astype(np.int64)))
    factors = np.stack([stiffness[of], -stiffness[of] * delay[of], by_change[of]], axis=1)
    return rows, columns, stretch[:, None] * factors
