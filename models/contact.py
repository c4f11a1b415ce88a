"""Contact of a collector strip with a contact wire: where they cross in plan, and the normal force [1]_.

References
----------
.. [1] P. Antunes, Co-simulation methods for multidisciplinary problems in railway dynamics (2012), section 4.1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from models.part import FloatArray

#: Below this penetration velocity an impact has no velocity to refer to [m/s].
_SLOWEST_IMPACT = 1e-6
#: Widths over which a contact sets in and fades [m]: of the strip, from its ends, as its horns bend down there; of the
#: wire, from its ends. They keep the force continuous where a wire slides off a strip or ends under it.
STRIP_EDGE = 0.05
WIRE_EDGE = 1.0


class ContactParameters(Protocol):
    """What a contact law needs."""

    @property
    def stiffness(self) -> float:
        """Return the stiffness [N/m^n]."""

    @property
    def exponent(self) -> float:
        """Return the exponent n."""

    @property
    def restitution(self) -> float:
        """Return the coefficient of restitution."""


class NormalForce(NamedTuple):
    """Normal force and its derivatives by penetration [N/m] and penetration velocity [N s/m]."""

    force: float
    by_penetration: float
    by_velocity: float

    def scaled(self, share: float) -> NormalForce:
        """Return a share of the force."""
        if share == 1.0:
            return self
        return NormalForce(share * self.force, share * self.by_penetration, share * self.by_velocity)


def continuous_contact(
    penetration: float, velocity: float, impact_velocity: float, parameters: ContactParameters
) -> NormalForce:
    """Return K delta^n (1 + 3/4 (1 - e^2) delta'/delta'(-)), never negative [2.47].

    Parameters
    ----------
    penetration, velocity : float
        delta [m] and delta' [m/s].
    impact_velocity : float
        delta'(-), the velocity at impact [m/s].

    Examples
    --------
    >>> from models.catenary.parameters import Contact
    >>> continuous_contact(0.005, 0.1, 0.1, Contact()).force
    100.0
    """
    if penetration <= 0.0:
        return NormalForce(0.0, 0.0, 0.0)
    n = parameters.exponent
    elastic = parameters.stiffness * penetration**n
    hysteresis = 0.75 * (1.0 - parameters.restitution**2) / max(impact_velocity, _SLOWEST_IMPACT)
    factor = 1.0 + hysteresis * velocity
    if factor <= 0.0:
        return NormalForce(0.0, 0.0, 0.0)
    return NormalForce(elastic * factor, n * elastic / penetration * factor, elastic * hysteresis)


ContactLaw = Callable[[float, float, float, ContactParameters], NormalForce]
#: Contact laws by name.
CONTACT_LAWS: dict[str, ContactLaw] = {"continuous": continuous_contact}


def crossing(
    a: Sequence[float], b: Sequence[float], i: Sequence[float], j: Sequence[float]
) -> tuple[float, float] | None:
    """Intersect strip and wire element in plan [2.36-2.42].

    Parameters
    ----------
    a, b : sequence of at least two numbers
        Ends of the strip, x and y first [m].
    i, j : (float, float)
        Ends of the element in plan [m].

    Returns
    -------
    (float, float) or None
        Shares of the way from A to B and from I to J; None if the two are parallel.

    Examples
    --------
    >>> crossing((1.0, 1.0, 0.0), (1.0, -1.0, 0.0), (0.0, 0.5), (4.0, 0.5))
    (0.25, 0.25)
    """
    strip_x, strip_y = b[0] - a[0], b[1] - a[1]
    wire_x, wire_y = j[0] - i[0], j[1] - i[1]
    determinant = strip_y * wire_x - strip_x * wire_y
    if determinant == 0.0:
        return None
    dx, dy = i[0] - a[0], i[1] - a[1]
    return (dy * wire_x - dx * wire_y) / determinant, (strip_x * dy - strip_y * dx) / determinant


def engagement(from_strip_end: float, from_wire_end: float) -> float:
    """Return the share of the contact law that acts so near to the ends of strip and wire [m].

    Examples
    --------
    >>> engagement(0.4, 200.0), engagement(0.4, 0.25), engagement(0.0, 200.0)
    (1.0, 0.25, 0.0)
    """
    return min(1.0, from_strip_end / STRIP_EDGE) * min(1.0, from_wire_end / WIRE_EDGE)


def application_point(force: FloatArray, point: FloatArray, strip: FloatArray) -> FloatArray:
    """Return where the resultant of the vertical forces on one strip acts, shape (3,) [m].

    Without force it is the place where the strip crosses a wire, or else the strip's middle.

    Parameters
    ----------
    force : ndarray, shape (n_sections,)
        Per wire, none negative [N].
    point : ndarray, shape (n_sections, 3)
        Points of contact [m]; NaN where strip and wire do not cross.
    strip : ndarray, shape (2, 2, 3)
        Ends A and B; position and velocity.

    Examples
    --------
    >>> point = np.array([[10.0, 0.2, 5.1], [10.0, -0.1, 5.1]])
    >>> application_point(np.array([100.0, 50.0]), point, np.zeros((2, 2, 3))).round(6).tolist()
    [10.0, 0.1, 5.1]
    """
    forces, points = force.tolist(), point.tolist()  # plain floats: for so few wires faster than arrays
    total = sum(forces)
    if total > 0.0:
        moment_x = moment_y = moment_z = 0.0
        for f, (x, y, z) in zip(forces, points, strict=True):
            if f > 0.0:
                moment_x, moment_y, moment_z = moment_x + f * x, moment_y + f * y, moment_z + f * z
        return np.array((moment_x / total, moment_y / total, moment_z / total))
    for crossed in points:
        if not math.isnan(crossed[0]):
            return np.array(crossed)
    middle: FloatArray = strip[:, 0].mean(axis=0)
    return middle
