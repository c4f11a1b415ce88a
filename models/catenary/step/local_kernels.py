"""Contacts and slack droppers of a step, for numba: `models.catenary.contact_and_slack.local_problem`.

There the method is explained. Here the forces of the contacts and those that slack droppers lack are one list: each
moves the contacts and pulls at a few droppers, which are listed too, not spread over all of them.
"""

from collections import namedtuple

import numpy as np

from models.catenary.step.contact_kernels import dropper_at, interval_at, moved_by, own, reached
from models.catenary.step.law_kernels import eliminate, law_of
from models.catenary.step.vector_kernels import part

#: Answers of `solve_local`; a number of LACKING or more less LACKING is the dropper whose record is lacking.
SOLVED, SINGULAR, UNSETTLED, LACKING = 0, 1, 2, 3
#: What unit forces do, those of the n contacts before those of the slack droppers: to the penetrations, ``moved``,
#: shape (n, forces); to pulls of droppers, ``pulled``, as many as ``count`` says; ``listed`` is where the records begin
#: to say which.
Effects = namedtuple("Effects", "moved pulled listed count")
_MAX_ITERATIONS = 60
_TOLERANCE = 1e-10


@part
def solve_local(records, points, contacts, yielding, droppers, numbers, slack, work):
    """Find slack and contact forces of a step.

    Parameters
    ----------
    contacts : ndarray of int, shape (n,)
        Which of the points are contacts; they get ``force``, ``depth`` and ``rate``.
    yielding : ndarray, shape (n_pantographs,)
        How far a strip yields within the step per unit force [m/N].
    droppers : Droppers
    numbers : ndarray
        Of `Work`.
    slack : ndarray of int
        Droppers to begin with.
    work : Work
        ``free``: pulls T of the droppers without these forces [N]; results: ``slack`` and ``lacks``, whether each is
        slack, and its force f.

    Returns
    -------
    int
        SOLVED, SINGULAR, UNSETTLED, or what is LACKING.
    """
    free, is_slack, lacks, pull = work.free, work.slack, work.lacks, work.pull
    n, is_taut = contacts.size, slack.size == 0
    for j in range(free.size):
        is_slack[j], lacks[j] = 0, 0.0
        is_taut &= not free[j] < 0.0
    for j in slack:
        is_slack[j] = 1
    if n == 0 and is_taut:
        return SOLVED
    forces, moved, was_closed, is_new = np.zeros(n + slack.size), np.zeros(n), np.zeros(n), True
    # Without contacts one iteration is exact for its set, and the set to begin with may well be the one.
    is_known = n == 0
    for _ in range(_MAX_ITERATIONS):
        if is_new:
            for j in slack:
                if records.droppers[j] < 0:
                    return LACKING + j
            effects = _effects(records, points, contacts, slack, yielding, work.bent.size)
            _put_moved(effects, forces, moved)
        unknown, is_regular = _newton_step(records, points, contacts, effects, droppers, free, numbers, moved, slack)
        if not is_regular:
            return SINGULAR
        change = largest = 0.0
        for i in range(n):
            change, largest = max(change, abs(unknown[i] - forces[i])), max(largest, unknown[i])
        forces, same = unknown, is_known and change <= _TOLERANCE * (1.0 + largest)
        _put_moved(effects, forces, moved)
        for i in range(n):
            is_closed = 1.0 if points.penetration[contacts[i]] + moved[i] > 0.0 else 0.0
            same &= is_closed == was_closed[i]
            was_closed[i] = is_closed
        for j in range(free.size):
            pull[j] = free[j]
        for k in range(forces.size):
            for j in range(effects.count[k]):
                pull[records.whole[effects.listed[k] + j]] += effects.pulled[k, j] * forces[k]
        is_new = False
        for j in range(pull.size):
            is_new |= (pull[j] < 0.0) != (is_slack[j] > 0)
        for k in range(slack.size):
            lacks[slack[k]] = forces[n + k]
        if same and not is_new:
            for i in range(n):
                k = contacts[i]
                points.force[k], points.depth[k] = forces[i], points.penetration[k] + moved[i]
                points.rate[k] = points.velocity[k] + numbers[0] * moved[i]
            return SOLVED
        is_known = True
        if is_new:
            slack, forces = _changed(work, forces[:n])
    return UNSETTLED


@part
def _changed(work, of_contacts):
    """Return the droppers that are slack now, and all forces, zero for those that are new."""
    count, n = 0, of_contacts.size
    for j in range(work.pull.size):
        work.slack[j] = work.pull[j] < 0.0
        count += work.slack[j]
    slack, forces, k = np.empty(count, dtype=np.int64), np.empty(n + count), 0
    for i in range(n):
        forces[i] = of_contacts[i]
    for j in range(work.pull.size):
        if work.slack[j]:
            slack[k], forces[n + k] = j, work.lacks[j]
            k += 1
        work.lacks[j] = 0.0
    return slack, forces


@part
def _effects(records, points, contacts, slack, yielding, size):
    """Return what unit forces do; ``size`` is the number of displacements of attachments."""
    n, m, most, whole, data = contacts.size, slack.size, 0, records.whole, records.data
    listed, count = np.empty(n + m, dtype=np.int64), np.empty(n + m, dtype=np.int64)
    for k in range(n + m):
        if k < n:
            interval = interval_at(whole, points.record[contacts[k]])
            listed[k], count[k] = interval.droppers, interval.stretched
        else:
            dropper = dropper_at(whole, records.droppers[slack[k - n]])
            listed[k], count[k] = dropper.droppers, dropper.stretched
        most = max(most, count[k])
    moved, pulled = np.zeros((n, n + m)), np.zeros((n + m, most))
    for k in range(n):
        source, load = contacts[k], own(points.load, points, contacts[k])
        interval = interval_at(whole, points.record[source])
        for i in range(interval.size):
            column = interval.stretch + i * count[k]
            for j in range(count[k]):
                pulled[k, j] += data[column + j] * load[i]
        for i in range(n):
            moved[i, k] = -moved_by(records, points, contacts[i], source, size)
            if points.pantograph[contacts[i]] == points.pantograph[source]:  # contacts of a strip share its retreat
                moved[i, k] -= yielding[points.pantograph[source]]
    for k in range(n, n + m):
        dropper = dropper_at(whole, records.droppers[slack[k - n]])
        for j in range(count[k]):
            pulled[k, j] = -data[dropper.stretch + j]
        for i in range(n):
            load, interval = own(points.load, points, contacts[i]), interval_at(whole, points.record[contacts[i]])
            for j in range(interval.size):
                row = reached(dropper.first, dropper.reach, whole[interval.ends + j], size)
                if row >= 0:
                    moved[i, k] += load[j] * data[dropper.column + row]
    return Effects(moved, pulled, listed, count)


@part
def _put_moved(effects, forces, moved):
    """Put what forces change of the penetrations into ``moved``."""
    for i in range(moved.size):
        moved[i] = 0.0
        for k in range(forces.size):
            moved[i] += effects.moved[i, k] * forces[k]


@part
def _newton_step(records, points, contacts, effects, droppers, free, numbers, moved, slack):
    """Solve the problem linearised at the present penetrations, for the present set of slack droppers.

    Contacts: F - slope (delta(F, f) - delta) = law; droppers of the set: f + (1 - r) T(F, f) = 0.
    """
    n, size = contacts.size, contacts.size + slack.size
    system, right = np.zeros((size, size)), np.empty(size)
    for i in range(size):
        system[i, i] = 1.0
    for i in range(n):
        k = contacts[i]
        force, stiffness, damping = law_of(
            points.penetration[k] + moved[i], points.velocity[k] + numbers[0] * moved[i],
            points.impact[k], points.engagement[k], numbers[2:],
        )  # fmt: skip
        slope = stiffness + numbers[0] * damping
        right[i] = force - slope * moved[i]
        for j in range(size):
            system[i, j] -= slope * effects.moved[i, j]
    if slack.size:
        row = np.full(free.size, -1)
        for k in range(slack.size):
            row[slack[k]], right[n + k] = n + k, -droppers.unilateral[slack[k]] * free[slack[k]]
        for k in range(size):
            for j in range(effects.count[k]):
                dropper = records.whole[effects.listed[k] + j]
                if row[dropper] >= 0:
                    system[row[dropper], k] += droppers.unilateral[dropper] * effects.pulled[k, j]
    is_regular = eliminate(system, right, size)
    return right, is_regular
