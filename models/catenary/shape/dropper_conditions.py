"""What form finding wants of every dropper: its lower end at a height, or its given length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from models.arrays import BoolArray, FloatArray
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.line_shape import LineShape


@dataclass(frozen=True)
class DropperConditions:
    """The equation of every dropper: rows @ d - flexibility * N = right.

    Attributes
    ----------
    rows : sparse, shape (n_droppers, 6 n)
    flexibility, right : ndarray, shape (n_droppers,)
    """

    rows: sp.csr_matrix
    flexibility: FloatArray
    right: FloatArray


def dropper_conditions(shape: LineShape, slack: BoolArray) -> DropperConditions:
    """Return the droppers' conditions: height of the lower end, or elongation of a given length by the force.

    Parameters
    ----------
    slack : ndarray, shape (n_droppers,)
        Which droppers of given length hang slack.
    """
    mesh, droppers = shape.mesh, shape.droppers
    lower = mesh.droppers[:, 0]
    n = len(lower)
    heights = sp.csr_matrix((np.ones(n), (np.arange(n), lower * NODE_DOFS + 2)), shape=(n, mesh.fixed.size))
    given = ~np.isnan(mesh.given_length)
    stiffness = np.where(slack, droppers.compression_ratio, 1.0) * droppers.stiffness
    limp = given & (stiffness == 0.0)
    stiffness[limp] = 1.0  # N / 1 = 0
    rows = sp.diags(np.where(given, 0.0, 1.0)) @ heights
    rows = rows + sp.diags(np.where(given & ~limp, 1.0, 0.0)) @ droppers.rows
    too_short = np.where(limp, 0.0, np.nan_to_num(mesh.given_length) - droppers.length)
    return DropperConditions(
        rows.tocsr(),
        np.where(given, 1.0 / stiffness, 0.0),
        np.where(given, too_short, mesh.target - shape.points[lower, 2]),
    )
