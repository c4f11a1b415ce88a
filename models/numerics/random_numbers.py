"""Seeded normal numbers that are the same bits everywhere: on every machine, under every numpy and Python."""

from __future__ import annotations

from statistics import NormalDist
from typing import Final

import numpy as np
from numpy.random import Philox

from models.arrays import FloatArray

#: Decimals that are kept: logarithms differ in their last bit from one C library to the next.
_DECIMALS: Final = 12
#: The largest number below 1.
_BELOW_ONE: Final = 1.0 - 2.0**-53


def normal_numbers(seed: int, stream: int, count: int) -> FloatArray:
    """Return standard normal numbers, rounded to 1e-12, shape (count,).

    The raw words of numpy's Philox, a counter-based generator, are turned into numbers here: which words belong to a
    key is fixed by the method, while what numpy makes of them (`Generator.normal`) may change with its version.

    Parameters
    ----------
    seed : int
        What the user chooses, 0 or more.
    stream : int
        What the numbers are for: numbers of two streams are independent, and a new use leaves the old ones alone.
    count : int
        How many; the first ones do not depend on it.
    """
    words = Philox(key=np.array([seed, stream], dtype=np.uint64)).random_raw(count)
    inverse = NormalDist().inv_cdf
    shares = (min(((int(word) >> 11) + 0.5) / 2.0**53, _BELOW_ONE) for word in words)
    return np.array([round(inverse(share), _DECIMALS) for share in shares], dtype=np.float64)
