"""Solving for the attachments: one factorisation a step size, whole solutions and solutions near a load.

The displacements of the attachments are numbered along the track, so their matrix is a band.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
import scipy.sparse as sp
from scipy.linalg.lapack import dpbtrf, dpbtrs
from scipy.sparse.linalg import splu

from models.part import FloatArray

#: Half-bandwidth up to which a band solver is used.
_WIDEST_BAND = 64
#: Rows on each side of a load that a local solution begins with.
_FIRST_REACH = 96
#: A solution is cut where it has fallen below this share of its largest value, less than its rounding: a solution
#: with the effective stiffness of a line is right to about 1e-15 of its largest value.
CUT = 1e-15


class Factor(Protocol):
    """A factorised symmetric matrix."""

    def solve(self, load: FloatArray) -> FloatArray:
        """Return the solution for a load of shape (n,)."""

    def near(self, first: int, load: FloatArray) -> tuple[int, FloatArray]:
        """Return solutions for loads of shape (k, m) on the rows from ``first``: their first row, and values."""


class Banded:
    """Cholesky factor of a band.

    Attributes
    ----------
    matrix : sparse, shape (n, n)
    factor : ndarray, shape (width + 1, n)
        Lower triangle of the Cholesky factor, diagonal by diagonal.
    """

    def __init__(self, matrix: sp.coo_matrix, width: int) -> None:
        self.matrix = matrix.tocsr()
        self._reach = 0
        lower = matrix.row >= matrix.col
        band = np.zeros((width + 1, matrix.shape[0]), order="F")
        band[(matrix.row - matrix.col)[lower], matrix.col[lower]] = matrix.data[lower]
        self.factor, failed = dpbtrf(band, lower=1)
        if failed:
            raise np.linalg.LinAlgError(f"the effective stiffness is not positive definite (row {failed})")

    def solve(self, load: FloatArray) -> FloatArray:
        """Return the solution for a load of shape (n,)."""
        result: FloatArray = dpbtrs(self.factor, load, lower=1)[0]
        return result

    def near(self, first: int, load: FloatArray) -> tuple[int, FloatArray]:
        """Return solutions for loads of shape (k, m) on the rows from ``first``, where they are not zero.

        A part of the factor is the factor of that part, so only rows near the load are visited: the solution
        on a window is exact once what it leaves outside is below rounding.
        """
        if not self._reach:
            # How far a response reaches is a matter of the factor: told by its middle, not by what was asked before,
            # so that the same question has the same answer to the last bit whatever came before it.
            middle = self.factor.shape[1] // 2
            begin, values = self._near(middle, np.ones((1, 1)), _FIRST_REACH)
            self._reach = max(middle - begin, begin + len(values) - middle) + 2 * self.factor.shape[0]
        return self._near(first, load, self._reach)

    def _near(self, first: int, load: FloatArray, reach: int) -> tuple[int, FloatArray]:
        n = self.factor.shape[1]
        while True:
            begin, end = max(first - reach, 0), min(first + len(load) + reach, n)
            right = np.zeros((end - begin, load.shape[1]), order="F")
            right[first - begin : first - begin + len(load)] = load
            values = dpbtrs(self.factor[:, begin:end], right, lower=1, overwrite_b=1)[0]
            size = np.abs(values[:, 0]) if values.shape[1] == 1 else np.abs(values).max(axis=1)
            smallest, edge = CUT * size.max(), self.factor.shape[0]
            if (begin == 0 or size[:edge].max() <= smallest) and (end == n or size[-edge:].max() <= smallest):
                kept = np.flatnonzero(size > smallest)
                return begin + int(kept[0]), np.ascontiguousarray(values[kept[0] : kept[-1] + 1])
            reach *= 2


class Sparse:
    """Factor of a matrix whose band is too wide for a band solver."""

    def __init__(self, matrix: sp.csc_matrix) -> None:
        self._factor = splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})

    def solve(self, load: FloatArray) -> FloatArray:
        """Return the solution for a load of shape (n,)."""
        result: FloatArray = self._factor.solve(load)
        return result

    def near(self, first: int, load: FloatArray) -> tuple[int, FloatArray]:
        """Return solutions for loads of shape (k, m) on the rows from ``first``: whole ones."""
        right = np.zeros((self._factor.shape[0], load.shape[1]))
        right[first : first + len(load)] = load
        return 0, self._factor.solve(right)


def factorised(matrix: sp.spmatrix) -> Banded | Sparse:
    """Factorise a symmetric positive definite matrix whose degrees of freedom are numbered along the track.

    Its own order is banded and fills in least. Up to a certain width the band solver, which works on contiguous
    memory, is faster than the general sparse one.
    """
    entries = matrix.tocoo()
    width = int(np.abs(entries.row - entries.col).max(initial=0))
    return Banded(entries, width) if width <= _WIDEST_BAND else Sparse(matrix.tocsc())
