"""Slack droppers and contacts: the few unknowns of a step that are not linear.

The response of the line to dropper and contact forces is linear, so a step is one free solution of the whole line and
then a small problem in the forces alone [1]_: with T what droppers would pull if they could push as well, f what a
slack one must add to that, delta the penetrations and F the contact forces,

    T = T_free - A_dd f + A_dc F,          f = max(0, -(1 - r) T),
    delta = delta_free - A_cc F + A_cd f,  F = law(delta, delta'),

with r the droppers' stiffness ratio in compression, and T as `dropper_law` has it.

It is solved by Newton's method on these max-functions: each iteration is exact for its set of slack droppers and
closed contacts, so it ends when the set repeats.

References
----------
.. [1] P. Antunes, Co-simulation methods for multidisciplinary problems in railway dynamics (2012), equation 2.11
   and figure 2.12, whose fixed-point iteration converges to the same solution.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgesv

from models.arrays import FloatArray, IntArray
from models.catenary.contact_and_slack.crossing import Crossing
from models.catenary.contact_and_slack.wire_response import WirePoint
from models.catenary.linear_motion.compliance import Columns
from models.contact_law import ContactLaw, ContactParameters, NormalForce

_MAX_ITERATIONS = 60
#: Relative change of the contact forces at which a nonlinear contact law counts as solved.
_TOLERANCE = 1e-10


class LocalSolutionError(RuntimeError):
    """Slack and contact forces of a step were not found."""


def not_settled(slack: int, contacts: int) -> LocalSolutionError:
    """Return what is raised when the iteration does not end, with that many slack droppers and contacts."""
    return LocalSolutionError(
        f"slack and contact forces have not settled after {_MAX_ITERATIONS} iterations "
        f"({slack} slack droppers, {contacts} contacts); use a smaller time step"
    )


class ContactCandidate(NamedTuple):
    """A strip over a wire before the contact force acts.

    Attributes
    ----------
    pantograph, section : int
    crossing : Crossing
        Where it lies in plan.
    point : WirePoint
        Of the wire, there.
    penetration, velocity : float
        At the end of the step without contact force [m, m/s].
    impact_velocity : float
        delta'(-) of a contact that is closed already; 0 otherwise.
    """

    pantograph: int
    section: int
    crossing: Crossing
    point: WirePoint
    penetration: float
    velocity: float
    impact_velocity: float


class LocalForces(NamedTuple):
    """Solution of the local problem.

    Attributes
    ----------
    contact : list of float
        Contact forces [N].
    velocity : list of float
        delta' at the end of the step [m/s].
    closed : list of bool
        Whether there is penetration.
    slack : ndarray, shape (n_slack,)
        Indices of slack droppers.
    compensation : ndarray, shape (n_slack,)
        Their forces f [N].
    """

    contact: list[float]
    velocity: list[float]
    closed: list[bool]
    slack: IntArray
    compensation: FloatArray


#: No droppers.
_NONE, _NOTHING = np.zeros(0, dtype=np.int64), np.zeros(0)


@dataclass(frozen=True)
class LocalProblem:
    """The parts of the local problem that do not change from step to step.

    Attributes
    ----------
    unilateral : ndarray, shape (n_droppers,)
        1 - r, with r a dropper's stiffness ratio in compression.
    dropper_columns : sequence of Columns
        Response of the line to a unit force in each dropper.
    velocity_factor : float
        d(velocity)/d(displacement) of the time integration, a1 [1/s].
    """

    unilateral: FloatArray
    dropper_columns: Sequence[Columns]
    velocity_factor: float
    law: ContactLaw
    parameters: ContactParameters

    def solve(
        self,
        free_force: FloatArray,
        contacts: Sequence[ContactCandidate],
        strip_compliance: FloatArray,
        slack: IntArray,
    ) -> LocalForces:
        """Find slack and contact forces of a step.

        Parameters
        ----------
        free_force : ndarray, shape (n_droppers,)
            Pulls T of the droppers in the free solution [N].
        contacts : sequence of ContactCandidate
        strip_compliance : ndarray, shape (n_contacts, n_contacts)
            Retreat of the strips per contact force within the step [m/N]; zero for prescribed strips.
        slack : ndarray of int
            Droppers that were slack at the last step, as a start.

        Raises
        ------
        LocalSolutionError
            If the iteration does not end.
        """
        if not contacts and not slack.size and free_force.min(initial=0.0) >= 0.0:
            return LocalForces([], [], [], _NONE, _NOTHING)
        if len(contacts) == 1 and not slack.size:
            found = self._single_contact(free_force, contacts[0], float(strip_compliance[0, 0]))
            if found is not None:
                return found
        coupling = _Coupling(self, contacts, strip_compliance)
        forces = np.array([_estimate(self, c) for c in contacts])
        compensation = np.zeros(slack.size)
        # Without contacts one iteration is exact for its set, and the set to begin with may well be the one.
        previous = None if contacts else (slack.tobytes(), b"")
        for _ in range(_MAX_ITERATIONS):
            laws = coupling.laws(forces, slack, compensation)
            new_forces, compensation = coupling.newton_step(free_force, laws, forces, slack, compensation)
            change = np.abs(new_forces - forces).max(initial=0.0)
            forces = new_forces
            pull = coupling.dropper_force(free_force, forces, slack, compensation)
            penetration, velocity = coupling.penetration(forces, slack, compensation)
            now_slack = np.flatnonzero(pull < 0.0)
            signature = (now_slack.tobytes(), (penetration > 0.0).tobytes())
            settled = change <= _TOLERANCE * (1.0 + forces.max(initial=0.0))
            same = np.array_equal(now_slack, slack)
            if settled and signature == previous and same:
                closed = (penetration > 0.0).tolist()
                return LocalForces(forces.tolist(), velocity.tolist(), closed, slack, compensation)
            previous = signature
            if not same:
                compensation = _carried(now_slack, slack, compensation)
                slack = now_slack
        raise not_settled(slack.size, len(contacts))

    def law_of(self, contact: ContactCandidate, penetration: float, velocity: float) -> NormalForce:
        """Return the contact law of one contact; its first closed instant is its impact."""
        impact = contact.impact_velocity or max(velocity, 0.0)
        return self.law(penetration, velocity, impact, self.parameters).scaled(contact.crossing.engagement)

    def _single_contact(
        self, free_force: FloatArray, contact: ContactCandidate, strip_compliance: float
    ) -> LocalForces | None:
        """Return the solution for one contact if it leaves no dropper slack, as in most steps."""
        point, slope_of_velocity = contact.point, self.velocity_factor
        compliance = strip_compliance + point.compliance
        force = 0.0
        for _ in range(_MAX_ITERATIONS):
            penetration = contact.penetration - compliance * force
            velocity = contact.velocity - slope_of_velocity * compliance * force
            law = self.law_of(contact, penetration, velocity)
            slope = compliance * (law.by_penetration + slope_of_velocity * law.by_velocity)
            before, force = force, (law.force + slope * force) / (1.0 + slope)
            if abs(force - before) <= _TOLERANCE * (1.0 + force):
                break
        else:
            return None
        if self._slackens(free_force, point, force):
            return None
        return LocalForces([force], [velocity], [penetration > 0.0], _NONE, _NOTHING)

    def _slackens(self, free_force: FloatArray, point: WirePoint, force: float) -> bool:
        """Return whether any dropper is slack under a force on one point."""
        columns = point.response.columns
        change = columns.dropper_force.dot(force * point.load)
        near = free_force.take(columns.dropper_index) + change
        if near.min(initial=0.0) < 0.0:
            return True
        if free_force.min(initial=0.0) >= 0.0:
            return False
        pull = free_force.copy()  # one that would be slack without the force may be near
        pull[columns.dropper_index] = near
        return bool(pull.min() < 0.0)


class _Coupling:
    """Compliances between the contacts and the droppers of one step."""

    def __init__(
        self, problem: LocalProblem, contacts: Sequence[ContactCandidate], strip_compliance: FloatArray
    ) -> None:
        self.problem, self.contacts = problem, contacts
        self._penetration = np.array([c.penetration for c in contacts])
        self._velocity = np.array([c.velocity for c in contacts])
        self._slack: IntArray | None = None
        n = len(contacts)
        self.contact_contact = strip_compliance.copy()
        self.dropper_contact = np.zeros((problem.unilateral.size, n))
        for j, source in enumerate(contacts):
            point = source.point
            columns = point.response.columns
            self.dropper_contact[columns.dropper_index, j] = columns.dropper_force @ point.load
            for i, target in enumerate(contacts):
                self.contact_contact[i, j] += target.point.moved_by(point)

    def by_slack(self, slack: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return what forces of slack droppers do to the pulls of all droppers and to the penetrations.

        Returns
        -------
        d(-T)/df : ndarray, shape (n_droppers, n_slack)
        d(delta)/df : ndarray, shape (n_contacts, n_slack)
        """
        if slack is not self._slack:  # the set rarely changes
            self._slack = slack
            on_droppers = np.zeros((self.problem.unilateral.size, slack.size))
            on_contacts = np.zeros((len(self.contacts), slack.size))
            self._by_slack = on_droppers, on_contacts
            for k, j in enumerate(slack.tolist()):
                column = self.problem.dropper_columns[j]
                on_droppers[column.dropper_index, k] = column.dropper_force[:, 0]
                for i, contact in enumerate(self.contacts):
                    point = contact.point
                    on_contacts[i, k] = point.load.dot(column.at(point.response.interval.ends)[:, 0])
        return self._by_slack

    def penetration(
        self, forces: FloatArray, slack: IntArray, compensation: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return penetrations and their velocities under given forces."""
        change = self.by_slack(slack)[1] @ compensation - self.contact_contact @ forces
        return self._penetration + change, self._velocity + self.problem.velocity_factor * change

    def dropper_force(
        self, free: FloatArray, forces: FloatArray, slack: IntArray, compensation: FloatArray
    ) -> FloatArray:
        """Return the droppers' pulls under given forces."""
        return free + self.dropper_contact @ forces - self.by_slack(slack)[0] @ compensation

    def laws(self, forces: FloatArray, slack: IntArray, compensation: FloatArray) -> list[NormalForce]:
        """Return the contact law and its slopes at the present penetrations."""
        penetration, velocity = self.penetration(forces, slack, compensation)
        return [
            self.problem.law_of(c, float(d), float(v))
            for d, v, c in zip(penetration, velocity, self.contacts, strict=True)
        ]

    def newton_step(
        self,
        free: FloatArray,
        laws: Sequence[NormalForce],
        forces: FloatArray,
        slack: IntArray,
        compensation: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Solve the problem linearised at the present forces, for the present set of slack droppers.

        Contacts: F - slope (delta(F, f) - delta) = law; droppers of the set: f + (1 - r) T(F, f) = 0.
        """
        n, m = len(forces), slack.size
        system = np.eye(n + m)
        right = np.zeros(n + m)
        slope = np.array([a.by_penetration + self.problem.velocity_factor * a.by_velocity for a in laws])
        if n:
            by_contact, by_slack = -self.contact_contact, self.by_slack(slack)[1]
            system[:n, :n] -= slope[:, None] * by_contact
            system[:n, n:] -= slope[:, None] * by_slack
            value = np.array([a.force for a in laws])
            right[:n] = value - slope * (by_contact @ forces + by_slack @ compensation)
        if m:
            share = self.problem.unilateral[slack]
            system[n:, :n] += share[:, None] * self.dropper_contact[slack]
            system[n:, n:] -= share[:, None] * self.by_slack(slack)[0][slack]
            right[n:] = -share * free[slack]
        if n + m:
            _, _, right, failed = dgesv(system, right, overwrite_a=1, overwrite_b=1)
            if failed:
                raise LocalSolutionError("slack and contact forces have no solution: their compliances are singular")
        return right[:n], right[n:]


def _estimate(problem: LocalProblem, contact: ContactCandidate) -> float:
    """Return a first guess of a contact force: the law's secant over the free penetration."""
    law = problem.law_of(contact, contact.penetration, contact.velocity)
    return law.force / (1.0 + law.by_penetration * contact.point.compliance)


def _carried(now: IntArray, before: IntArray, compensation: FloatArray) -> FloatArray:
    """Return the compensation forces for a changed set, zero for those that are new."""
    known = dict(zip(before.tolist(), compensation.tolist(), strict=True))
    return np.array([known.get(j, 0.0) for j in now.tolist()])
