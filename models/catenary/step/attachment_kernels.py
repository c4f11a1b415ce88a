"""The attachments' part of a step, for numba: the forces on them, and the solution for their change.

The line is cut into eight segments, side by side in the lanes of vectors (`models.catenary.step.attachment_lanes`): row
j of all segments is one vector, and number ``slots[i]`` of an array in lanes belongs to displacement i.
"""

from collections import namedtuple

import numpy as np

from models.catenary.step.vector_kernels import LANES, compiled, get, nothing, part, put, reader

#: Attachments in lanes. ``slots``: see above. ``rows``, ``targets``, ``values``: -2 K and a2 M, of which the modes have
#: taken a part, of each row of vectors the upper triangle, both values one after the other, its diagonal first; a
#: target beyond the segment is a row of the next. ``factor``: of each row that is not of a separator 1 / L_jj, L_j+k,j
#: for k = 1 ... ``widths[j]``, and the row of L^-1 C, with C its coupling with the separator before the segment.
#: ``middle``, ``shifts``: inverse of what is left for the separators, for each shift a block that leads from the
#: separators so many segments on. ``before``, ``after``: neighbours of the segments. ``size``: rows without separator,
#: rows of a separator, width, rows read beyond the segment.
Lanes = namedtuple("Lanes", "slots rows targets values widths factor middle shifts before after size")
lanes_of = reader(Lanes, "wwwfuffuuuu")
#: Arrays to work in: separators in lanes, twice, and once.
LanesWork = namedtuple("LanesWork", "separators left")
lanes_work_of = reader(LanesWork, "ff")
_0, _1, _2 = (np.uint64(i) for i in range(3))
_LANES = np.uint64(LANES)


@compiled
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


@compiled
def solve(lanes, work, solution):
    """Solve for the attachments: all segments from one end to the other, the separators, and back.

    Parameters
    ----------
    lanes : Lanes
    work : LanesWork
    solution : ndarray
        Forces on the attachments in lanes; replaced.
    """
    factor, left = lanes.factor, work.left
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
    separate(lanes, work, solution)
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


@part
def separate(lanes, work, solution):
    """Solve for the separators; ``left`` holds what the next segments take of them, then what is before each."""
    separators, left = work.separators, work.left
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
