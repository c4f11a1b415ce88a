"""Motion along the track: speed profiles, inputs, and what follows for the pantographs that are moved so."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from models.definition_files.parameter import ParameterError
from models.definition_files.toml_reader import DefinitionError, Table
from models.library.catalogue import load_pantograph
from models.numerics.kernel_cache import SWITCH
from models.pantograph.lumped.lumped_definition import read_lumped
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from models.pantograph.multibody.mechanism import Inputs
from models.pantograph.multibody.mechanism_assembly import assemble
from models.pantograph.multibody.multibody_part import MultibodyPantographPart
from models.pantograph.operation import Drive
from models.pantograph.train_motion import SpeedProfile, TrainMotion, acceleration_warning
from tests.models.pantograph.multibody.mechanisms import library, mechanism, pendulum_data
from tests.models.pantograph.multibody.test_mechanisms import run as integrated

POINT, BASE = np.zeros(3), np.zeros(2)
CX = load_pantograph("CX")
TEXT = {"time": (1.0, 3.0, 4.0, 6.5), "speed": (20.0, 25.0, 25.0, 10.0)}


def by_profile(start=100.0, **table):
    return TrainMotion(start, 0.0, SpeedProfile(**(table or TEXT)), by_inputs=False)


def by_inputs(start=100.0):
    return TrainMotion(start, 0.0, None, by_inputs=True)


@pytest.fixture(params=["numpy", "auto"])
def kernel(request, monkeypatch):
    monkeypatch.setenv(SWITCH, request.param)


def test_twenty_to_thirty_in_eight_seconds_is_two_hundred_metres():
    motion = by_profile(123.0, time=(0.0, 8.0), speed=(20.0, 30.0))
    assert motion.at(8.0) == (323.0, 30.0, 0.0)
    assert motion.at(4.0).x == 123.0 + 90.0


@pytest.mark.parametrize("t", [0.0, 0.5, 1.0, 2.2, 3.0, 3.7, 4.0, 5.9, 6.5, 9.0])
def test_the_way_is_the_integral_of_the_speed(t):
    """By numerical integration of the table read with `numpy.interp`; the acceleration is its slope."""
    motion, speed = by_profile(), lambda s: np.interp(s, TEXT["time"], TEXT["speed"])
    way = quad(speed, 0.0, t, points=[s for s in TEXT["time"] if s < t] or None, epsabs=1e-12)[0]
    found = motion.at(t)
    assert found.x == pytest.approx(100.0 + way, abs=1e-10)
    assert found.speed == pytest.approx(speed(t), abs=1e-12)
    assert found.acceleration == pytest.approx((speed(t + 1e-6) - speed(t)) / 1e-6, abs=1e-6)


@pytest.mark.parametrize("times", [(0.0, 8.0), (2.0, 3.0, 7.0)])
def test_a_constant_profile_is_the_constant_speed_bit_for_bit(times):
    profile = by_profile(7.3, time=times, speed=(83.1,) * len(times))
    steady = TrainMotion(7.3, 83.1, None, by_inputs=False)
    for motion in (profile, steady):
        motion.begin(2.0, (0.0, 0.0))
    assert all(profile.at(t) == steady.at(t) for t in np.random.default_rng(3).uniform(2.0, 30.0, 200).tolist())
    assert profile.kinks(2.5) == ()


def test_accelerations_change_where_the_table_says():
    motion = by_profile()
    motion.begin(10.0, (0.0, 0.0))
    assert motion.kinks(10.5) == pytest.approx([0.5, 2.5, 3.5, 6.0])


def test_inputs_are_continued_by_the_speed_and_its_trend():
    """Of a steady acceleration nothing is lost from the second step on."""
    motion, h, a = by_inputs(), 0.01, 0.8
    x, v = (lambda t: 30.0 * t + 0.5 * a * t * t), (lambda t: 30.0 + a * t)
    motion.begin(5.0, (0.0, 30.0))
    for n in range(20):
        t = n * h
        motion.receive(5.0 + t, (x(t), v(t)), h)
        if n:
            end = motion.at(5.0 + t + h)
            assert (end.x, end.speed, end.acceleration) == pytest.approx((100.0 + x(t + h), v(t + h), a), abs=1e-9)


def test_inputs_that_hold_for_the_end_of_a_step_are_known_by_their_position():
    motion, h = by_inputs(), 0.01
    motion.begin(0.0, (0.0, 50.0))
    motion.receive(0.0, (50.0 * h, 50.0), h)
    assert motion.at(h).x == pytest.approx(100.5)
    assert motion.at(0.0).x == pytest.approx(100.0)


def test_trains_that_accelerate_as_none_does_are_told_once():
    motion, told = by_inputs(), []
    motion.begin(0.0, (0.0, 0.0))
    for n in range(5):
        motion.receive(0.1 * n, (0.0, 4.0 * 0.1 * n), 0.1)
        told.append(motion.told)
    assert "train.vx changes by 4 m/s2" in told[1]
    assert told[2:] == [""] * 3
    assert acceleration_warning(SpeedProfile(**TEXT)).startswith("speed_profile accelerates by -6 m/s2 at t = 4 s")
    assert acceleration_warning(SpeedProfile(time=(0.0, 4.0), speed=(0.0, 12.0))) == ""


def strips(part, steps=40, train=lambda t: (0.0, 0.0), h=1e-3):
    part.initialise(0.0, 0.0, POINT, BASE, Drive(train=train(0.0)))
    found = []
    for n in range(steps):
        part.step(120.0, np.array([part.strip[0, 0, 0], 0.0, 5.0]), BASE, h, Drive(train=train(n * h)))
        found.append(part.strip.copy())
    return np.array(found)


@pytest.mark.usefixtures("kernel")
def test_a_lumped_pantograph_keeps_to_its_profile():
    steady = CX.with_values({"speed": 40.0})
    constant = replace(steady, speed=1.0, speed_profile=SpeedProfile(time=(0.0, 1.0), speed=(40.0, 40.0)))
    assert np.array_equal(strips(LumpedPantographPart(constant)), strips(LumpedPantographPart(steady)))
    braking = replace(constant, speed_profile=SpeedProfile(time=(0.0, 0.02, 1.0), speed=(40.0, 40.0, 39.0)))
    end = strips(LumpedPantographPart(braking))[-1]
    motion = braking.train_motion().at(0.04)
    assert end[:, 0, 0] == pytest.approx(motion.x, abs=1e-12)
    assert end[:, 1, 0] == pytest.approx(motion.speed, abs=1e-12)


@pytest.mark.usefixtures("kernel")
def test_the_uplift_of_the_air_goes_with_the_speed():
    """Steady acceleration on the same way by profile and by inputs; and less force than at the final speed."""
    given = CX.with_values({"aerodynamic_uplift.leading": 0.05, "start_position": 0.0})
    profile = replace(given, speed_profile=SpeedProfile(time=(0.0, 1.0), speed=(40.0, 41.0)))
    h = 1e-3
    train = lambda t: (40.0 * t + 0.5 * t * t, 40.0 + t)  # noqa: E731
    first = strips(LumpedPantographPart(profile), 60)
    second = strips(LumpedPantographPart(given.with_values({"use_train": 1})), 60, train, h)
    np.testing.assert_allclose(second[1:], first[1:], atol=1e-6)  # the trend is known from the second step on
    fast = strips(LumpedPantographPart(given.with_values({"speed": 41.0})), 60)
    assert fast[-1, 0, 0, 2] - first[-1, 0, 0, 2] > 1e-6


def test_a_mechanism_keeps_to_its_profile(monkeypatch):
    monkeypatch.setenv(SWITCH, "numpy")
    part = MultibodyPantographPart(
        replace(library("CX_multibody"), speed_profile=SpeedProfile(time=(0.0, 0.02, 1.0), speed=(40.0, 40.0, 38.5)))
    )
    end = strips(part)[-1]
    motion = part.definition.train_motion().at(0.04)
    assert end[:, 0, 0] == pytest.approx(motion.x, abs=1e-9)
    assert end[:, 1, 0] == pytest.approx(motion.speed, abs=1e-9)
    steady = library("CX_multibody").with_values({"speed": 40.0})
    constant = replace(steady, speed=1.0, speed_profile=SpeedProfile(time=(0.0, 1.0), speed=(40.0, 40.0)))
    both = [strips(MultibodyPantographPart(d), 10) for d in (steady, constant)]
    assert np.array_equal(*both)


@pytest.mark.parametrize(("kind", "form"), [("acceleration", "general"), ("lift", "general"), ("lift", "auto")])
def test_a_jump_within_a_step_costs_no_order(kind, form, monkeypatch):
    """Internal steps end at the jump; up to it the acceleration (or lift) before counts, then that after it."""
    monkeypatch.setenv(SWITCH, "numpy")

    macro, jump = 2.0**-7, 2.5 * 2.0**-7  # without rounding: a time is the jump's or is not

    def end(step):
        given = replace(library("generic_multibody"), formulation=form, time_step=step, tolerance=0.1)
        if kind == "lift":
            jumping = replace(given, raise_start=jump, raise_duration=0.0)
        else:
            profile = SpeedProfile(time=(0.0, jump, 1.0), speed=(40.0, 40.0, 49.8))  # 10 m/s2
            jumping = replace(given, speed_profile=profile)
        part = MultibodyPantographPart(jumping)
        part.initialise(0.0, 0.0, np.zeros(3), np.zeros(2))
        for _ in range(5):
            part.step(0.0, part.strip[:, 0].mean(axis=0), np.zeros(2), macro)
        return part.state[: 3 * 8]

    reference = end(macro / 16)
    errors = [np.abs(end(step) - reference).max() for step in (macro, 0.5 * macro)]
    assert errors[0] > 4.0 * errors[1]
    assert errors[1] < 1e-7


def test_a_train_that_accelerates_tilts_gravity():
    """A pendulum about y under a steady acceleration a swings as one under sqrt(g2 + a2), turned by atan(a / g)."""
    a, g = 2.5, 9.81
    tilt, strength = np.arctan2(a, g), float(np.hypot(a, g))
    pulled = mechanism(*_parts())
    angle = _angle(pulled, integrated(pulled, assemble(pulled), 0.5, inputs=lambda t: Inputs(pull=a)))
    turned_data = _parts(turn=-tilt)
    turned = mechanism(*turned_data, gravity=[strength, "m/s2", "test"])
    other = _angle(turned, integrated(turned, assemble(turned), 0.5, inputs=lambda t: Inputs()))
    assert angle - other == pytest.approx(tilt, abs=1e-7)


def _parts(turn=0.0):
    """Return a pendulum that is let go level, or turned about y."""
    data = pendulum_data((0.0, float(np.sin(0.5 * turn)), 0.0))
    return {"rod": data["body"]["rod"]}, {"hinge": data["joint"]["hinge"]}


def _angle(made, y):
    p = made.split(y).p[1]
    return 2.0 * np.arctan2(p[2], p[0])


def test_energy_counts_the_work_of_the_train(monkeypatch):
    monkeypatch.setenv(SWITCH, "numpy")
    drifts = []
    for h in (1e-3, 5e-4):
        given = library("CX_multibody").with_values({"monitor_energy": 1})
        part = MultibodyPantographPart(replace(given, speed_profile=SpeedProfile(time=(0.0, 1.0), speed=(40.0, 42.0))))
        strips(part, round(0.05 / h), h=h)
        drifts.append(abs(part.energy[3]) / np.abs(part.energy).max())
    assert drifts[0] < 1e-6


def table(**changes):
    data = {
        "name": "x", "type": "lumped", "static_force": [100.0, "N", "t"],
        "stage": [{"mass": [8.0, "kg", "t"], "stiffness": [100.0, "N/m", "t"], "damping": [10.0, "N.s/m", "t"]}],
        "speed_profile": {"time": [[0.0, 8.0], "s", "t"], "speed": [[72.0, 108.0], "km/h", "t"]},
    }  # fmt: skip
    return Table.from_dict(data | changes)


def test_a_speed_beside_inputs_in_its_place_is_refused():
    given = table(speed=[40.0, "m/s", "t"], use_train=[1, "1", "t"])
    del given.data["speed_profile"]
    with pytest.raises(DefinitionError, match=r"speed: does nothing with use_train = 1: .*; leave out one of the two"):
        read_lumped(given)


def test_a_profile_is_read_in_its_units_and_takes_the_place_of_the_speed():
    found = read_lumped(table())
    assert found.speed_profile == SpeedProfile(time=(0.0, 8.0), speed=(20.0, 30.0))
    assert {"speed", "use_train"} & {p.name for p in found.parameters()} == set()
    for name in ("speed", "use_train"):
        with pytest.raises(ParameterError, match=rf"parameter '{name}': does nothing beside \[speed_profile\]"):
            found.with_values({name: 1.0})
    with pytest.raises(ParameterError, match=r"\[speed_profile\]: this run runs at constant speed"):
        found.refuse_varying_speed("this run")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"speed": [30.0, "m/s", "t"]}, r"speed: does nothing beside \[speed_profile\]"),
        ({"use_train": [1, "1", "t"]}, r"use_train: does nothing beside \[speed_profile\]"),
        ({"speed_profile": {"time": [[0, 1], "s", "t"], "speed": [[20], "m/s", "t"]}}, "has 1 values for 2 of 'time'"),
        ({"speed_profile": {"time": [[0], "s", "t"], "speed": [[20], "m/s", "t"]}}, "takes at least 2"),
        ({"speed_profile": {"time": [[1, 1], "s", "t"], "speed": [[2, 3], "m/s", "t"]}}, "must rise from value to"),
        ({"speed_profile": {"time": [[0, 1], "s", "t"], "speed": [[2, 300], "m/s", "t"]}}, "300"),
        ({"speed_profile": {"time": [[0, 1], "s", "t"], "speed": [[2, -3], "m/s", "t"]}}, "-3"),
        ({"speed_profile": {"time": [[0, float("nan")], "s", "t"], "speed": [[2, 3], "m/s", "t"]}}, "profile.time"),
    ],
)  # fmt: skip
def test_profiles_that_cannot_be_meant(changes, said):
    with pytest.raises(DefinitionError, match=said):
        read_lumped(table(**changes))
