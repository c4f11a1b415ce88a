"""A mechanism's equations of motion in Cartesian coordinates and Euler parameters [2.35].

[[M, Phi_q^T], [Phi_q, 0]] [q''; lambda] = [g; gamma - 2 a Phi' - b^2 Phi]

M is block diagonal, so the multipliers come from (Phi_q M^-1 Phi_q^T) lambda = Phi_q M^-1 g - rhs: the same solution
with a matrix of the size of the constraints alone. Bodies of prescribed motion enter with M^-1 = 0.

The file is longer than others because one evaluation of the equations reads from top to bottom here.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from models.arrays import FloatArray
from models.pantograph.multibody.base_motion import Sway
from models.pantograph.multibody.elements.base_frame import BaseFrame, Carried
from models.pantograph.multibody.elements.force_elements import ForceElements, gravity_loads
from models.pantograph.multibody.elements.joints import JOINT_ROWS, Constraints, ConstraintValues, GapRow, Pair, Row
from models.pantograph.multibody.elements.moving_vectors import Kinematics, MovingVectors, VectorPool
from models.pantograph.multibody.elements.rotations import (
    euler_parameters,
    euler_rates,
    rotation_matrices,
    skew,
    turned,
)
from models.pantograph.multibody.mechanism_definition import MechanismDefinition, PairJoint

#: Baumgarte's a and b [1/s] [2.35]: critically damped, slow against the step and fast against the motion.
BAUMGARTE: Final = 50.0


_NO_RESPONSE: Final = np.zeros((0, 6, 4))


class MechanismError(ValueError):
    """A mechanism that cannot be put together, moved or balanced; says what and by how much."""


class Inputs(NamedTuple):
    """What acts from outside at one instant.

    Attributes
    ----------
    base : tuple of float
        Vertical displacement, velocity and acceleration of the base [m, m/s, m/s2].
    lift : float
        What is set of the lifting element [N, N.m, or 1 for a table of a cam].
    force : float
        Contact force, positive pushes the strip down [N].
    lateral : float
        y of its point of application [m].
    uplift : float
        Force that the lifting element brings to the strip besides [N].
    sway : Sway or None
        How the base moves besides; None: not at all.
    pull : float
        Acceleration of the base along the track [m/s2].
    against : float
        Speed against the air [m/s].
    driven_lift : float or None
        What the lifting element gives [N or N.m], if it is set directly: `lift` and `uplift` then do nothing.
    """

    base: tuple[float, float, float] = (0.0, 0.0, 0.0)
    lift: float = 0.0
    force: float = 0.0
    lateral: float = 0.0
    uplift: float = 0.0
    sway: Sway | None = None
    pull: float = 0.0
    against: float = 0.0
    driven_lift: float | None = None


#: Nothing acts.
NO_INPUTS: Final = Inputs()


class State(NamedTuple):
    """Views of a flat state: positions, Euler parameters, velocities, body-fixed angular velocities."""

    r: FloatArray
    p: FloatArray
    v: FloatArray
    w: FloatArray


class Placed(NamedTuple):
    """What follows from a state alone, whatever acts.

    Attributes
    ----------
    kinematics : Kinematics
    vectors : MovingVectors
    roots : ndarray, shape (n, 6, 6)
        See `Mechanism.roots`.
    constraints : ConstraintValues
    scaled : ndarray, shape (m, 6 n)
        Phi_q with respect to scaled body coordinates.
    """

    kinematics: Kinematics
    vectors: MovingVectors
    roots: FloatArray
    constraints: ConstraintValues
    scaled: FloatArray


class Evaluation(NamedTuple):
    """The equations of motion at one instant.

    Attributes
    ----------
    rates : ndarray, shape (13 n,)
        Time derivative of the state.
    acceleration : ndarray, shape (n, 6)
        Of the centres of mass and of the body-fixed angular velocities [m/s2, rad/s2].
    multipliers : ndarray, shape (m,)
        lambda: -Phi_q^T lambda are the joints' loads on the bodies.
    constraints : ConstraintValues
    response : ndarray, shape (n, 6, 4)
        Change of ``acceleration`` per vertical force, moment about x, moment about y on the strip's body and
        acceleration of the base; empty unless asked for.
    """

    rates: FloatArray
    acceleration: FloatArray
    multipliers: FloatArray
    constraints: ConstraintValues
    response: FloatArray


class Mechanism:
    """Bodies, joints and forces compiled to arrays. It has no state: that is passed in and returned.

    A state is a flat array of 13 n numbers, n bodies: all positions, all Euler parameters, all velocities, all
    body-fixed angular velocities. It is seen from a frame that moves along the track with the base.

    Parameters
    ----------
    definition : MechanismDefinition

    Attributes
    ----------
    names : list of str
        Bodies in the order of the arrays: those of prescribed motion come first.
    rows : list of Row
    joint_of_row : list of PairJoint
    """

    def __init__(self, definition: MechanismDefinition) -> None:
        self.definition = definition
        driven = definition.driven
        bodies = sorted(definition.bodies, key=lambda b: b.name not in driven)
        self.names = [b.name for b in bodies]
        self.numbers = {name: k for k, name in enumerate(self.names)}
        self.count = len(bodies)
        self.driven = len(driven)
        self.mass = np.array([b.mass for b in bodies])
        self.inertia = np.array([b.inertia for b in bodies])
        self._written = np.array([b.position for b in bodies])
        self._written_p = euler_parameters(np.array([b.euler for b in bodies]))
        self._compile_masses()
        self._compile_base()
        A = rotation_matrices(self._written_p)
        self.pool = VectorPool()
        self._list_rows(A)
        self.constraints = Constraints(self.rows, self.count, self.pool)
        self.forces = ForceElements(definition.forces, definition.joints, self.numbers, A, self.pool)
        self.pool.close()
        self.constraints.compile(self.pool)
        self.forces.compile(self.pool)
        strip = definition.strip
        self.strip_body = self.numbers[strip.body] if strip is not None else -1
        self.strip_point = np.array([0.0, definition.strip_offset, strip.height if strip is not None else 0.0])
        self._strip_halves = np.array([[0.0, 0.5, 0.0], [0.0, -0.5, 0.0]]) * definition.strip_length

    def _list_rows(self, A: FloatArray) -> None:
        self.rows: list[Row] = []
        self.joint_of_row: list[PairJoint] = []
        for joint in (j for j in self.definition.joints if isinstance(j, PairJoint)):
            i, j = self.numbers[joint.body_i], self.numbers[joint.body_j]
            try:
                rows = JOINT_ROWS[type(joint)](joint, Pair(i, j, A[i], A[j]))
            except ValueError as error:
                raise MechanismError(f"joint '{joint.name}' ({joint.kind}): {error}") from error
            self.rows += rows
            self.joint_of_row += [joint] * len(rows)
        self.is_gap = np.array([isinstance(r, GapRow) for r in self.rows], dtype=bool)

    def _compile_masses(self) -> None:
        free = np.arange(self.count) >= self.driven
        self._root_mass = np.where(free, 1.0 / np.sqrt(self.mass), 0.0)[:, None]
        self._root_inertia = np.where(free[:, None], 1.0 / np.sqrt(self.inertia), 0.0)
        self._root_both = np.concatenate([np.repeat(self._root_mass, 3, axis=1), self._root_inertia], axis=1)
        self._weights = gravity_loads(self.mass, self.definition.gravity)

    def _compile_base(self) -> None:
        """Note where the bodies of prescribed motion are in a state, and what stands there at rest."""
        marks = self.split(np.arange(13.0 * self.count))
        driven = [part[: self.driven] for part in marks]
        self._base_places = np.concatenate([part.ravel() for part in driven]).astype(np.int64)
        d = self.driven
        rest = (self._written[:d], self._written_p[:d], np.zeros((d, 3)), np.zeros((d, 3)))
        self._base_rest = np.concatenate([part.ravel() for part in rest])
        self._base_z = np.arange(d) * 3 + 2
        self._base_vz = 7 * d + self._base_z

    def body_table(self) -> FloatArray:
        """Return roots of inverse mass and inertia, inertia, mass and weight of every body, shape (n, 9)."""
        columns = (self._root_mass, self._root_inertia, self.inertia, self.mass, self._weights[:, 2])
        return np.column_stack(columns)

    def base_table(self) -> FloatArray:
        """Return positions and Euler parameters of the bodies of prescribed motion at rest, shape (d, 7)."""
        return np.concatenate([self._written, self._written_p], axis=1)[: self.driven]

    def written_state(self) -> FloatArray:
        """Return the state of the definition: bodies where it says, at rest."""
        return self.join(self._written, self._written_p)

    def join(
        self, r: FloatArray, p: FloatArray, v: FloatArray | None = None, w: FloatArray | None = None
    ) -> FloatArray:
        """Make a flat state, at rest unless velocities are given."""
        rest = np.zeros((self.count, 3))
        parts = (r, p, rest if v is None else v, rest if w is None else w)
        return np.concatenate([np.asarray(x, dtype=np.float64).ravel() for x in parts])

    def split(self, y: FloatArray) -> State:
        """Return views of a flat state."""
        n = self.count
        return State(
            y[: 3 * n].reshape(n, 3),
            y[3 * n : 7 * n].reshape(n, 4),
            y[7 * n : 10 * n].reshape(n, 3),
            y[10 * n :].reshape(n, 3),
        )

    def place_base(self, y: FloatArray, inputs: Inputs) -> None:
        """Put the bodies of prescribed motion where they belong, in place."""
        base, carried = inputs.base, self._carried(inputs)
        if carried is not None:
            y[self._base_places] = np.concatenate([part.ravel() for part in carried[:4]])
            return
        values = self._base_rest.copy()
        values[self._base_z] += base[0]
        values[self._base_vz] = base[1]
        y[self._base_places] = values

    def _carried(self, inputs: Inputs) -> Carried | None:
        """Return the bodies of prescribed motion on a base that sways, None if it does not."""
        if inputs.sway is None:
            return None
        d = self.driven
        return BaseFrame.of(inputs.base, inputs.sway).carry(self._written[:d], self._written_p[:d])

    def standing_on(self, y: FloatArray, inputs: Inputs) -> FloatArray:
        """Return a state at rest on a base at rest as it is at rest on a base that moves, shape (13 n,)."""
        s = self.split(y)
        if inputs.sway is not None:
            return self.join(*BaseFrame.of(inputs.base, inputs.sway).carry(s.r, s.p)[:4])
        moved = y.copy()
        s = self.split(moved)
        s.r[:, 2] += inputs.base[0]
        s.v[:, 2] += inputs.base[1]
        return moved

    def kinematics(self, y: FloatArray, inputs: Inputs = NO_INPUTS) -> Kinematics:
        """Return frames and origins of all bodies, with the acceleration of the base that the inputs say."""
        n, d = self.count, self.driven
        spin = skew(y[10 * n :].reshape(n, 3))
        frames = np.empty((n, 9, 3))
        A, first = frames[:, :3], frames[:, 3:6]
        A[...] = rotation_matrices(y[3 * n : 7 * n].reshape(n, 4))
        np.matmul(A, spin, out=first)
        np.matmul(first, spin, out=frames[:, 6:])
        origins = np.zeros((n, 9))
        origins[:, :3] = y[: 3 * n].reshape(n, 3)
        origins[:, 3:6] = y[7 * n : 10 * n].reshape(n, 3)
        origins[:d, 8] = inputs.base[2]
        carried = self._carried(inputs)
        if carried is not None:
            origins[:d, 6:] = carried.acceleration
            frames[:d, 6:] += A[:d] @ skew(carried.turning)
        return Kinematics(frames, origins, spin)

    def roots(self, frames: FloatArray) -> FloatArray:
        """Return W with W W^T = M^-1, shape (n, 6, 6), from scaled body coordinates to global ones."""
        W = np.zeros((self.count, 6, 6))
        W[:, 0, 0] = W[:, 1, 1] = W[:, 2, 2] = self._root_mass[:, 0]
        W[:, 3:, 3:] = frames[:, :3] * self._root_inertia[:, None, :]
        return W

    def contact_load(self, y: FloatArray, inputs: Inputs, frame: FloatArray | None = None) -> FloatArray:
        """Return the load of the contact on the strip's body, shape (6,).

        The force is vertical and acts on the strip's line where it has the given lateral position; along the track
        the strip itself says where it is.

        Parameters
        ----------
        y : ndarray, shape (13 n,)
        inputs : Inputs
        frame : ndarray, shape (3, 3), optional
            Rotation matrix of the strip's body, if it is known.
        """
        A = self._strip_frame(y)[:3] if frame is None else frame
        centre = A @ self.strip_point
        along = (inputs.lateral - y[3 * self.strip_body + 1] - centre[1]) / A[1, 1]
        x, side, _ = (centre + along * A[:, 1]).tolist()
        return np.array([0.0, 0.0, -inputs.force, -side * inputs.force, x * inputs.force, 0.0])

    def _strip_frame(self, y: FloatArray) -> FloatArray:
        """Return A and A w~ of the strip's body, shape (6, 3)."""
        n, k = self.count, self.strip_body
        A = rotation_matrices(y[3 * n + 4 * k : 3 * n + 4 * k + 4][None, :])[0]
        return np.concatenate([A, A @ skew(y[10 * n + 3 * k : 10 * n + 3 * k + 3][None, :])[0]])

    def loads(
        self,
        y: FloatArray,
        kinematics: Kinematics,
        inputs: Inputs,
        vectors: MovingVectors | None = None,
        *,
        lifted: bool = True,
    ) -> FloatArray:
        """Return all applied loads on the bodies, shape (n, 6), without gyroscopic moments; the lift's if wanted."""
        if vectors is None:
            vectors = self.pool.evaluate(kinematics)
        w = y[10 * self.count :].reshape(-1, 3)
        lift = self._lift_value(kinematics, inputs) if lifted else 0.0
        loads = self.forces.loads(kinematics, vectors, w, lift)
        loads += self._weights
        self.add_travel_loads(loads, kinematics, inputs)
        if inputs.force != 0.0:
            frame = kinematics.frames[self.strip_body, :3]
            loads[self.strip_body] += self.contact_load(y, inputs, frame)
        return loads

    def add_travel_loads(self, loads: FloatArray, kinematics: Kinematics, inputs: Inputs) -> None:
        """Add to loads, shape (n, 6), what the train's speed makes: forces of the air, and of its acceleration."""
        if inputs.against != 0.0 and self.forces.air.count:
            self.forces.air.add_loads(loads, kinematics.frames, inputs.against)
        if inputs.pull != 0.0:
            loads[self.driven :, 0] -= inputs.pull * self.mass[self.driven :]

    def lift_value(self, y: FloatArray, inputs: Inputs) -> float:
        """Return the force or moment of the lifting element [N or N.m] for what is set of it."""
        if inputs.driven_lift is None and self.forces.cam is None and inputs.uplift == 0.0:
            return inputs.lift
        return self._lift_value(self.kinematics(y), inputs)

    def _lift_value(self, kinematics: Kinematics, inputs: Inputs) -> float:
        if inputs.driven_lift is not None:
            return inputs.driven_lift
        return self.forces.lift_value(kinematics, inputs.lift, inputs.uplift)

    def held_force(self, y: FloatArray, inputs: Inputs) -> float:
        """Return the force on the strip that the cam holds, or would for a lift that is set directly [N]."""
        if inputs.driven_lift is None or self.forces.cam is None or self.forces.lift_place is None:
            return inputs.lift
        return self.forces.cam.lift_of(self.forces.lift_place.at(self.kinematics(y)), inputs.driven_lift)

    def constraint_values(self, kinematics: Kinematics) -> ConstraintValues:
        """Return all constraints."""
        return self.constraints.evaluate(self.pool.evaluate(kinematics))

    def evaluate(self, y: FloatArray, inputs: Inputs, *, respond: bool = False) -> Evaluation:
        """Return accelerations, multipliers and constraint values.

        Parameters
        ----------
        y : ndarray, shape (13 n,)
            State; the bodies of prescribed motion are put in place in it.
        inputs : Inputs
        respond : bool
            Whether to work out the response to other inputs, too.

        Raises
        ------
        numpy.linalg.LinAlgError
            If the constraints depend on each other.
        """
        self.place_base(y, inputs)
        kinematics = self.kinematics(y, inputs)
        vectors = self.pool.evaluate(kinematics)
        values = self.constraints.evaluate(vectors)
        W = self.roots(kinematics.frames)
        loads = self._scaled_loads(y, kinematics, inputs, vectors, W)
        jacobian = self._scaled(values.jacobian, W)
        stabilised = values.gamma - (2.0 * BAUMGARTE) * values.rate - BAUMGARTE**2 * values.violation
        right: FloatArray = jacobian @ loads - stabilised
        schur = jacobian @ jacobian.T
        if respond:
            units = self._unit_loads(W)
            per_base = values.jacobian[:, : self.driven, 2].sum(axis=1, keepdims=True)
            right = np.concatenate([right[:, None], jacobian @ units, per_base], axis=1)
            solved = np.linalg.solve(schur, right).view(np.float64)
            multipliers = solved[:, 0]
            response = self._response(units, jacobian.T @ solved[:, 1:])
        else:
            multipliers, response = np.linalg.solve(schur, right).view(np.float64), _NO_RESPONSE
        acceleration = (loads - multipliers @ jacobian).reshape(self.count, 6) * self._root_both
        acceleration[: self.driven, 2] = inputs.base[2]
        carried = self._carried(inputs)
        if carried is not None:
            acceleration[: self.driven] = np.concatenate([carried.acceleration, carried.turning], axis=1)
        return Evaluation(self._rates(y, acceleration), acceleration, multipliers, values, response)

    def _scaled_loads(
        self, y: FloatArray, kinematics: Kinematics, inputs: Inputs, vectors: MovingVectors, W: FloatArray
    ) -> FloatArray:
        """Return all applied loads less the gyroscopic moments in scaled coordinates, shape (6 n,)."""
        w = y[10 * self.count :].reshape(-1, 3)
        loads = (self.loads(y, kinematics, inputs, vectors)[:, None, :] @ W)[:, 0, :]
        loads[:, 3:] -= self._root_inertia * (kinematics.spin @ (self.inertia * w)[:, :, None])[:, :, 0]
        return loads.ravel()

    def position_rates(self, y: FloatArray) -> FloatArray:
        """Return the time derivatives of positions and Euler parameters, shape (7 n,)."""
        n = self.count
        turning = euler_rates(y[3 * n : 7 * n].reshape(n, 4), y[10 * n :].reshape(n, 3))
        return np.concatenate([y[7 * n : 10 * n], turning.ravel()])

    def _rates(self, y: FloatArray, acceleration: FloatArray) -> FloatArray:
        n = self.count
        rates = np.empty(13 * n)
        rates[: 7 * n] = self.position_rates(y)
        rates[7 * n :].reshape(2, n, 3)[...] = acceleration.reshape(n, 2, 3).transpose(1, 0, 2)
        return rates

    def _unit_loads(self, W: FloatArray) -> FloatArray:
        """Return unit vertical force, moment about x and about y on the strip's body, scaled, shape (6 n, 3)."""
        units = np.zeros((self.count, 6, 3))
        if self.strip_body >= 0:
            units[self.strip_body] = W[self.strip_body, 2:5].T
        return units.reshape(-1, 3)

    def _response(self, units: FloatArray, joints: FloatArray) -> FloatArray:
        response = -joints
        response[:, :3] += units
        response = response.reshape(self.count, 6, 4) * self._root_both[:, :, None]
        response[: self.driven, 2, 3] = 1.0
        return response

    def with_inputs(
        self, y: FloatArray, acceleration: FloatArray, response: FloatArray, old: Inputs, new: Inputs
    ) -> tuple[FloatArray, FloatArray]:
        """Return the rates of a state under another contact or base acceleration, without solving again.

        Accelerations are linear in them. Base height and velocity and the lift must be as they were.

        Parameters
        ----------
        y : ndarray, shape (13 n,)
        acceleration, response : ndarray, shape (n, 6), (n, 6, 4)
            Of the evaluation with the old inputs.
        old, new : Inputs

        Returns
        -------
        rates, change : ndarray, shape (13 n,)
            The rates, and by how much they differ from those under the old inputs.
        """
        frame = self._strip_frame(y)[:3]
        change = np.zeros(4)
        change[:3] = (self.contact_load(y, new, frame) - self.contact_load(y, old, frame))[2:5]
        change[3] = new.base[2] - old.base[2]
        difference = np.zeros(13 * self.count)
        shifted = (response @ change).reshape(self.count, 2, 3).transpose(1, 0, 2)
        difference[7 * self.count :].reshape(2, self.count, 3)[...] = shifted
        return self._rates(y, acceleration) + difference, difference

    def scaled_jacobian(self, y: FloatArray) -> tuple[ConstraintValues, FloatArray]:
        """Return constraint values and Phi_q W, shape (m, 6 n): with respect to scaled body coordinates."""
        placed = self.placed(y)
        return placed.constraints, placed.scaled

    def placed(self, y: FloatArray) -> Placed:
        """Return what follows from a state alone, for those who ask it for several things."""
        kinematics = self.kinematics(y)
        vectors, roots = self.pool.evaluate(kinematics), self.roots(kinematics.frames)
        values = self.constraints.evaluate(vectors)
        return Placed(kinematics, vectors, roots, values, self._scaled(values.jacobian, roots))

    def _scaled(self, jacobian: FloatArray, W: FloatArray) -> FloatArray:
        scaled: FloatArray = (jacobian.transpose(1, 0, 2) @ W).transpose(1, 0, 2).reshape(len(jacobian), 6 * self.count)
        return scaled

    def unscaled(self, scaled: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacements and body-fixed rotations, each (n, 3), of scaled body coordinates, shape (6 n,)."""
        by_body = scaled.reshape(self.count, 6)
        return by_body[:, :3] * self._root_mass, by_body[:, 3:] * self._root_inertia

    def shifted(self, y: FloatArray, shifts: FloatArray, turns: FloatArray) -> FloatArray:
        """Displace and turn the bodies by (n, 3) [m] and body-fixed (n, 3) [rad]."""
        s = self.split(y)
        return self.join(s.r + shifts, turned(s.p, turns), s.v, s.w)

    def moved(self, y: FloatArray, scaled: FloatArray) -> FloatArray:
        """Displace a state by scaled body coordinates, shape (6 n,); body-fixed velocities stay."""
        return self.shifted(y, *self.unscaled(scaled))

    def with_velocity(self, y: FloatArray, scaled: FloatArray) -> FloatArray:
        """Return the state with velocities from scaled ones, shape (6 n,)."""
        s = self.split(y)
        return self.join(s.r, s.p, *self.unscaled(scaled))

    def energy(self, y: FloatArray) -> float:
        """Return kinetic energy plus that of weights, springs and stops [J]; the base's weight left out."""
        free = slice(self.driven, None)
        weight = self.definition.gravity * (self.mass[free] @ self.split(y).r[free, 2])
        kinematics = self.kinematics(y)
        stored = self.forces.energy(self.pool.evaluate(kinematics)) + self.forces.stops.energy(kinematics.frames)
        return float(self.kinetic(y) + weight + stored)

    def kinetic(self, y: FloatArray) -> float:
        """Return the kinetic energy of the bodies that the base does not drive [J]."""
        s, free = self.split(y), slice(self.driven, None)
        return float(0.5 * (self.mass[free] @ (s.v[free] ** 2).sum(axis=1) + (self.inertia * s.w**2)[free].sum()))

    def power_of_base(self, y: FloatArray, inputs: Inputs) -> float:
        """Return the power that the base puts in through its joints [W]."""
        if inputs.base[1] == 0.0 and inputs.sway is None:
            return 0.0
        found, d = self.evaluate(y.copy(), inputs), self.driven
        jacobian = found.constraints.jacobian[:, :d]
        if inputs.sway is None:
            return float(found.multipliers @ jacobian[:, :, 2].sum(axis=1)) * inputs.base[1]
        frame = BaseFrame.of(inputs.base, inputs.sway)
        velocity = frame.carry(self._written[:d], self._written_p[:d]).v
        motion = np.concatenate([velocity, np.tile(frame.angular_velocity, (d, 1))], axis=1)
        return float(found.multipliers @ (jacobian * motion).sum(axis=(1, 2)))

    def strip_ends(self, y: FloatArray) -> FloatArray:
        """Return the strip's ends, shape (2, 2, 3): left A and right B; position, velocity [m, m/s]."""
        if self.strip_body < 0:
            raise MechanismError(f"'{self.definition.name}' has no collector strip")
        local = self.strip_point + self._strip_halves
        s, k = self.split(y), self.strip_body
        ends = (local @ self._strip_frame(y).T).reshape(2, 2, 3)
        ends[:, 0] += s.r[k]
        ends[:, 1] += s.v[k]
        return ends

    def strip_height(self, y: FloatArray) -> float:
        """Return the height of the strip's middle above the base's origin at rest [m]."""
        return float(self.strip_ends(y)[:, 0, 2].mean())
