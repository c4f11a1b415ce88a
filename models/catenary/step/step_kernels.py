"""One step of a line in one call, for numba: what `models.catenary.step.plain_step` does, in the same order.

Other files `*_kernels.py` hold the parts. Each has one subject, and none may import anything else of the project:
they are joined to one source and compiled from a copy in the user's cache (`models.catenary.step.engine_choice`), which
cannot see other files. What belongs together is handed over together, because a call costs more for every array.
"""

import math
from collections import namedtuple

import numpy as np

from models.catenary.step.attachment_kernels import Lanes, LanesWork, load, solve
from models.catenary.step.contact_kernels import (
    NOWHERE,
    Points,
    Records,
    Wires,
    add_column,
    bend,
    dropper_at,
    find,
    interval_at,
    point,
    press,
    put_place,
)
from models.catenary.step.local_kernels import LACKING, SINGULAR, SOLVED, solve_local
from models.catenary.step.mode_kernels import Modes, advance
from models.catenary.step.vector_kernels import compiled, floats64, ints64, part, uints32, uints64

#: Answers of `step`.
DONE, NO_SOLUTION, NOT_SETTLED, INTERVAL_LACKS, DROPPER_LACKS = range(5)
#: Droppers: their elongation by the attachments, ``rows``, ``columns`` and ``values``; ``at_rest``, elastic force [N];
#: ``stiffness``, ``delay`` and ``unilateral`` of the `DropperLaw`; ``known``, twice its rest_load, shape (n_attached,).
Droppers = namedtuple("Droppers", "rows columns values at_rest stiffness delay unilateral known")
#: What a step leaves in ``report``: how far it has come; what lacks; how many forces are on the wires, how many
#: droppers slack; an interval before a strip whose record is lacking, or -1.
STAGE, LACKS, LOADED, SLACK, AHEAD = range(5)
_BEGUN = 1
_1 = np.uint64(1)


@compiled
def step(book, moving, state, strips, given, records, work, report, out):
    """Advance a line by one step, or as far as the records of intervals and droppers reach: then call again.

    Parameters
    ----------
    book : ndarray of int
        Of the arrays of the line and those to work in, see `models.catenary.step.array_book` and `_opened`. The first:
        a1, then ``contact`` of `law_of`.
    moving : (attached, table, pull)
        attached : ndarray, shape (2, n_attached)
        table, pull
            See `models.catenary.step.mode_kernels.advance`.
    state : (element, impact_velocity, loaded, load, slack, compensation)
        As in a `CatenaryState`; the first two are replaced.
    strips : (strip, compliance)
        As in a `StripMotion`.
    given : (loaded, load)
        Known forces on the wires at the end of the step.
    records : Records
    work : (local, whole, numbers, row, load, chosen), arrays to work in
    report : ndarray of int, shape (5,)
        See above; all zero at first.
    out : (force, point, loaded, load, points, slack, lacks, pull)
        force, point
            As in a `ContactResult`.
        loaded, load
            Forces on the wires at the end of the step.
        points, slack, lacks, pull
            ``results`` of `solve_local`.

    Returns
    -------
    int
        DONE, NO_SOLUTION, NOT_SETTLED, INTERVAL_LACKS or DROPPER_LACKS; ``report[LACKS]`` says which.
    """
    constants, records = floats64(book, 0), Records(*records)
    lanes, modes, droppers, wires, lanes_work, arrays = _opened(book)
    change, pressed, free = arrays
    attached, table, pull = moving
    element, impact = state[0], state[1]
    whole, numbers, chosen, size = work[1], work[2], work[5], attached.shape[1]
    points = Points(
        whole[0], whole[1], whole[2], whole[3], whole[4],
        numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5], numbers[6],
        work[3], work[4],
    )  # fmt: skip
    motion = constants[0], table, change, attached
    if report[STAGE] < _BEGUN:
        lacking = _unknown(wires, records, state[2], given[0])
        if lacking >= 0:
            report[LACKS] = lacking
            return INTERVAL_LACKS
        _begin(lanes, droppers, wires, records, moving, state, points, change, pressed, lanes_work)
        _push(wires, records, given, points, motion)
        _put_free(droppers, motion, free)
        report[STAGE] = _BEGUN
    lacking, count = _meet(wires, records, element, impact, strips[0], constants[4], motion, work[0], points, report)
    if lacking >= 0:
        report[LACKS] = lacking
        return INTERVAL_LACKS
    n = 0
    for i in range(count):
        # One that was closed stays among the contacts: other forces of the step may keep it so.
        if points.penetration[i] > 0.0 or points.impact[i] > 0.0:
            chosen[n] = i
            n += 1
    contacts = chosen[:n]
    answer = solve_local(
        records, points, contacts, strips[1], free, droppers.unilateral, constants[0], constants[1:], size, table,
        state[4], out[4:],
    )  # fmt: skip
    if answer >= LACKING:
        report[LACKS] = answer - LACKING
        return DROPPER_LACKS
    if answer != SOLVED:
        report[SLACK], report[LOADED] = _count(out[5]), n
        return NO_SOLUTION if answer == SINGULAR else NOT_SETTLED
    _apply(records, points, contacts, out, motion)
    _follow(modes, motion, pull)
    _note(points, contacts, given, impact, out, report)
    _put_result(wires, records, points, contacts, count, strips[0], motion, out)
    return DONE


@part
def _opened(book):
    """Return the arrays of a book: those of the line, and those to work in."""
    lanes = Lanes(
        uints32(book, 1), uints32(book, 2), uints32(book, 3), uints32(book, 4), floats64(book, 5), uints64(book, 6),
        floats64(book, 7), floats64(book, 8), uints64(book, 9), uints64(book, 10), uints64(book, 11), uints64(book, 12),
    )  # fmt: skip
    modes = Modes(
        uints64(book, 13), floats64(book, 14), uints32(book, 15), floats64(book, 16),
        uints64(book, 17), floats64(book, 18), uints32(book, 19), floats64(book, 20),
    )  # fmt: skip
    droppers = Droppers(
        uints32(book, 21), uints32(book, 22), floats64(book, 23), floats64(book, 24), floats64(book, 25),
        floats64(book, 26), floats64(book, 27), floats64(book, 28),
    )  # fmt: skip
    wires = Wires(ints64(book, 29), floats64(book, 30), floats64(book, 31), ints64(book, 32), ints64(book, 33))
    work = LanesWork(floats64(book, 34), floats64(book, 35), floats64(book, 36), floats64(book, 37), floats64(book, 38))
    return lanes, modes, droppers, wires, work, (floats64(book, 39), floats64(book, 40), floats64(book, 41))


@part
def _unknown(wires, records, loaded, given):
    """Return an interval under a known force whose record is lacking, or -1."""
    for places in (loaded, given):
        for i in range(places.shape[0]):
            number = wires.interval[wires.first[places[i, 0]] + places[i, 1]]
            if records.intervals[number] < 0:
                return number
    return -1


@part
def _begin(lanes, droppers, wires, records, moving, state, points, change, pressed, lanes_work):
    """Find the change of the attachments under the forces at the beginning of the step, and known ones at its end."""
    attached, table, pull = moving
    loaded, force, slack, compensation = state[2], state[3], state[4], state[5]
    for i in range(pressed.size):
        pressed[i] = droppers.known[i]
    for k in range(slack.size):
        for i in range(droppers.rows[slack[k]], droppers.rows[slack[k] + 1]):
            pressed[droppers.columns[i]] -= compensation[k] * droppers.values[i]
    for k in range(loaded.shape[0]):
        number = wires.interval[wires.first[loaded[k, 0]] + loaded[k, 1]]
        record, place = records.intervals[number], loaded[k, 1] - wires.begins[number]
        row, share = points.row[0], points.load[0]
        point(records, record, place, force[k, 0], table, row, share)
        press(records, record, row, force[k, 1], table)
        interval = interval_at(records.whole, record)
        for j in range(interval.size):
            pressed[records.whole[interval.ends + j]] += force[k, 1] * share[j]
    load(lanes, attached, pressed, pull, lanes_work)
    solve(lanes, lanes_work, change)


@part
def _push(wires, records, given, points, motion):
    """Add what given forces at the end of the step change in it."""
    _, table, change, _ = motion
    places, force = given
    for k in range(places.shape[0]):
        number = wires.interval[wires.first[places[k, 0]] + places[k, 1]]
        record, place = records.intervals[number], places[k, 1] - wires.begins[number]
        point(records, record, place, force[k, 0], table, points.row[0], points.load[0])
        press(records, record, points.row[0], force[k, 1], table)
        bend(records, record, points.load[0], force[k, 1], change)


@part
def _put_free(droppers, motion, free):
    """Put the droppers' pulls at the end of the step, if they could push, into ``free``; see `DropperLaw.pull`."""
    a1, _, change, attached = motion
    for i in range(free.size):
        elongation = 0.0
        for k in range(droppers.rows[i], droppers.rows[i + 1]):
            j = droppers.columns[k]
            rate = a1 * change[j] - attached[1, j]
            elongation += droppers.values[k] * (attached[0, j] + change[j] + droppers.delay[i] * rate)
        free[i] = droppers.at_rest[i] + droppers.stiffness[i] * elongation


@part
def _meet(wires, records, element, impact, strips, gap, motion, local, points, report):
    """Find all strips that cross a wire at the end of the step, forces found inside it left out.

    Returns
    -------
    (int, int)
        An interval whose record is lacking, or -1; how many points there are.
    """
    count = 0
    place = np.empty(3)
    report[AHEAD] = -1
    for s in range(wires.period.size):
        for p in range(strips.shape[0]):
            strip = strips[p]
            found = find(wires, records, s, strip, element[p, s], motion, local, place)
            if found == NOWHERE:
                continue
            if found < NOWHERE:
                return NOWHERE - 1 - found, count
            element[p, s] = found
            number = wires.interval[wires.first[s] + found]
            record = records.intervals[number]
            points.pantograph[count], points.section[count], points.element[count] = p, s, found
            points.record[count], points.place[count] = record, found - wires.begins[number]
            points.xi[count], points.engagement[count], points.impact[count] = place[0], place[2], impact[p, s]
            row = points.row[count]
            height, points.compliance[count] = point(
                records, record, points.place[count], place[0], motion[1], row, points.load[count]
            )
            points.height[count] = height
            rate = 0.0
            interval = interval_at(records.whole, record)
            for m in range(interval.modes + interval.size):
                height += row[m] * local[0, m]
                rate += row[m] * local[1, m]
            a, b = strip[0, :, 2], strip[1, :, 2]
            points.penetration[count] = a[0] + place[1] * (b[0] - a[0]) - (height - gap)
            points.velocity[count] = a[1] + place[1] * (b[1] - a[1]) - rate
            ahead = _next(wires, s, number)
            if records.intervals[ahead] < 0:
                report[AHEAD] = ahead
            count += 1
    return -1, count


@part
def _next(wires, section, number):
    """Return the interval after another; the last one of a wire that ends follows itself."""
    last = wires.interval[wires.first[section + 1] - 1]
    if number < last:
        return number + 1
    return wires.interval[wires.first[section]] if wires.period[section] > 0.0 else number


@part
def _apply(records, points, contacts, out, motion):
    """Add what contacts and slack droppers change within the step."""
    _, table, change, _ = motion
    of_points, is_slack, lacks = out[4], out[5], out[6]
    for i in contacts:
        force = of_points[i, 0]
        if force != 0.0:
            press(records, points.record[i], points.row[i], force, table)
            bend(records, points.record[i], points.load[i], force, change)
    for j in range(is_slack.size):
        if is_slack[j]:
            dropper = dropper_at(records.whole, records.droppers[j])
            add_column(
                records.data,
                np.uint64(dropper.column),
                np.uint64(dropper.first),
                np.uint64(dropper.reach),
                -lacks[j],
                change,
            )


@part
def _follow(modes, motion, pull):
    """Replace the motion by that at the end of the step."""
    a1, table, change, attached = motion
    for i in range(change.size):
        attached[0, i] += change[i]
        attached[1, i] = a1 * change[i] - attached[1, i]
    advance(modes, a1, change, table, pull)


@part
def _note(points, contacts, given, impact, out, report):
    """Record the forces at the end of the step; the next one begins with them."""
    of_points, loaded, load = out[4], out[2], out[3]
    count = given[0].shape[0]
    for i in range(count):
        for j in range(2):
            loaded[i, j], load[i, j] = given[0][i, j], given[1][i, j]
    for p in range(out[0].shape[0]):
        for s in range(out[0].shape[1]):
            impact[p, s] = 0.0
    for i in contacts:
        loaded[count, 0], loaded[count, 1] = points.section[i], points.element[i]
        load[count, 0], load[count, 1] = points.xi[i], of_points[i, 0]
        count += 1
        if of_points[i, 1] > 0.0:
            before = points.impact[i]
            impact[points.pantograph[i], points.section[i]] = before if before > 0.0 else max(of_points[i, 2], 1e-6)
    report[LOADED] = count
    report[SLACK] = _count(out[5])


@part
def _put_result(wires, records, points, contacts, count, strips, motion, out):
    """Put the contacts into the result."""
    _, table, _, attached = motion
    force, place, of_points = out[0], out[1], out[4]
    for p in range(force.shape[0]):
        for s in range(force.shape[1]):
            force[p, s] = 0.0
            for i in range(3):
                place[p, s, i] = math.nan
    for i in contacts:
        force[points.pantograph[i], points.section[i]] = of_points[i, 0]
    for i in range(count):
        p, s = points.pantograph[i], points.section[i]
        put_place(records, points, i, table, attached, place[p, s])
        if wires.period[s] > 0.0:  # points travel on along with their strips
            laps = (0.5 * (strips[p, 0, 0, 0] + strips[p, 1, 0, 0]) - place[p, s, 0]) / wires.period[s]
            place[p, s, 0] += wires.period[s] * math.floor(laps + 0.5)


@part
def _count(is_slack):
    """Return how many droppers are slack."""
    count = 0
    for j in range(is_slack.size):
        count += is_slack[j]
    return count
