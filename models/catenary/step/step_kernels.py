"""One step of a line in one call, for numba: what `models.catenary.step.plain_step` does, in the same order.

Other files `*_kernels.py` hold the parts. Each has one subject, and none may import anything else of the project:
they are joined to one source and compiled from a copy in the user's cache (`models.catenary.step.engine_choice`), which
cannot see other files.
"""

import math
from collections import namedtuple

import numpy as np

from models.catenary.step.attachment_kernels import lanes_of, lanes_work_of, multiply, solve
from models.catenary.step.contact_kernels import (
    NOWHERE,
    Motion,
    bend,
    drive,
    dropper_at,
    find,
    interval_at,
    locate,
    moving_of,
    own,
    point,
    points_of,
    press,
    put_place,
    records_of,
    surface_at,
    surfaces_of,
    wires_of,
)
from models.catenary.step.local_kernels import LACKING, SINGULAR, SOLVED, solve_local
from models.catenary.step.mode_kernels import advance, modes_of
from models.catenary.step.vector_kernels import LANES, compiled, get, part, put, reader

#: Answers of `step`.
DONE, NO_SOLUTION, NOT_SETTLED, INTERVAL_LACKS, DROPPER_LACKS, NO_WIRE = range(6)
#: Droppers: their elongation by the attachments, ``rows``, ``columns`` and ``values``; ``at_rest``, elastic force [N];
#: ``stiffness``, ``delay`` and ``unilateral`` of the `DropperLaw`; ``known``, twice its rest_load, in lanes.
Droppers = namedtuple("Droppers", "rows columns values at_rest stiffness delay unilateral known")
droppers_of = reader(Droppers, "wwffffff")
#: ``numbers``: a1, a2, then ``contact`` of `law_of`, then the gap. To work in: ``change`` of the attachments in lanes,
#: ``shift`` and ``ends`` of `advance`, ``bent`` of `bend`, ``free`` pulls of the droppers and ``pull``, ``local``
#: coordinates of an interval and their ``rates``. What a step leaves: droppers that are ``slack`` (1), and what each
#: ``lacks``; ``report``, see below.
Work = namedtuple("Work", "numbers change shift ends bent free pull local rates slack lacks report")
work_of = reader(Work, "fffffffffifi")
#: ``report``: how far the step has come; what lacks; how many forces are on the wires, how many droppers slack; an
#: interval before a strip whose record is lacking, or -1.
STAGE, LACKS, LOADED, SLACK, AHEAD = range(5)
_BEGUN = 1
_0, _1, _4, _LANES = (np.uint64(i) for i in (0, 1, 4, LANES))


@compiled
def step(
    book, moving_book, attached, element, impact, loaded, load_before, slack, compensation,
    strips, yielding, given, loaded_after, load_after, force, place,
):  # fmt: skip
    """Advance a line by one step, or as far as the records of intervals and droppers reach: then call again.

    Parameters
    ----------
    book : ndarray of int
        Of Lanes, LanesWork, Modes, Droppers, Wires, Surfaces, Work, Points and Records, see
        `models.catenary.step.array_book`.
    moving_book : ndarray of int
        Of Moving.
    attached : ndarray, shape (2, n_attached)
        As in a `LineMotion`, replaced.
    element, impact, loaded, load_before, slack, compensation
        As in a `CatenaryState`; the first two are replaced.
    strips, yielding
        As in a `StripMotion`.
    given : ndarray, shape (k, 3)
        Forces that are known at the end of the step: wire, position along the track [m], force [N].
    loaded_after, load_after : ndarray, shape (n, 2)
        Result, of ``work.report[LOADED]`` forces: as in a `CatenaryState`.
    force, place
        As in a `ContactResult`.

    Returns
    -------
    int
        DONE, NO_SOLUTION, NOT_SETTLED, INTERVAL_LACKS, DROPPER_LACKS or NO_WIRE; ``work.report[LACKS]`` says which.
    """
    lanes, lanes_work, modes = lanes_of(book, 0), lanes_work_of(book, 11), modes_of(book, 13)
    droppers, wires, surfaces = droppers_of(book, 22), wires_of(book, 30), surfaces_of(book, 35)
    work, points, records = work_of(book, 39), points_of(book, 51), records_of(book, 69)
    moving, report, change, a1 = moving_of(moving_book, 0), work.report, work.change, work.numbers[0]
    motion = Motion(a1, work.numbers[1], attached, moving.table, moving.driven, moving.pull, change, lanes.slots)
    if report[STAGE] < _BEGUN:
        for k in range(given.shape[0]):
            if not 0 <= given[k, 0] < wires.period.size or given[k, 0] != math.floor(given[k, 0]):
                return NO_WIRE
            section = np.int64(given[k, 0])
            loaded_after[k, 0], load_after[k, 1] = section, given[k, 2]
            loaded_after[k, 1], load_after[k, 0] = locate(wires, section, given[k, 1])
        for known in (loaded, loaded_after[: given.shape[0]]):
            report[LACKS] = _unknown(wires, records, known)
            if report[LACKS] >= 0:
                return INTERVAL_LACKS
        for at in range(_0, np.uint64(change.size), _LANES):
            put(change, at, get(droppers.known, at) + get(moving.pull, at))
        for k in range(slack.size):
            for i in range(droppers.rows[slack[k]], droppers.rows[slack[k] + 1]):
                change[lanes.slots[droppers.columns[i]]] -= compensation[k] * droppers.values[i]
        _press_known(wires, records, loaded, load_before, points, motion)
        _press_known(wires, records, loaded_after[: given.shape[0]], load_after, points, motion)
        multiply(lanes, moving.x, moving.v, change)
        solve(lanes, lanes_work, change)
        _put_free(droppers, motion, work.free)
        report[STAGE] = _BEGUN
    report[LACKS], count = _meet(wires, surfaces, records, element, impact, strips, motion, points, work)
    if report[LACKS] >= 0:
        return INTERVAL_LACKS
    n = 0
    for i in range(count):
        # One that was closed stays among the contacts: other forces of the step may keep it so.
        if points.penetration[i] > 0.0 or points.impact[i] > 0.0:
            points.contacts[n] = i
            n += 1
    contacts = points.contacts[:n]
    answer = solve_local(records, points, contacts, yielding, droppers, work.numbers, slack, work)
    if answer >= LACKING:
        report[LACKS] = answer - LACKING
        return DROPPER_LACKS
    report[SLACK], report[LOADED] = work.slack.sum(), given.shape[0] + n
    if answer != SOLVED:
        return NO_SOLUTION if answer == SINGULAR else NOT_SETTLED
    _apply(records, points, contacts, motion, work)
    _move_attachments(modes, moving, motion, work.shift)
    advance(modes, a1, work.shift, moving.table, work.ends, moving.pull)
    _note(points, contacts, loaded_after[given.shape[0] :], load_after[given.shape[0] :], impact)
    for known in (loaded, loaded_after[: report[LOADED]]):
        for k in range(known.shape[0]):
            drive(records, records.intervals[_interval_of(wires, known, k)], motion)
    _put_result(wires, records, points, contacts, count, strips, motion, force, place)
    return DONE


@part
def _interval_of(wires, loaded, k):
    """Return the interval that a force is on."""
    return wires.interval[wires.first[loaded[k, 0]] + loaded[k, 1]]


@part
def _unknown(wires, records, loaded):
    """Return an interval under a known force whose record is lacking, or -1."""
    for k in range(loaded.shape[0]):
        number = _interval_of(wires, loaded, k)
        if records.intervals[number] < 0:
            return number
    return -1


@part
def _press_known(wires, records, loaded, force, points, motion):
    """Add known forces on the wires to the modes under them, and to the forces on the attachments."""
    row, load = own(points.row, points, 0), own(points.load, points, 0)
    for k in range(loaded.shape[0]):
        number = _interval_of(wires, loaded, k)
        record = records.intervals[number]
        point(records, record, loaded[k, 1] - wires.begins[number], force[k, 0], row, load)
        press(records, record, row, force[k, 1], motion.driven)
        interval = interval_at(records.whole, record)
        for j in range(interval.size):
            motion.change[motion.slots[records.whole[interval.ends + j]]] += force[k, 1] * load[j]


@part
def _put_free(droppers, motion, free):
    """Put the droppers' pulls at the end of the step, if they could push, into ``free``; see `DropperLaw.pull`."""
    a1, attached = motion.a1, motion.attached
    for i in range(free.size):
        elongation = 0.0
        for k in range(droppers.rows[i], droppers.rows[i + 1]):
            j = droppers.columns[k]
            change = motion.change[motion.slots[j]]
            rate = a1 * change - attached[1, j]
            elongation += droppers.values[k] * (attached[0, j] + change + droppers.delay[i] * rate)
        free[i] = droppers.at_rest[i] + droppers.stiffness[i] * elongation


@part
def _meet(wires, surfaces, records, element, impact, strips, motion, points, work):
    """Find all strips that cross a wire at the end of the step, forces found inside it left out.

    Returns
    -------
    (int, int)
        An interval whose record is lacking, or -1; how many points there are.
    """
    count, place, local = 0, np.empty(3), (work.local, work.rates)
    work.report[AHEAD] = -1
    for s in range(wires.period.size):
        for p in range(strips.shape[0]):
            found = find(wires, records, s, strips[p], element[p, s], motion, local, place)
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
            row = own(points.row, points, count)
            height, points.compliance[count] = point(
                records, record, points.place[count], place[0], row, own(points.load, points, count)
            )
            points.height[count] = height
            rate = 0.0
            interval = interval_at(records.whole, record)
            for m in range(interval.modes + interval.size):
                height += row[m] * work.local[m]
                rate += row[m] * work.rates[m]
            a, b = strips[p, 0, :, 2], strips[p, 1, :, 2]
            points.penetration[count] = a[0] + place[1] * (b[0] - a[0]) - (height - work.numbers[5])
            points.velocity[count] = a[1] + place[1] * (b[1] - a[1]) - rate
            if surfaces.first[s] < surfaces.first[s + 1]:
                a, b = strips[p, 0, :, 0], strips[p, 1, :, 0]
                r, slope = surface_at(surfaces, wires, s, a[0] + place[1] * (b[0] - a[0]))
                points.penetration[count] -= r
                points.velocity[count] -= (a[1] + place[1] * (b[1] - a[1])) * slope
            ahead = _next(wires, s, number)
            if records.intervals[ahead] < 0:
                work.report[AHEAD] = ahead
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
def _apply(records, points, contacts, motion, work):
    """Add what contacts and slack droppers change within the step."""
    for i in contacts:
        if points.force[i] != 0.0:
            press(records, points.record[i], own(points.row, points, i), points.force[i], motion.driven)
            interval = interval_at(records.whole, points.record[i])
            share = own(points.load, points, i)[: interval.size]
            bend(
                records.data, interval.columns, interval.first, interval.reach, share, points.force[i],
                motion.change, motion.slots, work.bent,
            )  # fmt: skip
    for j in range(work.slack.size):
        if work.slack[j]:
            of = dropper_at(records.whole, records.droppers[j])
            bend(
                records.data, of.column, of.first, of.reach, work.lacks[j : j + 1], -1.0,
                motion.change, motion.slots, work.bent,
            )  # fmt: skip


@part
def _move_attachments(modes, moving, motion, shift):
    """Replace the motion of the attachments, and find ``shift`` of `advance`."""
    x, v, size = moving.x, moving.v, np.uint64(moving.x.size)
    for at in range(_0, size, _LANES):
        change, before = get(motion.change, at), get(v, at)
        for kind in range(np.uint64(modes.turned.size) - _1):
            put(shift, kind * size + at, change - before * modes.rates[_4 * kind + _1])
        put(x, at, get(x, at) + change)
        put(v, at, change * motion.a1 - before)
    for i in range(motion.slots.size):
        motion.attached[0, i], motion.attached[1, i] = x[motion.slots[i]], v[motion.slots[i]]


@part
def _note(points, contacts, loaded, load, impact):
    """Record the forces of contacts at the end of the step, with which the next one begins, and their impacts."""
    impact[:] = 0.0
    for k in range(contacts.size):
        i = contacts[k]
        loaded[k, 0], loaded[k, 1] = points.section[i], points.element[i]
        load[k, 0], load[k, 1] = points.xi[i], points.force[i]
        if points.depth[i] > 0.0:
            before = points.impact[i]
            impact[points.pantograph[i], points.section[i]] = before if before > 0.0 else max(points.rate[i], 1e-6)


@part
def _put_result(wires, records, points, contacts, count, strips, motion, force, place):
    """Put the contacts into the result."""
    force[:], place[:] = 0.0, math.nan
    for i in contacts:
        force[points.pantograph[i], points.section[i]] = points.force[i]
    for i in range(count):
        p, s = points.pantograph[i], points.section[i]
        put_place(records, points, i, motion, place[p, s])
        if wires.period[s] > 0.0:  # points travel on along with their strips
            laps = (0.5 * (strips[p, 0, 0, 0] + strips[p, 1, 0, 0]) - place[p, s, 0]) / wires.period[s]
            place[p, s, 0] += wires.period[s] * math.floor(laps + 0.5)
