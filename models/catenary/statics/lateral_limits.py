"""How far the contact wire may lie from the middle of the track: EN 50367 and EN 15273, by height, radius and cant."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from models.definition_files.field_schema import named, quantity, series
from models.definition_files.parameter import ParameterError


@dataclass(frozen=True, kw_only=True)
class PantographHead:
    """A head: half widths, and what the interoperability rules allow at most."""

    name: str
    half_width: float = quantity("m", "b_w, half of the head")
    working_half_width: float = quantity("m", "b_wc, half of its working range")
    cap: float = quantity("m", "largest permissible lateral deviation of the TSI")


@dataclass(frozen=True, kw_only=True)
class LateralNorm:
    """The numbers of the permissible lateral deviation."""

    uplift: float = quantity("m", "uplift of the wire")
    height_tolerance: float = quantity("m", "tolerance of the wire's height")
    lowest: float = quantity("m", "lowest height of the formulas")
    highest: float = quantity("m", "highest height of the formulas")
    sway_lowest: float = quantity("m", "e_p, sway of the head at the lowest height")
    sway_highest: float = quantity("m", "e_p at the highest height")
    curve: float = quantity("m2", "S' times the radius: overhang in curves")
    widest_gauge: float = quantity("m", "widest gauge of the track")
    gauge: float = quantity("m", "narrowest gauge of wheelsets")
    base: float = quantity("m", "base of the cant")
    flexibility: float = quantity("1", "flexibility of the vehicle")
    free_cant: float = quantity("m", "cant that is in e_p already")
    roll_centre: float = quantity("m", "height of the roll centre")
    track_position: float = quantity("m", "lateral tolerance of the track")
    track_cant: float = quantity("m", "tolerance of cant, of a track at rest")
    loading: float = quantity("rad", "angle by the loading")
    suspension: float = quantity("rad", "angle by the suspension's adjustment")
    dynamic_cant: float = quantity("m", "cant of the vehicle's oscillations")
    line: tuple[float, ...] = series("m", "tolerances of the line")
    head: tuple[PantographHead, ...] = named("head", PantographHead)

    def permissible(self, head: str, height: float, curvature: float, cant: float) -> LateralLimit:
        """Return how far the wire may lie from the middle of the track.

        Parameters
        ----------
        head : str
            Name of the head: "1600", "1950".
        height : float
            Nominal height of the contact wire [m].
        curvature, cant : float
            Of the track [1/m], [m].

        Raises
        ------
        ParameterError
            If the height, raised by uplift and tolerance, is outside the formulas' range.
        """
        chosen = next(h for h in self.head if h.name == head)
        h = height + self.uplift + self.height_tolerance
        if not self.lowest <= h <= self.highest:
            raise ParameterError(
                f"a contact wire at {height:g} m is at {h:g} m with uplift and tolerance: permissible deviations are "
                f"known for {self.lowest:g} ... {self.highest:g} m; give a --limit"
            )
        sway = float(np.interp(h, [self.lowest, self.highest], [self.sway_lowest, self.sway_highest]))
        overhang = self.curve * abs(curvature) + 0.5 * (self.widest_gauge - self.gauge)
        lean = self.flexibility / self.base * max(0.0, abs(cant) - self.free_cant) * (h - self.roll_centre)
        fixed = sway + overhang + lean
        chance = float(np.interp(h, [self.lowest, self.highest], [*map(self._chance, (self.lowest, self.highest))]))
        return LateralLimit(chosen.working_half_width - fixed, chosen.half_width - fixed - chance, chosen.cap)

    def _chance(self, h: float) -> float:
        """Return what happens by chance at a height, the root of the sum of squares [m]."""
        return math.sqrt(sum(value**2 for value in self._chances(h)))

    def _chances(self, h: float) -> Iterator[float]:
        arm, lean = h - self.roll_centre, self.flexibility / self.base
        yield self.track_position
        yield self.track_cant / self.base * h + lean * self.track_cant * arm
        yield math.tan(self.loading) * arm
        yield math.tan(self.suspension) * arm
        yield lean * self.dynamic_cant * arm
        yield from self.line


@dataclass(frozen=True)
class LateralLimit:
    """Permissible lateral deviations: in operation (d_lg), mechanical (d_lv), and the cap of the TSI [m]."""

    operating: float
    mechanical: float
    cap: float

    @property
    def permissible(self) -> float:
        """Return the least of the three [m]."""
        return min(self.operating, self.mechanical, self.cap)
