"""What a study reports of one pantograph in one interval beyond the figures of every run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from master.arrays import BoolArray, FloatArray
from master.contacts import Contact, strip_centre, track_position
from master.line import lies_within, passages, period_of
from master.recorder import Recording
from master.results import Assessment, Results, assess_contacts
from master.study.family import Interval
from master.trains import leading_first

#: A pantograph's effect on a dropper begins this long before it passes, and is followed this long after [s].
_BEFORE: Final = 0.2
_AFTER: Final = 1.0


@dataclass(frozen=True)
class Sharing:
    """A strip between two wires, while both can be touched.

    Attributes
    ----------
    start, end : float
        Track positions of the strip at the first and last contact with both wires [m].
    duration : float
        Between these [s].
    touching : float
        Time in which both wires are touched [s].
    losses : tuple of int
        How often contact with each wire is lost, from ``start`` on, section by section.
    least_force : float
        Least total force, as computed [N].
    """

    start: float
    end: float
    duration: float
    touching: float
    losses: tuple[int, ...]
    least_force: float


@dataclass(frozen=True)
class Entry:
    """One pantograph of one variant in one interval.

    Attributes
    ----------
    variant : str
    interval : Interval
    assessment : Assessment
        Figures and verdict; the uplift in it is that of the interval's supports.
    uplift : float or None
        Largest uplift of the interval's supports [m].
    slack : float or None
        Share of the interval's droppers that go slack as this pantograph passes.
    sharing : Sharing or None
        If it touches two wires within the interval.
    """

    variant: str
    interval: Interval
    assessment: Assessment
    uplift: float | None
    slack: float | None
    sharing: Sharing | None

    @property
    def pantograph(self) -> str:
        """The pantograph's name."""
        return self.assessment.contact.pantograph


def entries(variant: str, done: Results, interval: Interval) -> tuple[Entry, ...]:
    """Return the entries of a run's pantographs in an interval, the leading one first."""
    limits = (interval.start, interval.end)
    uplifts = [u for u in done.uplifts if u.x is None or lies_within(u.x, limits, u.period)]
    found = assess_contacts(done.recordings, done.contacts, limits, uplifts)
    ordered = leading_first(done.recordings[0], [a.contact for a in found])
    by_index = {(a.contact.catenary, a.contact.index): a for a in found}
    return tuple(
        Entry(
            variant,
            interval,
            by_index[contact.catenary, contact.index],
            max((u.maximum for u in uplifts), default=None),
            slack_share(done, contact, follower, interval),
            sharing(done.recordings[0], contact, interval),
        )
        for contact, follower in zip(ordered, [*ordered[1:], None], strict=False)
    )


def passing_time(recording: Recording, contact: Contact, x: float) -> float:
    """Return when a pantograph passes a place [s], infinite if it does not."""
    centre = strip_centre(recording, contact, "x")
    position = track_position(recording, contact) if centre is None else centre
    if not min(position[0], position[-1]) <= x <= max(position[0], position[-1]):
        return float("inf")
    order = np.argsort(position, kind="stable")
    return float(np.interp(x, position[order], recording.time[order]))


def slack_share(done: Results, contact: Contact, follower: Contact | None, interval: Interval) -> float | None:
    """Return the share of the interval's droppers that carry nothing for a moment as a pantograph passes.

    From just before it passes until the next pantograph comes, or for a second. On a line that closes on itself every
    passage of a dropper counts.
    """
    geometry = done.geometry.get(contact.catenary, {})
    position = track_position(done.recordings[0], contact)
    travelled = (float(position.min()), float(position.max()))
    total = slack = 0
    for recording in done.recordings:
        for name in recording.matching(f"{contact.catenary}.dropper[*].force"):
            x = geometry.get(f"{name.removeprefix(contact.catenary + '.').removesuffix('.force')}.x")
            if x is None:
                continue
            for place in passages(x, (interval.start, interval.end), travelled, period_of(geometry)):
                begin, end = _passage(done.recordings[0], contact, follower, float(place))
                during = (recording.time >= begin) & (recording.time < end)
                total += 1
                slack += bool((recording[name][during] <= 0.0).any())
    return slack / total if total else None


def _passage(whole: Recording, contact: Contact, follower: Contact | None, x: float) -> tuple[float, float]:
    """Return from when to when a place belongs to a pantograph [s]."""
    begin = passing_time(whole, contact, x) - _BEFORE
    end = begin + _BEFORE + _AFTER
    return begin, end if follower is None else min(end, passing_time(whole, follower, x) - _BEFORE)


def section_forces(recording: Recording, contact: Contact) -> FloatArray | None:
    """Return the force per wire, shape (n, n_sections) [N]; None if the line has one section."""
    prefix = contact.prefix.removesuffix(".contact")
    names = recording.matching(f"{prefix}.section[*].force")
    return np.column_stack([recording[n] for n in names]) if len(names) > 1 else None


def sharing(recording: Recording, contact: Contact, interval: Interval) -> Sharing | None:
    """Return how a strip passes from wire to wire within an interval; None if it never touches two at once."""
    forces = section_forces(recording, contact)
    position = track_position(recording, contact)
    if forces is None:
        return None
    touched = forces > 0.0
    both = np.flatnonzero((touched.sum(axis=1) > 1) & (position >= interval.start) & (position <= interval.end))
    if not both.size:
        return None
    first, last = int(both[0]), int(both[-1])
    step = float(np.median(np.diff(recording.time)))
    after = touched[first : last + 2]
    return Sharing(
        start=float(position[first]),
        end=float(position[last]),
        duration=float(recording.time[last] - recording.time[first]),
        touching=both.size * step,
        losses=tuple(_losses(after[:, s]) for s in range(after.shape[1])),
        least_force=float(forces[first : last + 1].sum(axis=1).min()),
    )


def _losses(touched: BoolArray) -> int:
    return int(np.count_nonzero(touched[:-1] & ~touched[1:]))
