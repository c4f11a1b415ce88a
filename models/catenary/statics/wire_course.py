"""The contact wires at rest as one runs along the track: heights and places in plan anywhere between the anchors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arrays import FloatArray, IntArray
from models.catenary.contact_and_slack.contact_wire import height_polynomials
from models.catenary.shape.form_finding import StaticState


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
