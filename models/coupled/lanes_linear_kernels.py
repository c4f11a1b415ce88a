"""The linear part of a step of one line under several trains, for all lanes at once, for numba.

A lane is one run. In every array the numbers of all lanes stand side by side, so that factor and couplings are read
once for all of them, and the processor takes eight lanes at a time (`models.catenary.step.vector_kernels`), those of
one half of the block, then of the other. The arithmetic is that of `models.catenary.step`.
"""

from collections import namedtuple

import numpy as np

from models.catenary.step.vector_kernels import get, nothing, put
from models.coupled.lane_forms_kernels import inner, merged, outer

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
#: A block less: whole numbers from 0 begin again after the last.
_BACK = _U(2**64 - BLOCK)


@outer
def load(linear, motion):
    """Find the forces on the attachments that their change balances, before what is found inside the step."""
    own, back, known, attached, pull = linear.own, linear.back, motion.known, motion.attached, motion.pull
    right = middle(linear, motion.change)
    for row in range(_U(own[0].size - 1)):
        at = row * _K
        force, other = get(known, at), get(known, at + _H)
        heavy, heavy_other = nothing(), nothing()
        for k in range(own[0][row], own[0][row + _1]):
            of, stiffness, mass = own[1][k] * _K2, own[2][k, _0], own[2][k, _1]
            force += get(attached, of) * stiffness
            other += get(attached, of + _H) * stiffness
            heavy += get(attached, of + _K) * mass
            heavy_other += get(attached, of + _K + _H) * mass
        for k in range(back[0][row], back[0][row + _1]):
            of, value = back[1][k] * _K, back[2][k]
            heavy += get(pull, of) * value
            heavy_other += get(pull, of + _H) * value
        put(right, at, force + heavy)
        put(right, at + _H, other + heavy_other)


@merged
def middle(linear, change):
    """Return the part of an array that stands between the rows of zeros that the band needs."""
    margin = (linear.lower.shape[1] - 1) * BLOCK
    return change[margin : change.size - margin]


@outer
def begin(linear, motion):
    """Find the change of the attachments without what is found inside the step."""
    load(linear, motion)
    solve(linear.lower, linear.upper, motion.change)


@outer
def pull_droppers(linear, droppers, motion):
    """Find what droppers would pull at the end of the step if they could push, as `begin` left it."""
    rows, columns, values, rest = droppers
    change, attached, pulls = middle(linear, motion.change), motion.attached, motion.droppers
    for j in range(_U(rest.size)):
        pull = other = nothing() + rest[j]
        for k in range(rows[j], rows[j + _1]):
            of = columns[k] * _K
            at, displaced, moving, changed = of + of, values[k, _0], values[k, _1], values[k, _2]
            pull += get(attached, at) * displaced
            other += get(attached, at + _H) * displaced
            pull += get(attached, at + _K) * moving
            other += get(attached, at + _K + _H) * moving
            pull += get(change, of) * changed
            other += get(change, of + _H) * changed
        put(pulls, j * _K, pull)
        put(pulls, j * _K + _H, other)


@outer
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


@inner
def multiply(matrix, vector, result):
    """Put a matrix times a vector of every lane into ``result``."""
    rows, columns, values = matrix
    for row in range(_U(rows.size - 1)):
        value, other = nothing(), nothing()
        for k in range(rows[row], rows[row + _1]):
            of = columns[k] * _K
            value += get(vector, of) * values[k]
            other += get(vector, of + _H) * values[k]
        put(result, row * _K, value)
        put(result, row * _K + _H, other)


@inner
def solve(lower, upper, x):
    """Solve a band for all lanes; ``x`` holds the loads, then the solution, between rows of zeros.

    ``lower`` and ``upper`` hold row by row the inverse of the factor's diagonal and, divided by the diagonal, the
    entries before and after it. The nearest come last: they alone wait for the row before.
    """
    n, width = _U(lower.shape[0]), _U(lower.shape[1] - 1)
    last, last_other = nothing(), nothing()
    for row in range(n):
        last, last_other = eliminate(lower, row, (row + width) * _K, _BACK, x, last, last_other)
    last, last_other = nothing(), nothing()
    for step in range(n):
        row = n - _1 - step
        last, last_other = eliminate(upper, row, (row + width) * _K, _K, x, last, last_other)


@merged
def eliminate(matrix, row, at, on, x, last, last_other):
    """Solve a row of a band, given the solutions of the one before it; ``on`` leads from there to those before that."""
    value, other = get(x, at) * matrix[row, _0], get(x, at + _H) * matrix[row, _0]
    width = _U(matrix.shape[1] - 1)
    for back in range(width - _1):
        k = width - back
        value -= get(x, at + k * on) * matrix[row, k]
        other -= get(x, at + k * on + _H) * matrix[row, k]
    value, other = value - last * matrix[row, _1], other - last_other * matrix[row, _1]
    put(x, at, value)
    put(x, at + _H, other)
    return value, other


@inner
def follow(linear, motion):
    """Let all modes follow their ends, and find what they do to these in the next step.

    A mode takes three rows of the table: amplitude, rate, momentum. Those of an interval that move with the same ends
    follow one another: motion of these ends and forces on them stay in registers meanwhile.
    """
    first, end, rates, modes = linear.first, linear.end, linear.rates, linear.modes
    table, ends, pull, a1 = motion.table, motion.ends, motion.pull, linear.a1
    pull[:] = 0.0
    for u in range(_U(end.size)):
        for half in range(_0, _K, _H):
            e = end[u] * _K + half
            x0, x1, x2 = get(ends, e), get(ends, e + _K), get(ends, e + _K2)
            x3, x4, x5 = get(ends, e + _K3), get(ends, e + _K4), get(ends, e + _K5)
            f0, f1, f2 = get(pull, e), get(pull, e + _K), get(pull, e + _K2)
            f3, f4, f5 = get(pull, e + _K3), get(pull, e + _K4), get(pull, e + _K5)
            for m in range(first[u], first[u + _1]):
                g0, g1, g2 = modes[m, _3], modes[m, _4], modes[m, _5]
                g3, g4, g5 = modes[m, _6], modes[m, _7], modes[m, _8]
                moved = x0 * g0 + x1 * g1 + x2 * g2 + x3 * g3 + x4 * g4 + x5 * g5
                at = m * _K3 + half
                value = advance(rates, modes, m, moved, a1, table, at)
                f0, f1, f2 = f0 + value * g0, f1 + value * g1, f2 + value * g2
                f3, f4, f5 = f3 + value * g3, f4 + value * g4, f5 + value * g5
            put(pull, e, f0)
            put(pull, e + _K, f1)
            put(pull, e + _K2, f2)
            put(pull, e + _K3, f3)
            put(pull, e + _K4, f4)
            put(pull, e + _K5, f5)
    follow_wide(linear, first[first.size - 1], table, ends, pull)


@inner
def advance(rates, modes, m, moved, a1, table, at):
    """Let a mode make the step in which its ends have moved; return what it does to these in the next one."""
    stiff, from_momentum = modes[m, _1], modes[m, _2]
    amplitude, momentum = get(table, at), get(table, at + _K2)
    change = amplitude * stiff + momentum * from_momentum - moved * modes[m, _0]
    amplitude += change
    rate, momentum = change * a1 - get(table, at + _K), change * a1 + moved * rates[m, _0] - momentum
    put(table, at, amplitude)
    put(table, at + _K, rate)
    put(table, at + _K2, momentum)
    return rate * rates[m, _1] - amplitude * stiff - momentum * from_momentum


@inner
def follow_wide(linear, begin, table, ends, pull):
    """Do as `follow` does for modes that move with more ends, one by one."""
    rates, modes, slot_end, a1 = linear.rates, linear.modes, linear.slot_end, linear.a1
    for m in range(begin, _U(modes.shape[0])):
        for half in range(_0, _K, _H):
            e = slot_end[m] * _K + half
            moved = nothing()
            for j in range(_U(modes.shape[1] - OWN)):
                moved += get(ends, e + j * _K) * modes[m, _3 + j]
            value = advance(rates, modes, m, moved, a1, table, m * _K3 + half)
            for j in range(_U(modes.shape[1] - OWN)):
                at = e + j * _K
                put(pull, at, get(pull, at) + value * modes[m, _3 + j])
