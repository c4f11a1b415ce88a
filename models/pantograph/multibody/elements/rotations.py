"""Orientation of rigid bodies by Euler parameters [1]_.

References
----------
.. [1] P. E. Nikravesh, "Computer-Aided Analysis of Mechanical Systems", Prentice-Hall 1988, chapter 6.
"""

from __future__ import annotations

import numpy as np

from models.arrays import FloatArray


def _rotation_table() -> FloatArray:
    """Return T, shape (16, 9), with vec(A) = T^T vec(p p^T)."""
    table = np.zeros((4, 4, 3, 3))
    for k in range(3):
        table[0, 0, k, k] = 1.0
        for n in range(3):
            table[n + 1, n + 1, k, k] = 1.0 if n == k else -1.0
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        table[i + 1, j + 1, i, j] = table[i + 1, j + 1, j, i] = 2.0
        table[0, k + 1, i, j] = -2.0
        table[0, k + 1, j, i] = 2.0
    return table.reshape(16, 9)


def _rate_table() -> FloatArray:
    """Return T, shape (12, 4), with p' = T^T vec(p w^T): half the product of p and the body-fixed rate w."""
    table = np.zeros((4, 3, 4))
    for k in range(3):
        table[k + 1, k, 0] = -0.5
        table[0, k, k + 1] = 0.5
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        table[i + 1, j, k + 1] = 0.5
        table[j + 1, i, k + 1] = -0.5
    return table.reshape(12, 4)


def _skew_table() -> FloatArray:
    """Return T, shape (3, 9), with vec(w~) = T^T w."""
    table = np.zeros((3, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        table[k, i, j] = -1.0
        table[k, j, i] = 1.0
    return table.reshape(3, 9)


ROTATION_TABLE = _rotation_table()
RATE_TABLE = _rate_table()
SKEW_TABLE = _skew_table()


def euler_parameters(vector_part: FloatArray) -> FloatArray:
    """Complete (e1, e2, e3) to unit Euler parameters with e0 >= 0.

    Parameters
    ----------
    vector_part : ndarray, shape (..., 3)
        Axis times the sine of half the angle; not longer than 1.

    Returns
    -------
    ndarray, shape (..., 4)

    Examples
    --------
    >>> euler_parameters(np.array([0.0, 0.6, 0.0])).tolist()
    [0.8, 0.0, 0.6, 0.0]
    """
    square = np.sum(vector_part**2, axis=-1, keepdims=True)
    return np.concatenate([np.sqrt(np.maximum(1.0 - square, 0.0)), vector_part], axis=-1)


def rotation_matrices(p: FloatArray) -> FloatArray:
    """Return the matrices A that turn body-fixed components into global ones.

    Parameters
    ----------
    p : ndarray, shape (n, 4)
        Euler parameters.

    Returns
    -------
    ndarray, shape (n, 3, 3)
    """
    products = p[:, :, None] * p[:, None, :]
    return (products.reshape(-1, 16) @ ROTATION_TABLE).reshape(-1, 3, 3)


def euler_rates(p: FloatArray, w: FloatArray) -> FloatArray:
    """Return p', shape (n, 4), of bodies turning with the body-fixed angular velocities w [rad/s]."""
    return (p[:, :, None] * w[:, None, :]).reshape(-1, 12) @ RATE_TABLE


def skew(w: FloatArray) -> FloatArray:
    """Return the matrices w~ with w~ b = w x b, shape (n, 3, 3)."""
    return (w @ SKEW_TABLE).reshape(-1, 3, 3)


def turned(p: FloatArray, angles: FloatArray) -> FloatArray:
    """Turn bodies by small or large body-fixed rotation vectors.

    Parameters
    ----------
    p : ndarray, shape (n, 4)
        Euler parameters.
    angles : ndarray, shape (n, 3)
        Rotation vectors in body-fixed components [rad].

    Returns
    -------
    ndarray, shape (n, 4)
        Unit Euler parameters.
    """
    size = _lengths(angles)
    argument = np.pi * (size / (2.0 * np.pi))
    argument[argument == 0.0] = np.pi * 1e-20  # as in `np.sinc`, whose value there is 1
    product = np.cos(0.5 * size) * p + 2.0 * euler_rates(p, 0.5 * angles * (np.sin(argument) / argument))
    return product / _lengths(product)


def _lengths(rows: FloatArray) -> FloatArray:
    """Return what ``np.linalg.norm`` makes of rows, shape (n, 1), which takes a few of them three times as long."""
    lengths: FloatArray = np.sqrt(np.add.reduce(rows * rows, axis=1, keepdims=True))
    return lengths


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return a x b along the last axis; much quicker than ``np.cross`` on a few vectors."""
    return np.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        axis=-1,
    )


def normals(axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two unit vectors that with ``axis``, shape (3,), make a right-handed frame."""
    unit = axis / np.linalg.norm(axis)
    first = np.zeros(3)
    first[int(np.argmin(np.abs(unit)))] = 1.0
    first -= (first @ unit) * unit
    first /= np.linalg.norm(first)
    return first, cross(unit, first)
