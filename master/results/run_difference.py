"""The differences of two runs, contact by contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from master.errors import MasterError
from master.evaluation.contact_assessment import Assessment
from master.evaluation.contact_signals import Signals, contact_signals
from master.results.run_results import Results

#: Contacts this near to each other at equal times are at the same position [m].
SAME_PLACE: Final = 0.1


@dataclass(frozen=True)
class RunDifference:
    """Differences of one contact between two runs (second minus first).

    Attributes
    ----------
    first, second : Assessment
        Figures of the two runs.
    rms : float, optional
        Root mean square difference of the low-passed forces at equal times in the interval of the first run [N].
    largest : float, optional
        Largest magnitude of this difference [N].
    apart : float, optional
        Largest distance along the track between the two at these times [m].
    """

    first: Assessment
    second: Assessment
    rms: float | None
    largest: float | None
    apart: float | None = None

    @property
    def sentence(self) -> str:
        """The difference of the forces in words, or why there is none."""
        if self.rms is None or self.largest is None:
            return "no difference of the forces: the second run has no time in common with the first one's interval"
        text = f"low-passed forces differ by {self.rms:.3g} N (rms), {self.largest:.3g} N (largest)"
        if self.apart is None or self.apart <= SAME_PLACE:
            return text
        return f"{text}, at equal times, at which the two are up to {self.apart:.3g} m apart: not at the same positions"


def compare(a: Results, b: Results) -> tuple[RunDifference, ...]:
    """Return the differences of the contacts that both runs have.

    Raises
    ------
    MasterError
        If they have none in common.
    """
    seconds = {s.quality.contact: s for s in b.assessments()}
    pairs = [(f, seconds[f.quality.contact]) for f in a.assessments() if f.quality.contact in seconds]
    if not pairs:
        reasons = "".join(f"; {run.folder} is not judged: {run.not_judged}" for run in (a, b) if run.not_judged)
        raise MasterError(f"{a.folder} and {b.folder} have no contact in common that has figures{reasons}")
    return tuple(RunDifference(f, s, *_difference(a, b, f, s)) for f, s in pairs)


def filter_note(runs: Sequence[Results]) -> str:
    """Return a sentence if runs were evaluated with different filters, else an empty one."""
    filters = [run.evaluation.filter.short for run in runs]
    if len(set(filters)) < 2:
        return ""
    return (
        f"the filters differ ({_by_run(runs, filters)}), so the figures do even for the same force; "
        "differences of the forces are taken with the first one's"
    )


def setting_notes(runs: Sequence[Results]) -> tuple[str, ...]:
    """Return a sentence for each setting that runs are evaluated with and differ in."""
    intervals = [_interval_words(run.evaluation.interval) for run in runs]
    limits = [run.evaluation.limits for run in runs]
    found = [filter_note(runs)]
    if len(set(intervals)) > 1:
        listed = _by_run(runs, intervals)
        found.append(
            f"the intervals of interest differ ({listed}), so the figures are of different parts of the line; "
            "differences of the forces are taken in the first one's"
        )
    if len(set(limits)) > 1:
        listed = _by_run(runs, [choice.title for choice in limits])
        found.append(
            f"the runs are judged by different limits ({listed}), so a verdict may differ for the same figures"
        )
    return tuple(filter(None, found))


def _by_run(runs: Sequence[Results], texts: Sequence[str]) -> str:
    return "; ".join(f"{run.folder.name}: {text}" for run, text in zip(runs, texts, strict=True))


def _interval_words(interval: tuple[float | None, float | None]) -> str:
    start, end = interval
    begin = "settled contact" if start is None else f"{start:g} m"
    return f"{begin} to {'the end of the run' if end is None else f'{end:g} m'}"


def _difference(
    a: Results, b: Results, first: Assessment, second: Assessment
) -> tuple[float | None, float | None, float | None]:
    """Return the differences of the forces, both low-passed with the filter of the first run, and of the positions."""
    one, two = _signals(a, first), contact_signals(b.recordings[0], second.contact, a.evaluation)
    inside = one.inside & (one.time >= two.time[0]) & (one.time <= two.time[-1])
    if not inside.any():
        return None, None, None
    difference = np.interp(one.time[inside], two.time, two.filtered) - one.filtered[inside]
    apart = np.abs(np.interp(one.time[inside], two.time, two.position) - one.position[inside])
    return float(np.sqrt(np.mean(difference**2))), float(np.abs(difference).max()), float(apart.max())


def _signals(run: Results, assessment: Assessment) -> Signals:
    return next(s for s in run.signals if s.contact == assessment.contact)
