"""The low-pass filter of the contact force, and which samples and places belong to the interval of interest.

One filter serves every command [1]_. It works in the frequency domain on the whole record, extended on both sides by
odd reflection; the interval is cut out afterwards, so that its ends are not the ends of a filter.

References
----------
.. [1] EN 50317 and EN 50318 ask for the force up to 20 Hz. The order 6 is recalled from them, not read; the phase is
   unknown. Both are therefore settings, stated wherever a figure is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from master.arrays import BoolArray, FloatArray

ComplexArray = npt.NDArray[np.complex128]
#: Frequencies [Hz], shape (n,) -> the share of each that passes, shape (n,).
Response = Callable[[FloatArray], FloatArray | ComplexArray]

Kind = Literal["butterworth", "fft"]
Phase = Literal["zero", "causal"]

#: An open interval begins this long after the first contact [s]: raising is over by then.
SETTLING: Final = 1.0
#: Time after the first contact during which any of the filters rings visibly [s]: two periods of 20 Hz.
FILTER_REACH: Final = 0.1
#: Time by which the record is extended on both sides before filtering [s].
_PADDING: Final = 2.0
#: Half the width of the edge of ``fft`` [Hz].
_HALF_EDGE: Final = 0.25
#: A position this near to a bound of the interval is on it [m].
_ON_BOUND: Final = 1e-6
#: A support this near to an interval stands in it [m]: intervals are given in whole metres, supports stand between.
_NEAR: Final = 1.0


@dataclass(frozen=True)
class ForceFilter:
    """How the contact force is low-passed.

    Attributes
    ----------
    kind : str
        ``butterworth``: magnitude 1 / sqrt(1 + (f / cutoff)^(2 order)), -3 dB at the cut-off. ``fft``: brick wall with
        a raised-cosine edge 0.5 Hz wide, which has neither order nor phase.
    order : int
        Order of the Butterworth filter.
    cutoff : float
        Cut-off frequency [Hz].
    phase : str
        ``zero``: the magnitude alone. ``causal``: what a measuring chain does, with its delay at low frequencies
        removed from the positions.
    """

    kind: Kind = "butterworth"
    order: int = 6
    cutoff: float = 20.0
    phase: Phase = "zero"

    @property
    def short(self) -> str:
        """The filter in three words."""
        if self.kind == "fft":
            return f"fft {self.cutoff:g} Hz"
        return f"butterworth {self.order}, {self.cutoff:g} Hz, {_PHASES[self.phase]}"

    @property
    def sentence(self) -> str:
        """The filter in full, so that it can be repeated."""
        if self.kind == "fft":
            edge = f"raised-cosine edge {self.cutoff - _HALF_EDGE:g} to {self.cutoff + _HALF_EDGE:g} Hz"
            what = f"fft: brick-wall low-pass at {self.cutoff:g} Hz, zero phase ({edge})"
        else:
            how = "zero phase" if self.phase == "zero" else "causal, its delay at low frequencies taken out"
            what = f"butterworth: low-pass of order {self.order}, -3 dB at {self.cutoff:g} Hz, {how}"
        return f"{what}; in the frequency domain, on the whole record continued by odd reflection"

    @property
    def band(self) -> str:
        """The band that it passes."""
        return f"0-{self.cutoff:g} Hz"

    def at(self, cutoff: float) -> ForceFilter:
        """Return the same filter with another cut-off [Hz]."""
        return ForceFilter(self.kind, self.order, cutoff, self.phase)

    @property
    def others(self) -> tuple[ForceFilter, ...]:
        """The other filters that the standards may mean, with the same cut-off."""
        order = 6 if self.kind == "fft" else self.order
        known = (
            ForceFilter("butterworth", order, self.cutoff, "zero"),
            ForceFilter("butterworth", order, self.cutoff, "causal"),
            ForceFilter("fft", cutoff=self.cutoff),
        )
        return tuple(f for f in known if (f.kind, f.phase) != (self.kind, "zero" if self.kind == "fft" else self.phase))


_PHASES: Final = {"zero": "zero phase", "causal": "causal"}
DEFAULT: Final = ForceFilter()
#: The filter of results that name none: they were made before there was a choice.
BEFORE_CHOICE: Final = ForceFilter("fft")


def low_pass(signal: FloatArray, step: float, chosen: ForceFilter) -> FloatArray:
    """Return the part of a signal below the cut-off; constants and straight lines pass unchanged.

    Parameters
    ----------
    signal : ndarray, shape (n,)
        Samples at a constant step.
    step : float
        Sampling step [s].
    chosen : ForceFilter
        If its cut-off is above half the sampling frequency, the signal passes unchanged.

    Returns
    -------
    ndarray, shape (n,)
    """
    if _passes_whole(signal, step, chosen):
        return signal.copy()
    return _through(signal, step, lambda frequency: _response(frequency, chosen))


def band_pass(signal: FloatArray, step: float, low: float, high: float, chosen: ForceFilter) -> FloatArray:
    """Return the part of a signal between two frequencies [Hz], at zero phase; ``low = 0`` keeps the mean.

    The squared magnitudes of the high-pass and of the low-pass at ``low`` add up to 1, so that the variances of
    neighbouring bands add up.
    """
    edges = ForceFilter(chosen.kind, chosen.order)
    upper, lower = edges.at(high), edges.at(low)

    def gain(frequency: FloatArray) -> FloatArray:
        passed = np.ones(len(frequency)) if _passes_whole(signal, step, upper) else _magnitude(frequency, upper)
        return passed * _high_pass(frequency, lower) if low > 0.0 else passed

    return _through(signal, step, gain, keeps_line=low <= 0.0)


def _passes_whole(signal: FloatArray, step: float, chosen: ForceFilter) -> bool:
    edge = _HALF_EDGE if chosen.kind == "fft" else 0.0
    return len(signal) < 3 or chosen.cutoff - edge >= 0.5 / step


def _through(signal: FloatArray, step: float, response: Response, keeps_line: bool = True) -> FloatArray:
    """Return a signal filtered by a response over the frequency [Hz]."""
    pad = min(len(signal) - 1, round(_PADDING / step))
    padded = _odd_extension(signal, pad)
    line = np.linspace(padded[0], padded[-1], len(padded))  # passes unchanged; without it the ends would be a jump
    frequency = np.asarray(np.fft.rfftfreq(len(padded), step), dtype=np.float64)
    filtered = np.fft.irfft(np.fft.rfft(padded - line) * response(frequency), len(padded))
    whole: FloatArray = filtered + line if keeps_line else filtered
    return whole[pad : pad + len(signal)]


def _odd_extension(signal: FloatArray, pad: int) -> FloatArray:
    before = 2.0 * signal[0] - signal[pad:0:-1]
    after = 2.0 * signal[-1] - signal[-2 : -pad - 2 : -1]
    return np.concatenate((before, signal, after))


def _response(frequency: FloatArray, chosen: ForceFilter) -> FloatArray | ComplexArray:
    if chosen.kind == "butterworth" and chosen.phase == "causal":
        return _causal(frequency / chosen.cutoff, chosen.order)
    return _magnitude(frequency, chosen)


def _magnitude(frequency: FloatArray, chosen: ForceFilter) -> FloatArray:
    if chosen.kind == "fft":
        share = np.clip((frequency - chosen.cutoff) / (2.0 * _HALF_EDGE) + 0.5, 0.0, 1.0)
        wall: FloatArray = 0.5 * (1.0 + np.cos(np.pi * share))
        return wall
    # In logarithms, so that high orders do not overflow; 0 Hz passes unchanged.
    with np.errstate(divide="ignore"):
        power = 2.0 * chosen.order * np.log(frequency / chosen.cutoff)
    gain: FloatArray = np.exp(-0.5 * np.logaddexp(0.0, power))
    return gain


def _high_pass(frequency: FloatArray, lower: ForceFilter) -> FloatArray:
    low = _magnitude(frequency, lower)
    # The two halves of the wall add up as they are: a part of the spectrum is cut off, nothing is filtered.
    high: FloatArray = 1.0 - low if lower.kind == "fft" else np.sqrt(np.maximum(0.0, 1.0 - low**2))
    return high


def _causal(ratio: FloatArray, order: int) -> ComplexArray:
    """Return the response of the analogue Butterworth filter over f / cutoff, its delay at 0 Hz removed.

    Its poles are exp(i pi (2 k + order - 1) / (2 order)), k = 1 ... order.
    """
    poles = np.exp(0.5j * np.pi * (2.0 * np.arange(1, order + 1) + order - 1.0) / order)
    response = np.exp(1j * ratio * float(np.sum(1.0 / -poles).real))
    for pole in poles:
        response = response * (-pole / (1j * ratio - pole))
    return response


def settled(force: FloatArray, step: float) -> BoolArray:
    """Return where the filtered force means something, shape (n,).

    A record that begins without contact has a jump where contact is made, and a 20 Hz filter rings on both sides of
    it. Everything up to `FILTER_REACH` after the first contact is left out.

    Examples
    --------
    >>> settled(np.array([0.0, 0.0, 9.0, 9.0, 9.0]), 0.05).tolist()
    [False, False, False, False, True]
    >>> settled(np.array([9.0, 0.0, 9.0]), 0.05).all()
    np.True_
    """
    first = _first_contact(force)
    return _from(len(force), first + round(FILTER_REACH / step) if first else first)


def interval_mask(position: FloatArray, start: float | None, end: float | None) -> BoolArray:
    """Return which samples lie in the interval of interest, shape (n,).

    Its end belongs to it, its beginning does not, so that samples stand for steps and adjacent intervals share none.
    Recorded digits do not resolve a sample on a bound, so it counts as on the bound within a micrometre.
    """
    inside = np.ones(len(position), dtype=np.bool_)
    if start is not None:
        inside &= position > start + _ON_BOUND
    if end is not None:
        inside &= position <= end + _ON_BOUND
    return inside


def evaluated(
    force: FloatArray,
    position: FloatArray,
    step: float,
    interval: tuple[float | None, float | None],
    settling: float = SETTLING,
) -> BoolArray:
    """Return which samples the figures are taken from, shape (n,): those in the interval of interest.

    Where the interval is open on the side from which the run enters, it begins ``settling`` after the first contact:
    before that the pantograph is still being raised.

    Parameters
    ----------
    force, position : ndarray, shape (n,)
        Contact force [N] and track position [m].
    step : float
        Sampling step [s].
    interval : tuple
        Its bounds along the track [m]; None where it is open.
    settling : float
        Time after the first contact [s]; 0 for a record that begins in the middle of a run.
    """
    inside = interval_mask(position, *interval)
    entry = interval[0] if len(position) and position[-1] >= position[0] else interval[1]
    if entry is None:
        inside &= _from(len(force), _first_contact(force) + round(settling / step))
    return inside


def stands_in(x: float | None, interval: tuple[float | None, float | None], period: float = 0.0) -> bool:
    """Return whether a support is in an interval of the track, ends included; on a line that repeats, in some lap.

    A support within a metre of an end stands on it.

    Parameters
    ----------
    x : float or None
        Position along the track [m]; None if it is unknown.
    interval : (float or None, float or None)
        Ends of the interval [m]; None where it has none.
    period : float
        Length after which the line repeats [m]; 0 if it does not.

    Examples
    --------
    >>> stands_in(20.0, (110.0, 150.0)), stands_in(20.0, (110.0, 150.0), 100.0)
    (False, True)
    """
    if x is None:
        return False
    start = -math.inf if interval[0] is None else interval[0] - _NEAR
    end = math.inf if interval[1] is None else interval[1] + _NEAR
    if period:
        x = start if math.isinf(start) else x + period * math.ceil((start - x) / period)
    return start <= x <= end


def _first_contact(force: FloatArray) -> int:
    """Return the index of the first sample in contact; the number of samples if there is none."""
    found = force > 0.0
    return int(np.argmax(found)) if found.any() else len(force)


def _from(count: int, first: int) -> BoolArray:
    return np.arange(count) >= first
