"""What a dropper's length does to the heights of the contact wire: the derivative of all heights by every length.

Lengthening dropper j by e takes k e from its tension and adds its weight, so that heights change by H K^-1 B_j' k e and
a little more: one solution for each dropper, with the stiffness, factorised once, of a line whose wires keep their
tensions. A slack dropper has no influence.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from models.arrays import IntArray
from models.catenary.definition.line_definition import GRAVITY
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.form_finding import StaticState, rest_stiffness

#: Droppers that are solved for at a time.
_AT_A_TIME: Final = 64
#: Influences below this are left out [m/m]; they are far from the dropper.
_LEAST: Final = 1e-7


def dropper_influence(
    static: StaticState, chosen: IntArray, tell: Callable[[int], None] = lambda done: None
) -> sp.csc_matrix:
    """Return dh/dL, shape (k, k): how much unit lengthening of a dropper (column) raises the wire at others (row).

    Parameters
    ----------
    static : StaticState
        About which it holds.
    chosen : ndarray, shape (k,)
        Droppers, by their places in the mesh.
    tell : callable, optional
        Is told how many columns are done.
    """
    mesh = static.shape.mesh
    free = np.flatnonzero(~mesh.fixed.ravel())
    factor = splu(rest_stiffness(static)[free][:, free])
    loads = _loads(static, chosen)[free]
    rows = np.searchsorted(free, mesh.droppers[chosen, 0] * NODE_DOFS + 2)
    columns = []
    for start in range(0, len(chosen), _AT_A_TIME):
        heights = factor.solve(loads[:, start : start + _AT_A_TIME].toarray())[rows]
        heights[np.abs(heights) < _LEAST] = 0.0
        columns.append(sp.csc_matrix(heights))
        tell(min(start + _AT_A_TIME, len(chosen)))
    return sp.csc_matrix(sp.hstack(columns)) if columns else sp.csc_matrix((0, 0))


def _loads(static: StaticState, chosen: IntArray) -> sp.csc_matrix:
    """Return the forces on the nodes by unit lengths, shape (6 n, k): k e, and the weight of what is added."""
    droppers, mesh = static.droppers, static.shape.mesh
    stiffness = np.where(static.is_slack, droppers.compression_ratio, 1.0) * droppers.stiffness
    pull = (sp.diags(stiffness) @ droppers.rows).tocsr()[chosen].T
    half = -0.5 * GRAVITY * np.where(static.is_slack, 0.0, droppers.mass / droppers.length)[chosen]
    ends = mesh.droppers[chosen] * NODE_DOFS + 2
    columns = np.repeat(np.arange(len(chosen)), 2)
    weight = sp.csc_matrix((np.repeat(half, 2), (ends.ravel(), columns)), shape=pull.shape)
    return sp.csc_matrix(pull + weight)
