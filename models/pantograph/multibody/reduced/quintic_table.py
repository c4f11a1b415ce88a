"""Functions of one variable, tabulated once and evaluated together: a polynomial of fifth degree in every cell.

They are known at the points of Chebyshev polynomials in a few panels; the cells take value, first and second derivative
from those at their ends, so that the functions and two derivatives go on from cell to cell.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import FloatArray

#: Points of a panel, and cells in it.
POINTS: Final = 14
CELLS: Final = 12
#: Share of a function's size that its last coefficients may have in a panel, or the function is not smooth enough.
_SMALL: Final = 3e-9


@dataclass(frozen=True)
class QuinticTable:
    """Functions over an interval, in cells of equal length.

    Attributes
    ----------
    start, end : float
    cells : ndarray, shape (cells, functions, 6)
        Coefficients in powers of the share of a cell, lowest first.
    """

    start: float
    end: float
    cells: FloatArray

    def at(self, x: float) -> FloatArray:
        """Return the functions at ``x``, shape (functions,)."""
        place = (x - self.start) * len(self.cells) / (self.end - self.start)
        k = min(max(int(place), 0), len(self.cells) - 1)
        values: FloatArray = self.cells[k] @ (place - k) ** np.arange(6)
        return values


def points_of(start: float, end: float) -> FloatArray:
    """Return where functions must be known in a panel, shape (POINTS,)."""
    nodes = np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)[::-1]
    points: FloatArray = 0.5 * (start + end) + 0.5 * (end - start) * nodes
    return points


def tabulated(edges: FloatArray, values: FloatArray) -> tuple[QuinticTable, FloatArray]:
    """Tabulate functions over panels of equal length.

    Parameters
    ----------
    edges : ndarray, shape (panels + 1,)
    values : ndarray, shape (panels, POINTS, functions)
        At `points_of` every panel.

    Returns
    -------
    table : QuinticTable
    doubt : ndarray, shape (panels,)
        How large the last coefficients are, as a share of what is allowed: above 1 a panel is too coarse.
    """
    nodes = np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)[::-1]
    coefficients = np.linalg.solve(_chebyshev(nodes)[0], values)
    scale = np.maximum(np.abs(values).max(axis=(0, 1)), 1e-3)
    doubt = (np.abs(coefficients[:, -2:]) / scale).max(axis=(1, 2)) / _SMALL
    basis = _chebyshev(np.linspace(-1.0, 1.0, CELLS + 1))
    share = 2.0 / CELLS  # of a panel's half length: derivatives count per cell
    zeroth, first, second = (share**k * (b @ coefficients) for k, b in enumerate(basis))
    left = np.stack([zeroth[:, :-1], first[:, :-1], 0.5 * second[:, :-1]], axis=-1)
    right = np.stack([zeroth[:, 1:], first[:, 1:], second[:, 1:]], axis=-1)
    # Hermite: what is left of the right end's value, slope and bend by the first three powers.
    gap = right - left @ np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 2.0, 2.0]])
    last = gap @ np.linalg.inv(np.array([[1.0, 3.0, 6.0], [1.0, 4.0, 12.0], [1.0, 5.0, 20.0]]))
    cells = np.concatenate([left, last], axis=-1)
    return QuinticTable(float(edges[0]), float(edges[-1]), cells.reshape(-1, *cells.shape[2:])), doubt


def _chebyshev(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the first POINTS polynomials at places within -1 and 1, with two derivatives, each (len(x), POINTS)."""
    value, slope, bend = (np.zeros((len(x), POINTS)) for _ in range(3))
    value[:, 0], value[:, 1], slope[:, 1] = 1.0, x, 1.0
    for k in range(2, POINTS):
        value[:, k] = 2.0 * x * value[:, k - 1] - value[:, k - 2]
        slope[:, k] = 2.0 * value[:, k - 1] + 2.0 * x * slope[:, k - 1] - slope[:, k - 2]
        bend[:, k] = 4.0 * slope[:, k - 1] + 2.0 * x * bend[:, k - 1] - bend[:, k - 2]
    return value, slope, bend
