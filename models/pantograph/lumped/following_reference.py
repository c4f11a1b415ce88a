"""The lowest spring of a lumped pantograph on a reference that follows the working height.

Real pantographs hold their static force over the working height; a spring on the roof does not. The spring then pulls
the lowest mass towards a reference r instead,

    f = -k (w - r),   T (r' - u) = w - r,   w: height of the lowest mass above the roof, u: a rate given from outside,

which without u is the spring in series with a damper k T: a bellows whose regulator has the time constant T.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from models.arrays import ComplexArray, FloatArray

#: Below this step per time constant the series is the better formula.
_SHORT: Final = 1e-3


class FollowingReference(NamedTuple):
    """How the reference moves in a step in which w changes linearly: exact.

    r_new = keep r + before w + after w_new + lead u

    Attributes
    ----------
    time : float
        Time constant T [s].
    keep, before, after : float
        [1]
    lead : float
        [s]
    """

    time: float
    keep: float
    before: float
    after: float
    lead: float

    @classmethod
    def within(cls, step: float, time: float) -> FollowingReference:
        """Return the coefficients for a step [s] and a time constant [s].

        Examples
        --------
        >>> f = FollowingReference.within(1e-3, 0.5)
        >>> round(f.keep + f.before + f.after, 15)  # what is at rest stays at rest
        1.0
        """
        x = step / time
        keep = math.exp(-x)
        gone = -math.expm1(-x)
        after = x / 2.0 - x * x / 6.0 if x < _SHORT else 1.0 - gone / x
        return cls(time, keep, gone - after, after, time * gone)

    def moved(self, reference: float, before: float, after: float, rate: float) -> float:
        """Return the reference after a step from where it and w were, where w is now, and the rate given."""
        return self.known(reference, before, rate) + self.after * after

    def known(self, reference: float, before: float, rate: float) -> float:
        """Return the part of it that does not depend on where w goes."""
        return self.keep * reference + self.before * before + self.lead * rate

    def integrals(self, stretch: float, slope: float, rate: float, step: float) -> tuple[float, float]:
        """Return the integrals over a step of w - r and of its square [m.s, m2.s].

        Parameters
        ----------
        stretch : float
            w - r at its beginning [m].
        slope : float
            Rate of w within it [m/s].
        rate : float
            Rate given from outside [m/s].
        step : float
            [s]
        """
        settled = self.time * (slope - rate)
        rest = stretch - settled
        first = settled * step + rest * self.lead
        second = settled**2 * step + 2.0 * settled * rest * self.lead
        second += rest**2 * 0.5 * self.time * (1.0 - self.keep**2)
        return first, second


def link_stiffness(
    frequency: FloatArray, stiffness: float | FloatArray, damping: float | FloatArray, time: float | FloatArray
) -> ComplexArray:
    """Return the dynamic stiffness between the roof and the lowest mass, shape (f,) [N/m].

    Parameters
    ----------
    frequency : ndarray, shape (f,)
        [Hz]
    stiffness, damping : float or ndarray, shape (p, 1)
        Of the lowest stage [N/m, N.s/m]; of several stages.
    time : float or ndarray, shape (p, 1)
        Time constant [s].
    """
    s: Any = 2j * np.pi * np.asarray(frequency)
    link: ComplexArray = stiffness * s * time / (1.0 + s * time) + damping * s
    return link
