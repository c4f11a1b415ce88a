"""The track under a line: curvature, cant and vertical curvature along its length, as read and checked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from models.definition_files.field_schema import quantity, series

#: Tightest radius that a track may have [m]; tramways turn with 20 m.
TIGHTEST_RADIUS: Final = 15.0
_TIGHTEST: Final = 1.0 / TIGHTEST_RADIUS
#: Largest cant of any track, with the sign of a mistake in the unit well beyond it [m].
_LARGEST_CANT: Final = 0.3
#: Distance of the wheel circles of standard gauge [m].
_BASE: Final = 1.5
#: Steepest ramp of a cant [1]; railways build 1 in 400.
STEEPEST_RAMP: Final = 0.05
#: Knots closer than this are the same place, at which a quantity jumps [m].
SAME_PLACE: Final = 1e-6


@dataclass(frozen=True, kw_only=True)
class Track:
    """Curvature and cant at knots along the track: linear between them, constant outside; [] means 0 everywhere.

    A place that is written twice is one where curvature jumps.
    """

    positions: tuple[float, ...] = series(
        "m", "places along the track at which the other lists say something, in rising order",
        minimum=-1e7, maximum=1e7,
    )  # fmt: skip
    curvature: tuple[float, ...] = series(
        "1/m", "curvature at every position; greater than 0: a curve to the left",
        default=(), minimum=-_TIGHTEST, maximum=_TIGHTEST,
    )  # fmt: skip
    radius: tuple[float, ...] = series(
        "m", "instead of the curvature: radius at every position, 0 for straight track; greater than 0: a curve to "
        "the left. Between the positions it is the curvature that is linear",
        default=(), minimum=-1e7, maximum=1e7,
    )  # fmt: skip
    cant: tuple[float, ...] = series(
        "m", "how much higher the right rail is than the left one at every position, which a curve to the left wants",
        default=(), minimum=-_LARGEST_CANT, maximum=_LARGEST_CANT,
    )  # fmt: skip
    vertical_curvature: tuple[float, ...] = series(
        "1/m", "curvature of the gradient at every position; greater than 0: the track is hollow",
        default=(), minimum=-0.01, maximum=0.01,
    )  # fmt: skip
    base: float = quantity(
        "m", "distance of the wheel circles, over which the cant is measured", default=_BASE, minimum=0.4, maximum=2.5
    )

    @property
    def curvatures(self) -> tuple[float, ...]:
        """Return the curvature at every knot [1/m], from whichever list gives it."""
        if self.radius:
            return tuple(1.0 / R if R else 0.0 for R in self.radius)
        return self._listed(self.curvature)

    @property
    def cants(self) -> tuple[float, ...]:
        """Return the cant at every knot [m]."""
        return self._listed(self.cant)

    @property
    def vertical_curvatures(self) -> tuple[float, ...]:
        """Return the vertical curvature at every knot [1/m]."""
        return self._listed(self.vertical_curvature)

    @property
    def is_constant(self) -> bool:
        """Return whether the track is everywhere the same."""
        return all(len(set(values)) == 1 for values in (self.curvatures, self.cants, self.vertical_curvatures))

    @property
    def is_straight(self) -> bool:
        """Return whether the track is straight, level and without cant."""
        return not any(map(any, (self.curvatures, self.cants, self.vertical_curvatures)))

    def _listed(self, values: tuple[float, ...]) -> tuple[float, ...]:
        return values or (0.0,) * len(self.positions)

    def problems(self) -> Iterator[tuple[str, str]]:
        """Yield what lists do not agree upon."""
        count = len(self.positions)
        if not count:
            return  # missing or unreadable, and reported
        yield from _order_problems(self.positions)
        for key in ("curvature", "radius", "cant", "vertical_curvature"):
            values: tuple[float, ...] = getattr(self, key)
            if values and len(values) != count:
                yield key, f"gives {len(values)} values for {count} positions: give one for each"
        if self.curvature and self.radius:
            yield "radius", "says what curvature says: give one of them"
        if tight := [R for R in self.radius if 0.0 < abs(R) < TIGHTEST_RADIUS]:
            yield "radius", f"{tight[0]:g} m: no track is as tight; {TIGHTEST_RADIUS:g} m or more, or 0 for straight"
        if self.base != _BASE and not any(self.cant):
            yield "base", f"{self.base:g} m says nothing where no cant is measured over it: give a cant, or remove it"
        yield from self._cant_problems()

    def _cant_problems(self) -> Iterator[tuple[str, str]]:
        if any(abs(D) >= self.base for D in self.cant):
            yield "cant", f"is not less than the base, {self.base:g} m"
        for (a, b), (D, E) in zip(pairwise(self.positions), pairwise(self.cant), strict=False):
            if abs(b - a) <= SAME_PLACE and D != E:
                text = f"jumps from {1e3 * D:g} to {1e3 * E:g} mm at {a:g} m: a cant rises along a ramp"
                yield "cant", f"{text}; give its two ends different positions"
            elif abs(E - D) > STEEPEST_RAMP * (b - a) > 0.0:
                text = f"goes from {1e3 * D:g} to {1e3 * E:g} mm within {b - a:g} m, from {a:g} m on"
                yield "cant", f"{text}: no ramp is steeper than 1 in {1.0 / STEEPEST_RAMP:g}; check the positions"


def _order_problems(positions: Sequence[float]) -> Iterator[tuple[str, str]]:
    if falling := [(a, b) for a, b in pairwise(positions) if b < a]:
        a, b = falling[0]
        yield "positions", f"are not in rising order: {b:g} m comes after {a:g} m"
    if any(c - a <= SAME_PLACE for a, c in zip(positions, positions[2:], strict=False)):
        yield "positions", "give one place more than twice: twice is a jump of curvature"
