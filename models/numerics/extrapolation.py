"""Inputs of a part between communication points.

Tools exchange values once per macro step and hold them. Held inputs add energy at a stiff contact (they act like a
damping of about -K H), so each part extrapolates its inputs within the step.

A tool may pass values valid at the beginning of the step (jacobi) or, from a part that has already stepped, at its end
(gauss-seidel), and FMI does not tell them apart. The data do: strip and contact point travel along the track at a known
speed, so a position is a time stamp.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from models.arrays import FloatArray, Snapshot

#: Largest deviation of a position, as a share of the travel in a step, at which it still serves as a time stamp.
_STAMP_TOLERANCE = 0.25
#: Travel within a step below which a position is no time stamp [m].
_LEAST_TRAVEL = 1e-9
#: Highest order of the polynomials.
MAX_ORDER = 2
#: Quantities by which a strip's ends are extrapolated.
_MOTION = ("position", "velocity", "acceleration")


def lead_of(position: float, expected: float, speed: float, step: float) -> float:
    """Return how long after the beginning of the step a received position is valid: 0 or ``step`` [s].

    Parameters
    ----------
    position, expected : float
        Received position, and position of the body at the beginning of the step [m].
    speed : float
        Speed along the track [m/s].
    step : float
        Macro step [s].

    Examples
    --------
    >>> lead_of(10.083, 10.0, 83.0, 1e-3), lead_of(10.0, 10.0, 83.0, 1e-3)
    (0.001, 0.0)
    """
    travel = speed * step
    if abs(travel) < _LEAST_TRAVEL:
        return 0.0
    return step if abs((position - expected) / travel - 1.0) < _STAMP_TOLERANCE else 0.0


@dataclass
class ForceExtrapolation:
    """Contact force over a step from its latest values: constant, linear or quadratic in time.

    Attributes
    ----------
    order : int
        0, 1 or 2; lower while fewer values are known.
    times, values : list of float
        Times of the latest values [s] and the values [N], latest first: plain floats, faster than such short arrays.
    known : int
        Number of values received.
    """

    order: int = MAX_ORDER
    times: list[float] = field(default_factory=lambda: [math.nan] * (MAX_ORDER + 1))
    values: list[float] = field(default_factory=lambda: [0.0] * (MAX_ORDER + 1))
    known: int = 0

    def start(self, time: float, force: float) -> None:
        """Begin with a single value."""
        self.known = 0
        self.receive(time, force)

    def receive(self, time: float, force: float) -> None:
        """Take a value valid at ``time``; it replaces one for the same time."""
        if self.known and time <= self.times[0] + 1e-12:
            self.values[0] = force
            return
        self.times = [time, *self.times[:-1]]
        self.values = [force, *self.values[:-1]]
        self.known = min(self.known + 1, MAX_ORDER + 1)

    def receive_at(
        self, time: float, force: float, position: float, expected: float, speed: float, step: float
    ) -> None:
        """Take a value for a step that begins at ``time``, valid when its position says.

        Parameters
        ----------
        position, expected : float
            Received point of application, and position of the strip at ``time`` [m].
        """
        self.receive(time + lead_of(position, expected, speed, step), force)

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        known = np.array([self.known])
        return {"force.times": np.array(self.times), "force.values": np.array(self.values), "force.known": known}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self.times, self.values = (_as_list(snapshot[n], MAX_ORDER + 1) for n in ("force.times", "force.values"))
        self.known = int(snapshot["force.known"][0])

    def at(self, time: float) -> float:
        """Return the force at ``time`` [N], never negative.

        A force of zero stays zero: a lost contact has no trend.
        """
        if self.values[0] == 0.0 and time > self.times[0]:
            return 0.0
        return max(0.0, self._polynomial(time))

    def _polynomial(self, time: float) -> float:
        """Evaluate Newton's divided differences through the latest values."""
        t, f = self.times, self.values
        order = min(self.order, self.known - 1)
        result: float = f[0]
        if order >= 1:
            first = (f[0] - f[1]) / (t[0] - t[1])
            result += first * (time - t[0])
        if order >= 2:
            second = (first - (f[1] - f[2]) / (t[1] - t[2])) / (t[0] - t[2])
            result += second * (time - t[0]) * (time - t[1])
        return result


@dataclass
class StripExtrapolation:
    """Strip ends over a step from their latest positions and velocities.

    Attributes
    ----------
    order : int
        0 holds the positions, 1 continues them by the velocity, 2 also by the change of velocity.
    time : float
        When the values are valid [s].
    position, velocity, acceleration : list of float
        x, y, z of end A, then of end B: plain floats, faster than short arrays. The acceleration is 0 below order 2.
    """

    order: int = MAX_ORDER
    time: float = 0.0
    position: list[float] = field(default_factory=lambda: [0.0] * 6)
    velocity: list[float] = field(default_factory=lambda: [0.0] * 6)
    acceleration: list[float] = field(default_factory=lambda: [0.0] * 6)

    def start(self, time: float, strip: FloatArray) -> None:
        """Begin with a single state, shape (2, 2, 3): end A, B; position, velocity; x, y, z."""
        self.time = time
        self._take(strip)
        self.acceleration = [0.0] * 6

    def receive(self, time: float, strip: FloatArray, step: float) -> None:
        """Take a strip state, shape (2, 2, 3), for a step that begins at ``time``, valid when its position says."""
        known, before, velocity = self.position[0], self.velocity, self._take(strip)
        speed = velocity[0]
        holds = time + lead_of(self.position[0], known + speed * (time - self.time), speed, step)
        if self.order >= 2 and holds > self.time + 1e-12:
            elapsed = holds - self.time
            self.acceleration = [(new - old) / elapsed for new, old in zip(velocity, before, strict=True)]
        self.time = holds

    def at(self, time: float, out: FloatArray) -> FloatArray:
        """Write positions and velocities at ``time`` into ``out``, shape (2, 2, 3)."""
        tau = time - self.time
        position, velocity = self.position, self.velocity
        if self.order >= 1 and tau != 0.0:
            half, acceleration = 0.5 * (tau * tau), self.acceleration
            position = [p + tau * v + half * a for p, v, a in zip(position, velocity, acceleration, strict=True)]
            velocity = [v + tau * a for v, a in zip(velocity, acceleration, strict=True)]
        flat = position[:3] + velocity[:3] + position[3:] + velocity[3:]  # faster to copy than when nested
        out[...] = np.array(flat).reshape(2, 2, 3)
        return out

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        motion = {f"strip.{name}": np.array(getattr(self, name)) for name in _MOTION}
        return {"strip.time": np.array([self.time]), **motion}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self.time = float(snapshot["strip.time"][0])
        self.position, self.velocity, self.acceleration = (_as_list(snapshot[f"strip.{name}"], 6) for name in _MOTION)

    def _take(self, strip: FloatArray) -> list[float]:
        """Take positions and velocities, and return the velocities."""
        (a, velocity_a), (b, velocity_b) = strip.tolist()
        self.position, self.velocity = a + b, velocity_a + velocity_b
        return self.velocity


def _as_list(values: npt.ArrayLike, count: int) -> list[float]:
    """Return numbers as a list; raises ``ValueError`` if there are not ``count`` of them."""
    numbers: list[float] = np.asarray(values, dtype=np.float64).reshape(count).tolist()
    return numbers
