"""Numbers for a page: decimated without visible loss, and packed."""

from __future__ import annotations

import base64
from typing import Any, Final

import numpy as np

from master.arrays import FloatArray, IntArray

#: Points of a curve: more than a screen or a sheet of paper resolves.
MOST_POINTS: Final = 4000


def kept_samples(values: FloatArray, most: int = MOST_POINTS) -> IntArray:
    """Return the indices of the samples to draw, shape (m,), m <= ``most``: minimum and maximum of every stretch.

    Gaps (NaN) are kept as gaps: a stretch that begins with one keeps it.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A curve's ordinates at a constant step.
    most : int
        Largest number of samples to keep.

    Examples
    --------
    >>> kept_samples(np.array([0.0, 5.0, 1.0, 0.0, 0.0, -7.0, 0.0, 0.0]), 4).tolist()
    [0, 1, 5, 7]
    """
    n = len(values)
    if n <= most:
        return np.arange(n)
    stretches = np.array_split(np.arange(n), max(1, most // 2 - 1))
    kept = {0, n - 1}
    for stretch in stretches:
        kept.update(_extremes(values, stretch))
    return np.array(sorted(kept), dtype=np.intp)


def _extremes(values: FloatArray, stretch: IntArray) -> set[int]:
    part = values[stretch]
    known = stretch[np.isfinite(part)]
    if known.size < part.size / 2.0:
        return {int(stretch[int(np.argmin(np.isfinite(part)))])}
    there = values[known]
    return {int(known[int(np.argmin(there))]), int(known[int(np.argmax(there))])}


def packed(values: FloatArray) -> dict[str, str]:
    """Return numbers in the form that plotly.js reads, four bytes each.

    Examples
    --------
    >>> packed(np.array([1.0]))
    {'dtype': 'f4', 'bdata': 'AACAPw=='}
    """
    most = np.finfo("<f4").max  # larger ones are drawn at the edge
    return {"dtype": "f4", "bdata": _base64(np.clip(values, -most, most).astype("<f4"))}


def packed_integers(values: FloatArray, unit: float) -> str:
    """Return numbers as multiples of ``unit`` in 16 bits, base64; larger ones are clipped."""
    scaled = np.nan_to_num(np.round(np.asarray(values) / unit))
    return _base64(np.clip(scaled, -32768, 32767).astype("<i2"))


def _base64(values: Any) -> str:
    return base64.b64encode(values.tobytes()).decode("ascii")
