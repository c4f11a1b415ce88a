"""Two runs side by side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from master.contacts import track_position
from master.errors import MasterError
from master.quality import interval_mask, low_pass
from master.results import Assessment, Results


@dataclass(frozen=True)
class Comparison:
    """Differences of one contact between two runs (second minus first).

    Attributes
    ----------
    first, second : Assessment
        Figures of each.
    rms : float, optional
        Root mean square difference of the 0-20 Hz forces at equal times in the first run's interval [N].
    largest : float, optional
        Largest magnitude of that difference [N].
    """

    first: Assessment
    second: Assessment
    rms: float | None
    largest: float | None


def compare(a: Results, b: Results) -> tuple[Comparison, ...]:
    """Compare the contacts that both runs have.

    Raises
    ------
    MasterError
        If they have none in common.
    """
    seconds = {s.quality.contact: s for s in b.assessments()}
    pairs = [(f, seconds[f.quality.contact]) for f in a.assessments() if f.quality.contact in seconds]
    if not pairs:
        raise MasterError(f"{a.folder} and {b.folder} have no contact in common that has figures")
    return tuple(Comparison(f, s, *_difference(a, b, f, s)) for f, s in pairs)


def _difference(a: Results, b: Results, first: Assessment, second: Assessment) -> tuple[float | None, float | None]:
    one, two = a.recordings[0], b.recordings[0]
    steps = [float(np.median(np.diff(r.time))) for r in (one, two)]
    inside = interval_mask(track_position(one, first.contact), *a.interval)
    inside &= (one.time >= two.time[0]) & (one.time <= two.time[-1])
    if not inside.any():
        return None, None
    filtered = low_pass(two[second.contact.force], steps[1])
    there = np.interp(one.time[inside], two.time, filtered)
    difference = there - low_pass(one[first.contact.force], steps[0])[inside]
    return float(np.sqrt(np.mean(difference**2))), float(np.abs(difference).max())
