"""Force elements between bodies: springs, dampers, actuators, bump stops, friction, bushings, gravity.

Every function here returns loads, shape (n, 6): the force on each body and the moment about its centre
of mass, both in global components [N, N.m].
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple, get_args

import numpy as np

from models.arrays import FloatArray
from models.numerics.cubic_curve import CubicCurve
from models.pantograph.multibody.elements.air_forces import AirForces
from models.pantograph.multibody.elements.angle_elements import AngleStops, BodyAngle, Cam, PointDistance
from models.pantograph.multibody.elements.moving_vectors import Handle, Kinematics, MovingVectors, Vector, VectorPool
from models.pantograph.multibody.elements.rotations import cross
from models.pantograph.multibody.mechanism_definition import (
    ActuatorForce,
    ActuatorMoment,
    Aerodynamic,
    AngleStop,
    BumpStop,
    Bushing,
    Force,
    Joint,
    JointFriction,
    LiftingForce,
    LiftingMoment,
    LineForce,
    PairJoint,
    PointJoint,
    Prismatic,
    Revolute,
    RevolutePrismatic,
    SlideAndTurnFriction,
    SlidingFriction,
    SpringDamper,
    Triple,
    TurningFriction,
    WeightSpring,
)

#: Every class that `ForceElements` makes something of; `tests/test_registries.py` sees that each one pushes.
KNOWN: Final = (
    SpringDamper,
    WeightSpring,
    BumpStop,
    ActuatorForce,
    LiftingForce,
    ActuatorMoment,
    LiftingMoment,
    AngleStop,
    Bushing,
    Aerodynamic,
    *get_args(JointFriction),
)


class ForceElements:
    """All force elements of a mechanism, the simple ones evaluated together.

    Parameters
    ----------
    forces : sequence of Force
    joints : sequence of Joint
        Where the friction is.
    numbers : dict
        Body name -> number.
    orientations : ndarray, shape (n, 3, 3)
        Orientations as written: where a bushing is untwisted until ``untwist`` is told those as assembled.
    pool : VectorPool
        Takes the vectors of the elements; to be closed before ``compile``.

    Raises
    ------
    ValueError
        If there is a kind of force that nothing here computes: it would silently do nothing.
    """

    def __init__(
        self,
        forces: Sequence[Force],
        joints: Sequence[Joint],
        numbers: dict[str, int],
        orientations: FloatArray,
        pool: VectorPool,
    ) -> None:
        if strange := [f for f in forces if type(f) not in KNOWN]:
            raise ValueError(f"force '{strange[0].name}': nothing computes a {type(strange[0]).__name__}")
        by_name = {j.name: j for j in joints if isinstance(j, PairJoint)}
        rubbing = [(f, by_name[f.joint]) for f in forces if isinstance(f, JointFriction)]
        slides = [(f, _Line.of(j, j.axis_i, numbers)) for f, j in rubbing if isinstance(j, Prismatic)]
        heads = [(f, j) for f, j in rubbing if isinstance(f, SlideAndTurnFriction) and isinstance(j, RevolutePrismatic)]
        slides += [(f.sliding, _Line.back(j, j.axis_j, numbers)) for f, j in heads]
        self.lines = LineElements([f for f in forces if isinstance(f, LineForce)], numbers, pool)
        turning = [f for f in forces if isinstance(f, ActuatorMoment | LiftingMoment)]
        self._moments = _Moments(turning, numbers, pool)
        self._slides = _Lines([line for _, line in slides], len(numbers), pool)
        self._friction = np.array([f.level for f, _ in slides])
        self._transition = np.array([f.transition for f, _ in slides])
        self.stops = AngleStops([f for f in forces if isinstance(f, AngleStop)], numbers, orientations)
        self.air = AirForces([f for f in forces if isinstance(f, Aerodynamic)], numbers)
        self.cam: Cam | None = None
        self.per_force: CubicCurve | None = None
        self.lift_place = self._place_of_lift(forces, numbers, orientations)
        self._others: list[_Friction | _Bushing] = []
        for f in forces:
            if isinstance(f, SlideAndTurnFriction):
                if (turning_part := f.turning) is not None:
                    self._others.append(_Friction(turning_part, by_name[f.joint], numbers))
            elif isinstance(f, SlidingFriction | TurningFriction) and not isinstance(by_name[f.joint], Prismatic):
                self._others.append(_Friction(f, by_name[f.joint], numbers))
            elif isinstance(f, Bushing):
                self._others.append(_Bushing(f, numbers, orientations))

    @staticmethod
    def _place_of_lift(
        forces: Sequence[Force], numbers: dict[str, int], orientations: FloatArray
    ) -> BodyAngle | PointDistance | None:
        lifting = next((f for f in forces if isinstance(f, LiftingForce | LiftingMoment)), None)
        if lifting is None:
            return None
        if isinstance(lifting, LiftingMoment):
            return BodyAngle(lifting, numbers, orientations)
        return PointDistance(lifting, numbers)

    def compile(self, pool: VectorPool) -> None:
        """Work out where everything comes from."""
        for elements in (self.lines, self._moments, self._slides):
            elements.compile(pool)

    def untwist(self, orientations: FloatArray) -> None:
        """Take the bodies' orientations, shape (n, 3, 3), as those in which no bushing is twisted."""
        for element in self._others:
            if isinstance(element, _Bushing):
                element.untwist(orientations)

    def loads(self, kinematics: Kinematics, vectors: MovingVectors, w: FloatArray, lift: float) -> FloatArray:
        """Return the loads of all elements.

        Parameters
        ----------
        kinematics : Kinematics
        vectors : MovingVectors
        w : ndarray, shape (n, 3)
            Body-fixed angular velocities [rad/s].
        lift : float
            Value of the lifting element [N or N.m].
        """
        total = self.lines.loads(vectors, lift)
        if self._moments.count:
            total[:, 3:] += self._moments.moments(vectors, lift)
        if self._slides.count:
            speed = self._slides.lengths(vectors).rate
            total += self._slides.spread(self._friction * np.tanh(speed / self._transition), vectors)
        if self.stops.stops:
            self.stops.add_loads(total, kinematics.frames, w)
        for element in self._others:
            total += element.loads(kinematics, w)
        return total

    def lift_value(self, kinematics: Kinematics, lift: float, uplift: float = 0.0) -> float:
        """Return the force or moment of the lifting element [N or N.m].

        Parameters
        ----------
        kinematics : Kinematics
        lift : float
            What is set of it [N, N.m or 1]: with a cam, what the cam makes of it acts.
        uplift : float
            Force that it brings to the strip besides [N]; a force that lifts takes it as it is.
        """
        if self.lift_place is None or (self.cam is None and uplift == 0.0):
            return lift
        if self.cam is None and self.per_force is None:
            return lift + uplift
        place = self.lift_place.at(kinematics)
        value = lift if self.cam is None else self.cam.value(place, lift)
        return value if self.per_force is None else value + uplift * self.per_force.at(place)

    def tables(self) -> ElementTables:
        """Return the elements as tables, bushings untwisted as they are now."""
        frictions = [e.numbers() for e in self._others if isinstance(e, _Friction)]
        bushings = [e.numbers() for e in self._others if isinstance(e, _Bushing)]
        slides = np.column_stack([self._slides.table(), self._friction, self._transition])
        return ElementTables(
            self.lines.table(), slides, self._moments.table(), self.stops.table(),
            np.array(frictions).reshape(-1, 8), np.array(bushings).reshape(-1, 29), self.air.table(),
        )  # fmt: skip

    def energy(self, vectors: MovingVectors) -> float:
        """Return the potential energy of springs and bump stops [J]; that of angle stops is with ``stops``."""
        return self.lines.energy(vectors)


class ElementTables(NamedTuple):
    """Force elements as tables, a row of numbers for each; see the ``table`` of each kind."""

    lines: FloatArray
    slides: FloatArray
    moments: FloatArray
    stops: FloatArray
    frictions: FloatArray
    bushings: FloatArray
    air: FloatArray


class Lengths(NamedTuple):
    """Lengths of line elements [m], their rates [m/s], and what their direction vectors are divided by."""

    length: FloatArray
    rate: FloatArray
    divisor: FloatArray


class _Line(NamedTuple):
    """A line from a point of body i to one of body j, or the direction of body i that stands for it."""

    start: Vector
    to: Vector
    direction: Triple | None

    @classmethod
    def of(cls, pair: LineForce | PointJoint, direction: Triple | None, numbers: dict[str, int]) -> _Line:
        """Return the line of an element's points."""
        start, to = Vector(numbers[pair.body_i], pair.point_i), Vector(numbers[pair.body_j], pair.point_j)
        return cls(start, to, direction)

    @classmethod
    def back(cls, joint: PointJoint, direction: Triple, numbers: dict[str, int]) -> _Line:
        """Return the line of a joint's points from body j to body i, with a direction of body j."""
        start, to = Vector(numbers[joint.body_j], joint.point_j), Vector(numbers[joint.body_i], joint.point_i)
        return cls(start, to, direction)


class _Lines:
    """Lines between bodies, or directions, with lengths and tensions along them.

    With d from point i to point j and x = d, or x = a given direction a of body i, the length is l = d . x / |x|; a
    tension T pulls body i at the far point with T x / |x| and body j with the opposite.
    """

    def __init__(self, lines: Sequence[_Line], bodies: int, pool: VectorPool) -> None:
        self.count = len(lines)
        self._directed = np.array([line.direction is not None for line in lines], dtype=bool)
        self._turning = self._directed.astype(np.float64)
        self._enter(lines, pool)
        columns = np.arange(self.count)
        self._gather = np.zeros((bodies, 2 * self.count))
        self._gather[[line.start.body for line in lines], columns] = 1.0
        self._gather[[line.to.body for line in lines], self.count + columns] = -1.0
        self._bodies = np.array([(line.start.body, line.to.body) for line in lines], dtype=np.float64).reshape(-1, 2)

    def _enter(self, lines: Sequence[_Line], pool: VectorPool) -> None:
        self._handles: list[tuple[Handle, Handle]] = []
        ends_i, ends_j = [], []
        for start, to, direction in lines:
            gap = pool.gap(start, to)
            x = gap if direction is None else pool.vector(Vector(start.body, direction))
            self._handles.append((x, gap))
            ends_i.append(pool.cross(pool.lever(start, to), x))
            ends_j.append(pool.cross(pool.vector(to), x))
        self._turns = np.array(ends_i + ends_j, dtype=np.int64)

    def compile(self, pool: VectorPool) -> None:
        """Work out where everything comes from."""
        self._x = pool.positions([x for x, _ in self._handles])
        self._d = pool.positions([d for _, d in self._handles])

    def table(self) -> FloatArray:
        """Return the entries x and d, the bodies of start and end, their cross products, and whether it is directed."""
        turns = self._turns.reshape(2, -1).T
        return np.column_stack([self._x, self._d, self._bodies, turns, self._turning])

    def lengths(self, vectors: MovingVectors) -> Lengths:
        """Return lengths and rates."""
        x = vectors.values.take(self._x, axis=0).reshape(-1, 3, 3)
        d = vectors.values.take(self._d, axis=0).reshape(-1, 3, 3)
        products = x @ d.transpose(0, 2, 1)
        along = products[:, 0, 0]
        divisor = np.where(self._directed, 1.0, np.sqrt(np.abs(along)) + 1e-300)
        rate = products[:, 0, 1] + self._turning * products[:, 1, 0]
        return Lengths(along / divisor, rate / divisor, divisor)

    def spread(self, tension: FloatArray, vectors: MovingVectors) -> FloatArray:
        """Return the loads of given tensions per length of x, shape (L,)."""
        wrench = np.empty((2, self.count, 6))
        wrench[:, :, :3] = vectors.values.take(self._x, axis=0)[:, :3]
        wrench[:, :, 3:] = vectors.crosses.take(self._turns, axis=0).reshape(2, -1, 3)
        wrench *= tension[:, None]
        return self._gather @ wrench.reshape(-1, 6)


class LineElements(_Lines):
    """Springs, dampers, actuators and bump stops, with the tension T = k (l - l0) + c l' - push.

    Attributes
    ----------
    names : list of str
    stiffness, damping, free_length : ndarray, shape (L,)
        [N/m, N.s/m, m]; 0 of what is no spring.
    carries : ndarray
        Which elements are springs that carry the weights.
    """

    def __init__(self, forces: Sequence[LineForce], numbers: dict[str, int], pool: VectorPool) -> None:
        super().__init__([_Line.of(f, f.direction, numbers) for f in forces], len(numbers), pool)
        self.names = [f.name for f in forces]
        springs = [f if isinstance(f, SpringDamper | WeightSpring) else None for f in forces]
        self.stiffness = np.array([f.stiffness if f else 0.0 for f in springs])
        self.damping = np.array([f.damping if f else 0.0 for f in springs])
        self.free_length = np.array([f.free_length if isinstance(f, SpringDamper) else 0.0 for f in forces])
        self.carries = np.flatnonzero([isinstance(f, WeightSpring) for f in forces])
        self._push = np.array([f.force if isinstance(f, ActuatorForce) else 0.0 for f in forces])
        self._lift = [k for k, f in enumerate(forces) if isinstance(f, LiftingForce)]
        self._stops = _Stops([f if isinstance(f, BumpStop) else None for f in forces])

    def table(self) -> FloatArray:
        """Return the numbers of a line, share of the lift, stiffness, damping, free length and push of every element,
        then stiffness, damping, shortest and longest length of its stop, 16 numbers.
        """
        lifts = np.zeros(self.count)
        lifts[self._lift] = 1.0
        stops = self._stops
        own = (lifts, self.stiffness, self.damping, self.free_length, self._push)
        return np.column_stack([super().table(), *own, stops.k, stops.c, stops.shortest, stops.longest])

    def loads(self, vectors: MovingVectors, lift: float) -> FloatArray:
        """Return the loads of all line elements."""
        if self.count == 0:
            return np.zeros((len(self._gather), 6))
        lengths = self.lengths(vectors)
        tension = self.stiffness * (lengths.length - self.free_length) + self.damping * lengths.rate - self._push
        if self._lift:
            tension[self._lift] -= lift
        if self._stops.any:
            tension += self._stops.tension(lengths.length, lengths.rate)
        return self.spread(tension / lengths.divisor, vectors)

    def energy(self, vectors: MovingVectors) -> float:
        """Return the energy stored in springs and bump stops [J]."""
        if self.count == 0:
            return 0.0
        length = self.lengths(vectors).length
        stored = 0.5 * self.stiffness * (length - self.free_length) ** 2
        return float(stored.sum() + self._stops.energy(length))


class _Stops:
    """Bump stops: springs beyond a shortest and a longest length; they push back, never pull."""

    def __init__(self, stops: Sequence[BumpStop | None]) -> None:
        self.any = any(stops)
        self.k = np.array([s.stiffness if s else 0.0 for s in stops])
        self.c = np.array([s.damping if s else 0.0 for s in stops])
        self.shortest = np.array([-np.inf if s is None or s.shortest is None else s.shortest for s in stops])
        self.longest = np.array([np.inf if s is None or s.longest is None else s.longest for s in stops])

    def tension(self, length: FloatArray, speed: FloatArray) -> FloatArray:
        """Return the tension of the stops, 0 between the two lengths [N]."""
        over = np.maximum(length - self.longest, 0.0)
        under = np.minimum(length - self.shortest, 0.0)
        pull = np.where(over > 0.0, np.maximum(self.k * over + self.c * speed, 0.0), 0.0)
        push = np.where(under < 0.0, np.minimum(self.k * under + self.c * speed, 0.0), 0.0)
        return pull + push

    def energy(self, length: FloatArray) -> float:
        """Return the energy stored [J]."""
        if not self.any:
            return 0.0
        out = np.maximum(length - self.longest, 0.0) + np.maximum(self.shortest - length, 0.0)
        return float((0.5 * self.k * out**2).sum())


class _Moments:
    """Actuator moments: +M on body j and -M on body i about an axis of body i."""

    def __init__(
        self, forces: Sequence[ActuatorMoment | LiftingMoment], numbers: dict[str, int], pool: VectorPool
    ) -> None:
        self.count = len(forces)
        self._handles = [pool.vector(Vector(numbers[f.body_i], f.axis_i)) for f in forces]
        self._values = np.array([f.moment if isinstance(f, ActuatorMoment) else 0.0 for f in forces])
        self._lift = [k for k, f in enumerate(forces) if isinstance(f, LiftingMoment)]
        self._bodies = [(numbers[f.body_i], numbers[f.body_j]) for f in forces]
        self._gather = np.zeros((len(numbers), self.count))
        for k, f in enumerate(forces):
            self._gather[numbers[f.body_j], k] = 1.0
            self._gather[numbers[f.body_i], k] = -1.0

    def compile(self, pool: VectorPool) -> None:
        """Work out where the axes come from."""
        self._axes = pool.positions(self._handles)

    def table(self) -> FloatArray:
        """Return the entry of the axis, the bodies, whether it lifts, and the moment of every element, 5 numbers."""
        lifts = np.zeros(self.count)
        lifts[self._lift] = 1.0
        bodies = np.array(self._bodies, dtype=np.float64).reshape(-1, 2)
        return np.column_stack([self._axes, bodies, lifts, self._values])

    def moments(self, vectors: MovingVectors, lift: float) -> FloatArray:
        """Return the moments on the bodies, shape (n, 3)."""
        values = self._values.copy()
        values[self._lift] = lift
        moments: FloatArray = self._gather @ (values[:, None] * vectors.values.take(self._axes, axis=0)[:, :3])
        return moments


class _Friction:
    """Moment against the relative rotation in a joint, M tanh(w / w0), for a hinge about its axis."""

    def __init__(self, force: SlidingFriction | TurningFriction, joint: PairJoint, numbers: dict[str, int]) -> None:
        self._i, self._j = numbers[joint.body_i], numbers[joint.body_j]
        self._level, self._transition = force.level, force.transition
        self._axis = np.array(joint.axis_i) if isinstance(joint, Revolute) else None

    def numbers(self) -> list[float]:
        """Return bodies, level, transition, whether there is an axis, and the axis, 8 numbers."""
        axis = np.zeros(3) if self._axis is None else self._axis
        return [self._i, self._j, self._level, self._transition, float(self._axis is not None), *axis]

    def loads(self, kinematics: Kinematics, w: FloatArray) -> FloatArray:
        frames = kinematics.frames
        relative = frames[self._j, :3] @ w[self._j] - frames[self._i, :3] @ w[self._i]
        if self._axis is not None:
            axis = frames[self._i, :3] @ self._axis
            moment = -self._level * np.tanh((relative @ axis) / self._transition) * axis
        else:
            speed = max(float(np.sqrt(relative @ relative)), 1e-12)
            moment = -self._level * np.tanh(speed / self._transition) / speed * relative
        loads = np.zeros((len(frames), 6))
        loads[self._j, 3:] = moment
        loads[self._i, 3:] = -moment
        return loads


class _Bushing:
    """Elastic joint: springs and dampers along and about the axes of body i.

    Untwisted where the bodies' orientations are as assembled, unstretched where the points meet. The rotation
    is taken as a rotation vector, so the moments are those of a potential for small angles.
    """

    def __init__(self, force: Bushing, numbers: dict[str, int], orientations: FloatArray) -> None:
        self._i, self._j = numbers[force.body_i], numbers[force.body_j]
        self._s_i, self._s_j = np.array(force.point_i), np.array(force.point_j)
        self.untwist(orientations)
        self._k, self._c = np.array(force.translation_stiffness), np.array(force.translation_damping)
        self._kr, self._cr = np.array(force.rotation_stiffness), np.array(force.rotation_damping)

    def untwist(self, orientations: FloatArray) -> None:
        """Take the relative orientation in which the bushing carries no moment."""
        self._rest = orientations[self._i].T @ orientations[self._j]

    def numbers(self) -> list[float]:
        """Return bodies, points, orientation at rest by rows, stiffness and damping, those of turning, 29 numbers."""
        laws = (self._k, self._c, self._kr, self._cr)
        return [self._i, self._j, *self._s_i, *self._s_j, *self._rest.ravel(), *np.concatenate(laws)]

    def loads(self, kinematics: Kinematics, w: FloatArray) -> FloatArray:
        frames, origins = kinematics.frames, kinematics.origins
        A_i, A_j = frames[self._i, :3], frames[self._j, :3]
        end_i = frames[self._i] @ self._s_i + origins[self._i]
        end_j = frames[self._j] @ self._s_j + origins[self._j]
        d = end_j[:3] - end_i[:3]
        w_i, w_j = A_i @ w[self._i], A_j @ w[self._j]
        drift = A_i.T @ (end_j[3:6] - end_i[3:6] - cross(w_i, d))
        force = -A_i @ (self._k * (A_i.T @ d) + self._c * drift)
        twist = rotation_vector(A_i.T @ A_j @ self._rest.T)
        moment = -A_i @ (self._kr * twist + self._cr * (A_i.T @ (w_j - w_i)))
        lever_j = A_j @ self._s_j
        lever_i = A_i @ self._s_i + d
        loads = np.zeros((len(frames), 6))
        loads[self._j] = np.concatenate([force, moment + cross(lever_j, force)])
        loads[self._i] = np.concatenate([-force, -moment - cross(lever_i, force)])
        return loads


def rotation_vector(A: FloatArray) -> FloatArray:
    """Return the rotation vector of a matrix, shape (3,) [rad]; angles below pi.

    Examples
    --------
    >>> c, s = np.cos(0.3), np.sin(0.3)
    >>> rotation_vector(np.array([[1.0, 0, 0], [0, c, -s], [0, s, c]])).round(12).tolist()
    [0.3, 0.0, 0.0]
    """
    axial = 0.5 * np.array([A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1]])
    sine = float(np.sqrt(axial @ axial))
    angle = float(np.arctan2(sine, 0.5 * (np.trace(A) - 1.0)))
    scaled: FloatArray = axial * (angle / sine if sine > 1e-9 else 1.0)
    return scaled


def gravity_loads(masses: FloatArray, gravity: float) -> FloatArray:
    """Return the bodies' weights as loads."""
    loads = np.zeros((len(masses), 6))
    loads[:, 2] = -masses * gravity
    return loads
