"""Static geometry of the line, uplift of the supports and what is slack, as the catenary FMU reports them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from master.arrays import BoolArray, FloatArray
from master.evaluation.filters import stands_in
from master.recording.recording import Recording
from master.recording.static_geometry import Geometry

#: Calculated parameter of a line that closes on itself: the length after which it repeats [m].
PERIOD: Final = "period"
#: Most laps on a line that closes on itself.
_MOST_LAPS: Final = 10_000
_INDEXED: Final = re.compile(r"(support|dropper)\[(\d+)\]\.(.+)")
_TENSIONED: Final = re.compile(r"(.+?)\.((?:support|dropper)\[\d+\])\.(force|slack)")


@dataclass(frozen=True)
class Uplift:
    """Largest uplift of a support over the whole run.

    Attributes
    ----------
    component : str
        The catenary.
    support : int
        Number of the support.
    x : float, optional
        Its position along the track [m], if the FMU gives it.
    section : int, optional
        Its section, if the line has several.
    period : float
        Length after which the line repeats, and with it the support [m]; 0 if it does not.
    maximum : float
        Largest uplift [m].
    time : float
        When it occurs [s].
    """

    component: str
    support: int
    x: float | None
    maximum: float
    time: float
    section: int | None = None
    period: float = 0.0

    @property
    def place(self) -> str:
        """Where it stands, short and unambiguous, for tables and legends."""
        where = f"{self.x:.0f} m" if self.x is not None else f"support {self.support}"
        return where if self.section is None else f"{where} (section {self.section})"

    def stands_in(self, interval: tuple[float | None, float | None]) -> bool:
        """Return whether the support stands in an interval of the track [m], its ends included."""
        return stands_in(self.x, interval, self.period)


@dataclass(frozen=True)
class Slackness:
    """When a dropper is slack, or a support whose force is recorded.

    Attributes
    ----------
    component : str
        The catenary.
    name : str
        ``dropper[n]`` or ``support[n]``.
    time : ndarray, shape (n,)
        Times of the samples [s].
    slack : ndarray of bool, shape (n,)
        Whether it is slack at these times.
    """

    component: str
    name: str
    time: FloatArray
    slack: BoolArray


def indexed(geometry: Mapping[str, float], kind: str, name: str) -> FloatArray:
    """Return the values ``kind[1].name, kind[2].name, ...``, shape (n,); empty if there are none.

    Examples
    --------
    >>> indexed({"support[1].x": 0.0, "support[2].x": 50.0}, "support", "x").tolist()
    [0.0, 50.0]
    """
    found = {
        int(m[2]): v for k, v in geometry.items() if (m := _INDEXED.fullmatch(k)) and m[1] == kind and m[3] == name
    }
    return np.array([found[i] for i in sorted(found)])


def aligned(geometry: Mapping[str, float], kind: str, names: Sequence[str]) -> dict[str, FloatArray]:
    """Return values of the supports or droppers whose ``x`` is known, side by side; NaN where one is missing.

    Examples
    --------
    >>> known = {"support[1].x": 0.0, "support[2].x": 50.0, "support[2].z": 5.0, "support[3].z": 6.0}
    >>> {name: values.tolist() for name, values in aligned(known, "support", ("x", "z")).items()}
    {'x': [0.0, 50.0], 'z': [nan, 5.0]}
    """
    numbers = sorted(int(m[2]) for k in geometry if (m := _INDEXED.fullmatch(k)) and (m[1], m[3]) == (kind, "x"))
    return {name: np.array([geometry.get(f"{kind}[{i}].{name}", math.nan) for i in numbers]) for name in names}


def period_of(geometry: Mapping[str, float]) -> float:
    """Return the length after which a line that closes on itself repeats [m]; 0 if it does not."""
    return max(0.0, geometry.get(PERIOD, 0.0))


def laps(geometry: Mapping[str, float], limits: tuple[float, float]) -> FloatArray:
    """Return the shifts of a line along the track that put it between two positions [m].

    Parameters
    ----------
    limits : (float, float)
        Both positions [m].

    Returns
    -------
    ndarray, shape (n,)
        Whole periods for a line that closes on itself; a single 0 for one that ends.

    Examples
    --------
    >>> laps({"period": 100.0, "support[1].x": 0.0, "support[2].x": 50.0}, (120.0, 310.0)).tolist()
    [100.0, 200.0, 300.0]
    """
    period, x = period_of(geometry), indexed(geometry, "support", "x")
    if not period or not len(x):
        return np.zeros(1)
    return period * _whole(*((limit - x.min()) / period for limit in limits))


def _whole(first: float, last: float) -> FloatArray:
    """Return the whole numbers from the one at or below ``first`` to that at or below ``last``, shape (n,).

    If there are more than any run has laps, the positions are meaningless, and there are none.
    """
    if not last - first <= _MOST_LAPS:
        return np.zeros(0)
    return np.arange(math.floor(first), math.floor(last) + 1, dtype=np.float64)


def met(geometry: Mapping[str, float], kind: str, limits: tuple[float, float]) -> FloatArray:
    """Return where supports or droppers are passed between two positions of the track [m], shape (n,).

    On a line that closes on itself they are passed once per lap.

    Examples
    --------
    >>> met({"period": 100.0, "support[1].x": 0.0, "support[2].x": 50.0}, "support", (120.0, 310.0)).tolist()
    [150.0, 200.0, 250.0, 300.0]
    """
    x = (laps(geometry, limits)[:, None] + indexed(geometry, kind, "x")).ravel()
    return x[(x >= limits[0]) & (x <= limits[1])]


def passages(
    x: float, interval: tuple[float | None, float | None], travelled: tuple[float, float], period: float = 0.0
) -> FloatArray:
    """Return where a point of the line is passed within an interval of the track, shape (n,) [m].

    Parameters
    ----------
    x : float
        The point [m].
    interval : (float or None, float or None)
        Ends of the interval [m]; None where it has none.
    travelled : (float, float)
        Positions between which the run goes [m]: on a line that repeats there is no lap beyond.
    period : float
        Length after which the line repeats [m]; 0 if it does not: then the point is passed once.

    Examples
    --------
    >>> passages(20.0, (110.0, None), (0.0, 330.0), 100.0).tolist()
    [120.0, 220.0, 320.0]
    >>> passages(20.0, (110.0, None), (0.0, 330.0)).tolist()
    []
    """
    start = -math.inf if interval[0] is None else interval[0]
    end = math.inf if interval[1] is None else interval[1]
    if not period:
        return np.array([x] if start <= x <= end else [])
    start, end = max(start, travelled[0]), min(end, travelled[1])
    places: FloatArray = x + period * _whole((start - x) / period, (end - x) / period)
    return places[(places >= start) & (places <= end)]


def by_section(geometry: Mapping[str, float]) -> tuple[dict[str, float], ...]:
    """Return the static geometry of each section of a line; that of a line of one section unchanged.

    Examples
    --------
    >>> two = {"support[1].x": 0.0, "support[1].section": 1.0, "support[2].x": 5.0, "support[2].section": 2.0}
    >>> [indexed(one, "support", "x").tolist() for one in by_section(two)]
    [[0.0], [5.0]]
    """
    owner = {(m[1], m[2]): v for k, v in geometry.items() if (m := _INDEXED.fullmatch(k)) and m[3] == "section"}
    if not owner:
        return (dict(geometry),)
    return tuple(
        {k: v for k, v in geometry.items() if (m := _INDEXED.fullmatch(k)) and owner.get((m[1], m[2])) == section}
        for section in sorted(set(owner.values()))
    )


def slackness(recordings: Iterable[Recording]) -> tuple[Slackness, ...]:
    """Return when those droppers and supports are slack for which this is recorded.

    A line reports it itself, as ``dropper[n].slack``, because a slack dropper whose damper still acts carries a force
    all the same. Where it does not (a foreign line, results of an older version), what carries no tension is slack.

    Examples
    --------
    >>> names = ("line.dropper[1].force", "line.dropper[1].slack", "line.dropper[2].force")
    >>> values = np.array([[50.0, 0.0, 50.0], [-3.0, 1.0, 50.0], [8.0, 1.0, 0.0]])
    >>> found = slackness([Recording(np.arange(3.0), names, ("N", "1", "N"), values)])
    >>> [(s.name, s.slack.tolist()) for s in found]
    [('dropper[1]', [False, True, True]), ('dropper[2]', [False, False, True])]
    """
    reported: dict[tuple[str, str], Slackness] = {}
    pulling: dict[tuple[str, str], Slackness] = {}
    for recording in recordings:
        for name, values in zip(recording.names, recording.values.T, strict=True) if len(recording.time) else ():
            match = _TENSIONED.fullmatch(name)
            if match is not None:
                found, slack = (pulling, values <= 0.0) if match[3] == "force" else (reported, values > 0.5)
                found.setdefault((match[1], match[2]), Slackness(match[1], match[2], recording.time, slack))
    return tuple((pulling | reported).values())


def support_uplifts(recordings: tuple[Recording, ...], geometry: Geometry) -> tuple[Uplift, ...]:
    """Return the largest uplift of every recorded support, in the order of the supports."""
    found = [
        _uplift(recording, name, geometry)
        for recording in recordings
        if len(recording.time)
        for name in recording.matching("*.support[*].uplift")
    ]
    return tuple(sorted(found, key=lambda u: (u.component, u.support)))


def _uplift(recording: Recording, full: str, geometry: Geometry) -> Uplift:
    component, _, name = full.partition(".support[")
    number = int(name.partition("]")[0])
    values = recording[full]
    peak = int(np.argmax(values))
    known = geometry.get(component, {})
    x, section = known.get(f"support[{number}].x"), known.get(f"support[{number}].section")
    peak_time = float(recording.time[peak])
    return Uplift(
        component,
        number,
        x,
        float(values[peak]),
        peak_time,
        None if section is None else round(section),
        period_of(known),
    )
