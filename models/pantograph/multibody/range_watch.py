"""What a mechanism reaches while it runs: its stops, the ends of its cam, heights outside its range."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.pantograph.excursions import Excursions, Place
from models.pantograph.multibody.analysis.cam_design import strip_height_where
from models.pantograph.multibody.elements.angle_elements import BodyAngle
from models.pantograph.multibody.elements.rotations import rotation_matrices
from models.pantograph.multibody.mechanism import Mechanism, MechanismError
from models.pantograph.multibody.mechanism_definition import AngleStop, BumpStop, LiftingMoment

#: Time between two looks [s] (choice: what a stop holds back takes longer).
_EVERY: Final = 0.01
#: An angle this far beyond the cam's table is outside it, and not at its end [rad or m].
_OUTSIDE: Final = 1e-3


class RangeWatch:
    """Looks every 10 ms whether a pantograph is at a stop or out of its range, and tells of it once.

    Parameters
    ----------
    mechanism : Mechanism
        Its cam fitted.
    standing : ndarray, shape (13 n,)
        At rest.
    base_height : float
        Of the base's origin above the rails [m].

    Attributes
    ----------
    told : list of str
        See `Excursions`.
    lowest, highest : float
        Heights of the strip above the rails that the range leads to, infinite where there is no end [m].
    cam_range : (float, float)
        Places of the lifting element that its cam's table is for, infinite without a cam [rad or m].
    """

    def __init__(self, mechanism: Mechanism, standing: FloatArray, base_height: float) -> None:
        self._mechanism = mechanism
        self._excursions = Excursions()
        self.told = self._excursions.told
        self._bumps = [f for f in mechanism.definition.forces if isinstance(f, BumpStop)]
        ends = _range_of_lift(mechanism)
        heights = sorted(
            _height_at(mechanism, standing, place, side) for place, side in zip(ends, (-1, 1), strict=True)
        )
        self.lowest, self.highest = (base_height + h for h in heights)
        cam = mechanism.forces.cam
        first, last = (-math.inf, math.inf) if cam is None else cam.per_lift.range
        self.cam_range = first - _OUTSIDE, last + _OUTSIDE
        self._next = -math.inf
        self._has_met = False

    @classmethod
    def over(cls, mechanism: Mechanism, standing: FloatArray, base_height: float) -> RangeWatch | None:
        """Return a watch, None for a mechanism without stops and cam."""
        forces = mechanism.definition.forces
        has_stops = any(isinstance(f, AngleStop | BumpStop) for f in forces)
        return cls(mechanism, standing, base_height) if has_stops or mechanism.forces.cam is not None else None

    def start(self) -> None:
        """Begin a run."""
        self._excursions.start()
        self._next, self._has_met = -math.inf, False

    def is_due(self, time: float, force: float) -> bool:
        """Return whether it is time to look [s], and note a contact force [N]."""
        self._has_met |= force > 0.0
        if self._next - _EVERY <= time < self._next:
            return False
        self._next = time + _EVERY
        return True

    def look_at_contact(self, force: float, place: Place) -> None:
        """Look at a contact force [N] and its place."""
        self._excursions.check_contact(force, place, self.lowest, self.highest)

    def look(self, y: FloatArray, place: Place, force: float) -> None:
        """Look at a state, shape (13 n,), with the strip at a place, under a contact force [N]."""
        frames = self._frames(y)
        stops = [*self._angle_stops(frames), *self._bump_stops(y, frames)]
        holds = self._mechanism.definition.holds_force
        self._excursions.touch(stops, place, has_met=self._has_met, is_loaded=force > 0.0, is_neutral=holds)
        if not stops:
            self._check_cam(y, frames, place)

    def _angle_stops(self, frames: FloatArray) -> list[str]:
        stops = self._mechanism.forces.stops
        beyond = [
            (stop.name, stop.beyond(angle.of(frames))) for stop, angle in zip(stops.stops, stops.angles, strict=True)
        ]
        return [f"{name} ({'highest' if value > 0.0 else 'lowest'})" for name, value in beyond if value != 0.0]

    def _bump_stops(self, y: FloatArray, frames: FloatArray) -> list[str]:
        found = []
        for stop in self._bumps:
            length = self._length(stop, y, frames)
            if stop.shortest is not None and length < stop.shortest:
                found.append(f"{stop.name} (shortest)")
            elif stop.longest is not None and length > stop.longest:
                found.append(f"{stop.name} (longest)")
        return found

    def _length(self, stop: BumpStop, y: FloatArray, frames: FloatArray) -> float:
        i, j = self._mechanism.numbers[stop.body_i], self._mechanism.numbers[stop.body_j]
        r = y[: 3 * self._mechanism.count].reshape(-1, 3)
        gap = r[j] + frames[j, :3] @ stop.point_j - r[i] - frames[i, :3] @ stop.point_i
        return float(np.sqrt(gap @ gap)) if stop.direction is None else float(gap @ (frames[i, :3] @ stop.direction))

    def _check_cam(self, y: FloatArray, frames: FloatArray, place: Place) -> None:
        """Note that the lifting element is where its cam's table has no value, and holds its last one."""
        cam, where = self._mechanism.forces.cam, self._mechanism.forces.lift_place
        if cam is None or where is None:
            return
        now = where.of(frames) if isinstance(where, BodyAngle) else where.at(self._mechanism.kinematics(y))
        first, last = cam.per_lift.range
        if self.cam_range[0] <= now <= self.cam_range[1] or not self._excursions.is_new("cam", place.time):
            return
        lifting = self._mechanism.definition.lifting
        assert lifting is not None
        is_angle = isinstance(lifting, LiftingMoment)
        shown = [f"{math.degrees(v):.2f} deg" if is_angle else f"{v:.4f} m" for v in (now, first, last)]
        self.told.append(
            f"{place}: '{lifting.name}' is at {shown[0]}, outside the table of its cam, {shown[1]} to {shown[2]}, "
            f"which holds its last value there; the strip is at {place.z:.3f} m"
        )

    def _frames(self, y: FloatArray) -> FloatArray:
        """Return the bodies' rotation matrices as the first rows of their frames, shape (n, 3, 3)."""
        n = self._mechanism.count
        return rotation_matrices(y[3 * n : 7 * n].reshape(n, 4))


def _range_of_lift(mechanism: Mechanism) -> tuple[float, float]:
    """Return the ends of the cam, or the stops of the lifted bodies, infinite where there is none [rad or m]."""
    cam = mechanism.forces.cam
    if cam is not None:
        return cam.per_lift.range
    lifting = mechanism.definition.lifting
    pair = None if lifting is None else (lifting.body_i, lifting.body_j)
    for stop in mechanism.definition.forces:
        if isinstance(stop, AngleStop) and isinstance(lifting, LiftingMoment) and (stop.body_i, stop.body_j) == pair:
            low, high = stop.lowest, stop.highest
            return -math.inf if low is None else low, math.inf if high is None else high
    return -math.inf, math.inf


def _height_at(mechanism: Mechanism, standing: FloatArray, place: float, side: int) -> float:
    """Return the strip's height above the base where the lifting element is at a place; infinite if it cannot be."""
    if math.isfinite(place):
        try:
            return strip_height_where(mechanism, standing, place)
        except (MechanismError, np.linalg.LinAlgError):
            pass
    return side * math.inf
