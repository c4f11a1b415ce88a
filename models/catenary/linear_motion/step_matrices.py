"""What a line's matrices become for one step size, whichever engine makes the step."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from models.arrays import FloatArray, IntArray
from models.catenary.linear_motion.attachment_solver import Banded, Cyclic, Sparse, factorised
from models.catenary.linear_motion.interval_modes import IntervalModes
from models.numerics.newmark import Newmark


class StepMatrices:
    """K_hat of a line: diagonal for the modes, a factor for the attachments, and mu G between them.

    Parameters
    ----------
    modes : IntervalModes
    newmark : Newmark

    Attributes
    ----------
    modes, newmark
        The parameters.
    mu : ndarray, shape (n_modes,)
        a0 + a1 beta.
    inverse : ndarray, shape (n_modes,)
        1 / K_hat of the modes.
    coupling : sparse, shape (n_modes, n_ends)
        mu G over the intervals' ends.
    factor : Factor
        Of what the attachments feel, intervals eliminated.

    Raises
    ------
    numpy.linalg.LinAlgError
        If K_hat is not positive definite.
    """

    def __init__(self, modes: IntervalModes, newmark: Newmark) -> None:
        a0, a1 = newmark.a0, newmark.a1
        self.modes, self.newmark = modes, newmark
        self.mu = a0 + a1 * modes.beta
        self.inverse = 1.0 / (modes.eigenvalue * (1.0 + a1 * modes.alpha) + self.mu)
        self.coupling = (sp.diags(self.mu) @ modes.coupling).tocsr()
        G = self.coupling @ modes.turn
        self.factor: Banded | Cyclic | Sparse = factorised(
            modes.K + a0 * modes.M + a1 * modes.C - G.T @ sp.diags(self.inverse) @ G
        )

    def coupling_of(self, span: slice, places: IntArray) -> FloatArray:
        """Return mu G of one interval, a column for each displacement of its attachments, shape (n_span, n_places)."""
        modes = self.modes
        moved, low = _dense_rows(modes.coupling, span.start, span.stop)
        turned, first = _dense_rows(modes.turn, low, low + moved.shape[1])
        inside = (places >= first) & (places < first + turned.shape[1])
        result = np.zeros((moved.shape[0], len(places)))
        result[:, inside] = moved @ turned[:, places[inside] - first]
        return self.mu[span, None] * result


def _dense_rows(matrix: sp.csr_matrix, start: int, stop: int) -> tuple[FloatArray, int]:
    """Return some rows of a matrix from their first column that is not empty, and that column."""
    bounds = matrix.indptr[start : stop + 1]
    columns = matrix.indices[bounds[0] : bounds[-1]]
    if not columns.size:
        return np.zeros((stop - start, 0)), 0
    low = int(columns.min())
    result = np.zeros((stop - start, int(columns.max()) - low + 1))
    result[np.repeat(np.arange(stop - start), np.diff(bounds)), columns - low] = matrix.data[bounds[0] : bounds[-1]]
    return result, low
