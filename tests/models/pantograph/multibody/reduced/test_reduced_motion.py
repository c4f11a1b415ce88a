"""The reduced form against the general one, which knows nothing of tables, arm or head."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest

from models.library.catalogue import load_pantograph
from models.numerics.cubic_curve import CubicCurve
from models.pantograph.multibody.analysis.posture import take_posture
from models.pantograph.multibody.elements.angle_elements import PointDistance
from models.pantograph.multibody.last_found import LastFound
from models.pantograph.multibody.mechanism import Inputs, Mechanism
from models.pantograph.multibody.mechanism_assembly import assemble, project
from models.pantograph.multibody.mechanism_definition import BumpStop
from models.pantograph.multibody.multibody_part import MultibodyPantographPart
from models.pantograph.multibody.reduced import reduced_equations, reduced_motion
from models.pantograph.multibody.reduced.reduced_motion import ReducedModel, ReducedMotion
from models.pantograph.operation import Drive
from tests.effort import count
from tests.models.pantograph.multibody.pantographs import pitching_head, rubbing_head, with_everything

#: The motion is plain here, but where kernels are compared with it.
KERNEL = "OPENPANTO_KERNEL"
LIBRARY = ("CX_multibody", "generic_multibody", "generic_multibody_cam")


@pytest.fixture(autouse=True)
def plain(monkeypatch):
    monkeypatch.setenv(KERNEL, "numpy")


def reduced(definition):
    """The model about the working configuration, and the lift that balances it there."""
    mechanism = Mechanism(definition)
    posture = take_posture(mechanism)
    return ReducedModel(mechanism, project(mechanism, posture.start.y)), posture.start.lift


def reduced_as_assembled(definition):
    """The same about a configuration that nothing balances."""
    mechanism = Mechanism(definition)
    return ReducedModel(mechanism, assemble(mechanism)), 1200.0


def random_states(model, rng, number):
    """Coordinates over the range, bodies at up to 2 m/s."""
    n, (low, high) = model.size, model.range
    for _ in range(number):
        y = np.zeros(2 * n)
        weights = np.array(model.settings[2][:n])
        y[0], y[2:n] = rng.uniform(low, high), rng.uniform(-0.03, 0.03, n - 2)
        y[n:] = rng.uniform(-2.0, 2.0, n) / weights
        if model.rolls:
            y[1] = rng.uniform(-0.2, 0.2)
        else:
            y[n + 1] = 0.0
        yield y


@pytest.fixture(scope="module", params=[*LIBRARY, "with_everything", "pitching_head", "rubbing_head"])
def case(request):
    own = {f.__name__: f for f in (with_everything, pitching_head, rubbing_head)}
    if request.param in own:
        definition = own[request.param]()
        return definition, *reduced_as_assembled(definition)
    definition = load_pantograph(request.param)
    return definition, *reduced(definition)


def test_accelerations_are_those_of_the_general_form(case):
    definition, model, balance = case
    rng, motion = np.random.default_rng(3), ReducedMotion(model)
    mechanism, free = model.mechanism, slice(model.mechanism.driven, None)
    for y in random_states(model, rng, count(40, 200)):
        lift = rng.uniform(0.0, 300.0) if definition.holds_force else balance * rng.uniform(0.5, 1.5)
        force, lateral, base = rng.uniform(0.0, 300.0), rng.uniform(-0.4, 0.4), rng.uniform(-3.0, 3.0)
        acting = (force, lateral, base, lift, 0.0)
        acceleration, response = motion.evaluate(y, acting)
        motion.memory[0][:], motion.memory[1][:] = y.tolist(), acceleration.tolist()
        state = model.cartesian(y, np.array([0.1, 0.3]))
        found = mechanism.evaluate(state.copy(), Inputs((0.1, 0.3, base), lift, force, lateral), respond=True)
        s = mechanism.split(state)
        seen = motion.bodies((0.1, 0.3, base))
        assert np.abs(seen[:, 0] - s.r[free, 2]).max() < 1e-11
        assert np.abs(seen[:, 1] - s.v[free, 2]).max() < 1e-10
        scale = max(1.0, np.abs(found.acceleration[free, 2]).max())
        assert np.abs(seen[:, 2] - found.acceleration[free, 2]).max() < 1e-8 * scale
        other, _ = motion.evaluate(y, (force + 30.0, lateral + 0.1, base + 0.5, lift, 0.0))
        moment = (force + 30.0) * (lateral + 0.1) - force * lateral
        change = np.array([30.0, moment, 0.5]) @ response.reshape(3, -1)
        assert other == pytest.approx(acceleration + change, rel=1e-9, abs=1e-9 * scale)


@pytest.mark.filterwarnings("ignore:.*reflected list")
def test_kernels_give_the_plain_numbers(case, monkeypatch):
    pytest.importorskip("numba")
    definition, model, balance = case
    plain = ReducedMotion(model)
    monkeypatch.setenv(KERNEL, "numba")
    compiled = ReducedMotion(model)
    for y in random_states(model, np.random.default_rng(11), 20):
        for acting in ((120.0, 0.3, 1.0, balance, 20.0), (0.0, 0.0, 0.0, 0.5 * balance, 0.0)):
            for mine, theirs in zip(compiled.evaluate(y, acting), plain.evaluate(y, acting), strict=True):
                assert mine == pytest.approx(theirs, rel=1e-12, abs=1e-12 * np.abs(theirs).max())
    given = [0.0, 0.0, 3, 0.0, -1e-3, -2e-3, 150.0, 149.0, 147.0, 2, 0.1, 0.2, 0.0, 0.0, 0.01, 0.2, 5.0]
    given += [balance, definition.lift, 0.0025, 0.02, 3.0, float(definition.holds_force)]
    strips = np.zeros((2, 2, 2, 3))
    for motion in (plain, compiled):
        motion.begin(given)
    for k in range(40):
        given[0] = 1e-3 * k
        for motion, strip in zip((plain, compiled), strips, strict=True):
            assert motion.step(given, 1e-3) == ""
            motion.place_strip((0.0, 0.0, 80.0, 0.0), strip)
        assert np.abs(strips[0] - strips[1]).max() < 1e-12
    assert np.abs(plain.bodies((0.0, 0.0, 0.0)) - compiled.bodies((0.0, 0.0, 0.0))).max() < 1e-9
    assert compiled.lift_value() == pytest.approx(plain.lift_value(), rel=1e-12)
    assert compiled.is_free(-np.inf, np.inf) == plain.is_free(-np.inf, np.inf)
    # What one leaves the other continues.
    compiled.restore(plain.snapshot())
    assert compiled.snapshot()["reduced"].tobytes() == plain.snapshot()["reduced"].tobytes()


def test_it_is_free_where_no_stop_of_the_bodies_is_reached(case):
    definition, model, _ = case
    motion, mechanism, seen = ReducedMotion(model), model.mechanism, []
    bumps = [(f, PointDistance(f, mechanism.numbers)) for f in definition.forces if isinstance(f, BumpStop)]
    for y in random_states(model, np.random.default_rng(8), 12):
        y[2 : model.size] *= 0.5
        motion.memory[0][:] = y.tolist()
        kinematics = mechanism.kinematics(model.cartesian(y, np.zeros(2)))
        lengths = [(f.shortest, distance.at(kinematics), f.longest) for f, distance in bumps]
        inside = [(low is None or length >= low) and (high is None or length <= high) for low, length, high in lengths]
        free = not mechanism.forces.stops.touched(kinematics.frames) and all(inside)
        assert motion.is_free(-np.inf, np.inf) == free
        seen.append(free)
        if mechanism.forces.lift_place is not None and free:
            place = mechanism.forces.lift_place.at(kinematics)
            assert motion.is_free(place - 1e-6, place + 1e-6)
            assert not motion.is_free(place + 1e-6, np.inf)
    assert any(seen) or any(f.name == "b1" for f, _ in bumps)  # with everything, some stop or other always is


def test_the_strip_is_where_its_body_is(case):
    _, model, _ = case
    motion, mechanism = ReducedMotion(model), model.mechanism
    strip = np.zeros((2, 2, 3))
    for y in random_states(model, np.random.default_rng(5), 10):
        motion.memory[0][:] = y.tolist()
        motion.place_strip((0.0, 0.1, 0.0, 0.3), strip)
        assert strip == pytest.approx(mechanism.strip_ends(model.cartesian(y, np.array([0.1, 0.3]))), abs=1e-10)


def both_forms(definition):
    """A part in either form, built once."""
    auto, general = (MultibodyPantographPart(replace(definition, formulation=f)) for f in ("auto", "general"))
    general._built = copy.copy(auto._ready())
    general._built.reduced, general._built.form = None, "general form"
    return auto, general


def run_beside(definition, seconds, force_at, base_at):
    """Run both forms under the same inputs; return the largest difference of the strips' places [m]."""
    parts = both_forms(definition)
    for part in parts:
        part.initialise(0.0, force_at(0.0), np.zeros(3), np.array(base_at(0.0)))
    worst = 0.0
    for k in range(round(seconds * 1e3)):
        t = 1e-3 * k
        for part in parts:
            point = np.array([part.strip[0, 0, 0], 0.2 * np.sin(2.0 * t), 5.0])
            part.step(force_at(t), point, np.array(base_at(t)), 1e-3)
        worst = max(worst, float(np.abs(parts[0].strip - parts[1].strip)[:, 0].max()))
    return worst, parts


@pytest.mark.parametrize("seconds", [0.4, pytest.param(10.0, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", LIBRARY)
def test_trajectories_are_those_of_the_general_form(name, seconds):
    """At a step so small that neither integration errs by as much as the forms may differ."""
    definition = load_pantograph(name)
    mean = 157.5 if name != "CX_multibody" else 168.0

    def force_at(t):
        # It grows as the lift does: a constant-force cam brings nothing back, and a hit on a stop is no smooth motion.
        return min(1.0, t / 0.1) * (mean + 30.0 * np.cos(9.0 * t) + 20.0 * np.cos(37.0 * t))

    worst, (auto, general) = run_beside(
        replace(definition, time_step=5e-4), seconds, force_at,
        lambda t: (0.004 * (1.0 - np.cos(6.0 * t)), 0.024 * np.sin(6.0 * t)),
    )  # fmt: skip
    assert auto.form().startswith("reduced form")
    assert general.form().startswith("general form")
    assert worst < 1e-7
    shown, meant = auto.observation_values(), general.observation_values()
    assert shown == pytest.approx(meant, abs=1e-4)


def rising(formulation):
    """A generic pantograph without a wire whose arms rise beyond the tables."""
    d = load_pantograph("generic_multibody").with_values({"static_moment": 2500.0})
    part = MultibodyPantographPart(replace(d, formulation=formulation))
    part.initialise(0.0, 0.0, np.zeros(3), np.zeros(2))
    return part


def test_beyond_the_tables_the_general_form_goes_on():
    auto, general = rising("auto"), rising("general")
    worst, snapshots = 0.0, []
    for _ in range(450):
        for part in (auto, general):
            part.step(0.0, np.zeros(3), np.zeros(2), 1e-3)
        worst = max(worst, float(np.abs(auto.strip - general.strip).max()))
        snapshots.append(auto.snapshot())
    assert "beyond the tables" in auto.form()
    assert worst < 1e-5
    left = [("reduced" in s) for s in snapshots]
    assert left[0]
    assert not left[-1]
    # Back to a state before that: in the reduced form again.
    auto.restore(snapshots[100])
    auto.step(0.0, np.zeros(3), np.zeros(2), 1e-3)
    assert auto.snapshot()["reduced"].tobytes() == snapshots[101]["reduced"].tobytes()
    assert auto.form().startswith("reduced form")


def test_a_roof_that_sways_takes_the_general_form():
    auto, general = both_forms(load_pantograph("generic_multibody"))
    for k in range(60):
        t = 1e-3 * k
        y = 0.01 * (t - 0.03) ** 2 if t > 0.03 else 0.0
        sway = (y, 0.02 * (t - 0.03) if t > 0.03 else 0.0, 0.0, 0.0, 0.0, 0.0)
        for part in (auto, general):
            if k == 0:
                part.initialise(0.0, 150.0, np.zeros(3), np.zeros(2))
            part.step(150.0, np.array([part.strip[0, 0, 0], 0.0, 5.0]), np.zeros(2), 1e-3, Drive(sway=sway))
    assert "sway" in auto.form()
    assert auto.strip == pytest.approx(general.strip, abs=1e-6)


def test_a_force_from_outside_reaches_the_reduced_form():
    """Its curve is found when it first acts (here it is given), after the model is made."""
    auto, general = both_forms(load_pantograph("generic_multibody"))
    for part in (auto, general):
        part.initialise(0.0, 150.0, np.zeros(3), np.zeros(2))
    moments = np.linspace(200.0, 250.0, 5)
    auto._built.mechanism.forces.per_force = CubicCurve(np.linspace(-0.4, 0.4, 5), moments**1.1)
    for part in (auto, general):
        for k in range(40):
            part.step(150.0, np.array([part.strip[0, 0, 0], 0.0, 5.0]), np.zeros(2), 1e-3, Drive(uplift=1.0 * k))
    assert auto.form().startswith("reduced form")
    assert auto.strip == pytest.approx(general.strip, abs=1e-8)
    assert auto.observation_values() == pytest.approx(general.observation_values(), abs=1e-4)


def test_an_arm_is_tabulated_once_for_all_runs_of_a_pantograph(monkeypatch):
    """What a run may set leaves no bit of its tables changed; springs of other lengths have others."""
    monkeypatch.setattr(reduced_motion, "_tables", LastFound(most=2))
    plain = load_pantograph("CX_multibody")
    run = plain.with_values({"speed": 20.0, "reference_height": 5.3, "time_step": 5e-4, "raise_duration": 0.7})
    first, same = (reduced(d)[0]._arm for d in (plain, run))
    assert same is first
    assert reduced_as_assembled(plain)[0]._arm is not first
    assert reduced(plain.with_values({"body.m1.mass": 9.0}))[0]._arm is not first
    other = reduced(run)[0]._arm
    assert other is not first  # the two used last alone are kept
    assert other.functions.cells.tobytes() == first.functions.cells.tobytes()
    assert other.rows.tobytes() == first.rows.tobytes()


def test_numbers_of_functions_are_those_of_the_table():
    model, _ = reduced(load_pantograph("generic_multibody"))
    table = ReducedMotion(model).model.numbers(lambda t: t, np.asarray, np.asarray)[0][0]
    assert table.cells.shape[1] == reduced_equations.FIRST_OF_ARM


def test_scalars_of_arrays_do_not_get_into_the_plain_arithmetic():
    """They are right, but every operation with one takes several times as long as with Python's numbers."""
    parts = [MultibodyPantographPart(load_pantograph("CX_multibody")) for _ in range(2)]
    for part, scalar in zip(parts, (float, np.float64), strict=True):
        part.initialise(scalar(0.0), scalar(150.0), np.zeros(3), np.zeros(2))
        for k in range(4):
            point = np.array([part.strip[0, 0, 0], 0.1, 5.0])
            part.step(scalar(150.0 + k), point, np.zeros(2), scalar(1e-3))
    plain, given = (part._reduced.memory for part in parts)
    assert given == plain
    assert {type(x) for values in given for x in values} == {float}
