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
        strip_compliance : ndarray, shape (n_pantographs,)
            Retreat of a strip per force on it within the step [m/N]; zero for prescribed strips.
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
            found = self._single_contact(free_force, contacts[0], strip_compliance.item(contacts[0].pantograph))
            if found is not None:
                return found
        n = len(contacts)
        effects, forces = _Effects(self, contacts, strip_compliance, slack), np.zeros(n + slack.size)
        for _ in range(_MAX_ITERATIONS):
            before, forces = forces, effects.newton_step(free_force, forces)
            now_slack = (free_force + effects.pulled.dot(forces) < 0.0).nonzero()[0]
            if now_slack.tobytes() != slack.tobytes():
                forces = np.concatenate((forces[:n], _carried(now_slack, slack, forces[n:])))
                slack = now_slack
                effects = _Effects(self, contacts, strip_compliance, slack)
            # Without contacts one iteration is exact for its set.
            elif not n or abs(forces - before).max() <= _TOLERANCE * (1.0 + forces.max()):
                penetration, velocity = effects.at_contacts(forces)
                closed = [delta > 0.0 for delta in penetration]
                return LocalForces(forces[:n].tolist(), velocity, closed, slack, forces[n:])
        raise not_settled(slack.size, n)

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
        columns, pull = point.response.columns, free_force.copy()
        pull[columns.dropper_index] += columns.dropper_force.dot(force * point.load)
        return bool(pull.min(initial=0.0) < 0.0)


class _Effects:
    """What unit forces do: first those of the contacts F, then those that slack droppers lack, f.

    Attributes
    ----------
    moved : ndarray, shape (n_contacts, n_forces)
        Of the penetrations [m/N].
    pulled : ndarray, shape (n_droppers, n_forces)
        Of the droppers' pulls [N/N].
    """

    def __init__(
        self,
        problem: LocalProblem,
        contacts: Sequence[ContactCandidate],
        strip_compliance: FloatArray,
        slack: IntArray,
    ) -> None:
        self._problem, self._contacts, self._slack = problem, contacts, slack
        n, size = len(contacts), len(contacts) + slack.size
        self.moved, self.pulled = np.zeros((n, size)), np.zeros((problem.unilateral.size, size))
        for k, source in enumerate(contacts):
            columns = source.point.response.columns
            self.pulled[columns.dropper_index, k] = columns.dropper_force.dot(source.point.load)
            for i, target in enumerate(contacts):
                self.moved[i, k] = -target.point.moved_by(source.point)
                if target.pantograph == source.pantograph:  # two contacts of one strip share its retreat
                    self.moved[i, k] -= strip_compliance[source.pantograph]
        for k, j in enumerate(slack.tolist(), n):
            column = problem.dropper_columns[j]
            self.pulled[column.dropper_index, k] = -column.dropper_force[:, 0]
            for i, target in enumerate(contacts):
                ends = target.point.response.interval.ends
                self.moved[i, k] = target.point.load.dot(column.at(ends)[:, 0])
        #: Of what the forces follow, the penetrations and the pulls of slack droppers.
        self._felt = np.concatenate((self.moved, self.pulled[slack]))
        self._unilateral, self._one = problem.unilateral[slack], np.eye(size)

    def newton_step(self, free_force: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the forces of the problem linearised at the present ones, for the present set of slack droppers.

        Contacts: F = law + slope (delta(F, f) - delta); droppers of the set: f = -(1 - r) T(F, f).
        """
        if not forces.size:
            return forces
        laws = [self._problem.law_of(*touch) for touch in zip(self._contacts, *self.at_contacts(forces), strict=True)]
        slope = np.array([law.by_penetration + self._problem.velocity_factor * law.by_velocity for law in laws])
        known = np.array([law.force for law in laws]) - slope * self.moved.dot(forces)
        follow = np.concatenate((slope, -self._unilateral))
        right = np.concatenate((known, -self._unilateral * free_force[self._slack]))
        system = self._one - follow[:, None] * self._felt
        _, _, found, failed = dgesv(system, right, overwrite_a=1, overwrite_b=1)
        if failed:
            raise LocalSolutionError("slack and contact forces have no solution: their compliances are singular")
        return found

    def at_contacts(self, forces: FloatArray) -> tuple[list[float], list[float]]:
        """Return the penetrations under given forces [m], and their velocities [m/s]."""
        changes = list(zip(self._contacts, self.moved.dot(forces).tolist(), strict=True))
        velocity = [c.velocity + self._problem.velocity_factor * change for c, change in changes]
        return [c.penetration + change for c, change in changes], velocity


def _carried(now: IntArray, before: IntArray, compensation: FloatArray) -> FloatArray:
    """Return the compensation forces for a changed set, zero for those that are new."""
    known = dict(zip(before.tolist(), compensation.tolist(), strict=True))
    return np.array([known.get(j, 0.0) for j in now.tolist()])
