"""How far the measured wire is from the designed one: what droppers and arms have done, and what is left.

What moves a wire against its design acts at droppers, arms and anchors. Between these its load is the design's, so that
the difference is straight there, but for the wire's bending. Such a course is fitted to all measured heights by least
squares, which gives it at each knot with a standard error, and leaves noise and the wire's own unevenness.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

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
#: Knots whose errors are computed at a time.
_AT_A_TIME: Final = 64


@dataclass(frozen=True)
class WireDeviation:
    """Measured minus designed height along a section's wire.

    Attributes
    ----------
    knots, value : ndarray, shape (k,)
        Places along the track, and the course there [m].
    error : ndarray, shape (k,)
        Standard error of ``value`` for a standard deviation of 1 m of a height.
    x, deviation, left : ndarray, shape (n,)
        Measured places, the deviation there, and what the course leaves of it [m].
    is_outlier : ndarray, shape (n,)
        Heights that were left out.
    sigma : float
        Standard deviation of a height about the course [m]; NaN if there are no more heights than knots.
    """

    knots: FloatArray
    value: FloatArray
    error: FloatArray
    x: FloatArray
    deviation: FloatArray
    left: FloatArray
    is_outlier: BoolArray
    sigma: float
    #: The wire's shapes at the places that count, and the factor of the equations: the inverse of their matrix times
    #: ``sigma``^2 is the covariance of ``value``.
    _shapes: sp.csr_matrix = field(repr=False, compare=False)
    _factor: Any = field(repr=False, compare=False)

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

    def course_of(self, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the courses, shape (k, m), of some quantities at the measured places, shape (n, m), and what is left.

        Both as of heights: without outliers.
        """
        counted = np.where(self.is_outlier[:, None], 0.0, columns)
        courses = np.asarray(self._factor.solve(np.asarray(self._shapes.T @ counted)))
        return courses, np.asarray(counted - self._shapes @ courses)

    def covariance(self, rows: FloatArray) -> FloatArray:
        """Return the variances of sums of ``value`` [m^2], shape (m,), with the weights ``rows``, shape (m, k).

        Where what is left is alike at neighbouring places there is less to average than there are heights.
        """
        alike = 0.0 if self.is_noise else min(self.likeness, 0.95)
        variance = self.sigma**2 * (1.0 + alike) / (1.0 - alike)
        return np.asarray(variance * np.einsum("mk,km->m", rows, self._factor.solve(np.ascontiguousarray(rows.T))))


def wire_deviation(x: FloatArray, deviation: FloatArray, knots: FloatArray, shapes: sp.csr_matrix) -> WireDeviation:
    """Fit a course to heights above the design's.

    Parameters
    ----------
    x, deviation : ndarray, shape (n,)
        Places in rising order, and measured minus designed height [m].
    knots : ndarray, shape (k,)
        In rising order.
    shapes : sparse, shape (n, k)
        Of the wire at the places, by unit rises at the knots.

    Raises
    ------
    AsBuiltError
        If there is no height at all.
    """
    if not len(x):
        raise AsBuiltError("no measured height lies on the line")
    outlier = np.zeros(len(x), dtype=np.bool_)
    value = left = np.zeros(0)
    factor, kept = None, shapes
    for _ in range(3):
        kept = sp.diags((~outlier).astype(float)) @ shapes
        factor = splu(sp.csc_matrix(kept.T @ kept + _HOLD * sp.identity(len(knots))))
        value = factor.solve(np.asarray(kept.T @ deviation))
        left = deviation - shapes @ value
        spread = _MEDIAN_TO_SIGMA * float(np.median(np.abs(left[~outlier])))
        now = np.abs(left) > max(_FAR, _MANY * spread)
        if np.array_equal(now, outlier) or now.all():
            break
        outlier = now
    error = np.sqrt(_diagonal_of_inverse(factor, len(knots)))
    held = int((error <= _LARGEST_ERROR).sum())
    free = int((~outlier).sum()) - held
    sigma = float(np.sqrt(left[~outlier] @ left[~outlier] / free)) if free > 0 else float("nan")
    return WireDeviation(knots, value, error, x, deviation, left, outlier, sigma, sp.csr_matrix(kept), factor)


def _diagonal_of_inverse(factor: Any, count: int) -> FloatArray:
    result = np.empty(count)
    for start in range(0, count, _AT_A_TIME):
        some = np.arange(start, min(start + _AT_A_TIME, count))
        unit = np.zeros((count, len(some)))
        unit[some, np.arange(len(some))] = 1.0
        result[some] = factor.solve(unit)[some, np.arange(len(some))]
    return result
