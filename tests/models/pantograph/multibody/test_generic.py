"""The source's generic pantograph: statics, freedom, energy, drift, and the same mechanism written independently."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from models.pantograph.multibody.analysis.linearisation import (
    apparent_mass,
    base_transmission,
    linearise,
    modes,
    receptance,
)
from models.pantograph.multibody.analysis.mechanism_statics import contact_force_at, equilibrium, lift_over_height
from models.pantograph.multibody.mechanism import Inputs, Mechanism
from models.pantograph.multibody.mechanism_assembly import assemble, constraint_rank, null_space
from models.pantograph.multibody.mechanism_integrator import Integrator
from tests.effort import count
from tests.models.pantograph.multibody import independent
from tests.models.pantograph.multibody.mechanisms import library, library_data, mechanism_from
from tests.models.pantograph.multibody.test_mechanisms import line_force, run


def test_weights_alone_need_the_known_moment(generic):
    mechanism, y = generic
    assert equilibrium(mechanism, start=y).lift == pytest.approx(936.1, abs=0.05)


def test_assembled_positions_are_the_printed_ones_within_the_tables_rounding(generic):
    mechanism, _ = generic
    y = assemble(mechanism)
    printed = np.array([mechanism.definition.bodies[k].position for k in range(mechanism.count)])
    assert np.abs(mechanism.split(y).r - printed).max() < 0.012


def test_thirty_one_independent_constraints_and_five_degrees_of_freedom():
    """As printed: raise, heave, roll and the two links' spins; the two locks take the spins."""
    data = library_data("generic_multibody")
    del data["joint"]["lock_4"], data["joint"]["lock_6"]
    free = Mechanism(mechanism_from(data))
    y = assemble(free)
    assert constraint_rank(free, y) == free.constraints.count == 31
    assert null_space(free, y).shape[1] == 6 * 7 - 6 - 31 == 5
    locked = Mechanism(library("generic_multibody"))
    assert null_space(locked, assemble(locked)).shape[1] == 3


def test_lower_links_spin_is_unstable_as_printed_and_locking_changes_nothing_else(generic):
    data = library_data("generic_multibody")
    del data["joint"]["lock_4"], data["joint"]["lock_6"]
    free = Mechanism(mechanism_from(data))
    e = equilibrium(free, contact_force=100.0)
    found = modes(free, linearise(free, e.y, e.inputs))
    growing = [m for m in found if m.eigenvalue.real > 0.1]
    assert len(growing) == 1
    assert abs(growing[0].shape[free.numbers["lower_link"], 3]) > 0.9
    mechanism, y = generic
    e = equilibrium(mechanism, contact_force=100.0, start=y)
    for mode in modes(mechanism, linearise(mechanism, e.y, e.inputs)):
        assert min(abs(mode.eigenvalue - other.eigenvalue) for other in found) < 1e-5


def test_lifting_moment_follows_from_virtual_work(generic):
    """More contact force needs more moment by d z_head / d theta, about 2.34 m/rad."""
    mechanism, y = generic
    idle, loaded = (equilibrium(mechanism, 1.5, contact_force=f, start=y) for f in (0.0, 100.0))
    assert (loaded.lift - idle.lift) / 100.0 == pytest.approx(2.38, abs=0.05)
    back = contact_force_at(mechanism, 1.5, loaded.lift, start=idle.y)
    assert back.inputs.force == pytest.approx(100.0, abs=1e-6)


def test_moment_over_the_working_range_is_the_slope_of_the_energy(generic):
    """Without contact force, M d theta = d V: the work of the lift is what weights and springs store."""
    mechanism, _ = generic
    heights = np.linspace(1.40, 1.60, 21)
    found = lift_over_height(mechanism, heights)
    energy = [mechanism.energy(e.y) for e in found]
    pitch = [independent.coordinates(mechanism, e.y)[0] for e in found]
    work = np.trapezoid([e.lift for e in found], pitch)
    assert work == pytest.approx(energy[-1] - energy[0], rel=1e-4)


def test_off_centre_force_rolls_the_head_towards_it(generic):
    """The side that is pressed goes down, by about F y / (2 k b^2) rad."""
    mechanism, y = generic
    left = equilibrium(mechanism, contact_force=150.0, lateral=0.2, start=y)
    ends = mechanism.strip_ends(left.y)[:, 0]
    roll = np.arctan2(ends[0, 2] - ends[1, 2], ends[0, 1] - ends[1, 1])
    assert roll == pytest.approx(-150.0 * 0.2 / (2 * 3000 * 0.335**2), rel=0.1)
    right = equilibrium(mechanism, contact_force=150.0, lateral=-0.2, start=y)
    np.testing.assert_allclose(mechanism.strip_ends(right.y)[::-1, 0, 2], ends[:, 2], atol=1e-9)


def forcing(t):
    """Pulses, an off-centre force that wanders, a moving base."""
    z = 0.01 * np.sin(5.0 * t)
    base = (z, 0.05 * np.cos(5.0 * t), -25.0 * z)
    return Inputs(base, 1313.7, 157.5 + 60.0 * np.sin(9.0 * t), 0.2 * np.sin(2.0 * t) + 0.05)


DURATION = count(0.4, 2)


@pytest.fixture(scope="module")
def both_formulations(generic):
    mechanism, y = generic
    duration = DURATION
    q0 = independent.coordinates(mechanism, y)

    def slope(t, u):
        given = forcing(t)
        a = independent.accelerations(u[:3], u[3:], given.lift, given.force, given.lateral, given.base[2])
        return np.concatenate([u[3:], a])

    other = solve_ivp(slope, (0.0, duration), np.append(q0, np.zeros(3)), method="DOP853", rtol=1e-10, atol=1e-12)
    y = y.copy()
    mechanism.split(y).v[:, 2] = 0.05  # the base moves at once, and all on it
    return run(mechanism, y, duration, inputs=forcing, tolerance=1e-8), other.y[:3, -1]


def test_cartesian_form_agrees_with_independent_coordinates(generic, both_formulations):
    mechanism, _ = generic
    y, q = both_formulations
    mine = independent.coordinates(mechanism, y)
    np.testing.assert_allclose(mine, q, atol=2e-7)
    centre, *_ = independent.head(q)
    head = mechanism.numbers["pan_head"]
    moved = mechanism.split(y).r[head] - [0.0, 0.0, forcing(DURATION).base[0]]
    np.testing.assert_allclose(moved, centre, atol=1e-6)
    assert abs(q[2]) > 0.005


def test_linear_model_is_the_derivative_of_the_independent_equations(generic):
    mechanism, y = generic
    e = equilibrium(mechanism, 1.5, contact_force=120.0, start=y)
    model = linearise(mechanism, e.y, e.inputs)
    q = independent.coordinates(mechanism, e.y)
    rest = np.zeros(3)

    def accelerate(q, v):
        return independent.accelerations(q, v, e.lift, 120.0, 0.0)

    np.testing.assert_allclose(accelerate(q, rest), 0.0, atol=1e-8)
    h = 1e-4
    eye = h * np.eye(3)
    by_q = np.stack([(accelerate(q + d, rest) - accelerate(q - d, rest)) / (2 * h) for d in eye], axis=1)
    by_v = np.stack([(accelerate(q, d) - accelerate(q, -d)) / (2 * h) for d in eye], axis=1)
    exact = np.linalg.eigvals(np.block([[np.zeros((3, 3)), np.eye(3)], [by_q, by_v]]))
    for mode in modes(mechanism, model):
        assert np.abs(exact - mode.eigenvalue).min() < 2e-5
    np.testing.assert_allclose(model.K, model.K.T, atol=1e-5)


def test_receptance_at_low_and_high_frequency(generic):
    """Towards 0 Hz the inverse static stiffness, high up the head alone."""
    mechanism, y = generic
    e = equilibrium(mechanism, 1.5, contact_force=100.0, start=y)
    model = linearise(mechanism, e.y, e.inputs)
    pressed = contact_force_at(mechanism, 1.5001, e.lift, start=e.y)
    slope = (pressed.inputs.force - 100.0) / 1e-4
    assert receptance(model, np.array([1e-4]))[0].real == pytest.approx(-1.0 / slope, rel=1e-3)
    assert apparent_mass(model, np.array([500.0]))[0].real == pytest.approx(7.8, rel=0.01)


def test_forced_response_has_the_receptance_and_the_base_transmission(generic):
    """Small harmonic contact force and base motion in the full equations against the linear model, at 3 Hz."""
    mechanism, y = generic
    e = equilibrium(mechanism, 1.5, contact_force=100.0, start=y)
    model = linearise(mechanism, e.y, e.inputs)
    assert base_transmission(mechanism, model, np.array([1e-3]))[0] == pytest.approx(1.0, abs=1e-4)
    frequency, displacement = 3.0, 1e-5
    omega = 2 * np.pi * frequency
    compliance = receptance(model, np.array([frequency]))[0]
    amplitude = displacement / abs(compliance)
    dynamic = model.K + 1j * omega * model.C - omega**2 * model.M
    eta = np.linalg.solve(dynamic, model.contact.astype(complex) * amplitude)
    moved = mechanism.moved(e.y, model.basis @ eta.real)
    start = mechanism.with_velocity(moved, model.basis @ (1j * omega * eta).real)
    inputs = lambda t: e.inputs._replace(force=100.0 - amplitude * np.cos(omega * t))  # noqa: E731
    end = run(mechanism, start, 0.5 / frequency, inputs=inputs, step=0.005 / frequency, tolerance=1e-10)
    change = mechanism.strip_height(end) - e.strip_height
    expected = (compliance * amplitude * np.exp(1j * np.pi)).real
    assert change == pytest.approx(expected, rel=2e-3)


MOMENT = 1313.7


def undamped():
    """The mechanism without dampers, lifted by a constant moment against an elastic wire."""
    data = library_data("generic_multibody")
    for force in data["force"].values():
        if "damping" in force:
            force["damping"][0] = 0.0
    data["force"]["wire"] = line_force(
        stiffness=(3000.0, "N/m"), free_length=(1.787, "m"), direction=([0, 0, 1], "1")
    ) | {"body_j": "pan_head"}
    mechanism = Mechanism(mechanism_from(data))
    return mechanism, assemble(mechanism)


def total_energy(mechanism, y):
    """Return the energy with that of the constant moment."""
    return mechanism.energy(y) - MOMENT * independent.coordinates(mechanism, y)[0]


def swing_and_drift(duration):
    mechanism, y = undamped()
    pushed = Inputs(lift=MOMENT, force=200.0, lateral=0.05)
    y = run(mechanism, y, 0.2, inputs=lambda t: pushed)
    energy, kinetic = total_energy(mechanism, y), []

    def watch(t, done):
        s = mechanism.split(done.y)
        kinetic.append(0.5 * (mechanism.mass @ (s.v**2).sum(axis=1) + (mechanism.inertia * s.w**2).sum()))

    y = run(mechanism, y, duration, inputs=lambda t: Inputs(lift=MOMENT), tolerance=1e-9, watch=watch)
    return max(kinetic) - min(kinetic), total_energy(mechanism, y) - energy


def test_undamped_mechanism_keeps_its_energy():
    swing, drift = swing_and_drift(2.0)
    assert swing > 1.0
    assert abs(drift) < 1e-6 * swing * 2.0 / 60.0


@pytest.mark.long
def test_undamped_mechanism_keeps_its_energy_over_a_minute():
    swing, drift = swing_and_drift(60.0)
    assert abs(drift) < 1e-6 * swing


def test_halving_the_tolerance_changes_little(generic):
    mechanism, y = generic
    ends = [run(mechanism, y.copy(), 0.5, inputs=forcing, tolerance=t) for t in (1e-8, 5e-9)]
    assert np.abs(ends[0] - ends[1])[: 3 * mechanism.count].max() < 1e-7


@pytest.mark.long
def test_halving_the_tolerance_changes_a_ten_second_response_by_less_than_a_micrometre(generic):
    mechanism, y = generic
    ends = [run(mechanism, y.copy(), 10.0, inputs=forcing, tolerance=t) for t in (1e-8, 5e-9)]
    assert np.abs(ends[0] - ends[1])[: 3 * mechanism.count].max() < 1e-6


def test_constraints_hold_through_a_violent_run(generic):
    mechanism, y = generic
    worst = np.zeros(2)

    def watch(t, done):
        values = done.evaluation.constraints
        worst[:] = np.maximum(worst, [np.abs(values.violation).max(), np.abs(values.rate).max()])

    pulses = lambda t: Inputs(lift=1313.7 + 400.0 * np.sign(np.sin(20 * t)), force=900.0 * (np.sin(7 * t) > 0.9))  # noqa: E731
    run(mechanism, y.copy(), 1.5, inputs=pulses, watch=watch, tolerance=1e-7, step=5e-3, largest=5e-3)
    assert (worst < 1e-7).all()


def test_larger_macro_steps_end_in_the_same_place(generic):
    mechanism, y = generic
    fine = run(mechanism, y.copy(), 0.3, inputs=forcing)
    coarse = run(mechanism, y.copy(), 0.3, inputs=forcing, step=0.05, largest=0.05)
    assert np.abs(fine - coarse)[: 3 * mechanism.count].max() < 1e-7


def test_steps_end_on_the_communication_point_and_kinks(generic):
    mechanism, y = generic
    times = []

    def inputs(t, inside):
        times.append(t)
        assert (t - 0.7e-3) * (inside - 0.7e-3) >= -1e-12
        return Inputs(lift=1313.7)

    done = Integrator(mechanism, 1e-8, 1e-3).advance(y.copy(), inputs, 2.5e-3, 1e-3, kinks=(0.7e-3, 9.0))
    assert max(times) == pytest.approx(2.5e-3, abs=1e-15)
    assert any(abs(t - 0.7e-3) < 1e-15 for t in times)
    assert done.steps == 3
