"""What happened in a run and when: contact lost, wire at the end of the strip, droppers or supports slack.

Found in what was recorded, by the names of the line's variables, so a foreign line's FMU that has such names is served
alike. An event is as exact in time as its variable is recorded often.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from master.arrays import BoolArray
from master.contacts import Contact, lateral_position, strip_centre, track_position
from master.line import Geometry
from master.recorder import Recording

LOST: Final = "contact lost"
AT_END: Final = "wire beyond the strip's end"
SLACK: Final = "slack"
#: Most events that are listed; a line whose droppers chatter has no end of them.
MOST_EVENTS: Final = 1000
_TENSIONED: Final = re.compile(r"(?P<component>.+?)\.(?P<name>(?:dropper|support)\[\d+\])\.force")


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
        Whether it had not ended when the recording did.
    """

    kind: str
    what: str
    time: float
    duration: float
    position: float | None
    is_open: bool


def find_events(
    recordings: Sequence[Recording], contacts: Iterable[Contact], geometry: Geometry
) -> tuple[Event, ...]:
    """Return the events of a run in the order of their beginnings."""
    found = [e for contact in contacts if len(recordings[0].time) for e in _of_contact(recordings[0], contact)]
    for recording in recordings:
        found += [e for name in recording.names for e in _of_tension(recording, name, geometry)]
    return tuple(sorted(found, key=lambda e: (e.time, e.kind, e.what)))


def _of_contact(recording: Recording, contact: Contact) -> Iterator[Event]:
    if contact.force not in recording:
        return
    touches = recording[contact.force] > 0.0
    where = track_position(recording, contact)
    for first, last in _spells(_after_first(touches) & ~touches):
        yield _event(LOST, contact.pantograph, recording, first, last, float(where[first]))
    for first, last in _spells(_beyond_end(recording, contact)):
        yield _event(AT_END, contact.pantograph, recording, first, last, float(where[first]))


def _beyond_end(recording: Recording, contact: Contact) -> BoolArray:
    """Return when the contact is farther from the strip's middle than its ends."""
    offset, middle = lateral_position(recording, contact), strip_centre(recording, contact, "y")
    if offset is None or middle is None:
        return np.zeros(len(recording.time), dtype=np.bool_)
    half = np.abs(recording[contact.end("A", "y")] - middle)
    beyond: BoolArray = np.abs(offset) > half  # not without contact: NaN is not greater
    return beyond


def _of_tension(recording: Recording, name: str, geometry: Geometry) -> Iterator[Event]:
    match = _TENSIONED.fullmatch(name)
    if match is None or not len(recording.time):
        return
    tight = recording[name] > 0.0
    where = geometry.get(match["component"], {}).get(f"{match['name']}.x")
    for first, last in _spells(_after_first(tight) & ~tight):
        yield _event(SLACK, f"{match['component']}.{match['name']}", recording, first, last, where)


def _event(kind: str, what: str, recording: Recording, first: int, last: int, where: float | None) -> Event:
    time, end = recording.time[first], recording.time[min(last, len(recording.time) - 1)]
    return Event(kind, what, float(time), float(end - time), where, last == len(recording.time))


def _after_first(state: BoolArray) -> BoolArray:
    """Return what is not before the state was first there: what never was cannot be lost.

    Examples
    --------
    >>> _after_first(np.array([False, True, False])).tolist()
    [False, True, True]
    """
    return np.logical_or.accumulate(state)


def _spells(state: BoolArray) -> list[tuple[int, int]]:
    """Return first and last plus one of every stretch in which the state is there.

    Examples
    --------
    >>> _spells(np.array([False, True, True, False, True]))
    [(1, 3), (4, 5)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([False], state, [False]))))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
