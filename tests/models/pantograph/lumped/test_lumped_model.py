"""Lumped pantographs: statics, frequencies, time integration, communication."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

from models.definition_files.parameter import ParameterError
from models.numerics.kernel_cache import SWITCH
from models.pantograph.lumped.lumped_model import LumpedModel
from models.pantograph.lumped.lumped_part import LumpedPantographPart

POINT, BASE = np.zeros(3), np.zeros(2)


@pytest.fixture(params=["numpy", "auto"], autouse=True)
def kernel(request, monkeypatch):
    """Do everything twice: to be read, and in compiled kernels where numba is installed."""
    monkeypatch.setenv(SWITCH, request.param)


def test_equations_are_those_of_three_masses(cx):
    """Written out from the source's equations 2.12 to 2.14."""
    model = LumpedModel(cx)
    (m1, k1, c1), (m2, k2, c2), (m3, k3, c3) = [(s.mass, s.stiffness, s.damping) for s in cx.stage]
    assert np.array_equal(np.diag(model.M), [m1, m2, m3])
    assert model.K == pytest.approx(np.array([[k1 + k2, -k2, 0], [-k2, k2 + k3, -k3], [0, -k3, k3]]))
    assert model.C == pytest.approx(np.array([[c1 + c2, -c2, 0], [-c2, c2 + c3, -c3], [0, -c3, c3]]))


def test_steady_state_balances_uplift_and_contact_force(cx):
    """At rest F_static - F = k1 (rise of the lowest mass): k1 takes uplift away as the strip rises."""
    part = LumpedPantographPart(cx.with_values({"speed": 0.0, "static_force": 120.0, "raise_duration": 1.0}))
    part.initialise(0.0, 0.0, POINT, BASE)
    for _ in range(20000):
        part.step(100.0, POINT, BASE, 1e-3)
    rise = part.observation_values()[0] - cx.reference_height
    assert cx.stage[0].stiffness * rise == pytest.approx(20.0, rel=1e-3)


def test_roof_motion_lifts_the_pantograph(cx):
    part = LumpedPantographPart(cx.with_values({"speed": 0.0, "static_force": 0.0}))
    part.initialise(0.0, 0.0, POINT, BASE)
    for _ in range(20000):
        part.step(0.0, POINT, np.array([0.05, 0.0]), 1e-3)
    assert part.strip[0, 0, 2] == pytest.approx(cx.reference_height + 0.05, abs=1e-5)


def test_a_pantograph_on_a_rising_roof_rises_with_it(cx):
    """The lowest damper stands on the roof as the spring does: at constant speed nothing lags behind."""
    speed, h = 0.02, 5e-3
    part = LumpedPantographPart(cx.with_values({"speed": 0.0, "static_force": 0.0, "time_step": h}))
    part.initialise(0.0, 0.0, POINT, np.array([0.0, speed]))
    for n in range(6000):
        part.step(0.0, POINT, np.array([speed * n * h, speed]), h)
    assert part.observation_values()[::3] - cx.reference_height == pytest.approx(speed * part.time, abs=1e-6)
    assert part.observation_values()[1::3] == pytest.approx(speed, abs=1e-6)


def test_only_the_damper_of_the_lowest_stage_feels_a_roof_that_starts_to_move(cx):
    """In the first instant a moving roof pushes with c1 v: the lowest mass alone, M a = f."""
    part = LumpedPantographPart(cx.with_values({"static_force": 0.0}))
    part.initialise(0.0, 0.0, POINT, np.array([0.0, 0.3]))
    lowest = cx.stage[0]
    assert part.observation_values()[2::3] == pytest.approx([0.3 * lowest.damping / lowest.mass, 0.0, 0.0])


def test_when_a_run_begins_is_of_no_account(cx):
    """Uplift, travel and contact force count from the start: one that begins at 1000 s moves as one from 0 s."""
    definition = cx.with_values({"raise_start": 0.05, "raise_duration": 0.1})
    early, late = LumpedPantographPart(definition), LumpedPantographPart(definition)
    early.initialise(0.0, 0.0, POINT, BASE)
    late.initialise(1000.0, 0.0, POINT, BASE)
    for n in range(300):
        for part in (early, late):
            part.step(_force(n * 1e-3) if n > 100 else 0.0, POINT, BASE, 1e-3)
        if n == 49:
            assert early.strip[0, 0, 2] == cx.reference_height  # nothing lifts it before the uplift begins
    assert early.strip[0, 0, 2] > cx.reference_height + 1e-4
    assert late.strip == pytest.approx(early.strip, abs=1e-9)
    assert late.observation_values() == pytest.approx(early.observation_values(), abs=1e-7)


@pytest.mark.parametrize("start", [0.0, 0.3])
def test_the_uplift_grows_evenly_from_its_beginning_to_its_end(cx, start):
    definition = cx.with_values({"raise_start": start, "raise_duration": 0.2})
    share = [definition.raised(start + t) for t in (-0.01, 0.0, 0.05, 0.1, 0.2, 5.0)]
    assert share == pytest.approx([0.0, 0.0, 0.25, 0.5, 1.0, 1.0])
    at_once = cx.with_values({"raise_start": start, "raise_duration": 0.0})
    assert [at_once.raised(start + t) for t in (-1e-9, 0.0, 1.0)] == [0.0, 1.0, 1.0]


def test_a_snapshot_knows_when_its_run_began(cx):
    """In the midst of the ramp, of a run that began at 50 s."""
    definition = cx.with_values({"raise_start": 0.05, "raise_duration": 0.1})
    first, second = LumpedPantographPart(definition), LumpedPantographPart(definition)
    first.initialise(50.0, 0.0, POINT, BASE)
    for _ in range(80):
        first.step(0.0, POINT, BASE, 1e-3)
    second.restore(first.snapshot())
    for _ in range(40):
        for part in (first, second):
            part.step(0.0, POINT, BASE, 1e-3)
    assert np.array_equal(first.strip, second.strip)
    assert np.array_equal(first.observation_values(), second.observation_values())


def test_observed_heights_velocities_and_accelerations_belong_together(cx):
    """By the trapezoidal rule, name by name: z' is vz and vz' is az of the same mass, and the strip is the highest."""
    h = 1e-3
    part = LumpedPantographPart(cx)
    names = [name for name, _, _ in part.observed]
    part.initialise(0.0, 0.0, POINT, BASE)
    before = dict(zip(names, part.observation_values(), strict=True))
    for n in range(1, 150):
        part.step(_force(n * h), POINT, np.array([1e-2 * np.sin(20.0 * n * h), 0.2 * np.cos(20.0 * n * h)]), h)
        now = dict(zip(names, part.observation_values(), strict=True))
        for i in (1, 2, 3):
            for value, rate in (("z", "vz"), ("vz", "az")):
                change = now[f"mass[{i}].{value}"] - before[f"mass[{i}].{value}"]
                mean = 0.5 * (now[f"mass[{i}].{rate}"] + before[f"mass[{i}].{rate}"])
                assert change == pytest.approx(h * mean, rel=1e-6, abs=1e-12)
        assert part.strip[:, :, 2] == pytest.approx(np.array([[now["mass[3].z"], now["mass[3].vz"]]] * 2))
        before = now
    assert max(abs(before[f"mass[{i}].vz"] - before[f"mass[{i}].az"]) for i in (1, 2, 3)) > 0.1


def test_the_highest_mass_carries_the_contact_force_and_the_lowest_the_uplift(cx):
    """At the start, at rest: M a = f, mass by mass."""
    part = LumpedPantographPart(cx.with_values({"static_force": 90.0, "raise_duration": 0.0}))
    part.initialise(0.0, 60.0, POINT, BASE)
    masses = [stage.mass for stage in cx.stage]
    assert part.observation_values()[2::3] == pytest.approx([90.0 / masses[0], 0.0, -60.0 / masses[2]])


def test_no_uplift_no_motion(cx):
    part = LumpedPantographPart(cx.with_values({"static_force": 0.0}))
    part.initialise(0.0, 0.0, POINT, BASE)
    for _ in range(100):
        part.step(0.0, POINT, BASE, 1e-3)
    assert part.strip[:, 0, 2] == pytest.approx(cx.reference_height, abs=1e-15)
    assert part.strip[0, 0, 0] == pytest.approx(cx.speed * 0.1)


def _force(t):
    return 100.0 + 40.0 * np.sin(2.0 * np.pi * 3.0 * t)


def _exact(cx, stop):
    model = LumpedModel(cx)
    M_inverse = np.linalg.inv(model.M)

    def rate(t, y):
        load = model.load(t, BASE)
        load[-1] -= _force(t)
        return np.concatenate([y[3:], M_inverse @ (load - model.C @ y[3:] - model.K @ y[:3])])

    return solve_ivp(rate, (0.0, stop), np.zeros(6), rtol=1e-10, atol=1e-12, max_step=0.01).y[:3, -1]


@pytest.mark.parametrize(("order", "expected"), [(0, 1.0), (1, 2.0), (2, 2.0)])
def test_order_of_a_step_with_extrapolated_force(cx, order, expected):
    """Held force: first order; continued force: second, the trapezoidal rule's own."""
    definition = cx.with_values({"speed": 0.0, "extrapolation_order": order, "raise_duration": 0.0})
    exact = _exact(definition, 0.5)
    errors = []
    for h in (2e-3, 1e-3, 5e-4):
        part = LumpedPantographPart(definition.with_values({"time_step": h}))
        part.initialise(0.0, _force(0.0), POINT, BASE)
        for n in range(round(0.5 / h)):
            part.step(_force(n * h), POINT, BASE, h)
        errors.append(np.abs(part.state.displacement - exact).max())
    assert np.log2(errors[1] / errors[2]) == pytest.approx(expected, abs=0.25)


def test_natural_frequencies_of_cx(cx):
    """Printed parameters give modes near 0.45, 8 and 11 Hz when the strip is free; checked by a Rayleigh quotient."""
    model = LumpedModel(cx)
    omega2, modes = eigh(model.K, model.M)
    for value, mode in zip(omega2, modes.T, strict=True):
        assert mode @ model.K @ mode / (mode @ model.M @ mode) == pytest.approx(value)
    assert np.sqrt(omega2[0]) / (2 * np.pi) == pytest.approx(np.sqrt(178.45 / 22.11) / (2 * np.pi), rel=0.01)


def test_macro_steps_longer_than_the_time_step_are_divided(cx):
    """Two halves of a macro step give what one call gives, force and roof standing still."""
    one, two = LumpedPantographPart(cx), LumpedPantographPart(cx)
    for part in (one, two):
        part.initialise(0.0, 0.0, POINT, BASE)
    for n in range(50):
        one.step(0.0, POINT, BASE, 2e-3)
        for _ in range(2):
            two.step(0.0, POINT, BASE, 1e-3)
        del n
    assert one.strip == pytest.approx(two.strip, abs=1e-12)


def test_snapshots_continue_identically(cx):
    first, second = LumpedPantographPart(cx), LumpedPantographPart(cx)
    first.initialise(0.0, 0.0, POINT, BASE)
    for n in range(20):
        first.step(_force(n * 1e-3), POINT, BASE, 1e-3)
    second.restore(first.snapshot())
    for n in range(20, 40):
        for part in (first, second):
            part.step(_force(n * 1e-3), POINT, BASE, 1e-3)
    assert np.array_equal(first.strip, second.strip)
    assert np.array_equal(first.observation_values(), second.observation_values())


@pytest.mark.parametrize(
    ("name", "value"), [("stage[2].mass", -1.0), ("stage[4].mass", 1.0), ("speed", np.nan), ("sped", 80.0)]
)
def test_wrong_parameters_are_refused_by_name(cx, name, value):
    with pytest.raises(ParameterError, match=name.replace("[", r"\[").replace("]", r"\]")):
        cx.with_values({name: value})


@pytest.mark.parametrize("step", [1e-4, 1e-3, 1e-2])
def test_the_transition_is_the_step_in_displacements(cx, step):
    """Solved for accelerations in one place, for displacements in the other."""
    model, rng = LumpedModel(cx), np.random.default_rng(2)
    state, load = model.initial_state(), 100.0 * rng.standard_normal(3)
    state.displacement, state.velocity, state.acceleration = rng.standard_normal((3, 3)) * [[1e-2], [1e-1], [1.0]]
    before = np.column_stack([state.displacement, state.velocity, state.acceleration]).ravel()
    after = model.transition(step) @ np.concatenate([before, load])
    model.advance(state, step, model.free_response(state, step, load))
    assert after[0::3] == pytest.approx(state.displacement, rel=1e-12)
    assert after[1::3] == pytest.approx(state.velocity, rel=1e-10)
    assert after[2::3] == pytest.approx(state.acceleration, rel=1e-8)


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("lead", [0.0, 1.0])
def test_kernels_make_the_same_steps(monkeypatch, cx, order, lead):
    """Also values valid at a step's end, a moving roof, several steps in one, contact lost and found again."""
    pytest.importorskip("numba")
    found = []
    for kernel in ("numpy", "numba"):
        monkeypatch.setenv(SWITCH, kernel)
        definition = cx.with_values({"extrapolation_order": order, "raise_start": 0.01, "raise_duration": 0.05})
        part = LumpedPantographPart(definition)
        part.initialise(0.5, 20.0, POINT, BASE)
        rows = [part.outputs.copy()]
        for n in range(60):
            h = 2.5e-3 if n % 3 == 0 else 1e-3
            t = part.time
            point = np.array([definition.start_position + definition.speed * (t - 0.5 + lead * h), 0.0, 0.0])
            base = np.array([1e-2 * np.sin(9.0 * t), 9e-2 * np.cos(9.0 * t)])
            part.step(0.0 if 20 < n < 30 else _force(t + lead * h), point, base, h)
            rows.append(part.outputs.copy())
        found.append(np.array(rows))
    # Accelerations jump with the force, so they stay large; the sums are in another order, nothing else differs.
    assert found[1] == pytest.approx(found[0], rel=1e-12, abs=1e-12)
    assert np.abs(np.diff(found[0], axis=0)[:, 12:]).max() > 1.0
