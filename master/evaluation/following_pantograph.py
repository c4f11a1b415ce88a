"""Several pantographs under one line: which runs ahead, and the effect on the one that follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from master.evaluation.contact_assessment import Assessment
from master.evaluation.contact_positions import leading_first, running_position
from master.recording.recording import Recording


@dataclass(frozen=True)
class FollowerEffect:
    """Figures of a pantograph minus those of the one just ahead of it.

    Attributes
    ----------
    leading, trailing : str
        Component names.
    distance : float
        Distance between their strips at the start [m].
    mean, sigma, minimum, maximum : float
        Differences [N].
    """

    leading: str
    trailing: str
    distance: float
    mean: float
    sigma: float
    minimum: float
    maximum: float

    @property
    def sentence(self) -> str:
        """The comparison in one line."""
        return (
            f"{self.trailing} {self.distance:.0f} m behind {self.leading}: sigma {self.sigma:+.1f} N, "
            f"maximum {self.maximum:+.1f} N, minimum {self.minimum:+.1f} N"
        )


def follower_effects(recording: Recording, assessments: Sequence[Assessment]) -> tuple[FollowerEffect, ...]:
    """Compare every pantograph that has figures with the one ahead of it on the same line."""
    found: list[FollowerEffect] = []
    for line in dict.fromkeys(a.contact.catenary for a in assessments):
        own = {a.contact.index: a for a in assessments if a.contact.catenary == line}
        ordered = leading_first(recording, [a.contact for a in own.values()])
        found += [_effect_of(recording, own[ahead.index], own[behind.index]) for ahead, behind in pairwise(ordered)]
    return tuple(found)


def _effect_of(recording: Recording, ahead: Assessment, behind: Assessment) -> FollowerEffect:
    places = [float(running_position(recording, a.contact)[0]) for a in (ahead, behind)]
    one, two = ahead.quality, behind.quality
    return FollowerEffect(
        ahead.contact.pantograph,
        behind.contact.pantograph,
        abs(places[0] - places[1]),
        two.mean - one.mean,
        two.sigma - one.sigma,
        two.minimum - one.minimum,
        two.maximum - one.maximum,
    )
