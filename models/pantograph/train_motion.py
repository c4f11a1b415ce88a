"""Where a pantograph is along the track: at constant speed, by a speed profile, or as inputs say."""

from __future__ import annotations

import bisect
import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from models.arrays import Snapshot
from models.definition_files.field_schema import series
from models.numerics.extrapolation import lead_of

#: Longitudinal acceleration that no train reaches in operation [m/s2]; emergency brakes stay below.
LARGEST_ACCELERATION: Final = 3.0
_FEWEST: Final = 2


@dataclass(frozen=True, kw_only=True)
class SpeedProfile:
    """Speed over time, from the beginning of the run: linear between the times, held before and after them."""

    time: tuple[float, ...] = series("s", "time from the beginning of the run", minimum=0.0, maximum=1e5)
    speed: tuple[float, ...] = series("m/s", "speed along the track", minimum=0.0, maximum=170.0)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the table."""
        if len(self.time) != len(self.speed):
            yield "speed", f"has {len(self.speed)} values for {len(self.time)} of 'time'"
        elif len(self.time) < _FEWEST:
            yield "time", "has one value where a profile takes at least 2; for a constant speed write 'speed'"
        elif falls := [b for a, b in itertools.pairwise(self.time) if not b > a]:
            yield "time", f"must rise from value to value; {falls[0]:g} does not"

    def segments(self) -> tuple[tuple[float, float, float, float], ...]:
        """Return pieces of constant acceleration: begin [s], distance and speed there [m, m/s], acceleration [m/s2].

        The first begins at 0, the last never ends. Pieces of the same acceleration are one, so that a speed that does
        not change is one product with the time.
        """
        times, speeds = (0.0, *self.time), (self.speed[0], *self.speed)
        pieces: list[tuple[float, float, float, float]] = []
        distance = 0.0
        for k, (t, v) in enumerate(zip(times, speeds, strict=True)):
            last = k + 1 == len(times)
            length = 0.0 if last else times[k + 1] - t
            if length == 0.0 and not last:
                continue  # the table begins at 0
            slope = 0.0 if last else (speeds[k + 1] - v) / length
            if not pieces or pieces[-1][3] != slope:
                pieces.append((t, distance, v, slope))
            if not last:
                distance += 0.5 * (v + speeds[k + 1]) * length
        return tuple(pieces)


class Travel(NamedTuple):
    """Motion along the track at one instant: position, speed, acceleration [m, m/s, m/s2]."""

    x: float
    speed: float
    acceleration: float


class TrainMotion:
    """A pantograph's motion along the track.

    Parameters
    ----------
    start : float
        Position at time 0 [m].
    speed : float
        Constant speed [m/s]; of no account with a profile or with inputs.
    profile : SpeedProfile or None
    by_inputs : bool
        Whether the position is ``start`` and what is received.

    Attributes
    ----------
    by_inputs : bool
    told : str
        What the user should know of the motion received last; empty if nothing.
    """

    def __init__(self, start: float, speed: float, profile: SpeedProfile | None, by_inputs: bool) -> None:
        self._start = start
        self._segments = ((0.0, 0.0, speed, 0.0),) if profile is None else profile.segments()
        self._begins = [s[0] for s in self._segments]
        self._is_one_piece = len(self._segments) == 1
        # Of one piece without acceleration: the speed.
        self._steady = self._segments[0][2] if self._is_one_piece and not by_inputs else None
        self.by_inputs = by_inputs
        self._began = 0.0
        # Of inputs: when the last ones held, position and speed then, the trend of the speed.
        self._last = (0.0, 0.0, 0.0, 0.0)
        self._is_told = False
        self.told = ""

    def begin(self, time: float, train: tuple[float, float]) -> None:
        """Begin at a time [s], with position and speed as inputs say [m, m/s]."""
        self._began = time
        self._last = (time, *train, 0.0)
        self._is_told = False

    def receive(self, time: float, train: tuple[float, float], step: float) -> None:
        """Take position and speed for a step [s] that begins at ``time``, or for its end if the position says so."""
        if not self.by_inputs:
            return
        x, speed = train
        then, _, before, trend = self._last
        now = self.at(time)
        holds = time + lead_of(self._start + x, now.x, now.speed, step)
        if holds > then + 1e-12:
            trend = (speed - before) / (holds - then)
        self._last = (holds, x, speed, trend)
        self.told = ""
        if abs(trend) > LARGEST_ACCELERATION and not self._is_told:
            self._is_told = True
            self.told = (
                f"train.vx changes by {trend:.3g} m/s2 at t = {time:.6g} s: no train accelerates by more than "
                f"{LARGEST_ACCELERATION:g} m/s2; check its unit and its smoothness"
            )

    def at(self, time: float, inside: float | None = None) -> Travel:
        """Return the motion at a time [s], with the acceleration of the piece that another lies in, if one is given."""
        if self.by_inputs:
            holds, x, speed, trend = self._last
            tau = time - holds
            return Travel(self._start + (x + tau * (speed + 0.5 * trend * tau)), speed + trend * tau, trend)
        elapsed = time - self._began
        within = elapsed if inside is None else inside - self._began
        k = 0 if self._is_one_piece else max(0, bisect.bisect_right(self._begins, within) - 1)
        begin, distance, speed, slope = self._segments[k]
        if slope == 0.0 and distance == 0.0 and begin == 0.0:
            return Travel(self._start + speed * elapsed, speed, 0.0)
        tau = elapsed - begin
        return Travel(self._start + (distance + tau * (speed + 0.5 * slope * tau)), speed + slope * tau, slope)

    def way(self, begin: float, step: float) -> tuple[float, float, float, float]:
        """Return where a step from a time begins, the speed at its middle, where it ends and the speed there.

        Parameters
        ----------
        begin, step : float
            [s]
        """
        end, speed = begin + step, self._steady
        if speed is not None:  # as `at` says, in one go
            start, began = self._start, self._began
            return start + speed * (begin - began), speed, start + speed * (end - began), speed
        x, _, _ = self.at(begin)
        last = self.at(end)
        return x, self.at(begin + 0.5 * step).speed, last.x, last.speed

    def kinks(self, time: float) -> tuple[float, ...]:
        """Return how long after a time the acceleration changes [s], negative ones among them."""
        return tuple(b - (time - self._began) for b in self._begins[1:])

    def snapshot(self) -> Snapshot:
        """Return the whole state."""
        return {"train": np.array([self._began, *self._last, float(self._is_told)])}

    def restore(self, snapshot: Snapshot) -> None:
        """Take over a snapshot."""
        self._began, then, x, speed, trend, told = snapshot["train"].tolist()
        self._last, self._is_told = (then, x, speed, trend), bool(told)


def acceleration_warning(profile: SpeedProfile | None) -> str:
    """Say so if a profile accelerates as no train does; empty if not."""
    wild = [s for s in (profile.segments() if profile else ()) if abs(s[3]) > LARGEST_ACCELERATION]
    if not wild:
        return ""
    return (
        f"speed_profile accelerates by {wild[0][3]:.3g} m/s2 at t = {wild[0][0]:g} s: no train does by more than "
        f"{LARGEST_ACCELERATION:g} m/s2; check its units"
    )
