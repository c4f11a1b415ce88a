"""One step of a line by NumPy and SciPy, to be read: contacts and slack droppers between the parts of a linear step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray
from models.catenary.contact_and_slack.contact_wire import WireInterval, put_in_lap
from models.catenary.contact_and_slack.local_problem import ContactCandidate, LocalForces, LocalProblem
from models.catenary.contact_and_slack.response_cache import ResponseCache
from models.catenary.contact_and_slack.wire_response import WirePoint, interval_response
from models.catenary.line_state import CatenaryState, ContactResult, StripMotion, empty_result
from models.catenary.linear_motion.compliance import Compliance
from models.catenary.linear_motion.sparse_products import Product
from models.catenary.linear_motion.step_matrices import StepMatrices
from models.catenary.step.linear_step import LinearStep
from models.catenary.step.step_engine import GivenForce, SteppedLine, no_such_wire

_NO_STRIPS = np.zeros(0)
#: Where a force acts, its section, element and xi; the point of the wire there; the force at the end of the step [N].
_Placed = tuple[tuple[int, int, float], WirePoint, float]


class PlainStep:
    """Steps of one size by NumPy and SciPy; see `StepEngine`.

    Parameters
    ----------
    line : SteppedLine
    matrices : StepMatrices

    Attributes
    ----------
    linear : LinearStep
        What is linear in the step.
    """

    def __init__(self, line: SteppedLine, matrices: StepMatrices) -> None:
        self._line, self.linear = line, LinearStep(matrices)
        by_change = line.droppers.by_change(matrices.newmark)
        compliance = Compliance(matrices.factor, line.droppers.B, by_change)
        self._local = LocalProblem(
            unilateral=line.droppers.unilateral,
            dropper_columns=compliance.dropper_columns,
            velocity_factor=matrices.newmark.a1,
            law=line.law,
            parameters=line.contact,
        )
        self._responses = ResponseCache(
            lambda interval, columns: interval_response(matrices, interval, columns), compliance, len(line.wires)
        )
        #: Points of wires with forces at the end of the last step: the next one begins with them.
        self._points: dict[tuple[int, int, float], WirePoint] = {}
        #: What a change of the attachments adds to the droppers' pulls.
        self._pull = Product(sp.diags(by_change) @ line.droppers.B)

    def step(self, state: CatenaryState, motion: StripMotion) -> ContactResult:
        """Advance the line by one step under moving strips; see `StepEngine`."""
        pull = self._begin(state)
        candidates = self._candidates(state, motion)
        # One that was closed stays among the contacts: other forces of the step may keep it so.
        contacts = [c for c in candidates if c.penetration > 0.0 or c.impact_velocity > 0.0]
        found = self._local.solve(pull, contacts, motion.compliance, state.slack)
        acting = zip(contacts, found.contact, strict=True)
        placed = [((c.section, c.crossing.element, c.crossing.xi), c.point, force) for c, force in acting]
        self._finish(state, placed, found)
        result = empty_result(*state.element.shape)
        state.impact_velocity[...] = 0.0
        for contact, force, velocity, closed in zip(contacts, *found[:3], strict=True):
            p, s = contact.pantograph, contact.section
            result.force[p, s] = force
            if closed:
                state.impact_velocity[p, s] = contact.impact_velocity or max(velocity, 1e-6)
        for candidate in candidates:
            self._place(candidate, state, result)
        put_in_lap(self._line.wires, result.point, motion.strip)
        return result

    def push(self, state: CatenaryState, forces: Sequence[GivenForce]) -> None:
        """Advance the line by one step under forces that are given at its end; see `StepEngine`."""
        if any(s not in range(len(self._line.wires)) for s, _, _ in forces):
            raise no_such_wire(len(self._line.wires))
        pull = self._begin(state)
        placed: list[_Placed] = []
        for s, x, force in forces:
            place = s, *self._line.wires[s].locate(x)
            point = self._point(*place)
            columns = point.response.columns
            pull[columns.dropper_index] += columns.dropper_force.dot(force * point.load)
            placed.append((place, point, force))
        self._finish(state, placed, self._local.solve(pull, (), _NO_STRIPS, state.slack))
        state.impact_velocity[...] = 0.0

    def _begin(self, state: CatenaryState) -> FloatArray:
        """Find the free changes of the step; return the droppers' pulls at its end, if they could push [N]."""
        droppers, applied = self._line.droppers, []
        for (s, element), (xi, force) in zip(state.loaded.tolist(), state.load.tolist(), strict=True):
            applied.append((self._points.get((s, element, xi)) or self._point(s, element, xi), force))
        self.linear.begin(state.motion, droppers.known_load(state.slack, state.compensation), applied)
        pull = droppers.pull(state.motion.attached)
        self._pull.add(self.linear.attached, pull)
        return pull

    def _candidates(self, state: CatenaryState, motion: StripMotion) -> list[ContactCandidate]:
        """Return all strips that cross a wire at the end of the step, forces found inside it left out."""

        def local(interval: WireInterval) -> FloatArray:
            return self.linear.local(self._responses.of(interval), state.motion)

        def positions(interval: WireInterval) -> list[float]:
            return interval.positions(local(interval)[0])

        candidates, strips = [], motion.strip.tolist()
        for s, wire in enumerate(self._line.wires):
            for p, strip in enumerate(strips):
                if not wire.is_near(strip):
                    continue
                crossing = wire.find(strip, positions, state.element.item(p, s))
                if crossing is None:
                    continue
                state.element[p, s] = crossing.element
                point = self._point(s, crossing.element, crossing.xi)
                rise, speed = local(point.response.interval).dot(point.row).tolist()
                delta, rate = wire.penetration(crossing.share, point.height + rise, speed, strip, self._line.gap)
                impact = state.impact_velocity.item(p, s)
                candidates.append(ContactCandidate(p, s, crossing, point, delta, rate, impact))
                self._responses.prepare(wire.next_interval(crossing.element))
        return candidates

    def _finish(self, state: CatenaryState, placed: Sequence[_Placed], found: LocalForces) -> None:
        """Let forces on wires, and those that slack droppers lack, act in the step; finish it.

        All of them are recorded: the next step begins with them.
        """
        for _, point, force in placed:
            if force != 0.0:
                self.linear.apply(point, force)
        for j, compensation in zip(found.slack.tolist(), found.compensation.tolist(), strict=True):
            column = self._local.dropper_columns[j]
            self.linear.attached[column.rows] -= compensation * column.values[:, 0]
        self.linear.finish(state.motion)
        self._points = {place: point for place, point, _ in placed}
        state.slack, state.compensation = found.slack, found.compensation
        state.loaded = np.array([place[:2] for place, _, _ in placed], dtype=np.int64).reshape(-1, 2)
        state.load = np.array([(xi, force) for (_, _, xi), _, force in placed]).reshape(-1, 2)

    def _point(self, section: int, element: int, xi: float) -> WirePoint:
        """Return a point of a wire."""
        return self._responses.of(self._line.wires[section].interval(element)).point(element, xi)

    @staticmethod
    def _place(candidate: ContactCandidate, state: CatenaryState, result: ContactResult) -> None:
        """Write down where a strip meets a wire at the end of the step."""
        p, s, crossing, point, *_ = candidate
        interval = point.response.interval
        local = interval.local(state.motion)[0]
        result.point[p, s] = *interval.at(crossing, local), point.height + point.row.dot(local)
