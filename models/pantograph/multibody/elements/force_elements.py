"""Force elements between bodies: springs, dampers, actuators, bump stops, friction, bushings, gravity.

Every function here returns loads, shape (n, 6): the force on each body and the moment about its centre
of mass, both in global components [N, N.m].
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from models.arrays import FloatArray
from models.pantograph.multibody.elements.moving_vectors import Handle, Kinematics, MovingVectors, Vector, VectorPool
from models.pantograph.multibody.elements.rotations import cross
from models.pantograph.multibody.mechanism_definition import Force

_LINES: Final = ("spring_damper", "actuator_force", "bump_stop")
#: Every kind that `ForceElements` makes something of; `tests/test_registries.py` sees that each one pushes.
KNOWN_KINDS: Final = frozenset((*_LINES, "actuator_moment", "joint_friction", "bushing"))


class ForceElements:
    """All force elements of a mechanism, the simple ones evaluated together.

    Parameters
    ----------
    forces : sequence of Force
    numbers : dict
        Body name -> number.
    orientations : ndarray, shape (n, 3, 3)
        Orientations as written: where a bushing is untwisted.
    pool : VectorPool
        Takes the vectors of the elements; to be closed before ``compile``.

    Raises
    ------
    ValueError
        If there is a kind of force that nothing here computes: it would silently do nothing.
    """

    def __init__(
        self, forces: Sequence[Force], numbers: dict[str, int], orientations: FloatArray, pool: VectorPool
    ) -> None:
        if strange := [f for f in forces if f.kind not in KNOWN_KINDS]:
            raise ValueError(f"force '{strange[0].name}': nothing is known of its kind '{strange[0].kind}'")
        self.lines = LineElements([f for f in forces if f.kind in _LINES], numbers, pool)
        self._moments = _Moments([f for f in forces if f.kind == "actuator_moment"], numbers, pool)
        self._slides = LineElements([f for f in forces if f.joint_kind == "prismatic"], numbers, pool)
        self._friction = np.array([f.friction for f in forces if f.joint_kind == "prismatic"])
        self._transition = np.array([f.transition for f in forces if f.joint_kind == "prismatic"])
        self._others: list[_Friction | _Bushing] = []
        for f in forces:
            if f.kind == "joint_friction" and f.joint_kind != "prismatic":
                self._others.append(_Friction(f, numbers))
            elif f.kind == "bushing":
                self._others.append(_Bushing(f, numbers, orientations))

    def compile(self, pool: VectorPool) -> None:
        """Work out where everything comes from."""
        for elements in (self.lines, self._moments, self._slides):
            elements.compile(pool)

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
        for element in self._others:
            total += element.loads(kinematics, w)
        return total

    def energy(self, vectors: MovingVectors) -> float:
        """Return the potential energy of springs and bump stops [J]."""
        return self.lines.energy(vectors)


class Lengths(NamedTuple):
    """Lengths of line elements [m], their rates [m/s], and what their direction vectors are divided by."""

    length: FloatArray
    rate: FloatArray
    divisor: FloatArray


class LineElements:
    """Springs, dampers, actuators and bump stops: a tension along a line or a given direction.

    With d from point i to point j and x = d, or x = a given direction a of body i, the length is l = d . x / |x|
    and the tension T = k (l - l0) + c l' - push; it pulls body i at the far point with T x / |x| and body j with the
    opposite.
    """

    def __init__(self, forces: Sequence[Force], numbers: dict[str, int], pool: VectorPool) -> None:
        self.names = [f.name for f in forces]
        self.count = len(forces)
        springs = [f.kind == "spring_damper" for f in forces]
        self.stiffness = np.array([f.stiffness if s else 0.0 for f, s in zip(forces, springs, strict=True)])
        self.damping = np.array([f.damping if s else 0.0 for f, s in zip(forces, springs, strict=True)])
        self.free_length = np.array([f.free_length or 0.0 for f in forces])
        self.carries = np.flatnonzero([s and f.free_length is None for f, s in zip(forces, springs, strict=True)])
        self._push = np.array([f.value if f.kind == "actuator_force" else 0.0 for f in forces])
        self._lift = [k for k, f in enumerate(forces) if f.lift]
        self._stops = _Stops(forces)
        self._directed = np.array([f.direction is not None for f in forces], dtype=bool)
        self._turning = self._directed.astype(np.float64)
        self._enter(forces, numbers, pool)
        columns = np.arange(self.count)
        self._gather = np.zeros((len(numbers), 2 * self.count))
        self._gather[[numbers[f.body_i] for f in forces], columns] = 1.0
        self._gather[[numbers[f.body_j] for f in forces], self.count + columns] = -1.0

    def _enter(self, forces: Sequence[Force], numbers: dict[str, int], pool: VectorPool) -> None:
        self._handles: list[tuple[Handle, Handle]] = []
        ends_i, ends_j = [], []
        for f in forces:
            start, to = Vector(numbers[f.body_i], f.point_i), Vector(numbers[f.body_j], f.point_j)
            gap = pool.gap(start, to)
            x = gap if f.direction is None else pool.vector(Vector(start.body, f.direction))
            self._handles.append((x, gap))
            ends_i.append(pool.cross(pool.lever(start, to), x))
            ends_j.append(pool.cross(pool.vector(to), x))
        self._turns = np.array(ends_i + ends_j, dtype=np.int64)

    def compile(self, pool: VectorPool) -> None:
        """Work out where everything comes from."""
        self._x = pool.positions([x for x, _ in self._handles])
        self._d = pool.positions([d for _, d in self._handles])

    def lengths(self, vectors: MovingVectors) -> Lengths:
        """Return lengths and rates."""
        x = vectors.values.take(self._x, axis=0).reshape(-1, 3, 3)
        d = vectors.values.take(self._d, axis=0).reshape(-1, 3, 3)
        products = x @ d.transpose(0, 2, 1)
        along = products[:, 0, 0]
        divisor = np.where(self._directed, 1.0, np.sqrt(np.abs(along)) + 1e-300)
        rate = products[:, 0, 1] + self._turning * products[:, 1, 0]
        return Lengths(along / divisor, rate / divisor, divisor)

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

    def spread(self, tension: FloatArray, vectors: MovingVectors) -> FloatArray:
        """Return the loads of given tensions per length of x, shape (L,)."""
        wrench = np.empty((2, self.count, 6))
        wrench[:, :, :3] = vectors.values.take(self._x, axis=0)[:, :3]
        wrench[:, :, 3:] = vectors.crosses.take(self._turns, axis=0).reshape(2, -1, 3)
        wrench *= tension[:, None]
        return self._gather @ wrench.reshape(-1, 6)

    def energy(self, vectors: MovingVectors) -> float:
        """Return the energy stored in springs and bump stops [J]."""
        if self.count == 0:
            return 0.0
        length = self.lengths(vectors).length
        stored = 0.5 * self.stiffness * (length - self.free_length) ** 2
        return float(stored.sum() + self._stops.energy(length))


class _Stops:
    """Bump stops: springs beyond a shortest and a longest length; they push back, never pull."""

    def __init__(self, forces: Sequence[Force]) -> None:
        is_stop = [f.kind == "bump_stop" for f in forces]
        self.any = any(is_stop)
        self.k = np.array([f.stiffness if s else 0.0 for f, s in zip(forces, is_stop, strict=True)])
        self.c = np.array([f.damping if s else 0.0 for f, s in zip(forces, is_stop, strict=True)])
        self.shortest = np.array([f.shortest for f in forces])
        self.longest = np.array([f.longest for f in forces])

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

    def __init__(self, forces: Sequence[Force], numbers: dict[str, int], pool: VectorPool) -> None:
        self.count = len(forces)
        axes = [(numbers[f.body_i], f.direction) for f in forces]
        self._handles = [pool.vector(Vector(body, axis)) for body, axis in axes if axis is not None]
        self._values = np.array([f.value for f in forces])
        self._lift = [k for k, f in enumerate(forces) if f.lift]
        self._gather = np.zeros((len(numbers), self.count))
        for k, f in enumerate(forces):
            self._gather[numbers[f.body_j], k] = 1.0
            self._gather[numbers[f.body_i], k] = -1.0

    def compile(self, pool: VectorPool) -> None:
        """Work out where the axes come from."""
        self._axes = pool.positions(self._handles)

    def moments(self, vectors: MovingVectors, lift: float) -> FloatArray:
        """Return the moments on the bodies, shape (n, 3)."""
        values = self._values.copy()
        values[self._lift] = lift
        moments: FloatArray = self._gather @ (values[:, None] * vectors.values.take(self._axes, axis=0)[:, :3])
        return moments


class _Friction:
    """Moment against the relative rotation in a joint, M tanh(w / w0), for a hinge about its axis."""

    def __init__(self, force: Force, numbers: dict[str, int]) -> None:
        self._i, self._j = numbers[force.body_i], numbers[force.body_j]
        self._level, self._transition = force.friction, force.transition
        hinge = force.joint_kind == "revolute" and force.direction is not None
        self._axis = np.array(force.direction) if hinge else None

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

    def __init__(self, force: Force, numbers: dict[str, int], orientations: FloatArray) -> None:
        self._i, self._j = numbers[force.body_i], numbers[force.body_j]
        self._s_i, self._s_j = np.array(force.point_i), np.array(force.point_j)
        self._rest = orientations[self._i].T @ orientations[self._j]
        self._k, self._c = np.array(force.translation_stiffness), np.array(force.translation_damping)
        self._kr, self._cr = np.array(force.rotation_stiffness), np.array(force.rotation_damping)

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
