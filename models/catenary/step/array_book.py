"""Arrays for kernels in a book: a call costs more for every array that is handed over, so these are told by address."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


class ArrayBook:
    """Addresses of arrays, which are kept alive with it and must not be replaced.

    Parameters
    ----------
    first, last : sequence of ndarray
        Contiguous; the arrays are those of the first, then those of the last.

    Attributes
    ----------
    entries : ndarray of int, shape (2 n,)
        Address and size of each; a `reader` of `models.catenary.step.vector_kernels` reads them, as of one dimension.
    last
        The parameter.
    """

    def __init__(self, first: Sequence[Any], last: Sequence[Any]) -> None:
        self._first, self.last = first, last
        assert all(array.flags.c_contiguous for array in (*first, *last))
        self.entries = np.array([(array.ctypes.data, array.size) for array in (*first, *last)], dtype=np.int64).ravel()
