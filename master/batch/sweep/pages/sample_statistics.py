"""Statistics of samples: shares, means, quantiles and linear effects, each with how well it is known.

Intervals are those of independent samples. A Latin hypercube or a Sobol sequence fills the space more evenly, so that
estimates of means and shares scatter less than these intervals say.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import stats

from master.arrays import BoolArray, FloatArray, IntArray

#: Level of all confidence intervals.
LEVEL: Final = 0.95
#: Quantiles of bands and tables.
QUANTILES: Final = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class Estimate:
    """An estimate with its confidence interval; NaN where nothing can be said."""

    value: float
    low: float
    high: float


def share(count: int, total: int) -> Estimate:
    """Return the share of ``count`` in ``total`` with its exact binomial interval (Clopper and Pearson) [1]_.

    References
    ----------
    .. [1] C. J. Clopper, E. S. Pearson: The use of confidence or fiducial limits illustrated in the case of the
       binomial. Biometrika 26 (1934), 404-413.
    """
    if total == 0:
        return Estimate(math.nan, 0.0, 1.0)
    low, high = _exact(np.array([count]), np.array([total]))
    return Estimate(count / total, float(low[0]), float(high[0]))


def _exact(count: IntArray, total: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the exact intervals of shares."""
    tail = 0.5 * (1.0 - LEVEL)
    low, high = np.zeros(len(count)), np.ones(len(count))
    some, few = count > 0, count < total
    low[some] = stats.beta.ppf(tail, count[some], (total - count + 1)[some])
    high[few] = stats.beta.ppf(1.0 - tail, (count + 1)[few], (total - count)[few])
    return low, high


def running_share(happened: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the share after 1, 2, 3 ... samples and its interval's ends, each of shape (n,)."""
    count, total = np.cumsum(happened, dtype=np.intp), np.arange(1, len(happened) + 1)
    return count / total, *_exact(count, total)


def mean(values: FloatArray) -> Estimate:
    """Return the mean of finite values with its interval from Student's distribution."""
    there = values[np.isfinite(values)]
    if len(there) < 2:
        return Estimate(float(there[0]) if len(there) else math.nan, math.nan, math.nan)
    centre, width = float(there.mean()), _half_width(len(there), float(there.std(ddof=1)))
    return Estimate(centre, centre - width, centre + width)


def _half_width(count: int, deviation: float) -> float:
    return float(stats.t.ppf(0.5 + 0.5 * LEVEL, count - 1)) * deviation / math.sqrt(count)


def running_mean(values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the mean after 1, 2, 3 ... finite samples and its interval's ends (NaN for one), each of shape (n,)."""
    count = np.arange(1.0, len(values) + 1.0)
    shifted = values - values[:1]  # their squares then lose no digits
    centre = np.cumsum(shifted) / count
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.maximum(np.cumsum(shifted**2) - count * centre**2, 0.0) / (count - 1.0)
        half = stats.t.ppf(0.5 + 0.5 * LEVEL, count - 1.0) * np.sqrt(variance / count)
    whole = centre + values[:1]
    return whole, whole - half, whole + half


@dataclass(frozen=True)
class Effects:
    """Linear effects of parameters on a figure.

    Attributes
    ----------
    names : tuple of str
    change : tuple of Estimate
        Of the figure when a parameter goes from its 5 % to its 95 % quantile and the others stay.
    rank_correlation : tuple of float
        Spearman's, of parameter and figure.
    explained : float
        Share of the figure's variance that the linear model explains.
    count : int
        Samples that it comes from.
    """

    names: tuple[str, ...]
    change: tuple[Estimate, ...]
    rank_correlation: tuple[float, ...]
    explained: float
    count: int


def linear_effects(names: tuple[str, ...], inputs: FloatArray, figure: FloatArray) -> Effects | None:
    """Return linear effects by least squares, None if there are too few samples to tell them apart.

    Parameters
    ----------
    names : tuple of str
        Of the parameters.
    inputs : ndarray, shape (n, len(names))
    figure : ndarray, shape (n,)
    """
    there = np.isfinite(figure) & np.isfinite(inputs).all(axis=1)
    x, y = inputs[there], figure[there]
    free = len(y) - len(names) - 1
    if free < 1 or np.ptp(y) == 0.0:
        return None
    spans = np.quantile(x, QUANTILES[2], axis=0) - np.quantile(x, QUANTILES[0], axis=0)
    if not (spans > 0.0).all():
        return None
    model = np.column_stack((np.ones(len(y)), (x - x.mean(axis=0)) / spans))
    found, _, rank, _ = np.linalg.lstsq(model, y, rcond=None)
    if rank < model.shape[1]:
        return None
    rest = y - model @ found
    deviation = np.sqrt(np.diag(np.linalg.inv(model.T @ model)) * (rest @ rest) / free)[1:]
    width = float(stats.t.ppf(0.5 + 0.5 * LEVEL, free)) * deviation
    change = tuple(Estimate(float(b), float(b - w), float(b + w)) for b, w in zip(found[1:], width, strict=True))
    ranks = tuple(float(stats.spearmanr(column, y).statistic) for column in x.T)
    return Effects(names, change, ranks, float(1.0 - (rest @ rest) / ((y - y.mean()) @ (y - y.mean()))), len(y))
