"""The two halves of a line's step in one pass each, for numba.

The same arithmetic as `numpy_engine.NumpyEngine`, but nothing is read twice and no intermediate array
is written: how much is read and written sets the pace.
Indices are unsigned, which spares the compiler the check whether they count from the end.
What belongs together is handed over together, as a tuple or as one array (`unpacked`).

This module imports nothing of the project and is not divided: it is compiled from a copy in the user's cache
(`models.catenary.step.engine_choice`), which cannot see other files.
"""

from collections import namedtuple

import numpy as np
from numba import njit

#: Modes of a unit, and ends that it moves with: what the processor takes at once.
LANES, ENDS = 8, 6
#: Rows of a unit: the coupling mu G with its ends, 1 / K_hat, then the motion of its modes.
INVERSE, AMPLITUDE, RATE, MOMENTUM, HELD, ROWS = 6, 7, 8, 9, 10, 11
#: What `meet` returns where there is no crossing.
NOWHERE, BEFORE, BEYOND = -1, -2, -3
#: An interval of a contact wire, as `unpacked` returns it: ``slots``, where the amplitudes of its modes are in the
#: table, ``ends``, the places of its attachments' displacements, and ``reached``, the displacements that loads at these
#: reach, all unsigned; ``plan`` to ``height_static`` of the `WireInterval`; ``yielding``, ``at_ends`` and the values of
#: ``columns`` of the `IntervalResponse`.
Interval = namedtuple(
    "Interval",
    ("slots", "ends", "reached", "plan", "plan_static", "height", "height_static", "yielding", "at_ends", "columns"),
)
#: Sums may be reordered, not more: infinities and NaN stay what they are.
_compiled = njit(cache=True, fastmath={"reassoc", "contract", "nsz"}, error_model="numpy")
_0, _1, _2, _3, _4, _5 = (np.uint64(i) for i in range(6))
_LANES, _UNIT = np.uint64(LANES), np.uint64(ROWS * LANES)
_R0, _R1, _R2, _R3, _R4, _R5, _INVERSE, _AMPLITUDE, _RATE, _MOMENTUM, _HELD = (
    np.uint64(LANES * row) for row in range(ROWS)
)
#: From the place of a mode's amplitude in the table to others of the same mode.
_TO_RATE, _TO_HELD, _FROM_INVERSE = _RATE - _AMPLITUDE, _HELD - _AMPLITUDE, _AMPLITUDE - _INVERSE


@_compiled
def prepare(units, table, pull):
    """Find what modes do in the next step, were the attachments held, and what they do to the ends of their intervals.

    Parameters
    ----------
    units, table
        See `finish`.
    pull : ndarray, shape (n_ends,)
        Result: forces on the ends.
    """
    where, rates, more, more_coupling = units
    pull[:] = 0.0
    for u in range(where.size):
        end, begin = where[u], np.uint64(u) * _UNIT
        for k in range(begin, begin + _LANES):
            inverse = table[k + _INVERSE]
            held = (rates[u, _3] + rates[u, _4] * inverse) * table[k + _AMPLITUDE]
            held += rates[u, _1] * inverse * table[k + _MOMENTUM]
            table[k + _HELD] = held
            value = rates[u, _2] * table[k + _RATE] - held
            for j in range(_0, np.uint64(ENDS)):
                pull[end + j] += table[k + j * _LANES] * value
    draw_more(rates, more, more_coupling, table, pull)


@_compiled
def load(back, own, attached, pressed, pull, right):
    """Find the forces on the attachments that their change in this step balances.

    Parameters
    ----------
    back : (ndarray, ndarray, ndarray)
        Turn of the ends back to the attachments' axes: rows, columns and values, compressed by rows.
    own : (ndarray, ndarray, ndarray)
        -2 K and a2 M of the attachments, values (k, 2) for both: upper triangles compressed by rows, each of
        which begins with its diagonal.
    attached : ndarray, shape (2, n_attached)
    pressed : ndarray, shape (n_attached,)
    pull : ndarray, shape (n_ends,)
    right : ndarray, shape (n_attached,)
        Result.
    """
    rows, columns, values = own
    for i in range(right.size):
        right[i] = pressed[i]
    for i in range(right.size):
        x, v = attached[0, i], attached[1, i]
        at = rows[i]
        total = values[at, _0] * x + values[at, _1] * v
        for k in range(at + _1, rows[i + _1]):
            j = columns[k]
            total += values[k, _0] * attached[0, j] + values[k, _1] * attached[1, j]
            right[j] += values[k, _0] * x + values[k, _1] * v
        right[i] += total
    add_product(back, pull, right)


@_compiled
def finish(turn, units, a1, solution, ends, attached, table, pull):
    """Let the intervals follow their attachments, replace the motion, and `prepare` the next step in the same pass.

    Parameters
    ----------
    turn : (ndarray, ndarray, ndarray)
        Turn of the attachments' displacements to the axes of the intervals: rows, columns and values, compressed by
        rows.
    units : (where, rates, more, more_coupling)
        where : ndarray of unsigned int, shape (N,)
            First of the six ends that the modes of a unit move with.
        rates : ndarray, shape (N, 5)
            a1 / mu, a2 and a2 / mu of the modes, then c and d with -2 lambda / K_hat = c + d / K_hat: less to read
            than these themselves.
        more : ndarray of unsigned int, shape (M, 2)
            Units that move with further ends: the unit, and the first of six such ends.
        more_coupling : ndarray, shape (M, 6, 8)
            mu G with these.
    a1 : float
    solution : ndarray, shape (n_attached,)
        Change of the attachments' displacements.
    ends : ndarray, shape (n_ends,)
        Work space.
    attached : ndarray, shape (2, n_attached)
        Motion of the attachments, replaced.
    table : ndarray, shape (N * 11 * 8,)
        Unit by unit eleven rows of eight modes, see the constants above: properties, and the motion, which is replaced.
        The last row is the change of the amplitudes were the attachments held, of this step; for the next one
        afterwards.
    pull : ndarray, shape (n_ends,)
        Result: forces on the ends in the next step, the attachments held.
    """
    where, rates, more, more_coupling = units
    ends[:] = 0.0
    pull[:] = 0.0
    add_product(turn, solution, ends)
    for i in range(solution.size):
        attached[0, i] += solution[i]
        attached[1, i] = a1 * solution[i] - attached[1, i]
    follow_more(rates, more, more_coupling, ends, table)
    advance(where, rates, a1, ends, table, pull)
    draw_more(rates, more, more_coupling, table, pull)


@_compiled
def advance(where, rates, a1, ends, table, pull):
    """Replace the motion of all modes.

    One array for everything and rows at fixed distances: then the compiler knows that nothing overlaps, and takes
    several modes at once.
    """
    for u in range(where.size):
        end, begin = where[u], np.uint64(u) * _UNIT
        to_momentum, a2, from_rate = rates[u, _0], rates[u, _1], rates[u, _2]
        stiff, less = rates[u, _3], rates[u, _4]
        e0, e1, e2 = ends[end], ends[end + _1], ends[end + _2]
        e3, e4, e5 = ends[end + _3], ends[end + _4], ends[end + _5]
        t0 = t1 = t2 = t3 = t4 = t5 = 0.0
        for k in range(begin, begin + _LANES):
            g0, g1, g2 = table[k], table[k + _R1], table[k + _R2]
            g3, g4, g5 = table[k + _R3], table[k + _R4], table[k + _R5]
            moved = g0 * e0 + g1 * e1 + g2 * e2 + g3 * e3 + g4 * e4 + g5 * e5
            inverse = table[k + _INVERSE]
            change = table[k + _HELD] - moved * inverse
            amplitude = table[k + _AMPLITUDE] + change
            rate = a1 * change - table[k + _RATE]
            momentum = a1 * change + to_momentum * moved - table[k + _MOMENTUM]
            held = a2 * inverse * momentum + (stiff + less * inverse) * amplitude
            value = from_rate * rate - held
            table[k + _AMPLITUDE], table[k + _RATE] = amplitude, rate
            table[k + _MOMENTUM], table[k + _HELD] = momentum, held
            t0 += g0 * value
            t1 += g1 * value
            t2 += g2 * value
            t3 += g3 * value
            t4 += g4 * value
            t5 += g5 * value
        pull[end] += t0
        pull[end + _1] += t1
        pull[end + _2] += t2
        pull[end + _3] += t3
        pull[end + _4] += t4
        pull[end + _5] += t5


@_compiled
def follow_more(rates, more, coupling, ends, table):
    """Put what further ends do to the modes into ``table``, so that `advance` finds it there."""
    for i in range(more.shape[0]):
        unit, end = more[i, _0], more[i, _1]
        for k in range(_0, _LANES):
            moved = 0.0
            for j in range(_0, np.uint64(ENDS)):
                moved += coupling[i, j, k] * ends[end + j]
            at = unit * _UNIT + k
            table[at + _HELD] -= moved * table[at + _INVERSE]
            table[at + _MOMENTUM] -= rates[unit, _0] * moved


@_compiled
def draw_more(rates, more, coupling, table, pull):
    """Add what modes do to further ends to ``pull``."""
    for i in range(more.shape[0]):
        unit, end = more[i, _0], more[i, _1]
        for k in range(_0, _LANES):
            at = unit * _UNIT + k
            value = rates[unit, _2] * table[at + _RATE] - table[at + _HELD]
            for j in range(_0, np.uint64(ENDS)):
                pull[end + j] += coupling[i, j, k] * value


@_compiled
def add_product(matrix, vector, result):
    """Add a matrix, its rows, columns and values, times a vector to ``result``."""
    rows, columns, values = matrix
    for i in range(result.size):
        total = 0.0
        for k in range(rows[i], rows[i + _1]):
            total += values[k] * vector[columns[k]]
        result[i] += total


@_compiled
def solve(band, load, work, solution):
    """Solve a band from both of its ends towards the middle, which are two chains that do not wait for each other.

    Parameters
    ----------
    band : (top, bottom, middle, size)
        top, bottom : ndarray, shape (p (width + 1),), (q (width + 1),)
            Cholesky factors of the first p rows, and of the last q rows from the end backwards: row j holds 1 / L_jj
            and L_j+k,j for k = 1 ... width.
        middle : ndarray, shape (width, width)
            Inverse of what is left for the rows between.
        size : ndarray of unsigned int, shape (4,)
            p, q, width, width + 1; q <= p <= q + 1.
    load : ndarray, shape (n,)
        n = p + width + q.
    work : ndarray, shape (2, p + width)
    solution : ndarray, shape (n,)
    """
    top, bottom, middle, size = band
    p, q, width, stride = size[_0], size[_1], size[_2], size[_3]
    n = p + width + q
    for j in range(p + width):
        work[0, j] = load[j]
    for j in range(q):
        work[1, j] = load[n - _1 - j]
    for k in range(q, q + width):
        work[1, k] = 0.0
    at = _0
    for j in range(q):
        a, b = work[0, j] * top[at], work[1, j] * bottom[at]
        work[0, j], work[1, j] = a, b
        for k in range(_1, stride):
            work[0, j + k] -= top[at + k] * a
            work[1, j + k] -= bottom[at + k] * b
        at += stride
    if p > q:
        a = work[0, q] * top[at]
        work[0, q] = a
        for k in range(_1, stride):
            work[0, q + k] -= top[at + k] * a
    for k in range(width):
        load[k] = work[0, p + k] + work[1, q + width - _1 - k]
    for i in range(width):
        total = 0.0
        for k in range(width):
            total += middle[i, k] * load[k]
        work[0, p + i] = total
        work[1, q + width - _1 - i] = total
    if p > q:
        total = 0.0
        for k in range(_1, stride):
            total += top[at + k] * work[0, q + k]
        work[0, q] = (work[0, q] - total) * top[at]
    for step in range(q):
        j = q - _1 - step
        at -= stride
        a = b = 0.0
        for k in range(_1, stride):
            a += top[at + k] * work[0, j + k]
            b += bottom[at + k] * work[1, j + k]
        work[0, j] = (work[0, j] - a) * top[at]
        work[1, j] = (work[1, j] - b) * bottom[at]
    for j in range(p + width):
        solution[j] = work[0, j]
    for j in range(q):
        solution[n - _1 - j] = work[1, j]


@_compiled
def unpacked(record):
    """Return the parts of an interval's record, see `Interval`.

    A record is one array, because a call costs more for every array that is handed over: four whole numbers (modes n,
    displacements of attachments e, elements k, displacements r that are reached), then the parts one after the other.
    """
    n, e, k, r = record[:4].view(np.int64)
    m, nodes, at = n + e, 2 * (k + 1), 4
    slots, at = record[at : at + n].view(np.uint64), at + n
    ends, at = record[at : at + e].view(np.uint64), at + e
    reached, at = record[at : at + r].view(np.uint64), at + r
    plan, at = record[at : at + nodes * m].reshape((nodes, m)), at + nodes * m
    plan_static, at = record[at : at + nodes], at + nodes
    height, at = record[at : at + 4 * k * m].reshape((k, 4, m)), at + 4 * k * m
    height_static, at = record[at : at + 4 * k].reshape((k, 4)), at + 4 * k
    yielding, at = record[at : at + n * e].reshape((n, e)), at + n * e
    at_ends, at = record[at : at + e * e].reshape((e, e)), at + e * e
    columns = record[at : at + r * e].reshape((r, e))
    return Interval(slots, ends, reached, plan, plan_static, height, height_static, yielding, at_ends, columns)


@_compiled
def meet(record, strip, element, a1, table, solution, attached, result):
    """Find where a strip crosses an interval of a wire at the end of a step, forces found inside the step left out.

    The same as `models.catenary.contact_and_slack.wire_response.walk` does.

    Parameters
    ----------
    record : ndarray
        Of the interval, see `unpacked`.
    strip : ndarray, shape (2, 2, 3)
        Ends A and B; position and velocity.
    element : int
        Of the interval, to begin with.
    a1 : float
    table : ndarray
        See `finish`.
    solution, attached : ndarray, shape (n_attached,), (2, n_attached)
        Change of the attachments in this step, and their motion at its beginning.
    result : ndarray, shape (6 + m + e,)
        Share of the way along the element and along the strip, static height, rise and its rate, compliance; what a
        unit force on the point does to the m local coordinates, and to the e displacements of the attachments directly
        and through the modes.

    Returns
    -------
    int
        Element of the interval; NOWHERE where the strip and the wire are parallel or pass beside each other, BEFORE or
        BEYOND where they may cross in another interval on that side.
    """
    interval = unpacked(record)
    plan, plan_static = interval.plan, interval.plan_static
    size = plan.shape[1]
    row, load = result[6 : 6 + size], result[6 + size :]
    local = np.empty((2, size))
    follow_ends(interval, a1, table, solution, attached, local)
    ax, ay = strip[0, 0, 0], strip[0, 0, 1]
    strip_x, strip_y = strip[1, 0, 0] - ax, strip[1, 0, 1] - ay
    direction = 0
    while True:
        x, y = plan_static[2 * element], plan_static[2 * element + 1]
        x2, y2 = plan_static[2 * element + 2], plan_static[2 * element + 3]
        for m in range(row.size):
            x += plan[2 * element, m] * local[0, m]
            y += plan[2 * element + 1, m] * local[0, m]
            x2 += plan[2 * element + 2, m] * local[0, m]
            y2 += plan[2 * element + 3, m] * local[0, m]
        determinant = strip_y * (x2 - x) - strip_x * (y2 - y)
        if determinant == 0.0:
            return NOWHERE
        dx, dy = x - ax, y - ay
        share = (dy * (x2 - x) - dx * (y2 - y)) / determinant
        xi = (strip_x * dy - strip_y * dx) / determinant
        step = -1 if xi < 0.0 else (1 if xi > 1.0 else 0)
        if step == 0 or step == -direction:
            break
        direction = step
        element += step
        if element < 0:
            return BEFORE
        if element >= interval.height.shape[0]:
            return BEYOND
    if not 0.0 <= share <= 1.0:
        return NOWHERE
    xi = min(max(xi, 0.0), 1.0)
    height = lift(interval, element, xi, row)
    rise = rate = 0.0
    for m in range(row.size):
        rise += row[m] * local[0, m]
        rate += row[m] * local[1, m]
    result[0], result[1], result[2], result[3], result[4] = xi, share, height, rise, rate
    result[5] = give(interval, table, row, load)
    return element


@_compiled
def follow_ends(interval, a1, table, solution, attached, local):
    """Put the local coordinates of an interval at the end of a step and their rates into ``local``; see `meet`."""
    slots, ends, yielding = interval.slots, interval.ends, interval.yielding
    count, size = yielding.shape
    for j in range(size):
        change = solution[ends[j]]
        local[0, count + j] = change
    for i in range(count):
        at = slots[i]
        change = table[at + _TO_HELD]
        for j in range(size):
            change -= yielding[i, j] * local[0, count + j]
        local[1, i] = a1 * change - table[at + _TO_RATE]
        local[0, i] = table[at] + change
    for j in range(size):
        change = local[0, count + j]
        local[1, count + j] = a1 * change - attached[1, ends[j]]
        local[0, count + j] = attached[0, ends[j]] + change


@_compiled
def lift(interval, element, xi, row):
    """Put what a unit force on a point does to the local coordinates into ``row``; return the static height."""
    height, height_static = interval.height, interval.height_static
    power, static = 1.0, 0.0
    row[:] = 0.0
    for n in range(4):
        static += power * height_static[element, n]
        for m in range(row.size):
            row[m] += power * height[element, n, m]
        power *= xi
    return static


@_compiled
def give(interval, table, row, load):
    """Put what a unit force on a point does to the attachments into ``load``; return the compliance of the point."""
    slots, yielding, at_ends = interval.slots, interval.yielding, interval.at_ends
    count, size = yielding.shape
    compliance = 0.0
    for j in range(size):
        load[j] = row[count + j]
    for i in range(count):
        compliance += row[i] * row[i] * table[slots[i] - _FROM_INVERSE]
        for j in range(size):
            load[j] -= row[i] * yielding[i, j]
    for j in range(size):
        for k in range(size):
            compliance += load[j] * at_ends[j, k] * load[k]
    return compliance


@_compiled
def push(record, element, xi, force, table, pressed):
    """Add a known force on a point of an interval to ``pressed``, the forces on the attachments, and to its modes."""
    interval = unpacked(record)
    ends = interval.ends
    row, load = np.empty(interval.plan.shape[1]), np.empty(ends.size)
    lift(interval, element, xi, row)
    give(interval, table, row, load)
    for j in range(ends.size):
        pressed[ends[j]] += force * load[j]
    press(interval.slots, force, row, table)


@_compiled
def press(slots, force, row, table):
    """Add a force on a point of an interval, its attachments held, to the changes of the interval's modes."""
    for i in range(slots.size):
        table[slots[i] + _TO_HELD] += force * row[i] * table[slots[i] - _FROM_INVERSE]


@_compiled
def apply(record, row, load, force, table, solution):
    """Add what a force on a point changes in a step; ``row`` and ``load`` are those of the point, see `meet`."""
    interval = unpacked(record)
    reached, columns = interval.reached, interval.columns
    press(interval.slots, force, row, table)
    for i in range(reached.size):
        total = 0.0
        for j in range(load.size):
            total += columns[i, j] * load[j]
        solution[reached[i]] += force * total


@_compiled
def place(record, row, height, table, attached, element, xi, out):
    """Put a point of a wire into ``out``, shape (3,); ``row`` and ``height`` are those of the point, see `meet`."""
    interval = unpacked(record)
    slots, ends, plan, plan_static = interval.slots, interval.ends, interval.plan, interval.plan_static
    count = slots.size
    x, y = plan_static[2 * element], plan_static[2 * element + 1]
    x2, y2, z = plan_static[2 * element + 2], plan_static[2 * element + 3], height
    for m in range(row.size):
        value = table[slots[m]] if m < count else attached[0, ends[m - count]]
        x += plan[2 * element, m] * value
        y += plan[2 * element + 1, m] * value
        x2 += plan[2 * element + 2, m] * value
        y2 += plan[2 * element + 3, m] * value
        z += row[m] * value
    out[0], out[1], out[2] = x + xi * (x2 - x), y + xi * (y2 - y), z
