"""The contact wire as a strip meets it: elements along the track, their shape and their static height."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from models.catenary.assembly import element_dofs
from models.catenary.condensation import plan_rotation
from models.catenary.elements import NODE_DOFS, frames, hermite_rows
from models.catenary.equilibrium import StaticState
from models.catenary.mesh import Chain
from models.contact import crossing, engagement
from models.part import FloatArray, IntArray


@dataclass(frozen=True)
class WireElement:
    """One element of a contact wire.

    Attributes
    ----------
    dofs : ndarray, shape (m,)
        Its free degrees of freedom, m <= 12.
    rows : ndarray, shape (4, m)
        Height above the static shape = [1, xi, xi^2, xi^3] @ rows @ d[dofs].
    static : ndarray, shape (4,)
        Static height = [1, xi, xi^2, xi^3] @ static [m].
    """

    dofs: IntArray
    rows: FloatArray
    static: FloatArray


@dataclass(frozen=True)
class Crossing:
    """Where a strip crosses a wire in plan: element, place on it, place on the strip; how much of the contact acts."""

    element: int
    xi: float
    share: float
    engagement: float = 1.0

    @property
    def powers(self) -> FloatArray:
        """Return [1, xi, xi^2, xi^3]."""
        return np.array([1.0, self.xi, self.xi**2, self.xi**3])


class ContactWire:
    """Contact wire of one section.

    Parameters
    ----------
    chain : Chain
        Its nodes.
    static : StaticState
    free_index : ndarray, shape (6 n,)
        Position of a degree of freedom among the free ones, -1 if it is held.
    angles : ndarray, shape (n,)
        Direction of the nodal axes in plan [rad].
    """

    def __init__(self, chain: Chain, static: StaticState, free_index: IntArray, angles: FloatArray) -> None:
        self._static_xy = static.positions[chain.nodes, :2]
        self._xy_dofs = free_index[chain.nodes[:, None] * NODE_DOFS + np.arange(2)]
        self._axes = [(math.cos(a), math.sin(a)) for a in angles[chain.nodes]]
        self.elements = _elements(chain, static, free_index, angles)
        self._starts = self._static_xy[:, 0].tolist()

    @property
    def ends(self) -> tuple[float, float]:
        """Return where the wire begins and ends along the track [m]."""
        return self._starts[0], self._starts[-1]

    def locate(self, x: float) -> tuple[int, float]:
        """Return the element at a position of the track and the share of the way along it, in the static shape."""
        element = self._start(-1, x)
        start, end = self._starts[element : element + 2]
        return element, (x - start) / (end - start)

    def find(self, strip: FloatArray, displacement: FloatArray, guess: int) -> Crossing | None:
        """Find where a strip crosses the wire, walking from the element ``guess``.

        Parameters
        ----------
        strip : ndarray, shape (2, 2, 3)
            Ends A and B; position and velocity.
        displacement : ndarray, shape (n_free,)
            Displacement of the line from its static shape.

        Returns
        -------
        Crossing or None
            None beyond the wire's ends, or where the wire passes beside the strip.
        """
        element = self._start(guess, float(strip[0, 0, 0] + strip[1, 0, 0]) / 2.0)
        last = len(self.elements) - 1
        direction = 0
        while True:
            found = crossing(
                strip[0, 0], strip[1, 0], self._plan(element, displacement), self._plan(element + 1, displacement)
            )
            if found is None:
                return None
            share, xi = found
            step = -1 if xi < 0.0 else (1 if xi > 1.0 else 0)
            if step == 0 or step == -direction:
                return self._crossing(strip, element, min(max(xi, 0.0), 1.0), share) if 0.0 <= share <= 1.0 else None
            direction = step
            element += step
            if not 0 <= element <= last:
                return None

    def plan(self, found: Crossing, displacement: FloatArray) -> tuple[float, float]:
        """Return the crossing's position in plan [m]."""
        (x1, y1), (x2, y2) = (self._plan(found.element + k, displacement) for k in (0, 1))
        return x1 + found.xi * (x2 - x1), y1 + found.xi * (y2 - y1)

    def _crossing(self, strip: FloatArray, element: int, xi: float, share: float) -> Crossing:
        length = math.dist(strip[0, 0, :2].tolist(), strip[1, 0, :2].tolist())
        start, end = self._starts[element : element + 2]
        x = start + xi * (end - start)
        from_wire_end = min(x - self._starts[0], self._starts[-1] - x)
        return Crossing(element, xi, share, engagement(min(share, 1.0 - share) * length, from_wire_end))

    def _start(self, guess: int, x: float) -> int:
        """Return where to begin walking; a guess that is far off (first step, reset) is replaced by a search."""
        if 0 <= guess < len(self.elements) and abs(self._starts[guess] - x) < 5.0:
            return guess
        found = int(np.searchsorted(self._starts, x)) - 1
        return min(max(found, 0), len(self.elements) - 1)

    def _plan(self, node: int, displacement: FloatArray) -> tuple[float, float]:
        x, y = self._static_xy[node]
        i, j = self._xy_dofs[node]
        u = float(displacement[i]) if i >= 0 else 0.0
        v = float(displacement[j]) if j >= 0 else 0.0
        cosine, sine = self._axes[node]
        return float(x) + cosine * u - sine * v, float(y) + sine * u + cosine * v


def _elements(
    chain: Chain, static: StaticState, free_index: IntArray, angles: FloatArray
) -> tuple[WireElement, ...]:
    pairs = np.stack([chain.nodes[:-1], chain.nodes[1:]], axis=1)
    axes, length = frames(static.points[pairs[:, 0]], static.points[pairs[:, 1]])
    dofs = element_dofs(pairs)
    return tuple(
        _element(static, pair, dofs[i], free_index, axes[i], float(length[i]), angles[pair])
        for i, pair in enumerate(pairs)
    )


def _element(
    static: StaticState,
    pair: IntArray,
    dofs: IntArray,
    free_index: IntArray,
    axes: FloatArray,
    length: float,
    angles: FloatArray,
) -> WireElement:
    rows = hermite_rows(axes, length)
    z = static.points[pair, 2]
    local = static.displacement[dofs].copy()
    # The static rotations count from a horizontal wire; the chord's own slope is in the reference height.
    local[[4, 10]] += axes[0, 2]
    local[[5, 11]] -= axes[0, 1]
    height = rows @ local
    height[:2] += z[0], z[1] - z[0]
    rows = rows @ plan_rotation(angles)
    inside = free_index[dofs] >= 0
    return WireElement(free_index[dofs][inside], np.ascontiguousarray(rows[:, inside]), height)
