"""The attachments' part of a step, for numba: the forces on them, and the solution for their change.

The line is cut into eight segments, side by side in the lanes of vectors (`models.catenary.step.attachment_lanes`): row
j of all segments is one vector, and number ``slot[k]`` of an array in lanes belongs to displacement ``order[k]``.
"""

from collections import namedtuple

import numpy as np

from models.catenary.step.vector_kernels import LANES, compiled, get, nothing, part, put, reader

#: Attachments in lanes. ``order``, ``slot``: displacements in the order of their slots, and these, so that arrays in
#: lanes are read and written from end to end. ``rows``, ``targets``, ``values``: -2 K and a2 M, of each row of vectors
#: the upper triangle, both values one after the other, its diagonal first; a target beyond the segment is a row of the
#: next. ``factor``: of each row that is not of a separator 1 / L_jj, L_j+k,j for k = 1 ... ``widths[j]``, and the row
#: of L^-1 C, with C its coupling with the separator before the segment. ``middle``, ``shifts``: inverse of what is
#: left for the separators, for each shift a block that leads from the separators so many segments on. ``before``,
#: ``after``: neighbours of the segments. ``size``: rows without separator, rows of a separator, width, rows read
#: beyond the segment.
Lanes = namedtuple("Lanes", "order slot rows targets values widths factor middle shifts before after size")
lanes_of = reader(Lanes, "wwwwfuffuuuu")
#: Arrays to work in, in lanes: displacements, velocities, forces that turn to the solution; separators, twice, and
#: once.
LanesWork = namedtuple("LanesWork", "x v right separators left")
lanes_work_of = reader(LanesWork, "fffff")
_0, _1, _2 = (np.uint64(i) for i in range(3))
_LANES = np.uint64(LANES)


@compiled
def load(lanes, attached, pressed, pull, work):
    """Find the forces on the attachments that their change in this step balances.

    Parameters
    ----------
    lanes : Lanes
    attached : ndarray, shape (2, n_attached)
        Displacements and velocities at the beginning of the step.
    pressed, pull : ndarray, shape (n_attached,)
        Known forces on them, and those of the modes.
    work : LanesWork
        ``right`` is the result.
    """
    x, v, right = work.x, work.v, work.right
    for at in range(_0, np.uint64(right.size), _LANES):
        put(right, at, nothing())
    for k in range(np.uint64(pressed.size)):
        at, i = lanes.slot[k], lanes.order[k]
        x[at], v[at] = attached[0, i], attached[1, i]
        right[at] = pressed[i] + pull[i]
    multiply(lanes, x, v, right)


@part
def multiply(lanes, x, v, right):
    """Add -2 K x + a2 M v to ``right``, all in lanes; what lies beyond the segments is work space."""
    rows, targets, values = lanes.rows, lanes.targets, lanes.values
    first, beyond = np.uint64(rows.size - 1) * _LANES, lanes.size[3] * _LANES
    for at in range(beyond):
        there = at // _LANES * _LANES + lanes.after[at % _LANES]
        x[first + at], v[first + at] = x[there], v[there]
    entry = _0
    for j in range(_0, np.uint64(rows.size - 1)):
        here = j * _LANES
        own_x, own_v = get(x, here), get(v, here)
        force = get(right, here) + get(values, entry) * own_x + get(values, entry + _LANES) * own_v
        entry += _2 * _LANES
        for k in range(rows[j] + _1, rows[j + _1]):
            there, stiff, heavy = targets[k], get(values, entry), get(values, entry + _LANES)
            entry += _2 * _LANES
            force += stiff * get(x, there) + heavy * get(v, there)
            put(right, there, get(right, there) + stiff * own_x + heavy * own_v)
        put(right, here, force)
    for at in range(beyond):
        right[at // _LANES * _LANES + lanes.after[at % _LANES]] += right[first + at]


@part
def solve(lanes, work, change):
    """Solve for the change of the attachments: all segments from one end to the other, the separators, and back.

    Parameters
    ----------
    lanes : Lanes
    work : LanesWork
        ``right`` is replaced.
    change : ndarray, shape (n_attached,)
        Result.
    """
    factor, solution, left = lanes.factor, work.right, work.left
    inner, border = lanes.size[0], lanes.size[1]
    for at in range(_0, border * _LANES, _LANES):
        put(left, at, nothing())
    begin = _0
    for row in range(inner):
        here, to_left = row * _LANES, (_1 + lanes.widths[row]) * _LANES
        value = get(solution, here) * get(factor, begin)
        put(solution, here, value)
        for k in range(_LANES, to_left, _LANES):
            put(solution, here + k, get(solution, here + k) - get(factor, begin + k) * value)
        begin += to_left
        for at in range(_0, border * _LANES, _LANES):
            put(left, at, get(left, at) + get(factor, begin) * value)
            begin += _LANES
    separate(lanes, work)
    for back in range(inner):
        row = inner - _1 - back
        here, to_left = row * _LANES, (_1 + lanes.widths[row]) * _LANES
        begin -= to_left + border * _LANES
        value = get(solution, here)
        for at in range(_0, border * _LANES, _LANES):
            value -= get(factor, begin + to_left + at) * get(left, at)
        for k in range(to_left - _LANES, _0, -_LANES):
            value -= get(factor, begin + k) * get(solution, here + k)
        put(solution, here, value * get(factor, begin))
    for k in range(np.uint64(change.size)):
        change[lanes.order[k]] = solution[lanes.slot[k]]


@compiled
def respond(lanes, load, work, change):
    """Solve for the change of the attachments under a load, both of shape (n_attached,)."""
    for at in range(_0, np.uint64(work.right.size), _LANES):
        put(work.right, at, nothing())
    for k in range(np.uint64(load.size)):
        work.right[lanes.slot[k]] = load[lanes.order[k]]
    solve(lanes, work, change)


@part
def separate(lanes, work):
    """Solve for the separators; ``left`` holds what the next segments take of them, then what is before each."""
    solution, separators, left = work.right, work.separators, work.left
    inner, border, width = lanes.size[0] * _LANES, lanes.size[1], lanes.size[2]
    for row in range(border):
        at, twice = row * _LANES, _2 * row * _LANES
        for lane in range(_LANES):
            separators[twice + lane] = solution[inner + at + lane]
        for lane in range(_LANES):
            separators[twice + lanes.before[lane]] -= left[at + lane]
        put(separators, twice + _LANES, get(separators, twice))
    for row in range(width):
        put(solution, inner + row * _LANES, nothing())
    block = _0
    for shift in lanes.shifts:
        for column in range(border):
            force = get(separators, _2 * column * _LANES + shift)
            for at in range(inner, inner + border * _LANES, _LANES):
                put(solution, at, get(solution, at) + get(lanes.middle, block) * force)
                block += _LANES
    for row in range(border):
        for lane in range(_LANES):
            left[row * _LANES + lane] = solution[inner + row * _LANES + lanes.before[lane]]
