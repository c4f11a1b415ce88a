"""Seeded random numbers that are the same bits everywhere: on every machine, under every numpy and Python.

Both methods stand here without the modules that have them as well (numpy's Philox, NormalDist of statistics): these
would bring OpenSSL and a dozen other generators into every standalone FMU, 2 MB of its 20.
"""

from __future__ import annotations

# What NormalDist.inv_cdf calls; the module `statistics` itself imports hashlib.
from _statistics import _normal_dist_inv_cdf  # type: ignore[import-not-found]
from collections.abc import Iterator
from itertools import count as counting
from itertools import islice
from typing import Final

import numpy as np

from models.arrays import FloatArray

#: Decimals that are kept: logarithms differ in their last bit from one C library to the next.
_DECIMALS: Final = 12
#: The largest number below 1.
_BELOW_ONE: Final = 1.0 - 2.0**-53
_MASK: Final = 2**64 - 1
#: Multipliers and the steps of the key, and the number of rounds, of Philox4x64-10 [1].
_MULTIPLIERS: Final = (0xD2E7470EE14C6C93, 0xCA5A826395121157)
_KEY_STEPS: Final = (0x9E3779B97F4A7C15, 0xBB67AE8584CAA73B)
_ROUNDS: Final = 10


def normal_numbers(seed: int, stream: int, count: int) -> FloatArray:
    """Return standard normal numbers, rounded to 1e-12, shape (count,).

    The raw words of Philox4x64-10 [1]_, a counter-based generator, are turned into numbers here: which words belong to
    a key is fixed by the method, while what numpy makes of them (`Generator.normal`) may change with its version.

    Parameters
    ----------
    seed : int
        What the user chooses, 0 or more.
    stream : int
        What the numbers are for: numbers of two streams are independent, and a new use leaves the old ones alone.
    count : int
        How many; the first ones do not depend on it.

    References
    ----------
    .. [1] J. Salmon et al., Parallel random numbers: as easy as 1, 2, 3 (2011), table 2.
    """
    shares = _shares(seed, stream, count)
    return np.array([round(_normal_dist_inv_cdf(u, 0.0, 1.0), _DECIMALS) for u in shares], dtype=np.float64)


def uniform_numbers(seed: int, stream: int, count: int) -> FloatArray:
    """Return numbers that are spread evenly between 0 and 1, shape (count,); see `normal_numbers`.

    Parameters
    ----------
    seed, stream, count : int
        As there.

    Examples
    --------
    >>> uniform_numbers(1, 5, 2).round(6).tolist()
    [0.798855, 0.67244]
    """
    return np.array(list(_shares(seed, stream, count)), dtype=np.float64)


def _shares(seed: int, stream: int, count: int) -> Iterator[float]:
    """Yield numbers between 0 and 1, neither of them."""
    for word in islice(_words(seed, stream), count):
        yield min(((word >> 11) + 0.5) / 2.0**53, _BELOW_ONE)


def _words(seed: int, stream: int) -> Iterator[int]:
    """Yield 64-bit words of the generator whose key is (seed, stream), four a block, from block 1 on as numpy does."""
    for block in counting(1):
        a, b, c, d = block & _MASK, block >> 64, 0, 0
        key, other = seed, stream
        for _ in range(_ROUNDS):
            first, second = _MULTIPLIERS[0] * a, _MULTIPLIERS[1] * c
            a, b, c, d = (second >> 64) ^ b ^ key, second & _MASK, (first >> 64) ^ d ^ other, first & _MASK
            key, other = (key + _KEY_STEPS[0]) & _MASK, (other + _KEY_STEPS[1]) & _MASK
        yield from (a, b, c, d)
