"""The effective stiffness of a step, factorised once, and the columns of its inverse that a step needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np
import scipy.sparse as sp

from models.catenary.condensation import Blocks, Condensed
from models.part import FloatArray, IntArray

#: A column is cut where it has fallen below this share of its largest value, less than rounding.
_CUT = 1e-16
#: Droppers whose response is kept.
_KEPT_DROPPERS = 256


@dataclass(frozen=True)
class Columns:
    """Some columns of K_hat^-1 B, where they are not zero.

    The response to a contact force or a slack dropper's force dies out along the line.

    Attributes
    ----------
    index : ndarray, shape (m,)
        Degrees of freedom, rising.
    values : ndarray, shape (m, n)
    dropper_index : ndarray, shape (k,)
        Droppers that the columns stretch.
    dropper_stretch : ndarray, shape (k, n)
        Elongation of those droppers [m/N].
    """

    index: IntArray
    values: FloatArray
    dropper_index: IntArray
    dropper_stretch: FloatArray

    def at(self, dofs: IntArray) -> FloatArray:
        """Return the values at some degrees of freedom, shape (len(dofs), n)."""
        place = np.minimum(np.searchsorted(self.index, dofs), len(self.index) - 1)
        inside = self.index[place] == dofs
        result = np.zeros((len(dofs), self.values.shape[1]))
        result[inside] = self.values[place[inside]]
        return result


class EffectiveStiffness:
    """Factorised K_hat, and the responses to what acts inside a step.

    Parameters
    ----------
    K_hat : sparse, shape (n, n)
        Symmetric positive definite.
    B : sparse, shape (n_droppers, n)
        Rows of dropper elongation.
    blocks : Blocks
        Degrees of freedom to condense out, the first ones of ``K_hat``.
    """

    def __init__(self, K_hat: sp.csr_matrix, B: sp.csr_matrix, blocks: Blocks) -> None:
        self._factor = Condensed(K_hat.tocsr(), blocks)
        self._B = B.tocsr()
        self.dropper_columns = DropperColumns(self._B, self.columns)

    def solve(self, load: FloatArray) -> FloatArray:
        """Return K_hat^-1 load, for loads of shape (n,) or (n, m)."""
        return self._factor.solve(load)

    def columns(self, load: FloatArray) -> Columns:
        """Return K_hat^-1 load for loads of shape (n, m), where it is not zero."""
        full = self._factor.solve(load)
        size = np.abs(full).max(axis=1)
        index = np.flatnonzero(size > _CUT * size.max())
        stretch = self._B @ full
        near = np.flatnonzero(np.abs(stretch).max(axis=1) > _CUT * np.abs(stretch).max(initial=1e-300))
        return Columns(index, np.ascontiguousarray(full[index]), near, np.ascontiguousarray(stretch[near]))


class DropperColumns(Sequence[Columns]):
    """Response to a unit force in each dropper, solved when first asked for: few droppers ever slacken.

    Parameters
    ----------
    B : sparse, shape (n_droppers, n)
        Rows of dropper elongation.
    respond : callable
        load, shape (n, 1) -> Columns.
    """

    def __init__(self, B: sp.csr_matrix, respond: Callable[[FloatArray], Columns]) -> None:
        self._B, self._respond = B, respond
        self._known: dict[int, Columns] = {}

    def __len__(self) -> int:
        return int(self._B.shape[0])

    @overload
    def __getitem__(self, index: int) -> Columns: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Columns]: ...
    def __getitem__(self, index: int | slice) -> Columns | Sequence[Columns]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        found = self._known.get(index)
        if found is None:
            found = self._respond(self._B[[index]].toarray().T)
            while len(self._known) >= _KEPT_DROPPERS:
                del self._known[next(iter(self._known))]
            self._known[index] = found
        return found
