"""Attachments in lanes: products and solutions against dense ones, for bands of any length and rings."""

import numpy as np
import pytest
import scipy.sparse as sp

from models.catenary.step.attachment_lanes import AttachmentLanes
from models.catenary.step.engine_choice import kernels


@pytest.fixture(scope="module")
def compiled_kernels():
    pytest.importorskip("numba")
    return kernels()


def _matrix(n, width, seed, is_ring=False):
    """Return a symmetric band, or a cyclic one, with holes; large where it is stiff."""
    rng = np.random.default_rng(seed)
    k = np.arange(1, width + 1)
    row, step = np.repeat(np.arange(n), width), np.tile(k, n)
    kept = (rng.random(row.size) < 0.6) & (is_ring | (row + step < n))
    row, column = row[kept], ((row + step) % n)[kept]
    value = rng.uniform(-1.0, 0.0, row.size)
    lower = sp.csr_matrix((value, (row, column)), shape=(n, n))
    scale = sp.diags(10.0 ** rng.uniform(-0.5, 0.5, n))
    matrix = lower + lower.T
    return (scale @ (matrix + sp.diags(0.5 - matrix.sum(axis=1).A1)) @ scale).tocsr()


@pytest.mark.parametrize(
    ("n", "width", "is_ring"),
    [
        (3, 1, False),
        (15, 7, False),
        (40, 7, False),
        (100, 7, False),
        (263, 12, False),
        (900, 7, False),
        (403, 31, False),
        (40, 7, True),
        (101, 7, True),
        (903, 12, True),
    ],
)
def test_products_and_solutions_are_those_of_the_matrices(n, width, is_ring, compiled_kernels):
    matrix, stiff, heavy = (_matrix(n, width, seed, is_ring) for seed in (1, 2, 3))
    lanes = AttachmentLanes(matrix, width, (stiff, heavy), compiled_kernels)
    rng = np.random.default_rng(4)
    load = rng.standard_normal(n) * np.sqrt(matrix.diagonal())
    expected = np.linalg.solve(matrix.toarray(), load)
    assert lanes.solve(load) == pytest.approx(expected, rel=1e-9, abs=1e-11 * np.abs(expected).max())
    x, v, right = rng.standard_normal((3, n))
    laid_out = [lanes.laid_out(values) for values in (x, v, right)]
    compiled_kernels.multiply(lanes.arrays, *laid_out)
    expected = stiff @ x + heavy @ v + right
    assert laid_out[2][lanes.slots] == pytest.approx(expected, rel=1e-12, abs=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("is_ring", [False, True])
@pytest.mark.parametrize("first", [0, 3, 440, 890, 898])
def test_a_solution_near_its_load_is_the_whole_one(first, is_ring, compiled_kernels):
    matrix = _matrix(903, 12, 1, is_ring)
    lanes = AttachmentLanes(matrix, 12, (matrix, matrix), compiled_kernels)
    load = np.zeros((903, 2))
    load[first : first + 4] = np.random.default_rng(first).standard_normal((4, 2))
    whole = np.linalg.solve(matrix.toarray(), load)
    begin, values = lanes.near(first, load[first : first + 4])
    near = np.zeros_like(whole)
    near[(begin + np.arange(len(values))) % 903] = values
    assert np.abs(near - whole).max() < 1e-12 * np.abs(whole).max()


def test_a_matrix_that_is_not_positive_definite_is_refused(compiled_kernels):
    matrix = sp.diags([1.0] * 50 + [-1.0] + [1.0] * 50).tocsr()
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        AttachmentLanes(matrix, 1, (matrix, matrix), compiled_kernels)
