"""The contact wires at rest as one runs along the track: heights and places in plan anywhere between the anchors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from models.arrays import FloatArray, IntArray
from models.catenary.contact_and_slack.contact_wire import height_polynomials
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.form_finding import StaticState

#: Nodes solved for at a time, and the least that is kept of a shape, which soon dies out beyond its neighbours.
_AT_A_TIME: Final = 64
_LEAST: Final = 1e-9


@dataclass(frozen=True)
class WireCourse:
    """The contact wire of one section in its static shape.

    Attributes
    ----------
    x, y : ndarray, shape (k + 1,)
        Of its nodes [m].
    polynomials : ndarray, shape (k, 4)
        Height of element i = [1, xi, xi^2, xi^3] @ polynomials[i] [m].
    """

    x: FloatArray
    y: FloatArray
    polynomials: FloatArray

    def height(self, x: FloatArray) -> FloatArray:
        """Return heights at places along the track, shape (n,) [m]; NaN beyond the anchors."""
        element = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2)
        xi = (x - self.x[element]) / np.diff(self.x)[element]
        powers = xi[:, None] ** np.arange(4)
        return self._inside(x, np.einsum("ni,ni->n", powers, self.polynomials[element]))

    def slope(self, x: FloatArray) -> FloatArray:
        """Return dz/dx at places along the track, shape (n,) [1]; NaN beyond the anchors."""
        element = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2)
        length = np.diff(self.x)[element]
        xi = (x - self.x[element]) / length
        powers = np.arange(1, 4) * xi[:, None] ** np.arange(3)
        return self._inside(x, np.einsum("ni,ni->n", powers, self.polynomials[element, 1:]) / length)

    def lateral(self, x: FloatArray) -> FloatArray:
        """Return places in plan, shape (n,) [m]; NaN beyond the anchors."""
        return self._inside(x, np.interp(x, self.x, self.y))

    def _inside(self, x: FloatArray, values: FloatArray) -> FloatArray:
        return np.where((x >= self.x[0]) & (x <= self.x[-1]), values, np.nan)


def wire_courses(static: StaticState) -> tuple[WireCourse, ...]:
    """Return the contact wire of every section."""
    angles = np.zeros(len(static.shape.points))
    courses = []
    for chain in static.shape.mesh.contact_chains():
        x, y = static.positions[chain.nodes, :2].T
        courses.append(WireCourse(x.copy(), y.copy(), height_polynomials(chain.nodes, static, angles)[1]))
    return tuple(courses)


def section_alone(courses: tuple[WireCourse, ...], x: FloatArray) -> IntArray:
    """Return the section whose wire alone is at each place, from 0, shape (n,); -1 where there is none or several."""
    within = np.array([(x >= course.x[0]) & (x <= course.x[-1]) for course in courses])
    return np.where(within.sum(axis=0) == 1, within.argmax(axis=0), -1)


@dataclass(frozen=True)
class HeldShapes:
    """Shapes that a contact wire takes when one of the nodes that hold it is raised, the others staying.

    Straight but for the wire's bending at the nodes, whatever it carries.

    Attributes
    ----------
    x : ndarray, shape (n,)
        Of the wire's nodes [m].
    knots : ndarray, shape (k,)
        Of those that are held [m].
    basis : sparse, shape (2 n, k)
        Height and rotation about y of all nodes, by unit rises of those that are held.
    """

    x: FloatArray
    knots: FloatArray
    basis: sp.csr_matrix

    def at(self, x: FloatArray) -> sp.csr_matrix:
        """Return the rise at each of some places between the wire's ends by unit rises of the nodes, shape (m, k)."""
        return sp.csr_matrix(_hermite(self.x, x) @ self.basis)


def held_shapes(static: StaticState, section: int, nodes: IntArray) -> HeldShapes:
    """Return the shapes of the contact wire of a section that is held at some nodes of the mesh, its ends among them.

    Parameters
    ----------
    nodes : ndarray, shape (k,)
        Along the track.
    """
    chain = static.shape.mesh.contact_chains()[section].nodes
    x, knots = static.positions[chain, 0], static.positions[nodes, 0]
    place = np.searchsorted(x, knots - 1e-9)
    dofs = np.concatenate([chain * NODE_DOFS + 2, chain * NODE_DOFS + 4])
    K = static.shape.matrices.K[dofs][:, dofs].tocsc()
    free = np.setdiff1d(np.arange(len(dofs)), place)
    factor, columns = splu(K[free][:, free]), []
    for start in range(0, len(place), _AT_A_TIME):
        some = place[start : start + _AT_A_TIME]
        shape = np.zeros((len(dofs), len(some)))
        shape[free] = -factor.solve(K[free][:, some].toarray())
        shape[some, np.arange(len(some))] = 1.0
        shape[np.abs(shape) < _LEAST] = 0.0
        columns.append(sp.csc_matrix(shape))
    return HeldShapes(x, knots, sp.csr_matrix(sp.hstack(columns)))


def _hermite(nodes: FloatArray, x: FloatArray) -> sp.csr_matrix:
    """Return heights at places from heights and rotations (about y, negative slopes) of nodes, shape (n, 2 k)."""
    element = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, len(nodes) - 2)
    length = np.diff(nodes)[element]
    s = (x - nodes[element]) / length
    values = [
        1.0 - 3.0 * s**2 + 2.0 * s**3,
        3.0 * s**2 - 2.0 * s**3,
        -length * (s - 2.0 * s**2 + s**3),
        -length * (s**3 - s**2),
    ]
    columns = [element, element + 1, element + len(nodes), element + len(nodes) + 1]
    rows = np.tile(np.arange(len(x)), 4)
    shape = len(x), 2 * len(nodes)
    return sp.csr_matrix((np.concatenate(values), (rows, np.concatenate(columns))), shape=shape)
