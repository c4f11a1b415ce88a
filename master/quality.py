"""Contact-quality figures in the manner of EN 50317, EN 50367 and EN 50318, from recorded arrays.

The contact force is filtered over the whole record first and cut to the interval of interest afterwards, so
that the ends of the interval are not the ends of a filter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from master.arrays import BoolArray, FloatArray

#: Upper end of the frequency range of interest [Hz].
CUTOFF: Final = 20.0
#: Bands whose standard deviation is reported [Hz].
BANDS: Final = ((0.0, 2.0), (0.0, 5.0), (5.0, 20.0))
#: Contact losses shorter than this make no arc that counts for NQ [s].
SHORTEST_ARC: Final = 5e-3
#: Time by which the record is continued on both sides before filtering [s].
_PADDING: Final = 2.0
#: Time after the first contact in which the filter rings visibly [s]: two periods of its cut-off.
FILTER_REACH: Final = 2.0 / CUTOFF
#: Half the width of the filter's edge [Hz].
_HALF_EDGE: Final = 0.25
#: A position this near to a bound of the interval is on it [m].
_ON_BOUND: Final = 1e-6

FILTER_NOTE: Final = (
    "zero-phase low-pass 0-20 Hz by discrete Fourier transform (raised-cosine edge 19.75-20.25 Hz, "
    "whole record continued by odd reflection), cut to the interval of interest afterwards"
)


@dataclass(frozen=True)
class Losses:
    """Contact losses: force not above zero.

    Attributes
    ----------
    count : int
        Number of losses.
    longest, total : float
        Longest one and sum [s].
    percentage : float
        Sum in percent of the interval's duration.
    nq : float
        The same with only the losses of at least `SHORTEST_ARC`: an estimate of the arcing percentage NQ.
    """

    count: int
    longest: float
    total: float
    percentage: float
    nq: float


@dataclass(frozen=True)
class Quality:
    """Figures of one contact in the interval of interest, SI; of the 0-20 Hz force unless called raw."""

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


@dataclass(frozen=True)
class Criterion:
    """One acceptance limit with its verdict; values as text with unit."""

    name: str
    value: str
    limit: str
    passed: bool


def low_pass(signal: FloatArray, step: float, cutoff: float = CUTOFF) -> FloatArray:
    """Return the part of a signal below ``cutoff``, without phase shift and with unit gain at zero frequency.

    Parameters
    ----------
    signal : ndarray, shape (n,)
        Samples at a constant step.
    step : float
        Sampling step [s].
    cutoff : float
        Edge [Hz]; where it is beyond half the sampling frequency the signal passes whole.

    Returns
    -------
    ndarray, shape (n,)
    """
    if len(signal) < 3 or cutoff - _HALF_EDGE >= 0.5 / step:
        return signal.copy()
    pad = min(len(signal) - 1, round(_PADDING / step))
    padded = _odd_extension(signal, pad)
    line = np.linspace(padded[0], padded[-1], len(padded))  # passes whole; without it the ends would be a jump
    spectrum = np.fft.rfft(padded - line) * _edge(
        np.asarray(np.fft.rfftfreq(len(padded), step), dtype=np.float64), cutoff
    )
    filtered: FloatArray = (np.fft.irfft(spectrum, len(padded)) + line)[pad : pad + len(signal)]
    return filtered


def settled(force: FloatArray, step: float) -> BoolArray:
    """Return where the filtered force means something, shape (n,).

    A record that begins without contact has a jump where contact is made, and a filter of 20 Hz rings on both
    sides of it. What lies before the first contact plus `FILTER_REACH` is left out.

    Examples
    --------
    >>> settled(np.array([0.0, 0.0, 9.0, 9.0, 9.0]), 0.05).tolist()
    [False, False, False, False, True]
    >>> settled(np.array([9.0, 0.0, 9.0]), 0.05).all()
    np.True_
    """
    found = force > 0.0
    if not found.any():
        return np.zeros(len(force), dtype=np.bool_)
    first = int(np.argmax(found))
    if first:
        first += round(FILTER_REACH / step)
    return np.arange(len(force)) >= first


def band_pass(signal: FloatArray, step: float, low: float, high: float) -> FloatArray:
    """Return the part of a signal between two frequencies [Hz]; ``low = 0`` keeps the mean."""
    passed = low_pass(signal, step, high)
    return passed if low <= 0.0 else passed - low_pass(signal, step, low)


def interval_mask(position: FloatArray, start: float | None, end: float | None) -> BoolArray:
    """Return which samples lie in the interval of interest, shape (n,).

    Its end belongs to it, its beginning does not, so that samples stand for steps and intervals side by side share
    none. A sample on a bound is told by less than recorded digits, so it counts as on the bound within a micrometre.
    """
    inside = np.ones(len(position), dtype=np.bool_)
    if start is not None:
        inside &= position > start + _ON_BOUND
    if end is not None:
        inside &= position <= end + _ON_BOUND
    return inside


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
    interval : tuple
        Start and end of the interval of interest [m]; None for the record's own.
    height, lateral : ndarray, shape (n,), optional
        Height of the contact point and its position on the strip [m]; NaN without contact.
    contact : int
        Index of the contact.
    """
    inside = interval_mask(position, *interval)
    if np.count_nonzero(inside) < 2:
        return None
    cut = low_pass(force, step)[inside]
    raw = force[inside]
    where = position[inside]
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
        sigma_bands={f"{lo:g}-{hi:g}": float(band_pass(force, step, lo, hi)[inside].std()) for lo, hi in BANDS},
        raw_minimum=float(raw.min()),
        raw_maximum=float(raw.max()),
        losses=find_losses(raw, step),
        contact_height_minimum=_least(height, inside),
        contact_height_maximum=_greatest(height, inside),
        contact_height_range=_range(height, inside),
        lateral_minimum=_least(lateral, inside),
        lateral_maximum=_greatest(lateral, inside),
        histogram_edges=tuple(float(e) for e in edges),
        histogram_share=tuple(float(c) for c in counts / len(cut)),
    )


def target_mean_force(speed: float) -> float:
    """Return the upper limit of the mean force on AC lines at ``speed`` [m/s], in N.

    0.00097 v^2 + 70 above 200 km/h, 0.00047 v^2 + 90 below, v in km/h [EN 50367].
    """
    v = 3.6 * speed
    return 0.00097 * v**2 + 70.0 if v > 200.0 else 0.00047 * v**2 + 90.0


#: How far the mean force may be off its target [N]: a choice, wide enough for rounded targets.
MEAN_TOLERANCE: Final = 2.5
MAX_FORCE: Final = 350.0
MAX_UPLIFT: Final = 0.120
MAX_HEIGHT_RANGE: Final = 0.080
MAX_NQ: Final = 0.2


def judge(quality: Quality, uplifts: Sequence[float] = ()) -> tuple[Criterion, ...]:
    """Return the acceptance limits of EN 50367, row by row.

    Parameters
    ----------
    quality : Quality
        Figures of a contact.
    uplifts : sequence of float
        Largest uplift of every support [m].
    """
    target = target_mean_force(quality.speed)
    share = quality.sigma / quality.mean if quality.mean > 0 else math.inf
    rows = [
        Criterion(
            "mean force",
            f"{quality.mean:.1f} N",
            f"{target:.1f} +- {MEAN_TOLERANCE:g} N",
            abs(quality.mean - target) <= MEAN_TOLERANCE,
        ),
        Criterion("sigma / mean", f"{share:.3f}", "< 0.3", share < 0.3),
        Criterion("maximum force", f"{quality.maximum:.1f} N", f"< {MAX_FORCE:g} N", quality.maximum < MAX_FORCE),
        Criterion("NQ (estimate)", f"{quality.losses.nq:.2f} %", f"<= {MAX_NQ:g} %", quality.losses.nq <= MAX_NQ),
    ]
    if uplifts:
        largest = max(uplifts)
        rows.append(_millimetres("uplift at supports", largest, MAX_UPLIFT))
    if quality.contact_height_range is not None:
        rows.append(_millimetres("contact height range", quality.contact_height_range, MAX_HEIGHT_RANGE))
    return tuple(rows)


def _millimetres(name: str, value: float, limit: float) -> Criterion:
    return Criterion(name, f"{1e3 * value:.1f} mm", f"<= {1e3 * limit:g} mm", value <= limit)


def _odd_extension(signal: FloatArray, pad: int) -> FloatArray:
    before = 2.0 * signal[0] - signal[pad:0:-1]
    after = 2.0 * signal[-1] - signal[-2 : -pad - 2 : -1]
    return np.concatenate((before, signal, after))


def _edge(frequency: FloatArray, cutoff: float) -> FloatArray:
    phase = np.clip((frequency - cutoff) / (2.0 * _HALF_EDGE) + 0.5, 0.0, 1.0)
    gain: FloatArray = 0.5 * (1.0 + np.cos(np.pi * phase))
    return gain


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
