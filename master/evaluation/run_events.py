"""What happened in a run and when: contact lost, wire at the end of the strip, droppers or supports slack.

Events are found in the recordings by the names of the line's variables, so this works for the FMU of a foreign line
with such names too. An event is as exact in time as the sampling of its variable.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from master.arrays import BoolArray, FloatArray
from master.evaluation.contact_positions import lateral_position, strip_centre, track_position
from master.evaluation.line_geometry import Slackness, slackness
from master.recording.recording import Recording
from master.recording.static_geometry import Geometry
from master.system.contacts import Contact

LOST: Final = "contact lost"
AT_END: Final = "wire beyond the strip's end"
SLACK: Final = "slack"
#: Most events that are listed: a line whose droppers chatter has any number of them.
MOST_EVENTS: Final = 1000


@dataclass(frozen=True)
class Event:
    """Something that began at a time and lasted.

    Attributes
    ----------
    kind : str
        `LOST`, `AT_END` or `SLACK`.
    what : str
        The pantograph's component, or ``component.dropper[n]``.
    time, duration : float
        When it began and how long it lasted [s], by recorded samples.
    position : float, optional
        Where along the track, at its beginning [m].
    is_open : bool
        Whether it was still going on when the recording ended.
    """

    kind: str
    what: str
    time: float
    duration: float
    position: float | None
    is_open: bool


def find_events(recordings: Sequence[Recording], contacts: Iterable[Contact], geometry: Geometry) -> tuple[Event, ...]:
    """Return the events of a run, ordered by when they begin."""
    found = [e for contact in contacts if len(recordings[0].time) for e in _of_contact(recordings[0], contact)]
    found += [e for each in slackness(recordings) for e in _of_slackness(each, geometry)]
    return tuple(sorted(found, key=lambda e: (e.time, e.kind, e.what)))


def _of_contact(recording: Recording, contact: Contact) -> Iterator[Event]:
    if contact.force not in recording:
        return
    touches = recording[contact.force] > 0.0
    where = track_position(recording, contact)
    for first, last in _spells(_after_first(touches) & ~touches):
        yield _event(LOST, contact.pantograph, recording.time, first, last, float(where[first]))
    for first, last in _spells(_beyond_end(recording, contact)):
        yield _event(AT_END, contact.pantograph, recording.time, first, last, float(where[first]))


def _beyond_end(recording: Recording, contact: Contact) -> BoolArray:
    """Return when the contact is farther from the strip's centre than its ends."""
    offset, middle = lateral_position(recording, contact), strip_centre(recording, contact, "y")
    if offset is None or middle is None:
        return np.zeros(len(recording.time), dtype=np.bool_)
    half = np.abs(recording[contact.end("A", "y")] - middle)
    beyond: BoolArray = np.abs(offset) > half  # never without contact: NaN compares as false
    return beyond


def _of_slackness(found: Slackness, geometry: Geometry) -> Iterator[Event]:
    where = geometry.get(found.component, {}).get(f"{found.name}.x")
    for first, last in _spells(_after_first(~found.slack) & found.slack):
        yield _event(SLACK, f"{found.component}.{found.name}", found.time, first, last, where)


def _event(kind: str, what: str, times: FloatArray, first: int, last: int, where: float | None) -> Event:
    time, end = times[first], times[min(last, len(times) - 1)]
    return Event(kind, what, float(time), float(end - time), where, last == len(times))


def _after_first(state: BoolArray) -> BoolArray:
    """Return what is not before the state first held: what never was cannot be lost.

    Examples
    --------
    >>> _after_first(np.array([False, True, False])).tolist()
    [False, True, True]
    """
    return np.logical_or.accumulate(state)


def _spells(state: BoolArray) -> list[tuple[int, int]]:
    """Return first index and last index plus one of every stretch in which the state holds.

    Examples
    --------
    >>> _spells(np.array([False, True, True, False, True]))
    [(1, 3), (4, 5)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([False], state, [False]))))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
