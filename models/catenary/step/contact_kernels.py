"""Where strips cross the contact wires, for numba, and how the wires give way there.

The same as `models.catenary.contact_and_slack.contact_wire` and `wire_response` say, with records of intervals in place
of objects.
"""

import math
from collections import namedtuple

import numpy as np

from models.catenary.step.mode_kernels import AMPLITUDE, RATE, ROWS
from models.catenary.step.vector_kernels import LANES, get, nothing, part, put, reader

#: What `find` returns where a strip crosses no wire; a number below says which interval's record is lacking.
NOWHERE = -1
#: The contact wires, one after the other: ``first`` element of each, and one more; ``starts`` of the elements along
#: the track, one more for each wire; ``period``; the ``interval`` of each element, counted over all wires; the element
#: of its wire that each interval ``begins`` with.
Wires = namedtuple("Wires", "first starts period interval begins")
wires_of = reader(Wires, "iffii")
#: Running surfaces, wire after wire: ``first`` knot of each, and one more; ``position``, ``height`` and ``slope`` of
#: the knots; see `models.catenary.condition.running_surface`.
Surfaces = namedtuple("Surfaces", "first position height slope")
surfaces_of = reader(Surfaces, "ifff")
#: What is known of intervals and droppers: ``data``, record after record; ``whole``, the same memory as whole numbers;
#: where in it the record of each of the ``intervals`` and ``droppers`` begins, below 0 if it is not there.
Records = namedtuple("Records", "data whole intervals droppers")
records_of = reader(Records, "fiii")
#: An interval's record: ``modes``, ``size`` (displacements of attachments), ``elements``, ``reach`` (displacements
#: that loads at its attachments reach, from ``first`` on) and ``stretched`` (droppers); then where in the data its
#: parts begin: ``slots``, the numbers of its modes in the units; ``ends``, the places of its attachments'
#: displacements; ``droppers``, those that they stretch; of its modes ``inverse``, 1 / K_hat, ``back``,
#: -2 lambda / K_hat, and ``carried``, a2 / mu; ``plan`` to ``height_static`` of the `WireInterval`;
#: ``yielding`` and ``at_ends`` of the `IntervalResponse`, and its ``columns`` with their ``dropper_force``, both by
#: displacements of its attachments. Offsets take the compiler far less time than arrays made of them.
Interval = namedtuple(
    "Interval",
    "modes size elements reach first stretched slots ends droppers inverse back carried "
    "plan plan_static height height_static yielding at_ends columns stretch",
)
#: A dropper's record: the same for a force in it.
Dropper = namedtuple("Dropper", "reach first stretched droppers column stretch")
#: Points of wires, and the strips above them: see `WirePoint` and `ContactCandidate`. ``record`` says where the
#: interval's record is, ``place`` which element of the interval it is on; ``force``, ``depth`` and ``rate`` come
#: of the step, ``penetration`` and ``velocity`` were without forces. ``row`` and ``load``: as many numbers a point as
#: the largest interval needs; ``contacts``: which points may be such.
Points = namedtuple(
    "Points",
    "pantograph section element record place contacts "
    "xi engagement height compliance penetration velocity impact force depth rate row load",
)
points_of = reader(Points, "iiiiii" + 12 * "f")
#: A strip farther than this from the ends of a wire does not meet it [m]; a guess farther off is replaced by a search.
_FAR, _FAR_OFF = 1.0, 5.0
#: Widths over which a contact sets in [m], see `models.catenary.contact_and_slack.crossing`.
_STRIP_EDGE, _WIRE_EDGE = 0.05, 1.0
_0, _LANES = np.uint64(0), np.uint64(LANES)
#: A motion between steps: displacements ``x`` and velocities ``v`` of the attachments in lanes, ``table`` and ``pull``
#: of `advance`, and ``driven``, zeros, in which forces on the wires move modes within a step.
Moving = namedtuple("Moving", "x v table driven pull")
moving_of = reader(Moving, "fffff")
#: How a line moves in a step: ``a1`` and ``a2`` of Newmark's method; ``attached`` of the `LineMotion`; ``table``,
#: ``driven`` and ``pull`` as above; ``change`` of the attachments in lanes, and their ``slots`` in these.
Motion = namedtuple("Motion", "a1 a2 attached table driven pull change slots")


@part
def interval_at(whole, at):
    """Return the record of an interval that begins at ``at``: six whole numbers, then part after part."""
    n, e, k, r, first, d = whole[at], whole[at + 1], whole[at + 2], whole[at + 3], whole[at + 4], whole[at + 5]
    m, slots = n + e, at + 6
    ends = slots + n
    droppers = ends + e
    inverse = droppers + d
    plan = inverse + 3 * n
    plan_static = plan + 2 * (k + 1) * m
    height = plan_static + 2 * (k + 1)
    height_static = height + 4 * k * m
    yielding = height_static + 4 * k
    at_ends = yielding + n * e
    columns = at_ends + e * e
    return Interval(
        n, e, k, r, first, d, slots, ends, droppers, inverse, inverse + n, inverse + 2 * n, plan, plan_static, height,
        height_static, yielding, at_ends, columns, columns + r * e,
    )  # fmt: skip


@part
def dropper_at(whole, at):
    """Return the record of a dropper that begins at ``at``."""
    r, first, d = whole[at], whole[at + 1], whole[at + 2]
    return Dropper(r, first, d, at + 3, at + 3 + d, at + 3 + d + r)


@part
def own(values, points, i):
    """Return the part of ``row`` or ``load`` that belongs to a point."""
    width = values.size // points.xi.size
    return values[i * width : (i + 1) * width]


@part
def reached(first, count, place, size):
    """Return which of ``count`` rows from ``first`` on, round the end, a displacement is; -1 if none."""
    offset = place - first
    if offset < 0:
        offset += size
    return offset if offset < count else -1


@part
def find(wires, records, section, strip, guess, motion, local, place):
    """Return the element of a wire that a strip crosses at the end of a step, walking from ``guess``.

    Parameters
    ----------
    strip : ndarray, shape (2, 2, 3)
        Ends A and B; position and velocity.
    motion : Motion
    local : (ndarray, ndarray)
        Local coordinates of its interval at the end of the step and their rates, forces found inside it left out.
    place : ndarray, shape (3,)
        Shares of the way along the element and along the strip; how much of the contact acts.
    """
    first = wires.first[section]
    starts, period = wires.starts[first + section : wires.first[section + 1] + section + 1], wires.period[section]
    last, nearest, farthest = starts.size - 2, min(strip[0, 0, 0], strip[1, 0, 0]), max(strip[0, 0, 0], strip[1, 0, 0])
    if not (period > 0.0 or (farthest > starts[0] - _FAR and nearest < starts[-1] + _FAR)):
        return NOWHERE
    middle = (strip[0, 0, 0] + strip[1, 0, 0]) / 2.0
    shift = math.floor((middle - starts[0]) / period) * period if period > 0.0 else 0.0
    if not abs(middle - shift) < math.inf:
        return NOWHERE
    element = _first_element(starts, guess, middle - shift)
    number, direction, has_turned = -1, 0, False
    while True:
        if wires.interval[first + element] != number:
            number = wires.interval[first + element]
            record = records.intervals[number]
            if record < 0:
                return NOWHERE - 1 - number
            follow_ends(records, record, motion, local)
        share, xi = _crossing(strip, shift, records, record, element - wires.begins[number], local)
        if share == math.inf:
            return NOWHERE
        step = -1 if xi < 0.0 else (1 if xi > 1.0 else 0)
        if step in (0, -direction):
            break
        direction = step
        element += step
        if not 0 <= element <= last:
            if period == 0.0 or has_turned:  # a strip along the track may cross nowhere near
                return NOWHERE
            has_turned = True
            element -= step * (last + 1)
            shift += step * period
    if not 0.0 <= share <= 1.0:
        return NOWHERE
    xi = min(max(xi, 0.0), 1.0)
    x = starts[element] + xi * (starts[element + 1] - starts[element])
    from_wire_end = math.inf if period > 0.0 else min(x - starts[0], starts[-1] - x)
    length = math.hypot(strip[1, 0, 0] - strip[0, 0, 0], strip[1, 0, 1] - strip[0, 0, 1])
    from_strip_end = min(share, 1.0 - share) * length
    place[0], place[1] = xi, share
    place[2] = min(1.0, from_strip_end / _STRIP_EDGE) * min(1.0, from_wire_end / _WIRE_EDGE)
    return element


@part
def _first_element(starts, guess, x):
    """Return the element to begin walking with."""
    last = starts.size - 2
    if 0 <= guess <= last and abs(starts[guess] - x) < _FAR_OFF:
        return guess
    return last_before(starts, 0, last, x)


@part
def locate(wires, section, x):
    """Return the element at a position of the track and the share of the way along it; see `ContactWire.locate`."""
    first, last = wires.first[section] + section, wires.first[section + 1] + section - 1
    if wires.period[section] > 0.0:
        x -= math.floor((x - wires.starts[first]) / wires.period[section]) * wires.period[section]
    i = last_before(wires.starts, first, last, x)
    return i - first, (x - wires.starts[i]) / (wires.starts[i + 1] - wires.starts[i])


@part
def last_before(values, low, high, x):
    """Return which of rising values, between two of them, is the last below ``x``; the first of them if none is."""
    while low < high:
        middle = (low + high + 1) // 2
        if values[middle] < x:
            low = middle
        else:
            high = middle - 1
    return low


@part
def _crossing(strip, shift, records, record, element, local):
    """Return where strip and element cross, shares of the way along the strip and along it; infinity if parallel."""
    interval, data = interval_at(records.whole, record), records.data
    size = interval.modes + interval.size
    static, plan = interval.plan_static + 2 * element, interval.plan + 2 * element * size
    x, y, x2, y2 = data[static], data[static + 1], data[static + 2], data[static + 3]
    for m in range(size):
        x += data[plan + m] * local[0][m]
        y += data[plan + size + m] * local[0][m]
        x2 += data[plan + 2 * size + m] * local[0][m]
        y2 += data[plan + 3 * size + m] * local[0][m]
    strip_x, strip_y = strip[1, 0, 0] - strip[0, 0, 0], strip[1, 0, 1] - strip[0, 0, 1]
    wire_x, wire_y = x2 - x, y2 - y
    determinant = strip_y * wire_x - strip_x * wire_y
    if determinant == 0.0:
        return math.inf, 0.0
    dx, dy = x - (strip[0, 0, 0] - shift), y - strip[0, 0, 1]
    return (dy * wire_x - dx * wire_y) / determinant, (strip_x * dy - strip_y * dx) / determinant


@part
def surface_at(surfaces, wires, section, x):
    """Return height and slope of a wire's running surface at a place along the track; see `SurfacePiece.at`."""
    period = wires.period[section]
    if period > 0.0:
        x -= math.floor((x - wires.starts[wires.first[section] + section]) / period) * period
    low, last = surfaces.first[section], surfaces.first[section + 1] - 1
    x = min(max(x, surfaces.position[low]), surfaces.position[last])
    i = last_before(surfaces.position, low, last - 1, x)
    h, d = surfaces.position[i + 1] - surfaces.position[i], surfaces.height[i + 1] - surfaces.height[i]
    t = (x - surfaces.position[i]) / h
    a, b = h * surfaces.slope[i] - d, d - h * surfaces.slope[i + 1]
    between = a * (1.0 - t) + b * t
    slope = (d + (1.0 - 2.0 * t) * between + t * (1.0 - t) * (b - a)) / h
    return surfaces.height[i] + t * (d + (1.0 - t) * between), slope


@part
def follow_ends(records, record, motion, local):
    """Put the local coordinates of an interval at the end of a step and their rates into ``local``; see `find`."""
    interval, data, whole = interval_at(records.whole, record), records.data, records.whole
    count, size, table = interval.modes, interval.size, motion.table
    for j in range(size):
        end = whole[interval.ends + j]
        local[0][count + j], local[1][count + j] = motion.change[motion.slots[end]], motion.attached[1, end]
    for i in range(count):
        slot, yielding = whole[interval.slots + i], interval.yielding + i * size
        at, carried = row_of(slot, AMPLITUDE), data[interval.carried + i]
        rate = table[row_of(slot, RATE)]
        moved = (
            motion.driven[slot] + data[interval.inverse + i] * motion.a2 * rate + data[interval.back + i] * table[at]
        )
        for j in range(size):
            moved -= data[yielding + j] * (local[0][count + j] - carried * local[1][count + j])
        local[0][i], local[1][i] = table[at] + moved, motion.a1 * moved - rate
    for j in range(size):
        local[1][count + j] = motion.a1 * local[0][count + j] - local[1][count + j]
        local[0][count + j] += motion.attached[0, whole[interval.ends + j]]


@part
def row_of(slot, row):
    """Return where a row of the table has the number of a mode."""
    return (slot // LANES * ROWS + row) * LANES + slot % LANES


@part
def point(records, record, element, xi, row, load):
    """Return the static height of a point of an interval and its compliance.

    Parameters
    ----------
    element : int
        Of the interval.
    row, load : ndarray, shape (m,), (e,)
        Result: what a unit force on the point does to the local coordinates; to the displacements of the attachments,
        directly and through the modes.
    """
    interval, data = interval_at(records.whole, record), records.data
    count, size = interval.modes, interval.size
    m = count + size
    xi2 = xi * xi
    xi3 = xi2 * xi
    at, height = interval.height_static + 4 * element, interval.height + 4 * element * m
    static = data[at] + xi * data[at + 1] + xi2 * data[at + 2] + xi3 * data[at + 3]
    for i in range(m):
        row[i] = data[height + i] + xi * data[height + m + i]
        row[i] += xi2 * data[height + 2 * m + i] + xi3 * data[height + 3 * m + i]
    compliance = 0.0
    for j in range(size):
        load[j] = row[count + j]
    for i in range(count):
        compliance += row[i] * row[i] * data[interval.inverse + i]
        for j in range(size):
            load[j] -= row[i] * data[interval.yielding + i * size + j]
    for j in range(size):
        for k in range(size):
            compliance += load[j] * data[interval.at_ends + j * size + k] * load[k]
    return static, compliance


@part
def press(records, record, row, force, driven):
    """Add what a force on a point of an interval changes of its modes, the attachments held, to ``driven``."""
    interval = interval_at(records.whole, record)
    for i in range(interval.modes):
        driven[records.whole[interval.slots + i]] += force * row[i] * records.data[interval.inverse + i]


@part
def drive(records, record, motion):
    """Add what forces changed of an interval's modes to their motion, and to their pull in the next step."""
    interval, data, whole = interval_at(records.whole, record), records.data, records.whole
    for i in range(interval.modes):
        slot, yielding = whole[interval.slots + i], interval.yielding + i * interval.size
        inverse, moved = data[interval.inverse + i], motion.driven[slot]
        if moved == 0.0:  # by another force on the interval
            continue
        motion.driven[slot] = 0.0
        motion.table[row_of(slot, AMPLITUDE)] += moved
        motion.table[row_of(slot, RATE)] += motion.a1 * moved
        value = motion.a1 * (data[interval.carried + i] - motion.a2 * inverse) - data[interval.back + i]
        value *= moved / inverse
        for j in range(interval.size):
            motion.pull[motion.slots[whole[interval.ends + j]]] += value * data[yielding + j]


@part
def bend(data, column, first, reach, load, force, change, slots, bent):
    """Add what forces on attachments change in a step.

    Parameters
    ----------
    data, column
        Responses to unit forces, ``reach`` displacements from ``first`` on, round the end, one after the other.
    load : ndarray
        The force of each, for a ``force`` of one.
    change, slots
        Of `Motion`.
    bent : ndarray, shape (n_attached,)
        To work in.
    """
    begin, width, of = np.uint64(first), np.uint64(reach), np.uint64(column)
    here, whole = np.uint64(slots.size) - begin, width // _LANES * _LANES
    for i in range(_0, whole, _LANES):
        moved = nothing()
        for j in range(np.uint64(load.size)):
            moved += get(data, of + j * width + i) * (force * load[j])
        put(bent, i, moved)
    for i in range(whole, width):
        bent[i] = 0.0
        for j in range(np.uint64(load.size)):
            bent[i] += force * load[j] * data[of + j * width + i]
    for i in range(width):
        at = begin + i if i < here else i - here
        change[slots[at]] += bent[i]


@part
def moved_by(records, points, i, j, size):
    """Return how far the wire is moved at one point by a unit force at another [m/N]; see `WirePoint.moved_by`."""
    if i == j:
        return points.compliance[i]
    data, whole, moved = records.data, records.whole, 0.0
    here, there = interval_at(whole, points.record[i]), interval_at(whole, points.record[j])
    load, row = own(points.load, points, i), own(points.row, points, i)
    other_load, other_row = own(points.load, points, j), own(points.row, points, j)
    for k in range(here.size):
        at = reached(there.first, there.reach, whole[here.ends + k], size)
        if at >= 0:
            for m in range(there.size):
                moved += load[k] * data[there.columns + m * there.reach + at] * other_load[m]
    if points.record[i] == points.record[j]:
        for k in range(here.modes):
            moved += row[k] * other_row[k] * data[here.inverse + k]
    return moved


@part
def put_place(records, points, i, motion, out):
    """Put a point of a wire into ``out``, shape (3,) [m], as the motion stands."""
    interval, data, whole = interval_at(records.whole, points.record[i]), records.data, records.whole
    size, xi, row = interval.modes + interval.size, points.xi[i], own(points.row, points, i)
    static, plan = interval.plan_static + 2 * points.place[i], interval.plan + 2 * points.place[i] * size
    x, y, z = data[static], data[static + 1], points.height[i]
    x += xi * (data[static + 2] - x)
    y += xi * (data[static + 3] - y)
    for m in range(size):
        at = whole[interval.slots + m]  # the ends follow the slots
        value = motion.table[row_of(at, AMPLITUDE)] if m < interval.modes else motion.attached[0, at]
        x += ((1.0 - xi) * data[plan + m] + xi * data[plan + 2 * size + m]) * value
        y += ((1.0 - xi) * data[plan + size + m] + xi * data[plan + 3 * size + m]) * value
        z += row[m] * value
    out[0], out[1], out[2] = x, y, z
