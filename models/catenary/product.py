"""Products with sparse matrices that are computed again and again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from models.part import FloatArray

try:  # The routine behind scipy's own product, which spends a third of a small product on looking at its operands.
    from scipy.sparse._sparsetools import bsr_matvec as _bsr_matvec
    from scipy.sparse._sparsetools import csc_matvec as _csc_matvec
    from scipy.sparse._sparsetools import csr_matvec as _csr_matvec
except ImportError:  # pragma: no cover - a scipy that has moved it
    _bsr_matvec = _csc_matvec = _csr_matvec = None

_Routine = Callable[..., None]


class Product:
    """A sparse matrix that is multiplied with vectors, without allocating anything.

    Parameters
    ----------
    matrix : sparse, shape (m, n)
    routine : callable, optional
        scipy's compiled product; None takes the public operator.
    """

    def __init__(self, matrix: sp.spmatrix, routine: _Routine | None = _csr_matvec) -> None:
        self.matrix = sp.csr_matrix(matrix)
        self.matrix.sort_indices()
        m = self.matrix
        self._arguments = (*m.shape, m.indptr, m.indices, m.data)
        self._routine = routine

    def add(self, vector: FloatArray, result: FloatArray) -> None:
        """Add matrix @ vector to ``result``.

        Parameters
        ----------
        vector : ndarray, shape (n,)
        result : ndarray, shape (m,)
            Contiguous.

        Examples
        --------
        >>> result = np.ones(2)
        >>> Product(sp.csr_matrix([[1.0, 2.0], [0.0, 3.0]])).add(np.array([1.0, 1.0]), result)
        >>> result.tolist()
        [4.0, 4.0]
        """
        if self._routine is None:
            result += self.matrix @ vector
        else:
            self._routine(*self._arguments, vector, result)


class BlockProduct:
    """A matrix of dense blocks of one size that is multiplied with vectors: without an index for every entry.

    Parameters
    ----------
    matrix : sparse, shape (m, n)
        By rows of blocks.
    routine : callable, optional
        scipy's compiled product; None takes the public operator.
    """

    def __init__(self, matrix: sp.bsr_matrix, routine: _Routine | None = _bsr_matvec) -> None:
        self.matrix = matrix
        rows, columns = matrix.blocksize
        shape = matrix.shape[0] // rows, matrix.shape[1] // columns
        self._arguments = (*shape, rows, columns, matrix.indptr, matrix.indices, matrix.data.ravel())
        self._routine = routine

    def add(self, vector: FloatArray, result: FloatArray) -> None:
        """Add matrix @ vector to ``result``, shapes (n,) and (m,); ``result`` is contiguous.

        Examples
        --------
        >>> result = np.zeros(2)
        >>> BlockProduct(sp.bsr_matrix([[1.0, 2.0], [0.0, 3.0]], blocksize=(2, 2))).add(np.array([1.0, 1.0]), result)
        >>> result.tolist()
        [3.0, 3.0]
        """
        if self._routine is None:
            result += self.matrix @ vector
        else:
            self._routine(*self._arguments, vector, result)


class TransposedProduct:
    """The transpose of a matrix that has a `Product`, without a second copy of it: there is less to read in a step.

    Parameters
    ----------
    product : Product
    routine : callable, optional
        scipy's compiled product of compressed columns; None takes the public operator.
    """

    def __init__(self, product: Product, routine: _Routine | None = _csc_matvec) -> None:
        matrix = product.matrix
        self._matrix = matrix.T
        self._arguments = (matrix.shape[1], matrix.shape[0], matrix.indptr, matrix.indices, matrix.data)
        self._routine = routine

    def add(self, vector: FloatArray, result: FloatArray) -> None:
        """Add matrix.T @ vector to ``result``, shapes (m,) and (n,); ``result`` is contiguous.

        Examples
        --------
        >>> result = np.zeros(2)
        >>> TransposedProduct(Product(sp.csr_matrix([[1.0, 2.0], [0.0, 3.0]]))).add(np.array([1.0, 1.0]), result)
        >>> result.tolist()
        [1.0, 5.0]
        """
        if self._routine is None:
            result += self._matrix @ vector
        else:
            self._routine(*self._arguments, vector, result)


def inner(one: FloatArray, other: FloatArray) -> float:
    """Return the inner product of two long vectors on one thread.

    BLAS wakes its threads for those of more than ten thousand numbers, which may cost milliseconds.

    Examples
    --------
    >>> inner(np.array([1.0, 2.0]), np.array([3.0, 4.0]))
    11.0
    """
    return float(np.einsum("i,i->", one, other))
