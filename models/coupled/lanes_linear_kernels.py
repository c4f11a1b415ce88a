"""The linear part of a step of one line under several trains, for all lanes at once, for numba.

A lane is one run. In every array the numbers of all lanes stand side by side, so that factor and couplings are read
once for all of them, and the processor takes eight lanes at a time (`models.catenary.step.vector_kernels`), those of
one half of the block, then of the other. The arithmetic is that of `models.catenary.step`.
"""

from collections import namedtuple

import numpy as np

from models.catenary.step.vector_kernels import (
    compiled,
    get,
    minus_product,
    nothing,
    part,
    plus_product,
    product,
    put,
    spread,
)

#: Lanes of a block, two vectors; ends that most modes move with.
BLOCK, ENDS = 16, 6
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
_U = np.uint64
_0, _1, _2, _3, _4, _5, _6, _7, _8 = (_U(i) for i in range(9))
#: Lanes of a half and of a block; rows of a block.
_H, _K, _K2, _K3, _K4, _K5 = _8, *(_U(i * BLOCK) for i in range(1, 6))


@compiled
def load(linear, motion):
    """Find the forces on the attachments that their change balances, before what is found inside the step."""
    own, back, known, attached, pull = linear.own, linear.back, motion.known, motion.attached, motion.pull
    right, one = middle(linear, motion.change), spread(1.0)
    for row in range(_U(own[0].size - 1)):
        at = row * _K
        force, other = get(known, at), get(known, at + _H)
        heavy, heavy_other = nothing(), nothing()
        for k in range(own[0][row], own[0][row + _1]):
            of, stiffness, mass = own[1][k] * _K2, spread(own[2][k, _0]), spread(own[2][k, _1])
            force = plus_product(force, stiffness, get(attached, of))
            other = plus_product(other, stiffness, get(attached, of + _H))
            heavy = plus_product(heavy, mass, get(attached, of + _K))
            heavy_other = plus_product(heavy_other, mass, get(attached, of + _K + _H))
        for k in range(back[0][row], back[0][row + _1]):
            of, value = back[1][k] * _K, spread(back[2][k])
            heavy = plus_product(heavy, value, get(pull, of))
            heavy_other = plus_product(heavy_other, value, get(pull, of + _H))
        put(right, at, plus_product(force, one, heavy))
        put(right, at + _H, plus_product(other, one, heavy_other))


@part
def middle(linear, change):
    """Return the part of an array that stands between the rows of zeros that the band needs."""
    margin = (linear.lower.shape[1] - 1) * BLOCK
    return change[margin : change.size - margin]


@compiled
def begin(linear, motion):
    """Find the change of the attachments without what is found inside the step."""
    load(linear, motion)
    solve(linear.lower, linear.upper, motion.change)


@compiled
def pull_droppers(linear, droppers, motion):
    """Find what droppers would pull at the end of the step if they could push, as `begin` left it."""
    rows, columns, values, rest = droppers
    change, attached, pulls = middle(linear, motion.change), motion.attached, motion.droppers
    for j in range(_U(rest.size)):
        pull, other = spread(rest[j]), spread(rest[j])
        for k in range(rows[j], rows[j + _1]):
            of = columns[k] * _K
            at, displaced, moving, changed = (
                of + of,
                spread(values[k, _0]),
                spread(values[k, _1]),
                spread(values[k, _2]),
            )
            pull = plus_product(pull, displaced, get(attached, at))
            other = plus_product(other, displaced, get(attached, at + _H))
            pull = plus_product(pull, moving, get(attached, at + _K))
            other = plus_product(other, moving, get(attached, at + _K + _H))
            pull = plus_product(pull, changed, get(change, of))
            other = plus_product(other, changed, get(change, of + _H))
        put(pulls, j * _K, pull)
        put(pulls, j * _K + _H, other)


@compiled
def finish(linear, motion):
    """Replace the motion by that at the end of the step; forces on intervals are added afterwards."""
    change = middle(linear, motion.change)
    multiply(linear.turn, change, motion.ends)
    follow(linear, motion)
    attached, a1 = motion.attached, linear.a1
    for row in range(_U(change.size) // _K):
        at, of = row * _K2, row * _K
        for i in range(_0, _K):
            attached[at + i] += change[of + i]
            attached[at + _K + i] = a1 * change[of + i] - attached[at + _K + i]


@part
def multiply(matrix, vector, result):
    """Put a matrix times a vector of every lane into ``result``."""
    rows, columns, values = matrix
    for row in range(_U(rows.size - 1)):
        value, other = nothing(), nothing()
        for k in range(rows[row], rows[row + _1]):
            of, entry = columns[k] * _K, spread(values[k])
            value = plus_product(value, entry, get(vector, of))
            other = plus_product(other, entry, get(vector, of + _H))
        put(result, row * _K, value)
        put(result, row * _K + _H, other)


@part
def solve(lower, upper, x):
    """Solve a band for all lanes; ``x`` holds the loads, then the solution, between rows of zeros.

    ``lower`` and ``upper`` hold row by row the inverse of the factor's diagonal and, divided by the diagonal, the
    entries before and after it. The nearest come last: they alone wait for the row before.
    """
    n, width = _U(lower.shape[0]), _U(lower.shape[1] - 1)
    last, last_other = nothing(), nothing()
    for row in range(n):
        at = (row + width) * _K
        scale = spread(lower[row, _0])
        value, other = product(get(x, at), scale), product(get(x, at + _H), scale)
        for back in range(width - _1):
            k = width - back
            of, entry = at - k * _K, spread(lower[row, k])
            value = minus_product(value, entry, get(x, of))
            other = minus_product(other, entry, get(x, of + _H))
        entry = spread(lower[row, _1])
        last, last_other = minus_product(value, entry, last), minus_product(other, entry, last_other)
        put(x, at, last)
        put(x, at + _H, last_other)
    last, last_other = nothing(), nothing()
    for step in range(n):
        row = n - _1 - step
        at = (row + width) * _K
        scale = spread(upper[row, _0])
        value, other = product(get(x, at), scale), product(get(x, at + _H), scale)
        for back in range(width - _1):
            k = width - back
            of, entry = at + k * _K, spread(upper[row, k])
            value = minus_product(value, entry, get(x, of))
            other = minus_product(other, entry, get(x, of + _H))
        entry = spread(upper[row, _1])
        last, last_other = minus_product(value, entry, last), minus_product(other, entry, last_other)
        put(x, at, last)
        put(x, at + _H, last_other)


@part
def follow(linear, motion):
    """Let all modes follow their ends, and find what they do to these in the next step.

    A mode takes three rows of the table: amplitude, rate, momentum. Those of an interval that move with the same ends
    follow one another: motion of these ends and forces on them stay in registers meanwhile.
    """
    first, end, rates, modes = linear.first, linear.end, linear.rates, linear.modes
    table, ends, pull, a1 = motion.table, motion.ends, motion.pull, spread(linear.a1)
    pull[:] = 0.0
    for u in range(_U(end.size)):
        for half in range(_0, _K, _H):
            e = end[u] * _K + half
            x0, x1, x2 = get(ends, e), get(ends, e + _K), get(ends, e + _K2)
            x3, x4, x5 = get(ends, e + _K3), get(ends, e + _K4), get(ends, e + _K5)
            f0, f1, f2 = get(pull, e), get(pull, e + _K), get(pull, e + _K2)
            f3, f4, f5 = get(pull, e + _K3), get(pull, e + _K4), get(pull, e + _K5)
            for m in range(first[u], first[u + _1]):
                g0, g1, g2 = spread(modes[m, _3]), spread(modes[m, _4]), spread(modes[m, _5])
                g3, g4, g5 = spread(modes[m, _6]), spread(modes[m, _7]), spread(modes[m, _8])
                moved = plus_product(plus_product(product(g0, x0), g1, x1), g2, x2)
                moved = plus_product(plus_product(plus_product(moved, g3, x3), g4, x4), g5, x5)
                at = m * _K3 + half
                value = advance(rates, modes, m, moved, a1, table, at)
                f0, f1, f2 = plus_product(f0, g0, value), plus_product(f1, g1, value), plus_product(f2, g2, value)
                f3, f4, f5 = plus_product(f3, g3, value), plus_product(f4, g4, value), plus_product(f5, g5, value)
            put(pull, e, f0)
            put(pull, e + _K, f1)
            put(pull, e + _K2, f2)
            put(pull, e + _K3, f3)
            put(pull, e + _K4, f4)
            put(pull, e + _K5, f5)
    follow_wide(linear, first[first.size - 1], table, ends, pull)


@part
def advance(rates, modes, m, moved, a1, table, at):
    """Let a mode make the step in which its ends have moved; return what it does to these in the next one."""
    stiff, from_momentum = spread(modes[m, _1]), spread(modes[m, _2])
    amplitude, momentum = get(table, at), get(table, at + _K2)
    change = plus_product(product(stiff, amplitude), from_momentum, momentum)
    change = minus_product(change, spread(modes[m, _0]), moved)
    amplitude = plus_product(amplitude, spread(1.0), change)
    rate = minus_product(product(a1, change), spread(1.0), get(table, at + _K))
    momentum = minus_product(plus_product(product(a1, change), spread(rates[m, _0]), moved), spread(1.0), momentum)
    put(table, at, amplitude)
    put(table, at + _K, rate)
    put(table, at + _K2, momentum)
    value = minus_product(product(spread(rates[m, _1]), rate), stiff, amplitude)
    return minus_product(value, from_momentum, momentum)


@part
def follow_wide(linear, begin, table, ends, pull):
    """Do as `follow` does for modes that move with more ends, one by one."""
    rates, modes, slot_end, a1 = linear.rates, linear.modes, linear.slot_end, spread(linear.a1)
    for m in range(begin, _U(modes.shape[0])):
        for half in range(_0, _K, _H):
            e = slot_end[m] * _K + half
            moved = nothing()
            for j in range(_U(modes.shape[1] - OWN)):
                moved = plus_product(moved, spread(modes[m, _3 + j]), get(ends, e + j * _K))
            value = advance(rates, modes, m, moved, a1, table, m * _K3 + half)
            for j in range(_U(modes.shape[1] - OWN)):
                at = e + j * _K
                put(pull, at, plus_product(get(pull, at), spread(modes[m, _3 + j]), value))
