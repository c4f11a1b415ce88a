"""The tension of wires in a line as it is found: that of the design, or what temperature has made of it."""

from __future__ import annotations

import numpy as np

from models.arrays import FloatArray
from models.catenary.definition.line_definition import COMPONENTS
from models.catenary.shape.form_finding import StaticState


def found_tension(static: StaticState, component: str, section: int, x: FloatArray) -> FloatArray:
    """Return the tension of a wire at places along a section [N], shape (n,).

    Parameters
    ----------
    static : StaticState
    component : str
        Kind of wire, one of ``COMPONENTS``.
    section : int
    x : ndarray, shape (n,)
        [m].
    """
    mesh = static.shape.mesh
    chosen = (mesh.component == COMPONENTS.index(component)) & (mesh.section[mesh.beams[:, 0]] == section)
    along = mesh.points[mesh.beams[chosen], 0].mean(axis=1)
    order = along.argsort()
    nominal: float = getattr(static.shape.definition, component).tension
    return nominal * np.interp(x, along[order], mesh.tension_factor[chosen][order])
