"""Strips continued within a step, and resultants handed out, for numba; see `strip_exchange.StripExchange`.

The same figures to the last bit: nothing is reordered. This module imports nothing of the project: it is compiled from
a copy in the user's cache, which cannot see other files.
"""

import math

from numba import njit

#: Of a strip: when its values are valid, then positions, velocities and accelerations of its ends.
WIDTH = 19
_POSITION, _VELOCITY, _ACCELERATION = 1, 7, 13
#: As in `models.numerics.extrapolation`.
_STAMP_TOLERANCE = 0.25
_LEAST_TRAVEL = 1e-9

#: What is called from Python, and what by other kernels alone: nothing is made for Python then, which takes long.
_compiled = njit(cache=True, error_model="numpy")
_part = njit(  # type: ignore[call-overload]
    error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True
)


@_compiled
def receive(known, order, start, step, strips, end, out):
    """Take strips for a step that begins at ``start``, and write those at ``end`` into ``out``.

    Parameters
    ----------
    known : ndarray, shape (P, 19)
        What is known of the strips, replaced.
    order : int
    start, step, end : float
        [s]
    strips, out : ndarray, shape (P, 2, 2, 3)
    """
    for p in range(strips.shape[0]):
        own = known[p]
        speed, x = strips[p, 0, 1, 0], strips[p, 0, 0, 0]
        expected, travel, holds = own[_POSITION] + speed * (start - own[0]), speed * step, start
        if abs(travel) >= _LEAST_TRAVEL and abs((x - expected) / travel - 1.0) < _STAMP_TOLERANCE:
            holds = start + step
        elapsed, is_later = holds - own[0], order >= 2 and holds > own[0] + 1e-12
        for side in range(2):
            for axis in range(3):
                i, velocity = 3 * side + axis, strips[p, side, 1, axis]
                if is_later:
                    own[_ACCELERATION + i] = (velocity - own[_VELOCITY + i]) / elapsed
                own[_POSITION + i], own[_VELOCITY + i] = strips[p, side, 0, axis], velocity
        own[0] = holds
    at(known, order, end, out)


@_compiled
def at(known, order, time, out):
    """Write the strips at ``time`` into ``out``, shape (P, 2, 2, 3)."""
    for p in range(out.shape[0]):
        own = known[p]
        tau = time - own[0] if order >= 1 else 0.0
        half = 0.5 * (tau * tau)
        for side in range(2):
            for axis in range(3):
                i = 3 * side + axis
                position, velocity = own[_POSITION + i], own[_VELOCITY + i]
                if tau != 0.0:
                    acceleration = own[_ACCELERATION + i]
                    position = position + tau * velocity + half * acceleration
                    velocity = velocity + tau * acceleration
                out[p, side, 0, axis], out[p, side, 1, axis] = position, velocity


@_compiled
def publish(force, point, strips, attached, places, outputs):
    """Write resultants, their points, forces per wire where there are several, and uplifts one after the other.

    Parameters
    ----------
    force, point : ndarray, shape (P, S), (P, S, 3)
        Of a `ContactResult`.
    strips : ndarray, shape (P, 2, 2, 3)
    attached : ndarray, shape (2, n_attached)
        Motion of the attachments.
    places : ndarray of int, shape (n_supports,)
        Which of them are the rises of the contact wire at the supports.
    outputs : ndarray
        Result; see `strip_exchange.output_count`.
    """
    pantographs, sections = force.shape
    for p in range(pantographs):
        total = 0.0
        for s in range(sections):
            total += force[p, s]
        outputs[p] = total
        _apply(force[p], point[p], strips[p], total, outputs[pantographs + 3 * p : pantographs + 3 * p + 3])
    first = 4 * pantographs
    if sections > 1:
        for p in range(pantographs):
            for s in range(sections):
                outputs[first + s] = force[p, s]
            first += sections
    for i in range(places.size):
        outputs[first + i] = attached[0, places[i]]


@_part
def _apply(force, point, strip, total, place):
    """Write where the resultant on a strip acts into ``place``, as `models.contact_law.application_point` says."""
    place[:] = 0.0
    for s in range(force.size):
        if total > 0.0:
            if force[s] > 0.0:
                for axis in range(3):
                    place[axis] += force[s] * point[s, axis]
        elif not math.isnan(point[s, 0]):
            for axis in range(3):
                place[axis] = point[s, axis]
            return
    for axis in range(3):
        if total > 0.0:
            place[axis] /= total
        else:
            place[axis] = (strip[0, 0, axis] + strip[1, 0, axis]) / 2.0
