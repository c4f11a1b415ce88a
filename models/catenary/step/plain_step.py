"""One step of a line by NumPy and SciPy, to be read: contacts and slack droppers between the parts of a linear step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray
from models.catenary.contact_and_slack.contact_wire import put_in_lap
from models.catenary.contact_and_slack.local_problem import ContactCandidate, LocalForces, LocalProblem
from models.catenary.contact_and_slack.response_cache import ResponseCache
from models.catenary.contact_and_slack.wire_response import WirePoint, interval_response
from models.catenary.line_state import CatenaryState, ContactResult, StripMotion, empty_result
from models.catenary.linear_motion.compliance import Compliance
from models.catenary.linear_motion.sparse_products import Product
from models.catenary.linear_motion.step_matrices import StepMatrices
from models.catenary.step.linear_step import AppliedForce, LinearStep
from models.catenary.step.step_engine import GivenForce, SteppedLine

#: No forces on the contact wires.
_NOWHERE, _NOTHING = np.zeros((0, 2), dtype=np.int64), np.zeros((0, 2))


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
        #: Points of wires that strips crossed in the last step: the next one begins with the forces on them.
        self._points: dict[tuple[int, int, float], WirePoint] = {}
        #: What a change of the attachments adds to the droppers' pulls.
        self._pull = Product(sp.diags(by_change) @ line.droppers.B)

    def step(self, state: CatenaryState, motion: StripMotion) -> ContactResult:
        """Advance the line by one step under moving strips; see `StepEngine`."""
        free_force = self._begin(state)
        candidates = self._candidates(state, motion)
        # One that was closed stays among the contacts: other forces of the step may keep it so.
        contacts = [c for c in candidates if c.penetration > 0.0 or c.impact_velocity > 0.0]
        forces = self._local.solve(free_force, contacts, _strip_compliance(contacts, motion), state.slack)
        self._apply(contacts, forces)
        self.linear.finish(state.motion)
        _note(state, contacts, forces)
        return self._result(state, candidates, contacts, forces, motion)

    def push(self, state: CatenaryState, forces: Sequence[GivenForce]) -> None:
        """Advance the line by one step under forces that are given at its end; see `StepEngine`."""
        wires = self._line.wires
        pull = self._begin(state)
        placed = [(s, *wires[s].locate(x), force) for s, x, force in forces]
        for s, element, xi, force in placed:
            point = self._responses.of(wires[s].interval(element)).point(element, xi)
            self.linear.apply(point, force)
            columns = point.response.columns
            pull[columns.dropper_index] += columns.dropper_force @ (force * point.load)
        found = self._local.solve(pull, (), np.zeros((0, 0)), state.slack)
        self._apply((), found)
        self.linear.finish(state.motion)
        state.slack, state.compensation = found.slack, found.compensation
        state.loaded = np.array([(s, element) for s, element, _, _ in placed], dtype=np.int64).reshape(-1, 2)
        state.load = np.array([(xi, force) for _, _, xi, force in placed]).reshape(-1, 2)

    def _begin(self, state: CatenaryState) -> FloatArray:
        """Find the free changes of the step; return the droppers' pulls at its end, if they could push [N]."""
        applied: list[AppliedForce] = []
        droppers = self._line.droppers
        for (s, element), (xi, force) in zip(state.loaded.tolist(), state.load.tolist(), strict=True):
            known = self._points.get((s, element, xi))
            point = known or self._responses.of(self._line.wires[s].interval(element)).point(element, xi)
            applied.append((point, force))
        self._points.clear()
        self.linear.begin(state.motion, droppers.known_load(state.slack, state.compensation), applied)
        pull = droppers.pull(state.motion.attached)
        self._pull.add(self.linear.attached, pull)
        return pull

    def _candidates(self, state: CatenaryState, motion: StripMotion) -> list[ContactCandidate]:
        """Return all strips that cross a wire at the end of the step, forces found inside it left out."""
        candidates = []
        for s, wire in enumerate(self._line.wires):
            for p, strip in enumerate(motion.strip):
                if not wire.is_near(strip):
                    continue
                met = self.linear.meet(wire, self._responses.of, strip, int(state.element[p, s]), state.motion)
                if met is None:
                    continue
                crossing, point, rise, speed = met
                state.element[p, s] = crossing.element
                self._points[s, crossing.element, crossing.xi] = point
                delta, rate = wire.penetration(crossing.share, point.height + rise, speed, strip, self._line.gap)
                impact = float(state.impact_velocity[p, s])
                candidates.append(ContactCandidate(p, s, crossing, point, delta, rate, impact))
                self._responses.prepare(wire.next_interval(crossing.element))
        return candidates

    def _apply(self, contacts: Sequence[ContactCandidate], forces: LocalForces) -> None:
        """Add what contact and compensation forces change within the step."""
        for contact, force in zip(contacts, forces.contact, strict=True):
            if force != 0.0:
                self.linear.apply(contact.point, force)
        for j, compensation in zip(forces.slack.tolist(), forces.compensation.tolist(), strict=True):
            column = self._local.dropper_columns[j]
            self.linear.attached[column.rows] -= compensation * column.values[:, 0]

    def _result(
        self,
        state: CatenaryState,
        candidates: Sequence[ContactCandidate],
        contacts: Sequence[ContactCandidate],
        forces: LocalForces,
        motion: StripMotion,
    ) -> ContactResult:
        result = empty_result(*state.element.shape)
        for contact, force in zip(contacts, forces.contact, strict=True):
            result.force[contact.pantograph, contact.section] = force
        for p, s, crossing, point, *_ in candidates:
            self.linear.place(crossing, point, state.motion, result.point[p, s])
        put_in_lap(self._line.wires, result.point, motion.strip)
        return result


def _strip_compliance(contacts: Sequence[ContactCandidate], motion: StripMotion) -> FloatArray:
    """Return how far strips give way to the contacts' forces [m/N]; two contacts of one strip share its retreat."""
    if len(contacts) == 1:
        return motion.compliance[contacts[0].pantograph].reshape(1, 1)
    owners = [c.pantograph for c in contacts]
    return np.array([[motion.compliance[i] if i == j else 0.0 for j in owners] for i in owners]).reshape(
        len(owners), len(owners)
    )


def _note(state: CatenaryState, contacts: Sequence[ContactCandidate], forces: LocalForces) -> None:
    """Record the forces at the end of the step; the next one begins with them."""
    state.slack, state.compensation = forces.slack, forces.compensation
    state.impact_velocity[...] = 0.0
    for contact, velocity, closed in zip(contacts, forces.velocity, forces.closed, strict=True):
        if closed:
            impact = contact.impact_velocity or max(velocity, 1e-6)
            state.impact_velocity[contact.pantograph, contact.section] = impact
    state.loaded, state.load = _NOWHERE, _NOTHING
    if contacts:
        places = [c.crossing for c in contacts]
        state.loaded = np.array([(c.section, place.element) for c, place in zip(contacts, places, strict=True)])
        state.load = np.array([(place.xi, f) for place, f in zip(places, forces.contact, strict=True)])
