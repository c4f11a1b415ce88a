"""Points and weights of Gauss-Legendre integration, without `numpy.polynomial`, which an FMU would carry for them."""

from __future__ import annotations

import numpy as np

from models.arrays import FloatArray


def gauss_points(count: int) -> tuple[FloatArray, FloatArray]:
    """Return points in (-1, 1) and their weights, which integrate polynomials of degree ``2 count - 1`` exactly.

    Both of shape (count,). They are eigenvalues and eigenvectors of the matrix of Legendre's recurrence [1]_.

    References
    ----------
    .. [1] G. Golub, J. Welsch, Calculation of Gauss quadrature rules, Mathematics of Computation 23 (1969).
    """
    k = np.arange(1.0, count)
    beside = k / np.sqrt(4.0 * k**2 - 1.0)
    points, vectors = np.linalg.eigh(np.diag(beside, 1) + np.diag(beside, -1))
    return points, 2.0 * vectors[0] ** 2
