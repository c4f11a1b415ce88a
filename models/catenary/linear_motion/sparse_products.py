"""Products with sparse matrices that are computed in every step."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray

try:  # The routine behind scipy's own product, which spends a third of a small product on looking at its operands.
    from scipy.sparse._sparsetools import bsr_matvec as _bsr_matvec
    from scipy.sparse._sparsetools import csc_matvec as _csc_matvec
    from scipy.sparse._sparsetools import csr_matvec as _csr_matvec
except ImportError:  # pragma: no cover - a scipy that has moved it
    _bsr_matvec = _csc_matvec = _csr_matvec = None

_Routine = Callable[..., None]


class Multiplier:
    """A sparse matrix that is multiplied by vectors without allocating anything.

    Parameters
    ----------
    matrix : sparse, shape (m, n)
    arguments : tuple
        The matrix as the routine takes it.
    routine : callable or None
        scipy's compiled product for it; None takes the public operator.
    """

    def __init__(self, matrix: sp.spmatrix, arguments: tuple[object, ...], routine: _Routine | None) -> None:
        self.matrix, self._arguments, self._routine = matrix, arguments, routine

    def add(self, vector: FloatArray, result: FloatArray) -> None:
        """Add matrix @ vector to ``result``.

        Parameters
        ----------
        vector : ndarray, shape (n,)
        result : ndarray, shape (m,)
            Contiguous.
        """
        if self._routine is None:
            result += self.matrix @ vector
        else:
            self._routine(*self._arguments, vector, result)


class Product(Multiplier):
    """A matrix compressed by rows.

    Parameters
    ----------
    matrix : sparse, shape (m, n)

    Examples
    --------
    >>> result = np.ones(2)
    >>> Product(sp.csr_matrix([[1.0, 2.0], [0.0, 3.0]])).add(np.array([1.0, 1.0]), result)
    >>> result.tolist()
    [4.0, 4.0]
    """

    def __init__(self, matrix: sp.spmatrix, routine: _Routine | None = _csr_matvec) -> None:
        rows = sp.csr_matrix(matrix)
        rows.sort_indices()
        super().__init__(rows, (*rows.shape, rows.indptr, rows.indices, rows.data), routine)


class BlockProduct(Multiplier):
    """A matrix of dense blocks of one size, which needs no index for every entry.

    Parameters
    ----------
    matrix : sparse, shape (m, n)
        By rows of blocks.

    Examples
    --------
    >>> result = np.zeros(2)
    >>> BlockProduct(sp.bsr_matrix([[1.0, 2.0], [0.0, 3.0]], blocksize=(2, 2))).add(np.array([1.0, 1.0]), result)
    >>> result.tolist()
    [3.0, 3.0]
    """

    def __init__(self, matrix: sp.bsr_matrix, routine: _Routine | None = _bsr_matvec) -> None:
        rows, columns = matrix.blocksize
        shape = matrix.shape[0] // rows, matrix.shape[1] // columns
        super().__init__(matrix, (*shape, rows, columns, matrix.indptr, matrix.indices, matrix.data.ravel()), routine)


class TransposedProduct(Multiplier):
    """The transpose of a matrix that has a `Product`, without a second copy of it, so that a step has less to read.

    Parameters
    ----------
    product : Product

    Examples
    --------
    >>> result = np.zeros(2)
    >>> TransposedProduct(Product(sp.csr_matrix([[1.0, 2.0], [0.0, 3.0]]))).add(np.array([1.0, 1.0]), result)
    >>> result.tolist()
    [1.0, 5.0]
    """

    def __init__(self, product: Product, routine: _Routine | None = _csc_matvec) -> None:
        rows, columns = product.matrix, product.matrix.T
        super().__init__(columns, (*columns.shape, rows.indptr, rows.indices, rows.data), routine)


def inner(one: FloatArray, other: FloatArray) -> float:
    """Return the inner product of two long vectors on one thread.

    BLAS wakes its threads for those of more than ten thousand numbers, which may cost milliseconds.

    Examples
    --------
    >>> inner(np.array([1.0, 2.0]), np.array([3.0, 4.0]))
    11.0
    """
    return float(np.einsum("i,i->", one, other))
