"""Whether a recording covers the interval of interest: figures of a part are not those of the interval."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from master.arrays import FloatArray
from master.evaluation.contact_positions import strip_centre, track_position
from master.recording.recording import Recording
from master.system.contacts import Contact

Interval = tuple[float | None, float | None]


def shortfall(recording: Recording, contacts: Iterable[Contact], interval: Interval) -> str:
    """Return what of the interval a recording lacks, empty if every contact has passed all of it.

    Parameters
    ----------
    recording : Recording
        The one of every step.
    contacts : iterable of Contact
    interval : tuple
        Start and end [m]; None where it is open.

    Examples
    --------
    >>> x = np.linspace(40.0, 90.0, 51)
    >>> run = Recording(x / 50.0, ("c.force", "c.x"), ("N", "m"), np.column_stack((np.ones(51), x)))
    >>> shortfall(run, [Contact(1, "line", "train", "c")], (50.0, 100.0))
    "the run ends with 'train' at 90 m, before the end of the interval of interest, 100 m"
    """
    if not len(recording.time):
        return ""
    found = (_lacking(_place(recording, c), c.pantograph, interval) for c in contacts if c.force in recording)
    return next(filter(None, found), "")


def _place(recording: Recording, contact: Contact) -> FloatArray:
    centre = strip_centre(recording, contact, "x")
    return track_position(recording, contact) if centre is None else centre


def _lacking(x: FloatArray, pantograph: str, interval: Interval) -> str:
    start, end = interval
    # A bound between two samples has been passed; a single jump of the position is no stride.
    stride = float(np.median(np.abs(np.diff(x)))) if len(x) > 1 else 0.0
    first, last = float(x.min()), float(x.max())
    if end is not None and last + stride < end:
        where = f"{x[-1]:.6g} m, before the end of the interval of interest, {end:g} m"
        return f"the run ends with '{pantograph}' at {where}"
    if start is not None and first - stride > start:
        where = f"{x[0]:.6g} m, beyond the start of the interval of interest, {start:g} m"
        return f"the run begins with '{pantograph}' at {where}"
    return ""


def not_judgeable(recording: Recording, contacts: Sequence[Contact], interval: Interval) -> str:
    """Return why a recording is not enough to judge the interval by, empty if it is."""
    if reason := shortfall(recording, contacts, interval):
        return reason
    silent = never_touched(recording, contacts)
    return f"'{silent}' never touches the wire" if silent else ""


def never_touched(recording: Recording, contacts: Iterable[Contact]) -> str:
    """Return the pantograph that never receives a contact force in a recording, empty if there is none."""
    silent = (c.pantograph for c in contacts if c.force in recording and not np.any(recording[c.force] > 0.0))
    return next(silent, "")
