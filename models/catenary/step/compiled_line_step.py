"""One step of a line in compiled kernels, in one call: the same figures in a fraction of the time."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray, IntArray
from models.catenary.contact_and_slack.local_problem import LocalSolutionError, not_settled
from models.catenary.line_state import CatenaryState, ContactResult, StripMotion
from models.catenary.linear_motion.attachment_solver import Sparse
from models.catenary.linear_motion.compliance import Compliance
from models.catenary.linear_motion.line_motion import LineMotion
from models.catenary.linear_motion.step_matrices import StepMatrices
from models.catenary.step.array_book import ArrayBook
from models.catenary.step.attachment_lanes import AttachmentLanes
from models.catenary.step.mode_units import ModeUnits, PackedMotion
from models.catenary.step.step_engine import GivenForce, SteppedLine
from models.catenary.step.step_records import StepRecords
from models.contact_law import continuous_contact

#: No forces that are given, and no strips.
_NOWHERE, _NOTHING = np.zeros((0, 2), dtype=np.int64), np.zeros((0, 2))
_NO_STRIPS = np.zeros((0, 2, 2, 3)), np.zeros(0)
#: No droppers.
_NONE, _NO_FORCES = np.zeros(0, dtype=np.int64), np.zeros(0)


#: Displacements of attachments from which on a solution about a load takes less time than a whole one.
_LONG = 12000


class UnsuitedError(Exception):
    """A line that the kernels are not made for."""


class CompiledLineStep:
    """Steps of one size in compiled kernels; see `StepEngine`.

    Parameters
    ----------
    line : SteppedLine
    matrices : StepMatrices
    kernels : module
        `models.catenary.step.step_kernels` and what it imports, compiled.

    Attributes
    ----------
    kernels, matrices
        The parameters.
    units : ModeUnits
    lanes : AttachmentLanes

    Raises
    ------
    UnsuitedError
        If the line is too short, or too many wires are abreast, or its contact law is in Python alone.
    """

    def __init__(self, line: SteppedLine, matrices: StepMatrices, kernels: ModuleType) -> None:
        modes, newmark, factor, droppers = matrices.modes, matrices.newmark, matrices.factor, line.droppers
        if modes.turn.shape[0] < kernels.ENDS:
            raise UnsuitedError("the line has too few intervals for them")
        if isinstance(factor, Sparse):
            raise UnsuitedError("the line has too many wires abreast for them")
        if line.law is not continuous_contact:
            raise UnsuitedError("they do not know the line's contact law")
        self.kernels, self.matrices, self._wires = kernels, matrices, line.wires
        self.units = ModeUnits(matrices, kernels)
        self.lanes = lanes = AttachmentLanes(
            factor.matrix, factor.width, (-2.0 * modes.K, newmark.a2 * modes.M), kernels
        )
        near = lanes if factor.matrix.shape[0] < _LONG else factor
        compliance = Compliance(near, droppers.B, droppers.by_change(newmark))
        self._records = StepRecords(line.wires, matrices, compliance, self.units.slots)
        contact = line.contact
        constants = np.array([newmark.a1, contact.stiffness, contact.exponent, contact.restitution, line.gap])
        n_attached, n_droppers = len(modes.attached), len(droppers.stiffness)
        arrays = (
            *(constants, *lanes.arrays, *self.units.arrays, *_by_rows(droppers.B), droppers.elastic_at_rest),
            *(droppers.stiffness, droppers.slack_delay, droppers.unilateral, 2.0 * droppers.rest_load),
            *(*self._records.wires, *lanes.work, np.zeros(n_attached), np.zeros(n_attached), np.zeros(n_droppers)),
        )
        self._book = ArrayBook(arrays)
        intervals = [interval for wire in line.wires for interval in wire.intervals]
        self._sizes = max(i.size for i in intervals), max(len(i.ends) for i in intervals)
        self._local = np.zeros((2, self._sizes[0]))
        self._droppers = np.zeros(n_droppers, dtype=np.bool_), np.zeros(n_droppers), np.zeros(n_droppers)
        self._report = np.zeros(5, dtype=np.int64)
        self._places: tuple[int, tuple[Any, ...], tuple[Any, ...]] = (0, (), ())

    def step(self, state: CatenaryState, motion: StripMotion) -> ContactResult:
        """Advance the line by one step under moving strips; see `StepEngine`."""
        count, shape = len(motion.strip), state.element.shape
        result = ContactResult(np.empty(shape), np.empty((*shape, 3)))
        strips = np.ascontiguousarray(motion.strip), np.ascontiguousarray(motion.compliance)
        self._run(state, strips, (_NOWHERE, _NOTHING), count * shape[1], result.force, result.point)
        return result

    def push(self, state: CatenaryState, forces: Sequence[GivenForce]) -> None:
        """Advance the line by one step under forces that are given at its end; see `StepEngine`."""
        given = _NOWHERE, _NOTHING
        if forces:
            placed = [(s, *self._wires[s].locate(x), force) for s, x, force in forces]
            given = np.array([place[:2] for place in placed]), np.array([place[2:] for place in placed])
        nothing = np.zeros((0, len(self._wires)))
        self._run(state, _NO_STRIPS, given, len(forces), nothing, nothing[:, :, None])

    def _run(
        self,
        state: CatenaryState,
        strips: tuple[FloatArray, FloatArray],
        given: tuple[IntArray, FloatArray],
        places: int,
        force: FloatArray,
        point: FloatArray,
    ) -> None:
        """Do one step, with what the kernels ask for on the way."""
        work, out = self._room_for(places)
        packed, report, records = self._packed(state.motion), self._report, self._records
        moving = state.motion.attached, packed.table, packed.pull
        before = state.element, state.impact_velocity, state.loaded, state.load, state.slack, state.compensation
        records.begin()
        report[0] = 0
        while answer := self.kernels.step(
            self._book.entries, moving, before, strips, given, records.arrays, work, report, (force, point, *out)
        ):
            self._answer(answer)
        packed.moved = True
        _, _, loaded, slack, ahead = report.tolist()
        state.loaded, state.load = _NOWHERE, _NOTHING
        if loaded:
            state.loaded, state.load = out[0][:loaded].copy(), out[1][:loaded].copy()
        state.slack, state.compensation = _NONE, _NO_FORCES
        if slack:
            state.slack = np.flatnonzero(self._droppers[0])
            state.compensation = self._droppers[1][state.slack]
        if ahead >= 0 and len(strips[0]):
            records.prepare(ahead)

    def _answer(self, answer: int) -> None:
        """Give the kernels what they lack, or say why they do not go on."""
        kernels, (_, lacks, contacts, slack, _) = self.kernels, self._report.tolist()
        if answer == kernels.INTERVAL_LACKS:
            self._records.add_interval(lacks)
        elif answer == kernels.DROPPER_LACKS:
            self._records.add_dropper(lacks)
        elif answer == kernels.NO_SOLUTION:
            raise LocalSolutionError("slack and contact forces have no solution: their compliances are singular")
        else:
            raise not_settled(slack, contacts)

    def _room_for(self, places: int) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        """Return arrays to work in and for results, long enough for so many points of wires."""
        known, work, out = self._places
        if places > known or not work:
            known = max(places, 1)
            work = (
                self._local,
                np.zeros((5, known), dtype=np.int64),
                np.zeros((7, known)),
                *(np.zeros((known, size)) for size in self._sizes),
                np.zeros(known, dtype=np.int64),
            )
            loaded = np.zeros((known, 2), dtype=np.int64), np.zeros((known, 2))
            out = (*loaded, np.zeros((known, 3)), *self._droppers)
            self._places = known, work, out
        return work, out

    def _packed(self, motion: LineMotion) -> PackedMotion:
        """Return the modal part of a motion in the kernels' order, which it is kept in from now on."""
        found = motion.packed
        if isinstance(found, PackedMotion) and found.units is self.units:
            return found
        prepared = motion.prepared
        packed = PackedMotion(self.units, *motion.plain(), prepared)
        if not prepared.size or prepared[0] != self.units.step:
            self.kernels.prepare(self.units.arrays, packed.table, packed.pull)
        motion.packed = packed
        return packed


def _by_rows(matrix: sp.spmatrix) -> tuple[Any, Any, FloatArray]:
    """Return a matrix compressed by rows, with indices of 32 bits: the amount that is read sets the pace."""
    rows = sp.csr_matrix(matrix)
    rows.sort_indices()
    return rows.indptr.astype(np.uint32), rows.indices.astype(np.uint32), rows.data
