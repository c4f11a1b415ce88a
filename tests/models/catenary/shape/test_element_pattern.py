"""Sums of element matrices by a pattern, to the bit what SciPy makes of the same entries in coordinates."""

import numpy as np
import pytest
import scipy.sparse as sp

from models.catenary.shape.element_pattern import ElementPattern, element_dofs, translation_dofs

SIZE = 6 * 40


def drawn(seed):
    """Return degrees of freedom and matrices of elements, up to five of which meet in a node."""
    rng = np.random.default_rng(seed)
    along = np.stack([np.arange(39), np.arange(1, 40)], axis=1)
    across = np.array([[3, 20], [3, 21], [22, 3], [10, 11]])
    nodes = np.concatenate([along, across])
    return nodes, rng.standard_normal((len(nodes), 12, 12))


def in_coordinates(dofs, matrices):
    rows, columns = np.repeat(dofs, dofs.shape[1], axis=1).ravel(), np.tile(dofs, (1, dofs.shape[1])).ravel()
    return sp.csc_matrix((matrices.ravel(), (rows, columns)), shape=(SIZE, SIZE))


@pytest.mark.parametrize("seed", range(3))
def test_sums_are_those_of_entries_in_coordinates(seed):
    nodes, matrices = drawn(seed)
    dofs = element_dofs(nodes)
    pattern = ElementPattern.of(dofs, SIZE)
    for values in (matrices, 2.0 * matrices[::-1]):
        found, expected = pattern.assembled(values), in_coordinates(dofs, values)
        for part in ("data", "indices", "indptr"):
            assert np.array_equal(getattr(found, part), getattr(expected, part))


def test_part_of_the_degrees_of_freedom_is_added_in_the_same_order():
    nodes, matrices = drawn(5)
    kept = translation_dofs(np.array([[0, 1]]))[0]
    assert kept.tolist() == [0, 1, 2, 6, 7, 8]
    found = ElementPattern.of(element_dofs(nodes), SIZE).among(kept).assembled(matrices[:, kept[:, None], kept])
    translations = (np.arange(40)[:, None] * 6 + np.arange(3)).ravel()
    whole = in_coordinates(element_dofs(nodes), matrices)
    at = np.ix_(translations, translations)
    assert np.array_equal(found.toarray()[at], whole.toarray()[at])
    assert found.nnz == whole[translations][:, translations].nnz
