"""Figures of one contact in its interval of interest, in the manner of EN 50317, EN 50367 and EN 50318."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from master.arrays import BoolArray, FloatArray
from master.evaluation.filters import SETTLING, ForceFilter, band_pass, evaluated, low_pass

#: Bands whose standard deviation is reported [Hz].
BANDS: Final = ((0.0, 2.0), (0.0, 5.0), (5.0, 20.0))
#: Contact losses shorter than this make no arc that counts for NQ [s].
SHORTEST_ARC: Final = 5e-3
#: If an extreme moves by more than this share under another filter, it is shown under all of them.
NOTABLE_SHARE: Final = 0.05


@dataclass(frozen=True)
class Losses:
    """Contact losses: force not above zero.

    Attributes
    ----------
    count : int
        Number of losses.
    longest, total : float
        Longest one and their sum [s].
    percentage : float
        Sum as a percentage of the interval's duration.
    nq : float
        The same for losses of at least `SHORTEST_ARC` alone: an estimate of the arcing percentage NQ.
    """

    count: int
    longest: float
    total: float
    percentage: float
    nq: float


@dataclass(frozen=True)
class Filtered:
    """The figures that depend on the filter, under another filter [N]."""

    filter: str
    mean: float
    sigma: float
    minimum: float
    maximum: float


@dataclass(frozen=True)
class Quality:
    """Figures of one contact in the interval of interest, SI; of the low-passed force unless called raw.

    ``others`` are the figures that depend on the filter, under the other filters that the standards may mean.
    """

    contact: int
    start: float
    end: float
    duration: float
    speed: float
    mean: float
    sigma: float
    minimum: float
    maximum: float
    amplitude: float
    statistical_minimum: float
    statistical_maximum: float
    sigma_bands: dict[str, float]
    raw_minimum: float
    raw_maximum: float
    losses: Losses
    contact_height_minimum: float | None
    contact_height_maximum: float | None
    contact_height_range: float | None
    lateral_minimum: float | None
    lateral_maximum: float | None
    histogram_edges: tuple[float, ...]
    histogram_share: tuple[float, ...]
    others: tuple[Filtered, ...]

    @property
    def sigma_share(self) -> float:
        """Sigma over mean; infinite where the mean is not above zero."""
        return sigma_share(self.mean, self.sigma)

    @property
    def filter_dependent(self) -> tuple[Filtered, ...]:
        """The figures under the other filters if an extreme moves by more than `NOTABLE_SHARE`; else none."""
        pairs = [(o.maximum, self.maximum) for o in self.others] + [(o.minimum, self.minimum) for o in self.others]
        return self.others if any(abs(a - b) > NOTABLE_SHARE * abs(b) for a, b in pairs) else ()


def sigma_share(mean: float, sigma: float) -> float:
    """Return sigma over mean; infinite where the mean is not above zero."""
    return sigma / mean if mean > 0.0 else math.inf


def find_losses(force: FloatArray, step: float) -> Losses:
    """Return the contact losses in a raw force, each sample standing for one step.

    Examples
    --------
    >>> find_losses(np.array([1.0, 0.0, 0.0, 1.0]), 0.01).total
    0.02
    """
    lost = np.concatenate(([False], force <= 0.0, [False]))
    edges = np.flatnonzero(lost[1:] != lost[:-1])
    durations = (edges[1::2] - edges[::2]) * step
    duration = len(force) * step
    arcs = durations[durations >= SHORTEST_ARC * (1.0 - 1e-9)]
    return Losses(
        count=len(durations),
        longest=float(durations.max(initial=0.0)),
        total=float(durations.sum()),
        percentage=100.0 * float(durations.sum()) / duration if duration else 0.0,
        nq=100.0 * float(arcs.sum()) / duration if duration else 0.0,
    )


def assess(
    force: FloatArray,
    position: FloatArray,
    step: float,
    chosen: ForceFilter,
    interval: tuple[float | None, float | None] = (None, None),
    height: FloatArray | None = None,
    lateral: FloatArray | None = None,
    contact: int = 1,
) -> Quality | None:
    """Return the figures of a contact, None if the record has fewer than two samples in the interval.

    Parameters
    ----------
    force : ndarray, shape (n,)
        Raw contact force [N].
    position : ndarray, shape (n,)
        Track position of the contact [m].
    step : float
        Sampling step [s].
    chosen : ForceFilter
        Low-pass of the force.
    interval : tuple
        Start and end of the interval of interest [m]; None where it is open (`evaluated`).
    height, lateral : ndarray, shape (n,), optional
        Height of the contact point and its position on the strip [m]; NaN without contact.
    contact : int
        Index of the contact.
    """
    sampled = Sampled(force, position, step, evaluated(force, position, step, interval), height, lateral)
    return figures_of(sampled, chosen, contact)


@dataclass(frozen=True)
class Sampled:
    """The record of a contact, and which of its samples the figures are taken from.

    Attributes
    ----------
    force, position : ndarray, shape (n,)
        Raw contact force [N] and track position of the contact [m].
    step : float
        Sampling step [s].
    inside : ndarray, shape (n,)
        Whether a sample counts.
    height, lateral : ndarray, shape (n,), optional
        Height of the contact point and its position on the strip [m]; NaN without contact.
    """

    force: FloatArray
    position: FloatArray
    step: float
    inside: BoolArray
    height: FloatArray | None = None
    lateral: FloatArray | None = None


def figures_of(record: Sampled, chosen: ForceFilter, contact: int = 1) -> Quality | None:
    """Return the figures of a contact, None if fewer than two samples count."""
    force, inside, step = record.force, record.inside, record.step
    if np.count_nonzero(inside) < 2:
        return None
    cut = low_pass(force, step, chosen)[inside]
    raw, where = force[inside], record.position[inside]
    mean, sigma = float(cut.mean()), float(cut.std())
    counts, edges = np.histogram(cut, bins=20)
    return Quality(
        contact=contact,
        start=float(where[0]),
        end=float(where[-1]),
        duration=len(cut) * step,
        speed=float((where[-1] - where[0]) / ((len(cut) - 1) * step)),
        mean=mean,
        sigma=sigma,
        minimum=float(cut.min()),
        maximum=float(cut.max()),
        amplitude=float(cut.max() - cut.min()),
        statistical_minimum=mean - 3.0 * sigma,
        statistical_maximum=mean + 3.0 * sigma,
        sigma_bands={f"{lo:g}-{hi:g}": float(band_pass(force, step, lo, hi, chosen)[inside].std()) for lo, hi in BANDS},
        raw_minimum=float(raw.min()),
        raw_maximum=float(raw.max()),
        losses=find_losses(raw, step),
        contact_height_minimum=_least(record.height, inside),
        contact_height_maximum=_greatest(record.height, inside),
        contact_height_range=_range(record.height, inside),
        lateral_minimum=_least(record.lateral, inside),
        lateral_maximum=_greatest(record.lateral, inside),
        histogram_edges=tuple(float(e) for e in edges),
        histogram_share=tuple(float(c) for c in counts / len(cut)),
        others=tuple(_under(record, other) for other in chosen.others),
    )


def early_warning(record: Sampled, settling: float = SETTLING) -> str:
    """Return a warning if samples count before the contact has settled; empty if none do.

    Parameters
    ----------
    record : Sampled
    settling : float
        Time after the first contact by which it has settled [s].

    Examples
    --------
    >>> x = np.linspace(0.0, 300.0, 301)
    >>> force = np.ones(301)
    >>> [early_warning(Sampled(force, x, 0.01, x > first)) for first in (100.0, 90.0)]  # doctest: +ELLIPSIS
    ['', 'the interval of interest begins at 91 m, less than 1 s after the first contact: ...']
    """
    settled = evaluated(record.force, record.position, record.step, (None, None), settling)
    if not np.any(record.inside & ~settled):
        return ""
    begins = f"the interval of interest begins at {record.position[record.inside][0]:.6g} m"
    if not settled.any():
        within = f"the run ends within {settling:g} s of the first contact"
        return f"{begins}, and {within}: the raising is part of the figures"
    return (
        f"{begins}, less than {settling:g} s after the first contact: the raising is part of the figures; let the "
        f"pantograph start earlier, or the interval begin at {record.position[settled][0]:.6g} m or later"
    )


def _under(record: Sampled, other: ForceFilter) -> Filtered:
    cut = low_pass(record.force, record.step, other)[record.inside]
    return Filtered(other.short, float(cut.mean()), float(cut.std()), float(cut.min()), float(cut.max()))


def _known(values: FloatArray | None, inside: BoolArray) -> FloatArray:
    cut = np.zeros(0) if values is None else values[inside]
    return cut[np.isfinite(cut)]


def _least(values: FloatArray | None, inside: BoolArray) -> float | None:
    known = _known(values, inside)
    return float(known.min()) if known.size else None


def _greatest(values: FloatArray | None, inside: BoolArray) -> float | None:
    known = _known(values, inside)
    return float(known.max()) if known.size else None


def _range(values: FloatArray | None, inside: BoolArray) -> float | None:
    known = _known(values, inside)
    return float(known.max() - known.min()) if known.size else None
