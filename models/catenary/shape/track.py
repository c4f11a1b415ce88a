"""The track as wires feel it: curvature, cant and their changes as loads on tensioned wires and on weights.

Along a track x is the length of its axis; y and z lie in the cross-section and turn with the rail plane. A wire that is
straight in space is not so in these coordinates: under the tension T it feels, besides T y'' and T z'', per length

    f_y = T [ kappa cos d - kappa_v sin d + z d'' + 2 d' z' - y d'^2 ] + m g sin d
    f_z = T [ kappa sin d + kappa_v cos d - y d'' - 2 d' y' - z d'^2 ] - m g cos d

with the angle of cant d, sin d = D / base. This follows from twice differentiating the place of a point of the wire,
y e_y + z e_z, in a frame that turns with kappa about the vertical, kappa_v about the horizontal and d about the axis.
Where ramps of cant begin and end, d' jumps, and T d'' is a force T (d'_after - d'_before) at a point.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from models.arrays import FloatArray, IntArray
from models.catenary.definition.line_definition import GRAVITY
from models.catenary.definition.track_definition import SAME_PLACE, Track
from models.catenary.shape.beam_elements import NODE_DOFS, point_loads
from models.numerics.gauss_points import gauss_points

#: Points of Gauss-Legendre integration in an element, or in its part between knots of the track.
_POINTS, _WEIGHTS = gauss_points(3)
_XI: Final = 0.5 * (1.0 + _POINTS)
_SHARE: Final = 0.5 * _WEIGHTS


@dataclass(frozen=True)
class TrackPlace:
    """The track at some places, arrays of shape (n,).

    Attributes
    ----------
    curvature, vertical_curvature : ndarray
        kappa > 0 to the left, kappa_v > 0 hollow [1/m].
    cant : ndarray
        Angle of cant d [rad], > 0 with the right rail higher.
    twist, twist_rate : ndarray
        d' [rad/m] and d'' [rad/m2].
    """

    curvature: FloatArray
    vertical_curvature: FloatArray
    cant: FloatArray
    twist: FloatArray
    twist_rate: FloatArray


def track_at(track: Track, x: FloatArray) -> TrackPlace:
    """Return the track at places along it, shape (n,) [m]; at a knot what it is after it."""
    knots = np.array(track.positions)
    cant = np.interp(x, knots, track.cants)
    angle = np.arcsin(cant / track.base)
    slope = _slopes(track)[np.searchsorted(knots, x, side="right")] / (track.base * np.cos(angle))
    return TrackPlace(
        curvature=np.interp(x, knots, track.curvatures),
        vertical_curvature=np.interp(x, knots, track.vertical_curvatures),
        cant=angle,
        twist=slope,
        twist_rate=slope**2 * np.tan(angle),
    )


def mean_curvature(track: Track, start: float, end: float) -> float:
    """Return the mean of the curvature between two places, exact whatever knots and jumps lie between [1/m]."""
    knots, values = np.array(track.positions), np.array(track.curvatures)
    inside = (knots > start) & (knots < end)
    # A jump at an end counts with its side within: np.interp takes either.
    ends = np.array([start, end]) + np.array([1.0, -1.0]) * SAME_PLACE
    first, last = np.interp(ends, knots, values)
    x = np.concatenate([[start], knots[inside], [end]])
    kappa = np.concatenate([[first], values[inside], [last]])
    return float(0.5 * np.diff(x) @ (kappa[1:] + kappa[:-1]) / (end - start))


def _slopes(track: Track) -> FloatArray:
    """Return D' before the first knot, between the knots and after the last one, shape (n_knots + 1,)."""
    length, rise = np.diff(np.array(track.positions)), np.diff(np.array(track.cants, dtype=np.float64))
    ramps = np.divide(rise, length, out=np.zeros_like(rise), where=length > SAME_PLACE)
    return np.concatenate([[0.0], ramps, [0.0]])


def twist_jumps(track: Track) -> FloatArray:
    """Return by how much d' jumps at every knot, shape (n_knots,) [rad/m]."""
    cosine = np.cos(np.arcsin(np.array(track.cants) / track.base))
    return np.diff(_slopes(track)) / (track.base * cosine)


def curve_force(
    place: TrackPlace, y: FloatArray, z: FloatArray, y_slope: FloatArray | float, z_slope: FloatArray | float
) -> FloatArray:
    """Return what a wire feels per length and tension, f / T without weight, shape (n, 2): y, z [1/m].

    Parameters
    ----------
    y, z : ndarray, shape (n,)
        Where it is in the cross-section [m].
    y_slope, z_slope : ndarray, shape (n,), or float
        y' and z'.
    """
    sine, cosine = np.sin(place.cant), np.cos(place.cant)
    turn, bend = place.twist, place.twist_rate
    return np.stack(
        [
            place.curvature * cosine - place.vertical_curvature * sine + z * bend + 2.0 * turn * z_slope - y * turn**2,
            place.curvature * sine + place.vertical_curvature * cosine - y * bend - 2.0 * turn * y_slope - z * turn**2,
        ],
        axis=1,
    )


def acceleration(track: Track, x: FloatArray) -> FloatArray:
    """Return gravity in the rail plane's axes at places along the track, shape (n, 3) [m/s2]."""
    angle = track_at(track, x).cant
    return GRAVITY * np.stack([np.zeros_like(x), np.sin(angle), -np.cos(angle)], axis=1)


def curve_load(track: Track, points: FloatArray, axes: FloatArray, tension: FloatArray) -> FloatArray:
    """Return the consistent nodal loads of tensioned elements on a curved, canted track, shape (n, 12) [N, N m].

    Parameters
    ----------
    points : ndarray, shape (n, 2, 3)
        Both ends of every element [m].
    axes : ndarray, shape (n, 3, 3)
        Local axes of the elements.
    tension : ndarray, shape (n,)
        [N].
    """
    element, begin, end = _pieces(track, points[:, :, 0])
    result = np.zeros((len(points), 2 * NODE_DOFS))
    for xi, share in zip(_XI, _SHARE, strict=True):
        at = begin + xi * (end - begin)
        x, y, z, slopes = _along(points[element], at)
        force = np.zeros((len(element), 3))
        force[:, 1:] = curve_force(track_at(track, x), y, z, *slopes)
        length = (end - begin) * (points[element, 1, 0] - points[element, 0, 0])
        force *= (share * length * tension[element])[:, None]
        np.add.at(result, element, point_loads(points[element], axes[element], at, force))
    element, at, jump = _twists(track, points[:, :, 0])
    _, y, z, _ = _along(points[element], at)
    force = (tension[element] * jump)[:, None] * np.stack([np.zeros_like(y), z, -y], axis=1)
    np.add.at(result, element, point_loads(points[element], axes[element], at, force))
    return result


def _along(points: FloatArray, xi: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return x, y, z at shares ``xi`` of elements, and y', z' of these, shape (2, n)."""
    along = points[:, 1] - points[:, 0]
    x, y, z = (points[:, 0] + xi[:, None] * along).T
    return x, y, z, along[:, 1:].T / along[:, 0]


def _pieces(track: Track, ends: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return elements cut at the knots: which element a piece is of, and from where to where, as shares of it."""
    count = np.arange(len(ends))
    element, begin, end = [count], [np.zeros(len(ends))], [np.ones(len(ends))]
    cuts: dict[int, list[float]] = {}
    for knot in dict.fromkeys(track.positions):
        for hit in np.flatnonzero((ends[:, 0] < knot) & (knot < ends[:, 1])).tolist():
            cuts.setdefault(hit, []).append(float((knot - ends[hit, 0]) / (ends[hit, 1] - ends[hit, 0])))
    for hit, shares in cuts.items():
        end[0][hit] = shares[0]
        element.append(np.full(len(shares), hit))
        begin.append(np.array(shares))
        end.append(np.array([*shares[1:], 1.0]))
    return np.concatenate(element), np.concatenate(begin), np.concatenate(end)


def _twists(track: Track, ends: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return where in which elements d' jumps, and by how much [rad/m]."""
    found: list[tuple[int, float, float]] = []
    for knot, jump in zip(track.positions, twist_jumps(track), strict=True):
        if jump:
            hits = np.flatnonzero((ends[:, 0] <= knot) & (knot < ends[:, 1]))
            shares = (knot - ends[hits, 0]) / (ends[hits, 1] - ends[hits, 0])
            found += [(hit, share, float(jump)) for hit, share in zip(hits.tolist(), shares.tolist(), strict=True)]
    element, at, jumps = np.array(found, dtype=float).reshape(-1, 3).T
    return element.astype(np.int64), at, jumps
