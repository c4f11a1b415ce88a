"""What attachments give way by under local loads: columns of a factor's inverse, where they are not zero."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np
import scipy.sparse as sp

from models.catenary.band import CUT, Factor
from models.part import FloatArray, IntArray

#: Droppers whose response is kept.
_KEPT_DROPPERS = 256
#: Attachments of the contact wires whose response is kept: strips come by once.
_KEPT_ATTACHMENTS = 24


@dataclass(frozen=True)
class Columns:
    """Responses of the attachments to a few loads, where they are not zero: they die out along the line.

    Attributes
    ----------
    rows : slice
        Attachments' displacements that they reach.
    values : ndarray, shape (n_rows, n)
    dropper_index : ndarray, shape (k,)
        Droppers that they stretch.
    dropper_stretch : ndarray, shape (k, n)
        Elongation of those droppers [m/N].
    """

    rows: slice
    values: FloatArray
    dropper_index: IntArray
    dropper_stretch: FloatArray

    def at(self, places: IntArray) -> FloatArray:
        """Return the values at some displacements of the attachments, shape (len(places), n)."""
        inside = (places >= self.rows.start) & (places < self.rows.stop)
        result = np.zeros((len(places), self.values.shape[1]))
        result[inside] = self.values[places[inside] - self.rows.start]
        return result


def joined(parts: Sequence[Columns]) -> Columns:
    """Return the columns of several as one, side by side."""
    rows = slice(min(part.rows.start for part in parts), max(part.rows.stop for part in parts))
    droppers = np.unique(np.concatenate([part.dropper_index for part in parts]))
    count = sum(part.values.shape[1] for part in parts)
    values, stretch = np.zeros((rows.stop - rows.start, count)), np.zeros((len(droppers), count))
    first = 0
    for part in parts:
        own = slice(first, first + part.values.shape[1])
        values[part.rows.start - rows.start : part.rows.stop - rows.start, own] = part.values
        stretch[np.searchsorted(droppers, part.dropper_index), own] = part.dropper_stretch
        first = own.stop
    return Columns(rows, values, droppers, stretch)


class Compliance:
    """Local responses of the attachments.

    Parameters
    ----------
    factor : Factor
        Of the matrix that the attachments feel.
    B : sparse, shape (n_droppers, n_attached)
        Rows of dropper elongation.
    """

    def __init__(self, factor: Factor, B: sp.csr_matrix) -> None:
        self._factor, self._B = factor, B
        self._by_place = B.tocsc()
        self._attachments: dict[int, Columns] = {}
        self.dropper_columns = DropperColumns(self)

    def attachment(self, places: IntArray) -> Columns:
        """Return the responses to unit loads on one attachment, whose displacements are at ``places``."""
        kept, key = self._attachments, int(places[0])
        found = kept.get(key)
        if found is None:
            found = self.columns(places, np.eye(len(places)))
            while len(kept) >= _KEPT_ATTACHMENTS:
                del kept[next(iter(kept))]
            kept[key] = found
        return found

    def columns(self, places: IntArray, load: FloatArray) -> Columns:
        """Return the responses to loads of shape (len(places), n) at some displacements of the attachments."""
        first = int(places.min())
        local = np.zeros((int(places.max()) - first + 1, load.shape[1]))
        local[places - first] = load
        begin, values = self._factor.near(first, local)
        rows = slice(begin, begin + len(values))
        part = self._by_place[:, rows]
        touched = np.unique(part.indices)
        stretch = part.tocsr()[touched] @ values
        size = np.abs(stretch).max(axis=1)
        near = size > CUT * size.max(initial=0.0)
        return Columns(rows, values, touched[near], np.ascontiguousarray(stretch[near]))

    def dropper(self, index: int) -> Columns:
        """Return the response to a unit force in a dropper."""
        row = self._B[[index]].tocoo()
        return self.columns(row.col, row.data[:, None])

    @property
    def droppers(self) -> int:
        """Return the number of droppers."""
        return int(self._B.shape[0])


class DropperColumns(Sequence[Columns]):
    """Response to a unit force in each dropper, solved when first asked for: few droppers ever slacken."""

    def __init__(self, compliance: Compliance) -> None:
        self._compliance = compliance
        self._known: dict[int, Columns] = {}

    def __len__(self) -> int:
        return self._compliance.droppers

    @overload
    def __getitem__(self, index: int) -> Columns: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Columns]: ...
    def __getitem__(self, index: int | slice) -> Columns | Sequence[Columns]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        found = self._known.get(index)
        if found is None:
            found = self._compliance.dropper(index)
            while len(self._known) >= _KEPT_DROPPERS:
                del self._known[next(iter(self._known))]
            self._known[index] = found
        return found
