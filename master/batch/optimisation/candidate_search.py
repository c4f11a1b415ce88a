"""Which points an optimisation tries: SciPy's differential evolution, then Nelder and Mead from the best of them.

Runs take seconds to minutes, have no derivatives, may fail, and several can be made at a time. Differential evolution
asks for a whole generation at once, which a pool makes in parallel, and needs no more of a point than whether it is
better than another: a failed run is worse than all. The same seed gives the same points however many processes there
are. It comes near the optimum soon and at it slowly, so the simplex of Nelder and Mead ends the search, one run after
the other.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import optimize
from scipy.stats import qmc

from master.arrays import FloatArray

#: Points (n, D) in the unit cube -> their merits (n,), the less the better, infinite if a run failed.
Evaluate = Callable[[FloatArray], FloatArray]
#: Points of a generation for each parameter, and fewest.
_POINTS: Final = 6
_FEWEST: Final = 8
#: Share of all points that evolution may try; the rest are the simplex's.
_EVOLVED: Final = 0.65
#: Spread of merits, relative to their mean, at which evolution ends; sizes of the simplex at its beginning and end.
_SPREAD: Final = 2e-3
_EDGE: Final = 0.08
_SMALL: Final = 1e-3
_FLAT: Final = 1e-5


class SearchEnd(Exception):  # noqa: N818 (no error: the last point was tried)
    """Raised by an `Evaluate` that will try no more points."""


class _HopelessError(Exception):
    """No point of the first generation has a merit, that where the search begins included."""


@dataclass
class _Best:
    """Passes points on, within the bounds, and remembers the best."""

    evaluate: Evaluate
    point: FloatArray
    merit: float = np.inf

    def several(self, points: FloatArray) -> FloatArray:
        """Return the merits of points (D, n), as SciPy gives them."""
        inside = np.clip(points.T, 0.0, 1.0)
        merits = self.evaluate(inside)
        best = int(np.argmin(merits))
        if merits[best] < self.merit:
            self.point, self.merit = inside[best].copy(), float(merits[best])
        if not np.isfinite(self.merit):
            raise _HopelessError
        return merits

    def single(self, point: FloatArray) -> float:
        """Return the merit of one point (D,)."""
        return float(self.several(point[:, None])[0])


def search(evaluate: Evaluate, start: FloatArray, most: int, seed: int) -> str:
    """Try points of the unit cube until the best is found or no more may be tried; return why it ended.

    Parameters
    ----------
    evaluate : callable
        Raises `SearchEnd` when ``most`` points were tried.
    start : ndarray, shape (D,)
        Tried first.
    most : int
        How many points may be tried; it divides them between the two methods.
    seed : int
    """
    best = _Best(evaluate, start)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # infinite merits, in SciPy's measure of their spread
            _evolve(best, start, most, seed)
            done = _refine(best)
    except _HopelessError:
        return "no run of the first generation has the figure"
    except SearchEnd:
        return "as many runs as were allowed"
    return "converged" if done else "as many steps as were allowed"


def _evolve(best: _Best, start: FloatArray, most: int, seed: int) -> None:
    count = max(_FEWEST, _POINTS * len(start))
    first = qmc.LatinHypercube(len(start), seed=np.random.default_rng(seed)).random(count)
    first[0] = start
    generations = int(_EVOLVED * most) // count
    if generations < 1:
        best.several(first.T)
        return
    optimize.differential_evolution(
        best.several,
        [(0.0, 1.0)] * len(start),
        init=first,
        maxiter=max(generations - 1, 1),
        tol=_SPREAD,
        recombination=0.9,
        polish=False,
        updating="deferred",
        vectorized=True,
        seed=np.random.default_rng(seed),
    )


def _refine(best: _Best) -> bool:
    """Return whether Nelder and Mead's simplex has become small."""
    middle = best.point.copy()
    steps = np.where(middle < 0.5, _EDGE, -_EDGE)
    simplex = np.vstack([middle, middle + np.diag(steps)])
    flat = _FLAT * max(abs(best.merit), 1e-12)
    options = {"initial_simplex": simplex, "xatol": _SMALL, "fatol": flat, "maxfev": 1000 * len(middle)}
    done = optimize.minimize(
        best.single, middle, method="Nelder-Mead", bounds=[(0.0, 1.0)] * len(middle), options=options
    )
    return bool(done.success)
