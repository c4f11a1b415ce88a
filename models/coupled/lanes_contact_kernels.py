"""What is not linear in a step of one line under several trains, lane by lane, for numba: contacts and slack droppers.

The arithmetic is that of `models.catenary.contact_and_slack` and `models.catenary.line_model`; a lane is one run.

This module is not divided, so it is longer than a file should be: it is compiled from a copy in the user's cache
(`models.numerics.kernel_cache`), to which the files that it imports are joined.
"""

from collections import namedtuple

import numpy as np

from models.catenary.step.law_kernels import SLOWEST_IMPACT, eliminate, law_of
from models.coupled.lane_forms_kernels import inner, outer

#: How the local problem of a lane ended.
SOLVED, UNSETTLED, SINGULAR = 0, 1, 2
#: Numbers of a mode before its couplings; see `models.coupled.lanes_linear_kernels`.
OWN = 3
#: Most iterations of a local problem, and the relative change of its forces at which it counts as solved.
_MOST, _TOLERANCE = 60, 1e-10
#: Of `models.contact_law` and `models.catenary.contact_and_slack`.
_STRIP_EDGE, _WIRE_EDGE, _FAR, _NEAR = 0.05, 1.0, 1.0, 5.0
#: Contact wires: where elements begin and where each wire's begin among them, its period, interval of each element;
#: records of intervals and of droppers, with the numbers that say what is where in them.
Wires = namedtuple(
    "Wires", ("starts", "first", "period", "interval", "records", "numbers", "slack_records", "slack_numbers")
)
#: Contact law: stiffness, exponent, restitution; radii of wire and strip together.
Law = namedtuple("Law", ("stiffness", "exponent", "restitution", "radii"))
#: The arrays of `lanes_linear_kernels.Motion`, a column for every lane, and the modes that they belong to.
Motion = namedtuple(
    "Motion", ("a1", "modes", "rates", "slot_end", "table", "attached", "known", "change", "pull", "droppers")
)
#: What every lane remembers. By pantograph and wire: element last met, velocity at impact; interval, force, row and
#: load of the force on the wire. Of the slack droppers: how many, which, and what they lack.
Memory = namedtuple(
    "Memory",
    ("active", "status", "element", "impact", "interval", "force", "row", "load", "slack_count", "slack", "lacking"),
)
#: An interval of a contact wire and how it gives way, see `models.catenary.contact_and_slack.wire_response`: how many
#: modes, displacements of attachments, rows that forces on these reach, from which on, and droppers near; its first
#: element; and where in the records its parts begin, matrices row by row.
Interval = namedtuple(
    "Interval",
    ("modes", "ends", "reached", "begin", "near", "first", "slots", "places", "plan", "plan_static", "height",
     "height_static", "yielding", "at_ends", "columns", "near_index", "near_force"),
)  # fmt: skip
#: Work space: ``met``, ``row`` and ``load`` by lane, pantograph and wire, the others for one lane.
Work = namedtuple(
    "Work",
    ("met", "row", "load", "local", "place", "response", "by_contact", "by_slack", "on_contacts", "compliance",
     "system", "change", "pull", "force", "penetration", "velocity", "closed", "contacts", "slack", "found", "lacking"),
)  # fmt: skip
#: What ``met`` holds of a candidate.
(
    FOUND, ELEMENT, XI, SHARE, ENGAGED, HEIGHT, RISE, RATE, GIVES, DEPTH, SPEED, IMPACT, PRESSES, FORCE, CLOSED, MET,
) = range(16)  # fmt: skip


@inner
def of_lane(lane, memory):
    """Return the places of a lane's pantographs and wires."""
    count = memory.interval.size // memory.active.size
    return range(lane * count, (lane + 1) * count)


@inner
def interval_of(wires, index):
    """Return the numbers of an interval; in its record whole numbers are held as what they are."""
    numbers = wires.numbers[index]
    n, e, k, r, near, at = numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[7]
    m, nodes = n + e, 2 * (k + 1)
    places = at + n
    plan = places + e
    plan_static = plan + nodes * m
    height = plan_static + nodes
    height_static = height + 4 * k * m
    yielding = height_static + 4 * k
    at_ends = yielding + n * e
    columns = at_ends + e * e
    near_index = columns + e * r
    return Interval(
        n, e, r, numbers[6], near, numbers[5], at, places, plan, plan_static, height, height_static, yielding, at_ends,
        columns, near_index, near_index + near,
    )  # fmt: skip


@inner
def local_motion(interval, index, lane, records, memory, motion, local):
    """Put local coordinates of an interval and their rates at the end of the step into ``local``, shape (2, m)."""
    a1, n, e = motion.a1[0], interval.modes, interval.ends
    for j in range(e):
        local[0, n + j] = motion.change[np.int64(records[interval.places + j]), lane]
    for i in range(n):
        slot = np.int64(records[interval.slots + i])
        amplitude, rate, momentum = (
            motion.table[slot, 0, lane],
            motion.table[slot, 1, lane],
            motion.table[slot, 2, lane],
        )
        change = motion.modes[slot, 1] * amplitude + motion.modes[slot, 2] * momentum
        yielding = records[interval.yielding + i * e : interval.yielding + (i + 1) * e]
        for j in range(e):
            change -= yielding[j] * local[0, n + j]
        for q in of_lane(lane, memory):
            if memory.interval[q] == index:
                change += memory.force[q] * memory.row[q, i] * motion.modes[slot, 0]
        local[0, i] = amplitude + change
        local[1, i] = a1 * change - rate
    for j in range(e):
        place, change = np.int64(records[interval.places + j]), local[0, n + j]
        local[0, n + j] = motion.attached[place, 0, lane] + change
        local[1, n + j] = a1 * change - motion.attached[place, 1, lane]


@inner
def standing(interval, lane, records, motion, local):
    """Put local coordinates of an interval as they are into ``local``."""
    for i in range(interval.modes):
        local[0, i] = motion.table[np.int64(records[interval.slots + i]), 0, lane]
    for j in range(interval.ends):
        local[0, interval.modes + j] = motion.attached[np.int64(records[interval.places + j]), 0, lane]


@inner
def start_element(wires, wire, guess, x):
    """Return where to begin walking; see `ContactWire.start`."""
    first, last = wires.first[wire], wires.first[wire + 1] - 1
    count = last - first
    if 0 <= guess < count and abs(wires.starts[first + guess] - x) < _NEAR:
        return guess
    return min(max(np.searchsorted(wires.starts[first : last + 1], x) - 1, 0), count - 1)


@inner
def meet(wires, wire, lane, q, strip, guess, memory, motion, work):
    """Find where a strip (x, y of its ends, z, vz) crosses a wire at the end of the step; see `ContactWire.find`."""
    met, local = work.met[q], work.local
    met[FOUND] = 0.0
    first, period = wires.first[wire], wires.period[wire]
    count = wires.first[wire + 1] - 1 - first
    x, left, right = strip[0], strip[1], strip[2]
    begins, ends = wires.starts[first], wires.starts[first + count]
    if period == 0.0 and not begins - _FAR < x < ends + _FAR:
        return
    if period:
        x -= np.floor((x - begins) / period) * period
    element = start_element(wires, wire, guess, x)
    known, direction, rounds = -1, 0, 0
    interval = interval_of(wires, wires.interval[first + element])
    while True:
        index = wires.interval[first + element]
        if index != known:
            known, interval = index, interval_of(wires, index)
            local_motion(interval, index, lane, wires.records, memory, motion, local)
        place_nodes(interval, element - interval.first, wires.records, local, work.place)
        x1, y1, x2, y2 = work.place
        determinant = (right - left) * (x2 - x1)
        if determinant == 0.0:
            return
        share = ((y1 - left) * (x2 - x1) - (x1 - x) * (y2 - y1)) / determinant
        xi = -(right - left) * (x1 - x) / determinant
        step = -1 if xi < 0.0 else (1 if xi > 1.0 else 0)
        if step == 0 or step == -direction:
            break
        direction = step
        element += step
        if not 0 <= element < count:
            rounds += 1
            if not period or rounds > 1:
                return
            element = element % count
            x -= step * period
    if not 0.0 <= share <= 1.0:
        return
    xi = min(max(xi, 0.0), 1.0)
    along = wires.starts[first + element]
    along += xi * (wires.starts[first + element + 1] - along)
    engaged = min(1.0, min(share, 1.0 - share) * abs(right - left) / _STRIP_EDGE)
    if not period:
        engaged *= min(1.0, min(along - begins, ends - along) / _WIRE_EDGE)
    met[FOUND], met[ELEMENT], met[XI], met[SHARE], met[ENGAGED] = 1.0, element, xi, share, engaged
    met[HEIGHT], met[GIVES] = lift_and_give(
        interval, element - interval.first, xi, wires.records, motion.modes, work.row[q], work.load[q]
    )
    rise = rate = 0.0
    for m in range(interval.modes + interval.ends):
        rise += work.row[q, m] * local[0, m]
        rate += work.row[q, m] * local[1, m]
    met[RISE], met[RATE] = rise, rate


@inner
def place_nodes(interval, own, records, local, place):
    """Put the positions in plan of both ends of an element into ``place``."""
    count = interval.modes + interval.ends
    for k in range(4):
        value, at = records[interval.plan_static + 2 * own + k], interval.plan + (2 * own + k) * count
        row = records[at : at + count]
        for m in range(count):
            value += row[m] * local[0, m]
        place[k] = value


@inner
def lift_and_give(interval, own, xi, records, modes, row, load):
    """Put what a unit force on a point does to the local coordinates into ``row`` and to the attachments into ``load``.

    Returns its static height and its compliance.
    """
    n, e = interval.modes, interval.ends
    height, power = 0.0, 1.0
    row[:] = 0.0
    for k in range(4):
        height += power * records[interval.height_static + 4 * own + k]
        at = interval.height + (4 * own + k) * (n + e)
        height_row = records[at : at + n + e]
        for m in range(n + e):
            row[m] += power * height_row[m]
        power *= xi
    gives = 0.0
    for j in range(e):
        load[j] = row[n + j]
    for i in range(n):
        if row[i] != 0.0:
            gives += row[i] * row[i] * modes[np.int64(records[interval.slots + i]), 0]
            yielding = records[interval.yielding + i * e : interval.yielding + (i + 1) * e]
            for j in range(e):
                load[j] -= row[i] * yielding[j]
    for j in range(e):
        for k in range(e):
            gives += load[j] * records[interval.at_ends + j * e + k] * load[k]
    return height, gives


@inner
def single_contact(met, compliance, law, a1):
    """Return force, velocity and penetration of one contact alone, and whether they were found."""
    force = 0.0
    for _ in range(_MOST):
        penetration = met[DEPTH] - compliance * force
        velocity = met[SPEED] - a1 * compliance * force
        value, by_penetration, by_velocity = law_of(penetration, velocity, met[IMPACT], met[ENGAGED], law)
        slope = compliance * (by_penetration + a1 * by_velocity)
        before, force = force, (value + slope * force) / (1.0 + slope)
        if abs(force - before) <= _TOLERANCE * (1.0 + force):
            return force, velocity, penetration, True
    return force, 0.0, 0.0, False


@inner
def column_at(values, at, reached, begin, rows, place):
    """Return a response, which reaches some rows of all from ``begin`` on, at a row."""
    offset = place - begin
    if offset < 0:
        offset += rows
    return values[at + offset] if offset < reached else 0.0


@inner
def add_columns(records, at, rows, count, load, result):
    """Put the sum of the rows of a matrix, each times its load, into ``result``; they have ``count`` entries."""
    result[:count] = 0.0
    for j in range(rows):
        share = load[j]
        if share != 0.0:
            row = records[at + j * count : at + (j + 1) * count]
            for k in range(count):
                result[k] += row[k] * share


@inner
def find_contacts(lane, wires, strips, law, memory, motion, work):
    """Find which strips of a lane cross wires, and put those that may press into ``work.contacts``; return how many."""
    n, sections = 0, wires.period.size
    for wire in range(sections):
        for p in range(strips.shape[0]):
            q = (lane * strips.shape[0] + p) * sections + wire
            met = work.met[q]
            meet(wires, wire, lane, q, strips[p], memory.element[q], memory, motion, work)
            if not met[FOUND]:
                continue
            memory.element[q] = np.int64(met[ELEMENT])
            met[DEPTH] = strips[p, 3] - (met[HEIGHT] + met[RISE] - law.radii)
            met[SPEED] = strips[p, 4] - met[RATE]
            met[IMPACT] = memory.impact[q]
            if met[DEPTH] > 0.0 or met[IMPACT] > 0.0:
                work.contacts[n] = q
                n += 1
    return n


@inner
def couple(contacts, wires, motion, work):
    """Find what the contacts' forces do to droppers and to one another."""
    rows, records = motion.change.shape[0], wires.records
    for b in range(contacts):
        q = work.contacts[b]
        index = pressed_interval(q, wires, work)
        interval = interval_of(wires, index)
        work.by_contact[b, :] = 0.0
        add_columns(records, interval.near_force, interval.ends, interval.near, work.load[q], work.response)
        for j in range(interval.near):
            work.by_contact[b, np.int64(records[interval.near_index + j])] = work.response[j]
        work.compliance[b, b] = work.met[q, GIVES]
        if contacts > 1:
            add_columns(records, interval.columns, interval.ends, interval.reached, work.load[q], work.response)
        for a in range(contacts):
            if a == b:
                continue
            other = work.contacts[a]
            there = pressed_interval(other, wires, work)
            target = interval_of(wires, there)
            total = 0.0
            for e in range(target.ends):
                place = np.int64(records[target.places + e])
                moved = column_at(work.response, 0, interval.reached, interval.begin, rows, place)
                total += work.load[other, e] * moved
            if there == index:
                for i in range(interval.modes):
                    slot = np.int64(records[interval.slots + i])
                    total += work.row[q, i] * work.row[other, i] * motion.modes[slot, 0]
            work.compliance[a, b] = total


@inner
def pressed_interval(q, wires, work):
    """Return the interval on which a candidate is."""
    return wires.interval[wires.first[q % wires.period.size] + np.int64(work.met[q, ELEMENT])]


@inner
def couple_slack(k, j, contacts, wires, motion, work):
    """Find what a force of dropper ``j``, the ``k``-th slack one, does to droppers and contacts."""
    numbers = wires.slack_numbers[j]
    reached, begin, near, at = numbers[0], numbers[1], numbers[2], numbers[3]
    values, index = wires.slack_records, at + reached
    work.by_slack[k, :] = 0.0
    for i in range(near):
        work.by_slack[k, np.int64(values[index + i])] = values[index + near + i]
    for a in range(contacts):
        q = work.contacts[a]
        interval = interval_of(wires, pressed_interval(q, wires, work))
        total = 0.0
        for e in range(interval.ends):
            place = np.int64(wires.records[interval.places + e])
            total += work.load[q, e] * column_at(values, at, reached, begin, motion.change.shape[0], place)
        work.on_contacts[a, k] = total


@inner
def penetrate(contacts, slack, a1, work):
    """Find penetrations and their velocities under the present forces."""
    for a in range(contacts):
        change = 0.0
        for k in range(slack):
            change += work.on_contacts[a, k] * work.lacking[k]
        for b in range(contacts):
            change -= work.compliance[a, b] * work.force[b]
        work.penetration[a] = work.met[work.contacts[a], DEPTH] + change
        work.velocity[a] = work.met[work.contacts[a], SPEED] + a1 * change


@inner
def settle(lane, contacts, wires, law, unilateral, memory, motion, work):
    """Solve for contact forces and slack droppers of a lane; see `LocalProblem.solve`.

    Returns
    -------
    int
        Slack droppers, whose numbers and forces are in ``work.slack`` and ``work.lacking``; or -UNSETTLED, -SINGULAR.
    """
    a1, droppers, slack = motion.a1[0], unilateral.size, memory.slack_count[lane]
    lowest = 0.0
    for j in range(droppers):
        work.pull[j] = motion.droppers[j, lane]
        lowest = min(lowest, work.pull[j])
    if not contacts and not slack and lowest >= 0.0:
        return 0
    couple(contacts, wires, motion, work)
    if contacts == 1 and not slack:
        met = work.met[work.contacts[0]]
        force, work.velocity[0], work.penetration[0], found = single_contact(met, met[GIVES], law, a1)
        if found:
            lowest = 0.0
            for j in range(droppers):
                lowest = min(lowest, work.pull[j] + force * work.by_contact[0, j])
            if lowest >= 0.0:
                work.force[0] = force
                return 0
    for a in range(contacts):
        met = work.met[work.contacts[a]]
        value, slope, _ = law_of(met[DEPTH], met[SPEED], met[IMPACT], met[ENGAGED], law)
        work.force[a] = value / (1.0 + slope * met[GIVES])
    for k in range(slack):
        work.slack[k], work.lacking[k] = memory.slack[lane, k], 0.0
        couple_slack(k, work.slack[k], contacts, wires, motion, work)
    is_repeated = contacts == 0  # without contacts one iteration is exact for its set
    for _ in range(_MOST):
        penetrate(contacts, slack, a1, work)
        if not newton_step(contacts, slack, law, unilateral, a1, work):
            return -SINGULAR
        change = largest = 0.0
        for a in range(contacts):
            change = max(change, abs(work.change[a] - work.force[a]))
            work.force[a] = work.change[a]
            largest = max(largest, work.force[a])
        for k in range(slack):
            work.lacking[k] = work.change[contacts + k]
        penetrate(contacts, slack, a1, work)
        for a in range(contacts):
            is_closed = 1 if work.penetration[a] > 0.0 else 0
            is_repeated = is_repeated and work.closed[a] == is_closed
            work.closed[a] = is_closed
        now = find_slack(contacts, slack, work)
        is_same = now == slack
        for k in range(min(now, slack)):
            is_same = is_same and work.found[k] == work.slack[k]
        if change <= _TOLERANCE * (1.0 + largest) and is_repeated and is_same:
            return slack
        is_repeated = True
        if not is_same:
            slack = take_over(now, slack, contacts, wires, motion, work)
    return -UNSETTLED


@inner
def find_slack(contacts, slack, work):
    """Put the droppers that would push under the present forces into ``work.found``; return how many."""
    now = 0
    for j in range(work.pull.size):
        pull = work.pull[j]
        for a in range(contacts):
            pull += work.by_contact[a, j] * work.force[a]
        for k in range(slack):
            pull -= work.by_slack[k, j] * work.lacking[k]
        if pull < 0.0:
            work.found[now] = j
            now += 1
    return now


@inner
def take_over(now, before, contacts, wires, motion, work):
    """Take the droppers of ``work.found`` for the slack ones, with the forces of those that were so before."""
    for i in range(before):
        work.change[i] = work.lacking[i]
    for k in range(now):
        work.lacking[k] = 0.0
        for i in range(before):
            if work.slack[i] == work.found[k]:
                work.lacking[k] = work.change[i]
    for k in range(now):
        work.slack[k] = work.found[k]
        couple_slack(k, work.found[k], contacts, wires, motion, work)
    return now


@inner
def newton_step(contacts, slack, law, unilateral, a1, work):
    """Solve the local problem linearised at the present forces into ``work.change``; return whether it could be.

    Contacts: F - slope (delta(F, f) - delta) = law; slack droppers: f + (1 - r) T(F, f) = 0.
    """
    system, right = work.system, work.change
    for a in range(contacts):
        met = work.met[work.contacts[a]]
        depth, speed = work.penetration[a], work.velocity[a]
        value, by_penetration, by_velocity = law_of(depth, speed, met[IMPACT], met[ENGAGED], law)
        slope = by_penetration + a1 * by_velocity
        moved = 0.0
        for b in range(contacts):
            system[a, b] = slope * work.compliance[a, b] + (1.0 if a == b else 0.0)
            moved -= work.compliance[a, b] * work.force[b]
        for k in range(slack):
            system[a, contacts + k] = -slope * work.on_contacts[a, k]
            moved += work.on_contacts[a, k] * work.lacking[k]
        right[a] = value - slope * moved
    for k in range(slack):
        j = work.slack[k]
        for b in range(contacts):
            system[contacts + k, b] = unilateral[j] * work.by_contact[b, j]
        for i in range(slack):
            system[contacts + k, contacts + i] = (1.0 if i == k else 0.0) - unilateral[j] * work.by_slack[i, j]
        right[contacts + k] = -unilateral[j] * work.pull[j]
    return eliminate(system, right, contacts + slack)


@inner
def add_along(change, lane, begin, factor, values, at, count):
    """Add a multiple of some values to the rows from ``begin`` on, round the end of a line that closes on itself."""
    before = min(change.shape[0] - begin, count)
    rows, shown = change[begin : begin + before], values[at : at + count]
    for k in range(before):
        rows[k, lane] += factor * shown[k]
    for k in range(before, count):
        change[k - before, lane] += factor * shown[k]


@inner
def react(lane, contacts, slack, wires, motion, work):
    """Add what the forces found in the step change to the attachments."""
    for a in range(contacts):
        q = work.contacts[a]
        if work.force[a] != 0.0:
            interval = interval_of(wires, pressed_interval(q, wires, work))
            reached = interval.reached
            add_columns(wires.records, interval.columns, interval.ends, reached, work.load[q], work.response)
            add_along(motion.change, lane, interval.begin, work.force[a], work.response, 0, reached)
    for k in range(slack):
        numbers, lacking = wires.slack_numbers[work.slack[k]], work.lacking[k]
        add_along(motion.change, lane, numbers[1], -lacking, wires.slack_records, numbers[3], numbers[0])


@inner
def keep(lane, contacts, slack, memory, work):
    """Note what was found for a lane in the step, until it has moved."""
    memory.slack_count[lane] = slack
    for k in range(slack):
        memory.slack[lane, k], memory.lacking[lane, k] = work.slack[k], work.lacking[k]
    for q in of_lane(lane, memory):
        work.met[q, PRESSES] = 0.0
    for a in range(contacts):
        met = work.met[work.contacts[a]]
        met[PRESSES], met[FORCE] = 1.0, work.force[a]
        met[CLOSED] = 0.0
        if work.penetration[a] > 0.0:
            met[CLOSED] = met[IMPACT] if met[IMPACT] else max(work.velocity[a], SLOWEST_IMPACT)


@inner
def remember(lane, wires, memory, work):
    """Take the forces at the end of the step for those with which the next one begins."""
    for q in of_lane(lane, memory):
        met = work.met[q]
        memory.impact[q], memory.force[q], memory.interval[q] = 0.0, 0.0, -1
        if met[PRESSES]:
            memory.impact[q], memory.force[q] = met[CLOSED], met[FORCE]
            memory.interval[q] = pressed_interval(q, wires, work)
            for m in range(work.row.shape[1]):
                memory.row[q, m] = work.row[q, m]
            for e in range(work.load.shape[1]):
                memory.load[q, e] = work.load[q, e]


@inner
def press(lane, wires, memory, motion):
    """Add what the remembered forces do to the modes of their intervals in a step, and so to the ends of these."""
    a1, modes = motion.a1[0], motion.modes
    for q in of_lane(lane, memory):
        if memory.interval[q] < 0 or memory.force[q] == 0.0:
            continue
        interval = interval_of(wires, memory.interval[q])
        for i in range(interval.modes):
            slot = np.int64(wires.records[interval.slots + i])
            change = memory.force[q] * memory.row[q, i] * modes[slot, 0]
            if change == 0.0:
                continue
            motion.table[slot, 0, lane] += change
            motion.table[slot, 1, lane] += a1 * change
            motion.table[slot, 2, lane] += a1 * change
            held = modes[slot, 1] * change + modes[slot, 2] * (a1 * change)
            value = motion.rates[slot, 1] * (a1 * change) - held
            end = np.int64(motion.slot_end[slot])
            for j in range(modes.shape[1] - OWN):
                if modes[slot, OWN + j] != 0.0:
                    motion.pull[end + j, lane] += modes[slot, OWN + j] * value


@inner
def know(lane, droppers, wires, memory, motion):
    """Add what is known of the forces on the attachments in the next step to ``motion.known``."""
    rows, columns, stretch, _ = droppers
    for q in of_lane(lane, memory):
        if memory.interval[q] >= 0:
            interval = interval_of(wires, memory.interval[q])
            for j in range(interval.ends):
                place = np.int64(wires.records[interval.places + j])
                motion.known[place, lane] += memory.force[q] * memory.load[q, j]
    for k in range(memory.slack_count[lane]):
        j = memory.slack[lane, k]
        for at in range(rows[j], rows[j + 1]):
            motion.known[columns[at], lane] -= memory.lacking[lane, k] * stretch[at]


@inner
def publish(lane, p, strip, wires, memory, motion, work, output):
    """Put the resultant on a strip and its point of application into ``output``, then the force on every wire."""
    sections = wires.period.size
    total = 0.0
    is_crossed = False
    output[1], output[2], output[3] = strip[0], 0.5 * (strip[1] + strip[2]), strip[3]
    for wire in range(sections):
        q = (lane * (memory.interval.size // memory.active.size // sections) + p) * sections + wire
        force = memory.force[q]
        output[4 + wire] = force
        if not work.met[q, FOUND]:
            continue
        x, y, z = crossed_at(q, wire, strip[0], wires, motion, work)
        if force > 0.0:
            if total == 0.0:
                output[1:4] = 0.0
            total += force
            output[1] += force * x
            output[2] += force * y
            output[3] += force * z
        elif total == 0.0 and not is_crossed:
            output[1], output[2], output[3] = x, y, z
        is_crossed = True
    output[0] = total
    if total > 0.0:
        for k in range(1, 4):
            output[k] /= total


@inner
def crossed_at(q, wire, along, wires, motion, work):
    """Return where a wire is crossed as it stands, in the lap of a strip at ``along``; ``work.local`` is replaced."""
    met, place = work.met[q], work.place
    interval = interval_of(wires, pressed_interval(q, wires, work))
    standing(interval, q // (work.met.shape[0] // motion.change.shape[1]), wires.records, motion, work.local)
    place_nodes(interval, np.int64(met[ELEMENT]) - interval.first, wires.records, work.local, place)
    x, y, z = place[0] + met[XI] * (place[2] - place[0]), place[1] + met[XI] * (place[3] - place[1]), met[HEIGHT]
    for m in range(interval.modes + interval.ends):
        z += work.row[q, m] * work.local[0, m]
    if wires.period[wire]:
        x += wires.period[wire] * np.round((along - x) / wires.period[wire])
    return x, y, z


@outer
def meet_all(strips, law, unilateral, wires, memory, motion, work):
    """Find contacts and slack droppers of every lane at the end of a step, and add what they change in it.

    Parameters
    ----------
    strips : ndarray, shape (lanes, P, 5)
        At the end of the step: x, y of the left and the right end, z, vertical velocity.
    """
    for lane in range(memory.active.size):
        if not memory.active[lane]:
            continue
        contacts = find_contacts(lane, wires, strips[lane], law, memory, motion, work)
        slack = settle(lane, contacts, wires, law, unilateral, memory, motion, work)
        if slack < 0:
            memory.status[lane] = -slack
            contacts = slack = 0
        react(lane, contacts, slack, wires, motion, work)
        keep(lane, contacts, slack, memory, work)


@outer
def conclude(strips, droppers, wires, memory, motion, work, outputs):
    """Add what forces on the wires did to modes in the step that was made, and prepare the next one.

    Parameters
    ----------
    outputs : ndarray, shape (lanes, P, 4 + wires)
        Result: contact force, its point of application, the force on every wire.
    """
    at_rest = droppers[3]
    for i in range(at_rest.size):
        motion.known[i] = 2.0 * at_rest[i]
    for lane in range(memory.active.size):
        if not memory.active[lane]:
            continue
        press(lane, wires, memory, motion)
        remember(lane, wires, memory, work)
        press(lane, wires, memory, motion)
        know(lane, droppers, wires, memory, motion)
        for p in range(strips.shape[1]):
            publish(lane, p, strips[lane, p], wires, memory, motion, work, outputs[lane, p])


@outer
def stand(lane, strips, law, droppers, wires, memory, motion, work, outputs):
    """Find the contacts of a lane as it stands, see `CatenaryModel.contact_at_rest`; nothing is advanced."""
    for q in of_lane(lane, memory):
        memory.interval[q], memory.force[q] = -1, 0.0
    for wire in range(wires.period.size):
        for p in range(strips.shape[0]):
            q = (lane * strips.shape[0] + p) * wires.period.size + wire
            meet(wires, wire, lane, q, strips[p], memory.element[q], memory, motion, work)
            met = work.met[q]
            if met[FOUND]:
                memory.element[q] = np.int64(met[ELEMENT])
                depth, speed = strips[p, 3] - (met[HEIGHT] + met[RISE] - law.radii), strips[p, 4] - met[RATE]
                memory.force[q] = law_of(depth, speed, 0.0, met[ENGAGED], law)[0]
    for p in range(strips.shape[0]):
        publish(lane, p, strips[p], wires, memory, motion, work, outputs[p])
    for q in of_lane(lane, memory):
        memory.force[q] = 0.0
    at_rest = droppers[3]
    for i in range(at_rest.size):
        motion.known[i, lane] = 2.0 * at_rest[i]
    know(lane, droppers, wires, memory, motion)
