"""The closed arm over theta: its places, and what the reduced form takes from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from models.arrays import FloatArray
from models.pantograph.multibody.elements.angle_elements import BodyAngle
from models.pantograph.multibody.elements.moving_vectors import Kinematics, MovingVectors
from models.pantograph.multibody.elements.rotations import cross, rotation_matrices
from models.pantograph.multibody.mechanism_definition import (
    ActuatorForce,
    ActuatorMoment,
    AngleStop,
    BumpStop,
    Force,
    LiftingForce,
    LiftingMoment,
    LineForce,
    PairJoint,
    Prismatic,
    Revolute,
    SlidingFriction,
    TurningFriction,
)
from models.pantograph.multibody.reduced.quintic_table import QuinticTable, points_of, tabulated
from models.pantograph.multibody.reduced.reduced_equations import FIRST_OF_ARM
from models.pantograph.multibody.reduced.reduction import NotReducibleError, Reduction, is_still

#: Largest residual of a place [m, 1, rad].
_CLOSED: Final = 1e-13
_ITERATIONS: Final = 12
#: Length of a panel of the table, and how many there may be on either side: of an angle [rad], of a way [m].
_PANEL: Final = {True: 0.05, False: 0.25}
_PANELS: Final = 16
#: Share of its value at the beginning to which the rise of the carrier may fall: then a dead centre is near.
_DEAD: Final = 0.1


class ArmPlace(NamedTuple):
    """The arm at a theta.

    Attributes
    ----------
    y : ndarray, shape (13 n,)
        State with theta' = 1.
    bend : ndarray, shape (n, 6)
        Accelerations with theta'' = 0, body-fixed the angular ones.
    """

    y: FloatArray
    bend: FloatArray


class ArmFinder:
    """Places of the arm for given theta.

    Parameters
    ----------
    reduction : Reduction
    """

    def __init__(self, reduction: Reduction) -> None:
        self.arm, driver = reduction.arm, reduction.driver
        on_base = driver.body_i in self.arm.definition.driven
        self.body = self.arm.numbers[driver.body_j if on_base else driver.body_i]
        start = self.arm.split(reduction.start)
        frames = rotation_matrices(start.p)
        axis = frames[self.arm.numbers[driver.body_i]] @ np.array(driver.axis_i)
        self.axis = axis / np.linalg.norm(axis)
        self.turns = isinstance(driver, Revolute)
        self._r0, self._p0 = start.r[self.body].copy(), start.p[self.body].copy()

    def theta(self, y: FloatArray) -> float:
        """Return theta in a state [rad or m]."""
        s = self.arm.split(y)
        if not self.turns:
            return float((s.r[self.body] - self._r0) @ self.axis)
        turn = turn_between(self._p0, s.p[self.body])
        return 2.0 * float(np.arctan2(turn[1:] @ self.axis, turn[0]))

    def at(self, theta: float, guess: FloatArray) -> ArmPlace:
        """Find the arm at a theta from a state nearby; raises ``NotReducibleError`` if it is not found."""
        y, arm = guess.copy(), self.arm
        for _ in range(_ITERATIONS):
            s = arm.split(y)
            s.p[:] /= np.linalg.norm(s.p, axis=1, keepdims=True)
            values, system = self._system(y)
            residual = np.append(values, self.theta(y) - theta)
            if np.abs(residual).max() <= _CLOSED:
                break
            y = arm.moved(y, self._whole(np.linalg.solve(system, -residual)))
        else:
            if np.abs(residual).max() > 100.0 * _CLOSED:
                raise NotReducibleError(f"the arm does not close at {theta:.3g}")
        unit = np.zeros(len(system))
        unit[-1] = 1.0
        y = arm.with_velocity(y, self._whole(np.linalg.solve(system, unit).view(np.float64)))
        gamma = arm.constraint_values(arm.kinematics(y)).gamma
        bend = self._whole(np.linalg.solve(system, np.append(gamma, 0.0)))
        return ArmPlace(y, np.concatenate(arm.unscaled(bend), axis=1))

    def onward(self, place: ArmPlace, way: float) -> FloatArray:
        """Return a guess of the state some way of theta on."""
        s = self.arm.split(place.y)
        shifts = way * s.v + 0.5 * way**2 * place.bend[:, :3]
        turns = way * s.w + 0.5 * way**2 * place.bend[:, 3:]
        return self.arm.shifted(place.y, shifts, turns)

    def _system(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the joints' violations, and the derivatives of these and of theta by the free scaled coordinates."""
        arm = self.arm
        values, scaled = arm.scaled_jacobian(y)
        row = np.zeros((arm.count, 6))
        frame = rotation_matrices(arm.split(y).p[self.body : self.body + 1])[0]
        if self.turns:
            row[self.body, 3:] = self.axis @ frame
        else:
            row[self.body, :3] = self.axis
        shifts, turns = arm.unscaled(row.ravel())
        row = np.concatenate([shifts, turns], axis=1)
        system = np.concatenate([scaled, row.reshape(1, -1)])[:, 6 * arm.driven :]
        if system.shape[0] != system.shape[1]:
            raise NotReducibleError("its closed part does not have one degree of freedom")
        return values.violation, system

    def _whole(self, free: FloatArray) -> FloatArray:
        return np.concatenate([np.zeros(6 * self.arm.driven), free])


def turn_between(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return the Euler parameters of the rotation, in global axes, that leads from one orientation to another."""
    scalar = float(before @ after)
    axial = before[0] * after[1:] - after[0] * before[1:] - cross(after[1:], before[1:])
    return np.concatenate([[scalar], axial])


@dataclass(frozen=True)
class ArmTables:
    """The arm over theta.

    Attributes
    ----------
    functions : QuinticTable
        As `reduced_equations` numbers them: INERTIA to CARRIER_Z, then those of ``rows``.
    outline : QuinticTable
        Height of every body but the base, and two derivatives.
    rows : ndarray, shape (elements, 8)
        Stops and friction of the arm: number of value and slope in ``functions``, lowest, highest, stiffness, damping;
        friction, its transition.
    reach : float
        Fastest body per theta' [m].
    postures : QuinticTable
        Positions and Euler parameters of the bodies: the first 7 n values of a state.
    """

    functions: QuinticTable
    outline: QuinticTable
    rows: FloatArray
    reach: float
    postures: QuinticTable


def tabulate(reduction: Reduction, finder: ArmFinder) -> ArmTables:
    """Tabulate the arm as far as it goes before a dead centre, at most `_PANELS` panels either way.

    Raises
    ------
    NotReducibleError
        If it cannot be: it leaves the plane of the track, say.
    """
    sampler = _Sampler(reduction, finder)
    start = finder.at(0.0, reduction.start)
    rise = sampler.rise(start)
    above = _panels(sampler, start, 1.0, rise)
    below = _panels(sampler, start, -1.0, rise)
    panels = below[::-1] + above
    values, first = np.array([p.values for p in panels]), -len(below)
    length = _PANEL[finder.turns]
    while len(panels):
        edges = length * np.arange(first, first + len(panels) + 1, dtype=np.float64)
        table, doubt = tabulated(edges, values)
        if doubt.max() <= 1.0:
            break
        cut = len(panels) - 1 if not doubt[-1] < doubt[0] else 0  # the end that is nearer to a dead centre
        panels.pop(cut)
        values, first = np.delete(values, cut, axis=0), first + (cut == 0)
    if not panels or not edges[0] < 0.0 < edges[-1]:
        raise NotReducibleError("its arm stands at a dead centre, or what it carries is not smooth over its range")
    parts = np.split(table.cells, [sampler.outline_from, table.cells.shape[1] - 7 * finder.arm.count], axis=1)
    tables = [QuinticTable(table.start, table.end, np.ascontiguousarray(cells)) for cells in parts]
    return ArmTables(tables[0], tables[1], sampler.rows, max(p.reach for p in panels), tables[2])


class _Panel(NamedTuple):
    values: FloatArray
    reach: float


def _panels(sampler: _Sampler, start: ArmPlace, way: float, rise: float) -> list[_Panel]:
    """Return the panels one way from the start, nearest first, until the carrier's rise has all but gone."""
    length, place, theta = _PANEL[sampler.finder.turns], start, 0.0
    found: list[_Panel] = []
    for k in range(_PANELS):
        points = points_of(way * k * length, way * (k + 1) * length) if way > 0 else None
        points = points if points is not None else points_of(-(k + 1) * length, -k * length)[::-1]
        places: list[ArmPlace] = []
        try:
            for point in points:
                place = sampler.finder.at(float(point), sampler.finder.onward(place, float(point) - theta))
                theta = float(point)
                places.append(place)
                if sampler.rise(place) / rise < _DEAD:
                    return found
            values = [sampler.functions(p) for p in places]
        except (NotReducibleError, np.linalg.LinAlgError):
            if not found:
                raise
            return found
        ordered = slice(None, None, 1 if way > 0 else -1)
        states = np.array([p.y for p in places])
        speeds = states[:, 7 * sampler.arm.count : 10 * sampler.arm.count].reshape(len(places), -1, 3)
        reach = float(np.linalg.norm(speeds, axis=2).max())
        found.append(_Panel(np.array(values)[ordered], reach))
    return found


class _Sampler:
    """Values of all functions at a place of the arm."""

    def __init__(self, reduction: Reduction, finder: ArmFinder) -> None:
        self.finder, self.arm = finder, reduction.arm
        self.carrier = self.arm.numbers[reduction.carrier]
        self._start = self.arm.split(reduction.start)
        self._gravity_free = slice(self.arm.driven, None)
        self._lines = {f.name: f for f in self.arm.definition.forces if isinstance(f, LineForce)}
        self._angles = list(self.arm.forces.stops.angles)
        self._joints = {j.name: j for j in self.arm.definition.joints if isinstance(j, PairJoint)}
        self.rows = self._list_rows()

    def _list_rows(self) -> FloatArray:
        """Number the functions of stops and friction: slopes and values in the order of ``_rest``."""
        rows, at = [], FIRST_OF_ARM
        for f in self._rest():
            if isinstance(f, BumpStop):
                limits = (f.shortest, f.longest, f.stiffness, f.damping, 0.0, 1.0)
            elif isinstance(f, AngleStop):
                limits = (f.lowest, f.highest, f.stiffness, f.damping, 0.0, 1.0)
            else:
                assert isinstance(f, SlidingFriction | TurningFriction)
                limits = (0.0, 0.0, 0.0, 0.0, f.level, f.transition)
            low, high, *others = limits
            rows.append([at, at + 1, -np.inf if low is None else low, np.inf if high is None else high, *others])
            at += 2
        self.outline_from = at
        return np.array(rows, dtype=np.float64).reshape(-1, 8)

    def _rest(self) -> list[Force]:
        kinds = BumpStop | AngleStop | SlidingFriction | TurningFriction
        return [f for f in self.arm.definition.forces if isinstance(f, kinds)]

    def rise(self, place: ArmPlace) -> float:
        """Return the carrier's rise per theta."""
        return float(self.arm.split(place.y).v[self.carrier, 2])

    def functions(self, place: ArmPlace) -> FloatArray:
        """Return all functions, those of outputs and the posture last."""
        arm, free = self.arm, self._gravity_free
        kinematics = arm.kinematics(place.y)
        vectors = arm.pool.evaluate(kinematics)
        s, bend = arm.split(place.y), place.bend
        spin = (kinematics.frames[:, :3] @ s.w[:, :, None])[:, :, 0]
        mass, inertia = arm.mass[free], arm.inertia[free]
        v, w = s.v[free], s.w[free]
        moving = float(mass @ (v**2).sum(axis=1) + (inertia * w**2).sum())
        slope = float(mass @ (v * bend[free, :3]).sum(axis=1) + (inertia * w * bend[free, 3:]).sum())
        own, damping, lever = self._springs(kinematics, vectors, spin)
        where = arm.forces.lift_place
        place_of_lift = 0.0 if where is None else where.at(kinematics)
        group = [moving, slope, -float(mass @ v[:, 2]), own, damping, lever, place_of_lift]
        outline = np.stack([s.r[free, 2], v[:, 2], bend[free, 2]], axis=1).ravel()
        carried = self._carrier(kinematics, place, spin)
        return np.array(
            [*group, *carried, *self._others(kinematics, vectors, spin), *outline, *place.y[: 7 * arm.count]]
        )

    def _springs(self, kinematics: Kinematics, vectors: MovingVectors, spin: FloatArray) -> tuple[float, float, float]:
        """Return the generalised force of springs and drives, the damping, and the force per unit of what lifts."""
        lines = self.arm.forces.lines
        own = damping = lever = 0.0
        if lines.count:
            lengths = lines.lengths(vectors)
            own -= float((lines.stiffness * (lengths.length - lines.free_length) * lengths.rate).sum())
            damping += float((lines.damping * lengths.rate**2).sum())
            for name, rate in zip(lines.names, lengths.rate.tolist(), strict=True):
                force = self._lines[name]
                own += force.force * rate if isinstance(force, ActuatorForce) else 0.0
                lever += rate if isinstance(force, LiftingForce) else 0.0
        for f in self.arm.definition.forces:
            if isinstance(f, ActuatorMoment | LiftingMoment):
                i, j = self.arm.numbers[f.body_i], self.arm.numbers[f.body_j]
                share = float((kinematics.frames[i, :3] @ np.array(f.axis_i)) @ (spin[j] - spin[i]))
                if isinstance(f, LiftingMoment):
                    lever += share
                else:
                    own += f.moment * share
        return own, damping, lever

    def _carrier(self, kinematics: Kinematics, place: ArmPlace, spin: FloatArray) -> list[float]:
        """Return motion and pitch of the carrier, in its own axes."""
        k, s = self.carrier, self.arm.split(place.y)
        turn = turn_between(self._start.p[k], s.p[k])
        spin_2 = kinematics.frames[k, :3] @ place.bend[k, 3:]
        aside = [s.r[k, 1] - self._start.r[k, 1], turn[1], turn[3], s.v[k, 1], spin[k, 0], spin[k, 2]]
        if not is_still(np.array(aside)):
            raise NotReducibleError(f"body '{self.arm.names[k]}' does not stay in the plane of the track")
        pitch = 2.0 * float(np.arctan2(turn[2], turn[0]))
        sine, cosine = np.sin(pitch), np.cos(pitch)
        (vx, _, vz), (ax, _, az) = s.v[k], place.bend[k, :3]
        into = np.array([[cosine, -sine], [sine, cosine]])
        vx, vz = into @ (vx, vz)
        ax, az = into @ (ax, az)
        return [vx, vz, spin[k, 1], ax, az, spin_2[1], sine, cosine, s.r[k, 0], s.r[k, 2]]

    def _others(self, kinematics: Kinematics, vectors: MovingVectors, spin: FloatArray) -> list[float]:
        """Return value and slope of what stops and friction act on."""
        lines, found = self.arm.forces.lines, []
        lengths = lines.lengths(vectors) if lines.count else None
        angles: dict[str, BodyAngle] = dict(
            zip((s.name for s in self.arm.forces.stops.stops), self._angles, strict=True)
        )
        for f in self._rest():
            if isinstance(f, BumpStop):
                assert lengths is not None
                k = lines.names.index(f.name)
                found += [float(lengths.length[k]), float(lengths.rate[k])]
            elif isinstance(f, AngleStop):
                angle = angles[f.name]
                axis = kinematics.frames[angle.i, :3] @ angle.axis
                found += [angle.at(kinematics), float(axis @ (spin[angle.j] - spin[angle.i]))]
            else:
                assert isinstance(f, SlidingFriction | TurningFriction)
                rate = self._rate_in(self._joints[f.joint], kinematics, spin)
                found += [rate, rate]
        return found

    def _rate_in(self, joint: PairJoint, kinematics: Kinematics, spin: FloatArray) -> float:
        """Return the relative speed in a joint [m or rad per theta]."""
        i, j = self.arm.numbers[joint.body_i], self.arm.numbers[joint.body_j]
        if isinstance(joint, Prismatic):
            frames, origins = kinematics.frames, kinematics.origins
            gap = frames[j] @ np.array(joint.point_j) + origins[j] - frames[i] @ np.array(joint.point_i) - origins[i]
            axis = frames[i] @ np.array(joint.axis_i)
            return float(gap[3:6] @ axis[:3] + gap[:3] @ axis[3:6])
        relative = spin[j] - spin[i]
        if isinstance(joint, Revolute):
            return float(relative @ (kinematics.frames[i, :3] @ np.array(joint.axis_i)))
        return float(np.linalg.norm(relative))
