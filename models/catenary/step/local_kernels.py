"""Contacts and slack droppers of a step, for numba: `models.catenary.contact_and_slack.local_problem`, term by term.

There the method is explained; this differs in the storage alone. Forces on a few points and in a few droppers reach few
droppers, so what they do is listed, not spread over all of them.
"""

from collections import namedtuple

import numpy as np

from models.catenary.step.contact_kernels import dropper_at, interval_at, moved_by, reached
from models.catenary.step.vector_kernels import part

#: Answers of `solve_local`; a number of LACKING or more less LACKING is the dropper whose record is lacking.
SOLVED, SINGULAR, UNSETTLED, LACKING = 0, 1, 2, 3
#: What is linear: what a contact force does to a penetration, and a dropper's; what each contact's unit force adds to
#: the pulls of the droppers that its interval's record lists.
Coupling = namedtuple("Coupling", "by_contact by_dropper stretch")
_MAX_ITERATIONS = 60
_TOLERANCE = 1e-10
_SLOWEST_IMPACT = 1e-6


@part
def law_of(penetration, velocity, impact, engagement, contact):
    """Return the force of a contact and its slopes over penetration and velocity; see `models.contact_law`.

    Parameters
    ----------
    contact : ndarray, shape (4,)
        Stiffness, exponent, restitution; what wire and strip add to the height.
    """
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    if impact == 0.0:  # the first closed instant is its impact
        impact = max(velocity, 0.0)
    elastic = engagement * contact[0] * penetration ** contact[1]
    hysteresis = 0.75 * (1.0 - contact[2] ** 2) / max(impact, _SLOWEST_IMPACT)
    factor = 1.0 + hysteresis * velocity
    if factor <= 0.0:
        return 0.0, 0.0, 0.0
    return elastic * factor, contact[1] * elastic / penetration * factor, elastic * hysteresis


@part
def solve_local(records, points, contacts, yielding, free, unilateral, a1, contact, size, table, slack, results):
    """Find slack and contact forces of a step.

    Parameters
    ----------
    contacts : ndarray of int, shape (n,)
        Which of the points are contacts.
    yielding : ndarray, shape (n_pantographs,)
        How far a strip yields within the step per unit force [m/N].
    free : ndarray, shape (n_droppers,)
        Pulls T of the droppers without these forces [N].
    unilateral : ndarray, shape (n_droppers,)
        1 - r.
    size : int
        Displacements of attachments.
    slack : ndarray of int
        Droppers to begin with.
    results : (ndarray, ndarray, ndarray, ndarray)
        Contact force, penetration and its velocity of each point, shape (points, 3); whether each dropper is slack, and
        the forces f; work space for the pulls; each of shape (n_droppers,).

    Returns
    -------
    int
        SOLVED, SINGULAR, UNSETTLED, or what is LACKING.
    """
    of_points, is_slack, lacks, pull = results
    n, is_taut = contacts.size, slack.size == 0
    for j in range(free.size):
        is_slack[j], lacks[j] = False, 0.0
        is_taut &= not free[j] < 0.0
    for j in slack:
        is_slack[j] = True
    if n == 0 and is_taut:
        return SOLVED
    by_contact, stretch = _between_contacts(records, points, contacts, yielding, size, table)
    forces = np.empty(n)
    for i in range(n):
        k = contacts[i]
        force, slope, _ = law_of(
            points.penetration[k], points.velocity[k], points.impact[k], points.engagement[k], contact
        )
        forces[i] = force / (1.0 + slope * points.compliance[k])
    compensation, moved, was_closed, is_new = np.empty(slack.size), np.empty(n), np.empty(n), True
    for k in range(slack.size):
        compensation[k] = 0.0
    coupling = Coupling(by_contact, stretch, stretch)
    # Without contacts one iteration is exact for its set, and the set to begin with may well be the one.
    is_known = n == 0
    for _ in range(_MAX_ITERATIONS):
        if is_new:
            for j in slack:
                if records.droppers[j] < 0:
                    return LACKING + j
            coupling = Coupling(by_contact, _by_droppers(records, points, contacts, slack, size), stretch)
            _put_moved(coupling, forces, compensation, moved)
        unknown, is_regular = _newton_step(
            records, points, contacts, coupling, free, unilateral, a1, contact, moved, slack
        )
        if not is_regular:
            return SINGULAR
        change = largest = 0.0
        for i in range(n):
            change, largest = max(change, abs(unknown[i] - forces[i])), max(largest, unknown[i])
        forces, compensation = unknown[:n], unknown[n:]
        _put_pull(records, points, contacts, coupling, free, forces, slack, compensation, pull)
        same = is_known and change <= _TOLERANCE * (1.0 + largest)
        _put_moved(coupling, forces, compensation, moved)
        for i in range(n):
            is_closed = 1.0 if points.penetration[contacts[i]] + moved[i] > 0.0 else 0.0
            same &= is_closed == was_closed[i]
            was_closed[i] = is_closed
        is_new = False
        for j in range(pull.size):
            is_new |= (pull[j] < 0.0) != is_slack[j]
        if same and not is_new:
            for i in range(n):
                k = contacts[i]
                of_points[k, 0] = forces[i]
                of_points[k, 1] = points.penetration[k] + moved[i]
                of_points[k, 2] = points.velocity[k] + a1 * moved[i]
            for k in range(slack.size):
                lacks[slack[k]] = compensation[k]
            return SOLVED
        is_known = True
        if is_new:
            slack, compensation = _changed(is_slack, slack, compensation, pull, lacks)
    return UNSETTLED


@part
def _changed(is_slack, slack, compensation, pull, lacks):
    """Return the droppers that are slack now and their forces, zero for those that are new."""
    for k in range(slack.size):
        lacks[slack[k]] = compensation[k]
    count = 0
    for j in range(pull.size):
        is_slack[j] = pull[j] < 0.0
        count += is_slack[j]
    now, carried, k = np.empty(count, dtype=np.int64), np.empty(count), 0
    for j in range(pull.size):
        if is_slack[j]:
            now[k], carried[k] = j, lacks[j]
            k += 1
        lacks[j] = 0.0
    return now, carried


@part
def _between_contacts(records, points, contacts, yielding, size, table):
    """Return what contact forces do to the penetrations, and what each adds to the pulls of its interval's droppers."""
    n, most = contacts.size, 0
    for i in contacts:
        most = max(most, interval_at(records.whole, points.record[i]).stretched)
    by_contact, stretch = np.empty((n, n)), np.empty((n, most))
    for j in range(n):
        source = contacts[j]
        interval = interval_at(records.whole, points.record[source])
        for k in range(interval.stretched):
            stretch[j, k] = 0.0
            for m in range(interval.size):
                stretch[j, k] += records.data[interval.stretch + k * interval.size + m] * points.load[source, m]
        for i in range(n):
            target = contacts[i]
            by_contact[i, j] = moved_by(records, points, target, source, size, table)
            if points.pantograph[target] == points.pantograph[source]:  # two contacts of one strip share its retreat
                by_contact[i, j] += yielding[points.pantograph[source]]
    return by_contact, stretch


@part
def _by_droppers(records, points, contacts, slack, size):
    """Return what forces of slack droppers do to the penetrations."""
    result = np.empty((contacts.size, slack.size))
    for k in range(slack.size):
        dropper = dropper_at(records.whole, records.droppers[slack[k]])
        for i in range(contacts.size):
            interval = interval_at(records.whole, points.record[contacts[i]])
            result[i, k] = 0.0
            for m in range(interval.size):
                row = reached(dropper.first, dropper.reach, records.whole[interval.ends + m], size)
                if row >= 0:
                    result[i, k] += points.load[contacts[i], m] * records.data[dropper.column + row]
    return result


@part
def _put_moved(coupling, forces, compensation, moved):
    """Put what forces change of the penetrations into ``moved``."""
    for i in range(forces.size):
        moved[i] = 0.0
        for j in range(forces.size):
            moved[i] -= coupling.by_contact[i, j] * forces[j]
        for k in range(compensation.size):
            moved[i] += coupling.by_dropper[i, k] * compensation[k]


@part
def _put_pull(records, points, contacts, coupling, free, forces, slack, compensation, pull):
    """Put the droppers' pulls under given forces into ``pull``."""
    for j in range(free.size):
        pull[j] = free[j]
    for i in range(contacts.size):
        interval = interval_at(records.whole, points.record[contacts[i]])
        for k in range(interval.stretched):
            pull[records.whole[interval.droppers + k]] += coupling.stretch[i, k] * forces[i]
    for k in range(slack.size):
        dropper = dropper_at(records.whole, records.droppers[slack[k]])
        for m in range(dropper.stretched):
            pull[records.whole[dropper.droppers + m]] -= records.data[dropper.stretch + m] * compensation[k]


@part
def _newton_step(records, points, contacts, coupling, free, unilateral, a1, contact, moved, slack):
    """Solve the problem linearised at the present penetrations, for the present set of slack droppers.

    Contacts: F - slope (delta(F, f) - delta) = law; droppers of the set: f + (1 - r) T(F, f) = 0.
    """
    n, m = contacts.size, slack.size
    system, right = np.empty((n + m, n + m)), np.empty(n + m)
    for i in range(n + m):
        for j in range(n + m):
            system[i, j] = 1.0 if i == j else 0.0
    place = np.empty(free.size if m else 0, dtype=np.int64)
    for j in range(place.size):
        place[j] = -1
    for k in range(m):
        place[slack[k]] = n + k
        right[n + k] = -unilateral[slack[k]] * free[slack[k]]
    for i in range(n):
        k = contacts[i]
        force, stiffness, damping = law_of(
            points.penetration[k] + moved[i], points.velocity[k] + a1 * moved[i],
            points.impact[k], points.engagement[k], contact,
        )  # fmt: skip
        slope = stiffness + a1 * damping
        right[i] = force - slope * moved[i]
        for j in range(n):
            system[i, j] += slope * coupling.by_contact[i, j]
        for j in range(m):
            system[i, n + j] = -slope * coupling.by_dropper[i, j]
        interval = interval_at(records.whole, points.record[k])
        for j in range(interval.stretched if m else 0):
            dropper = records.whole[interval.droppers + j]
            if place[dropper] >= 0:
                system[place[dropper], i] = unilateral[dropper] * coupling.stretch[i, j]
    for k in range(m):
        dropper = dropper_at(records.whole, records.droppers[slack[k]])
        for j in range(dropper.stretched):
            other = records.whole[dropper.droppers + j]
            if place[other] >= 0:
                system[place[other], n + k] -= unilateral[other] * records.data[dropper.stretch + j]
    is_regular = eliminate(system, right)
    return right, is_regular


@part
def eliminate(system, right):
    """Solve a small dense system by elimination with row pivots, in place; return whether it is regular."""
    n = right.size
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(system[i, k]) > abs(system[best, k]):
                best = i
        if system[best, k] == 0.0:
            return False
        if best != k:
            right[k], right[best] = right[best], right[k]
            for j in range(k, n):
                system[k, j], system[best, j] = system[best, j], system[k, j]
        for i in range(k + 1, n):
            share = system[i, k] / system[k, k]
            if share != 0.0:  # droppers far from each other
                right[i] -= share * right[k]
                for j in range(k + 1, n):
                    system[i, j] -= share * system[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            right[k] -= system[k, j] * right[j]
        right[k] /= system[k, k]
    return True
