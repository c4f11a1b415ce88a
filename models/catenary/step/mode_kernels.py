"""The modes' part of a step, for numba: they follow the attachments, and what they do in the next step is prepared.

The same arithmetic as `models.catenary.step.linear_step`, in one pass: nothing is read twice and no intermediate array
is written, because how much is read and written sets the pace.
"""

from collections import namedtuple

import numpy as np

from models.catenary.step.vector_kernels import LANES, get, nothing, part, put, reader, total

#: Ends that the modes of a unit move with.
ENDS = 6
#: Rows of a unit: the coupling mu G with its ends, 1 / K_hat, then the motion of its modes: amplitudes, rates, momenta,
#: and the change of the amplitudes were the attachments held, of this step; for the next one once it is over.
INVERSE, AMPLITUDE, RATE, MOMENTUM, HELD, ROWS = 6, 7, 8, 9, 10, 11
#: The modes of a line in units of eight, group by group: those of a group move with the same six ends. ``first``: the
#: first unit of every group, and one more; ``rates``, five a group: a1 / mu, a2 and a2 / mu of the modes, then c
#: and d with -2 lambda / K_hat = c + d / K_hat, less to read than these themselves; ``places``, ``shares``, shape
#: (groups, 12): each end moves with two displacements of attachments, because intervals are turned in plan; ``more``,
#: shape (k, 2): units that move with further ends, and their group; ``more_coupling``, ``more_places`` and
#: ``more_shares``, shape (k, 6, 8), (k, 12), (k, 12): mu G with six such, and these.
Modes = namedtuple("Modes", "first rates places shares more more_coupling more_places more_shares")
modes_of = reader(Modes, "ufwfufwf")
_0, _1, _2, _3, _4, _5 = (np.uint64(i) for i in range(6))
_ENDS, _LANES, _UNIT = np.uint64(ENDS), np.uint64(LANES), np.uint64(ROWS * LANES)
_R0, _R1, _R2, _R3, _R4, _R5, _INVERSE, _AMPLITUDE, _RATE, _MOMENTUM, _HELD = (
    np.uint64(LANES * row) for row in range(ROWS)
)


@part
def end(places, shares, of, k, change):
    """Return how an end of a group's intervals moves."""
    at = _2 * (_ENDS * of + k)
    return shares[at] * change[places[at]] + shares[at + _1] * change[places[at + _1]]


@part
def draw(places, shares, of, k, force, pull):
    """Add a force on an end of a group's intervals to ``pull``."""
    at = _2 * (_ENDS * of + k)
    pull[places[at]] += shares[at] * force
    pull[places[at + _1]] += shares[at + _1] * force


@part
def advance(modes, a1, change, table, pull):
    """Let all modes follow the attachments, replace their motion, and prepare the next step.

    Parameters
    ----------
    modes : Modes
    a1 : float
        Of Newmark's method.
    change : ndarray, shape (n_attached,)
        Of the attachments' displacements.
    table : ndarray, shape (N * 11 * 8,)
        Unit by unit eleven rows of eight modes, see `INVERSE`.
    pull : ndarray, shape (n_attached,)
        Result: forces on the attachments in the next step, as long as these are held.
    """
    for i in range(pull.size):
        pull[i] = 0.0
    follow_more(modes, change, table)
    places, shares = modes.places, modes.shares
    for group in range(np.uint64(modes.rates.size) // _5):
        rates = _5 * group
        to_momentum, a2, from_rate = modes.rates[rates], modes.rates[rates + _1], modes.rates[rates + _2]
        stiff, less = modes.rates[rates + _3], modes.rates[rates + _4]
        e0, e1 = end(places, shares, group, _0, change), end(places, shares, group, _1, change)
        e2, e3 = end(places, shares, group, _2, change), end(places, shares, group, _3, change)
        e4, e5 = end(places, shares, group, _4, change), end(places, shares, group, _5, change)
        t0, t1, t2, t3, t4, t5 = nothing(), nothing(), nothing(), nothing(), nothing(), nothing()
        for k in range(modes.first[group] * _UNIT, modes.first[group + _1] * _UNIT, _UNIT):
            g0, g1, g2 = get(table, k), get(table, k + _R1), get(table, k + _R2)
            g3, g4, g5 = get(table, k + _R3), get(table, k + _R4), get(table, k + _R5)
            moved, inverse = g0 * e0 + g1 * e1 + g2 * e2 + g3 * e3 + g4 * e4 + g5 * e5, get(table, k + _INVERSE)
            further = get(table, k + _HELD) - moved * inverse
            quick, amplitude = further * a1, get(table, k + _AMPLITUDE) + further
            rate = quick - get(table, k + _RATE)
            momentum = quick + moved * to_momentum - get(table, k + _MOMENTUM)
            held = inverse * a2 * momentum + (inverse * less + stiff) * amplitude
            put(table, k + _AMPLITUDE, amplitude)
            put(table, k + _RATE, rate)
            put(table, k + _MOMENTUM, momentum)
            put(table, k + _HELD, held)
            value = rate * from_rate - held
            t0, t1, t2 = t0 + g0 * value, t1 + g1 * value, t2 + g2 * value
            t3, t4, t5 = t3 + g3 * value, t4 + g4 * value, t5 + g5 * value
        draw(places, shares, group, _0, total(t0), pull)
        draw(places, shares, group, _1, total(t1), pull)
        draw(places, shares, group, _2, total(t2), pull)
        draw(places, shares, group, _3, total(t3), pull)
        draw(places, shares, group, _4, total(t4), pull)
        draw(places, shares, group, _5, total(t5), pull)
    draw_more(modes, table, pull)


@part
def follow_more(modes, change, table):
    """Put what further ends do to the modes into ``table``, so that `advance` finds it there."""
    for i in range(np.uint64(modes.more.size) // _2):
        begin, group = modes.more[_2 * i] * _UNIT, modes.more[_2 * i + _1]
        moved = nothing()
        for j in range(_0, _ENDS):
            moved += get(modes.more_coupling, (i * _ENDS + j) * _LANES) * end(
                modes.more_places, modes.more_shares, i, j, change
            )
        put(table, begin + _HELD, get(table, begin + _HELD) - moved * get(table, begin + _INVERSE))
        put(table, begin + _MOMENTUM, get(table, begin + _MOMENTUM) - moved * modes.rates[_5 * group])


@part
def draw_more(modes, table, pull):
    """Add what modes do to further ends to ``pull``."""
    for i in range(np.uint64(modes.more.size) // _2):
        begin, group = modes.more[_2 * i] * _UNIT, modes.more[_2 * i + _1]
        value = get(table, begin + _RATE) * modes.rates[_5 * group + _2] - get(table, begin + _HELD)
        for j in range(_0, _ENDS):
            force = total(value * get(modes.more_coupling, (i * _ENDS + j) * _LANES))
            draw(modes.more_places, modes.more_shares, i, j, force, pull)
