"""The contact wire's nominal height: what is specified at the supports, joined by straight lines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from models.arrays import FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.section_definition import Section
from models.catenary.shape.line_mesh import contact_wire_height
from models.catenary.shape.support_places import SupportPlaces


class _Course(NamedTuple):
    """A section's supports along the track and the wire's height there [m]; the period if it closes on itself."""

    x: FloatArray
    z: FloatArray
    period: float

    def at(self, x: float) -> tuple[float, float, bool]:
        """Return height [m] and slope [1] at x, level beyond the supports, and whether x lies between these."""
        if self.period:
            x = float(self.x[0]) + (x - float(self.x[0])) % self.period
        k = int(self.x.searchsorted(x, side="right"))
        if k == 0 or k == len(self.x):
            return float(self.z[max(k - 1, 0)]), 0.0, False
        slope = float((self.z[k] - self.z[k - 1]) / (self.x[k] - self.x[k - 1]))
        return float(self.z[k - 1]) + slope * (x - float(self.x[k - 1])), slope, True


class NominalHeight:
    """The nominal height of a line, without the sag between its supports.

    Where sections overlap it is that of the lowest wire, which carries the strip.

    Parameters
    ----------
    definition : CatenaryDefinition
    """

    def __init__(self, definition: CatenaryDefinition) -> None:
        self._courses = [_course(definition, section) for section in definition.sections]

    def at(self, x: float) -> tuple[float, float]:
        """Return height above the rails [m] and slope [1] at a place along the track [m]; level beyond the supports."""
        found = [course.at(x) for course in self._courses]
        z, slope, _ = min(found, key=lambda each: (not each[2], each[0]))
        return z, slope

    def under(self, strips: FloatArray) -> FloatArray:
        """Return the heights at the strips' middles [m], then how fast these change for the strips [m/s], shape (2 P,).

        Parameters
        ----------
        strips : ndarray, shape (P, 2, 2, 3)
            Pantograph; end A, B; position, velocity; x, y, z.
        """
        x, vx = strips[:, :, :, 0].mean(axis=1).T
        found = [self.at(place) for place in x.tolist()]
        heights, slopes = np.array(found).T
        return np.concatenate([heights, slopes * vx])


def _course(definition: CatenaryDefinition, section: Section) -> _Course:
    x = [section.spans[0].start, *(span.end for span in section.spans)]
    places = SupportPlaces(definition, section)
    z = [contact_wire_height(places, place) for place in x]
    if section.periodic:
        z[-1] = z[0]
    return _Course(np.array(x), np.array(z), section.period)
