"""Arrays for kernels in a book: a call costs more for every array that is handed over, so these are told by address."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


class ArrayBook:
    """Addresses of arrays, which are kept alive with it and must not be replaced.

    Parameters
    ----------
    arrays : sequence of ndarray
        Contiguous, of one dimension.

    Attributes
    ----------
    entries : ndarray of int, shape (2 * len(arrays),)
        Address and length of each; `floats64` and the like of `models.catenary.step.vector_kernels` read them.
    """

    def __init__(self, arrays: Sequence[Any]) -> None:
        assert all(array.ndim == 1 and array.flags.c_contiguous for array in arrays)
        self._arrays = tuple(arrays)
        self.entries = np.array([(array.ctypes.data, array.size) for array in self._arrays], dtype=np.int64).ravel()
