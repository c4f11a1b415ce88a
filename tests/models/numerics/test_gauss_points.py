"""Points of Gauss-Legendre integration."""

from __future__ import annotations

import numpy as np
import pytest

from models.numerics.gauss_points import gauss_points


@pytest.mark.parametrize("count", [1, 2, 3, 8])
def test_they_are_those_of_numpy(count):
    points, weights = gauss_points(count)
    wanted = np.polynomial.legendre.leggauss(count)
    np.testing.assert_allclose(points, wanted[0], atol=1e-15)
    np.testing.assert_allclose(weights, wanted[1], rtol=1e-14)


def test_polynomials_are_integrated_as_far_as_promised():
    points, weights = gauss_points(3)
    assert weights @ points**4 == pytest.approx(2.0 / 5.0, rel=1e-14)
    assert abs(weights @ points**6 - 2.0 / 7.0) > 0.01
