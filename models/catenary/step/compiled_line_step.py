"""One step of a line in compiled kernels, in one call: the same figures in a fraction of the time."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray, IntArray
from models.catenary.condition.running_surface import SurfacePiece
from models.catenary.contact_and_slack.contact_wire import ContactWire
from models.catenary.contact_and_slack.local_problem import LocalSolutionError, not_settled
from models.catenary.line_state import CatenaryState, ContactResult, StripMotion, empty_result
from models.catenary.linear_motion.attachment_solver import Sparse
from models.catenary.linear_motion.compliance import Compliance
from models.catenary.linear_motion.line_motion import LineMotion
from models.catenary.linear_motion.step_matrices import StepMatrices
from models.catenary.step.array_book import ArrayBook
from models.catenary.step.attachment_lanes import AttachmentLanes, aligned
from models.catenary.step.mode_units import ModeUnits, PackedMotion
from models.catenary.step.step_engine import GivenForce, SteppedLine, no_such_wire
from models.catenary.step.step_records import StepRecords
from models.contact_law import continuous_contact

#: No forces that are given, and no strips.
_NO_FORCES = np.zeros((0, 3))
_NO_STRIPS = np.zeros((0, 2, 2, 3)), np.zeros(0)
#: No slack droppers.
_NONE, _NO_LACK = np.zeros(0, dtype=np.int64), np.zeros(0)

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
        G = matrices.coupling @ modes.turn
        mass = newmark.a2 * (modes.M - G.T @ sp.diags(matrices.inverse / matrices.mu) @ G)
        self.lanes = lanes = AttachmentLanes(factor.matrix, factor.width, (-2.0 * modes.K, mass), kernels)
        self.units = ModeUnits(matrices, lanes, kernels)
        near = lanes if factor.matrix.shape[0] < _LONG else factor
        compliance = Compliance(near, droppers.B, droppers.by_change(newmark))
        self._records = StepRecords(line.wires, matrices, compliance, self.units.slots)
        contact, n_attached, n_droppers = line.contact, len(modes.attached), len(droppers.stiffness)
        law = contact.stiffness, contact.exponent, contact.restitution
        numbers = np.array([newmark.a1, newmark.a2, *law, line.gap])
        B = sp.csr_matrix(droppers.B)
        elongation = B.indptr.astype(np.uint32), B.indices.astype(np.uint32), B.data
        #: As named tuples of the kernels: `Lanes`, `LanesWork`, `Modes`, `Droppers`, `Wires`, `Surfaces`.
        self._line = (
            *(*lanes.arrays, *lanes.work, *self.units.arrays, *elongation, droppers.elastic_at_rest),
            *(droppers.stiffness, droppers.slack_delay, droppers.unilateral, lanes.laid_out(2.0 * droppers.rest_load)),
            *self._records.wires,
            *_surfaces(line.wires),
        )
        intervals = [interval for wire in line.wires for interval in wire.intervals]
        self._sizes = max(i.size for i in intervals), max(len(i.ends) for i in intervals)
        self._slack, self._lacks = np.zeros(n_droppers, dtype=np.int64), np.zeros(n_droppers)
        self._report = np.zeros(5, dtype=np.int64)
        shift, ends = len(self.units.carried) * lanes.size, self.units.rows_of_ends * kernels.LANES
        sizes = lanes.size, shift, ends, n_attached, *2 * (n_droppers,), *2 * self._sizes[:1]
        self._work = (numbers, *(aligned(np.zeros(size)) for size in sizes), self._slack, self._lacks, self._report)
        self._no_result = empty_result(0, len(line.wires))
        self._lay_out(1)

    def step(self, state: CatenaryState, motion: StripMotion) -> ContactResult:
        """Advance the line by one step under moving strips; see `StepEngine`."""
        shape = state.element.shape
        result = ContactResult(np.empty(shape), np.empty((*shape, 3)))
        strips = np.ascontiguousarray(motion.strip), np.ascontiguousarray(motion.compliance)
        self._run(state, strips, _NO_FORCES, state.element.size, result)
        return result

    def push(self, state: CatenaryState, forces: Sequence[GivenForce]) -> None:
        """Advance the line by one step under forces that are given at its end; see `StepEngine`."""
        given = np.array(forces, dtype=np.float64) if forces else _NO_FORCES
        self._run(state, _NO_STRIPS, given, len(forces), self._no_result)

    def _run(
        self,
        state: CatenaryState,
        strips: tuple[FloatArray, FloatArray],
        given: FloatArray,
        places: int,
        result: ContactResult,
    ) -> None:
        """Do one step, with what the kernels ask for on the way."""
        motion, report, records = state.motion, self._report, self._records
        packed = self._packed(motion)
        if places > self._places:
            self._lay_out(places)
        loaded, load = np.empty((places, 2), dtype=np.int64), np.empty((places, 2))
        before = state.element, state.impact_velocity, state.loaded, state.load, state.slack, state.compensation
        arrays = packed.book.entries, motion.attached, *before, *strips, given
        records.begin()
        report[0] = 0
        while answer := self.kernels.step(self._entries(), *arrays, loaded, load, result.force, result.point):
            self._answer(answer)
        packed.moved = True
        _, _, count, slack, ahead = report.tolist()
        state.loaded, state.load = (loaded, load) if count == places else (loaded[:count], load[:count])
        state.slack, state.compensation = _NONE, _NO_LACK
        if slack:
            state.slack = np.flatnonzero(self._slack)
            state.compensation = self._lacks[state.slack]
        if ahead >= 0 and len(strips[0]):
            records.prepare(ahead)

    def _answer(self, answer: int) -> None:
        """Give the kernels what they lack, or say why they do not go on."""
        kernels, (_, lacks, contacts, slack, _) = self.kernels, self._report.tolist()
        if answer == kernels.INTERVAL_LACKS:
            self._records.add_interval(lacks)
        elif answer == kernels.DROPPER_LACKS:
            self._records.add_dropper(lacks)
        elif answer == kernels.NO_WIRE:
            raise no_such_wire(len(self._wires))
        elif answer == kernels.NO_SOLUTION:
            raise LocalSolutionError("slack and contact forces have no solution: their compliances are singular")
        else:
            raise not_settled(slack, contacts)

    def _lay_out(self, places: int) -> None:
        """Make room for so many points of wires."""
        self._places = places
        points = *np.zeros((6, places), dtype=np.int64), *np.zeros((10, places))
        self._arrays = *self._line, *self._work, *points, *(np.zeros(places * size) for size in self._sizes)
        self._book: ArrayBook | None = None

    def _entries(self) -> IntArray:
        """Return where all arrays are; those of the records move as they grow."""
        if self._book is None or self._book.last is not self._records.arrays:
            self._book = ArrayBook(self._arrays, self._records.arrays)
        return self._book.entries

    def _packed(self, motion: LineMotion) -> PackedMotion:
        """Return the modal part of a motion in the kernels' order, which it is kept in from now on."""
        found = motion.packed
        if not (isinstance(found, PackedMotion) and found.units is self.units):
            motion.packed = found = PackedMotion(self.units, motion)
        return found


def _surfaces(wires: Sequence[ContactWire]) -> tuple[Any, ...]:
    """Return the running surfaces of contact wires: `Surfaces` of the kernels."""
    nothing = SurfacePiece(np.zeros(0), np.zeros(0), np.zeros(0))
    wholes = [wire.surface.whole() if wire.surface is not None else nothing for wire in wires]
    knots = (np.concatenate([getattr(whole, name) for whole in wholes]) for name in ("position", "height", "slope"))
    return np.cumsum([0, *(len(whole.position) for whole in wholes)]), *knots
