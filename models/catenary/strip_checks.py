"""Reject strips that cannot be meant for a line: they start inside the wire, or miss it where it is staggered."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.definition_files.parameter import ParameterError

#: Contact force at the first instant above which a warning is given, and above which the strip is rejected [N]:
#: EN 50367 allows at most 400 N in service, and a strip pushed into the wire on purpose is there by a few centimetres.
LARGEST_USUAL: Final = 500.0
LARGEST_AT_REST: Final = 2000.0
#: A strip farther below the wire than this is not in service (an unconnected port, a lowered pantograph) [m].
_REACH: Final = 3.0


class WireAtRest(NamedTuple):
    """Static shape of one contact wire, and the stretch over which it is at its working height [m].

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Of its nodes, in the order of the track.
    working : (float, float)
    """

    points: FloatArray
    working: tuple[float, float]


def check_strips(wires: Sequence[WireAtRest], strips: FloatArray, force: FloatArray) -> None:
    """Reject strips that cannot be meant for the line.

    Parameters
    ----------
    wires : sequence of WireAtRest
    strips : ndarray, shape (P, 2, 2, 3)
        Pantograph; end A, B; position, velocity; x, y, z.
    force : ndarray, shape (P,)
        Contact forces at the first instant [N].

    Raises
    ------
    ParameterError
        For the first such strip, with a remedy.
    """
    for number, (strip, found) in enumerate(zip(strips, force.tolist(), strict=True), 1):
        text = _inside_wire(wires, strip, found, LARGEST_AT_REST) or _beside_wire(wires, strip)
        if text:
            raise ParameterError(f"the strip of pantograph {number} {text}")


def start_warning(wires: Sequence[WireAtRest], strips: FloatArray, force: FloatArray) -> str:
    """Return a sentence about the first strip that starts inside a wire, empty if none does; see `check_strips`."""
    found = zip(strips, force.tolist(), strict=True)
    texts = [_inside_wire(wires, strip, value, LARGEST_USUAL) for strip, value in found]
    return next((f"the strip of pantograph {i} {text}" for i, text in enumerate(texts, 1) if text), "")


def _inside_wire(wires: Sequence[WireAtRest], strip: FloatArray, force: float, largest: float) -> str:
    if force <= largest:
        return ""
    x, z = float(strip[:, 0, 0].mean()), float(strip[:, 0, 2].mean())
    wire = min(_heights(wires, x), default=z)
    return (
        f"stands at {z:.3f} m, {1e3 * (z - wire):.0f} mm above the contact wire at x = {x:.6g} m, and would begin with "
        f"a contact force of {force:.3g} N: lower its reference_height to {wire:.3f} m or less"
    )


def _beside_wire(wires: Sequence[WireAtRest], strip: FloatArray) -> str:
    x, z = float(strip[:, 0, 0].mean()), float(strip[:, 0, 2].mean())
    here = _heights(wires, x)
    if not here or min(here) - z > _REACH:
        return ""
    right, left = float(strip[:, 0, 1].min()), float(strip[:, 0, 1].max())
    for wire in wires:
        missed = wire.points[_missed(wire, x, right, left)]
        missed = missed[[not _is_met(wires, point, right, left) for point in missed]]
        if len(missed):
            x, y = missed[0, :2].tolist()
            return (
                f"reaches from y = {right:.3f} m to {left:.3f} m, and the contact wire lies at y = {y:.3f} m at "
                f"x = {x:.6g} m: make strip_length longer than the stagger, or mend strip_offset"
            )
    return ""


def _missed(wire: WireAtRest, x: float, right: float, left: float) -> BoolArray:
    """Return which points of a wire at its working height ahead of ``x`` lie beside the strip, shape (n,)."""
    along, across = wire.points[:, 0], wire.points[:, 1]
    ahead = (along >= max(x, wire.working[0])) & (along <= wire.working[1])
    beside: BoolArray = ahead & ((across < right) | (across > left))
    return beside


def _is_met(wires: Sequence[WireAtRest], point: FloatArray, right: float, left: float) -> bool:
    """Return whether the strip meets another wire where it misses one, as in an overlap."""
    x = float(point[0])
    return any(right <= float(np.interp(x, *w.points[:, :2].T)) <= left for w in wires if _spans(w, x))


def _heights(wires: Sequence[WireAtRest], x: float) -> list[float]:
    return [float(np.interp(x, w.points[:, 0], w.points[:, 2])) for w in wires if _spans(w, x)]


def _spans(wire: WireAtRest, x: float) -> bool:
    return bool(wire.points[0, 0] <= x <= wire.points[-1, 0])
