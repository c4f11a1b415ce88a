"""The attachments of a line in eight segments, for the lanes of vectors: products and solutions side by side.

The segments follow one another along the line; the last rows of each are its separator. Without the separators they
do not know each other, so all are factorised for themselves,

    L L' = A_inner,    F = L^-1 C,    S = A_separators - what the inner rows take of it,

with C the coupling of a segment with the separator before it. A line that closes on itself is no other case: before
its first segment is its last one. F does not die out along a segment, so it is kept whole; the inverse of S is dense in
its blocks, and those that are nothing beside the largest are left out.
"""

from __future__ import annotations

from types import ModuleType

import numpy as np
import scipy.sparse as sp
from scipy.linalg.lapack import dpbtrf, dtbtrs

from models.arrays import FloatArray, IntArray
from models.catenary.linear_motion.attachment_solver import CUT

#: Rows to either side of an even share, within which a segment may end where its separator is narrow.
_PLAY = 16
#: Blocks of the separators' inverse below this share of the largest value are left out.
_NOTHING = 1e-18


def aligned(values: FloatArray) -> FloatArray:
    """Return a flat copy that begins on a cache line: a vector that lies across two takes twice as long to read."""
    raw = np.zeros(values.size + 8)
    begin = -(raw.ctypes.data // 8) % 8
    result = raw[begin : begin + values.size]
    result[:] = values.ravel()
    return result


class AttachmentLanes:
    """Matrices of the attachments in lanes, and a `Factor` that solves by them.

    Parameters
    ----------
    matrix : sparse, shape (n, n)
        What is solved with; a band, or a cyclic band.
    width : int
        Its half-bandwidth, counted round the end.
    products : (sparse, sparse), each of shape (n, n)
        What displacements and velocities are multiplied by: symmetric, and coupled no wider than ``matrix``.
    kernels : module

    Attributes
    ----------
    slots : ndarray of int, shape (n,)
        Where the displacements are in an array in lanes.
    size : int
        Of such an array.
    arrays, work : Lanes, LanesWork
        See `models.catenary.step.attachment_kernels`.
    """

    def __init__(
        self, matrix: sp.csr_matrix, width: int, products: tuple[sp.spmatrix, sp.spmatrix], kernels: ModuleType
    ) -> None:
        self._lanes: int = kernels.LANES
        entries = matrix.tocoo()
        n = matrix.shape[0]
        self._kernels, self._is_ring = kernels, bool((np.abs(entries.row - entries.col) > width).any())
        self._count = int(np.clip(n // (2 * (width + 1)), 3 if self._is_ring else 1, self._lanes))
        ends, self._border = _ends(entries, self._count, width, self._is_ring)
        begin = np.concatenate([[0], ends[:-1]])
        length = ends - begin
        self._length = int(length.max())
        self._inner, self._width = self._length - self._border, width
        self._lane = np.repeat(np.arange(self._count), length)
        # Shorter segments begin later: their ends are at the separators.
        self._row = np.arange(n) - begin[self._lane] + (self._length - length)[self._lane]
        self._before = (np.arange(self._lanes) - 1) % self._lanes
        self._before[: self._count] = (np.arange(self._count) - 1) % self._count
        widths, factor, middle, shifts = self._factorised(entries)
        rows, targets, values, beyond = self._products(*products)
        self.slots = self._row * self._lanes + self._lane
        size = [self._inner, self._border, width, beyond]
        neighbours = self._before, np.argsort(self._before)
        self.arrays = kernels.Lanes(
            *(part.astype(np.uint32) for part in (self.slots, rows, targets)),
            aligned(values),
            widths.astype(np.uint64),
            aligned(factor),
            aligned(middle),
            *(np.asarray(part, dtype=np.uint64) for part in (shifts, *neighbours, size)),
        )
        self.size = (self._length + max(beyond, width)) * self._lanes
        self.work = kernels.LanesWork(*(aligned(np.zeros(k * self._border * self._lanes)) for k in (2, 1)))

    def laid_out(self, values: FloatArray) -> FloatArray:
        """Return values for the displacements, shape (n,), as an array in lanes."""
        result = np.zeros(self.size)
        result[self.slots] = values
        return aligned(result)

    def solve(self, load: FloatArray) -> FloatArray:
        """Return the solution for a load of shape (n,)."""
        solution = self.laid_out(load)
        self._kernels.solve(self.arrays, self.work, solution)
        return solution[self.slots]

    def near(self, first: int, load: FloatArray) -> tuple[int, FloatArray]:
        """Return solutions for loads of shape (k, m) on the rows from ``first``, where they are not zero: see `Factor`.

        A whole solution takes less time here than one about the load.
        """
        n = self._row.size
        turned = (first - n // 2) % n if self._is_ring else 0  # the far side comes first and last
        whole = np.zeros((load.shape[1], n))
        whole[:, (first + np.arange(len(load))) % n] = load.T
        values = np.array([self.solve(each) for each in whole])
        if turned:
            values = np.roll(values, -turned, axis=1)
        size = np.abs(values).max(axis=0)
        kept = np.flatnonzero(size > CUT * size.max())
        return int(kept[0] + turned) % n, np.ascontiguousarray(values[:, kept[0] : kept[-1] + 1].T)

    def _apart(self, entries: sp.coo_matrix) -> tuple[IntArray, IntArray]:
        """Return which entries are within a segment, and which lead from a separator to the next segment."""
        lane, one, other = self._lane, entries.row, entries.col
        within = lane[one] == lane[other]
        to_next = ~within & (self._before[lane[other]] == lane[one])
        if self._count == 2:  # each comes before the other, but a ring has three
            to_next &= lane[one] < lane[other]
        return np.flatnonzero(within), np.flatnonzero(to_next)

    def _factorised(self, entries: sp.coo_matrix) -> tuple[IntArray, FloatArray, FloatArray, IntArray]:
        """Return ``widths``, ``factor``, ``middle`` and ``shifts`` of `Lanes`."""
        lanes, inner, border, width = self._lanes, self._inner, self._border, self._width
        lane, row = self._lane, self._row
        within, to_next = self._apart(entries)
        one, other, value = entries.row[within], entries.col[within], entries.data[within]
        band = np.zeros((lanes, width + 1, self._length))
        band[:, 0] = 1.0  # rows of no displacement
        lower = row[one] >= row[other]
        one, other = one[lower], other[lower]
        band[lane[one], row[one] - row[other], row[other]] = value[lower]
        coupling = np.zeros((lanes, self._length, border))
        one, other = entries.row[to_next], entries.col[to_next]
        coupling[lane[other], row[other], row[one] - inner] = entries.data[to_next]
        factor = np.zeros((inner, 1 + width + border, lanes))
        rest = np.zeros((lanes, border, lanes, border))
        for k in range(lanes):
            whole, failed = dpbtrf(band[k], lower=1)
            if failed:
                raise np.linalg.LinAlgError(f"the effective stiffness is not positive definite (segment {k})")
            before = self._before[k]
            follow = dtbtrs(whole[:, :inner], coupling[k, :inner], uplo="L")[0] if inner else coupling[k, :0]
            factor[:, 0, k] = 1.0 / whole[0, :inner]
            factor[:, 1 : width + 1, k], factor[:, width + 1 :, k] = whole[1:, :inner].T, follow
            own = sp.dia_matrix((whole, -np.arange(width + 1)), shape=2 * (self._length,)).tocsr()[inner:].toarray()
            rest[k, :, k] += own[:, inner - self._length :] @ own[:, inner - self._length :].T
            rest[before, :, before] -= follow.T @ follow
            across = coupling[k, inner:] - own[:, :inner] @ follow
            rest[k, :, before] += across
            rest[before, :, k] += across.T
        inverse = np.linalg.inv(rest.reshape(lanes * border, -1)).reshape(rest.shape)
        here = np.arange(lanes)
        blocks = [inverse[here, :, (here + shift) % lanes].transpose(2, 1, 0) for shift in range(lanes)]
        large = [k for k, block in enumerate(blocks) if np.abs(block).max() > _NOTHING * np.abs(inverse).max()]
        is_used = np.abs(factor).max(axis=2) > 0.0
        widths = width - is_used[:, width:0:-1].argmax(axis=1)
        widths[~is_used[:, 1 : width + 1].any(axis=1)] = 0
        is_used[:] = np.arange(1 + width + border) <= widths[:, None]
        is_used[:, 1 + width :] = True
        return widths, factor[is_used], np.stack([blocks[k] for k in large]), np.array(large)

    def _products(self, *matrices: sp.spmatrix) -> tuple[IntArray, IntArray, FloatArray, int]:
        """Return ``rows``, ``targets`` and ``values`` of `Lanes`, and how many rows of the next segments are read."""
        lanes, length = self._lanes, self._length
        matrix = (matrices[0] + 1j * matrices[1]).tocoo()  # both on one pattern
        within, to_next = self._apart(matrix)
        upper = within[self._row[matrix.col[within]] >= self._row[matrix.row[within]]]
        chosen = np.concatenate([upper, to_next])
        one, target = matrix.row[chosen], self._row[matrix.col[chosen]].copy()
        target[len(upper) :] += length
        widest = 2 * length
        own = np.arange(length) * (widest + 1)  # every row has its diagonal
        pairs, place = np.unique(np.concatenate([own, self._row[one] * widest + target]), return_inverse=True)
        values = np.zeros((len(pairs), 2, lanes))
        place = place.ravel()[length:]
        values[place, 0, self._lane[one]] = matrix.data[chosen].real
        values[place, 1, self._lane[one]] = matrix.data[chosen].imag
        row, target = np.divmod(pairs, widest)
        rows = np.searchsorted(row, np.arange(length + 1))
        return rows, target * lanes, values, int(max(target.max() + 1 - length, 0))


def _ends(entries: sp.coo_matrix, count: int, width: int, is_ring: bool) -> tuple[IntArray, int]:
    """Return where segments end, and how many rows before that lead beyond it."""
    n = entries.shape[0]
    near = np.abs(entries.row - entries.col) <= width
    reach = np.arange(n)
    np.maximum.at(reach, entries.row[near], entries.col[near])
    needed = np.arange(n + 1) - np.searchsorted(np.maximum.accumulate(reach), np.arange(n + 1))
    ends, play = [], min(_PLAY, (n // count - width - 1) // 2)
    for k in range(1, count):
        share = k * n // count
        near_share = np.arange(share - play, share + play + 1)
        ends.append(int(near_share[np.lexsort((np.abs(near_share - share), needed[near_share]))[0]]))
    return np.array([*ends, n]), max([1, *needed[ends].tolist(), *([width] if is_ring else [])])
