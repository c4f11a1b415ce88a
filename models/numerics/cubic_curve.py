"""A cubic spline through a table, evaluated one number at a time."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from models.arrays import FloatArray


class CubicCurve:
    """The cubic spline (not-a-knot) through points, its end values held outside.

    One number takes a microsecond here and ten in scipy, which is made for arrays.

    Parameters
    ----------
    places : ndarray, shape (n,)
        Rising; at least 3.
    values : ndarray, shape (n,)

    Examples
    --------
    >>> import numpy as np
    >>> x = np.linspace(0.0, 1.0, 5)
    >>> cube = CubicCurve(x, x**3)
    >>> round(cube.at(0.3), 12), cube.at(2.0)
    (0.027, 1.0)
    """

    def __init__(self, places: FloatArray, values: FloatArray) -> None:
        self._places = [float(x) for x in places]
        self._pieces = [tuple(map(float, piece)) for piece in _pieces(places, values)]
        self._ends = float(values[0]), float(values[-1])

    @property
    def range(self) -> tuple[float, float]:
        """First and last place."""
        return self._places[0], self._places[-1]

    @property
    def rows(self) -> FloatArray:
        """Place and coefficients of every piece, highest power first, shape (n, 5); the last one is a constant."""
        pieces = [[x, *piece] for x, piece in zip(self._places, self._pieces, strict=False)]
        return np.array([*pieces, [self._places[-1], 0.0, 0.0, 0.0, self._ends[1]]])

    def at(self, x: float) -> float:
        """Return the value at ``x``."""
        places = self._places
        if x <= places[0]:
            return self._ends[0]
        if x >= places[-1]:
            return self._ends[1]
        k = bisect_right(places, x) - 1
        a, b, c, d = self._pieces[k]
        t = x - places[k]
        return d + t * (c + t * (b + t * a))


def _pieces(places: FloatArray, values: FloatArray) -> FloatArray:
    """Return the coefficients of the pieces, highest power first, shape (n - 1, 4).

    The derivatives at the points follow from the continuity of the second one, and of the third one at the second point
    from either end. Not scipy's `CubicSpline`, which would bring `scipy.optimize` and more into a standalone FMU.
    """
    h = np.diff(places)
    slopes = np.diff(values) / h
    n = len(places)
    matrix, right = np.zeros((n, n)), np.zeros(n)
    for k in range(1, n - 1):
        matrix[k, k - 1 : k + 2] = h[k], 2 * (h[k - 1] + h[k]), h[k - 1]
        right[k] = 3 * (h[k] * slopes[k - 1] + h[k - 1] * slopes[k])
    if n == 3:  # a parabola
        matrix[0, :2] = matrix[2, 1:] = 1.0
        right[0], right[2] = 2 * slopes
    else:
        both = h[0] + h[1]
        matrix[0, :2] = h[1], both
        right[0] = ((h[0] + 2 * both) * h[1] * slopes[0] + h[0] ** 2 * slopes[1]) / both
        both = h[-1] + h[-2]
        matrix[-1, -2:] = both, h[-2]
        right[-1] = (h[-1] ** 2 * slopes[-2] + (2 * both + h[-1]) * h[-2] * slopes[-1]) / both
    rates = np.linalg.solve(matrix, right)
    bend = (rates[:-1] + rates[1:] - 2 * slopes) / h
    return np.stack([bend / h, (slopes - rates[:-1]) / h - bend, rates[:-1], values[:-1]], axis=1)
