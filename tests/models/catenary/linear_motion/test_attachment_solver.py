"""Solving for the attachments, whole and near a load."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from models.catenary.linear_motion.attachment_solver import Banded, Sparse, factorised


def _band(n=900, width=7, seed=1):
    rng = np.random.default_rng(seed)
    diagonals = [rng.uniform(-1.0, 0.0, n) for _ in range(width)]
    lower = sp.diags(diagonals, [-k - 1 for k in range(width)], shape=(n, n))
    return (lower + lower.T + 14.5 * sp.eye(n)).tocsr()


def test_both_factorisations_solve():
    matrix = _band()
    load = np.random.default_rng(3).standard_normal(matrix.shape[0])
    expected = splu(matrix.tocsc()).solve(load)
    assert isinstance(factorised(matrix), Banded)
    for factor in (factorised(matrix), Sparse(matrix.tocsc())):
        assert factor.solve(load) == pytest.approx(expected, rel=1e-12)


def test_wide_bands_are_solved_as_well():
    rng = np.random.default_rng(3)
    root = sp.random(200, 200, density=0.2, random_state=rng)
    matrix = (root @ root.T + 50.0 * sp.eye(200)).tocsc()
    load = rng.standard_normal(200)
    factor = factorised(matrix)
    assert isinstance(factor, Sparse)
    assert factor.solve(load) == pytest.approx(np.linalg.solve(matrix.toarray(), load), rel=1e-10)


def test_a_matrix_that_is_not_positive_definite_is_refused():
    with pytest.raises(np.linalg.LinAlgError, match="row 3"):
        factorised(sp.diags([1.0, 1.0, -1.0, 1.0]))


@pytest.mark.parametrize("first", [0, 3, 440, 890, 898])
def test_a_solution_near_its_load_is_the_whole_one(first):
    matrix = _band()
    local = np.random.default_rng(first).standard_normal((min(12, 900 - first), 3))
    load = np.zeros((900, 3))
    load[first : first + len(local)] = local
    whole = splu(matrix.tocsc()).solve(load)
    begin, values = factorised(matrix).near(first, local)
    near = np.zeros_like(whole)
    near[begin : begin + len(values)] = values
    assert np.abs(near - whole).max() < 1e-13 * np.abs(whole).max()


def test_a_solution_that_does_not_die_out_is_whole():
    n = 700
    matrix = sp.diags([-1.0, 2.0 + 1e-6, -1.0], [-1, 0, 1], shape=(n, n))
    load = np.zeros(n)
    load[300] = 1.0
    begin, values = factorised(matrix).near(300, np.ones((1, 1)))
    assert (begin, len(values)) == (0, n)
    assert values[:, 0] == pytest.approx(splu(matrix.tocsc()).solve(load), rel=1e-9)
