"""Two runs side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from master.errors import MasterError
from master.evaluation.contact_assessment import Assessment
from master.evaluation.contact_signals import Signals, contact_signals
from master.results import Results


@dataclass(frozen=True)
class Comparison:
    """Differences of one contact between two runs (second minus first).

    Attributes
    ----------
    first, second : Assessment
        Figures of each.
    rms : float, optional
        Root mean square difference of the low-passed forces at equal times in the first run's interval [N].
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
        reasons = "".join(f"; {run.folder} is not judged: {run.not_judged}" for run in (a, b) if run.not_judged)
        raise MasterError(f"{a.folder} and {b.folder} have no contact in common that has figures{reasons}")
    return tuple(Comparison(f, s, *_difference(a, b, f, s)) for f, s in pairs)


def filter_note(runs: Sequence[Results]) -> str:
    """Return a sentence if runs were evaluated with different filters, else nothing."""
    told = [run.evaluation.filter.short for run in runs]
    if len(set(told)) < 2:
        return ""
    named = "; ".join(f"{run.folder.name}: {text}" for run, text in zip(runs, told, strict=True))
    return (
        f"the filters differ ({named}), so the figures do even for the same force; "
        "differences of the forces are taken with the first one's"
    )


def _difference(a: Results, b: Results, first: Assessment, second: Assessment) -> tuple[float | None, float | None]:
    """Return the differences of the forces, both low-passed with the first run's filter."""
    one, two = _signals(a, first), contact_signals(b.recordings[0], second.contact, a.evaluation)
    inside = one.inside & (one.time >= two.time[0]) & (one.time <= two.time[-1])
    if not inside.any():
        return None, None
    difference = np.interp(one.time[inside], two.time, two.filtered) - one.filtered[inside]
    return float(np.sqrt(np.mean(difference**2))), float(np.abs(difference).max())


def _signals(run: Results, assessment: Assessment) -> Signals:
    return next(s for s in run.signals if s.contact == assessment.contact)
