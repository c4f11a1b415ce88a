"""What depends on the angle between two bodies: the cam of a lifting element, stops of an arm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from models.arrays import FloatArray
from models.numerics.cubic_curve import CubicCurve
from models.pantograph.multibody.elements.moving_vectors import Kinematics
from models.pantograph.multibody.elements.rotations import normals
from models.pantograph.multibody.mechanism_definition import AngleStop, AxisMoment, LineForce


class BodyAngle:
    """The angle of body j about an axis of body i, counted from where both are written.

    Parameters
    ----------
    moment : AxisMoment
        Names the bodies and the axis.
    numbers : dict
        Body name -> number.
    orientations : ndarray, shape (n, 3, 3)
        Of the bodies as written.
    """

    def __init__(self, moment: AxisMoment, numbers: dict[str, int], orientations: FloatArray) -> None:
        self.i, self.j = numbers[moment.body_i], numbers[moment.body_j]
        self.axis = np.array(moment.axis_i)
        across, _ = normals(self.axis)
        side = np.cross(self.axis, across)
        self._plane = np.stack([across, side], axis=1)
        self._hand = orientations[self.j].T @ orientations[self.i] @ across

    def numbers(self) -> list[float]:
        """Return the bodies, the axis, the two directions across it and what body j points with, 14 numbers."""
        return [self.i, self.j, *self.axis, *self._plane.T.ravel(), *self._hand]

    def at(self, kinematics: Kinematics) -> float:
        """Return the angle [rad]."""
        return self.of(kinematics.frames)

    def of(self, frames: FloatArray) -> float:
        """Return the angle [rad] in frames of shape (n, 9, 3)."""
        hand = frames[self.j, :3] @ self._hand
        along, aside = (hand @ frames[self.i, :3] @ self._plane).tolist()
        return math.atan2(aside, along)

    def rate(self, frames: FloatArray, w: FloatArray) -> float:
        """Return its rate [rad/s]; w are the body-fixed angular velocities, shape (n, 3)."""
        relative = frames[self.j, :3] @ w[self.j] - frames[self.i, :3] @ w[self.i]
        return float(relative @ (frames[self.i, :3] @ self.axis))


class PointDistance:
    """The length between the points of a lifting force, or along its direction."""

    def __init__(self, force: LineForce, numbers: dict[str, int]) -> None:
        self._i, self._j = numbers[force.body_i], numbers[force.body_j]
        self._point_i, self._point_j = np.array(force.point_i), np.array(force.point_j)
        self._direction = None if force.direction is None else np.array(force.direction)

    def numbers(self) -> list[float]:
        """Return the bodies, the points and the direction, 0 if there is none, 11 numbers."""
        direction = np.zeros(3) if self._direction is None else self._direction
        return [self._i, self._j, *self._point_i, *self._point_j, *direction]

    @property
    def is_directed(self) -> bool:
        """Whether it is along a direction."""
        return self._direction is not None

    def at(self, kinematics: Kinematics) -> float:
        """Return the length [m]."""
        frames, origins = kinematics.frames, kinematics.origins
        gap = frames[self._j, :3] @ self._point_j + origins[self._j, :3]
        gap = gap - frames[self._i, :3] @ self._point_i - origins[self._i, :3]
        if self._direction is None:
            return float(np.sqrt(gap @ gap))
        return float(gap @ (frames[self._i, :3] @ self._direction))


class Cam(NamedTuple):
    """How a lifting element's moment (or force) depends on where it stands.

    Attributes
    ----------
    for_weights : CubicCurve or None
        What it gives without any lift set [N.m or N]; None: nothing.
    per_lift : CubicCurve
        What it gives besides, for each unit of the lift set.
    """

    for_weights: CubicCurve | None
    per_lift: CubicCurve

    def value(self, place: float, lift: float) -> float:
        """Return moment [N.m] or force [N] at a place, for a lift set."""
        own = 0.0 if self.for_weights is None else self.for_weights.at(place)
        return own + lift * self.per_lift.at(place)

    def lift_of(self, place: float, value: float) -> float:
        """Return the lift set that would give a moment [N.m] or force [N] at a place; 0 where none does."""
        per_lift = self.per_lift.at(place)
        return (value - self.value(place, 0.0)) / per_lift if per_lift != 0.0 else 0.0


class AngleStops:
    """Stops of angles: springs and dampers beyond a lowest and a highest angle; they push back, never pull."""

    def __init__(self, stops: Sequence[AngleStop], numbers: dict[str, int], orientations: FloatArray) -> None:
        self.stops = tuple(stops)
        self.angles = tuple(BodyAngle(s, numbers, orientations) for s in stops)

    def add_loads(self, loads: FloatArray, frames: FloatArray, w: FloatArray) -> None:
        """Add the stops' moments to loads of shape (n, 6)."""
        for stop, angle in zip(self.stops, self.angles, strict=True):
            beyond = stop.beyond(angle.of(frames))
            if beyond == 0.0:
                continue
            moment = stop.stiffness * beyond + stop.damping * angle.rate(frames, w)
            moment = max(moment, 0.0) if beyond > 0.0 else min(moment, 0.0)
            about = frames[angle.i, :3] @ (moment * angle.axis)
            loads[angle.j, 3:] -= about
            loads[angle.i, 3:] += about

    def table(self) -> FloatArray:
        """Return the numbers of the angle, lowest and highest one, stiffness and damping of every stop, 18 numbers."""
        rows = []
        for stop, angle in zip(self.stops, self.angles, strict=True):
            lowest = -math.inf if stop.lowest is None else stop.lowest
            highest = math.inf if stop.highest is None else stop.highest
            rows.append([*angle.numbers(), lowest, highest, stop.stiffness, stop.damping])
        return np.array(rows).reshape(-1, 18)

    def energy(self, frames: FloatArray) -> float:
        """Return the energy stored [J]."""
        pairs = zip(self.stops, self.angles, strict=True)
        return sum(0.5 * s.stiffness * s.beyond(a.of(frames)) ** 2 for s, a in pairs)

    def touched(self, frames: FloatArray) -> tuple[str, ...]:
        """Return the names of the stops that are reached."""
        pairs = zip(self.stops, self.angles, strict=True)
        return tuple(s.name for s, a in pairs if s.beyond(a.of(frames)) != 0.0)
