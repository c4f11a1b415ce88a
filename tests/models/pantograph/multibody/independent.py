"""The generic pantograph once more, in three independent coordinates: lower-arm pitch, head slide, head roll.

Written for the tests alone, from the tables and not from the library's code: loops closed in closed form,
derivatives by complex steps, Newton-Euler projected on the coordinates. Pitch is counted about +y (nose down).
"""

from __future__ import annotations

import numpy as np

G = 9.81
#: mass, I_y of the bodies that stay in the plane: lower arm, upper arm, lower link, upper link, stabilisation arm.
PLANAR = ((32.18, 10.43), (15.60, 7.76), (3.10, 0.46), (4.51, 1.50), (4.67, 0.01))
HEAD_MASS, HEAD_INERTIA = 7.80, np.array([6.62, 0.23, 6.87])
SUSPENSION = (3000.0, 0.103, 13.0)
RAISING = (2.0, 0.459, 60.0)


def turn(angle, x, z):
    """Rotate (x, z) by a pitch."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * x + s * z, -s * x + c * z])


def closed(base, far, arm, distance, branch):
    """Return the pitch with which ``arm``, fixed at ``base``, keeps its end at ``distance`` from ``far``."""
    d = far - base
    r2 = arm[0] ** 2 + arm[1] ** 2
    a = d[0] * arm[0] + d[1] * arm[1]
    b = d[0] * arm[1] - d[1] * arm[0]
    c = 0.5 * (d[0] ** 2 + d[1] ** 2 + r2 - distance**2)
    return arctan2(b, a) + branch * np.arccos(c / np.sqrt(a * a + b * b))


def arctan2(b, a):
    """Return the analytic continuation of arctan2 that complex steps need."""
    if np.iscomplexobj(a) or np.iscomplexobj(b):
        a, b = complex(a), complex(b)
        angle = np.arctan2(b.real, a.real)
        return angle + 1j * (a.real * b.imag - b.real * a.imag) / (a.real**2 + b.real**2)
    return np.arctan2(b, a)


def plane(theta):
    """Return centres (5, 2) and pitches (5,) of the planar bodies, the joint that carries the head's support last."""
    hinge = np.array([0.200, 0.132])
    lower = hinge - turn(theta, 0.820, 0.0)
    knee = lower + turn(theta, -0.820, 0.0)
    foot = np.array([-0.259, 0.0])
    tail = np.array([-1.187 + 1.014, -0.126])
    link = np.array([-0.615 - 0.688, -0.025])
    upper_pitch = closed(knee, foot, tail, np.hypot(*link), +1)
    upper = knee + turn(upper_pitch, 1.014, 0.0)
    tail_point = knee + turn(upper_pitch, *tail)
    along = tail_point - foot
    link_pitch = arctan2(along[0] * link[1] - along[1] * link[0], along[0] * link[0] + along[1] * link[1])
    lower_link = foot - turn(link_pitch, 0.688, 0.0)
    start = lower + turn(theta, -0.780, 0.0)
    top = upper + turn(upper_pitch, 1.014, 0.0)
    arm_pitch = closed(top, start, np.array([0.0, -0.105]), 1.962, -1)
    reach = top + turn(arm_pitch, 0.0, -0.105) - start
    upper_link_pitch = arctan2(-reach[1], reach[0])
    upper_link = start + turn(upper_link_pitch, 1.000, 0.0)
    centres = np.array([lower, upper, lower_link, upper_link, top])
    return centres, np.array([theta, upper_pitch, link_pitch, upper_link_pitch, arm_pitch])


def head(q):
    """Return centre (3,) and rotation matrix of the head."""
    theta, slide, roll = q
    centres, pitches = plane(theta)
    c, s = np.cos(pitches[4]), np.sin(pitches[4])
    pitch = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    c, s = np.cos(roll), np.sin(roll)
    A = pitch @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    pivot = np.array([centres[4][0], 0.0, centres[4][1]]) + pitch @ np.array([0, 0, 0.010])
    return pivot + slide * A[:, 2], A, centres[4], pitch


def springs(q):
    """Return the lengths of raising spring, left and right suspension."""
    theta = q[0]
    centre, A, top, pitch = head(q)
    lower = plane(theta)[0][0]
    end = lower + turn(theta, 0.870, -0.136)
    lengths = [np.sqrt((end[0] + 0.259) ** 2 + end[1] ** 2)]
    for y in (0.335, -0.335):
        d = centre + A @ np.array([0, y, 0.010]) - np.array([top[0], 0, top[1]]) - pitch @ np.array([0, y, 0])
        lengths.append(np.sqrt((d * d).sum()))
    return np.array(lengths)


def derivative(function, q):
    """Return d function / d q, last axis q, by complex steps."""
    columns = []
    for k in range(3):
        step = np.zeros(3, dtype=complex)
        step[k] = 1e-30j
        columns.append(np.imag(function(q + step)) / 1e-30)
    return np.stack(columns, axis=-1)


def points(q):
    """Return all centres and pitches in a row: 5 x (x, z), 5 pitches, head x y z."""
    centres, pitches = plane(q[0])
    return np.concatenate([centres.ravel(), pitches, head(q)[0]])


def spin_matrix(q):
    """Return the head's body-fixed angular velocity per coordinate rate, shape (3, 3)."""
    A = np.real(head(q)[1])
    dA = derivative(lambda x: head(x)[1], q)
    return np.stack([np.array([(A.T @ dA[:, :, k])[m, n] for m, n in ((2, 1), (0, 2), (1, 0))]) for k in range(3)], 1)


MASSES = np.concatenate([np.repeat([m for m, _ in PLANAR], 2), [i for _, i in PLANAR], [HEAD_MASS] * 3])
VERTICAL = np.array([0, 1] * 5 + [0] * 5 + [0, 0, 1])


def accelerations(q, v, moment, force=0.0, lateral=0.0, base_acceleration=0.0):
    """Return q'' for a lifting moment, a contact force at a lateral position and a moving base."""
    J, spin = derivative(points, q), spin_matrix(q)
    h = 1e-4 / max(1.0, np.abs(v).max())
    ahead = (derivative(points, q + h * v), spin_matrix(q + h * v))
    behind = (derivative(points, q - h * v), spin_matrix(q - h * v))
    drift = (ahead[0] - behind[0]) @ v / (2 * h)
    spin_drift = (ahead[1] - behind[1]) @ v / (2 * h)
    M = J.T @ (MASSES[:, None] * J) + spin.T @ (HEAD_INERTIA[:, None] * spin)
    weights = -MASSES * VERTICAL * (G + base_acceleration)
    w = spin @ v
    load = J.T @ (weights - MASSES * drift)
    load -= spin.T @ (HEAD_INERTIA * spin_drift + np.cross(w, HEAD_INERTIA * w))
    load[0] += moment
    lengths, rates = springs(q), derivative(springs, q)
    for number, (k, free, c) in enumerate((RAISING, SUSPENSION, SUSPENSION)):
        load -= rates[number] * (k * (lengths[number] - free) + c * (rates[number] @ v))
    centre, A, _, _ = head(q)
    across = (lateral - centre[1]) / A[1, 1]
    touched = derivative(lambda x: (head(x)[0] + across * head(x)[1][:, 1])[2], q)
    return np.linalg.solve(M, load - force * touched)


def coordinates(mechanism, y):
    """Return the three coordinates of a Cartesian state."""
    s = mechanism.split(y)
    pitch = 2.0 * np.arctan2(s.p[1, 2], s.p[1, 0])
    arm, bow = s.r[mechanism.numbers["stabilisation_arm"]], s.r[mechanism.numbers["pan_head"]]
    frames = mechanism.kinematics(y).frames
    A6, A7 = frames[mechanism.numbers["stabilisation_arm"], :3], frames[mechanism.numbers["pan_head"], :3]
    roll = np.arctan2((A6.T @ A7)[2, 1], (A6.T @ A7)[1, 1])
    return np.array([pitch, (bow - arm - 0.010 * A6[:, 2]) @ A7[:, 2], roll])
