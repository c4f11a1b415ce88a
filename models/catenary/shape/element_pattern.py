"""Where the entries of element matrices go in a sparse matrix, found once for one set of points after another."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray, IntArray
from models.catenary.shape.beam_elements import NODE_DOFS


class ElementPattern:
    """The pattern of a global matrix over elements of some kind.

    Parameters
    ----------
    order : ndarray, shape (m,)
        Places in the flat element matrices of all entries, column by column of the global matrix.
    rows : ndarray, shape (m,)
        Rows of these entries, ascending in a column.
    ends : ndarray, shape (size + 1,)
        Where columns begin and end.
    local : int
        Degrees of freedom of an element.
    """

    def __init__(self, order: IntArray, rows: IntArray, ends: IntArray, local: int) -> None:
        self._order, self._rows, self._ends, self._local = order, rows, ends, local

    @classmethod
    def of(cls, dofs: IntArray, size: int) -> ElementPattern:
        """Return the pattern over elements with degrees of freedom of shape (n, k), of ``size`` in all."""
        local = dofs.shape[1]
        rows, columns = np.repeat(dofs, local, axis=1).ravel(), np.tile(dofs, (1, local)).ravel()
        # Few bits are sorted by radix, five times as fast.
        order = np.argsort(columns.astype(np.min_scalar_type(size)), kind="stable")
        ends = np.concatenate([[0], np.cumsum(np.bincount(columns, minlength=size))])
        # Sorted by SciPy itself: entries that fall together are added in the order in which it would add them.
        places = sp.csc_matrix((order, rows[order], ends), shape=(size, size))
        places.sort_indices()
        return cls(places.data, places.indices, places.indptr, local)

    def among(self, kept: IntArray) -> ElementPattern:
        """Return the pattern of elements with some of their degrees of freedom, which are added in the same order."""
        place = np.full(self._local, -1)
        place[kept] = np.arange(len(kept))
        element, entry = np.divmod(self._order, self._local**2)
        row, column = place[entry // self._local], place[entry % self._local]
        inside = (row >= 0) & (column >= 0)
        order = (element * len(kept) + row) * len(kept) + column
        ends = np.concatenate([[0], np.cumsum(inside)])[self._ends].astype(self._ends.dtype)
        return ElementPattern(order[inside], self._rows[inside], ends, len(kept))

    def assembled(self, matrices: FloatArray) -> sp.csc_matrix:
        """Return the sum of element matrices, shape (n, k, k): to the bit that of their entries in coordinates."""
        size = len(self._ends) - 1
        entries = (matrices.ravel()[self._order], self._rows.copy(), self._ends.copy())
        result = sp.csc_matrix(entries, shape=(size, size))
        result.has_sorted_indices = True
        result.sum_duplicates()
        return result


def element_dofs(nodes: IntArray) -> IntArray:
    """Return the degrees of freedom of elements of two nodes, shape (n, 12)."""
    return (nodes[:, :, None] * NODE_DOFS + np.arange(NODE_DOFS)).reshape(len(nodes), 2 * NODE_DOFS)


def translation_dofs(nodes: IntArray) -> IntArray:
    """Return the degrees of freedom that are translations of the ends of elements, shape (n, 6)."""
    return (nodes[:, :, None] * NODE_DOFS + np.arange(3)).reshape(len(nodes), 6)
