"""Where along a line a run begins, is evaluated and ends: from where the wire lies, the train and its speed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Final

from master.errors import RequestError
from master.scenario.value_checks import AFTER_INTERVAL

#: A strip starts this far behind the beginning of the wire's working height [m] (choice).
MARGIN: Final = 10.0
#: The leading pantograph runs this long before its interval [s] (choice), but over no more than this share of the line.
LEAD_IN: Final = 3.0
LEAD_SHARE: Final = 0.4
#: The motion of the start dies out in this time after the raising [s] (choice), as the evaluation has it.
SETTLING: Final = 1.0
#: Most spans that are evaluated unless the user says so (choice: as many as EN 50318 has at least).
MOST_SPANS: Final = 10
#: Pantographs nearer to one another than this would touch [m] (choice).
NEAREST: Final = 1.0
#: Fastest train [m/s]: what our pantographs can be set to.
FASTEST: Final = 170.0


@dataclass(frozen=True)
class Wire:
    """A contact wire, as whoever knows the line says, all in m.

    Attributes
    ----------
    name : str
        Of the line.
    begin, end : float
        Where it is at its working height.
    supports : tuple of float
        Within that.
    lowest, height : float
        Its height: the lowest, and at the supports.
    is_ring : bool
        Whether the line goes on at its beginning.
    overlaps : tuple of (float, float)
        Where a section and the next one both have wires.
    changes_height : bool
        Whether the supports hold it at different heights.
    """

    name: str
    begin: float
    end: float
    supports: tuple[float, ...]
    lowest: float
    height: float
    is_ring: bool = False
    overlaps: tuple[tuple[float, float], ...] = ()
    changes_height: bool = False


@dataclass(frozen=True)
class Stretch:
    """A run along a line: where the pantographs start, and the interval of interest [m]; when it ends [s]."""

    starts: tuple[float, ...]
    interval: tuple[float, float]
    stop: float


def check_speed(speed: float) -> None:
    """Refuse a speed [m/s] that no train has."""
    if not 0.0 < speed <= FASTEST:
        text = f"give the speed of the train in km/h, more than 0 and at most {3.6 * FASTEST:g}"
        raise RequestError(f"--speed {3.6 * speed:g}: {text}")


def stretch(
    wire: Wire | None, speed: float, separations: Sequence[float], interval: tuple[float, float] | None
) -> Stretch:
    """Return where a train begins, is evaluated and ends.

    Parameters
    ----------
    wire : Wire or None
        None if it is not known where the line lies.
    speed : float
        [m/s]
    separations : sequence of float
        From each pantograph to the next one behind it [m].
    interval : (float, float) or None
        Interval of interest; None to choose one.

    Raises
    ------
    RequestError
        If that is not possible on this line.
    """
    check_speed(speed)
    for separation in separations:
        if not NEAREST <= separation < math.inf:
            text = f"pantographs of a train stand at least {NEAREST:g} m apart; give the distance in m"
            raise RequestError(f"--separation {separation:g}: {text}")
    if interval is not None and not interval[0] < interval[1]:
        raise RequestError(f"--interval {interval[0]:g} {interval[1]:g}: the first number must be the smaller one")
    behind = [0.0, *accumulate(separations)]
    if wire is None:
        if interval is None:
            raise RequestError("an FMU does not say where its wire lies: give --interval START END [m]")
        first, chosen = -math.inf, interval
    else:
        first, last = _usable(wire, speed, behind[-1])
        chosen = _checked(wire, first, last, interval) if interval else _chosen(wire, speed, first, last, behind[-1])
    lead = max(first, chosen[0] - 2.0 * LEAD_IN * speed)
    starts = tuple(round(lead - distance, 3) for distance in behind)
    stop = math.ceil(10.0 * ((chosen[1] - starts[-1]) / speed + AFTER_INTERVAL)) / 10.0
    return Stretch(starts, chosen, stop)


def _usable(wire: Wire, speed: float, train: float) -> tuple[float, float]:
    """Return where the leading pantograph can start at the earliest, and the interval end at the latest [m]."""
    if wire.is_ring:
        return wire.begin + train, wire.end
    # The run continues after the last pantograph has passed, while the leading one is ahead of it.
    return wire.begin + MARGIN + train, wire.end - train - AFTER_INTERVAL * speed


def _checked(wire: Wire, first: float, last: float, interval: tuple[float, float]) -> tuple[float, float]:
    if first <= interval[0] and interval[1] <= last:
        return interval
    text = f"the contact wire of {wire.name} is at its working height from {wire.begin:g} to {wire.end:g} m"
    room = f"so the interval must lie between {math.ceil(first)} and {math.floor(last)} m"
    if math.ceil(first) >= math.floor(last):
        room = "so there is no room for this train and an interval"
    reason = "the train starts before it and runs on for 0.5 s after it"
    raise RequestError(f"--interval {interval[0]:g} {interval[1]:g}: {text}, and {reason}, {room}")


def _chosen(wire: Wire, speed: float, first: float, last: float, train: float) -> tuple[float, float]:
    """Return the interval from support to support that leaves the start's motion room to die out."""
    ahead = min(LEAD_IN * speed, LEAD_SHARE * (last - first))
    supports = [x for x in wire.supports if first + ahead <= x <= last]
    if len(supports) < 2:
        train_text = f" of pantographs {train:g} m apart" if train else ""
        text = f"{wire.name} is at its working height from {wire.begin:g} to {wire.end:g} m, too short for a train"
        raise RequestError(
            f"{text}{train_text} at {3.6 * speed:g} km/h: take a longer line, or a slower or shorter train"
        )
    return _about(wire, supports) or (supports[0], supports[MOST_SPANS if len(supports) > MOST_SPANS else -1])


def _about(wire: Wire, supports: Sequence[float]) -> tuple[float, float] | None:
    """Return the interval with the first overlap that has room, in its middle as far as that goes; None without one."""
    count = min(len(supports) - 1, MOST_SPANS)
    windows = [(supports[i], supports[i + count]) for i in range(len(supports) - count)]
    for begin, end in wire.overlaps:
        around = [w for w in windows if w[0] <= begin and end <= w[1]]
        if around:
            return min(around, key=lambda w: abs(w[0] + w[1] - begin - end))
    return None


def contained(wire: Wire | None, way: Stretch) -> tuple[float, float] | None:
    """Return the first overlap that lies in the interval, None if none does."""
    start, end = way.interval
    return next((o for o in (wire.overlaps if wire else ()) if start <= o[0] and o[1] <= end), None)


def early(way: Stretch, speed: float, raised: float) -> str:
    """Return that the interval begins before the motion of the start has died out, empty if it does not.

    Parameters
    ----------
    way : Stretch
    speed : float
        [m/s]
    raised : float
        When the leading pantograph has been raised [s].
    """
    settled = way.starts[0] + speed * (raised + SETTLING)
    if way.interval[0] >= settled:
        return ""
    at, place = way.interval[0], way.starts[0]
    return (
        f"figures are taken from {at:g} m and the pantograph starts at {place:g} m, so its raising and the motion "
        f"after it are in them; begin at {math.ceil(settled)} m or later, with --interval"
    )
