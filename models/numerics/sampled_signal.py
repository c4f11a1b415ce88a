"""Values between the rows of a table over time: held, linear or smooth, with exact rates and integrals.

The cost of a value does not depend on how long the table is: its place is looked for from the last one.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import Final, NamedTuple

import numpy as np

from models.arrays import FloatArray

HELD: Final = "held"
LINEAR: Final = "linear"
SMOOTH: Final = "smooth"
#: Ways between the rows.
INTERPOLATIONS: Final = (HELD, LINEAR, SMOOTH)


class Sample(NamedTuple):
    """A table at one time: values, rates, integrals from the first row, each of shape (k,)."""

    value: FloatArray
    rate: FloatArray
    integral: FloatArray


class SampledSignal:
    """Columns of a table over time.

    Before the first row and after the last the values of these are held, at rate 0; or the table repeats itself.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Rising; at least 2.
    values : ndarray, shape (n, k)
    interpolation : str
        One of `INTERPOLATIONS`. "smooth" is the cubic that rises and falls only where the rows do [1]_.
    repeats : bool
        Whether the first row follows on the last, at the same time.

    References
    ----------
    .. [1] F. N. Fritsch, J. Butland, "A method for constructing local monotone piecewise cubic interpolants",
       SIAM J. Sci. Stat. Comput. 5 (1984): slopes are harmonic means of the neighbouring secants.

    Examples
    --------
    >>> signal = SampledSignal(np.array([0.0, 2.0]), np.array([[20.0], [30.0]]), LINEAR)
    >>> found = signal.at(1.0)
    >>> float(found.value[0]), float(found.rate[0]), float(found.integral[0])
    (25.0, 5.0, 22.5)
    """

    def __init__(self, time: FloatArray, values: FloatArray, interpolation: str, repeats: bool = False) -> None:
        self._time, self._values = time, values
        self._is_held, self._repeats = interpolation == HELD, repeats
        self._slopes = monotone_slopes(time, values) if interpolation == SMOOTH else None
        step = np.diff(time)[:, None]
        areas = step * values[:-1] if self._is_held else 0.5 * step * (values[:-1] + values[1:])
        if self._slopes is not None:
            areas += step**2 / 12.0 * (self._slopes[:-1] - self._slopes[1:])
        self._areas = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(areas, axis=0)])
        self._first, self._end = float(time[0]), float(time[-1])
        self._place = 0

    @property
    def span(self) -> tuple[float, float]:
        """First and last time."""
        return self._first, self._end

    def at(self, time: float) -> Sample:
        """Return values, rates and integrals at a time."""
        laps = 0.0
        if self._repeats:
            period = self._end - self._first
            laps = math.floor((time - self._first) / period)
            time = min(max(time - laps * period, self._first), self._end)
            if time == self._end:
                laps, time = laps + 1.0, self._first
        value, rate, integral = self._within(time)
        return Sample(value, rate, integral + laps * self._areas[-1] if laps else integral)

    def _within(self, time: float) -> Sample:
        values, areas = self._values, self._areas
        if time < self._first:
            return Sample(values[0], np.zeros(values.shape[1]), values[0] * (time - self._first))
        if time > self._end or (self._is_held and time == self._end):
            return Sample(values[-1], np.zeros(values.shape[1]), areas[-1] + values[-1] * (time - self._end))
        k = self._find(time)
        begin = float(self._time[k])
        t, length = time - begin, float(self._time[k + 1]) - begin
        y, change = values[k], values[k + 1] - values[k]
        if self._is_held:
            return Sample(y, np.zeros(len(y)), areas[k] + t * y)
        if time == self._end:  # the row itself, not what rounding makes of it
            y_end = values[-1]
            rate = change / length if self._slopes is None else self._slopes[-1]
            return Sample(y_end, rate, areas[-1])
        secant = change / length
        if self._slopes is None:
            return Sample(y + t * secant, secant, areas[k] + t * (y + 0.5 * t * secant))
        m, last = self._slopes[k], self._slopes[k + 1]
        second = (3.0 * secant - 2.0 * m - last) / length
        third = (m + last - 2.0 * secant) / length**2
        return Sample(
            y + t * (m + t * (second + t * third)),
            m + t * (2.0 * second + 3.0 * t * third),
            areas[k] + t * (y + t * (0.5 * m + t * (second / 3.0 + 0.25 * t * third))),
        )

    def _find(self, time: float) -> int:
        """Return the row before a time within the table, looked for from the last one in growing strides."""
        rows, last = self._time, len(self._time) - 2
        low, stride = self._place, 1
        while low > 0 and rows[low] > time:
            low, stride = max(0, low - stride), 2 * stride
        high, stride = low + 1, 1
        while high <= last and rows[high] <= time:
            high, stride = min(last + 1, high + stride), 2 * stride
        self._place = min(bisect_right(rows, time, low, high) - 1, last)
        return self._place


def monotone_slopes(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return the slopes of the monotone cubic at the rows of a table, shape (n, k).

    Inside they are weighted harmonic means of the two secants, 0 where these have opposite signs; at the ends the slope
    of the parabola through three rows, as far as that rises or falls as they do.
    """
    step = np.diff(time)[:, None]
    secant = np.diff(values, axis=0) / step
    if len(secant) == 1:
        return np.concatenate([secant, secant])
    before, after = secant[:-1], secant[1:]
    agree = before * after > 0.0
    early, late = 2.0 * step[1:] + step[:-1], step[1:] + 2.0 * step[:-1]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        mean = (early + late) / (early / before + late / after)
    inside = np.where(agree, mean, 0.0)
    first = _end_slope(step[0], step[1], secant[0], secant[1])
    last = _end_slope(step[-1], step[-2], secant[-1], secant[-2])
    return np.concatenate([first[None], inside, last[None]])


def _end_slope(near: FloatArray, far: FloatArray, secant: FloatArray, next_secant: FloatArray) -> FloatArray:
    slope = ((2.0 * near + far) * secant - near * next_secant) / (near + far)
    steep = (np.sign(secant) != np.sign(next_secant)) & (np.abs(slope) > 3.0 * np.abs(secant))
    slope = np.where(steep, 3.0 * secant, slope)
    return np.where(np.sign(slope) == np.sign(secant), slope, 0.0)
