"""How long spans may be in the wind: the contact wire as a string between its supports [1]_.

Staggers count positive to the outside of the curve, q is the wind's force and T the wire's tension; with wind to the
outside w = q - T / R, to the inside w = q + T / R, and the wire is blown by w x (L - x) / (2 T) from the line between
its supports.

References
----------
.. [1] ADIF, NAE 300 (2024); Bane NOR, Teknisk regelverk, for the largest span.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import FloatArray

#: Grid of radii, and the largest one that is tried [m].
RADIUS_STEP: Final = 5.0
_LARGEST_RADIUS: Final = 50_000.0
#: Span lengths of the table [m].
LENGTHS: Final = tuple(float(L) for L in range(25, 66))
#: Curvature of the track [1/m] -> how far the wire may be from its middle [m]; it never rises with the curvature.
Limit = Callable[[float], float]


@dataclass(frozen=True)
class String:
    """A contact wire in the wind.

    Attributes
    ----------
    tension : float
        T [N].
    wind : float
        q, force per length [N/m].
    """

    tension: float
    wind: float

    def offset(self, length: float, curvature: float, start: float, end: float) -> float:
        """Return the largest offset from the middle of the track in a span, of both winds, to either side [m].

        Parameters
        ----------
        length : float
            L [m].
        curvature : float
            1 / R of the curve, 0 on straight track [1/m].
        start, end : float
            Staggers b1, b2, positive to the outside [m].
        """
        outside, inside = self._offsets(length, curvature, start, end)
        return max(outside, inside)

    def _offsets(self, length: float, curvature: float, start: float, end: float) -> tuple[float, float]:
        """Return the largest offsets to the outside and to the inside [m]."""
        blown = self.wind / self.tension
        return _largest(blown - curvature, length, start, end), _largest(blown + curvature, length, -start, -end)

    def largest_span(self, limit: float, curvature: float, start: float, end: float) -> float:
        """Return the largest span that keeps within a limit [m]; infinite if no wind moves the wire that way.

        Returns
        -------
        float
            NaN if the staggers alone are beyond the limit.
        """
        if max(abs(start), abs(end)) > limit:
            return math.nan
        found = math.inf
        for w, both in (
            (self.wind - self.tension * curvature, 2.0 * limit - (start + end)),
            (self.wind + self.tension * curvature, 2.0 * limit + (start + end)),
        ):
            if w > 0.0:
                root = math.sqrt(max(0.0, both**2 - (start - end) ** 2))
                found = min(found, math.sqrt(2.0 * self.tension / w * (both + root)))
        return found

    def smallest_radius(self, limit: Limit, length: float, start: float, end: float) -> float:
        """Return the smallest radius, on a grid of 5 m, in which a span keeps within the limit there [m].

        A span that is staggered to the outside may keep within it in a curve and not on straight track.

        Returns
        -------
        float
            NaN if there is none.
        """
        low, high = 0, round(_LARGEST_RADIUS / RADIUS_STEP)

        def is_kept_inside(steps: int) -> bool:
            curvature = 1.0 / (steps * RADIUS_STEP)
            return self._offsets(length, curvature, start, end)[1] <= limit(curvature)

        if not is_kept_inside(high):
            return math.nan
        while high - low > 1:  # to the inside the offset falls with the radius, and the limit does not
            middle = (low + high) // 2
            low, high = (low, middle) if is_kept_inside(middle) else (middle, high)
        radius = high * RADIUS_STEP
        return radius if self.offset(length, 1.0 / radius, start, end) <= limit(1.0 / radius) else math.nan


def _largest(bend: float, length: float, start: float, end: float) -> float:
    """Return the maximum over x = 0 ... L of bend x (L - x) / 2 + start + (end - start) x / L."""
    found = max(start, end)
    if bend > 0.0:
        x = 0.5 * length + (end - start) / (bend * length)
        if 0.0 < x < length:
            found = max(found, 0.5 * bend * x * (length - x) + start + (end - start) * x / length)
    return found


def radii(string: String, limit: Limit, start: float, end: float) -> FloatArray:
    """Return the smallest radius for every span length of the table [m], shape (41,)."""
    return np.array([string.smallest_radius(limit, L, start, end) for L in LENGTHS])
