"""Lumped-mass pantograph: masses on a line, springs and dampers between them [2.12-2.19]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arrays import FloatArray
from models.numerics.newmark import Newmark
from models.pantograph.lumped.following_reference import FollowingReference
from models.pantograph.lumped.lumped_definition import LumpedDefinition


@dataclass
class LumpedState:
    """State of a lumped pantograph, changed in place by a step.

    Attributes
    ----------
    displacement, velocity, acceleration : ndarray, shape (n,)
        Of the masses, bottom to top, from where the springs carry the weights [m, m/s, m/s2].
    reference : float
        Where the lowest spring hangs, above the roof, if that follows the height [m].
    """

    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    reference: float = 0.0


class LumpedModel:
    """Linear equations of a lumped pantograph: M y'' + C y' + K y = f.

    Parameters
    ----------
    definition : LumpedDefinition
    """

    def __init__(self, definition: LumpedDefinition) -> None:
        self.definition = definition
        n = len(definition.stage)
        self._masses = [s.mass for s in definition.stage]
        self.M = np.diag(self._masses)
        self.C = _chain([s.damping for s in definition.stage])
        self.K = _chain([s.stiffness for s in definition.stage])
        self.size = n
        self.follows = bool(definition.follow_height)
        # What holds a strip that starts elsewhere, until it is raised: the spring on the roof would move it.
        self.balance = 0.0 if self.follows else definition.stage[0].stiffness * definition.rise
        self._following: dict[float, FollowingReference] = {}
        self._inverse: dict[float, tuple[Newmark, FloatArray]] = {}
        self._transition: dict[float, FloatArray] = {}

    def initial_state(self, load: FloatArray | None = None) -> LumpedState:
        """Return the pantograph at rest at its start height, its acceleration that of ``load``, shape (n,) [N]."""
        displacement = np.full(self.size, self.definition.rise)
        pull = self.K @ displacement
        reference = self.definition.rise if self.follows else 0.0
        pull[0] -= self.definition.stage[0].stiffness * reference
        load = np.zeros(self.size) if load is None else load - pull
        return LumpedState(displacement, np.zeros(self.size), load / np.diag(self.M), reference)

    def following(self, step: float) -> FollowingReference:
        """Return how the reference moves in a step [s], if it follows."""
        found = self._following.get(step)
        if found is None:
            found = FollowingReference.within(step, self.definition.reference_time)
            self._following[step] = found
        return found

    def stiffness_within(self, step: float) -> FloatArray:
        """Return K of a step [s]: the part of the lowest spring that does not follow within it."""
        if not self.follows:
            return self.K
        K = self.K.copy()
        K[0, 0] -= self.definition.stage[0].stiffness * self.following(step).after
        return K

    def reference_load(self, reference: float, above_roof: float, rate: float, step: float) -> float:
        """Return the load of the reference on the lowest mass in a step [N], 0 if it does not follow.

        Parameters
        ----------
        reference, above_roof : float
            Of the reference and of the lowest mass at the beginning of the step [m].
        rate : float
            Given from outside [m/s].
        step : float
            [s]
        """
        if not self.follows:
            return 0.0
        return self.definition.stage[0].stiffness * self.following(step).known(reference, above_roof, rate)

    def free_response(self, state: LumpedState, step: float, load: FloatArray, rate: float = 0.0) -> FloatArray:
        """Return the displacement at the end of a step under ``load``, shape (n,) [N], held at its end value.

        A reference that follows the height moves at ``rate`` [m/s] besides.
        """
        n, inverse = self._effective(step)
        # Plain floats where it goes mass by mass: the same bits, and for so few masses faster than arrays.
        displacement, velocity, acceleration = state.displacement, state.velocity, state.acceleration
        motion = list(zip(displacement.tolist(), velocity.tolist(), acceleration.tolist(), strict=True))
        inertia = [m * (n.a0 * d + n.a2 * v + n.a3 * a) for m, (d, v, a) in zip(self._masses, motion, strict=True)]
        damping = [n.a1 * d + n.a4 * v + n.a5 * a for d, v, a in motion]
        if self.follows:
            load = load.copy()
            load[0] += self.reference_load(state.reference, float(displacement[0]), rate, step)
        result: FloatArray = inverse.dot(load + inertia + self.C.dot(damping))
        return result

    def compliance(self, step: float) -> FloatArray:
        """Return the displacement within a step per force on the strip, shape (n,) [m/N]."""
        result: FloatArray = self._effective(step)[1][:, -1]
        return result

    def compliances(self, step: float) -> tuple[FloatArray, float]:
        """Return the displacements within a step per force on every mass, shape (n, n) [m/N], and the velocity that
        belongs to a displacement besides [1/s].
        """
        newmark, inverse = self._effective(step)
        return inverse, newmark.a1

    def velocity_of(self, state: LumpedState, step: float, displacement: FloatArray) -> FloatArray:
        """Return the velocity that belongs to a new displacement, shape (n,)."""
        return np.array(self._rates(state, step, displacement)[0])

    def advance(self, state: LumpedState, step: float, displacement: FloatArray, rate: float = 0.0) -> None:
        """Replace the state by the one that belongs to a new displacement; ``rate`` as in `free_response`."""
        velocity, acceleration = self._rates(state, step, displacement)
        if self.follows:
            before, after = float(state.displacement[0]), float(displacement[0])
            state.reference = self.following(step).moved(state.reference, before, after, rate)
        state.displacement = displacement
        state.velocity, state.acceleration = np.array(velocity), np.array(acceleration)

    def transition(self, step: float) -> FloatArray:
        """Return the matrix that leads from the motion before a step and the load at its end to the motion after it.

        The same step as `free_response` and `advance` make, solved for the accelerations: nothing cancels out.

        Returns
        -------
        ndarray, shape (3 n, 4 n)
            Motion mass by mass, bottom to top: displacement, velocity, acceleration; then, in the columns, the load on
            every mass.
        """
        found = self._transition.get(step)
        if found is None:
            found = self._transition[step] = self._new_transition(Newmark(step))
        return found

    def _new_transition(self, newmark: Newmark) -> FloatArray:
        h, gamma, beta = newmark.step, newmark.gamma, newmark.beta
        known = np.eye(4 * self.size)
        motion, load = known[: 3 * self.size], known[3 * self.size :]
        velocity = motion[1::3] + (1.0 - gamma) * h * motion[2::3]
        displacement = motion[0::3] + h * motion[1::3] + (0.5 - beta) * h**2 * motion[2::3]
        K = self.stiffness_within(h)
        inertia = self.M + gamma * h * self.C + beta * h**2 * K
        acceleration = np.linalg.solve(inertia, load - self.C @ velocity - K @ displacement)
        result = np.empty((3 * self.size, 4 * self.size))
        result[0::3] = displacement + beta * h**2 * acceleration
        result[1::3] = velocity + gamma * h * acceleration
        result[2::3] = acceleration
        return result

    def load(self, time: float, base: FloatArray) -> FloatArray:
        """Return uplift and roof motion as loads, shape (n,) [N].

        Parameters
        ----------
        base : ndarray, shape (2,)
            Height [m] and velocity [m/s] of the roof, 0 at rest.
        """
        result = np.zeros(self.size)
        lowest, (height, velocity) = self.definition.stage[0], base.tolist()
        uplift = self.balance + (self.definition.static_force - self.balance) * self.definition.raised(time)
        result[0] = uplift + (lowest.stiffness * height + lowest.damping * velocity)
        return result

    def _rates(self, state: LumpedState, step: float, displacement: FloatArray) -> tuple[list[float], list[float]]:
        """Return velocity and acceleration of every mass that belong to a new displacement."""
        n = self._effective(step)[0]
        change = displacement - state.displacement
        motion = list(zip(change.tolist(), state.velocity.tolist(), state.acceleration.tolist(), strict=True))
        velocity = [n.a1 * c - n.a4 * v - n.a5 * a for c, v, a in motion]
        acceleration = [n.a0 * c - n.a2 * v - n.a3 * a for c, v, a in motion]
        return velocity, acceleration

    def _effective(self, step: float) -> tuple[Newmark, FloatArray]:
        if step not in self._inverse:
            newmark = Newmark(step)
            inverse = np.linalg.inv(self.stiffness_within(step) + newmark.a0 * self.M + newmark.a1 * self.C)
            self._inverse[step] = newmark, np.asarray(inverse, dtype=np.float64)
        return self._inverse[step]


def _chain(values: list[float]) -> FloatArray:
    """Return the matrix of a chain of springs or dampers, the first to ground."""
    matrix = np.diag(values)
    for i in range(1, len(values)):
        matrix[i - 1, i - 1] += values[i]
        matrix[i - 1, i] = matrix[i, i - 1] = -values[i]
    return matrix
