"""Motions with a known solution: pendulum, top, four-bar, slides; forces against hand calculation."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from models.pantograph.multibody.elements.rotations import rotation_matrices
from models.pantograph.multibody.mechanism import Inputs, Mechanism
from models.pantograph.multibody.mechanism_assembly import assemble
from models.pantograph.multibody.mechanism_integrator import Integrator
from tests.models.pantograph.multibody.mechanisms import body, joint, mechanism, mechanism_from, pendulum_data, q


def run(m, y, duration, *, inputs=lambda t: Inputs(), tolerance=1e-10, step=1e-3, largest=1e-3, watch=None):
    """Advance in macro steps; return the final state."""
    integrator, h, first, history = Integrator(m, tolerance, largest), largest, None, None
    for n in range(round(duration / step)):
        done = integrator.advance(y, lambda tau, _, t=n * step: inputs(t + tau), step, h, (), first, history)
        y, h, first, history = done.y, done.step, done.evaluation.rates, done.history
        if watch is not None:
            watch((n + 1) * step, done)
    return y


def test_pendulum_swings_as_its_equation_says():
    m = Mechanism(mechanism_from(pendulum_data((0.0, 0.1, 0.0))))
    y = assemble(m)
    inertia = 0.2 + 2.0 * 0.25  # about the hinge
    start = 2.0 * np.arcsin(0.1)
    exact = solve_ivp(
        lambda t, u: [u[1], 2.0 * 9.81 * 0.5 * np.cos(u[0]) / inertia], (0.0, 1.2), [start, 0.0],
        method="DOP853", rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    y = run(m, y, 1.2)
    s = m.split(y)
    assert 2.0 * np.arctan2(s.p[1, 2], s.p[1, 0]) == pytest.approx(exact.y[0, -1], abs=1e-7)
    assert s.w[1, 1] == pytest.approx(exact.y[1, -1], abs=1e-6)


def test_integration_is_of_fourth_order():
    m = Mechanism(mechanism_from(pendulum_data((0.0, 0.1, 0.0))))
    y = assemble(m)
    ends = [run(m, y, 0.8, tolerance=1.0, step=h, largest=h)[3:6] for h in (0.01, 0.005, 0.001)]
    errors = [np.linalg.norm(e - ends[-1]) for e in ends[:-1]]
    assert np.log2(errors[0] / errors[1]) > 3.5


def top(spin, precession, tilt):
    """A symmetric top on a ball joint, in steady precession if the rates fit."""
    centre = (0.3 * np.sin(tilt), 0.0, 0.3 * np.cos(tilt))
    m = mechanism(
        {"top": body(1.5, (0.02, 0.02, 0.005), centre, (0, np.sin(tilt / 2), 0))},
        {"tip": joint("spherical", "base", "top", point_i=(0, 0, 0), point_j=(0, 0, -0.3))},
    )
    y = assemble(m)
    s = m.split(y)
    A = rotation_matrices(s.p)[1]
    s.w[1] = A.T @ np.array([0.0, 0.0, precession]) + np.array([0.0, 0.0, spin])
    s.v[1] = np.cross(A @ s.w[1], s.r[1])
    return m, y


def test_top_in_steady_precession_keeps_its_tilt_and_rate():
    tilt, precession = 0.4, 3.0
    about_tip, polar, weight = 0.02 + 1.5 * 0.3**2, 0.005, 1.5 * 9.81 * 0.3
    # weight h = polar spin' precession - (about_tip - polar) precession^2 cos(tilt), spin' the body's own z rate
    spin_total = (weight + about_tip * precession**2 * np.cos(tilt)) / (polar * precession)
    m, y = top(spin_total - precession * np.cos(tilt), precession, tilt)
    y = run(m, y, 0.3, tolerance=1e-8)
    r = m.split(y).r[1]
    assert np.arccos(r[2] / 0.3) == pytest.approx(tilt, abs=1e-5)
    assert np.arctan2(r[1], r[0]) == pytest.approx(0.3 * precession, abs=1e-5)


def test_nutating_top_keeps_energy_and_momentum():
    m, y = top(120.0, 0.0, 0.5)

    def invariants(y):
        s = m.split(y)
        A = rotation_matrices(s.p)[1]
        momentum = 1.5 * np.cross(s.r[1], s.v[1]) + A @ (m.inertia[1] * s.w[1])
        return np.array([m.energy(y), momentum[2], momentum @ A[:, 2]])

    before = invariants(y)
    after = invariants(run(m, y, 0.25, tolerance=1e-9))
    np.testing.assert_allclose(after, before, rtol=1e-7)


CRANK, COUPLER, ROCKER, GROUND = 0.3, 0.9, 0.6, 0.8


def rocker_angle(crank):
    """Freudenstein: angle of the rocker of a four-bar, open branch, counter-clockwise in the x-z plane."""
    dx, dz = GROUND - CRANK * np.cos(crank), -CRANK * np.sin(crank)
    distance = np.hypot(dx, dz)
    at_rocker = np.arccos((distance**2 + ROCKER**2 - COUPLER**2) / (2 * distance * ROCKER))
    return np.arctan2(-dz, -dx) - at_rocker


def four_bar(third="spherical", coupler=COUPLER, lock=True, largest_gap=1e-6):
    crank, rocker = 1.0, rocker_angle(1.0)
    a = np.array([CRANK * np.cos(crank), 0.0, CRANK * np.sin(crank)])
    b = np.array([GROUND + ROCKER * np.cos(rocker), 0.0, ROCKER * np.sin(rocker)])
    tilt = np.arctan2((b - a)[2], (b - a)[0])
    turn = lambda angle: (0.0, -np.sin(angle / 2), 0.0)  # noqa: E731
    bodies = {
        "crank": body(1.0, (0.001, 0.01, 0.01), a / 2, turn(crank)),
        "coupler": body(2.0, (0.001, 0.15, 0.15), (a + b) / 2, turn(tilt)),
        "rocker": body(1.5, (0.001, 0.05, 0.05), (b + np.array([GROUND, 0, 0])) / 2, turn(rocker)),
    }
    y = {"axis_i": (0, 1, 0), "axis_j": (0, 1, 0)}
    ends = {"point_i": (coupler / 2, 0, 0), "point_j": (ROCKER / 2, 0, 0)}
    joints = {
        "first": joint("revolute", "base", "crank", point_i=(0, 0, 0), point_j=(-CRANK / 2, 0, 0), **y),
        "last": joint("revolute", "base", "rocker", point_i=(GROUND, 0, 0), point_j=(-ROCKER / 2, 0, 0), **y),
        "second": joint("spherical", "crank", "coupler", point_i=(CRANK / 2, 0, 0), point_j=(-coupler / 2, 0, 0)),
        "third": joint(third, "coupler", "rocker", **ends, **(y if third == "revolute" else {})),
    }
    if lock:
        joints["lock"] = joint("perpendicular", "crank", "coupler", axis_i=(0, 1, 0), axis_j=(0, 0, 1))
    return mechanism(bodies, joints, assembly={"largest_gap": q(largest_gap, "m")})


def angle_of(m, y, name):
    p = m.split(y).p[m.numbers[name]]
    return -2.0 * np.arctan2(p[2], p[0])


def test_four_bar_follows_its_closed_form_while_it_swings():
    m = four_bar()
    y = assemble(m)
    energy = m.energy(y)
    seen = []
    y = run(m, y, 0.6, watch=lambda t, done: seen.append(angle_of(m, done.y, "crank")))
    wrapped = lambda a: (a + np.pi) % (2 * np.pi) - np.pi  # noqa: E731
    assert wrapped(angle_of(m, y, "rocker") - rocker_angle(angle_of(m, y, "crank"))) == pytest.approx(0.0, abs=1e-8)
    assert np.ptp(seen) > 0.5
    assert m.energy(y) == pytest.approx(energy, abs=1e-7)


def test_slide_with_spring_damper_along_its_axis_is_an_oscillator():
    spring = {
        "kind": "spring_damper", "body_i": "base", "body_j": "box",
        "point_i": q([0, 0, 0], "m"), "point_j": q([0, 0, 0], "m"), "direction": q([0, 0, 1], "1"),
        "stiffness": q(800.0, "N/m"), "damping": q(4.0, "N.s/m"), "free_length": q(1.0, "m"),
    }  # fmt: skip
    slide = joint("prismatic", "base", "box", point_i=(0, 0, 0), point_j=(0, 0, 0), axis_i=(0, 0, 1))
    m = mechanism({"box": body(2.0, (1, 1, 1), (0, 0, 1.1))}, {"slide": slide}, {"spring": spring})
    y = run(m, assemble(m), 1.0)
    omega0, decay = 20.0, 1.0
    omega = np.sqrt(omega0**2 - decay**2)
    rest = 1.0 - 2.0 * 9.81 / 800.0
    exact = rest + (1.1 - rest) * np.exp(-1.0) * (np.cos(omega) + decay / omega * np.sin(omega))
    assert m.split(y).r[1, 2] == pytest.approx(exact, abs=1e-8)


def line_force(kind="spring_damper", **values):
    table = {
        "kind": kind, "body_i": "base", "body_j": "box",
        "point_i": q([0.1, 0.2, 0.0], "m"), "point_j": q([0.0, 0.0, 0.3], "m"),
    }  # fmt: skip
    return table | {k: q(v, u) for k, (v, u) in values.items()}


def loads_on_box(force, position=(0.5, 0.4, 1.0), velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0)):
    m = mechanism({"box": body(2.0, (1, 2, 3), position, (0.1, 0.2, 0.3))}, {}, {"it": force}, gravity=q(0.0, "m/s2"))
    y = m.written_state()
    s = m.split(y)
    s.v[1], s.w[1] = velocity, spin
    return m, s, m.loads(y, m.kinematics(y), Inputs())


def test_spring_damper_between_points_pulls_along_its_line_and_balances():
    force = line_force(stiffness=(500.0, "N/m"), damping=(20.0, "N.s/m"), free_length=(0.7, "m"))
    _, s, loads = loads_on_box(force, velocity=(1.0, -2.0, 0.5), spin=(0.3, 0.1, -0.2))
    A = rotation_matrices(s.p)[1]
    lever = A @ np.array([0, 0, 0.3])
    d = s.r[1] + lever - np.array([0.1, 0.2, 0.0])
    length = np.linalg.norm(d)
    speed = (s.v[1] + np.cross(A @ s.w[1], lever)) @ d / length
    pull = -(500.0 * (length - 0.7) + 20.0 * speed) * d / length
    np.testing.assert_allclose(loads[1], np.concatenate([pull, np.cross(lever, pull)]))
    np.testing.assert_allclose(loads[0, :3], -pull)
    np.testing.assert_allclose(loads[0, 3:] + loads[1, 3:] + np.cross(s.r[1], pull), 0.0, atol=1e-12)


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (1.0, 2.0, -0.5)])
def test_forces_along_a_direction_do_the_work_they_should(direction):
    """Power of the loads on a rigid motion of both bodies equals tension times rate of length."""
    force = line_force(stiffness=(500.0, "N/m"), free_length=(0.7, "m"), direction=(list(direction), "1"))
    m, s, loads = loads_on_box(force, velocity=(1.0, -2.0, 0.5), spin=(0.3, 0.1, -0.2))
    A = rotation_matrices(s.p)[1]
    power = loads[1, :3] @ s.v[1] + loads[1, 3:] @ (A @ s.w[1])
    h = 1e-6
    y = m.join(s.r, s.p, s.v, s.w)
    energy = [m.forces.energy(m.pool.evaluate(m.kinematics(m.shifted(y, t * s.v, t * s.w)))) for t in (-h, h)]
    assert power == pytest.approx(-(energy[1] - energy[0]) / (2 * h), rel=1e-7)
    np.testing.assert_allclose(loads[:, 3:].sum(axis=0) + np.cross(s.r[1], loads[1, :3]), 0.0, atol=1e-10)


def test_bump_stop_pushes_only_beyond_its_length():
    stop = {"stiffness": (1e4, "N/m"), "shortest": (0.5, "m"), "longest": (2.0, "m")}
    assert not loads_on_box(line_force("bump_stop", **stop), (0.1, 0.2, 1.0))[2].any()
    near = loads_on_box(line_force("bump_stop", **stop), (0.1, 0.2, 0.0))[2]
    far = loads_on_box(line_force("bump_stop", **stop), (0.1, 0.2, 4.0))[2]
    assert near[1, 2] > 0.0
    assert far[1, 2] < 0.0


@pytest.mark.parametrize(("height", "stored"), [(0.0, 0.5 * 1e4 * 0.2**2), (1.0, 0.0), (4.0, 0.5 * 1e4 * 2.3**2)])
def test_bump_stop_stores_the_work_that_is_done_on_it(height, stored):
    """Too short by 0.2 m, between its lengths, too long by 2.3 m; its power is what the stored energy changes by."""
    stop = {"stiffness": (1e4, "N/m"), "shortest": (0.5, "m"), "longest": (2.0, "m")}
    m, s, _ = loads_on_box(line_force("bump_stop", **stop), (0.1, 0.2, height), velocity=(0.0, 0.0, 0.7))
    y = m.join(s.r, np.array([[1.0, 0.0, 0.0, 0.0]] * 2), s.v, s.w)  # upright: the far point is 0.3 m above
    moved = [m.kinematics(m.shifted(y, t * s.v, t * s.w)) for t in (-1e-6, 0.0, 1e-6)]
    energy = [m.forces.energy(m.pool.evaluate(kinematics)) for kinematics in moved]
    assert energy[1] == pytest.approx(stored)
    upright = m.loads(y, m.kinematics(y), Inputs())
    assert upright[1, 2] * 0.7 == pytest.approx(-(energy[2] - energy[0]) / 2e-6, rel=1e-6)


def test_joint_friction_stops_a_pendulum():
    data = pendulum_data((0.0, 0.4, 0.0))
    data["force"]["rub"] = {
        "kind": "joint_friction", "joint": "hinge", "moment": q(1.5, "N.m"), "transition": q(0.01, "rad/s")
    }  # fmt: skip
    m = Mechanism(mechanism_from(data))
    energies = []
    y = run(m, assemble(m), 2.0, watch=lambda t, done: energies.append(m.energy(done.y)), tolerance=1e-8)
    assert (np.diff(energies) <= 1e-9).all()
    assert abs(m.split(y).w[1, 1]) < 0.01


def test_bushing_carries_a_body_like_springs():
    bushing = {
        "kind": "bushing", "body_i": "base", "body_j": "box",
        "point_i": q([0, 0, 1], "m"), "point_j": q([0, 0, 0], "m"),
        "translation_stiffness": q([1e3, 1e3, 2e3], "N/m"), "rotation_stiffness": q([50, 60, 70], "N.m/rad"),
        "translation_damping": q([20, 20, 40], "N.s/m"), "rotation_damping": q([4, 4, 4], "N.m.s/rad"),
    }  # fmt: skip
    m = mechanism({"box": body(2.0, (1, 1, 1), (0, 0, 1))}, {}, {"bushing": bushing})
    y = m.shifted(m.written_state(), np.zeros((2, 3)), np.array([[0, 0, 0], [0.05, 0.1, 0.02]]))
    s = m.split(run(m, y, 8.0, largest=5e-3, step=5e-3, tolerance=1e-7))
    np.testing.assert_allclose(s.r[1], [0, 0, 1 - 2 * 9.81 / 2e3], atol=1e-7)
    np.testing.assert_allclose(s.p[1, 1:], 0.0, atol=1e-5)
