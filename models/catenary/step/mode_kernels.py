"""The modes' part of a step, for numba: they follow the attachments, and what they do in the next step is prepared.

The same arithmetic as `models.catenary.step.linear_step`, in one pass: nothing is read twice and no intermediate array
is written, because how much is read and written sets the pace. So two things that the plain step keeps are not kept.
The momentum q' + G x' is one of the rates; what its second part does is found together with what the change of x does,

    K_hat dq = a2 q' - 2 lambda q - mu G (dx - a2 / mu x'),

and reaches the attachments in the next step as if it took of their mass (`models.catenary.step.compiled_line_step`).
And forces on the wires move a few modes only, which are moved once more afterwards (`drive`).
"""

from collections import namedtuple

import numpy as np

from models.catenary.step.vector_kernels import LANES, compiled, get, nothing, part, put, reader, totals

#: Ends that the modes of a unit move with.
ENDS = 6
#: Rows of a unit: the coupling mu G with its ends, 1 / K_hat, then the motion of its modes: amplitudes and rates.
INVERSE, AMPLITUDE, RATE, ROWS = 6, 7, 8, 9
#: The modes of a line in units of eight, group by group: those of a group move with the same six ends. ``first``: the
#: first unit of every group, and one more; ``rates``, four for every kind of damping: a2 and a2 / mu, then c and d with
#: -2 lambda / K_hat = c + d / K_hat, less to read than these themselves; ``more``, shape (k, 2): units that move with
#: six further ends, and their group; ``coupling``, shape (k, 6, 8): mu G with these; ``kinds``, of the damping of
#: groups. Ends are in rows of eight, six of which count: those of the groups, then the further ones, then a row for
#: what is not needed. ``turned``: the first of ``ends``, ``places`` and ``shares``, shape (pairs, 2), for every kind of
#: damping, and one more: two ends move as two displacements in lanes, turned in plan, with cosine and sine.
Modes = namedtuple("Modes", "first rates more coupling kinds turned ends places shares")
modes_of = reader(Modes, "ufufuuwwf")
_0, _1, _2, _3, _4, _5 = (np.uint64(i) for i in range(6))
_ENDS, _LANES, _UNIT = np.uint64(ENDS), np.uint64(LANES), np.uint64(ROWS * LANES)
_R0, _R1, _R2, _R3, _R4, _R5, _INVERSE, _AMPLITUDE, _RATE = (np.uint64(LANES * row) for row in range(ROWS))


@part
def advance(modes, a1, shift, table, ends, pull):
    """Let all modes follow the attachments, replace their motion, and prepare the next step.

    Three loops take less time than one: none has so much to do for a group that the processor cannot look ahead.

    Parameters
    ----------
    modes : Modes
    a1 : float
        Of Newmark's method.
    shift : ndarray, shape (kinds * m,)
        Change of the attachments' displacements less a2 / mu of their velocities before the step, for every kind of
        damping in lanes.
    table : ndarray, shape (N * 9 * 8,)
        Unit by unit nine rows of eight modes, see `INVERSE`.
    ends : ndarray, shape ((groups + k + 1) * 8,)
        To work in: ``shift`` of all ends, then the forces on them.
    pull : ndarray, shape (m,)
        Result: forces on the attachments in the next step, as long as these are held; in lanes.
    """
    put_ends(modes, shift, ends, np.uint64(pull.size))
    for group in range(np.uint64(modes.first.size) - _1):
        rates, e = _4 * modes.kinds[group], _LANES * group
        a2, carried = modes.rates[rates], modes.rates[rates + _1]
        stiff, less = modes.rates[rates + _2], modes.rates[rates + _3]
        e0, e1, e2, e3, e4, e5 = ends[e], ends[e + _1], ends[e + _2], ends[e + _3], ends[e + _4], ends[e + _5]
        t0, t1, t2, t3, t4, t5 = nothing(), nothing(), nothing(), nothing(), nothing(), nothing()
        for k in range(modes.first[group] * _UNIT, modes.first[group + _1] * _UNIT, _UNIT):
            g0, g1, g2 = get(table, k), get(table, k + _R1), get(table, k + _R2)
            g3, g4, g5 = get(table, k + _R3), get(table, k + _R4), get(table, k + _R5)
            inverse, amplitude, rate = get(table, k + _INVERSE), get(table, k + _AMPLITUDE), get(table, k + _RATE)
            moved = g0 * e0 + g1 * e1 + g2 * e2 + g3 * e3 + g4 * e4 + g5 * e5
            back = inverse * less + stiff
            further = inverse * (rate * a2 - moved) + back * amplitude
            amplitude, rate = amplitude + further, further * a1 - rate
            put(table, k + _AMPLITUDE, amplitude)
            put(table, k + _RATE, rate)
            force = rate * carried - inverse * (rate * a2) - back * amplitude
            t0, t1, t2 = t0 + g0 * force, t1 + g1 * force, t2 + g2 * force
            t3, t4, t5 = t3 + g3 * force, t4 + g4 * force, t5 + g5 * force
        put(ends, e, totals(t0, t1, t2, t3, t4, t5))
    advance_more(modes, a1, table, ends)
    for at in range(_0, np.uint64(pull.size), _LANES):
        put(pull, at, nothing())
    put(ends, np.uint64(ends.size) - _LANES, nothing())
    for k in range(_0, np.uint64(modes.ends.size), _2):
        cosine, sine = modes.shares[k], modes.shares[k + _1]
        force, other = ends[modes.ends[k]], ends[modes.ends[k + _1]]
        pull[modes.places[k]] += cosine * force - sine * other
        pull[modes.places[k + _1]] += sine * force + cosine * other


@part
def put_ends(modes, shift, ends, size):
    """Put ``shift`` of the ends into ``ends``; ``size`` is that of an array in lanes."""
    for kind in range(np.uint64(modes.turned.size) - _1):
        begin = kind * size
        for k in range(_2 * modes.turned[kind], _2 * modes.turned[kind + _1], _2):
            cosine, sine = modes.shares[k], modes.shares[k + _1]
            one, other = shift[begin + modes.places[k]], shift[begin + modes.places[k + _1]]
            ends[modes.ends[k]] = cosine * one + sine * other
            ends[modes.ends[k + _1]] = cosine * other - sine * one


@part
def advance_more(modes, a1, table, ends):
    """Let modes follow further ends, after their own, and find the forces on these."""
    count, groups = np.uint64(modes.more.size) // _2, np.uint64(modes.first.size) - _1
    for i in range(count):
        unit, group, further = modes.more[_2 * i] * _UNIT, modes.more[_2 * i + _1], nothing()
        for j in range(_0, _ENDS):
            further -= get(modes.coupling, (i * _ENDS + j) * _LANES) * ends[(groups + i) * _LANES + j]
        further *= get(table, unit + _INVERSE)
        put(table, unit + _AMPLITUDE, get(table, unit + _AMPLITUDE) + further)
        put(table, unit + _RATE, get(table, unit + _RATE) + further * a1)
        force = force_of(modes, group, get(table, unit + _INVERSE), further, further * a1)
        put(ends, group * _LANES, get(ends, group * _LANES) + at_ends(table, unit, force))
    for i in range(count):
        unit, group = modes.more[_2 * i] * _UNIT, modes.more[_2 * i + _1]
        inverse, amplitude, rate = get(table, unit + _INVERSE), get(table, unit + _AMPLITUDE), get(table, unit + _RATE)
        force = force_of(modes, group, inverse, amplitude, rate)
        put(ends, (groups + i) * _LANES, at_ends(modes.coupling, i * _ENDS * _LANES, force))


@compiled
def momenta(modes, v, table, ends, momentum):
    """Find the momenta q' + G x' of all modes, in the order of units.

    Parameters
    ----------
    v : ndarray, shape (m,)
        Velocities of the attachments in lanes.
    table, ends
        As in `advance`.
    momentum : ndarray
        Result.
    """
    put_ends(modes, v, ends, _0)
    groups = np.uint64(modes.first.size) - _1
    for group in range(groups):
        for unit in range(modes.first[group], modes.first[group + _1]):
            moved = nothing()
            for j in range(_0, _ENDS):
                moved += get(table, unit * _UNIT + j * _LANES) * ends[group * _LANES + j]
            rate = get(table, unit * _UNIT + _RATE)
            put(momentum, unit * _LANES, rate + moved * per_mass(modes, group))
    for i in range(np.uint64(modes.more.size) // _2):
        unit, group, moved = modes.more[_2 * i], modes.more[_2 * i + _1], nothing()
        for j in range(_0, _ENDS):
            moved += get(modes.coupling, (i * _ENDS + j) * _LANES) * ends[(groups + i) * _LANES + j]
        put(momentum, unit * _LANES, get(momentum, unit * _LANES) + moved * per_mass(modes, group))


@part
def per_mass(modes, group):
    """Return 1 / mu of a group's modes."""
    return modes.rates[_4 * modes.kinds[group] + _1] / modes.rates[_4 * modes.kinds[group]]


@part
def force_of(modes, group, inverse, amplitude, rate):
    """Return what eight modes do in the next step, to be coupled with ends; as in `advance`."""
    rates = _4 * modes.kinds[group]
    back = inverse * modes.rates[rates + _3] + modes.rates[rates + _2]
    return rate * modes.rates[rates + _1] - inverse * (rate * modes.rates[rates]) - back * amplitude


@part
def at_ends(coupling, k, force):
    """Return the forces of eight modes on six ends, by their coupling from ``k`` on, and two zeros."""
    return totals(
        get(coupling, k) * force, get(coupling, k + _R1) * force, get(coupling, k + _R2) * force,
        get(coupling, k + _R3) * force, get(coupling, k + _R4) * force, get(coupling, k + _R5) * force,
    )  # fmt: skip
