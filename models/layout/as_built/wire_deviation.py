"""How far the measured wire is from the designed one: a straight course between droppers and arms, and what is left.

What moves a wire against its design acts at droppers, arms and anchors. Between these its load is the design's, so that
the difference is straight there. It is fitted to all measured heights by least squares, which gives it at each knot
with a standard error, and leaves noise and the wire's own unevenness.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.sparse as sp
from scipy.linalg import solveh_banded

from models.arrays import BoolArray, FloatArray
from models.layout.as_built.measured_run import AsBuiltError

#: A knot is measured if its standard error is at most this many times that of a single height.
_LARGEST_ERROR: Final = 2.0
#: Weight that holds knots without measurements near zero, of that of one height.
_HOLD: Final = 1e-6
#: Heights farther from the rest than this [m], and than so many standard deviations, are none.
_FAR: Final = 0.02
_MANY: Final = 8.0
#: A normal deviation that half of the samples are within, over their median.
_MEDIAN_TO_SIGMA: Final = 1.4826


@dataclass(frozen=True)
class WireDeviation:
    """Measured minus designed height along a section's wire.

    Attributes
    ----------
    knots, value : ndarray, shape (k,)
        Places along the track, and the straight course there [m].
    error : ndarray, shape (k,)
        Standard error of ``value`` for a standard deviation of 1 m of a height.
    x, left : ndarray, shape (n,)
        Measured places, and what is left there [m].
    is_outlier : ndarray, shape (n,)
        Heights that were left out.
    sigma : float
        Standard deviation of a height about the course [m]; NaN if there are no more heights than knots.
    normal : ndarray, shape (2, k)
        The equations' matrix in banded form, of which ``sigma``^2 times the inverse is the covariance of ``value``.
    """

    knots: FloatArray
    value: FloatArray
    error: FloatArray
    x: FloatArray
    left: FloatArray
    is_outlier: BoolArray
    sigma: float
    normal: FloatArray

    @property
    def is_measured(self) -> BoolArray:
        """Return which knots enough heights were measured near, shape (k,)."""
        return self.error <= _LARGEST_ERROR

    @property
    def likeness(self) -> float:
        """Return the correlation of what is left at neighbouring places: near 0 of noise, near 1 of a smooth course."""
        left = self.left[~self.is_outlier]
        if len(left) < 3 or not left.any():
            return 0.0
        return float((left[1:] @ left[:-1]) / (left @ left))

    @property
    def is_noise(self) -> bool:
        """Return whether what is left at a place has nothing in common with what is left beside it."""
        count = max(int((~self.is_outlier).sum()), 1)
        return self.likeness <= 3.0 / np.sqrt(count)

    def covariance(self, rows: FloatArray) -> FloatArray:
        """Return the variances of sums of ``value`` [m^2], shape (m,), with the weights ``rows``, shape (m, k).

        Where what is left is alike at neighbouring places there is less to average than there are heights.
        """
        alike = 0.0 if self.is_noise else min(self.likeness, 0.95)
        variance = self.sigma**2 * (1.0 + alike) / (1.0 - alike)
        solved = solveh_banded(self.normal, rows.T, lower=False)
        return np.asarray(variance * np.einsum("mk,km->m", rows, solved))


def wire_deviation(x: FloatArray, deviation: FloatArray, knots: FloatArray) -> WireDeviation:
    """Fit a course that is straight between knots to heights above the design's.

    Parameters
    ----------
    x, deviation : ndarray, shape (n,)
        Places in rising order, and measured minus designed height [m].
    knots : ndarray, shape (k,)
        In rising order; heights are between the first and the last of them.

    Raises
    ------
    AsBuiltError
        If there is no height at all.
    """
    if not len(x):
        raise AsBuiltError("no measured height lies on the line")
    outlier = np.zeros(len(x), dtype=np.bool_)
    hats = _hats(x, knots)
    value = left = np.zeros(0)
    normal = np.zeros((2, len(knots)))
    for _ in range(3):
        kept = sp.diags((~outlier).astype(float)) @ hats
        normal = _banded((kept.T @ kept).tocsr())
        value = solveh_banded(normal, kept.T @ deviation, lower=False)
        left = deviation - hats @ value
        spread = _MEDIAN_TO_SIGMA * float(np.median(np.abs(left[~outlier])))
        now = np.abs(left) > max(_FAR, _MANY * spread)
        if np.array_equal(now, outlier) or now.all():
            break
        outlier = now
    error = np.sqrt(_diagonal_of_inverse(normal))
    held = int((error <= _LARGEST_ERROR).sum())
    free = int((~outlier).sum()) - held
    sigma = float(np.sqrt(left[~outlier] @ left[~outlier] / free)) if free > 0 else float("nan")
    return WireDeviation(knots, value, error, x, left, outlier, sigma, normal)


def _hats(x: FloatArray, knots: FloatArray) -> sp.csr_matrix:
    """Return the shares of the knots on both sides in the straight course at each place, shape (n, k)."""
    before = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2)
    share = (x - knots[before]) / (knots[before + 1] - knots[before])
    rows = np.repeat(np.arange(len(x)), 2)
    columns = np.stack([before, before + 1], axis=1).ravel()
    values = np.stack([1.0 - share, share], axis=1).ravel()
    return sp.csr_matrix((values, (rows, columns)), shape=(len(x), len(knots)))


def _banded(matrix: sp.csr_matrix) -> FloatArray:
    """Return a tridiagonal matrix as the solver wants it, knots without heights held by a little."""
    n = matrix.shape[0]
    result = np.zeros((2, n))
    result[1] = matrix.diagonal() + _HOLD
    result[0, 1:] = matrix.diagonal(1)
    return result


def _diagonal_of_inverse(banded: FloatArray) -> FloatArray:
    """Return the diagonal of the inverse of a symmetric tridiagonal matrix: from the pivots from both ends."""
    beside, diagonal = banded[0, 1:], banded[1]
    n = len(diagonal)
    down, up = diagonal.copy(), diagonal.copy()
    for k in range(1, n):
        down[k] -= beside[k - 1] ** 2 / down[k - 1]
        up[n - 1 - k] -= beside[n - 1 - k] ** 2 / up[n - k]
    return np.asarray(1.0 / (down + up - diagonal))
