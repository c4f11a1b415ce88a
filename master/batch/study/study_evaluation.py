"""The figures that a study adds to those of every run, for one pantograph in one interval."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from master.arrays import BoolArray, FloatArray
from master.batch.study.family import Interval
from master.evaluation.contact_assessment import Assessment
from master.evaluation.contact_positions import leading_first, track_position
from master.evaluation.contact_quality import Quality
from master.evaluation.filters import interval_mask
from master.recording.recording import Recording
from master.results.run_results import Results
from master.system.contacts import Contact


@dataclass(frozen=True)
class Sharing:
    """The passage of a strip from one wire to another.

    Attributes
    ----------
    start, end : float
        Track positions of the strip at the first and last contact with both wires [m].
    duration : float
        Time between the two [s].
    touching : float
        Time during which both wires are touched [s].
    losses : tuple of int
        How often contact with each wire is lost, from ``start`` on, section by section.
    least_force : float
        Smallest total force, as computed [N].
    """

    start: float
    end: float
    duration: float
    touching: float
    losses: tuple[int, ...]
    least_force: float


@dataclass(frozen=True)
class StudyEntry:
    """One pantograph of one variant in one interval.

    Attributes
    ----------
    variant : str
    interval : Interval
    assessment : Assessment
        Figures and verdict in the interval.
    sharing : Sharing or None
        None unless it touches two wires within the interval.
    """

    variant: str
    interval: Interval
    assessment: Assessment
    sharing: Sharing | None

    @property
    def pantograph(self) -> str:
        """Name of the pantograph."""
        return self.assessment.contact.pantograph

    @property
    def name(self) -> str:
        """Variant and pantograph."""
        return f"{self.variant}, {self.pantograph}"

    @property
    def quality(self) -> Quality:
        """The figures of the contact force."""
        return self.assessment.quality

    @property
    def uplift(self) -> float | None:
        """Largest uplift of the supports in the interval [m]."""
        return None if self.assessment.uplift is None else self.assessment.uplift.maximum

    @property
    def slack(self) -> float | None:
        """Share of the droppers in the interval that go slack as this pantograph passes."""
        return self.assessment.slack


def entries(variant: str, done: Results, interval: Interval) -> tuple[StudyEntry, ...]:
    """Return the entries of all pantographs of a run in an interval, the leading one first."""
    found = {a.contact: a for a in done.assessments_in((interval.start, interval.end))}
    ordered = leading_first(done.recordings[0], list(found))
    return tuple(StudyEntry(variant, interval, found[c], sharing(done.recordings[0], c, interval)) for c in ordered)


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
    both = np.flatnonzero((touched.sum(axis=1) > 1) & interval_mask(position, interval.start, interval.end))
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
