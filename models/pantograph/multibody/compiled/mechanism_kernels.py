"""A mechanism's equations of motion and its integrator's steps for numba; see `mechanism` and `mechanism_integrator`.

The joints' loads follow as there, from (Phi_q M^-1 Phi_q^T) lambda = Phi_q M^-1 g - rhs; but a row of Phi_q is kept as
its blocks for two bodies, and the matrix, symmetric and positive, is factored by Cholesky. ``numbers`` and ``layout``
are the tables of `mechanism_tables`, ``u`` the inputs as `mechanism_inputs.flat` has them.
"""

from math import sqrt

import numpy as np
from numba import njit

from models.pantograph.multibody.compiled.element_kernels import (
    add_air,
    add_angle_stops,
    add_bushings,
    add_friction,
    add_lines,
    add_moments,
    add_slides,
    carry_bodies,
    crossed,
    dot,
    frames_of,
    lift_of,
    rotation,
    spun,
    touch,
    turn,
    vectors_of,
)

#: For what is called from Python, and for what other kernels alone call.
_compiled = njit(cache=True, error_model="numpy")
_inside = njit(  # type: ignore[call-overload]
    error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True
)
#: Tables, in the order of `mechanism_tables.TABLES`.
(
    _BODIES, _BASE, _VECTORS, _GAPS, _LEVERS, _CROSSES, _ROWS, _LINES, _SLIDES, _MOMENTS, _STOPS, _FRICTIONS, _BUSHINGS,
    _AIR, _LIFTING, _OWN, _PER_LIFT, _PER_FORCE, _STRIP,
) = range(19)  # fmt: skip
#: As in `mechanism`.
_BAUMGARTE = 50.0


@_inside
def table(numbers, place):
    """Return a table, shape (elements, numbers of each)."""
    begin, rows, columns = place
    return numbers[begin : begin + rows * columns].reshape((rows, columns))


@_inside
def loads_of(numbers, layout, y, u, frames, origins, values, crosses):
    """Return all loads on the bodies, shape (n, 6), without gyroscopic moments; see `Mechanism.loads`."""
    bodies, strip = table(numbers, layout[_BODIES]), table(numbers, layout[_STRIP])
    n, driven = len(bodies), layout[_BASE, 1]
    loads = np.zeros((n, 6))
    w = y[10 * n :].reshape((n, 3))
    own, per_lift = table(numbers, layout[_OWN]), table(numbers, layout[_PER_LIFT])
    per_force = table(numbers, layout[_PER_FORCE])
    lift = lift_of(table(numbers, layout[_LIFTING]), own, per_lift, per_force, u, frames, origins)
    add_lines(table(numbers, layout[_LINES]), values, crosses, lift, loads)
    add_moments(table(numbers, layout[_MOMENTS]), values, lift, loads)
    add_slides(table(numbers, layout[_SLIDES]), values, crosses, loads)
    add_angle_stops(table(numbers, layout[_STOPS]), frames, w, loads)
    add_friction(table(numbers, layout[_FRICTIONS]), frames, w, loads)
    add_bushings(table(numbers, layout[_BUSHINGS]), frames, origins, w, loads)
    if u[8] != 0.0:
        add_air(table(numbers, layout[_AIR]), frames, u[8], loads)
    for k in range(n):
        loads[k, 2] += bodies[k, 8]
    for k in range(driven, n):
        loads[k, 0] -= u[7] * bodies[k, 7]
    if u[4] != 0.0:
        k = int(strip[0, 0])
        contact = np.empty(3)
        touch(strip[0], y, n, frames[k], u[4], u[5], contact)
        for c in range(3):
            loads[k, 2 + c] += contact[c]
    return loads


@_inside
def scale(bodies, frames, k, values, out):
    """Write six global components of a body's load, or of its columns in Phi_q, in scaled body coordinates."""
    A = frames[k]
    for c in range(3):
        out[c] = values[c] * bodies[k, 0]
        out[3 + c] = (values[3] * A[0, c] + values[4] * A[1, c] + values[5] * A[2, c]) * bodies[k, 1 + c]


@_inside
def constrain(rows, values, crosses, jacobian, found):
    """Write Phi_q, shape (m, n, 6), which is 0 before, and violations, rates and gamma, shape (3, m).

    See `joints.Constraints.evaluate`.
    """
    flat = values.reshape(values.size)
    for r in range(len(rows)):
        row = rows[r]
        x, y, at_from, at_to = int(row[1]), int(row[2]), int(row[5]), int(row[6])
        a, b = 9 * x, 9 * y
        found[0, r] = dot(flat, a, b)
        found[1, r] = dot(flat, a, b + 3) + dot(flat, a + 3, b)
        found[2, r] = -(dot(flat, a, b + 6) + dot(flat, a + 6, b) + 2.0 * dot(flat, a + 3, b + 3))
        start, to = int(row[3]), int(row[4])
        for c in range(3):
            along = row[0] * values[x, c]  # 1 of a gap, 0 of axes
            jacobian[r, start, c], jacobian[r, to, c] = -along, along
            jacobian[r, start, 3 + c], jacobian[r, to, 3 + c] = crosses[at_from, c], crosses[at_to, c]


@_inside
def schur_factor(rows, scaled, driven):
    """Return the lower Cholesky factor of J J^T and whether there is one; J has blocks, shape (m, 2, 6)."""
    m = len(rows)
    L = np.zeros((m, m))
    for r in range(m):
        for s in range(r + 1):
            total = 0.0
            for a in range(2):
                body = rows[r, 3 + a]
                if body < driven:
                    continue
                for b in range(2):
                    if rows[s, 3 + b] == body:
                        for c in range(6):
                            total += scaled[r, a, c] * scaled[s, b, c]
            L[r, s] = total
    for r in range(m):
        for s in range(r + 1):
            total = L[r, s]
            for c in range(s):
                total -= L[r, c] * L[s, c]
            if s < r:
                L[r, s] = total * L[s, s]
            elif total > 0.0:
                L[r, r] = 1.0 / sqrt(total)
            else:
                return L, False
    return L, True


@_inside
def solve(L, right):
    """Replace the columns of right sides, shape (m, k), by solutions; the factor has the inverse of its diagonal."""
    m, k = right.shape
    for r in range(m):
        for c in range(k):
            total = right[r, c]
            for s in range(r):
                total -= L[r, s] * right[s, c]
            right[r, c] = total * L[r, r]
    for r in range(m - 1, -1, -1):
        for c in range(k):
            total = right[r, c]
            for s in range(r + 1, m):
                total -= L[s, r] * right[s, c]
            right[r, c] = total * L[r, r]


@_inside
def place_rates(y, n, out):
    """Write the time derivatives of positions and Euler parameters, the first 7 n; see `rotations.euler_rates`."""
    for i in range(3 * n):
        out[i] = y[7 * n + i]
    for k in range(n):
        p, w, q = 3 * n + 4 * k, 10 * n + 3 * k, 3 * n + 4 * k
        a, e0, e1, e2 = y[p], y[p + 1], y[p + 2], y[p + 3]
        x, s, z = y[w], y[w + 1], y[w + 2]
        out[q] = -0.5 * (e0 * x + e1 * s + e2 * z)
        out[q + 1] = 0.5 * (a * x + e1 * z - e2 * s)
        out[q + 2] = 0.5 * (a * s + e2 * x - e0 * z)
        out[q + 3] = 0.5 * (a * z + e0 * s - e1 * x)


@_inside
def rates_of(y, acceleration, out):
    """Write the time derivative of a state."""
    n = len(acceleration)
    place_rates(y, n, out)
    for k in range(n):
        for c in range(3):
            out[7 * n + 3 * k + c] = acceleration[k, c]
            out[10 * n + 3 * k + c] = acceleration[k, 3 + c]


@_compiled
def evaluate(numbers, layout, y, u, respond, rates, acceleration, response, found, multipliers, jacobian):
    """Evaluate the equations of motion; return whether there is an answer; see `Mechanism.evaluate`.

    Parameters
    ----------
    y : ndarray, shape (13 n,)
        State; the bodies of prescribed motion are put in place in it.
    respond : bool
        Whether to work out the response, too.
    rates, acceleration, response : ndarray, shape (13 n,), (n, 6), (n, 6, 4)
        Result; the response only if it is wanted.
    found : ndarray, shape (3, m)
        Result: violations, their rates, gamma.
    multipliers : ndarray, shape (m,)
        Result.
    jacobian : ndarray, shape (m, n, 6)
        Result; 0 before.
    """
    bodies, base, rows = table(numbers, layout[_BODIES]), table(numbers, layout[_BASE]), table(numbers, layout[_ROWS])
    n, m, driven = len(bodies), len(rows), len(base)
    known, frames, origins = np.empty((driven, 6)), np.empty((n, 9, 3)), np.empty((n, 9))
    carry_bodies(base, y, u, n, known)
    frames_of(y, n, known, frames, origins)
    gaps, levers = table(numbers, layout[_GAPS]), table(numbers, layout[_LEVERS])
    values = vectors_of(table(numbers, layout[_VECTORS]), gaps, levers, frames, origins)
    pairs = table(numbers, layout[_CROSSES])
    crosses = np.empty((len(pairs), 3))
    for k in range(len(pairs)):
        crossed(values[int(pairs[k, 0])], values[int(pairs[k, 1])], crosses[k])
    constrain(rows, values, crosses, jacobian, found)
    loads = loads_of(numbers, layout, y, u, frames, origins, values, crosses)
    forces, gyroscopic, momentum = np.empty((n, 6)), np.empty(3), np.empty(3)
    for k in range(n):
        scale(bodies, frames, k, loads[k], forces[k])
        at = 10 * n + 3 * k
        for c in range(3):
            momentum[c] = bodies[k, 4 + c] * y[at + c]
        crossed(y[at : at + 3], momentum, gyroscopic)
        for c in range(3):
            forces[k, 3 + c] -= bodies[k, 1 + c] * gyroscopic[c]
    scaled, columns = np.empty((m, 2, 6)), 5 if respond else 1
    units, right = np.zeros((3, 6)), np.zeros((m, columns))
    strip = int(table(numbers, layout[_STRIP])[0, 0])
    if respond and strip >= 0:
        one = np.zeros(6)
        for k in range(3):
            one[2 + k] = 1.0
            scale(bodies, frames, strip, one, units[k])
            one[2 + k] = 0.0
    for r in range(m):
        total = 0.0
        for a in range(2):
            body = int(rows[r, 3 + a])
            scale(bodies, frames, body, jacobian[r, body], scaled[r, a])
            for c in range(6):
                total += scaled[r, a, c] * forces[body, c]
            if not respond:
                continue
            if body < driven:
                right[r, 4] += jacobian[r, body, 2]
            if body == strip:
                for k in range(3):
                    for c in range(6):
                        right[r, 1 + k] += scaled[r, a, c] * units[k, c]
        right[r, 0] = total - (found[2, r] - 2.0 * _BAUMGARTE * found[1, r] - _BAUMGARTE * _BAUMGARTE * found[0, r])
    L, is_regular = schur_factor(rows, scaled, driven)
    if not is_regular:
        return False
    solve(L, right)
    if respond:
        for k in range(n):
            for c in range(6):
                for i in range(4):
                    response[k, c, i] = units[i, c] if k == strip and i < 3 else 0.0
    for r in range(m):
        multipliers[r] = right[r, 0]
        for a in range(2):
            body = int(rows[r, 3 + a])
            for c in range(6):
                forces[body, c] -= scaled[r, a, c] * right[r, 0]
                if respond:
                    for k in range(4):
                        response[body, c, k] -= scaled[r, a, c] * right[r, 1 + k]
    for k in range(n):
        for c in range(6):
            root = bodies[k, 0] if c < 3 else bodies[k, c - 2]
            acceleration[k, c] = known[k, c] if k < driven else forces[k, c] * root
            if respond:
                for i in range(4):
                    response[k, c, i] *= root
        if respond and k < driven:
            response[k, 2, 3] = 1.0
    rates_of(y, acceleration, rates)
    return True


@_compiled
def half_way(y, first, before, begin, h, half, moving):
    """Write the state half-way through a step that continues one; ``moving`` is work space.

    See `PlainSteps.continued`.
    """
    n = len(y) // 13
    for i in range(13 * n):
        half[i] = y[i] + (h / 24.0) * (23.0 * first[i] - 16.0 * before[i] + 5.0 * begin[i])
    place_rates(half, n, moving)
    for i in range(7 * n):
        half[i] = y[i] + (h / 48.0) * (begin[i] - 5.0 * before[i] + 19.0 * first[i] + 9.0 * moving[i])


@_compiled
def ahead(y, first, before, middle, h, predicted, moving):
    """Write the state at the end of that step as predicted."""
    n = len(y) // 13
    for i in range(13 * n):
        predicted[i] = y[i] + (h / 6.0) * (before[i] - 2.0 * first[i] + 7.0 * middle[i])
    place_rates(predicted, n, moving)
    for i in range(7 * n):
        predicted[i] = y[i] + (h / 6.0) * (first[i] + 4.0 * middle[i] + moving[i])


@_compiled
def corrected(y, first, middle, last, h, scale, half, predicted, new, moving):
    """Write the state at the end of that step; return by how much it differs from the one predicted.

    Velocities are divided by ``scale`` for that; those half-way are replaced.
    """
    n = len(y) // 13
    error = 0.0
    for i in range(13 * n):
        new[i] = y[i] + (h / 6.0) * (first[i] + 4.0 * middle[i] + last[i])
        size = abs(new[i] - predicted[i])
        if i >= 7 * n:
            size /= scale
            half[i] = y[i] + (h / 24.0) * (5.0 * first[i] + 8.0 * middle[i] - last[i])
        if size > error or size != size:  # not a number stays so
            error = size
    place_rates(half, n, moving)
    for i in range(7 * n):
        half[i] = first[i] + 4.0 * moving[i]
    place_rates(new, n, moving)
    for i in range(7 * n):
        new[i] = y[i] + (h / 6.0) * (half[i] + moving[i])
    return error


@_compiled
def changed(numbers, layout, y, acceleration, response, old, u, rates, difference):
    """Write the rates of a state under another contact or base acceleration; see `Mechanism.with_inputs`."""
    n, strip = len(acceleration), table(numbers, layout[_STRIP])[0]
    A, one, other = np.empty((3, 3)), np.empty(3), np.empty(3)
    k = int(strip[0])
    rotation(y[3 * n + 4 * k : 3 * n + 4 * k + 4], A)
    touch(strip, y, n, A, old[4], old[5], one)
    touch(strip, y, n, A, u[4], u[5], other)
    rates_of(y, acceleration, rates)
    difference[: 7 * n] = 0.0
    for b in range(n):
        for c in range(6):
            change = response[b, c, 3] * (u[2] - old[2])
            for i in range(3):
                change += response[b, c, i] * (other[i] - one[i])
            at = 7 * n + 3 * b + c if c < 3 else 10 * n + 3 * b + c - 3
            difference[at] = change
            rates[at] += change


@_compiled
def strip_ends(numbers, layout, y, ends):
    """Write the strip's ends, shape (2, 2, 3); see `Mechanism.strip_ends`."""
    n, strip = layout[_BODIES, 1], table(numbers, layout[_STRIP])[0]
    k = int(strip[0])
    A, spin, end = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    rotation(y[3 * n + 4 * k : 3 * n + 4 * k + 4], A)
    spun(A, y[10 * n + 3 * k : 10 * n + 3 * k + 3], spin)
    for i in range(2):
        side = strip[2] + (0.5 - i) * strip[4]
        turn(A, strip[1], side, strip[3], end)
        for c in range(3):
            ends[i, 0, c] = y[3 * k + c] + end[c]
        turn(spin, strip[1], side, strip[3], end)
        for c in range(3):
            ends[i, 1, c] = y[7 * n + 3 * k + c] + end[c]


@_compiled
def has_strayed(y, violation, rate, places, speeds):
    """Return whether a state is to be projected for its violations and their rates, shape (m,); see `Equations`.

    Parameters
    ----------
    places, speeds : float
        The limits.
    """
    n = len(y) // 13
    for r in range(len(rate)):
        if not (abs(violation[r]) <= places and abs(rate[r]) <= speeds):
            return True
    for k in range(3 * n, 7 * n, 4):
        length = y[k] * y[k] + y[k + 1] * y[k + 1] + y[k + 2] * y[k + 2] + y[k + 3] * y[k + 3]
        if not abs(length - 1.0) <= places:
            return True
    return False
