"""The figures and the verdict of a contact that batches put into their tables."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from master.evaluation.contact_assessment import Assessment

#: Columns of the figures: title, unit, how to read it, decimals.
FIGURES: Final[tuple[tuple[str, str, Callable[[Assessment], float | None], int], ...]] = (
    ("mean", "N", lambda a: a.quality.mean, 1),
    ("sigma", "N", lambda a: a.quality.sigma, 1),
    ("sigma / mean", "1", lambda a: a.quality.sigma_share, 3),
    ("maximum", "N", lambda a: a.quality.maximum, 1),
    ("minimum", "N", lambda a: a.quality.minimum, 1),
    ("amplitude", "N", lambda a: a.quality.amplitude, 1),
    ("statistical minimum", "N", lambda a: a.quality.statistical_minimum, 1),
    ("share of loss", "%", lambda a: a.quality.losses.percentage, 2),
    ("uplift", "mm", lambda a: None if a.uplift is None else 1e3 * a.uplift.maximum, 1),
    ("slack droppers", "%", lambda a: None if a.slack is None else 1e2 * a.slack, 0),
)


def verdict_of(assessment: Assessment) -> str:
    """Return the verdict in a few words."""
    if assessment.withheld:
        return "not judged"
    failed = [c.name for c in assessment.criteria if not c.passed]
    if failed:
        return f"fails: {', '.join(failed)}"
    at_limit = assessment.at_limit
    return f"passes, at the limit: {', '.join(at_limit)}" if at_limit else "passes"
