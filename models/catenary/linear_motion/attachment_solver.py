"""Solving for the attachments: one factorisation per step size, whole solutions and solutions near a load.

The displacements of the attachments are numbered along the track, so their matrix is a band. That of a line which
closes on itself is a cyclic band: the last few rows reach the first few as well. Without its last rows, the border, it
is a band again; and it may be cut open anywhere, so that what is solved near a load is far from the cut.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
import scipy.sparse as sp
from scipy.linalg.lapack import dpbtrf, dpbtrs, dtbtrs  # of BLAS itself a standalone FMU would carry a megabyte more
from scipy.sparse.linalg import splu

from models.arrays import FloatArray

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
        """Return solutions for loads of shape (k, m) on the rows from ``first``: their first row, and values.

        In a cyclic band the first row follows on the last.
        """


class Banded:
    """Cholesky factor of a band.

    Attributes
    ----------
    matrix : sparse, shape (n, n)
    width : int
        Its half-bandwidth.
    factor : ndarray, shape (width + 1, n)
        Lower triangle of the Cholesky factor, diagonal by diagonal.
    """

    def __init__(self, matrix: sp.coo_matrix, width: int) -> None:
        self.matrix, self.width = matrix.tocsr(), width
        self._reach = 0
        lower = matrix.row >= matrix.col
        band = np.zeros((width + 1, matrix.shape[0]), order="F")
        band[(matrix.row - matrix.col)[lower], matrix.col[lower]] = matrix.data[lower]
        self.factor, failed = dpbtrf(band, lower=1)
        if failed:
            raise np.linalg.LinAlgError(f"the effective stiffness is not positive definite (row {failed})")
        #: The same as U' D U with ones on the diagonal of U, an upper triangle: with no division in every row, a single
        #: load is solved in half the time that LAPACK takes with the factor.
        self._unit, self._diagonal = np.zeros_like(self.factor), self.factor[0] ** 2
        for k, diagonal in enumerate(self.factor / self.factor[0]):
            self._unit[width - k, k:] = diagonal[: len(diagonal) - k]

    def solve(self, load: FloatArray) -> FloatArray:
        """Return the solution for a load of shape (n,) or (n, m)."""
        if load.ndim > 1:
            return np.asarray(dpbtrs(self.factor, load, lower=1)[0])
        result: FloatArray = dtbtrs(self._unit, load, trans="T", diag="U")[0]
        result /= self._diagonal
        return np.asarray(dtbtrs(self._unit, result, diag="U", overwrite_b=1)[0])

    def near(self, first: int, load: FloatArray) -> tuple[int, FloatArray]:
        """Return solutions for loads of shape (k, m) on the rows from ``first``, where they are not zero.

        A part of the factor is the factor of that part, so only rows near the load are visited: the solution
        on a window is exact once what it leaves outside is below rounding.
        """
        if not self._reach:
            # How far a response reaches depends on the factor alone. It is measured at the middle, not taken from
            # earlier calls, so that the same question has the same answer to the last bit whatever came before it.
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


class Cyclic:
    """Factors of a cyclic band: whole, and cut open at two places for solutions near a load.

    With A the band, b the border and C the columns between them, the border is eliminated from the rest once,

        Z = A^-1 C,    S = M_bb - C' Z,    x_b = S^-1 (f_b - C' A^-1 f),    x = A^-1 f - Z x_b.

    C has entries in the first and last rows only, and Z dies out from there.

    Parameters
    ----------
    matrix : sparse, shape (n, n)
    width : int
        Half-bandwidth, counted round the end.

    Attributes
    ----------
    matrix, width
        The parameters.
    """

    def __init__(self, matrix: sp.spmatrix, width: int) -> None:
        self.matrix, self.width = matrix.tocsr(), width
        self._inner = matrix.shape[0] - width
        inner, border = slice(0, self._inner), slice(self._inner, None)
        self._band = Banded(self.matrix[inner, inner].tocoo(), width)
        self._border = np.ascontiguousarray(self.matrix[border, inner].toarray())
        follow = self._band.solve(self._border.T)
        rest = self.matrix[border, border].toarray() - self._border @ follow
        self._rest = np.linalg.inv(np.linalg.cholesky(0.5 * (rest + rest.T)))
        self._follow = [(part, follow[part].copy()) for part in _ends(np.abs(follow).max(axis=1))]
        self._touch = [(part, self._border[:, part].copy()) for part in _ends(np.abs(self._border).max(axis=0))]
        self._half = matrix.shape[0] // 2
        turned = np.roll(np.arange(matrix.shape[0]), -self._half)[: self._inner]
        self._opposite = Banded(self.matrix[turned][:, turned].tocoo(), width)

    def solve(self, load: FloatArray) -> FloatArray:
        """Return the solution for a load of shape (n,) or (n, m)."""
        inner = self._inner
        result = np.empty_like(load)
        result[:inner] = self._band.solve(load[:inner])
        right = load[inner:].copy()
        for part, columns in self._touch:
            right -= columns @ result[part]
        border = result[inner:] = self._rest.T @ (self._rest @ right)
        for part, columns in self._follow:
            result[part] -= columns @ border
        return result

    def near(self, first: int, load: FloatArray) -> tuple[int, FloatArray]:
        """Return solutions for loads of shape (k, m) on the rows from ``first``, where they are not zero.

        The ring is cut open where it is far from the load. A solution that has not died out there is found whole.
        """
        n, quarter = self.matrix.shape[0], self._half // 2
        away = 0 if quarter <= first < n - quarter else self._half
        at, last = (first - away) % n, self._inner - self.width
        if at >= self.width and at + len(load) <= last:
            begin, values = (self._opposite if away else self._band).near(at, load)
            if begin >= self.width and begin + len(values) <= last:
                return (begin + away) % n, values
        whole = np.zeros((n, load.shape[1]))
        whole[(first + np.arange(len(load))) % n] = load
        return 0, self.solve(whole)


def _ends(size: FloatArray) -> list[slice]:
    """Return where values that die out from both ends are above rounding: all, or from either end."""
    large, n = np.flatnonzero(size > CUT * size.max(initial=0.0)), len(size)
    first, last = large[large < n // 2], large[large >= n // 2]
    begin, end = (int(first[-1]) + 1 if first.size else 0), (int(last[0]) if last.size else n)
    return [slice(0, begin), slice(end, n)]


def factorised(matrix: sp.spmatrix) -> Banded | Cyclic | Sparse:
    """Factorise a symmetric positive definite matrix whose degrees of freedom are numbered along the track.

    Its own order is banded, or a cyclic band, and fills in least. Up to a certain width the band solver, which works on
    contiguous memory, is faster than the general sparse one.
    """
    entries, n = matrix.tocoo(), matrix.shape[0]
    distance = np.abs(entries.row - entries.col)
    width = int(distance.max(initial=0))
    if width <= _WIDEST_BAND:
        return Banded(entries, width)
    width = int(np.minimum(distance, n - distance).max())
    return Cyclic(matrix, width) if width <= min(_WIDEST_BAND, n // 4) else Sparse(matrix.tocsc())
