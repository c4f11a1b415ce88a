"""How far attachments give way under local loads: columns of a factor's inverse, where they are not zero."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray, IntArray
from models.catenary.linear_motion.attachment_solver import CUT, Factor
from models.catenary.linear_motion.sparse_products import Product

#: Droppers whose response is kept.
_KEPT_DROPPERS = 256
#: Displacements of attachments whose response is kept: four strips on two wires meet fewer at a time.
_KEPT_PLACES = 256


@dataclass(frozen=True)
class Columns:
    """Responses of the attachments to a few loads, where they are not zero: they die out along the line.

    Attributes
    ----------
    rows : slice or ndarray of int, shape (n_rows,)
        Attachments' displacements that they reach; listed where a line closes on itself within their reach.
    values : ndarray, shape (n_rows, n)
    dropper_index : ndarray, shape (k,)
        Droppers that they stretch.
    dropper_force : ndarray, shape (k, n)
        What that adds to their pulls [N/N].
    """

    rows: slice | IntArray
    values: FloatArray
    dropper_index: IntArray
    dropper_force: FloatArray

    def at(self, places: IntArray) -> FloatArray:
        """Return the values at some displacements of the attachments, shape (len(places), n)."""
        if isinstance(self.rows, slice):
            offset = places - self.rows.start
        else:
            offset = (places - self.rows[0]) % (self.rows.max() + 1)
        inside = (offset >= 0) & (offset < len(self.values))
        result = np.zeros((len(places), self.values.shape[1]))
        result[inside] = self.values[offset[inside]]
        return result


class Compliance:
    """Local responses of the attachments.

    Parameters
    ----------
    factor : Factor
        Of the matrix that the attachments feel.
    B : sparse, shape (n_droppers, n_attached)
        Rows of dropper elongation.
    stiffness : ndarray, shape (n_droppers,)
        Pull of a dropper per elongation, within a step per change of it [N/m].
    """

    def __init__(self, factor: Factor, B: sp.csr_matrix, stiffness: FloatArray) -> None:
        self._factor, self._B, self._stiffness = factor, B, stiffness
        self._kept: dict[int, Columns] = {}
        self._whole, self._elongate = np.zeros(B.shape[1]), Product(B)
        self.dropper_columns = DropperColumns(self)

    def unit(self, place: int) -> Columns:
        """Return the response to a unit load on one displacement of an attachment."""
        kept = self._kept
        found = kept.get(place)
        if found is None:
            found = self._response(place, np.ones((1, 1)))
            while len(kept) >= _KEPT_PLACES:
                del kept[next(iter(kept))]
            kept[place] = found
        return found

    def prepare(self, places: IntArray) -> bool:
        """Find one of the responses to unit loads at ``places`` ahead of its use; return whether all are there."""
        for place in places.tolist():
            if place not in self._kept:
                self.unit(place)
                return False
        return True

    def units(self, places: IntArray) -> Columns:
        """Return the responses to unit loads at ``places``, side by side."""
        parts = [self.unit(place) for place in places.tolist()]
        force = np.zeros((len(parts), self.droppers))
        for k, part in enumerate(parts):
            force[k, part.dropper_index] = part.dropper_force[:, 0]
        near = np.flatnonzero(force.any(axis=0))
        return Columns(*self._side_by_side(parts), near, np.ascontiguousarray(force[:, near].T))

    def dropper(self, index: int) -> Columns:
        """Return the response to a unit force in a dropper."""
        row = slice(self._B.indptr[index], self._B.indptr[index + 1])
        places, values = self._B.indices[row], self._B.data[row]
        first = int(places.min())
        load = np.zeros((int(places.max()) - first + 1, 1))
        load[places - first, 0] = values
        return self._response(first, load)

    @property
    def droppers(self) -> int:
        """Return the number of droppers."""
        return int(self._B.shape[0])

    def _response(self, first: int, load: FloatArray) -> Columns:
        """Return the response to a load of shape (k, 1) on the displacements from ``first``."""
        begin, values = self._factor.near(first, load)
        rows = self._rows(begin, len(values))
        self._whole[rows] = values[:, 0]
        stretch = np.zeros(self._B.shape[0])
        self._elongate.add(self._whole, stretch)
        self._whole[rows] = 0.0
        size = np.abs(stretch)
        near = np.flatnonzero(size > CUT * size.max(initial=0.0))
        return Columns(rows, values, near, (self._stiffness[near] * stretch[near])[:, None])

    def _rows(self, first: int, count: int) -> slice | IntArray:
        """Return ``count`` rows from ``first`` on; in a line that closes on itself the first follows on the last."""
        n = len(self._whole)
        return slice(first, first + count) if first + count <= n else (first + np.arange(count)) % n

    def _side_by_side(self, parts: Sequence[Columns]) -> tuple[slice | IntArray, FloatArray]:
        """Return the rows that single responses reach together, and their values there."""
        reached = [part.rows for part in parts if isinstance(part.rows, slice)]
        is_open = len(reached) == len(parts)
        first = min(rows.start for rows in reached) if is_open else 0
        last = max(rows.stop for rows in reached) if is_open else len(self._whole)
        values = np.zeros((len(parts), last - first))
        for k, part in enumerate(parts):
            rows = part.rows
            inside = slice(rows.start - first, rows.stop - first) if isinstance(rows, slice) else rows
            values[k, inside] = part.values[:, 0]
        size = np.abs(values).max(axis=0)
        kept = np.flatnonzero(size > CUT * size.max())
        begin, end = int(kept[0]), int(kept[-1]) + 1
        if not is_open:  # all but the widest gap, which is the far side of the ring
            gaps = np.diff(kept, append=kept[0] + last)
            widest = int(gaps.argmax())
            begin = int(kept[(widest + 1) % len(kept)])
            end = begin + last - int(gaps[widest]) + 1
        chosen = self._rows(first + begin, end - begin)
        inside = chosen if not is_open else slice(begin, end)
        return chosen, np.ascontiguousarray(values[:, inside].T)


class DropperColumns(Sequence[Columns]):
    """Response to a unit force in each dropper, solved when first needed: few droppers ever slacken."""

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
