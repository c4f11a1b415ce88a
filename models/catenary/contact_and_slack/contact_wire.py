"""The contact wire as a strip meets it: elements along the track, their shape and their static height.

An element's nodes move with its interval: with its modes q and with the displacements x of the two attachments.
Local coordinates of an interval are these, one after the other.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from models.arrays import FloatArray, IntArray
from models.catenary.condition.running_surface import RunningSurface
from models.catenary.contact_and_slack.crossing import Crossing, Strip, crossing, engagement, penetration
from models.catenary.linear_motion.interval_modes import IntervalModes, IntervalMotion
from models.catenary.linear_motion.line_motion import LineMotion
from models.catenary.shape.beam_elements import NODE_DOFS, frames, hermite_rows
from models.catenary.shape.element_pattern import element_dofs
from models.catenary.shape.form_finding import StaticState
from models.catenary.shape.line_mesh import Chain
from models.catenary.shape.wire_intervals import Interval, turns


@dataclass(frozen=True, eq=False)
class WireInterval:
    """A contact wire between two attachments: k + 1 elements, m local coordinates.

    Attributes
    ----------
    first : int
        Its first element.
    modes : slice
        Its modes.
    count, size : int
        Number of these; number of local coordinates, m.
    sides : (ndarray, ndarray)
        Places of its two attachments' displacements.
    ends : ndarray, shape (e,)
        The same in one array.
    plan : ndarray, shape (2 k + 4, m)
        Displacement in plan, x and y, of its k + 2 nodes.
    plan_static : ndarray, shape (2 k + 4,)
        Static position of its nodes in plan [m].
    height : ndarray, shape (k + 1, 4, m)
        Height above the static shape = [1, xi, xi^2, xi^3] @ height[element] @ local coordinates.
    height_static : ndarray, shape (k + 1, 4)
        Static height = [1, xi, xi^2, xi^3] @ height_static[element] [m].
    """

    first: int
    modes: slice
    count: int
    size: int
    sides: tuple[IntArray, IntArray]
    ends: IntArray
    plan: FloatArray
    plan_static: FloatArray
    height: FloatArray
    height_static: FloatArray

    def positions(self, local: FloatArray) -> list[float]:
        """Return the positions of its nodes in plan, x and y in turn [m]."""
        return (self.plan_static + self.plan.dot(local)).tolist()

    def lift(self, element: int, xi: float) -> tuple[FloatArray, float]:
        """Return what unit local coordinates lift a point of an element of the wire by, and its static height [m]."""
        powers, own = np.array((1.0, xi, xi * xi, xi * xi * xi)), element - self.first
        return powers.dot(self.height[own]), float(powers.dot(self.height_static[own]))

    def split(self, row: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the parts of a row over local coordinates: over its modes, and over its attachments."""
        return row[: self.count], row[self.count :]

    def local(self, motion: LineMotion) -> FloatArray:
        """Return its local coordinates and their rates, shape (2, m)."""
        return np.concatenate((motion.modal[:, self.modes], motion.attached.take(self.ends, axis=1)), axis=1)

    def at(self, found: Crossing, local: FloatArray) -> tuple[float, float]:
        """Return a point of the interval in plan from its local coordinates [m]."""
        k = 2 * (found.element - self.first)
        x1, y1, x2, y2 = (self.plan_static[k : k + 4] + self.plan[k : k + 4].dot(local)).tolist()
        return x1 + found.xi * (x2 - x1), y1 + found.xi * (y2 - y1)


#: A strip farther than this from the ends of a wire does not meet it, however the wire moves [m].
_FAR = 1.0

#: Positions in plan of an interval's nodes, x and y in turn [m], from wherever its motion is known.
Positions = Callable[[WireInterval], Sequence[float]]


class ContactWire:
    """Contact wire of one section.

    One that closes on itself (``period`` > 0) is met at the same place after every lap; a strip is looked for in the
    lap of the elements, and may cross the wire on either side of the place where it closes.

    Parameters
    ----------
    chain : Chain
        Its nodes.
    parts : sequence of (Interval, slice)
        Its intervals, from end to end, and their modes.
    static : StaticState
    modes : IntervalModes
        Coordinates of the line.
    angles : ndarray, shape (n,)
        Direction of the nodal axes in plan [rad].
    period : float
        Length after which the wire is met again, because it closes on itself [m]; 0 for one that ends.
    surface : RunningSurface, optional
        What strips run on, where its underside does not follow its static shape.

    Attributes
    ----------
    starts : list of float
        Where its elements begin along the track, and where the last one ends [m].
    intervals : tuple of WireInterval
    period, surface
        The parameters.
    """

    def __init__(
        self,
        chain: Chain,
        parts: Sequence[tuple[Interval, slice]],
        static: StaticState,
        modes: IntervalModes,
        angles: FloatArray,
        period: float = 0.0,
        surface: RunningSurface | None = None,
    ) -> None:
        self.period, self.surface = period, surface
        self.starts: list[float] = static.positions[chain.nodes, 0].tolist()
        self.intervals = _intervals(parts, static, modes, angles)
        self._of_element = [i for i in self.intervals for _ in i.height]

    @property
    def ends(self) -> tuple[float, float]:
        """Return where the wire begins and ends along the track [m]."""
        return self.starts[0], self.starts[-1]

    @property
    def elements(self) -> int:
        """Return the number of its elements."""
        return len(self._of_element)

    def is_near(self, strip: Strip) -> bool:
        """Return whether a strip could meet the wire, which may end before it.

        Parameters
        ----------
        strip : Strip
        """
        a, b = strip[0][0][0], strip[1][0][0]
        return self.period > 0.0 or (max(a, b) > self.starts[0] - _FAR and min(a, b) < self.starts[-1] + _FAR)

    def locate(self, x: float) -> tuple[int, float]:
        """Return the element at a position of the track and the share of the way along it, in the static shape."""
        x -= self._laps(x) * self.period
        element = self.start(-1, x)
        start, end = self.starts[element : element + 2]
        return element, (x - start) / (end - start)

    def interval(self, element: int) -> WireInterval:
        """Return the interval that an element belongs to."""
        return self._of_element[element]

    def next_interval(self, element: int) -> WireInterval:
        """Return the interval after that of an element; the last one of a wire that ends follows itself."""
        after, count = self._of_element[element].first + len(self._of_element[element].height), self.elements
        return self._of_element[after % count if self.period else min(after, count - 1)]

    def find(self, strip: Strip, positions: Positions, guess: int) -> Crossing | None:
        """Find where a strip crosses the wire, walking from the element ``guess``.

        Parameters
        ----------
        strip : Strip
        positions : callable
            Interval -> positions in plan of its nodes, x and y in turn [m].

        Returns
        -------
        Crossing or None
            None beyond the wire's ends, or where the wire passes beside the strip.
        """
        a, b = list(strip[0][0]), list(strip[1][0])
        if self.period:
            self._shift(a, b, -self._laps((a[0] + b[0]) / 2.0))
        element = self.start(guess, (a[0] + b[0]) / 2.0)
        last = len(self._of_element) - 1
        interval: WireInterval | None = None
        at: Sequence[float] = ()
        direction, round_trips = 0, 0
        while True:
            if interval is not self._of_element[element]:
                interval = self._of_element[element]
                at = positions(interval)
            k = 2 * (element - interval.first)
            found = crossing(a, b, at[k : k + 2], at[k + 2 : k + 4])
            if found is None:
                return None
            share, xi = found
            step = -1 if xi < 0.0 else (1 if xi > 1.0 else 0)
            if step == 0 or step == -direction:
                return self.crossing(strip, element, min(max(xi, 0.0), 1.0), share) if 0.0 <= share <= 1.0 else None
            direction = step
            element += step
            if not 0 <= element <= last:
                round_trips += 1
                if not self.period or round_trips > 1:  # a strip along the track may cross nowhere near
                    return None
                element %= last + 1
                self._shift(a, b, -step)

    def crossing(self, strip: Strip, element: int, xi: float, share: float) -> Crossing:
        """Return a crossing from its place on an element and on the strip."""
        a, b = strip[0][0][:2], strip[1][0][:2]
        start, end = self.starts[element : element + 2]
        x = start + xi * (end - start)
        from_wire_end = math.inf if self.period else min(x - self.starts[0], self.starts[-1] - x)
        return Crossing(element, xi, share, engagement(min(share, 1.0 - share) * math.dist(a, b), from_wire_end))

    def penetration(self, share: float, height: float, rate: float, strip: Strip, gap: float) -> tuple[float, float]:
        """Return penetration and its velocity of a strip that crosses the wire [m, m/s]; see `crossing.penetration`.

        A running surface r that stands up leaves less of them, by r and by v dr/dx with the speed v of the strip.
        """
        delta, velocity = penetration(share, height, rate, strip, gap)
        if self.surface is None:
            return delta, velocity
        (x, v), (x_b, v_b) = ((position[0], velocity[0]) for position, velocity in strip)
        r, slope = self.surface.at(x + share * (x_b - x))
        return delta - r, velocity - (v + share * (v_b - v)) * slope

    def start(self, guess: int, x: float) -> int:
        """Return where to begin walking; a guess that is far off (first step, reset) is replaced by a search."""
        if 0 <= guess < len(self._of_element) and abs(self.starts[guess] - x) < 5.0:
            return guess
        found = bisect_left(self.starts, x) - 1
        return min(max(found, 0), len(self._of_element) - 1)

    def alongside(self, x: FloatArray, place: FloatArray) -> FloatArray:
        """Return places along the track of a wire that closes on itself in the lap of strips near them.

        Parameters
        ----------
        x : ndarray, shape (P,)
            Where the strips are [m].
        place : ndarray, shape (P,)
            As its elements stand [m]; NaN stays.
        """
        return place + self.period * np.round((x - place) / self.period)

    def _laps(self, x: float) -> int:
        """Return how often a position of the track has gone round a wire that closes on itself; 0 on one that ends.

        What is no number has no lap either: the step tells of it as on a wire that ends.
        """
        return math.floor((x - self.starts[0]) / self.period) if self.period and math.isfinite(x) else 0

    def _shift(self, a: list[float], b: list[float], laps: int) -> None:
        """Move the ends of a strip by whole laps."""
        a[0] += laps * self.period
        b[0] += laps * self.period


def put_in_lap(wires: Sequence[ContactWire], point: FloatArray, strips: FloatArray) -> None:
    """Move points of wires that close on themselves along with their strips, which travel on.

    Parameters
    ----------
    point : ndarray, shape (n_pantographs, n_sections, 3)
        Changed in place [m].
    strips : ndarray, shape (n_pantographs, 2, 2, 3)
    """
    for s, wire in enumerate(wires):
        if wire.period:
            point[:, s, 0] = wire.alongside(strips[:, :, 0, 0].mean(axis=1), point[:, s, 0])


def height_polynomials(nodes: IntArray, static: StaticState, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return heights of the elements between successive nodes as polynomials of xi.

    Returns
    -------
    rows : ndarray, shape (k, 4, 12)
        Of the height above the static shape, over the nodal displacements of an element.
    static : ndarray, shape (k, 4)
        Of the static height [m].
    """
    pairs = np.stack([nodes[:-1], nodes[1:]], axis=1)
    axes, length = frames(static.shape.points[pairs[:, 0]], static.shape.points[pairs[:, 1]])
    rows = hermite_rows(axes, length)
    local = static.displacement[element_dofs(pairs)].copy()
    # The static rotations count from a horizontal wire; the chord's own slope is in the reference height.
    local[:, [4, 10]] += axes[:, 0, 2, None]
    local[:, [5, 11]] -= axes[:, 0, 1, None]
    height = np.einsum("kij,kj->ki", rows, local)
    z = static.shape.points[pairs, 2]
    height[:, 0] += z[:, 0]
    height[:, 1] += z[:, 1] - z[:, 0]
    turn = turns(angles)[np.repeat(pairs, 2, axis=1)]
    return np.einsum("kibj,kbjm->kibm", rows.reshape(-1, 4, 4, 3), turn).reshape(rows.shape), height


def _intervals(
    parts: Sequence[tuple[Interval, slice]], static: StaticState, modes: IntervalModes, angles: FloatArray
) -> tuple[WireInterval, ...]:
    motion = IntervalMotion(modes)
    nodes = np.concatenate([parts[0][0].nodes[:1], *(part.nodes[1:] for part, _ in parts)])
    rows, height = height_polynomials(nodes, static, angles)
    result, first = [], 0
    for part, span in parts:
        count = len(part.nodes) - 1
        here = slice(first, first + count)
        sides, local = motion.rows(part, span)
        by_node = local.reshape(count + 1, NODE_DOFS, -1)
        of_element = np.concatenate([by_node[:-1], by_node[1:]], axis=1)
        plan = np.einsum("nij,njm->nim", turns(angles[part.nodes])[:, :2, :2], by_node[:, :2])
        result.append(
            WireInterval(
                first=first,
                modes=span,
                count=span.stop - span.start,
                size=local.shape[1],
                sides=sides,
                ends=np.concatenate(sides),
                plan=np.ascontiguousarray(plan.reshape(2 * (count + 1), -1)),
                plan_static=static.positions[part.nodes, :2].ravel(),
                height=rows[here] @ of_element,
                height_static=height[here],
            )
        )
        first += count
    return tuple(result)
