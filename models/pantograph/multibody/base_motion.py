"""What the base and the contact point of a mechanism do within a step, from what was received for its beginning."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np

from models.arrays import FloatArray, Snapshot

#: A contact point that wanders faster across the track than this has jumped, from wire to wire say [m/s].
_FASTEST_SWEEP: Final = 5.0


@dataclass
class LateralExtrapolation:
    """Lateral position of the contact over a step: linear through its last two values, held after a jump.

    Attributes
    ----------
    times, values : list of float
        Last value first [s, m]: plain floats, faster than such short arrays.
    rate : float
        [m/s]
    """

    times: list[float] = field(default_factory=lambda: [0.0, 0.0])
    values: list[float] = field(default_factory=lambda: [0.0, 0.0])
    rate: float = 0.0

    def start(self, time: float, value: float) -> None:
        """Forget everything but one value."""
        self.times = [time, time]
        self.values = [value, value]
        self.rate = 0.0

    def receive(self, time: float, value: float) -> None:
        """Take a value that holds at ``time``; one for the same time replaces the last."""
        if time > self.times[0] + 1e-12:
            self.times = [time, self.times[0]]
            self.values = [value, self.values[0]]
        self.values[0] = value
        elapsed = self.times[0] - self.times[1]
        rate = (self.values[0] - self.values[1]) / elapsed if elapsed > 0.0 else 0.0
        self.rate = rate if abs(rate) <= _FASTEST_SWEEP else 0.0

    def at(self, time: float) -> float:
        """Return the position at ``time`` [m]."""
        return self.values[0] + self.rate * (time - self.times[0])

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        rate = np.array([self.rate])
        known = {"lateral.times": np.array(self.times), "lateral.values": np.array(self.values)}
        return {**known, "lateral.rate": rate}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self.times, self.values = (snapshot[f"lateral.{name}"].tolist() for name in ("times", "values"))
        self.rate = float(snapshot["lateral.rate"][0])


@dataclass
class BaseMotion:
    """One coordinate of the roof over a step, its height say: smooth, and at its end where the inputs lead.

    A cubic joins where the base is to where its received height and velocity, and the trend of the velocity, will have
    taken it by the end of the step; so the base never jumps, whatever the inputs do.

    Attributes
    ----------
    name : str
        Begins the names of its arrays in a snapshot.
    now : ndarray, shape (2,)
        Height and velocity of the base [m, m/s].
    received : ndarray, shape (2,)
        Velocity received last [m/s], and how long before this step that was (0: never) [s].
    cubic : ndarray, shape (4,)
        Coefficients of the present step, constant one first.
    """

    name: str = "base"
    now: FloatArray = field(default_factory=lambda: np.zeros(2))
    received: FloatArray = field(default_factory=lambda: np.zeros(2))
    cubic: FloatArray = field(default_factory=lambda: np.zeros(4))

    def start(self, base: FloatArray) -> None:
        """Begin at a height and velocity."""
        self.now[...] = base
        self.received[...] = base[1], 0.0
        self.cubic[...] = base[0], base[1], 0.0, 0.0

    def receive(self, base: FloatArray, step: float) -> None:
        """Plan the motion over a step from the height and velocity at its beginning, shape (2,)."""
        z, v = float(base[0]), float(base[1])
        since = float(self.received[1])
        trend = (v - float(self.received[0])) / since if since > 0.0 else 0.0
        end, end_speed = z + v * step + 0.5 * trend * step**2, v + trend * step
        z0, v0 = float(self.now[0]), float(self.now[1])
        mean = (end - z0) / step
        self.cubic[...] = z0, v0, (3.0 * mean - 2.0 * v0 - end_speed) / step, (v0 + end_speed - 2.0 * mean) / step**2
        self.received[...] = v, step

    def at(self, tau: float) -> tuple[float, float, float]:
        """Return height, velocity and acceleration at ``tau`` [s] after the step's beginning."""
        a, b, c, d = self.cubic.tolist()
        return (
            a + tau * (b + tau * (c + tau * d)),
            b + tau * (2.0 * c + 3.0 * tau * d),
            2.0 * c + 6.0 * tau * d,
        )

    def finish(self, step: float) -> None:
        """Move to the end of the step."""
        self.now[...] = self.at(step)[:2]

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        names = ("now", "received", "cubic")
        return {f"{self.name}.{name}": getattr(self, name).copy() for name in names}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        for name in ("now", "received", "cubic"):
            getattr(self, name)[...] = snapshot[f"{self.name}.{name}"]


class Sway(NamedTuple):
    """How the roof sways at one instant; each a value, its rate and its acceleration.

    Attributes
    ----------
    y : tuple of float
        Lateral position [m, m/s, m/s2].
    roll, yaw : tuple of float
        Angles about x and z through the base's origin [rad, rad/s, rad/s2]; the roof yaws first, then rolls about its
        own x axis.
    """

    y: tuple[float, float, float]
    roll: tuple[float, float, float]
    yaw: tuple[float, float, float]


class SwayMotion:
    """The roof's lateral motion, roll and yaw over a step, each as `BaseMotion` has it.

    Attributes
    ----------
    is_still : bool
        Whether nothing has ever moved: the roof then needs no angles.
    """

    def __init__(self) -> None:
        self._coordinates = tuple(BaseMotion(f"base.{name}") for name in Sway._fields)
        self.is_still = True

    def start(self, sway: tuple[float, ...]) -> None:
        """Begin at values and rates, as in `operation.Drive.sway`."""
        for coordinate, (value, rate) in self._paired(sway):
            coordinate.start(np.array([value, rate]))
        self.is_still = not any(sway)

    def receive(self, sway: tuple[float, ...], step: float) -> None:
        """Plan the motion over a step [s] from the values and rates at its beginning."""
        self.is_still = self.is_still and not any(sway)
        if not self.is_still:
            for coordinate, pair in self._paired(sway):
                coordinate.receive(np.array(pair), step)

    def at(self, tau: float) -> Sway | None:
        """Return the motion at ``tau`` [s] after the step's beginning, None while nothing has ever moved."""
        return None if self.is_still else Sway(*(coordinate.at(tau) for coordinate in self._coordinates))

    def finish(self, step: float) -> None:
        """Move to the end of the step."""
        if not self.is_still:
            for coordinate in self._coordinates:
                coordinate.finish(step)

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        found: Snapshot = {"base.is_still": np.array([float(self.is_still)])}
        for coordinate in self._coordinates:
            found |= coordinate.snapshot()
        return found

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self.is_still = bool(snapshot["base.is_still"][0])
        for coordinate in self._coordinates:
            coordinate.restore(snapshot)

    def _paired(self, sway: tuple[float, ...]) -> Iterator[tuple[BaseMotion, tuple[float, float]]]:
        return zip(self._coordinates, zip(sway[0::2], sway[1::2], strict=True), strict=True)
