"""Products with sparse matrices."""

import numpy as np
import pytest
import scipy.sparse as sp

from models.catenary.linear_motion.sparse_products import BlockProduct, Product, TransposedProduct


@pytest.mark.parametrize("routine", [None, "scipy's"])
def test_products_with_and_without_scipy_s_routine(routine):
    rng = np.random.default_rng(1)
    matrix = sp.random(30, 20, density=0.3, random_state=rng, format="csr")
    product = Product(matrix, None) if routine is None else Product(matrix)
    vector, result = rng.standard_normal(20), rng.standard_normal(30)
    expected = result + matrix @ vector
    product.add(vector, result)
    assert result == pytest.approx(expected, rel=1e-14)
    transposed = TransposedProduct(product, None) if routine is None else TransposedProduct(product)
    expected = vector + matrix.T @ result
    transposed.add(result, vector)
    assert vector == pytest.approx(expected, rel=1e-14)
    blocks = matrix.tobsr((5, 4))
    by_blocks = BlockProduct(blocks, None) if routine is None else BlockProduct(blocks)
    expected = result + matrix @ vector
    by_blocks.add(vector, result)
    assert result == pytest.approx(expected, rel=1e-14)
