"""The part between communication points: what a co-simulation sees."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from models.pantograph.multibody.analysis.mechanism_statics import contact_force_at, settle_springs
from models.pantograph.multibody.base_motion import BaseMotion, LateralExtrapolation
from models.pantograph.multibody.mechanism import Inputs, Mechanism, MechanismError
from models.pantograph.multibody.multibody_part import MultibodyPantographPart
from tests.models.pantograph.multibody.mechanisms import library
from tests.models.pantograph.multibody.test_mechanisms import run

M = np.diag([5.58, 8.78, 7.75])
SPRINGS, DAMPERS = [178.45, 15487.0, 7000.0], [108.39, 0.009, 45.85]
REST = np.zeros(2)


FORM = {"formulation": "auto"}


@pytest.fixture(params=["auto", "general"])
def formulation(request, monkeypatch):
    """Either form of the equations of motion."""
    monkeypatch.setitem(FORM, "formulation", request.param)


in_either_form = pytest.mark.usefixtures("formulation")


def in_form(definition):
    return replace(definition, **FORM)


def chain(values):
    a, b, c = values
    return np.array([[a + b, -b, 0.0], [-b, b + c, -c], [0.0, -c, c]])


def lumped(duration, force, uplift, base):
    """Exact motion of the lumped equations 2.12 to 2.19 from rest."""
    K, C = chain(SPRINGS), chain(DAMPERS)

    def slope(t, u):
        z, vz = base(t)
        load = np.array([uplift(t) + SPRINGS[0] * z + DAMPERS[0] * vz, 0.0, -force(t)])
        return np.concatenate([u[3:], np.linalg.solve(M, load - K @ u[:3] - C @ u[3:])])

    start = np.append(np.full(3, base(0.0)[0]), np.full(3, base(0.0)[1]))
    return solve_ivp(slope, (0.0, duration), start, method="DOP853", rtol=1e-12, atol=1e-14, max_step=0.01).y[:, -1]


def force_at(t):
    return 150.0 + 60.0 * np.sin(8.0 * t) + 20.0 * np.sin(40.0 * t)


def base_at(t):
    return 0.01 * np.sin(6.0 * t), 0.06 * np.cos(6.0 * t)


def still(t):
    return 0.0, 0.0


def test_masses_on_slides_move_as_the_lumped_equations_say():
    m = Mechanism(library("CX_multibody"))
    y = settle_springs(m)
    rest = m.split(y).r[1:, 2].copy()
    m.split(y).v[:, 2] = base_at(0.0)[1]
    inputs = lambda t: Inputs((*base_at(t), -36.0 * base_at(t)[0]), 168.0, force_at(t), 0.2)  # noqa: E731
    s = m.split(run(m, y, 0.5, inputs=inputs))
    exact = lumped(0.5, force_at, lambda t: 168.0, base_at)
    np.testing.assert_allclose(s.r[1:, 2] - rest, exact[:3], atol=1e-8)
    np.testing.assert_allclose(s.v[1:, 2], exact[3:], atol=1e-6)


def drive(part, duration, force, base=lambda t: REST, lateral=lambda t: 0.0, step=1e-3, start=0):
    for n in range(start, start + round(duration / step)):
        t = n * step
        point = np.array([part.strip[0, 0, 0], lateral(t), 5.08])
        part.step(force(t), point, np.asarray(base(t)), step)
    return part


def cx_part(**changes):
    return MultibodyPantographPart(in_form(library("CX_multibody").with_values({"start_position": 260.0, **changes})))


@in_either_form
def test_part_follows_the_lumped_equations_under_extrapolated_inputs():
    part = cx_part(raise_start=0.2, raise_duration=0.1)
    part.initialise(0.0, force_at(0.0), np.zeros(3), np.array(base_at(0.0)))
    drive(part, 1.0, force_at, base_at)
    ramp = lambda t: 168.0 * np.clip((t - 0.2) / 0.1, 0.0, 1.0)  # noqa: E731
    exact = lumped(1.0, force_at, ramp, base_at)
    assert part.strip[0, 0, 2] == pytest.approx(5.02 + exact[2], abs=5e-6)
    assert part.strip[0, 1, 2] == pytest.approx(exact[5], abs=1e-5)
    named = dict(zip([name for name, _, _ in part.observed], part.observation_values(), strict=True))
    assert named["m1.vz"] == pytest.approx(exact[3], abs=1e-5)
    assert named["strip.roll"] == 0.0


@in_either_form
def test_part_travels_and_starts_at_its_reference():
    part = cx_part(speed=80.0)
    part.initialise(3.0, 0.0, np.zeros(3), REST)
    np.testing.assert_allclose(part.strip[0], [[260.0, 0.725, 5.02], [80.0, 0.0, 0.0]])
    np.testing.assert_allclose(part.strip[1], [[260.0, -0.725, 5.02], [80.0, 0.0, 0.0]])
    drive(part, 0.1, lambda t: 0.0)
    assert part.strip[0, 0, 0] == pytest.approx(268.0)
    assert part.time == pytest.approx(3.1)


def generic_part(**changes):
    part = MultibodyPantographPart(in_form(library("generic_multibody").with_values(changes)))
    part.initialise(0.0, 0.0, np.zeros(3), REST)
    return part


def spring_force(part):
    return max(0.0, 3000.0 * (part.strip[:, 0, 2].mean() - 5.02))


@in_either_form
def test_generic_part_at_rest_stays_at_rest_until_it_is_raised():
    part = drive(generic_part(raise_start=10.0), 0.5, lambda t: 0.0)
    np.testing.assert_allclose(part.strip[:, 0, 2], 5.02, atol=1e-9)


@in_either_form
def test_raised_pantograph_settles_where_statics_says(generic):
    """The contact force against an elastic wire becomes the one that the moment balances at that height."""
    part = generic_part(**{"force.raising_spring.damping": 5e4})
    for _ in range(2500):
        part.step(spring_force(part), np.array([part.strip[0, 0, 0], 0.0, 5.0]), REST, 1e-3)
    mechanism, y = generic
    height = part.strip[:, 0, 2].mean() - 5.02 + mechanism.strip_height(y)
    expected = contact_force_at(mechanism, height, part.definition.lift, start=y).inputs.force
    assert spring_force(part) == pytest.approx(expected, abs=0.5)
    assert 140.0 < expected < 157.5


@in_either_form
def test_staggered_contact_rolls_the_head_and_strip_ends_follow():
    part = generic_part()
    drive(part, 0.4, lambda t: 160.0, lateral=lambda t: 0.2)
    observed = dict(zip([name for name, _, _ in part.observed], part.observation_values(), strict=True))
    assert observed["strip.roll"] < -0.01
    across = part.strip[0] - part.strip[1]
    assert np.linalg.norm(across[0]) == pytest.approx(1.45)
    assert np.arctan2(across[0, 2], across[0, 1]) == pytest.approx(observed["strip.roll"])
    assert across[0] @ across[1] == pytest.approx(0.0, abs=1e-9)
    on_strip = part.strip[:, 0].mean(axis=0) + observed["strip.contact_y"] * across[0] / 1.45
    assert on_strip[1] == pytest.approx(0.2, abs=1e-3)


@in_either_form
def test_strip_velocity_is_the_rate_of_its_position():
    part = generic_part()
    wander = lambda t: 0.3 * np.sin(9.0 * t)  # noqa: E731
    drive(part, 0.3, force_at, base_at, wander)
    before = part.strip.copy()
    drive(part, 0.001, force_at, base_at, wander, start=300)
    middle = 0.5 * (before[:, 1] + part.strip[:, 1])
    np.testing.assert_allclose((part.strip[:, 0] - before[:, 0]) / 1e-3, middle, atol=1e-3)


@in_either_form
def test_constraints_stay_closed_over_a_run(generic):
    part = generic_part()
    worst = 0.0
    for n in range(1000):
        t = n * 1e-3
        part.step(spring_force(part), np.array([part.strip[0, 0, 0], 0.2 * np.sin(t), 5.0]), np.array(base_at(t)), 1e-3)
        worst = max(worst, part.observation_values()[-2:].max())
    assert worst < 1e-7


@in_either_form
def test_snapshot_restores_bit_for_bit():
    part = generic_part()
    wander = lambda t: 0.2 * np.sin(5.0 * t)  # noqa: E731
    drive(part, 0.05, force_at, base_at, wander)
    kept = part.snapshot()
    first = drive(part, 0.05, force_at, base_at, wander, start=50).snapshot()
    part.restore(kept)
    again = drive(part, 0.05, force_at, base_at, wander, start=50).snapshot()
    fresh = MultibodyPantographPart(part.definition)
    fresh.restore(kept)
    elsewhere = drive(fresh, 0.05, force_at, base_at, wander, start=50).snapshot()
    for name, value in first.items():
        assert np.array_equal(value, again[name]), name
        assert np.array_equal(value, elsewhere[name]), name


@in_either_form
def test_internal_step_is_never_larger_than_allowed():
    coarse, fine = cx_part(time_step=1e-3), cx_part(time_step=5e-3)
    for part in (coarse, fine):
        part.initialise(0.0, 0.0, np.zeros(3), REST)
        drive(part, 0.5, force_at, step=5e-3)
    np.testing.assert_allclose(coarse.strip, fine.strip, atol=1e-6)


@in_either_form
def test_input_that_is_not_a_number_is_refused_in_words():
    part = cx_part()
    part.initialise(0.0, 0.0, np.zeros(3), REST)
    with pytest.raises(MechanismError, match="not a number"):
        part.step(np.nan, np.zeros(3), REST, 1e-3)


def test_base_follows_its_inputs_without_a_jump():
    base = BaseMotion()
    base.start(np.array(base_at(0.0)))
    h, last = 1e-3, np.array(base_at(0.0))
    for n in range(500):
        base.receive(np.array(base_at(n * h)), h)
        np.testing.assert_allclose(base.at(0.0)[:2], last, atol=1e-14)
        base.finish(h)
        last = base.now.copy()
        np.testing.assert_allclose(last, base_at((n + 1) * h), atol=3e-6 if n else 1e-3)
    assert base.at(0.5 * h)[2] == pytest.approx(-36.0 * base_at(0.4995)[0], abs=0.05)


def test_base_that_steps_goes_there_within_one_step():
    base = BaseMotion()
    base.start(REST)
    base.receive(np.array([0.01, 0.0]), 1e-3)
    base.finish(1e-3)
    np.testing.assert_allclose(base.now, [0.01, 0.0], atol=1e-15)


def test_lateral_position_is_continued_but_not_through_a_jump():
    lateral = LateralExtrapolation()
    lateral.start(0.0, 0.1)
    lateral.receive(0.001, 0.1005)
    assert lateral.at(0.0015) == pytest.approx(0.10075)
    lateral.receive(0.002, -0.2)
    assert lateral.at(0.0025) == -0.2


def named(part):
    return dict(zip([name for name, _, _ in part.observed], part.observation_values(), strict=True))


@in_either_form
def test_observed_velocities_and_accelerations_are_rates_of_what_they_are_named_after():
    """Body by body, and of the roll: central differences of the one are the other."""
    part, h = generic_part(), 1e-3
    wander = lambda t: 0.3 * np.sin(9.0 * t)  # noqa: E731
    drive(part, 0.2, force_at, base_at, wander)
    before = named(part)
    now = named(drive(part, h, force_at, base_at, wander, start=200))
    after = named(drive(part, h, force_at, base_at, wander, start=201))
    pairs = [(name, name.replace(".vz", ".az")) for name in now if name.endswith(".vz")]
    pairs += [(name, name.replace(".z", ".vz")) for name in now if name.endswith(".z")]
    pairs.append(("strip.roll", "strip.roll_rate"))
    assert len(pairs) > 10
    for value, rate in pairs:
        scale = max(abs(now[rate]), 0.01 if rate.endswith(".vz") else 0.1)
        assert (after[value] - before[value]) / (2.0 * h) == pytest.approx(now[rate], abs=0.05 * scale), value
    assert abs(now["strip.roll_rate"]) > 0.01
    assert any(abs(now[a] - now[b]) > 0.05 for a, b in pairs)


@in_either_form
def test_when_a_run_begins_is_of_no_account_and_a_snapshot_knows_it():
    """Travel and raising count from the start; the second half goes on from a snapshot in the midst of the ramp."""
    motions = []
    for start in (0.0, 200.0):
        part = MultibodyPantographPart(in_form(library("generic_multibody").with_values({"raise_duration": 0.1})))
        part.initialise(start, 0.0, np.zeros(3), REST)
        drive(part, 0.06, lambda t: 0.0)
        other = MultibodyPantographPart(part.definition)
        other.restore(part.snapshot())
        motions.append(drive(other, 0.06, lambda t: 0.0, start=60).strip)
    assert motions[1] == pytest.approx(motions[0], abs=1e-7)
    assert motions[0][0, 1, 2] > 1e-3


@in_either_form
def test_a_pantograph_on_a_moving_roof_begins_with_its_velocity():
    part = MultibodyPantographPart(in_form(library("generic_multibody")))
    part.initialise(0.0, 0.0, np.zeros(3), np.array([0.03, 0.25]))
    assert part.strip[:, 1, 2] == pytest.approx(0.25)
    assert part.strip[:, 0, 2] == pytest.approx(part.definition.reference_height + 0.03)
    velocities = [value for name, value in named(part).items() if name.endswith(".vz")]
    assert velocities == pytest.approx([0.25] * len(velocities))


def test_an_accelerating_roof_is_followed_to_the_second_order():
    """Of z = a t^2 / 2, received at the beginnings of steps: at their ends it is where it leads, by half the trend."""
    base, h, a = BaseMotion(), 0.01, 4.0
    base.start(REST)
    for n in range(10):
        base.receive(np.array([0.5 * a * (n * h) ** 2, a * n * h]), h)
        base.finish(h)
    np.testing.assert_allclose(base.now, [0.5 * a * (10 * h) ** 2, a * 10 * h], rtol=1e-12)


def test_a_contact_that_goes_on_across_the_strip_goes_on_from_a_snapshot_as_well():
    first, second = LateralExtrapolation(), LateralExtrapolation()
    first.start(0.0, 0.1)
    first.receive(0.001, 0.1005)
    second.restore(first.snapshot())
    assert second.at(0.0015) == first.at(0.0015) == pytest.approx(0.10075)


@in_either_form
def test_where_the_contact_lies_on_a_tilted_strip_counts_along_the_strip():
    """Far out on a strip that rolls and yaws: along it the way is longer than across the track."""
    part = drive(generic_part(), 0.4, lambda t: 400.0, lateral=lambda t: 0.5)
    observed = named(part)
    ends = part.strip[:, 0]
    middle = ends.mean(axis=0)
    along = (ends[0] - ends[1]) / np.linalg.norm(ends[0] - ends[1])
    assert abs(along[2]) > 0.05
    assert (middle + observed["strip.contact_y"] * along)[1] == pytest.approx(0.5, abs=1e-9)
