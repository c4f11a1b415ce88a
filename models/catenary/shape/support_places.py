"""Where the supports of a section hold its wires: heights, places in plan, sides of the steady arms."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.catenary.definition.line_definition import GRAVITY, CatenaryDefinition
from models.catenary.definition.section_definition import Section, Support
from models.catenary.shape.track import curve_force, track_at, twist_jumps
from models.numerics.gauss_points import gauss_points

#: Points of Gauss-Legendre integration in every piece of a span between knots of the track.
_GAUSS: Final = 8


class SupportPlaces:
    """Where wires are held at the supports of a section, and on the straight lines between these.

    Attributes
    ----------
    supports : tuple of Support
        With the anchors; a line that closes on itself has the first of them once more at its end.
    x : ndarray, shape (n,)
        Where they are [m].
    """

    def __init__(self, definition: CatenaryDefinition, section: Section) -> None:
        self.definition, self.section = definition, section
        supports = section.supports
        if section.periodic:
            end = section.spans[-1].end
            supports = (*supports, replace(supports[0], x=end))
        self.supports = supports
        self.x = np.array([s.x for s in supports])
        self._stagger = np.array([s.stagger for s in supports])
        self._heights = self._own(lambda s: s.contact_wire_height, definition.profile.contact_wire_height)
        self._encumbrances = self._own(lambda s: s.encumbrance, definition.profile.encumbrance)
        self._messenger = self._messenger_places()

    def height(self, x: float) -> float:
        """Return the height of the contact wire on the line between supports, without pre-sag and rise [m]."""
        return self._between(x, self._heights, self.definition.profile.contact_wire_height)

    def encumbrance(self, x: float) -> float:
        """Return the height of the line between the messenger wire's supports above that [m]."""
        return self._between(x, self._encumbrances, self.definition.profile.encumbrance)

    def lateral(self, x: float, component: str) -> float:
        """Return the place in plan of a wire on the straight line between supports [m]."""
        contact = float(np.interp(x, self.x, self._stagger))
        if component == "contact_wire" or self._messenger is None:
            return contact
        share = 1.0
        if component == "auxiliary_wire":
            share = (self.definition.profile.auxiliary_height or 0.0) / self.encumbrance(x)
        return contact + share * (float(np.interp(x, self.x, self._messenger)) - contact)

    def side(self, support: Support) -> float:
        """Return the side of a steady arm's registration end: 1 left of the wire, -1 right of it.

        Unless it is given, the side from which the arm pulls: on straight track that of the stagger.
        """
        if support.arm_side is not None:
            return float(support.arm_side)
        track = self.definition.track
        if track is None or track.is_straight:
            return math.copysign(1.0, support.stagger)
        return math.copysign(1.0, self.lateral_force(support))

    def lateral_force(self, support: Support) -> float:
        """Return the lateral force that a support with a steady arm must give the contact wire alone [N], left > 0."""
        before, after = self._neighbours(support)
        tension = self.definition.contact_wire.tension
        y, force = support.stagger, 0.0
        for at, other in before, after:
            force += tension * (y - other) / abs(at - support.x)
            force -= self._load_share(support.x, y, at, other)
        return force - self._twist_share(support.x, before[0], after[0])

    def _neighbours(self, support: Support) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return place and stagger of what holds the contact wire before and after a support."""
        held = self._held
        place = bisect_left(held, support.x, key=lambda s: s.x)
        if not self.section.periodic:
            before, after = held[place - 1], held[place + 1]
            return (before.x, before.stagger), (after.x, after.stagger)
        period = self.section.period
        before, after = held[place - 1], held[(place + 1) % len(held)]
        return (
            (before.x - (period if place == 0 else 0.0), before.stagger),
            (after.x + (period if place == len(held) - 1 else 0.0), after.stagger),
        )

    @cached_property
    def _held(self) -> list[Support]:
        """Supports with arms, and the anchors: what holds the contact wire in plan."""
        supports = self.section.supports
        ends = set() if self.section.periodic else {0, len(supports) - 1}
        return [s for i, s in enumerate(supports) if s.has_steady_arm or i in ends]

    def _load_share(self, x: float, y: float, other: float, stagger: float) -> float:
        """Return what of the lateral load between two supports the one at ``x`` takes: its integral with the hat."""
        track, wire = self.definition.track, self.definition.contact_wire
        if track is None:
            return 0.0
        low, high = min(x, other), max(x, other)
        breaks = [low, *sorted({k for k in track.positions if low < k < high}), high]
        nodes, weights = gauss_points(_GAUSS)
        total = 0.0
        slope, rise = (stagger - y) / (other - x), (self.height(other) - self.height(x)) / (other - x)
        for a, b in pairwise(breaks):
            at = 0.5 * (a + b) + 0.5 * (b - a) * nodes
            share = (at - x) / (other - x)
            place = track_at(track, at)
            force = curve_force(place, y + slope * (at - x), self.height(x) + rise * (at - x), slope, rise)
            lateral = wire.tension * force[:, 0] + wire.mass * GRAVITY * np.sin(place.cant)
            total += 0.5 * (b - a) * float(weights @ ((1.0 - share) * lateral))
        return total

    def _twist_share(self, x: float, before: float, after: float) -> float:
        """Return what the support at ``x`` takes of the forces at points where ramps of cant begin and end."""
        track = self.definition.track
        if track is None:
            return 0.0
        hat = np.interp(track.positions, [before, x, after], [0.0, 1.0, 0.0])
        near = np.flatnonzero(hat)
        heights = np.array([self.height(track.positions[knot]) for knot in near])
        return float(self.definition.contact_wire.tension * (hat[near] * heights) @ twist_jumps(track)[near])

    def _own(self, value: Callable[[Support], float | None], line_wide: float) -> FloatArray | None:
        """Return values of all supports, None if every one has the line-wide value."""
        values = [value(s) for s in self.supports]
        if all(v is None for v in values):
            return None
        return np.array([line_wide if v is None else v for v in values])

    def _between(self, x: float, values: FloatArray | None, line_wide: float) -> float:
        return line_wide if values is None else float(np.interp(x, self.x, values))

    def _messenger_places(self) -> FloatArray | None:
        """Return the messenger wire's places in plan, truly above the contact wire unless given; None: as that."""
        track = self.definition.track
        given = [s.messenger_stagger for s in self.supports]
        if track is None and all(v is None for v in given):
            return None
        lean = np.zeros_like(self.x)
        if track is not None:
            lean = np.tan(track_at(track, self.x).cant) * [self.encumbrance(x) for x in self.x]
        above = self._stagger - lean
        return np.array([a if v is None else v for a, v in zip(above, given, strict=True)])
