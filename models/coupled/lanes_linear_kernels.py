"""The linear part of a step of one line under several trains, for all lanes at once, for numba.

A lane is one run. In every array the numbers of all lanes stand side by side, so that factor and couplings are read
once for all of them and the processor takes several lanes at a time. The arithmetic is that of `models.catenary.step`.

This module imports nothing of the project: it is compiled from a copy in the user's cache
(`models.numerics.kernel_cache`), which cannot see other files.
"""

from collections import namedtuple
from typing import Any

import numpy as np
from numba import njit

#: Lanes; ends that most modes move with; diagonals of the band taken at a time, and how often at least.
LANES, ENDS, DIAGONALS, GROUPS = 16, 6, 6, 3
#: Entries of the attachments' matrices, of the turn to the intervals' axes, and modes taken at a time.
ENTRIES, PAIR, MODES = 3, 2, 3
#: Numbers of a mode before its couplings mu G: 1 / K_hat, and what its amplitude and its momentum do to its change.
OWN = 3
#: The matrices, see `lane_matrices.LaneMatrices`.
Linear = namedtuple(
    "Linear", ("a1", "first", "end", "rates", "modes", "slot_end", "turn", "back", "own", "lower", "upper")
)
#: Elongation of droppers over the attachments, compressed by rows, three columns of values: for displacements,
#: velocities and changes; and what they pull at rest.
Droppers = namedtuple("Droppers", ("rows", "columns", "values", "rest"))
#: Motion, an array of all lanes each: modes; displacement and velocity of each attachment, what is known of the forces
#: on them, their change in this step; motion of the intervals' ends and forces on these; pulls of the droppers.
Motion = namedtuple("Motion", ("table", "attached", "known", "change", "ends", "pull", "droppers"))
#: Sums may be reordered, not more: infinities and NaN stay what they are.
_OPTIONS: Any = {"fastmath": {"reassoc", "contract", "nsz"}, "error_model": "numpy"}
#: Functions that are called from outside, and those that are not: what leads into these from Python is not compiled.
_compiled = njit(cache=True, **_OPTIONS)
_inner = njit(**(_OPTIONS | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}))
_U = np.uint64
_K = _U(LANES)
_0, _1, _2, _3, _4, _5, _6, _7, _8 = (_U(i) for i in range(9))
_K2, _K3, _K4, _K5, _K6, _K7, _K8 = (_U(i * LANES) for i in range(2, 9))


@_compiled
def load(linear, motion):
    """Find the forces on the attachments that their change balances, before what is found inside the step."""
    right = middle(linear, motion.change)
    for i in range(right.size):
        right[i] = motion.known[i]
    add_own(linear.own, motion.attached, right)
    multiply(linear.back, motion.pull, right)


@_inner
def middle(linear, change):
    """Return the part of an array that stands between the rows of zeros that the band needs."""
    margin = (linear.lower.shape[1] - 1) * LANES
    return change[margin : change.size - margin]


@_compiled
def begin(linear, motion):
    """Find the change of the attachments without what is found inside the step."""
    load(linear, motion)
    solve(linear.lower, linear.upper, motion.change)


@_compiled
def pull_droppers(linear, droppers, motion):
    """Find what droppers would pull at the end of the step if they could push, as `begin` left it."""
    rows, columns, values, rest = droppers
    change, attached, pulls = middle(linear, motion.change), motion.attached, motion.droppers
    for j in range(_U(rest.size)):
        at = j * _K
        for i in range(_0, _K):
            pulls[at + i] = rest[j]
        for k in range(rows[j], rows[j + _1]):
            a, b, c, of = values[k, _0], values[k, _1], values[k, _2], columns[k] * _K
            x = of + of
            for i in range(_0, _K):
                pulls[at + i] += a * attached[x + i] + b * attached[x + _K + i] + c * change[of + i]


@_compiled
def finish(linear, motion):
    """Replace the motion by that at the end of the step; forces on intervals are added afterwards."""
    change = middle(linear, motion.change)
    motion.ends[:] = 0.0
    multiply(linear.turn, change, motion.ends)
    follow(linear, motion)
    attached, a1 = motion.attached, linear.a1
    for row in range(_U(change.size) // _K):
        at, of = row * _K2, row * _K
        for i in range(_0, _K):
            attached[at + i] += change[of + i]
            attached[at + _K + i] = a1 * change[of + i] - attached[at + _K + i]


@_inner
def multiply(matrix, vector, result):
    """Add a matrix times a vector of every lane to ``result``; rows are filled up to an even number of entries."""
    rows, columns, values = matrix
    for row in range(_U(rows.size - 1)):
        at, k = row * _K, rows[row]
        while k < rows[row + _1]:
            a, b, x, y = values[k], values[k + _1], columns[k] * _K, columns[k + _1] * _K
            for i in range(_0, _K):
                result[at + i] += a * vector[x + i] + b * vector[y + i]
            k += _2


@_inner
def add_own(own, attached, result):
    """Add -2 K x + a2 M v of the attachments to ``result``; rows are filled up to a multiple of three entries."""
    rows, columns, values = own
    for row in range(_U(rows.size - 1)):
        at, k = row * _K, rows[row]
        while k < rows[row + _1]:
            a, b, c = columns[k] * _K2, columns[k + _1] * _K2, columns[k + _2] * _K2
            ax, bx, cx = values[k, _0], values[k + _1, _0], values[k + _2, _0]
            av, bv, cv = values[k, _1], values[k + _1, _1], values[k + _2, _1]
            for i in range(_0, _K):
                first = ax * attached[a + i] + av * attached[a + _K + i]
                second = bx * attached[b + i] + bv * attached[b + _K + i]
                result[at + i] += first + second + cx * attached[c + i] + cv * attached[c + _K + i]
            k += _3


@_inner
def solve(lower, upper, x):
    """Solve a band for all lanes; ``x`` holds the loads, then the solution, between rows of zeros.

    ``lower`` and ``upper`` hold row by row the inverse of the factor's diagonal and the entries before and after it.
    The first groups of diagonals are counted by a constant: the compiler then knows how far apart the rows are.
    """
    n, width, six = _U(lower.shape[0]), _U(lower.shape[1] - 1), _U(DIAGONALS)
    for row in range(n):
        at = (row + width) * _K
        for group in range(_U(GROUPS)):
            k, of = group * six, at - group * six * _K
            a, b, c = lower[row, k + _1], lower[row, k + _2], lower[row, k + _3]
            d, e, f = lower[row, k + _4], lower[row, k + _5], lower[row, k + _6]
            for i in range(_0, _K):
                near = a * x[of + i - _K] + b * x[of + i - _K2] + c * x[of + i - _K3]
                x[at + i] -= near + d * x[of + i - _K4] + e * x[of + i - _K5] + f * x[of + i - _K6]
        for k in range(six * _U(GROUPS) + _1, width + _1):
            a, of = lower[row, k], at - k * _K
            for i in range(_0, _K):
                x[at + i] -= a * x[of + i]
        diagonal = lower[row, _0]
        for i in range(_0, _K):
            x[at + i] *= diagonal
    for step in range(n):
        row = n - _1 - step
        at = (row + width) * _K
        for group in range(_U(GROUPS)):
            k, of = group * six, at + group * six * _K
            a, b, c = upper[row, k + _1], upper[row, k + _2], upper[row, k + _3]
            d, e, f = upper[row, k + _4], upper[row, k + _5], upper[row, k + _6]
            for i in range(_0, _K):
                near = a * x[of + i + _K] + b * x[of + i + _K2] + c * x[of + i + _K3]
                x[at + i] -= near + d * x[of + i + _K4] + e * x[of + i + _K5] + f * x[of + i + _K6]
        for k in range(six * _U(GROUPS) + _1, width + _1):
            a, of = upper[row, k], at + k * _K
            for i in range(_0, _K):
                x[at + i] -= a * x[of + i]
        diagonal = upper[row, _0]
        for i in range(_0, _K):
            x[at + i] *= diagonal


@_inner
def follow(linear, motion):
    """Let all modes follow their ends, and find what they do to these in the next step.

    A mode takes three rows of the table: amplitude, rate, momentum. Three modes are taken at a time, so that their ends
    are read once for them.
    """
    a1, first, end, rates, modes = linear.a1, linear.first, linear.end, linear.rates, linear.modes
    table, ends, pull = motion.table, motion.ends, motion.pull
    pull[:] = 0.0
    for u in range(_U(end.size)):
        e, m = end[u] * _K, first[u]
        to_momentum, from_rate = rates[m, _0], rates[m, _1]
        while m < first[u + _1]:
            i0, s0, p0 = modes[m, _0], modes[m, _1], modes[m, _2]
            a0, b0, c0 = modes[m, _3], modes[m, _4], modes[m, _5]
            d0, e0, f0 = modes[m, _6], modes[m, _7], modes[m, _8]
            n, o = m + _1, m + _2
            i_, s_, p_ = modes[n, _0], modes[n, _1], modes[n, _2]
            a_, b_, c_ = modes[n, _3], modes[n, _4], modes[n, _5]
            d_, e_, f_ = modes[n, _6], modes[n, _7], modes[n, _8]
            i2, s2, p2 = modes[o, _0], modes[o, _1], modes[o, _2]
            a2, b2, c2 = modes[o, _3], modes[o, _4], modes[o, _5]
            d2, e2, f2 = modes[o, _6], modes[o, _7], modes[o, _8]
            at = m * _K3
            for i in range(_0, _K):
                k, t = e + i, at + i
                xa, xb, xc = ends[k], ends[k + _K], ends[k + _K2]
                xd, xe, xf = ends[k + _K3], ends[k + _K4], ends[k + _K5]
                moved = a0 * xa + b0 * xb + c0 * xc + d0 * xd + e0 * xe + f0 * xf
                amplitude, momentum = table[t], table[t + _K2]
                change = s0 * amplitude + p0 * momentum - moved * i0
                amplitude += change
                rate = a1 * change - table[t + _K]
                momentum = a1 * change + to_momentum * moved - momentum
                table[t], table[t + _K], table[t + _K2] = amplitude, rate, momentum
                v0 = from_rate * rate - (s0 * amplitude + p0 * momentum)
                moved = a_ * xa + b_ * xb + c_ * xc + d_ * xd + e_ * xe + f_ * xf
                amplitude, momentum = table[t + _K3], table[t + _K5]
                change = s_ * amplitude + p_ * momentum - moved * i_
                amplitude += change
                rate = a1 * change - table[t + _K4]
                momentum = a1 * change + to_momentum * moved - momentum
                table[t + _K3], table[t + _K4], table[t + _K5] = amplitude, rate, momentum
                v1 = from_rate * rate - (s_ * amplitude + p_ * momentum)
                moved = a2 * xa + b2 * xb + c2 * xc + d2 * xd + e2 * xe + f2 * xf
                amplitude, momentum = table[t + _K6], table[t + _K8]
                change = s2 * amplitude + p2 * momentum - moved * i2
                amplitude += change
                rate = a1 * change - table[t + _K7]
                momentum = a1 * change + to_momentum * moved - momentum
                table[t + _K6], table[t + _K7], table[t + _K8] = amplitude, rate, momentum
                v2 = from_rate * rate - (s2 * amplitude + p2 * momentum)
                pull[k] += a0 * v0 + a_ * v1 + a2 * v2
                pull[k + _K] += b0 * v0 + b_ * v1 + b2 * v2
                pull[k + _K2] += c0 * v0 + c_ * v1 + c2 * v2
                pull[k + _K3] += d0 * v0 + d_ * v1 + d2 * v2
                pull[k + _K4] += e0 * v0 + e_ * v1 + e2 * v2
                pull[k + _K5] += f0 * v0 + f_ * v1 + f2 * v2
            m += _U(MODES)
    follow_wide(linear, first[first.size - 1], table, ends, pull)


@_inner
def follow_wide(linear, begin, table, ends, pull):
    """Do as `follow` does for modes that move with more ends, one by one."""
    a1, rates, modes, slot_end = linear.a1, linear.rates, linear.modes, linear.slot_end
    moved, value = np.empty(LANES), np.empty(LANES)
    for m in range(begin, _U(modes.shape[0])):
        e, at = slot_end[m] * _K, m * _K3
        inverse, stiff, from_momentum = modes[m, _0], modes[m, _1], modes[m, _2]
        to_momentum, from_rate = rates[m, _0], rates[m, _1]
        moved[:] = 0.0
        for j in range(_U(modes.shape[1] - OWN)):
            coupling, k = modes[m, _3 + j], e + j * _K
            for i in range(_0, _K):
                moved[i] += coupling * ends[k + i]
        for i in range(_0, _K):
            t = at + i
            amplitude, momentum = table[t], table[t + _K2]
            change = stiff * amplitude + from_momentum * momentum - moved[i] * inverse
            amplitude += change
            rate = a1 * change - table[t + _K]
            momentum = a1 * change + to_momentum * moved[i] - momentum
            table[t], table[t + _K], table[t + _K2] = amplitude, rate, momentum
            value[i] = from_rate * rate - (stiff * amplitude + from_momentum * momentum)
        for j in range(_U(modes.shape[1] - OWN)):
            coupling, k = modes[m, _3 + j], e + j * _K
            for i in range(_0, _K):
                pull[k + i] += coupling * value[i]
