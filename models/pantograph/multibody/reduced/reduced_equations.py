"""The reduced equations of motion and their integration, in the part of Python that numba compiles as well.

Coordinates are theta, which the closed arm follows; the roll phi of the head; and the displacements sigma of the bodies
that slide on the carrier, the body of the arm that carries the head. Everything of the arm is tabulated over theta. A
body of the head has its centre at

    p = p0 + sin(phi) ps + cos(phi) pc + sigma e,    e = e0 + sin(phi) es + cos(phi) ec

in axes that turn with the carrier about the y axis, by the pitch beta(theta). With its velocity linear in the rates of
the coordinates, v = sum of columns times rates, and b the rest of its acceleration, virtual work gives

    sum over columns of  m column . (columns rates' + b) + (rotation) = generalised forces.

Displacements do not feel each other's inertia: they are eliminated one by one, which leaves theta and phi.

Numbers come as lists or arrays, rows of tables as lists or rows of arrays: the same lines run as Python on lists, and
compiled on arrays. ``model`` is what `reduced_motion.ReducedModel.numbers` makes. ``memory`` is what a step leaves for
the next one: the coordinates with their rates (2 n), their accelerations (n) and response (3 n), the rates of all these
in the middle and at the beginning of the step before (2 n each), single numbers.

The file is longer than others because kernels are compiled from one source, and its functions take everything as
numbers.
"""

from __future__ import annotations

from math import ceil, cos, nan, sin, sqrt, tanh
from typing import Any

import numpy as np

#: Functions of theta, in the order of the table; those of elements of the arm follow.
INERTIA, SLOPE, WEIGHT, OWN, DAMPING, LEVER, PLACE, VX, VZ, PITCH, AX, AZ, PITCH_2, SINE, COSINE = range(15)
CARRIER_X, CARRIER_Z, FIRST_OF_ARM = 15, 16, 17
#: As in `mechanism_integrator`.
_SMALLEST_STEP, _GROWTH = 1e-9, 2.0
#: A coordinate that no motion reaches.
_ABSURD = 1e6
#: What became of a step.
DONE, TOO_SMALL, BEYOND = range(3)
#: Single numbers of a memory: last inputs, length of the step before (0: nothing to continue), step to try.
FORCE, FORCE_Y, BASE_A, LIFT, UPLIFT, BEFORE, NEXT, SINGLE = range(8)


def look_up(table: Any, theta: Any) -> Any:
    """Return the functions of a table at ``theta``; beyond its ends those of the last cell go on."""
    start, scale, count, cells = table
    place = (theta - start) * scale
    k = min(max(int(place), 0), count - 1)
    x = place - k
    x2 = x * x
    x3 = x2 * x
    return cells[k].dot(np.array((1.0, x, x2, x3, x2 * x2, x2 * x3))).tolist()


def put(target: Any, values: Any) -> None:
    """Write values into a memory."""
    target[:] = values


def is_beyond(table: Any, theta: Any) -> Any:
    """Return whether a table does not say anything about ``theta``."""
    start, scale, count, _ = table
    return not 0.0 <= (theta - start) * scale <= count


def curve_at(curve: Any, x: Any) -> Any:
    """Return the value of a cubic curve, rows (place, coefficients highest first), its end values held outside."""
    last = len(curve) - 1
    if x >= curve[last][0]:
        return curve[last][4]
    if x <= curve[0][0]:
        return curve[0][4]
    low, high = 0, last
    while high - low > 1:
        middle = (low + high) // 2
        if curve[middle][0] <= x:
            low = middle
        else:
            high = middle
    piece = curve[low]
    t = x - piece[0]
    return piece[4] + t * (piece[3] + t * (piece[2] + t * piece[1]))


def lift_value(curves: Any, place: Any, lift: Any, uplift: Any) -> Any:
    """Return what the lifting element gives [N or N.m]; see `ForceElements.lift_value`."""
    for_weights, per_lift, per_force, adds = curves
    value = lift
    if len(per_lift) > 0:
        own = curve_at(for_weights, place) if len(for_weights) > 0 else 0.0
        value = own + lift * curve_at(per_lift, place)
    if uplift == 0.0:
        return value
    if len(per_force) > 0:
        return value + uplift * curve_at(per_force, place)
    return value + uplift if adds > 0 else value


def stop_force(value: Any, rate: Any, lowest: Any, highest: Any, stiffness: Any, damping: Any) -> Any:
    """Return the force of a stop on a length or an angle: against what lies beyond, never pulling back."""
    if value > highest:
        return max(stiffness * (value - highest) + damping * rate, 0.0)
    if value < lowest:
        return min(stiffness * (value - lowest) + damping * rate, 0.0)
    return 0.0


def arm_force(arm: Any, t: Any, rate: Any) -> Any:
    """Return the generalised force of stops and friction in the arm."""
    total = 0.0
    for row in arm:
        value, slope = t[int(row[0])], t[int(row[1])]
        if row[6] > 0.0:
            total -= row[6] * tanh(slope * rate / row[7]) * slope
        else:
            total -= stop_force(value, slope * rate, row[2], row[3], row[4], row[5]) * slope
    return total


def line_forces(lines: Any, rolls: Any, sine: Any, cosine: Any, y: Any, n: Any, forces: Any) -> Any:
    """Add the generalised forces of springs, dampers and stops of the head to ``forces``; return that on the roll."""
    on_roll, by_roll, roll_rate = 0.0, 0.0, y[n + 1]
    for row in lines:
        a, b = int(row[0]), int(row[1])
        gap = rate = 0.0
        if b >= 0:
            gap, rate = y[2 + b], y[n + 2 + b]
        if a >= 0:
            gap -= y[2 + a]
            rate -= y[n + 2 + a]
        bend = gap * row[9]
        if rolls:
            by_gap = row[6] + sine * row[7] + cosine * row[8]
            value = row[3] + sine * row[4] + cosine * row[5] + gap * (by_gap + bend)
        else:
            by_gap = row[6] + row[8]
            value = row[3] + row[5] + gap * (by_gap + bend)
        squared, is_stop = row[2] == 0.0, row[14] > 0.0
        if squared:
            value = sqrt(abs(value)) + 1e-300
        if is_stop and row[16] <= value <= row[17]:  # a stop is nothing besides
            continue
        by_gap += 2.0 * bend
        if rolls:
            by_roll = cosine * row[4] - sine * row[5] + gap * (cosine * row[7] - sine * row[8])
        if squared:
            half = 0.5 / value
            by_gap *= half
            by_roll *= half
        speed = by_gap * rate + by_roll * roll_rate
        if is_stop:
            tension = stop_force(value, speed, row[16], row[17], row[14], row[15])
        else:
            tension = row[10] * (value - row[11]) + row[12] * speed - row[13]
        on_roll -= tension * by_roll
        if b >= 0:
            forces[b] -= tension * by_gap
        if a >= 0:
            forces[a] += tension * by_gap
    return on_roll


def joint_forces(slides: Any, turns: Any, y: Any, n: Any, forces: Any) -> Any:
    """Add friction of the head's slides to ``forces``; return the moments of stops, friction and drives on its roll."""
    for row in slides:
        a, b = int(row[0]), int(row[1])
        rate = 0.0
        if b >= 0:
            rate = y[n + 2 + b]
        if a >= 0:
            rate -= y[n + 2 + a]
        friction = row[2] * tanh(rate / row[3])
        if b >= 0:
            forces[b] -= friction
        if a >= 0:
            forces[a] += friction
    on_roll = 0.0
    for row in turns:
        factor = row[1]
        rate = factor * y[n + 1]
        moment = stop_force(row[0] + factor * y[1], rate, row[2], row[3], row[4], row[5]) - row[8]
        if row[6] > 0.0:
            moment += row[6] * tanh(rate / row[7])
        on_roll -= moment * factor
    return on_roll


def is_free(y: Any, model: Any, lowest: Any, highest: Any) -> Any:
    """Return whether no stop is reached, and the lifting element is between two places."""
    table, single, _, lines, _, turns, arm, _, _ = model
    t = look_up(table, y[0])
    if not lowest <= t[PLACE] <= highest:
        return False
    for row in arm:
        if row[6] == 0.0 and not row[2] <= t[int(row[0])] <= row[3]:
            return False
    roll = y[1] if single[1] == 0.0 else 0.0
    sine, cosine = sin(roll), cos(roll)
    for row in turns:
        if not row[2] <= row[0] + row[1] * roll <= row[3]:
            return False
    for row in lines:
        if row[14] == 0.0:  # no stop
            continue
        a, b = int(row[0]), int(row[1])
        gap = y[2 + b] if b >= 0 else 0.0
        gap -= y[2 + a] if a >= 0 else 0.0
        value = row[3] + sine * row[4] + cosine * row[5]
        value += gap * (row[6] + sine * row[7] + cosine * row[8] + gap * row[9])
        if row[2] == 0.0:
            value = sqrt(abs(value))
        if not row[16] <= value <= row[17]:
            return False
    return True


def strip_on_body(strip: Any, sin_p: Any, cos_p: Any) -> Any:
    """Return the strip's direction across, and where its middle is from its body's centre, in axes of the carrier."""
    if strip[21] == 0.0:
        return strip[10], strip[11], strip[12], strip[1], strip[2], strip[3]
    return (
        strip[10] + sin_p * strip[13] + cos_p * strip[16],
        strip[11] + sin_p * strip[14] + cos_p * strip[17],
        strip[12] + sin_p * strip[15] + cos_p * strip[18],
        strip[1] + sin_p * strip[4] + cos_p * strip[7],
        strip[2] + sin_p * strip[5] + cos_p * strip[8],
        strip[3] + sin_p * strip[6] + cos_p * strip[9],
    )


def motion_of(body: Any, y: Any, n: Any, sin_p: Any, cos_p: Any) -> Any:
    """Return how a body of the head stands to the carrier.

    Returns
    -------
    tuple of 15 floats
        Place of its centre, its derivative by the roll and by its displacement, its velocity, and what its acceleration
        is without those of the coordinates; in axes of the carrier, as if that stood still.
    """
    slide = int(body[0])
    s = s_rate = 0.0
    if slide >= 0:
        s, s_rate = y[2 + slide], y[n + 2 + slide]
    px, py, pz = body[3], body[4], body[5]
    ex, ey, ez = body[12], body[13], body[14]
    if body[1] == 0.0:
        return (
            px + s * ex, py + s * ey, pz + s * ez, 0.0, 0.0, 0.0, ex, ey, ez,
            s_rate * ex, s_rate * ey, s_rate * ez, 0.0, 0.0, 0.0,
        )  # fmt: skip
    rate = y[n + 1]
    ux, uy, uz = (
        sin_p * body[6] + cos_p * body[9],
        sin_p * body[7] + cos_p * body[10],
        sin_p * body[8] + cos_p * body[11],
    )
    hx, hy, hz = (
        sin_p * body[15] + cos_p * body[18],
        sin_p * body[16] + cos_p * body[19],
        sin_p * body[17] + cos_p * body[20],
    )
    gx, gy, gz = (
        cos_p * body[15] - sin_p * body[18],
        cos_p * body[16] - sin_p * body[19],
        cos_p * body[17] - sin_p * body[20],
    )
    tx = cos_p * body[6] - sin_p * body[9] + s * gx
    ty = cos_p * body[7] - sin_p * body[10] + s * gy
    tz = cos_p * body[8] - sin_p * body[11] + s * gz
    ex, ey, ez = ex + hx, ey + hy, ez + hz
    square, both = rate * rate, 2.0 * rate * s_rate
    return (
        px + ux + s * ex, py + uy + s * ey, pz + uz + s * ez, tx, ty, tz, ex, ey, ez,
        rate * tx + s_rate * ex, rate * ty + s_rate * ey, rate * tz + s_rate * ez,
        both * gx - square * (ux + s * hx), both * gy - square * (uy + s * hy), both * gz - square * (uz + s * hz),
    )  # fmt: skip


def evaluate(y: Any, given: Any, model: Any, respond: Any) -> Any:
    """Return the accelerations of the coordinates, and if wanted what they become per change of the inputs.

    Parameters
    ----------
    y : sequence, length 2 n
        Coordinates, then their rates.
    given : (force, lateral, base acceleration, lift, uplift)
    respond : bool
        Here never a constant: numba would compile the function for each of the two.

    Returns
    -------
    accelerations : list, length n
    response : list, length 3 n
        Per contact force at y = 0, per contact force times y, per acceleration of the base; empty if not wanted.
    """
    table, single, bodies, lines, slides, turns, arm, strip, curves = model
    force, lateral, base, lift, uplift = given
    n = len(y) // 2
    if not (abs(y[0]) < _ABSURD and abs(y[1]) < _ABSURD):  # not a number, either: the step is too long
        return [nan] * n, [nan] * (3 * n)
    t = look_up(table, y[0])
    speed, roll_rate = y[n], y[n + 1]
    square = speed * speed
    pitch, sine, cosine = t[PITCH], t[SINE], t[COSINE]
    vx, vz, ax, az = t[VX], t[VZ], t[AX] * square, t[AZ] * square
    turn, turning = pitch * speed, t[PITCH_2] * square
    turn_2 = turn * turn
    m_tt, m_tp, m_pp = t[INERTIA], 0.0, single[1]
    w_t, w_p = t[WEIGHT], 0.0
    f_t = t[OWN] - t[SLOPE] * square - t[DAMPING] * speed
    f_t += t[LEVER] * lift_value(curves, t[PLACE], lift, uplift)
    if len(arm) > 0:
        f_t += arm_force(arm, t, speed)
    rolls, sin_p, cos_p = m_pp == 0.0, 0.0, 1.0
    if rolls:
        sin_p, cos_p = sin(y[1]), cos(y[1])
    none = [0.0] * (n - 2)
    m_ts, m_ps, m_ss, w_s, f_s = none[:], none[:], none[:], none[:], none[:]
    f_p = line_forces(lines, rolls, sin_p, cos_p, y, n, f_s)
    if len(slides) + len(turns) > 0:
        f_p += joint_forces(slides, turns, y, n, f_s)
    on = strip[0]
    # Of the strip's body: place and columns.
    k_py = k_tx = k_tz = k_ex = k_ez = 0.0
    k_cx, k_cz, k_slide = vx, vz, -1
    number = 0.0
    for body in bodies:
        slide, mass = int(body[0]), body[2]
        if body[1] > 0.0:
            px, py, pz, tx, ty, tz, ex, ey, ez, wx, _, wz, rx, ry, rz = motion_of(body, y, n, sin_p, cos_p)
            by = mass * ry
        else:  # `motion_of` in few words
            px, py, pz, ex, ey, ez = body[3], body[4], body[5], body[12], body[13], body[14]
            tx = ty = tz = wx = wz = rx = rz = by = 0.0
            if slide >= 0:
                shift, rate = y[2 + slide], y[n + 2 + slide]
                px += shift * ex
                py += shift * ey
                pz += shift * ez
                wx, wz = rate * ex, rate * ez
        cx, cz = vx + pitch * pz, vz - pitch * px
        bx = mass * (ax + turning * pz + 2.0 * turn * wz - turn_2 * px + rx)
        bz = mass * (az - turning * px - 2.0 * turn * wx - turn_2 * pz + rz)
        m_tt += mass * (cx * cx + cz * cz)
        f_t -= cx * bx + cz * bz
        w_t -= mass * (cosine * cz - sine * cx)
        if slide >= 0:
            m_ts[slide] += mass * (cx * ex + cz * ez)
            m_ss[slide] += mass * (ex * ex + ey * ey + ez * ez)
            f_s[slide] -= ex * bx + ey * by + ez * bz
            w_s[slide] -= mass * (cosine * ez - sine * ex)
        if body[1] > 0.0:
            m_tp += mass * (cx * tx + cz * tz)
            m_pp += mass * (tx * tx + ty * ty + tz * tz) + body[29]
            f_p -= tx * bx + ty * by + tz * bz
            w_p -= mass * (cosine * tz - sine * tx)
            if slide >= 0:
                m_ps[slide] += mass * (tx * ex + ty * ey + tz * ez)
            double, slant = sin_p * body[24], cos_p * body[25]
            j_yy = body[21] + body[22] * sin_p + body[23] * cos_p + sin_p * (double + slant)
            d_yy = cos_p * (body[22] + 2.0 * double + slant) - sin_p * (body[23] + sin_p * body[25])
            j_yp = body[26] + body[27] * sin_p + body[28] * cos_p
            d_yp = body[27] * cos_p - body[28] * sin_p
            m_tt += pitch * pitch * j_yy
            m_tp += pitch * j_yp
            f_t -= pitch * (turning * j_yy + turn * roll_rate * d_yy + roll_rate * roll_rate * d_yp)
            f_p -= turning * j_yp - 0.5 * turn_2 * d_yy
        else:
            turned = pitch * body[21]
            m_tt += pitch * turned
            f_t -= turning * turned
        if number == on:
            k_py, k_cx, k_cz, k_slide = py, cx, cz, slide
            k_tx, k_tz, k_ex, k_ez = tx, tz, ex, ez
        number += 1.0
    # The contact's columns, at y = 0 and per y.
    dx, dy, dz, lx, ly, lz = strip_on_body(strip, sin_p, cos_p)
    along = -(strip[19] + k_py + ly) / dy
    lx += along * dx
    ly += along * dy
    lz += along * dz
    dx /= dy
    dz /= dy
    c_t = -(cosine * (k_cz - pitch * lx) - sine * (k_cx + pitch * lz))
    d_t = pitch * (cosine * dx + sine * dz)
    c_p = d_p = c_s = 0.0
    if strip[21] > 0.0:
        ux, uy, uz = single[2], single[3], single[4]
        c_p = -(cosine * (k_tz + ux * ly - uy * lx) - sine * (k_tx + uy * lz - uz * ly))
        d_p = -(cosine * (ux - uy * dx) - sine * (uy * dz - uz))
    if k_slide >= 0:
        c_s = -(cosine * k_ez - sine * k_ex)
    gravity, moment = single[0] + base, force * lateral
    f_t += gravity * w_t + force * c_t + moment * d_t
    f_p += gravity * w_p + force * c_p + moment * d_p
    for j in range(n - 2):
        f_s[j] += gravity * w_s[j]
    if k_slide >= 0:
        f_s[k_slide] += force * c_s
    # Displacements first: what is left of inertia, and how they follow.
    by_t, by_p = none[:], none[:]
    for j in range(n - 2):
        share = 1.0 / m_ss[j]
        by_t[j], by_p[j] = share * m_ts[j], share * m_ps[j]
        m_tt -= by_t[j] * m_ts[j]
        m_tp -= by_t[j] * m_ps[j]
        m_pp -= by_p[j] * m_ps[j]
    one = 1.0 / (m_tt * m_pp - m_tp * m_tp)
    inverse = (one * m_pp, -one * m_tp, one * m_tt)
    result = solved(inverse, by_t, by_p, m_ss, f_t, f_p, f_s)
    if not respond:
        return result, result[:0]
    u_s = none[:]
    if k_slide >= 0:
        u_s[k_slide] = c_s
    response = solved(inverse, by_t, by_p, m_ss, c_t, c_p, u_s)
    response += solved(inverse, by_t, by_p, m_ss, d_t, d_p, none)
    response += solved(inverse, by_t, by_p, m_ss, w_t, w_p, w_s)
    return result, response


def solved(inverse: Any, by_t: Any, by_p: Any, m_ss: Any, f_t: Any, f_p: Any, f_s: Any) -> Any:
    """Return the accelerations under generalised forces, inertia being eliminated and inverted."""
    i_tt, i_tp, i_pp = inverse
    for b_t, b_p, f in zip(by_t, by_p, f_s):  # noqa: B905 - numba
        f_t -= b_t * f
        f_p -= b_p * f
    a_t, a_p = i_tt * f_t + i_tp * f_p, i_tp * f_t + i_pp * f_p
    result = [a_t, a_p]
    for b_t, b_p, m, f in zip(by_t, by_p, m_ss, f_s):  # noqa: B905
        result.append(f / m - b_t * a_t - b_p * a_p)
    return result


def inputs_at(given: Any, tau: Any, inside: Any) -> Any:
    """Return (force, lateral, base acceleration, lift, uplift) ``tau`` after the beginning of a step.

    ``given`` holds 23 numbers: see `reduced_motion.ReducedMotion.step`. Where the lift jumps, it is that of the piece
    of the step in which the time ``inside`` lies.
    """
    time = given[0] + tau
    elapsed = time - given[1]
    share = 0.0
    if given[20] == 0.0:
        share = 1.0 if given[0] + inside - given[1] >= given[19] else 0.0
    elif elapsed >= given[19]:
        share = min(1.0, (elapsed - given[19]) / given[20])
    lift, uplift = given[17] + share * (given[18] - given[17]), given[21]
    if given[22] > 0.0:
        lift, uplift = lift + uplift, 0.0
    lateral = given[10] + given[11] * (time - given[12])
    return force_at(given, time), lateral, 2.0 * given[15] + 6.0 * given[16] * tau, lift, uplift


def force_at(given: Any, time: Any) -> Any:
    """Return the contact force at ``time``; see `ForceExtrapolation.at`."""
    t0, f0 = given[3], given[6]
    if f0 == 0.0 and time > t0:
        return 0.0
    degree, result = min(given[9], given[2] - 1.0), f0
    if degree >= 1.0:
        first = (f0 - given[7]) / (t0 - given[4])
        result += first * (time - t0)
        if degree >= 2.0:
            second = (first - (given[7] - given[8]) / (given[4] - given[5])) / (t0 - given[5])
            result += second * (time - t0) * (time - given[4])
    return result if result > 0.0 else 0.0


def begin(memory: Any, given: Any, model: Any, settings: Any) -> None:
    """Begin at the coordinates and rates in a memory: fill the rest of it."""
    state, rates, kept, _, _, single = memory
    inputs = inputs_at(given, 0.0, 0.0)
    acceleration, response = evaluate(list(state), inputs, model, len(rates) > 0)
    put(rates, acceleration)
    put(kept, response)
    keep_inputs(single, inputs)
    single[BEFORE], single[NEXT] = 0.0, settings[1]


def keep_inputs(single: Any, inputs: Any) -> None:
    """Note what acted."""
    force, lateral, base, lift, uplift = inputs
    single[FORCE], single[FORCE_Y], single[BASE_A] = force, force * lateral, base
    single[LIFT], single[UPLIFT] = lift, uplift


def step(memory: Any, given: Any, duration: Any, model: Any, settings: Any) -> Any:
    """Advance a memory by ``duration``, as `mechanism_integrator.Integrator.advance` does; return what became of it.

    Parameters
    ----------
    settings : (float, float, sequence of 2 n)
        Local error of an internal step [m], longest one [s], weights of coordinates and rates.

    Returns
    -------
    int
        DONE; or why nothing has changed: TOO_SMALL, BEYOND (the table).
    """
    state, rates, kept, kept_middle, kept_begun, single = memory
    n = len(rates)
    y, middle, begun = list(state), list(kept_middle), list(kept_begun)
    rise, latest = given[19] - (given[0] - given[1]), duration - _SMALLEST_STEP
    raised, inside = rise + given[20], 0.5 * (rise if _SMALLEST_STEP < rise < latest else duration)
    acting = inputs_at(given, 0.0, inside)
    force, lateral, base, lift, uplift = acting
    before, first = single[BEFORE], y[n:]
    if lift == single[LIFT] and uplift == single[UPLIFT]:
        d_force, d_moment, d_base = force - single[FORCE], force * lateral - single[FORCE_Y], base - single[BASE_A]
        for i in range(n):
            change = d_force * kept[i] + d_moment * kept[n + i] + d_base * kept[2 * n + i]
            first.append(rates[i] + change)
            middle[n + i] += change
            begun[n + i] += change
    else:
        acceleration, _ = evaluate(y, acting, model, n < 0)
        first, before = first + acceleration, 0.0
    response = first[:0]
    if abs(rise) <= _SMALLEST_STEP or abs(raised) <= _SMALLEST_STEP:
        before = 0.0
    now, trial = 0.0, single[NEXT]
    for end in (rise, raised, duration):  # inputs have kinks there: internal steps end there
        if end != duration and not _SMALLEST_STEP < end < latest:
            continue
        inside = 0.5 * (now + end)
        if given[20] == 0.0 and 0.0 < now < end:  # the lift has jumped
            acceleration, _ = evaluate(y, inputs_at(given, now, inside), model, n < 0)
            first = y[n:] + acceleration
        while now < end:
            longest = min(trial, settings[1], duration)
            pieces = max(1, int(ceil((end - now) / longest - 1e-6)))  # noqa: RUF046 - compiled, ceil is no integer
            h = (end - now) / pieces
            if before > 0.0 and abs(before - h) <= 1e-9 * h:
                new, new_rates, response, between, acting, error = continued(
                    y, first, middle, begun, given, now, inside, h, model, settings
                )
            else:
                new, new_rates, response, between, acting, error = started(
                    y, first, given, now, inside, h, model, settings
                )
            if not error <= 1.0:
                trial, before = h * factor(error), 0.0
                if trial < _SMALLEST_STEP:
                    return TOO_SMALL
                continue
            if is_beyond(model[0], new[0]):
                return BEYOND
            now = end if pieces == 1 else now + h
            y, middle, begun, first, before = new, between, first, new_rates, h
            trial = longest
            if longest < settings[1]:
                growth = factor(error)
                trial = min(longest * growth if growth >= _GROWTH else longest, settings[1])
        if end < duration:
            before = 0.0
    put(state, y)
    put(rates, first[n:])
    put(kept, response)
    put(kept_middle, middle)
    put(kept_begun, begun)
    keep_inputs(single, inputs_at(given, duration, inside) if before != duration else acting)
    single[BEFORE], single[NEXT] = before, trial
    return DONE


def continued(
    y: Any, first: Any, before: Any, begun: Any, given: Any, now: Any, inside: Any, h: Any, model: Any, settings: Any
) -> Any:
    """Predict by the parabola through the last three rates, correct by Simpson's rule; see `Integrator`."""
    n = len(y) // 2
    a, b, c = h / 24.0, h / 48.0, h / 6.0
    v, f, m, k = y[n:], first[n:], before[n:], begun[n:]
    speeds, places = [], []
    # Of a coordinate: place and speed; rates of both at first, in the middle of the step before, at its beginning.
    for x, u, q, dq, r, dr, s, ds in zip(y, v, first, f, before, m, begun, k):  # noqa: B905 - numba
        speed = u + a * (23.0 * dq - 16.0 * dr + 5.0 * ds)
        speeds.append(speed)
        places.append(x + b * (s - 5.0 * r + 19.0 * q + 9.0 * speed))
    acceleration, _ = evaluate(places + speeds, inputs_at(given, now + 0.5 * h, inside), model, n < 0)
    guess, places = [], []
    for x, u, q, dq, dr, r, dm in zip(y, v, first, f, m, speeds, acceleration):  # noqa: B905
        speed = u + c * (dr - 2.0 * dq + 7.0 * dm)
        guess.append(speed)
        places.append(x + c * (q + 4.0 * r + speed))
    acting = inputs_at(given, now + h, inside)
    latest, response = evaluate(places + guess, acting, model, n > 0)
    places, ends, largest = [], [], 0.0
    terms = zip(y, v, first, f, acceleration, latest, guess, settings[2][n:])  # noqa: B905
    for x, u, q, dq, dm, de, guessed, weight in terms:
        speed = u + c * (dq + 4.0 * dm + de)
        half = u + a * (5.0 * dq + 8.0 * dm - de)
        ends.append(speed)
        places.append(x + c * (q + 4.0 * half + speed))
        difference = abs(speed - guessed) * weight  # of places it is 0 by construction
        if not difference <= largest:
            largest = difference
    return places + ends, guess + latest, response, speeds + acceleration, acting, largest / settings[0]


def started(y: Any, first: Any, given: Any, now: Any, inside: Any, h: Any, model: Any, settings: Any) -> Any:
    """Take a Runge-Kutta step; see `Integrator`."""
    n = len(y) // 2
    at_middle, at_end = inputs_at(given, now + 0.5 * h, inside), inputs_at(given, now + h, inside)
    a, c = 0.5 * h, h / 6.0
    second = [y[i] + a * first[i] for i in range(2 * n)]
    acceleration, _ = evaluate(second, at_middle, model, n < 0)
    k2 = second[n:] + acceleration
    third = [y[i] + a * k2[i] for i in range(2 * n)]
    acceleration, _ = evaluate(third, at_middle, model, n < 0)
    k3 = third[n:] + acceleration
    fourth = [y[i] + h * k3[i] for i in range(2 * n)]
    acceleration, _ = evaluate(fourth, at_end, model, n < 0)
    k4 = fourth[n:] + acceleration
    new = [y[i] + c * (first[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) for i in range(2 * n)]
    acceleration, response = evaluate(new, at_end, model, n > 0)
    last = new[n:] + acceleration
    error = error_of([c * k for k in k4], [c * k for k in last], settings[2], settings[0])
    return new, last, response, k3, at_end, error


def error_of(a: Any, b: Any, weights: Any, tolerance: Any) -> Any:
    """Return the largest difference in units of the tolerance."""
    largest = 0.0
    for x, y, weight in zip(a, b, weights):  # noqa: B905
        difference = abs(x - y) * weight
        if not difference <= largest:
            largest = difference
    return largest / tolerance


def factor(error: Any) -> Any:
    """Return by how much a step may grow."""
    if not error < _ABSURD:
        return 0.1
    return min(4.0, max(0.1, 0.9 * max(error, 1e-10) ** -0.25))


def place_strip(memory: Any, model: Any, moved: Any, ends: Any) -> None:
    """Write the ends of the strip, 12 numbers: A, B; position, velocity; x, y, z.

    Parameters
    ----------
    moved : sequence of 4
        What is added to x, z and their rates: the train and the base.
    """
    table, _, bodies, _, _, _, _, strip, _ = model
    y, n = memory[0], len(memory[1])
    t = look_up(table, y[0])
    sin_p, cos_p = sin(y[1]), cos(y[1])
    sine, cosine, turn = t[SINE], t[COSINE], t[PITCH] * y[n]
    px = py = pz = wx = wy = wz = 0.0
    on = int(strip[0])
    if on >= 0:
        px, py, pz, _, _, _, _, _, _, wx, wy, wz, _, _, _ = motion_of(bodies[on], y, n, sin_p, cos_p)
    roll = y[n + 1] if strip[21] > 0.0 else 0.0
    ux, uy, uz = model[1][2] * roll, model[1][3] * roll, model[1][4] * roll
    dx, dy, dz, lx, ly, lz = strip_on_body(strip, sin_p, cos_p)
    x, z = px + lx, pz + lz
    vx = t[VX] * y[n] + turn * z + wx + uy * lz - uz * ly
    vz = t[VZ] * y[n] - turn * x + wz + ux * ly - uy * lx
    vy, py = wy + uz * lx - ux * lz, strip[19] + py + ly
    # From the middle to end A, and how that turns.
    half = strip[20]
    dx, dy, dz = half * dx, half * dy, half * dz
    qx, qy, qz = turn * dz + uy * dz - uz * dy, uz * dx - ux * dz, ux * dy - uy * dx - turn * dx
    middle = t[CARRIER_X] + cosine * x + sine * z + moved[0], t[CARRIER_Z] - sine * x + cosine * z + moved[1]
    speed = cosine * vx + sine * vz + moved[2], cosine * vz - sine * vx + moved[3]
    away = cosine * dx + sine * dz, cosine * dz - sine * dx
    rate = cosine * qx + sine * qz, cosine * qz - sine * qx
    ends[0], ends[1], ends[2] = middle[0] + away[0], py + dy, middle[1] + away[1]
    ends[3], ends[4], ends[5] = speed[0] + rate[0], vy + qy, speed[1] + rate[1]
    ends[6], ends[7], ends[8] = middle[0] - away[0], py - dy, middle[1] - away[1]
    ends[9], ends[10], ends[11] = speed[0] - rate[0], vy - qy, speed[1] - rate[1]


def place_bodies(memory: Any, model: Any, outline: Any, moved: Any, out: Any) -> None:
    """Write height, velocity and acceleration of the arm's bodies, then of the head's.

    Parameters
    ----------
    outline : table
        Height of the arm's bodies and two derivatives.
    moved : sequence of 3
        What is added: height, velocity and acceleration of the base.
    """
    table, _, bodies, _, _, _, _, _, _ = model
    y, rates = memory[0], memory[1]
    n = len(rates)
    t, o = look_up(table, y[0]), look_up(outline, y[0])
    speed, rise = y[n], rates[0]
    square = speed * speed
    k = 0
    for i in range(0, len(o), 3):
        out[k], out[k + 1] = o[i] + moved[0], o[i + 1] * speed + moved[1]
        out[k + 2] = o[i + 1] * rise + o[i + 2] * square + moved[2]
        k += 3
    sin_p, cos_p = sin(y[1]), cos(y[1])
    sine, cosine, turn = t[SINE], t[COSINE], t[PITCH] * speed
    turning = t[PITCH] * rise + t[PITCH_2] * square
    for body in bodies:
        px, _, pz, tx, _, tz, ex, _, ez, wx, _, wz, rx, _, rz = motion_of(body, y, n, sin_p, cos_p)
        slide = int(body[0])
        own = rates[2 + slide] if slide >= 0 else 0.0
        roll = rates[1]
        bx = t[VX] * rise + t[AX] * square + turning * pz - turn * turn * px
        bz = t[VZ] * rise + t[AZ] * square - turning * px - turn * turn * pz
        bx += 2.0 * turn * wz + rx + tx * roll + ex * own
        bz += rz - 2.0 * turn * wx + tz * roll + ez * own
        vx, vz = t[VX] * speed + turn * pz + wx, t[VZ] * speed - turn * px + wz
        out[k] = t[CARRIER_Z] - sine * px + cosine * pz + moved[0]
        out[k + 1] = cosine * vz - sine * vx + moved[1]
        out[k + 2] = cosine * bz - sine * bx + moved[2]
        k += 3
