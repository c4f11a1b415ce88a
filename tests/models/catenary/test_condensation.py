"""Block condensation against a plain sparse solve, and the blocks that a straight wire falls apart into."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from models.catenary.condensation import (
    Blocks,
    Condensed,
    factorised,
    order_by_blocks,
    plan_rotation,
    without_rounding,
)
from models.catenary.model import CatenaryModel
from models.time_integration import Newmark


@pytest.fixture(scope="module")
def model(short_line):
    return CatenaryModel(short_line)


@pytest.fixture(scope="module")
def k_hat(model):
    newmark = Newmark(1e-3)
    return (model.K + newmark.a0 * model.M + newmark.a1 * model.C).tocsr()


@pytest.mark.parametrize("shape", [(), (3,)])
def test_condensed_solution_is_the_plain_one(model, k_hat, shape):
    load = np.random.default_rng(1).standard_normal((k_hat.shape[0], *shape))
    expected = splu(k_hat.tocsc()).solve(load)
    found = Condensed(k_hat, model._blocks).solve(load)
    assert np.abs(found - expected).max() < 1e-11 * np.abs(expected).max()


def test_wires_fall_apart_into_in_plane_and_out_of_plane_blocks(model, short_line):
    """Six elements between droppers leave five nodes of three degrees of freedom in each block."""
    intervals = 2 * 6 * 8  # two wires, six spans, eight intervals
    assert model._blocks.batches == ((2 * intervals, 15),)


def test_rotation_to_nodal_axes_changes_no_energy(model):
    """The rotated stiffness, without what rounding leaves of zeros, is the same quadratic form."""
    matrices, Q = model.static.matrices, model._rotation
    rotated = (Q.T @ matrices.K @ Q).tocsr()
    cleaned = without_rounding(rotated, np.sqrt(rotated.diagonal()))
    assert cleaned.nnz < 0.7 * matrices.K.nnz
    rng = np.random.default_rng(2)
    for _ in range(3):
        d = rng.standard_normal(matrices.load.size)
        assert (Q.T @ d) @ cleaned @ (Q.T @ d) == pytest.approx(d @ matrices.K @ d, rel=1e-10)


def test_rotation_is_orthogonal():
    Q = plan_rotation(np.array([0.0, 0.3, -1.2]))
    assert (Q @ Q.T).toarray() == pytest.approx(np.eye(18), abs=1e-15)


def test_blocks_of_different_sizes_are_ordered_and_solved():
    """A chain with held nodes at irregular distances: tridiagonal, blocks of one, two and four."""
    n = 12
    matrix = sp.diags([-1.0, 2.5, -1.0], [-1, 0, 1], shape=(n, n), format="csr")
    inner = np.ones(n, dtype=bool)
    inner[[2, 5, 10]] = False
    order, blocks = order_by_blocks(matrix, inner)
    assert blocks == Blocks(((1, 1), (2, 2), (1, 4)))
    assert sorted(order.tolist()) == list(range(n))
    permuted = matrix[order][:, order].tocsr()
    load = np.arange(1.0, n + 1.0)
    expected = np.linalg.solve(matrix.toarray(), load)
    assert Condensed(permuted, blocks).solve(load[order]) == pytest.approx(expected[order], rel=1e-13)


def test_wide_bands_are_solved_as_well():
    rng = np.random.default_rng(3)
    root = sp.random(200, 200, density=0.2, random_state=rng)
    matrix = (root @ root.T + 50.0 * sp.eye(200)).tocsc()
    load = rng.standard_normal(200)
    assert factorised(matrix).solve(load) == pytest.approx(np.linalg.solve(matrix.toarray(), load), rel=1e-10)
