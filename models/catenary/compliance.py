"""The effective stiffness of a step, factorised once, and its local inverse columns.

The response to a contact force or a slack dropper's force has died out within some tens of metres at a step of
1 ms, so columns of K_hat^-1 are kept as windows: a first degree of freedom and the values from there on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from models.part import FloatArray, IntArray

#: A column is cut where it has fallen below this share of its largest value, less than rounding.
_CUT = 1e-16


@dataclass(frozen=True)
class Columns:
    """Some columns of K_hat^-1 B, zero outside one window of degrees of freedom.

    Attributes
    ----------
    start : int
        First degree of freedom of the window.
    values : ndarray, shape (width, n)
    dropper_index : ndarray, shape (m,)
        Droppers that the columns stretch.
    dropper_stretch : ndarray, shape (m, n)
        Elongation of those droppers [m/N].
    """

    start: int
    values: FloatArray
    dropper_index: IntArray
    dropper_stretch: FloatArray

    @property
    def window(self) -> slice:
        """Return the window as a slice."""
        return slice(self.start, self.start + len(self.values))

    def at(self, dofs: IntArray) -> FloatArray:
        """Return the values at some degrees of freedom, shape (len(dofs), n)."""
        local = dofs - self.start
        inside = (local >= 0) & (local < len(self.values))
        result = np.zeros((len(dofs), self.values.shape[1]))
        result[inside] = self.values[local[inside]]
        return result


class EffectiveStiffness:
    """Factorised K_hat with the columns that slack droppers and contacts need.

    Parameters
    ----------
    K_hat : sparse, shape (n, n)
        Symmetric positive definite, its degrees of freedom numbered along the track.
    B : sparse, shape (n_droppers, n)
        Rows of dropper elongation.
    """

    def __init__(self, K_hat: sp.csc_matrix, B: sp.csr_matrix) -> None:
        # Numbered along the track, the matrix is banded: its own order fills in least. It is positive definite,
        # so no pivoting is needed.
        self._lu = splu(K_hat, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        self._B = B.tocsr()
        self.dropper_columns = self._dropper_columns()

    def solve(self, load: FloatArray) -> FloatArray:
        """Return K_hat^-1 load."""
        result: FloatArray = self._lu.solve(load)
        return result

    def columns(self, load: FloatArray) -> Columns:
        """Return K_hat^-1 load for loads of shape (n, m), as a window."""
        full = self._lu.solve(np.asarray(load))
        size = np.abs(full).max(axis=1)
        kept = np.flatnonzero(size > _CUT * size.max())
        start, stop = int(kept[0]), int(kept[-1]) + 1
        stretch = self._B @ full
        near = np.flatnonzero(np.abs(stretch).max(axis=1) > _CUT * np.abs(stretch).max(initial=1e-300))
        return Columns(start, np.ascontiguousarray(full[start:stop]), near, np.ascontiguousarray(stretch[near]))

    def _dropper_columns(self) -> tuple[Columns, ...]:
        transposed = self._B.T.tocsc()
        return tuple(self.columns(transposed[:, [j]].toarray()) for j in range(self._B.shape[0]))
