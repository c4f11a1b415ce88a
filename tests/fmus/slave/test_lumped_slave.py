"""Ports of a pantograph."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from fmpy.fmi1 import FMICallException

from fmus.builder.fmu_build import build
from fmus.builder.recipe import recipe
from tests.fmus.support import Instance, names_of


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(recipe("Pantograph_CX"), tmp_path_factory.mktemp("fmu"))


@pytest.fixture
def instance(fmu: Path) -> Iterator[Instance]:
    made = Instance(fmu)
    yield made
    made.free()


def test_has_the_ports_of_a_pantograph(instance):
    inputs = ["contact.force", "contact.x", "contact.y", "contact.z", "base.z", "base.vz"]
    inputs += ["reference.vz", "air.u", "uplift_force"]
    inputs += ["base.y", "base.vy", "base.roll", "base.roll_rate", "train.x", "train.vx"]
    assert names_of(instance, "input") == inputs
    strip = [f"{end}.{axis}" for end in "AB" for axis in ("x", "y", "z", "vx", "vy", "vz")]
    outputs = names_of(instance, "output")
    assert outputs[:12] == strip
    assert {"mass[1].z", "mass[3].az"} <= set(outputs)


def test_speed_and_start_position_move_the_strip(instance):
    instance.initialise(start=2.0, speed=50.0, start_position=10.0)
    assert instance.get(["A.x", "B.x", "A.vx"]) == [10.0, 10.0, 50.0]
    instance.step(2.0, 1e-2)
    assert instance["A.x"] == pytest.approx(10.5)
    assert instance["A.y"] > instance["B.y"]


def test_values_by_name_are_motions_of_the_same_mass(instance):
    """By the trapezoidal rule over a step: heights change by the mean velocity, velocities by the mean acceleration."""
    instance.initialise(static_force=150.0, raise_duration=0.0)
    names = [f"mass[{i}].{key}" for i in (1, 2, 3) for key in ("z", "vz", "az")]
    h, before = 1e-3, dict(zip(names, instance.get(names), strict=True))
    for n in range(30):
        instance["contact.force"] = 60.0 + 20.0 * n
        instance.step(n * h, h)
        now = dict(zip(names, instance.get(names), strict=True))
        for i in (1, 2, 3):
            for value, rate in (("z", "vz"), ("vz", "az")):
                change = now[f"mass[{i}].{value}"] - before[f"mass[{i}].{value}"]
                mean = 0.5 * (now[f"mass[{i}].{rate}"] + before[f"mass[{i}].{rate}"])
                assert change == pytest.approx(h * mean, rel=1e-6, abs=1e-12)
        assert instance.get(["A.z", "B.z", "A.vz", "B.vz"]) == [now["mass[3].z"]] * 2 + [now["mass[3].vz"]] * 2
        before = now
    assert now["mass[3].vz"] < -0.01  # the contact force has pushed the strip down


@pytest.mark.parametrize(("z", "vz"), [(0.05, 0.0), (0.0, 0.4)])
def test_the_roof_s_height_and_velocity_have_their_own_names(instance, z, vz):
    """Height lifts by the lowest spring, velocity by the lowest damper: in the first instant M a = k z + c v."""
    instance.initialise(static_force=0.0, **{"base.z": z, "base.vz": vz})
    k, c, m = instance.get(["stage[1].stiffness", "stage[1].damping", "stage[1].mass"])
    assert instance["mass[1].az"] == pytest.approx((k * z + c * vz) / m)
    assert instance["mass[3].az"] == 0.0
    # The inputs of a step count as those of the start do: the same force at its end, nearly the same motion.
    instance.step(0.0, 1e-4)
    assert instance["mass[1].vz"] == pytest.approx(1e-4 * (k * z + c * vz) / m, rel=0.01)


def test_the_contact_force_of_the_start_pushes_the_strip_down(instance):
    instance.initialise(static_force=0.0, **{"contact.force": 77.5})
    assert instance["mass[3].az"] == pytest.approx(-77.5 / instance["stage[3].mass"])
    assert instance["mass[1].az"] == 0.0


@pytest.mark.parametrize("name", ["base.y", "base.roll"])
def test_an_input_that_is_no_number_is_refused_by_its_name(instance, name):
    instance.initialise()
    instance[name] = float("nan")
    with pytest.raises(FMICallException):
        instance.step(0.0)
    assert f"input {name} is nan" in instance.errors[-1]


def test_roll_without_the_height_of_the_base_is_refused_in_words(instance):
    instance.initialise()
    instance["base.roll"] = 0.01
    with pytest.raises(FMICallException):
        instance.step(0.0)
    assert "write base_height [m above rail] into the definition" in instance.errors[-1]
