"""Where on the designed line a measuring run was: its positions laid on the design's.

The vehicle's way has another origin and another scale than the design. Structures that both name tell both; else the
staggers do, which are laid on the design's so that they correlate best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.optimize import least_squares

from models.arrays import BoolArray, FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.statics.wire_course import WireCourse, section_alone
from models.layout.as_built.measured_run import AsBuiltError, MeasuredRun

#: Largest error of the vehicle's way.
LARGEST_SCALE: Final = 0.002
#: Staggers that correlate less lie on no line that is meant.
LEAST_CORRELATION: Final = 0.8
#: A span may differ by this share from the design's, as structures are seen from a running vehicle.
_LARGEST_STRETCH: Final = 0.03
#: Structures whose places are straight within this need no course of their own between them [m]: so well they are seen.
_SEEN: Final = 0.6
#: Staggers are compared at places this far apart [m]; two fits farther apart than _APART are two.
_GRID: Final = 0.5
_APART: Final = 10.0
#: The least that run and design must share: of the shorter one, and at all [m].
_LEAST_SHARE: Final = 0.5
_LEAST_WAY: Final = 100.0
#: A gap in the staggers longer than this is not bridged [m].
_GAP: Final = 5.0
#: A second fit is alike if it leaves less than twice as much unexplained, and this.
_ALIKE: Final = 0.005
#: What to say of staggers that fit better if left were negative.
_OPPOSITE: Final = (
    "with the opposite sign they would fit better: left of the track's middle is positive, as seen in rising position"
)


@dataclass(frozen=True)
class Alignment:
    """Positions of a run by those of the design: straight between pairs of them, and beyond with the last scale.

    Attributes
    ----------
    by : str
        "structures", "staggers" or "" where positions are taken as they are.
    measured, design : ndarray, shape (k,)
        Pairs, in rising order [m]; one pair is a shift alone, none leaves positions as they are.
    correlation : float
        Of the staggers; NaN if they were not used.
    standard_error : float
        Of the positions, as far as scattering heights leave them open [m]; NaN if heights did not take part.
    structures : int
        How many structures it is made of.
    """

    by: str
    measured: FloatArray
    design: FloatArray
    correlation: float = float("nan")
    standard_error: float = float("nan")
    structures: int = 0

    def position(self, x: FloatArray) -> FloatArray:
        """Return the design's positions of places of the run, shape (n,) [m]."""
        if not len(self.measured):
            return x
        if len(self.measured) == 1:
            return x + (self.design[0] - self.measured[0])
        k = np.clip(np.searchsorted(self.measured, x, side="right") - 1, 0, len(self.measured) - 2)
        slope = np.diff(self.design) / np.diff(self.measured)
        return np.asarray(self.design[k] + slope[k] * (x - self.measured[k]))

    def moved(self, shift: float, scale: float, standard_error: float) -> Alignment:
        """Return the same with design positions shifted [m], and stretched about their middle, by a little more."""
        middle = 0.5 * (self.design[0] + self.design[-1])
        design = self.design + shift + scale * (self.design - middle)
        return replace(self, design=design, standard_error=standard_error)

    @property
    def is_straight(self) -> bool:
        """Return whether it is one shift and one scale for all of the run."""
        return len(self.measured) == 2

    @property
    def shift(self) -> float:
        """Return by how much the middle of the run is moved [m]."""
        if not len(self.measured):
            return 0.0
        middle = np.array([0.5 * (self.measured[0] + self.measured[-1])])
        return float((self.position(middle) - middle)[0])

    @property
    def scale(self) -> float:
        """Return by which share the run's way is too short, over all of it."""
        if len(self.measured) < 2:
            return 0.0
        return float((self.design[-1] - self.design[0]) / (self.measured[-1] - self.measured[0]) - 1.0)


def align(run: MeasuredRun, definition: CatenaryDefinition, courses: tuple[WireCourse, ...]) -> Alignment:
    """Lay a run on the design: by structures that both name, else by the staggers, else as it is.

    Raises
    ------
    AsBuiltError
        If structures are not where they are in the design, staggers fit nowhere, or in two places alike.
    """
    known = {s.structure: s.x for section in definition.sections for s in section.supports if s.structure}
    if known and any(run.structure):
        return _by_structures(run, known)
    if np.isfinite(run.stagger).any():
        return _by_staggers(run, courses)
    return Alignment("", np.zeros(0), np.zeros(0))


def _by_structures(run: MeasuredRun, known: dict[str, float]) -> Alignment:
    seen: dict[str, float] = {}
    for x, name in zip(run.position.tolist(), run.structure, strict=True):
        if name in known and x - seen.setdefault(name, x) > _APART:
            raise AsBuiltError(
                f"{run.source}: structure '{name}' stands at {seen[name]:.2f} m and at {x:.2f} m: it is in one place; "
                "correct the names"
            )
    if not seen:
        first = next(filter(None, run.structure))
        raise AsBuiltError(
            f"{run.source}: structure '{first}' and all others are none of the design's, which has "
            f"{', '.join(list(known)[:5])}{' ...' if len(known) > 5 else ''}"
        )
    names, measured = list(seen), np.array(list(seen.values()))
    design = np.array([known[name] for name in names])
    for a, b, way, wanted in zip(names, names[1:], np.diff(measured), np.diff(design), strict=False):
        if wanted <= 0.0:
            raise AsBuiltError(f"{run.source}: structure '{b}' comes after '{a}', and before it in the design")
        if abs(way / wanted - 1.0) > _LARGEST_STRETCH:
            raise AsBuiltError(
                f"{run.source}: from structure '{a}' to '{b}' it is {way:.2f} m, and {wanted:.2f} m in the design: "
                "correct the positions or the names"
            )
    ends = measured[[0, -1]]
    if len(names) > 2:
        line = np.polynomial.Polynomial.fit(measured, design, 1)
        if np.abs(line(measured) - design).max() <= _SEEN:
            return Alignment("structures", ends, line(ends), structures=len(names))
    return Alignment("structures", measured, design, structures=len(names))


def _by_staggers(run: MeasuredRun, courses: tuple[WireCourse, ...]) -> Alignment:
    there = np.isfinite(run.stagger)
    x, y = run.position[there], run.stagger[there]
    if x[-1] - x[0] < _LEAST_WAY:
        raise AsBuiltError(
            f"{run.source}: staggers are given over {x[-1] - x[0]:.0f} m, and {_LEAST_WAY:g} m are needed to find "
            "their place: give more, or none and positions as the design has them"
        )
    fits = _Fits.over(x, y, courses)
    shift, scale = fits.best
    shift, scale = _refined(x, y, courses, shift, scale)
    middle = 0.5 * (x[0] + x[-1])
    ends = np.array([x[0], x[-1]])
    found = Alignment("staggers", ends, ends + shift + scale * (ends - middle))
    correlation = _correlation(y, _lateral(courses, found.position(x)))
    if not correlation >= LEAST_CORRELATION:
        raise AsBuiltError(_nowhere(run, fits, correlation))
    other, where = fits.second(shift)
    if 1.0 - other < 2.0 * (1.0 - fits.value) + _ALIKE:
        signs = f"; {_OPPOSITE} ({-fits.opposite:.3f})" if 1.0 + fits.opposite < 0.5 * (1.0 - fits.value) else ""
        raise AsBuiltError(
            f"{run.source}: the staggers fit the design in two places alike, shifted by {shift:.1f} m (correlation "
            f"{fits.value:.3f}) and by {where:.1f} m ({other:.3f}): name the structures in a column 'structure', or "
            f"give a longer run{signs}"
        )
    return Alignment("staggers", found.measured, found.design, correlation)


def _nowhere(run: MeasuredRun, fits: _Fits, correlation: float) -> str:
    if np.isnan(correlation):
        return (
            f"{run.source}: the staggers do not say where the run was: they are the same throughout, or it shares less "
            "than half of its way with the line"
        )
    text = (
        f"{run.source}: the staggers do not fit the design: at best they correlate with {correlation:.2f}, and "
        f"{LEAST_CORRELATION:g} is the least"
    )
    if -fits.opposite >= LEAST_CORRELATION:
        return f"{text}; {_OPPOSITE}"
    return f"{text}; check that this is the line, and the units of positions and staggers"


@dataclass(frozen=True)
class _Fits:
    """Correlations over shifts of the middle [m] (columns) and scales (rows); NaN where too little is shared."""

    shifts: FloatArray
    scales: FloatArray
    correlation: FloatArray

    @classmethod
    def over(cls, x: FloatArray, y: FloatArray, courses: tuple[WireCourse, ...]) -> _Fits:
        """Try all shifts of staggers y at x, with enough scales between the largest errors of the way."""
        start, end = min(c.x[0] for c in courses), max(c.x[-1] for c in courses)
        grid = np.arange(start, end, _GRID)
        wanted = _lateral(courses, grid)
        middle, way = 0.5 * (x[0] + x[-1]), x[-1] - x[0]
        count = 2 * int(np.ceil(LARGEST_SCALE * way / 4.0)) + 1 if way > 0.0 else 1
        scales = np.linspace(-LARGEST_SCALE, LARGEST_SCALE, max(3, min(count, 401)))
        least = max(_LEAST_WAY, _LEAST_SHARE * min(way, end - start)) / _GRID
        half = np.arange(0.0, 0.5 * way * (1.0 + LARGEST_SCALE) + _GRID, _GRID)
        around = np.concatenate([-half[:0:-1], half])
        rows = [
            _cross_correlation(_resampled((x - middle) * (1.0 + scale), y, around), wanted, least) for scale in scales
        ]
        lags = np.arange(-len(around) + 1, len(grid))
        # At lag k the run's first sample lies on grid[k].
        shifts = start + lags * _GRID - around[0] - middle
        return cls(shifts, scales, np.array(rows, dtype=np.float32))

    @property
    def best(self) -> tuple[float, float]:
        """Return shift [m] and scale of the best fit."""
        if not np.isfinite(self.correlation).any():
            return 0.0, 0.0
        row, column = np.unravel_index(np.nanargmax(self.correlation), self.correlation.shape)
        return float(self.shifts[column]), float(self.scales[row])

    @property
    def value(self) -> float:
        """Return the best correlation, as found here; NaN if run and design share too little."""
        return float(np.nanmax(self.correlation)) if np.isfinite(self.correlation).any() else float("nan")

    @property
    def opposite(self) -> float:
        """Return the most negative correlation."""
        return float(np.nanmin(self.correlation)) if np.isfinite(self.correlation).any() else float("nan")

    def second(self, shift: float) -> tuple[float, float]:
        """Return the best correlation of another place than ``shift``, and its shift [m]."""
        elsewhere = np.where(np.abs(self.shifts - shift) > _APART, self.correlation, np.nan)
        if not np.isfinite(elsewhere).any():
            return -1.0, shift
        column = int(np.unravel_index(np.nanargmax(elsewhere), elsewhere.shape)[1])
        return float(np.nanmax(elsewhere)), float(self.shifts[column])


def _resampled(x: FloatArray, y: FloatArray, grid: FloatArray) -> FloatArray:
    """Return values at the places of a grid, NaN outside and in gaps."""
    after = np.clip(np.searchsorted(x, grid), 1, max(len(x) - 1, 1))
    if len(x) < 2:
        return np.full(len(grid), np.nan)
    bridged = (x[after] - x[after - 1] <= _GAP) & (grid >= x[0]) & (grid <= x[-1])
    return np.where(bridged, np.interp(grid, x, y), np.nan)


def _cross_correlation(run: FloatArray, wanted: FloatArray, least: float) -> FloatArray:
    """Return the correlation of two rows of samples at every lag, NaN where they share fewer samples than ``least``."""
    a, b = (np.nan_to_num(v) for v in (run, wanted))
    has_a, has_b = (np.isfinite(v).astype(float) for v in (run, wanted))
    size = next_fast_len(len(a) + len(b) - 1, real=True)
    A, A2, NA = (rfft(v, size).conj() for v in (a, a * a, has_a))
    B, B2, NB = (rfft(v, size) for v in (b, b * b, has_b))

    def summed(one: FloatArray, other: FloatArray) -> FloatArray:
        return np.asarray(np.roll(irfft(one * other, size), len(a) - 1)[: len(a) + len(b) - 1])

    n = summed(NA, NB)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_a, mean_b = summed(A, NB) / n, summed(NA, B) / n
        var_a, var_b = summed(A2, NB) / n - mean_a**2, summed(NA, B2) / n - mean_b**2
        result = (summed(A, B) / n - mean_a * mean_b) / np.sqrt(var_a * var_b)
    usable = (n >= least) & (var_a > 1e-8) & (var_b > 1e-8)
    return np.where(usable, np.clip(result, -1.0, 1.0), np.nan)


def _refined(
    x: FloatArray, y: FloatArray, courses: tuple[WireCourse, ...], shift: float, scale: float
) -> tuple[float, float]:
    """Return shift and scale with the least squares of what is left of the staggers, near a first guess."""
    middle, half = 0.5 * (x[0] + x[-1]), max(0.5 * (x[-1] - x[0]), 1.0)

    def left(unknown: FloatArray) -> FloatArray:
        design = _lateral(courses, x + unknown[0] + unknown[1] / half * (x - middle))
        return np.nan_to_num(y - design)

    most = LARGEST_SCALE * half
    start = np.array([shift, np.clip(scale * half, -most * 0.999, most * 0.999)])
    bounds = ([shift - _APART, -most], [shift + _APART, most])
    found = least_squares(left, start, bounds=bounds, x_scale=0.1, diff_step=1e-4)
    return float(found.x[0]), float(found.x[1] / half)


def _correlation(a: FloatArray, b: FloatArray) -> float:
    both: BoolArray = np.isfinite(a) & np.isfinite(b)
    if both.sum() < 3 or not (a[both].std() > 1e-6 and b[both].std() > 1e-6):
        return float("nan")
    return float(np.corrcoef(a[both], b[both])[0, 1])


def _lateral(courses: Sequence[WireCourse], x: FloatArray) -> FloatArray:
    """Return the design's place in plan where one wire is alone, shape (n,) [m]; NaN elsewhere."""
    which = section_alone(tuple(courses), x)
    result = np.full(len(x), np.nan)
    for index, course in enumerate(courses):
        here = which == index
        result[here] = course.lateral(x[here])
    return result
