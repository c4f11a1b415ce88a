"""Lumped pantographs between communication points, those of all lanes in one call, for numba.

The arithmetic is that of `models.pantograph.lumped`, `models.numerics.extrapolation` and `models.catenary.line_part`; a
lane is one run.

This module is compiled from a copy in the user's cache (`models.numerics.kernel_cache`), to which the file that it
imports is joined.
"""

from collections import namedtuple

from models.coupled.lane_forms_kernels import inner, outer

#: Of `models.numerics.extrapolation`.
_STAMP_TOLERANCE, _LEAST_TRAVEL, _SAME_TIME = 0.25, 1e-9, 1e-12
#: What ``setting`` holds of a pantograph: track position, speed and height at its start, static force, raising, ends of
#: the strip across the track, order of the extrapolation of the force.
(
    POSITION, SPEED, HEIGHT, STATIC_FORCE, RAISE_START, RAISE_DURATION, LEFT, RIGHT, ORDER, SETTINGS,
) = range(10)  # fmt: skip
#: What ``strip`` holds of its strip: x, z, vx, vz; and what ``received`` holds of what the line knows of it.
X, Z, VX, VZ, AZ, TIME, RECEIVED = range(7)
#: What ``forces`` holds: three times, three values, latest first, and how many are known.
KNOWN, FORCES = 6, 7
#: Pantographs of all lanes, arrays (lanes, P, ...): masses, loads of the air on them, inverse of K_hat and damping
#: matrix; number of masses and of inner steps; length of such a step; displacement, velocity, acceleration of the
#: masses; see above for the rest; and work space (2, masses).
Trains = namedtuple(
    "Trains",
    ("mass", "air", "inverse", "damping", "masses", "steps", "length", "motion", "setting", "strip", "received",
     "forces", "work"),
)  # fmt: skip


@inner
def lead_of(position, expected, speed, step):
    """Return how long after the beginning of the step a received position is valid."""
    travel = speed * step
    if abs(travel) < _LEAST_TRAVEL:
        return 0.0
    return step if abs((position - expected) / travel - 1.0) < _STAMP_TOLERANCE else 0.0


@inner
def place_strip(trains, lane, p, elapsed):
    """Put the strip where the pantograph is, so long after its start."""
    setting, strip, top = trains.setting[lane, p], trains.strip[lane, p], trains.masses[lane, p] - 1
    strip[X] = setting[POSITION] + setting[SPEED] * elapsed
    strip[Z] = setting[HEIGHT] + trains.motion[lane, p, 0, top]
    strip[VX] = setting[SPEED]
    strip[VZ] = trains.motion[lane, p, 1, top]


@inner
def raised(setting, time):
    """Return the share of the uplift that acts at a time after the start."""
    if time < setting[RAISE_START]:
        return 0.0
    if setting[RAISE_DURATION] == 0.0:
        return 1.0
    return min(1.0, (time - setting[RAISE_START]) / setting[RAISE_DURATION])


@outer
def start(trains, lane, time, contact):
    """Set the pantographs of a lane to rest at its start, under contact forces, shape (P,)."""
    for p in range(contact.size):
        received, forces, setting = trains.received[lane, p], trains.forces[lane, p], trains.setting[lane, p]
        trains.motion[lane, p, :, :] = 0.0
        trains.motion[lane, p, 2, 0] = setting[STATIC_FORCE] * raised(setting, 0.0)
        trains.motion[lane, p, 2, trains.masses[lane, p] - 1] -= contact[p]
        for i in range(trains.masses[lane, p]):
            load = trains.motion[lane, p, 2, i] + trains.air[lane, p, i]
            trains.motion[lane, p, 2, i] = load / trains.mass[lane, p, i]
        place_strip(trains, lane, p, 0.0)
        for i in range(VZ + 1):
            received[i] = trains.strip[lane, p, i]
        received[AZ], received[TIME] = 0.0, time
        forces[:] = 0.0
        forces[0], forces[3], forces[KNOWN] = time, contact[p], 1.0


@outer
def receive(trains, active, times, step, order):
    """Let the line receive the strips for a macro step that begins at ``times``, shape (lanes,)."""
    for lane in range(active.size):
        if not active[lane]:
            continue
        for p in range(trains.strip.shape[1]):
            strip, held, time = trains.strip[lane, p], trains.received[lane, p], times[lane]
            speed, before = strip[VX], held[VZ]
            expected = held[X] + speed * (time - held[TIME])
            valid = time + lead_of(strip[X], expected, speed, step)
            for i in range(VZ + 1):
                held[i] = strip[i]
            if order >= 2 and valid > held[TIME] + _SAME_TIME:
                held[AZ] = (strip[VZ] - before) / (valid - held[TIME])
            held[TIME] = valid


@outer
def continue_strips(trains, active, times, later, order, strips):
    """Put the strips as the line continues them to ``later`` after ``times`` into ``strips``: x, ends' y, z, vz."""
    for lane in range(active.size):
        if not active[lane]:
            continue
        for p in range(strips.shape[1]):
            held, tau = trains.received[lane, p], times[lane] + later - trains.received[lane, p, TIME]
            if order == 0:
                tau = 0.0
            strips[lane, p, 0] = held[X] + tau * held[VX]
            strips[lane, p, 1], strips[lane, p, 2] = trains.setting[lane, p, LEFT], trains.setting[lane, p, RIGHT]
            strips[lane, p, 3] = held[Z] + tau * held[VZ] + 0.5 * tau**2 * held[AZ]
            strips[lane, p, 4] = held[VZ] + tau * held[AZ]


@inner
def take_force(forces, time, force):
    """Take a force valid at ``time``; see `ForceExtrapolation.receive`."""
    if forces[KNOWN] and time <= forces[0] + _SAME_TIME:
        forces[3] = force
        return
    for k in (2, 1):
        forces[k], forces[3 + k] = forces[k - 1], forces[2 + k]
    forces[0], forces[3] = time, force
    forces[KNOWN] = min(forces[KNOWN] + 1.0, 3.0)


@inner
def force_at(forces, wanted, time):
    """Return the force at ``time``; see `ForceExtrapolation.at`."""
    if forces[3] == 0.0 and time > forces[0]:
        return 0.0
    order = min(wanted, forces[KNOWN] - 1.0)
    result = forces[3]
    if order >= 1.0:
        first = (forces[3] - forces[4]) / (forces[0] - forces[1])
        result += first * (time - forces[0])
        if order >= 2.0:
            second = (first - (forces[4] - forces[5]) / (forces[1] - forces[2])) / (forces[0] - forces[2])
            result += second * (time - forces[0]) * (time - forces[1])
    return max(0.0, result)


@outer
def step_trains(trains, active, times, began, step, contact):
    """Let all pantographs make a macro step under the forces that they receive for its beginning.

    Parameters
    ----------
    times : ndarray, shape (lanes,)
        When the step begins [s].
    began : float
        When the run began [s].
    step : float
        [s]
    contact : ndarray, shape (lanes, P, >= 2)
        Contact force [N], and where along the track it acts [m].
    """
    for lane in range(active.size):
        if not active[lane]:
            continue
        for p in range(contact.shape[1]):
            setting, forces, time = trains.setting[lane, p], trains.forces[lane, p], times[lane]
            expected = setting[POSITION] + setting[SPEED] * (time - began)
            lead = lead_of(contact[lane, p, 1], expected, setting[SPEED], step)
            take_force(forces, time + lead, contact[lane, p, 0])
            for k in range(1, trains.steps[lane, p] + 1):
                now = time + k * trains.length[lane, p]
                uplift = setting[STATIC_FORCE] * raised(setting, now - began)
                step_masses(trains, lane, p, uplift, force_at(forces, setting[ORDER], now))
            place_strip(trains, lane, p, time + step - began)


@inner
def step_masses(trains, lane, p, uplift, contact):
    """Let the masses of a pantograph make one inner step by the trapezoidal rule; see `LumpedModel`."""
    n, h, mass, damping = trains.masses[lane, p], trains.length[lane, p], trains.mass[lane, p], trains.damping[lane, p]
    motion, inverse = trains.motion[lane, p], trains.inverse[lane, p]
    a0, a1, a2 = 4.0 / h**2, 2.0 / h, 4.0 / h
    load, new = trains.work[0], trains.work[1]
    for i in range(n):
        load[i] = new[i] = 0.0
    load[0] += uplift
    load[n - 1] -= contact
    for i in range(n):
        load[i] += trains.air[lane, p, i] + mass[i] * (a0 * motion[0, i] + a2 * motion[1, i] + motion[2, i])
        for j in range(n):
            load[i] += damping[i, j] * (a1 * motion[0, j] + motion[1, j])
    for i in range(n):
        for j in range(n):
            new[i] += inverse[i, j] * load[j]
    for i in range(n):
        change = new[i] - motion[0, i]
        velocity = a1 * change - motion[1, i]
        motion[2, i] = a0 * change - a2 * motion[1, i] - motion[2, i]
        motion[0, i], motion[1, i] = new[i], velocity
