"""The two halves of a line's step in one pass each, for numba.

The same arithmetic as `models.catenary.stepping.Stepper`, but nothing is read twice and no intermediate array is
written: how much is read and written sets the pace.
Indices are unsigned, which spares the compiler the question whether they count from the end.

This module imports nothing of the project: it is compiled from a copy in the user's cache
(`models.catenary.compiled`).
"""

import numpy as np
from numba import njit

#: Columns of a chunk of the coupling.
WIDTH = 6
#: Sums may be reordered, not more: infinities and NaN stay what they are.
_compiled = njit(cache=True, fastmath={"reassoc", "contract", "nsz"}, error_model="numpy")
_0, _1, _2, _3, _4, _5, _6 = (np.uint64(i) for i in range(7))
_FIRST, _COUNT, _END, _ENTRY = _0, _1, _2, _3


@_compiled
def prepare(groups, chunks, rates, coupling, stiffness, inverse, moved, modal, momentum, held, pull):
    """Find what modes do in the next step, were the attachments held, and what they do to the ends of their intervals.

    Parameters
    ----------
    groups, chunks, rates, coupling, stiffness, inverse, moved, modal, momentum
        See `finish`.
    held : ndarray, shape (n_modes,)
        Result: change of the modal amplitudes.
    pull : ndarray, shape (n_ends,)
        Result: forces on the ends.
    """
    pull[:] = 0.0
    for g in range(groups.shape[0]):
        begin, stop = groups[g, _0], groups[g, _1]
        for i in range(chunks[begin, _FIRST], chunks[stop - _1, _FIRST] + chunks[stop - _1, _COUNT]):
            held[i] = stiffness[i] * modal[0, i] + rates[begin, _1] * inverse[i] * momentum[i]
            moved[i] = rates[begin, _2] * modal[1, i] - held[i]
        draw(chunks, begin, stop, coupling, moved, pull)
    moved[:] = 0.0


@_compiled
def attachments(
    back_rows, back_columns, back, own_rows, own_columns, own, top, bottom, middle, size,
    attached, pressed, pull, right, work, solution,
):  # fmt: skip
    """Find the change of the attachments' displacements.

    Parameters
    ----------
    back_rows, back_columns, back : ndarray
        Turn of the ends back to the attachments' axes, compressed by rows.
    own_rows, own_columns, own : ndarray
        -2 K and a2 M of the attachments, an entry (k, 2) for both: upper triangles compressed by rows, each of
        which begins with its diagonal.
    top, bottom, middle, size, work
        See `solve`.
    attached : ndarray, shape (2, n_attached)
    pressed : ndarray, shape (n_attached,)
    pull : ndarray, shape (n_ends,)
    right, solution : ndarray, shape (n_attached,)
        Work space; the result.
    """
    for i in range(right.size):
        right[i] = pressed[i]
    for i in range(right.size):
        x, v = attached[0, i], attached[1, i]
        at = own_rows[i]
        total = own[at, _0] * x + own[at, _1] * v
        for k in range(at + _1, own_rows[i + _1]):
            j = own_columns[k]
            total += own[k, _0] * attached[0, j] + own[k, _1] * attached[1, j]
            right[j] += own[k, _0] * x + own[k, _1] * v
        right[i] += total
    add_product(back_rows, back_columns, back, pull, right)
    solve(top, bottom, middle, size, right, work, solution)


@_compiled
def finish(
    turn_rows, turn_columns, turn, groups, chunks, rates, coupling, stiffness, inverse, moved, a1,
    solution, ends, modal, momentum, attached, held, pull,
):  # fmt: skip
    """Let the intervals follow their attachments, replace the motion, and `prepare` the next step in the same pass.

    Parameters
    ----------
    turn_rows, turn_columns, turn : ndarray
        Turn of the attachments' displacements to the axes of the intervals, compressed by rows.
    groups : ndarray of unsigned int, shape (N_groups, 2)
        First chunk and the one after the last: as many as stay at hand in the processor's first cache, of equal rates.
    chunks : ndarray of unsigned int, shape (N, 4)
        First mode, number of modes, first of six ends, first entry of ``coupling``.
    rates : ndarray, shape (N, 3)
        a1 / mu, a2 and a2 / mu of the modes.
    coupling : ndarray
        mu G, chunk by chunk, modes by six ends.
    stiffness, inverse : ndarray, shape (n_modes,)
        -2 lambda / K_hat and 1 / K_hat.
    moved : ndarray, shape (n_modes,)
        Work space; zero before and after.
    a1 : float
    solution : ndarray, shape (n_attached,)
        Change of the attachments' displacements.
    ends : ndarray, shape (n_ends,)
        Work space.
    modal, momentum, attached : ndarray
        The motion, replaced.
    held, pull : ndarray, shape (n_modes,), (n_ends,)
        Changes of the modal amplitudes were the attachments held, of this step; both for the next step afterwards.
    """
    ends[:] = 0.0
    pull[:] = 0.0
    add_product(turn_rows, turn_columns, turn, solution, ends)
    for i in range(solution.size):
        attached[0, i] += solution[i]
        attached[1, i] = a1 * solution[i] - attached[1, i]
    for g in range(groups.shape[0]):
        begin, stop = groups[g, _0], groups[g, _1]
        follow(chunks, begin, stop, coupling, ends, moved)
        first, last = chunks[begin, _FIRST], chunks[stop - _1, _FIRST] + chunks[stop - _1, _COUNT]
        advance(
            rates[begin, _0], rates[begin, _1], rates[begin, _2], a1, stiffness[first:last], inverse[first:last],
            moved[first:last], modal[0, first:last], modal[1, first:last], momentum[first:last], held[first:last],
        )  # fmt: skip
        draw(chunks, begin, stop, coupling, moved, pull)
        for i in range(first, last):
            moved[i] = 0.0


@_compiled
def follow(chunks, begin, stop, coupling, ends, moved):
    """Add mu G times the motion of the ends to ``moved``, for some chunks."""
    entry = chunks[begin, _ENTRY]
    for b in range(begin, stop):
        first, last, end = chunks[b, _FIRST], chunks[b, _FIRST] + chunks[b, _COUNT], chunks[b, _END]
        e0, e1, e2 = ends[end], ends[end + _1], ends[end + _2]
        e3, e4, e5 = ends[end + _3], ends[end + _4], ends[end + _5]
        for i in range(first, last):
            moved[i] += (
                coupling[entry] * e0 + coupling[entry + _1] * e1 + coupling[entry + _2] * e2
                + coupling[entry + _3] * e3 + coupling[entry + _4] * e4 + coupling[entry + _5] * e5
            )  # fmt: skip
            entry += _6


@_compiled
def advance(to_momentum, a2, from_rate, a1, stiffness, inverse, moved, amplitude, rate, momentum, held):
    """Replace the motion of some modes; ``held`` is for the next step afterwards, ``moved`` what pulls on the ends.

    Short loops of few arrays each: more of them a compiler does not dare to vectorise, as arrays might overlap.
    """
    n = held.size
    for i in range(n):
        held[i] -= moved[i] * inverse[i]
    for i in range(n):
        amplitude[i] += held[i]
    for i in range(n):
        rate[i] = a1 * held[i] - rate[i]
    for i in range(n):
        momentum[i] = a1 * held[i] + to_momentum * moved[i] - momentum[i]
    for i in range(n):
        held[i] = a2 * inverse[i] * momentum[i]
    for i in range(n):
        held[i] += stiffness[i] * amplitude[i]
    for i in range(n):
        moved[i] = from_rate * rate[i] - held[i]


@_compiled
def draw(chunks, begin, stop, coupling, value, pull):
    """Add what the modes of some chunks do to the ends to ``pull``."""
    entry = chunks[begin, _ENTRY]
    for b in range(begin, stop):
        first, last, end = chunks[b, _FIRST], chunks[b, _FIRST] + chunks[b, _COUNT], chunks[b, _END]
        t0 = t1 = t2 = t3 = t4 = t5 = 0.0
        for i in range(first, last):
            t0 += coupling[entry] * value[i]
            t1 += coupling[entry + _1] * value[i]
            t2 += coupling[entry + _2] * value[i]
            t3 += coupling[entry + _3] * value[i]
            t4 += coupling[entry + _4] * value[i]
            t5 += coupling[entry + _5] * value[i]
            entry += _6
        pull[end] += t0
        pull[end + _1] += t1
        pull[end + _2] += t2
        pull[end + _3] += t3
        pull[end + _4] += t4
        pull[end + _5] += t5


@_compiled
def add_product(rows, columns, values, vector, result):
    """Add a matrix, compressed by rows, times a vector to ``result``."""
    for i in range(result.size):
        total = 0.0
        for k in range(rows[i], rows[i + _1]):
            total += values[k] * vector[columns[k]]
        result[i] += total


@_compiled
def solve(top, bottom, middle, size, load, work, solution):
    """Solve a band from both of its ends towards the middle, which are two chains that do not wait for each other.

    Parameters
    ----------
    top, bottom : ndarray, shape (p (width + 1),), (q (width + 1),)
        Cholesky factors of the first p rows, and of the last q rows from the end backwards: row j holds 1 / L_jj and
        L_j+k,j for k = 1 ... width.
    middle : ndarray, shape (width, width)
        Inverse of what is left for the rows between.
    size : ndarray of unsigned int, shape (4,)
        p, q, width, width + 1; q <= p <= q + 1.
    load : ndarray, shape (n,)
        n = p + width + q.
    work : ndarray, shape (2, p + width)
    solution : ndarray, shape (n,)
    """
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
def meet(
    strip, element, plan, plan_static, height, height_static, first, ends, following, a1,
    held, solution, modal, attached, local, row, out,
):  # fmt: skip
    """Find where a strip crosses an interval of a wire at the end of a step, forces found inside the step left out.

    The same as `models.catenary.contact_wire.ContactWire.find` and `touch` do.

    Parameters
    ----------
    strip : ndarray, shape (2, 2, 3)
        Ends A and B; position and velocity.
    element : int
        Of the interval, to begin with.
    plan, plan_static, height, height_static, first, ends : ndarray, int
        Of the `WireInterval`; ``first`` is its first mode.
    following : ndarray, shape (n_span, e)
        mu G / K_hat of the interval.
    a1 : float
    held, solution : ndarray, shape (n_modes,), (n_attached,)
        Changes in this step.
    modal, attached : ndarray, shape (2, n_modes), (2, n_attached)
        Motion at the beginning of the step.
    local : ndarray, shape (2, m)
        Work space.
    row : ndarray, shape (m,)
        Result: what unit local coordinates lift the point by.
    out : ndarray, shape (5,)
        Results: share of the way along the element and along the strip, static height, rise and its rate.

    Returns
    -------
    int
        Element of the interval; -1 where the strip crosses none of them.
    """
    count, size = following.shape
    for j in range(size):
        change = solution[ends[j]]
        local[0, count + j] = change
    for i in range(count):
        change = held[first + i]
        for j in range(size):
            change -= following[i, j] * local[0, count + j]
        local[1, i] = a1 * change - modal[1, first + i]
        local[0, i] = modal[0, first + i] + change
    for j in range(size):
        change = local[0, count + j]
        local[1, count + j] = a1 * change - attached[1, ends[j]]
        local[0, count + j] = attached[0, ends[j]] + change
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
            return -1
        dx, dy = x - ax, y - ay
        share = (dy * (x2 - x) - dx * (y2 - y)) / determinant
        xi = (strip_x * dy - strip_y * dx) / determinant
        step = -1 if xi < 0.0 else (1 if xi > 1.0 else 0)
        if step == 0 or step == -direction:
            break
        direction = step
        element += step
        if element < 0 or element >= height.shape[0]:
            return -1
    if not 0.0 <= share <= 1.0:
        return -1
    xi = min(max(xi, 0.0), 1.0)
    out[0], out[1] = xi, share
    out[2], out[3], out[4] = 0.0, 0.0, 0.0
    power = 1.0
    row[:] = 0.0
    for n in range(4):
        out[2] += power * height_static[element, n]
        for m in range(row.size):
            row[m] += power * height[element, n, m]
        power *= xi
    for m in range(row.size):
        out[3] += row[m] * local[0, m]
        out[4] += row[m] * local[1, m]
    return element


@_compiled
def place(plan, plan_static, row, height, first, count, ends, modal, attached, element, xi, out):
    """Put a point of a wire into ``out``, shape (3,); ``row`` and ``height`` are those of the point, see `meet`."""
    x, y = plan_static[2 * element], plan_static[2 * element + 1]
    x2, y2, z = plan_static[2 * element + 2], plan_static[2 * element + 3], height
    for m in range(row.size):
        value = modal[0, first + m] if m < count else attached[0, ends[m - count]]
        x += plan[2 * element, m] * value
        y += plan[2 * element + 1, m] * value
        x2 += plan[2 * element + 2, m] * value
        y2 += plan[2 * element + 3, m] * value
        z += row[m] * value
    out[0], out[1], out[2] = x + xi * (x2 - x), y + xi * (y2 - y), z
