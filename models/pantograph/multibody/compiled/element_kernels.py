"""Vectors and force elements of a mechanism for numba: what `elements` does, one after the other instead of as arrays.

Every row of a table is one element; `mechanism_tables` says what its numbers are. Loads have shape (n, 6), the force on
each body and the moment about its centre of mass [N, N.m]. This module imports nothing of the project: it is compiled
from a copy in the user's cache, joined with `mechanism_kernels`.
"""

from math import atan2, cos, sin, sqrt, tanh

import numpy as np
from numba import njit

#: For what other kernels alone call: nothing is made for Python then, nor kept besides.
_inside = njit(  # type: ignore[call-overload]
    error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True
)


@_inside
def turn(frame, x, y, z, out):
    """Write the product of the first three rows of a frame and a body-fixed vector."""
    for i in range(3):
        out[i] = frame[i, 0] * x + frame[i, 1] * y + frame[i, 2] * z


@_inside
def rotation(p, A):
    """Write the rotation matrix of Euler parameters; see `rotations.rotation_matrices`."""
    a, x, y, z = p[0], p[1], p[2], p[3]
    A[0, 0] = a * a + x * x - y * y - z * z
    A[1, 1] = a * a - x * x + y * y - z * z
    A[2, 2] = a * a - x * x - y * y + z * z
    A[0, 1], A[1, 0] = 2.0 * (x * y - a * z), 2.0 * (x * y + a * z)
    A[1, 2], A[2, 1] = 2.0 * (y * z - a * x), 2.0 * (y * z + a * x)
    A[2, 0], A[0, 2] = 2.0 * (z * x - a * y), 2.0 * (z * x + a * y)


@_inside
def spun(frame, w, out):
    """Write the product of a matrix and w~; w are three numbers."""
    for i in range(3):
        x, y, z = frame[i, 0], frame[i, 1], frame[i, 2]
        out[i, 0] = y * w[2] - z * w[1]
        out[i, 1] = z * w[0] - x * w[2]
        out[i, 2] = x * w[1] - y * w[0]


@_inside
def crossed(a, b, out):
    """Write a x b."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    out[0], out[1], out[2] = x, y, z


@_inside
def carry_bodies(base, y, u, n, known):
    """Put the bodies of prescribed motion in place in a state and write their accelerations; see `base_frame`.

    Parameters
    ----------
    base : ndarray, shape (d, 7)
        Where they are at rest: position, Euler parameters.
    known : ndarray, shape (d, 6)
        Result: linear and body-fixed angular accelerations.
    """
    sways = u[11] > 0.0
    yaw, roll = 0.5 * u[18], 0.5 * u[15]
    sine, cosine, mixed = sin(u[15]), cos(u[15]), u[19] * u[16]
    p, w, turning = np.empty(4), np.empty(3), np.empty(3)
    p[0], p[1], p[2], p[3] = cos(yaw) * cos(roll), cos(yaw) * sin(roll), sin(yaw) * sin(roll), sin(yaw) * cos(roll)
    w[0], w[1], w[2] = u[16], u[19] * sine, u[19] * cosine
    turning[0], turning[1], turning[2] = u[17], u[20] * sine + mixed * cosine, u[20] * cosine - mixed * sine
    R, own, around, twice = np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(3)
    rotation(p, R)
    for k in range(len(base)):
        r, q = base[k, :3], base[k, 3:]
        if not sways:
            for i in range(3):
                y[3 * k + i], y[7 * n + 3 * k + i], y[10 * n + 3 * k + i] = r[i], 0.0, 0.0
            for i in range(4):
                y[3 * n + 4 * k + i] = q[i]
            y[3 * k + 2] += u[0]
            y[7 * n + 3 * k + 2] = u[1]
            for i in range(6):
                known[k, i] = u[2] if i == 2 else 0.0
            continue
        crossed(w, r, around)
        crossed(w, around, twice)
        twice[0] += turning[1] * r[2] - turning[2] * r[1]
        twice[1] += turning[2] * r[0] - turning[0] * r[2]
        twice[2] += turning[0] * r[1] - turning[1] * r[0]
        rotation(q, own)
        for i in range(3):
            moved = 0.0 if i == 0 else u[11 + i] if i == 1 else u[0]
            place, speed, rate = moved, 0.0, 0.0
            if i == 1:
                speed, rate = u[13], u[14]
            elif i == 2:
                speed, rate = u[1], u[2]
            angular, change = 0.0, 0.0
            for j in range(3):
                place += R[i, j] * r[j]
                speed += R[i, j] * around[j]
                rate += R[i, j] * twice[j]
                angular += w[j] * own[j, i]
                change += turning[j] * own[j, i]
            y[3 * k + i], y[7 * n + 3 * k + i], y[10 * n + 3 * k + i] = place, speed, angular
            known[k, i], known[k, 3 + i] = rate, change
        at = 3 * n + 4 * k
        y[at] = p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3]
        y[at + 1] = p[0] * q[1] + q[0] * p[1] + p[2] * q[3] - p[3] * q[2]
        y[at + 2] = p[0] * q[2] + q[0] * p[2] + p[3] * q[1] - p[1] * q[3]
        y[at + 3] = p[0] * q[3] + q[0] * p[3] + p[1] * q[2] - p[2] * q[1]


@_inside
def frames_of(y, n, known, frames, origins):
    """Write frames (n, 9, 3) and origins (n, 9) of all bodies; see `moving_vectors.Kinematics`."""
    for k in range(n):
        w = y[10 * n + 3 * k : 10 * n + 3 * k + 3]
        rotation(y[3 * n + 4 * k : 3 * n + 4 * k + 4], frames[k, :3])
        spun(frames[k, :3], w, frames[k, 3:6])
        spun(frames[k, 3:6], w, frames[k, 6:])
        for i in range(3):
            origins[k, i], origins[k, 3 + i], origins[k, 6 + i] = y[3 * k + i], y[7 * n + 3 * k + i], 0.0
    extra = np.empty((3, 3))
    for k in range(len(known)):
        spun(frames[k, :3], known[k, 3:], extra)
        for i in range(3):
            origins[k, 6 + i] = known[k, i]
            for j in range(3):
                frames[k, 6 + i, j] += extra[i, j]


@_inside
def vectors_of(vectors, gaps, levers, frames, origins):
    """Return all entries of the pool with two derivatives, shape (entries, 9); see `moving_vectors.VectorPool`."""
    count, first_lever = len(vectors), len(vectors) + 3 + len(gaps)
    values = np.zeros((first_lever + len(levers), 9))
    for k in range(count):
        frame = frames[int(vectors[k, 0])]
        for i in range(9):
            values[k, i] = frame[i, 0] * vectors[k, 1] + frame[i, 1] * vectors[k, 2] + frame[i, 2] * vectors[k, 3]
    for i in range(3):
        values[count + i, i] = 1.0
    for k in range(len(gaps)):
        start, to = int(gaps[k, 0]), int(gaps[k, 1])
        i, j = int(vectors[start, 0]), int(vectors[to, 0])
        for c in range(9):
            values[count + 3 + k, c] = (values[to, c] + origins[j, c]) - (values[start, c] + origins[i, c])
    for k in range(len(levers)):
        gap, start = count + 3 + int(levers[k, 0]), int(levers[k, 1])
        for c in range(9):
            values[first_lever + k, c] = values[gap, c] + values[start, c]
    return values


@_inside
def dot(values, a, b):
    """Return the product of two vectors that begin at places in a flat array."""
    return values[a] * values[b] + values[a + 1] * values[b + 1] + values[a + 2] * values[b + 2]


@_inside
def add_lines(lines, values, crosses, lift, loads):
    """Add springs, dampers, actuators and bump stops; see `force_elements.LineElements`."""
    flat = values.reshape(values.size)
    for row in lines:
        x, d = 9 * int(row[0]), 9 * int(row[1])
        along, directed = dot(flat, x, d), row[6]
        divisor = 1.0 if directed > 0.0 else sqrt(abs(along)) + 1e-300
        length = along / divisor
        rate = (dot(flat, x, d + 3) + directed * dot(flat, x + 3, d)) / divisor
        tension = row[8] * (length - row[10]) + row[9] * rate - row[11] - row[7] * lift
        over, under = length - row[15], length - row[14]
        if over > 0.0:
            tension += max(row[12] * over + row[13] * rate, 0.0)
        elif under < 0.0:
            tension += min(row[12] * under + row[13] * rate, 0.0)
        pull(row, tension / divisor, values, crosses, loads)


@_inside
def pull(row, tension, values, crosses, loads):
    """Add a tension per length of x along a line; see `force_elements._Lines.spread`."""
    x, start, to, at_start, at_to = int(row[0]), int(row[2]), int(row[3]), int(row[4]), int(row[5])
    for c in range(3):
        loads[start, c] += tension * values[x, c]
        loads[to, c] -= tension * values[x, c]
        loads[start, 3 + c] += tension * crosses[at_start, c]
        loads[to, 3 + c] -= tension * crosses[at_to, c]


@_inside
def add_slides(slides, values, crosses, loads):
    """Add friction along lines."""
    flat = values.reshape(values.size)
    for row in slides:
        x, d = 9 * int(row[0]), 9 * int(row[1])
        rate = dot(flat, x, d + 3) + row[6] * dot(flat, x + 3, d)  # all of them along a direction
        pull(row, row[7] * tanh(rate / row[8]), values, crosses, loads)


@_inside
def add_moments(moments, values, lift, loads):
    """Add actuator moments: on body j, and the opposite on body i."""
    for row in moments:
        axis, i, j = int(row[0]), int(row[1]), int(row[2])
        value = lift if row[3] > 0.0 else row[4]
        for c in range(3):
            loads[j, 3 + c] += value * values[axis, c]
            loads[i, 3 + c] -= value * values[axis, c]


@_inside
def angle_of(row, frames):
    """Return the angle of body j about an axis of body i; see `angle_elements.BodyAngle`."""
    i, j = frames[int(row[0])], frames[int(row[1])]
    hand, seen = np.empty(3), np.empty(3)
    turn(j, row[11], row[12], row[13], hand)
    for c in range(3):
        seen[c] = hand[0] * i[0, c] + hand[1] * i[1, c] + hand[2] * i[2, c]
    along = seen[0] * row[5] + seen[1] * row[6] + seen[2] * row[7]
    aside = seen[0] * row[8] + seen[1] * row[9] + seen[2] * row[10]
    return atan2(aside, along)


@_inside
def relative_spin(i, j, frames, w, out):
    """Write the angular velocity of body j less that of body i."""
    other = np.empty(3)
    turn(frames[j], w[j, 0], w[j, 1], w[j, 2], out)
    turn(frames[i], w[i, 0], w[i, 1], w[i, 2], other)
    for c in range(3):
        out[c] -= other[c]


@_inside
def add_angle_stops(stops, frames, w, loads):
    """Add the stops of angles; see `angle_elements.AngleStops`."""
    axis, spin = np.empty(3), np.empty(3)
    for row in stops:
        angle = angle_of(row, frames)
        beyond = angle - row[15] if angle > row[15] else angle - row[14] if angle < row[14] else 0.0
        if beyond == 0.0:
            continue
        i, j = int(row[0]), int(row[1])
        turn(frames[i], row[2], row[3], row[4], axis)
        relative_spin(i, j, frames, w, spin)
        moment = row[16] * beyond + row[17] * (spin[0] * axis[0] + spin[1] * axis[1] + spin[2] * axis[2])
        moment = max(moment, 0.0) if beyond > 0.0 else min(moment, 0.0)
        for c in range(3):
            loads[j, 3 + c] -= moment * axis[c]
            loads[i, 3 + c] += moment * axis[c]


@_inside
def add_friction(frictions, frames, w, loads):
    """Add friction against turning in joints; see `force_elements._Friction`."""
    axis, spin = np.empty(3), np.empty(3)
    for row in frictions:
        i, j = int(row[0]), int(row[1])
        relative_spin(i, j, frames, w, spin)
        if row[4] > 0.0:
            turn(frames[i], row[5], row[6], row[7], axis)
            speed = spin[0] * axis[0] + spin[1] * axis[1] + spin[2] * axis[2]
            share = -row[2] * tanh(speed / row[3])
        else:
            axis[0], axis[1], axis[2] = spin[0], spin[1], spin[2]
            speed = max(sqrt(spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2]), 1e-12)
            share = -row[2] * tanh(speed / row[3]) / speed
        for c in range(3):
            loads[j, 3 + c] += share * axis[c]
            loads[i, 3 + c] -= share * axis[c]


@_inside
def add_bushings(bushings, frames, origins, w, loads):
    """Add elastic joints; see `force_elements._Bushing`."""
    end_i, end_j = np.empty(9), np.empty(9)
    w_i, spin, gap, drift, force, moment, side = (
        np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    )  # fmt: skip
    inner, twisted = np.empty((3, 3)), np.empty((3, 3))
    for row in bushings:
        i, j = int(row[0]), int(row[1])
        A, B = frames[i], frames[j]
        for c in range(9):
            end_i[c] = A[c, 0] * row[2] + A[c, 1] * row[3] + A[c, 2] * row[4] + origins[i, c]
            end_j[c] = B[c, 0] * row[5] + B[c, 1] * row[6] + B[c, 2] * row[7] + origins[j, c]
        turn(A, w[i, 0], w[i, 1], w[i, 2], w_i)
        relative_spin(i, j, frames, w, spin)
        for c in range(3):
            gap[c] = end_j[c] - end_i[c]
        crossed(w_i, gap, side)
        for c in range(3):
            drift[c] = end_j[3 + c] - end_i[3 + c] - side[c]
        for a in range(3):
            for b in range(3):
                inner[a, b] = A[0, a] * B[0, b] + A[1, a] * B[1, b] + A[2, a] * B[2, b]
        for a in range(3):
            for b in range(3):
                c = 8 + 3 * b
                twisted[a, b] = inner[a, 0] * row[c] + inner[a, 1] * row[c + 1] + inner[a, 2] * row[c + 2]
        x = 0.5 * (twisted[2, 1] - twisted[1, 2])
        y = 0.5 * (twisted[0, 2] - twisted[2, 0])
        z = 0.5 * (twisted[1, 0] - twisted[0, 1])
        sine = sqrt(x * x + y * y + z * z)
        angle = atan2(sine, 0.5 * (twisted[0, 0] + twisted[1, 1] + twisted[2, 2] - 1.0))
        share = angle / sine if sine > 1e-9 else 1.0
        twist = (share * x, share * y, share * z)
        for a in range(3):
            force[a], moment[a] = 0.0, 0.0
        for a in range(3):
            stretch = A[0, a] * gap[0] + A[1, a] * gap[1] + A[2, a] * gap[2]
            speed = A[0, a] * drift[0] + A[1, a] * drift[1] + A[2, a] * drift[2]
            rate = A[0, a] * spin[0] + A[1, a] * spin[1] + A[2, a] * spin[2]
            push = -(row[17 + a] * stretch + row[20 + a] * speed)
            about = -(row[23 + a] * twist[a] + row[26 + a] * rate)
            for c in range(3):
                force[c] += A[c, a] * push
                moment[c] += A[c, a] * about
        for c in range(3):
            loads[j, c] += force[c]
            loads[i, c] -= force[c]
            loads[j, 3 + c] += moment[c]
            loads[i, 3 + c] -= moment[c]
            end_j[c] -= origins[j, c]
            end_i[c] += gap[c] - origins[i, c]
        crossed(end_j, force, side)
        for c in range(3):
            loads[j, 3 + c] += side[c]
        crossed(end_i, force, side)
        for c in range(3):
            loads[i, 3 + c] -= side[c]


@_inside
def add_air(air, frames, against, loads):
    """Add forces of the air at a speed against it; see `air_forces`."""
    lever, side, force = np.empty(3), np.empty(3), np.empty(3)
    square = abs(against) * against
    for row in air:
        k = int(row[0])
        turn(frames[k], row[1], row[2], row[3], lever)
        for c in range(3):
            force[c] = row[4 + c] * square
        crossed(lever, force, side)
        for c in range(3):
            loads[k, c] += force[c]
            loads[k, 3 + c] += side[c]


@_inside
def curve_at(curve, x):
    """Return the value of a cubic curve, its end values held outside; see `cubic_curve.CubicCurve`."""
    last = len(curve) - 1
    if x >= curve[last, 0]:
        return curve[last, 4]
    if x <= curve[0, 0]:
        return curve[0, 4]
    low, high = 0, last
    while high - low > 1:
        middle = (low + high) // 2
        if curve[middle, 0] <= x:
            low = middle
        else:
            high = middle
    t = x - curve[low, 0]
    return curve[low, 4] + t * (curve[low, 3] + t * (curve[low, 2] + t * curve[low, 1]))


@_inside
def distance_of(row, frames, origins):
    """Return the length between the points of a lifting force; see `angle_elements.PointDistance`."""
    i, j = int(row[0]), int(row[1])
    start, to, direction = np.empty(3), np.empty(3), np.empty(3)
    turn(frames[i], row[2], row[3], row[4], start)
    turn(frames[j], row[5], row[6], row[7], to)
    turn(frames[i], row[8], row[9], row[10], direction)
    square, along = 0.0, 0.0
    for c in range(3):
        gap = to[c] + origins[j, c] - start[c] - origins[i, c]
        square += gap * gap
        along += gap * direction[c]
    return along if row[14] == 2.0 else sqrt(square)


@_inside
def lift_of(lifting, own, per_lift, per_force, u, frames, origins):
    """Return what the lifting element gives [N or N.m]; see `ForceElements.lift_value`."""
    lift, uplift = u[3], u[6]
    if u[9] > 0.0:
        return u[10]
    if len(lifting) == 0 or (len(per_lift) == 0 and uplift == 0.0):
        return lift
    if len(per_lift) == 0 and len(per_force) == 0:
        return lift + uplift
    row = lifting[0]
    place = angle_of(row, frames) if row[14] == 0.0 else distance_of(row, frames, origins)
    value = lift
    if len(per_lift) > 0:
        value = lift * curve_at(per_lift, place)
        if len(own) > 0:
            value += curve_at(own, place)
    return value + uplift * curve_at(per_force, place) if len(per_force) > 0 else value


@_inside
def touch(strip, y, n, frame, force, lateral, out):
    """Write the contact's force along z and moments about x and y on the strip's body; see `Mechanism.contact_load`."""
    k = int(strip[0])
    centre = np.empty(3)
    turn(frame, strip[1], strip[2], strip[3], centre)
    along = (lateral - y[3 * k + 1] - centre[1]) / frame[1, 1]
    out[0] = -force
    out[1] = -(centre[1] + along * frame[1, 1]) * force
    out[2] = (centre[0] + along * frame[0, 1]) * force
