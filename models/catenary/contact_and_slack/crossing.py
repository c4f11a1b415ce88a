"""Where a strip crosses a wire in plan, and how much of the contact acts there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

#: Widths over which a contact sets in and fades [m]: of the strip, from its ends, as its horns bend down there; of the
#: wire, from its ends. They keep the force continuous where a wire slides off a strip or ends under it.
STRIP_EDGE = 0.05
WIRE_EDGE = 1.0

#: A strip: ends A and B; position and velocity of each; x, y, z. Plain numbers are faster than short arrays.
Strip = Sequence[Sequence[Sequence[float]]]


class Crossing(NamedTuple):
    """Where a strip crosses a wire in plan.

    Attributes
    ----------
    element : int
        Of the wire.
    xi : float
        Share of the way along the element.
    share : float
        Share of the way along the strip.
    engagement : float
        How much of the contact acts.
    """

    element: int
    xi: float
    share: float
    engagement: float = 1.0


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


def penetration(share: float, height: float, rate: float, strip: Strip, gap: float) -> tuple[float, float]:
    """Return penetration and its velocity of a strip, where a wire of some height crosses it [m, m/s].

    Parameters
    ----------
    share : float
        Of the way along the strip.
    height, rate : float
        Of the wire's axis, and how fast that rises [m, m/s].
    strip : Strip
    gap : float
        Between the axes of a wire and of a strip that touch [m].
    """
    (a, a_rate), (b, b_rate) = strip
    z_a, v_a, z_b, v_b = a[2], a_rate[2], b[2], b_rate[2]
    return z_a + share * (z_b - z_a) - (height - gap), v_a + share * (v_b - v_a) - rate
