"""What a measured wire has beyond the static shape of its line: the running surface r(x) that a run then has.

Between droppers that is wear, kinks and splices, and the noise of the measurement; at arms it is what no dropper
explains. Noise is left out where it shows as such: neighbouring heights then have nothing in common.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.catenary.statics.wire_course import WireCourse, wire_courses
from models.layout.as_built.as_built_line import AsBuilt
from models.layout.as_built.measured_run import AsBuiltError, worn_depth
from models.layout.as_built.wire_deviation import WireDeviation

#: Standard errors from which on the course at an arm is more than noise.
_SURE: Final = 4.0
#: Farther from a measured height than this nothing is known [m].
_GAP: Final = 5.0
#: The largest height that a running surface has [m]; beyond it something else has moved.
_LARGEST: Final = 0.05


@dataclass(frozen=True)
class LeftoverSurface:
    """Height of the wire's underside above the static shape of the line as it hangs.

    Attributes
    ----------
    x, r : ndarray, shape (n,)
        In rising order [m].
    is_noise : bool
        Whether what is left between the droppers was taken for noise and left out.
    """

    x: FloatArray
    r: FloatArray
    is_noise: bool

    @property
    def is_even(self) -> bool:
        """Return whether there is no surface to speak of."""
        return not self.r.any()


def leftover_surface(found: AsBuilt) -> LeftoverSurface:
    """Return what the static shape of a line as it hangs leaves of the measured heights.

    Raises
    ------
    AsBuiltError
        If that is more than a running surface can be.
    """
    pieces = []
    designed, built = wire_courses(found.design), wire_courses(found.fitted.state)
    for deviation, before, after in zip(found.deviations, designed, built, strict=True):
        if deviation is not None:
            pieces.append(_of_section(deviation, before, after))
    noise = all(deviation is None or deviation.is_noise for deviation in found.deviations)
    x, r = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    order = np.argsort(x, kind="stable")
    x, r = x[order], r[order]
    worn = worn_depth(found.definition, found.run)
    if worn.any():
        r = r + np.interp(x, found.alignment.position(found.run.position), worn)
    kept = np.append(True, np.diff(x) > 1e-3)
    x, r = x[kept], r[kept]
    r[[0, -1]] = 0.0
    if np.abs(r).max() > _LARGEST:
        worst = int(np.abs(r).argmax())
        raise AsBuiltError(
            f"{found.run.source}: at {x[worst]:.1f} m the wire was measured {1e3 * r[worst]:+.0f} mm from where "
            "droppers and supports put it: a support stands otherwise than designed; give its height in [supports]"
        )
    return LeftoverSurface(x, r, noise)


def _of_section(deviation: WireDeviation, designed: WireCourse, built: WireCourse) -> tuple[FloatArray, FloatArray]:
    """Return places and heights of one section's surface [m], without wear."""
    knots = deviation.knots
    inner = np.clip(knots, designed.x[0], designed.x[-1])
    explained = built.height(np.clip(inner, built.x[0], built.x[-1])) - designed.height(inner)
    unexplained = deviation.value - explained
    sigma = 0.0 if np.isnan(deviation.sigma) else deviation.sigma
    sure = deviation.is_measured & (np.abs(unexplained) > np.maximum(_SURE * deviation.error * sigma, 1e-5))
    course = np.where(sure, unexplained, 0.0)
    good = ~deviation.is_outlier
    places, left = deviation.x[good], deviation.left[good]
    x = np.union1d(places, knots)
    r = np.interp(x, knots, course)
    if not deviation.is_noise:
        known = _distance(x, places) <= _GAP
        r = r + np.where(known, np.interp(x, places, left), 0.0)
    return x, r


def _distance(x: FloatArray, places: FloatArray) -> FloatArray:
    """Return how far the nearest of some places is from each x [m]."""
    after = np.clip(np.searchsorted(places, x), 1, max(len(places) - 1, 1))
    before = after - 1
    return np.minimum(np.abs(x - places[before]), np.abs(x - places[np.minimum(after, len(places) - 1)]))
