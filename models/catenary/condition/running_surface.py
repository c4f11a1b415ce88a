"""The running surface r(x): how high the underside of a contact wire stands above its static shape.

It is a sum of pieces, each with one cause (a measured profile, a generated surface, a fault), and each a curve of
cubics between knots, level beyond them: height and slope are continuous, so that a contact meets no jump.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.catenary.condition.faults import active_of
from models.catenary.definition.fault_definition import HardPoint, Wear
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.section_definition import Section
from models.catenary.definition.surface_definition import RunningSurface as Surface
from models.numerics.random_numbers import uniform_numbers

#: Length over which the underside rises from a new wire to a worn one [m].
_RAMP: Final = 1.0
#: Stream of random numbers, beside those of `irregularities`; never renumber it.
_STREAM: Final = 5
#: Waves of a generated surface, and knots in its shortest one: cubics between these are off by 4e-6 of its amplitude.
_WAVES: Final = 1024
_KNOTS: Final = 32
#: Knots that are computed at a time, and decimals that are kept: the last bits differ from one library to the next.
_BLOCK: Final = 512
_DECIMALS: Final = 12


@dataclass(frozen=True, eq=False)
class SurfacePiece:
    """A part of a running surface: a curve of cubics through knots.

    Attributes
    ----------
    position : ndarray, shape (n,)
        Of the knots along the track, rising; at least 2 [m].
    height : ndarray, shape (n,)
        r, positive up; beyond the knots the first and the last go on [m].
    slope : ndarray, shape (n,)
        dr/dx; 0 at the ends where nothing shall jump.
    """

    position: FloatArray
    height: FloatArray
    slope: FloatArray

    @classmethod
    def through(cls, position: FloatArray, height: FloatArray) -> SurfacePiece:
        """Return a curve through points.

        Its slope is that between the neighbours of a point: a kink bulges into a long interval beside it by 4/27 of
        its height at most, and between points that are close to a wave's length h/lambda the wave loses
        3/128 (2 pi h/lambda)^4 of its amplitude.
        """
        slope = np.zeros(len(position))
        slope[1:-1] = (height[2:] - height[:-2]) / (position[2:] - position[:-2])
        return cls(position, height, slope)

    @classmethod
    def bump(cls, position: float, length: float, height: float) -> SurfacePiece:
        """Return a rise to ``height`` at ``position`` and back, within ``length``; level at ends and top [m]."""
        half = 0.5 * length
        return cls(np.array([position - half, position, position + half]), np.array([0.0, height, 0.0]), np.zeros(3))

    @classmethod
    def raised(cls, start: float, end: float, height: float, ramp: float) -> SurfacePiece:
        """Return a piece that stands ``height`` higher between two places, with ramps inside these [m]."""
        ramp = min(ramp, 0.5 * (end - start))
        position = np.array([start, start + ramp, end - ramp, end])
        if position[1] == position[2]:
            return cls(position[[0, 1, 3]], np.array([0.0, height, 0.0]), np.zeros(3))
        return cls(position, np.array([0.0, height, height, 0.0]), np.zeros(4))

    def at(self, x: float) -> tuple[float, float]:
        """Return height [m] and slope at a place along the track [m]."""
        position, last = self.position, len(self.position) - 1
        if x < position[0]:
            return float(self.height[0]), 0.0
        if x >= position[last]:
            return float(self.height[last]), 0.0
        k = bisect_right(position, x) - 1
        h = float(position[k + 1] - position[k])
        t, d = (x - float(position[k])) / h, float(self.height[k + 1] - self.height[k])
        a, b = h * float(self.slope[k]) - d, d - h * float(self.slope[k + 1])
        height = float(self.height[k]) + t * (d + (1.0 - t) * (a * (1.0 - t) + b * t))
        return height, (d + (1.0 - 2.0 * t) * (a * (1.0 - t) + b * t) + t * (1.0 - t) * (b - a)) / h


@dataclass(frozen=True, eq=False)
class RunningSurface:
    """The running surface of one contact wire, the sum of its pieces.

    Attributes
    ----------
    pieces : tuple of SurfacePiece
    start, period : float
        Of a line that closes on itself: where its first lap begins, and its length [m]; else ``period`` is 0.
    """

    pieces: tuple[SurfacePiece, ...]
    start: float = 0.0
    period: float = 0.0

    def at(self, x: float) -> tuple[float, float]:
        """Return height [m] and slope at a place along the track [m]."""
        if self.period:
            x -= math.floor((x - self.start) / self.period) * self.period
        height = slope = 0.0
        for piece in self.pieces:
            own = piece.at(x)
            height, slope = height + own[0], slope + own[1]
        return height, slope

    def whole(self) -> SurfacePiece:
        """Return the sum as one piece, over the knots of all: between these a sum of cubics is a cubic, too."""
        if len(self.pieces) == 1:
            return self.pieces[0]
        knots = np.unique(np.concatenate([piece.position for piece in self.pieces]))
        sums = np.array([np.sum([piece.at(x) for piece in self.pieces], axis=0) for x in knots.tolist()])
        return SurfacePiece(knots, sums[:, 0], sums[:, 1])

    def height(self, x: float) -> float:
        """Return r(x) [m]."""
        return self.at(x)[0]

    def slope(self, x: float) -> float:
        """Return dr/dx."""
        return self.at(x)[1]


def running_surfaces(definition: CatenaryDefinition) -> tuple[RunningSurface | None, ...]:
    """Return the running surface of every section's contact wire, None where there is none."""
    found = []
    for number, section in enumerate(definition.sections):
        pieces = tuple(_pieces(definition, number, section))
        start = section.spans[0].start
        found.append(RunningSurface(pieces, start, section.period) if pieces else None)
    return tuple(found)


def _pieces(definition: CatenaryDefinition, number: int, section: Section) -> Iterator[SurfacePiece]:
    """Yield what the running surface of a section, counted from 0, is made of."""
    surface = definition.running_surface
    if surface is not None and surface.points:
        yield SurfacePiece.through(*np.array(surface.points).T)
    if surface is not None and surface.sigma:
        yield _generated(surface, number, section)
    for lap in (-section.period, 0.0, section.period) if section.periodic else (0.0,):
        yield from _of_faults(definition, number, lap)


def _of_faults(definition: CatenaryDefinition, number: int, lap: float) -> Iterator[SurfacePiece]:
    """Yield what faults do to the underside of the wire of a section, counted from 0, in some lap [m]."""
    for worn in active_of(definition, Wear):
        if worn.section - 1 == number and worn.lost_thickness:
            yield SurfacePiece.raised(worn.from_ + lap, worn.to + lap, worn.lost_thickness, _RAMP)
    for point in active_of(definition, HardPoint):
        if point.section - 1 == number and point.height and point.length:
            yield SurfacePiece.bump(point.position + lap, point.length, point.height)


def spectrum(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Return wavenumbers [1/m] and amplitudes [m] of a generated surface, S(k) = A k^-w, shape (1024,) each.

    A follows from sigma: sigma^2 is the integral of the one-sided S over the band. Every wave stands for a part of the
    band, and has the wavenumber of its middle.
    """
    assert surface.sigma is not None
    assert surface.exponent is not None
    assert surface.from_ is not None
    assert surface.to is not None
    low, high, power = surface.from_, surface.to, 1.0 - surface.exponent
    band = math.log(high / low) if power == 0.0 else (high**power - low**power) / power
    width = (high - low) / _WAVES
    k = low + width * (np.arange(_WAVES, dtype=np.float64) + 0.5)
    amplitude: FloatArray = math.sqrt(2.0 * surface.sigma**2 / band * width) * np.power(k, -0.5 * surface.exponent)
    return k, amplitude


def _generated(surface: Surface, number: int, section: Section) -> SurfacePiece:
    """Return a generated surface; each section draws its own phases, and in a ring whole waves go round."""
    assert surface.seed is not None
    assert surface.to is not None
    k, amplitude = spectrum(surface)
    start, end = _extent(section)
    if section.period:
        k = np.maximum(np.round(k * section.period), 1.0) / section.period
    phases = 2.0 * np.pi * uniform_numbers(surface.seed, _STREAM, (number + 1) * _WAVES)[number * _WAVES :]
    count = math.ceil((end - start) * surface.to * _KNOTS) + 1
    position = np.linspace(start, end, count)
    height, slope = _waves(position, k, amplitude, phases)
    return SurfacePiece(position, height, slope)


def _waves(x: FloatArray, k: FloatArray, amplitude: FloatArray, phase: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the sum of waves and its slope at places of even distance.

    Waves at the beginning of every block of places times waves from there on: a product of matrices in place of as many
    cosines as there are waves and places.
    """
    turn, begins = 2.0 * np.pi * k, x[::_BLOCK]
    first = amplitude * np.exp(1j * (np.outer(begins, turn) + phase))
    on = np.exp(1j * np.outer(turn, x[:_BLOCK] - x[0]))
    height, slope = (first @ on).real.ravel(), (first @ (1j * turn[:, None] * on)).real.ravel()
    return height[: len(x)].round(_DECIMALS), slope[: len(x)].round(_DECIMALS)


def _extent(section: Section) -> tuple[float, float]:
    """Return where a section's wire begins and ends along the track [m]."""
    if section.period:
        return section.spans[0].start, section.spans[-1].end
    return section.ends.anchors
