"""A macro step of a lumped pantograph, for numba; see `lumped_part.LumpedPantographPart.step`.

The same arithmetic; only the sums of the product with the transition matrix are in another order. This module imports
nothing of the project: it is compiled from a copy in the user's cache, which cannot see other files.
"""

from collections import namedtuple

import numpy as np
from numba import njit

#: Of the contact force: number of values known, their times, the values, latest first.
WIDTH = 7
_KNOWN, _TIME, _FORCE = 0, 1, 4
#: Of the table of stops and friction: columns, and that of the force, before that of the place.
_WIDTH, _HELD = 9, 7
#: As in `models.numerics.extrapolation`.
_STAMP_TOLERANCE = 0.25
_LEAST_TRAVEL = 1e-9
#: What does not change in a run: the order of the extrapolation, then values of the definition and of its lowest stage.
Constants = namedtuple(
    "Constants",
    (
        "order",
        "static_force",
        "balance",
        "raise_start",
        "raise_duration",
        "stiffness",
        "damping",
        "reference_height",
    ),
)

#: What is called from Python, and what by other kernels alone: nothing is made for Python then, which takes long.
_compiled = njit(cache=True, error_model="numpy")
_part = njit(  # type: ignore[call-overload]
    error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True
)


@_compiled
def step(
    known, values, transition, constants, began, time, duration, count, force, x, way, base,
    reference, roof, rate, following, own, outputs,
):  # fmt: skip
    """Step from ``time`` over ``duration`` in ``count`` equal steps.

    Parameters
    ----------
    known : ndarray, shape (7,)
        What is known of the contact force, replaced.
    values : ndarray, shape (4 n,)
        Motion, replaced, and work space for the load; see `LumpedModel.transition`.
    transition : ndarray, shape (3 n, 4 n)
        Of a step of ``duration / count``.
    constants : ndarray, shape (8,)
        See `Constants`.
    began, time, duration : float
        When the run began, when the step does, how long it is [s].
    count : int
    force, x : float
        Contact force [N] and place along the track [m] where it acts, as received.
    way : (float, float, float, float)
        Place at the beginning of the step, speed within it, place and speed at its end [m, m/s].
    base : ndarray, shape (2,)
        Height and velocity of the roof [m, m/s].
    reference, roof, rate : float
        What the lowest spring hangs on, height of the roof before, rate given from outside [m, m, m/s].
    following : ndarray, shape (5,)
        Stiffness of a spring that follows (0: none), keep, before, after, lead; see `FollowingReference`.
    own : ndarray, shape (n + 9 m,)
        Loads that do not change in the step [N], then the table of stops and friction, changed in place; see
        `held_forces`.
    outputs : ndarray, shape (12 + 3 n,)
        Result: ends of the strip and what is observed of the masses.

    Returns
    -------
    float
        The reference after the step [m].
    """
    c = Constants(*constants_of(constants))
    rows, columns = transition.shape
    n = columns - rows
    h, result = duration / count, np.empty(rows)
    receive(known, time, force, x, way[0], way[1], duration)
    for k in range(1, count + 1):
        end = time + k * h
        height, velocity = base[0] + k * h * base[1], base[1]
        for i in range(n):
            values[rows + i] = own[i]
        uplift = c.balance + (c.static_force - c.balance) * raised(end - began, c.raise_start, c.raise_duration)
        values[rows] += uplift + (c.stiffness * height + c.damping * velocity)
        before = values[0] - roof
        reference = following[1] * reference + following[2] * before + following[4] * rate
        values[rows] += following[0] * (reference - following[3] * height)
        values[rows + n - 1] -= at(known, c.order, end)
        for i in range(rows):
            total = 0.0
            for j in range(columns):
                total += transition[i, j] * values[j]
            result[i] = total
        if len(own) > n:
            hold(own[n:].reshape(-1, _WIDTH), transition, result, height, velocity)
        for i in range(rows):
            values[i] = result[i]
        reference += following[3] * (values[0] - height)
        roof = height
    place(values, way[2], way[3], c.reference_height, n, outputs)
    return reference


@_part
def constants_of(array):
    """Return the constants as a tuple."""
    return array[0], array[1], array[2], array[3], array[4], array[5], array[6], array[7]


@_part
def hold(table, transition, motion, z, vz):
    """Let stops and friction act in a step; see `held_forces.HeldForces.act`."""
    count, n = len(table), len(motion) // 3
    free, give = np.empty((count, 2)), np.empty((count, count, 2))
    columns, force = np.empty((count, 3 * n)), table[:, _HELD].copy()
    for k in range(count):
        upper, lower = int(table[k, 0]), int(table[k, 1])
        for i in range(3 * n):
            below = transition[i, 3 * n + lower] if lower >= 0 else 0.0
            columns[k, i] = transition[i, 3 * n + upper] - below
        relative(table[k], motion, z, vz, free[k])
    for k in range(count):
        for m in range(count):
            relative(table[m], columns[k], 0.0, 0.0, give[k, m])
    for _ in range(200):
        change = 0.0
        for k in range(count):
            row, x, v = table[k], free[k, 0], free[k, 1]
            for m in range(count):
                if m != k:
                    x -= give[m, k, 0] * force[m]
                    v -= give[m, k, 1] * force[m]
            new = held(row, x, v, give[k, k, 0], give[k, k, 1])
            change, force[k] = max(change, abs(new - force[k])), new
        if change <= 1e-11:
            break
    for k in range(count):
        for i in range(3 * n):
            motion[i] -= force[k] * columns[k, i]
    for k in range(count):
        relative(table[k], motion, z, vz, free[k])
        table[k, _HELD], table[k, _HELD + 1] = force[k], free[k, 0]


@_part
def relative(row, motion, z, vz, out):
    """Write displacement and velocity against each other of what a force joins."""
    upper, lower = int(row[0]), int(row[1])
    if lower >= 0:
        z, vz = motion[3 * lower], motion[3 * lower + 1]
    out[0], out[1] = motion[3 * upper] - z, motion[3 * upper + 1] - vz


@_part
def held(row, x, v, give, give_rate):
    """Return the force of friction, sticking or at its limit, or of a stop; see `held_forces`."""
    stiffness, second = row[3], row[4]
    if row[2] != 0.0:
        trial = (row[_HELD] + stiffness * (x - row[_HELD + 1])) / (1.0 + stiffness * give)
        return max(-second, min(second, trial))
    beyond = row[6] * (x - row[5])
    if beyond <= 0.0:
        return 0.0
    force = (stiffness * beyond + second * row[6] * v) / (1.0 + stiffness * give + second * give_rate)
    return row[6] * max(0.0, min(force, beyond / give))


@_part
def place(values, x, speed, reference_height, n, outputs):
    """Write where the ends of the strip are and what is observed of the masses."""
    for side in range(0, 12, 6):
        outputs[side], outputs[side + 3] = x, speed
        outputs[side + 2] = reference_height + values[3 * n - 3]
        outputs[side + 5] = values[3 * n - 2]
    for i in range(0, 3 * n, 3):
        outputs[12 + i] = reference_height + values[i]
        outputs[13 + i], outputs[14 + i] = values[i + 1], values[i + 2]


@_part
def raised(time, start, duration):
    """Return the share of the uplift that acts; see `Operation.raised`."""
    if time < start:
        return 0.0
    if duration == 0.0:
        return 1.0
    return min(1.0, (time - start) / duration)


@_part
def receive(known, time, force, x, expected, speed, step):
    """Take a force for a step that begins at ``time``; see `ForceExtrapolation.receive_at`."""
    travel = speed * step
    if abs(travel) >= _LEAST_TRAVEL and abs((x - expected) / travel - 1.0) < _STAMP_TOLERANCE:
        time = time + step
    if known[_KNOWN] > 0.0 and time <= known[_TIME] + 1e-12:
        known[_FORCE] = force
        return
    for k in range(2, 0, -1):
        known[_TIME + k], known[_FORCE + k] = known[_TIME + k - 1], known[_FORCE + k - 1]
    known[_TIME], known[_FORCE] = time, force
    known[_KNOWN] = min(known[_KNOWN] + 1.0, 3.0)


@_part
def at(known, order, time):
    """Return the force at ``time``; see `ForceExtrapolation.at`."""
    t0, t1, t2 = known[_TIME], known[_TIME + 1], known[_TIME + 2]
    f0, f1, f2 = known[_FORCE], known[_FORCE + 1], known[_FORCE + 2]
    if f0 == 0.0 and time > t0:
        return 0.0
    degree, result = min(order, known[_KNOWN] - 1.0), f0
    if degree >= 1.0:
        first = (f0 - f1) / (t0 - t1)
        result += first * (time - t0)
        if degree >= 2.0:
            second = (first - (f1 - f2) / (t1 - t2)) / (t0 - t2)
            result += second * (time - t0) * (time - t1)
    return result if result > 0.0 else 0.0
