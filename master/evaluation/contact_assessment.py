"""The assessment of a contact: figures, uplift and slack droppers in the interval, verdict, span by span."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from master.arrays import FloatArray
from master.evaluation.contact_positions import leading_first, running_position
from master.evaluation.contact_quality import Quality, early_warning, figures_of
from master.evaluation.contact_signals import EvaluationSettings, Signals, all_signals, settling_of
from master.evaluation.en50367_limits import HEIGHT_RANGE, UPLIFT, Criterion, judge
from master.evaluation.filters import evaluated, stands_in
from master.evaluation.line_geometry import (
    Slackness,
    Uplift,
    indexed,
    met,
    passages,
    period_of,
    slackness,
    support_uplifts,
)
from master.recording.recording import Recording
from master.recording.static_geometry import Geometry
from master.system.contacts import Contact

#: The effect of a pantograph on a dropper is counted from this long before it passes until this long after [s].
_BEFORE: Final = 0.2
_AFTER: Final = 1.0
#: Supports closer together than this stand at the same end of a span [m].
_SHORTEST_SPAN: Final = 10.0
#: Sigma drifts along the spans if a straight line through it rises or falls by more than this share of its mean and
#: correlates with it at least this well: alternating spans do not drift.
_DRIFT_SHARE: Final = 0.1
_DRIFT_CORRELATION: Final = 0.8
_FEWEST_SPANS: Final = 3
#: Limits that need more than the contact force, each with the text for when that is missing.
_NEEDED: Final = {
    UPLIFT: f"{UPLIFT}, because no support of the interval has a recorded uplift",
    HEIGHT_RANGE: f"{HEIGHT_RANGE}, because the height of the contact point is not recorded",
}


@dataclass(frozen=True)
class SpanFigures:
    """The low-passed force in one span.

    Attributes
    ----------
    start, end : float
        Positions of its supports along the track [m].
    mean, sigma, minimum, maximum : float
        Figures of the force [N].
    is_inside : bool
        Whether it lies in the interval of interest.
    """

    start: float
    end: float
    mean: float
    sigma: float
    minimum: float
    maximum: float
    is_inside: bool


@dataclass(frozen=True)
class Assessment:
    """Figures and verdict of one contact.

    Attributes
    ----------
    contact : Contact
    quality : Quality
        Figures in the interval.
    criteria : tuple of Criterion
        Limits row by row.
    uplift : Uplift, optional
        The largest at the interval's supports, ends included, over the whole run: waves arrive early and leave late.
    supports : int
        How many supports stand in the interval.
    slack : float, optional
        Share of the interval's droppers that go slack for a moment as this pantograph passes.
    spans : tuple of SpanFigures
        Every whole span after the contact has settled.
    withheld : str
        Why there is no verdict, and no criteria; empty if there is one.
    early : str
        A warning if the interval begins while the pantograph is still being raised; else empty.
    """

    contact: Contact
    quality: Quality
    criteria: tuple[Criterion, ...]
    uplift: Uplift | None = None
    supports: int = 0
    slack: float | None = None
    spans: tuple[SpanFigures, ...] = ()
    withheld: str = ""
    early: str = ""

    @property
    def unchecked(self) -> str:
        """Which limits the verdict leaves out because what they need was not recorded; else empty."""
        held = {c.name for c in self.criteria}
        missing = [] if self.withheld else [why for name, why in _NEEDED.items() if name not in held]
        return f"not checked: {'; '.join(missing)}" if missing else ""

    @property
    def at_limit(self) -> tuple[str, ...]:
        """What passes only because it is at its limit."""
        return tuple(c.name for c in self.criteria if c.is_at_limit)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader has to know beyond the figures and the verdict."""
        return tuple(filter(None, (self.early, self.drift, self.unchecked)))

    @property
    def passed(self) -> bool:
        """Whether every limit is met and the verdict is not withheld."""
        return not self.withheld and all(c.passed for c in self.criteria)

    def without_verdict(self, reason: str) -> Assessment:
        """Return the figures without a verdict, with the reason."""
        return replace(self, criteria=(), withheld=reason)

    @property
    def drift(self) -> str:
        """A warning if sigma drifts along the spans, since the run has not settled then; else empty."""
        if not drifts([s.sigma for s in self.spans]):
            return ""
        first, last = self.spans[0], self.spans[-1]
        return (
            f"sigma still drifts along the line, over {len(self.spans)} spans: {first.sigma:.1f} N in the one from "
            f"{first.start:.0f} m, {last.sigma:.1f} N in the one from {last.start:.0f} m; figures are those of this "
            "interval, not of the pair on a long line"
        )


def assess_contacts(
    recordings: Sequence[Recording], contacts: Sequence[Contact], geometry: Geometry, settings: EvaluationSettings
) -> tuple[Assessment, ...]:
    """Return the assessments of all contacts that have samples in the interval."""
    uplifts = support_uplifts(tuple(recordings), geometry)
    signals = all_signals(recordings, contacts, settings)
    found = ((s, figures_of(s.sampled, settings.filter, s.contact.index)) for s in signals)
    judged = [(s, quality) for s, quality in found if quality is not None]
    followers = _followers(recordings[0], [s.contact for s, _ in judged]) if judged else {}
    return tuple(
        _assessment(s, quality, uplifts, settings, _Line(recordings, geometry.get(s.contact.catenary, {})), followers)
        for s, quality in judged
    )


@dataclass(frozen=True)
class _Line:
    """The recordings, and the static geometry of one line."""

    recordings: Sequence[Recording]
    geometry: dict[str, float]


def _assessment(
    s: Signals,
    quality: Quality,
    uplifts: Sequence[Uplift],
    settings: EvaluationSettings,
    line: _Line,
    followers: dict[Contact, Contact | None],
) -> Assessment:
    limits = interval_of(quality, settings.interval)
    own = [u for u in uplifts if u.component == s.contact.catenary]
    inside = [u for u in own if u.x is None or u.stands_in(limits)]  # an unknown position may be in it
    return Assessment(
        contact=s.contact,
        quality=quality,
        criteria=judge(quality, settings.limits, [u.maximum for u in inside]),
        uplift=max(inside, key=lambda u: u.maximum, default=None),
        supports=len(inside),
        slack=slack_share(line.recordings, line.geometry, s.contact, followers.get(s.contact), limits),
        spans=tuple(_spans(s, line.geometry, limits)),
        early=early_warning(s.sampled, settling_of(s.raw, s.time, settings)),
    )


def interval_of(quality: Quality, wanted: tuple[float | None, float | None]) -> tuple[float, float]:
    """Return the bounds of an interval [m], those of the record where it is open."""
    low, high = min(quality.start, quality.end), max(quality.start, quality.end)
    return (low if wanted[0] is None else wanted[0]), (high if wanted[1] is None else wanted[1])


def _followers(recording: Recording, contacts: Sequence[Contact]) -> dict[Contact, Contact | None]:
    """Return which contact comes next under the same line, None for the last one."""
    found: dict[Contact, Contact | None] = {}
    for line in dict.fromkeys(c.catenary for c in contacts):
        ordered = leading_first(recording, [c for c in contacts if c.catenary == line])
        found |= dict(zip(ordered, [*ordered[1:], None], strict=True))
    return found


def passing_times(recording: Recording, contact: Contact, places: FloatArray) -> FloatArray:
    """Return when a pantograph passes points of the track [s], shape (n,); infinite where it does not."""
    position = running_position(recording, contact)
    order = np.argsort(position, kind="stable")
    return np.interp(places, position[order], recording.time[order], left=np.inf, right=np.inf)


def slack_share(
    recordings: Sequence[Recording],
    geometry: Mapping[str, float],
    contact: Contact,
    follower: Contact | None,
    limits: tuple[float, float],
) -> float | None:
    """Return the share of the interval's droppers that go slack for a moment as a pantograph passes.

    They are watched from just before it passes until the next pantograph comes, or for a second. On a line that
    closes on itself a dropper counts once per lap.
    """
    own = [s for s in slackness(recordings) if s.component == contact.catenary and s.name.startswith("dropper")]
    met_at = [_droppers_met(geometry, s.name, limits) for s in own]
    places = np.concatenate([np.zeros(0), *met_at])
    if not len(places):
        return None
    begin = passing_times(recordings[0], contact, places) - _BEFORE
    end = begin + _BEFORE + _AFTER
    if follower is not None:
        end = np.minimum(end, passing_times(recordings[0], follower, places) - _BEFORE)
    parts = np.cumsum([len(x) for x in met_at])[:-1]
    windows = zip(own, np.split(begin, parts), np.split(end, parts), strict=True)
    return sum(_count_slack(s, b, e) for s, b, e in windows) / len(places)


def _droppers_met(geometry: Mapping[str, float], name: str, limits: tuple[float, float]) -> FloatArray:
    """Return where a dropper is passed within limits [m]."""
    x = geometry.get(f"{name}.x")
    if x is None:
        return np.zeros(0)
    return passages(x, limits, limits, period_of(geometry))


def _count_slack(found: Slackness, begin: FloatArray, end: FloatArray) -> int:
    """Return during how many of these periods [s] a dropper goes slack."""
    if not len(begin):
        return 0
    counted = np.concatenate(([0], np.cumsum(found.slack)))
    first, last = (np.searchsorted(found.time, t, side="left") for t in (begin, end))
    return int(np.count_nonzero(counted[np.maximum(first, last)] > counted[first]))


def _spans(s: Signals, geometry: dict[str, float], limits: tuple[float, float]) -> Iterator[SpanFigures]:
    """Yield the figures of every whole span that is passed after the contact has settled."""
    ran = evaluated(s.raw, s.position, s.step, (None, None)) | s.inside
    if not ran.any() or not len(indexed(geometry, "support", "x")):
        return
    low, high = float(s.position[ran].min()), float(s.position[ran].max())
    places: list[float] = []
    for x in sorted(met(geometry, "support", (low, high)).tolist()):
        if not places or x - places[-1] > _SHORTEST_SPAN:
            places.append(x)
    for start, end in pairwise(places):
        cut = s.filtered[(s.position > start) & (s.position <= end)]
        if len(cut) > 1:
            is_inside = stands_in(start, limits) and stands_in(end, limits)
            extremes = float(cut.min()), float(cut.max())
            yield SpanFigures(start, end, float(cut.mean()), float(cut.std()), *extremes, is_inside)


def drifts(values: Sequence[float]) -> bool:
    """Return whether values of neighbouring spans rise or fall steadily, by more than a tenth in all.

    Examples
    --------
    >>> drifts([54.0, 57.0, 61.0, 64.0]), drifts([54.0, 64.0, 54.0, 64.0]), drifts([60.0, 60.5, 61.0])
    (True, False, False)
    """
    if len(values) < _FEWEST_SPANS or np.ptp(values) == 0.0:
        return False
    order = np.arange(len(values))
    slope = float(np.polyfit(order, values, 1)[0])
    correlation = float(np.corrcoef(order, values)[0, 1])
    change = abs(slope) * (len(values) - 1)
    return change > _DRIFT_SHARE * float(np.mean(values)) and abs(correlation) >= _DRIFT_CORRELATION
