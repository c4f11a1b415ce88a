"""Where contacts are, along the track and on the strip, from what was recorded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from master.arrays import FloatArray
from master.recording.recording import Recording
from master.system.contacts import Contact


def strip_centre(recording: Recording, contact: Contact, axis: str) -> FloatArray | None:
    """Return the coordinate of the strip's centre, shape (n,), or None if it is not recorded."""
    names = [contact.end(end, axis) for end in "AB"]
    if any(n not in recording for n in names):
        return None
    centre: FloatArray = 0.5 * (recording[names[0]] + recording[names[1]])
    return centre


def track_position(recording: Recording, contact: Contact) -> FloatArray:
    """Return where along the track the contact is [m], shape (n,).

    Without contact (no force) there is no point of contact, and the strip's centre is taken.
    """
    centre = strip_centre(recording, contact, "x")
    if contact.point("x") not in recording:
        return recording.time if centre is None else centre
    point = recording[contact.point("x")]
    if centre is None:
        return point
    return np.where(recording[contact.force] > 0.0, point, centre)


def running_position(recording: Recording, contact: Contact) -> FloatArray:
    """Return where along the track the strip's centre is [m], shape (n,); the contact if the strip is not recorded."""
    centre = strip_centre(recording, contact, "x")
    return track_position(recording, contact) if centre is None else centre


def leading_first(recording: Recording, contacts: Sequence[Contact]) -> list[Contact]:
    """Return contacts in the order in which they pass a point of the track."""
    forward = all(x[-1] >= x[0] for x in (running_position(recording, c) for c in contacts))
    return sorted(contacts, key=lambda c: float(running_position(recording, c)[0]), reverse=forward)


def lateral_position(recording: Recording, contact: Contact) -> FloatArray | None:
    """Return the contact's position on the strip from its centre [m], NaN without contact, shape (n,)."""
    centre = strip_centre(recording, contact, "y")
    if centre is None or contact.point("y") not in recording:
        return None
    offset = recording[contact.point("y")] - centre
    return np.where(recording[contact.force] > 0.0, offset, np.nan)
