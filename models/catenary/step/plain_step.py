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
from models.catenary.step.step_engine import GivenForce, SteppedLine

#: No forces on the contact wires; no strips.
_NOWHERE, _NOTHING, _NO_STRIPS = np.zeros((0, 2), dtype=np.int64), np.zeros((0, 2)), np.zeros(0)


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
        places = [(c.section, c.crossing.element, c.crossing.xi) for c in contacts]
        self._finish(state, places, [c.point for c in contacts], found.contact, found)
        result = empty_result(*state.element.shape)
        state.impact_velocity[...] = 0.0
        for contact, force, velocity, closed in zip(contacts, *found[:3], strict=True):
            p, s = contact.pantograph, contact.section
            result.force[p, s] = force
            if closed:
                state.impact_velocity[p, s] = contact.impact_velocity or max(velocity, 1e-6)
        for p, s, crossing, point, *_ in candidates:
            interval = point.response.interval
            local = interval.local(state.motion)[0]
            result.point[p, s] = *interval.at(crossing, local), point.height + point.row.dot(local)
        put_in_lap(self._line.wires, result.point, motion.strip)
        return result

    def push(self, state: CatenaryState, forces: Sequence[GivenForce]) -> None:
        """Advance the line by one step under forces that are given at its end; see `StepEngine`."""
        pull = self._begin(state)
        places = [(s, *self._line.wires[s].locate(x)) for s, x, _ in forces]
        points, values = [self._point(*place) for place in places], [force for _, _, force in forces]
        for point, force in zip(points, values, strict=True):
            columns = point.response.columns
            pull[columns.dropper_index] += columns.dropper_force.dot(force * point.load)
        found = self._local.solve(pull, (), _NO_STRIPS, state.slack)
        self._finish(state, places, points, values, found)

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

    def _finish(
        self,
        state: CatenaryState,
        places: Sequence[tuple[int, int, float]],
        points: Sequence[WirePoint],
        forces: Sequence[float],
        found: LocalForces,
    ) -> None:
        """Let forces on points of wires and those that slack droppers lack act in the step, and finish it.

        All of them are recorded, at their places (section, element, xi): the next step begins with them.
        """
        for point, force in zip(points, forces, strict=True):
            if force != 0.0:
                self.linear.apply(point, force)
        for j, compensation in zip(found.slack.tolist(), found.compensation.tolist(), strict=True):
            column = self._local.dropper_columns[j]
            self.linear.attached[column.rows] -= compensation * column.values[:, 0]
        self.linear.finish(state.motion)
        self._points = dict(zip(places, points, strict=True))
        state.slack, state.compensation = found.slack, found.compensation
        state.loaded, state.load = _NOWHERE, _NOTHING
        if places:
            state.loaded = np.array([(s, element) for s, element, _ in places])
            state.load = np.array([(xi, force) for (_, _, xi), force in zip(places, forces, strict=True)])

    def _point(self, section: int, element: int, xi: float) -> WirePoint:
        """Return a point of a wire."""
        return self._responses.of(self._line.wires[section].interval(element)).point(element, xi)
