"""An FMU through a real FMI importer: phases, values, states and failures."""

from __future__ import annotations

import math
import sys

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from fmus.builder.fmu_build import build
from tests.fmus.support import Instance, refused, toy_recipe

NAMES = ["mass[1].z", "mass[2].z", "spring[1].force", "rest"]
VALUES = {"mass": 0.2, "stiffness": 300.0, "substeps": 5}


def set_all(instance, values):
    for name, value in values.items():
        instance[name] = value


# Phases.


@pytest.mark.parametrize("phase", ["before setup", "after setup", "in initialization"])
def test_parameters_may_come_in_any_phase(instantiate, phase):
    instance = instantiate()
    if phase == "before setup":
        set_all(instance, VALUES)
    instance.slave.setupExperiment(startTime=0.0)
    if phase == "after setup":
        set_all(instance, VALUES)
    instance.slave.enterInitializationMode()
    if phase == "in initialization":
        instance.get(NAMES)  # builds the part with the wrong values first
        set_all(instance, VALUES)
    instance["force"] = 3.0
    instance.slave.exitInitializationMode()
    rest = instance["rest"]
    assert rest == 0.2 * 9.81 / 300.0
    reference = instantiate()
    reference.initialise(force=3.0, **VALUES)
    assert instance.run(20) == reference.run(20)
    assert not instance.messages


def test_outputs_follow_inputs_and_parameters_in_initialization_mode(instantiate):
    instance = instantiate()
    instance.slave.setupExperiment(startTime=0.0)
    instance.slave.enterInitializationMode()
    assert instance["mass[1].z"] == 0.0
    instance["force"] = 2.0
    assert instance["spring[1].force"] == pytest.approx(2.0)
    instance["stiffness"] = 200.0
    assert instance["mass[1].z"] == pytest.approx(0.01)
    instance.slave.exitInitializationMode()
    assert instance["mass[1].z"] == pytest.approx(0.01)


def test_asking_and_setting_the_same_value_builds_nothing_again(toy_fmu):

    instance = Instance(toy_fmu)
    instance.slave.setupExperiment(startTime=0.0)
    instance.slave.enterInitializationMode()
    package = f"openpanto_{instance.description.guid.replace('-', '')[:12]}"
    part = sys.modules[f"{package}.toy.part"].ToyPart
    before = part.built
    for _ in range(3):
        instance.get(NAMES)
        instance["force"] = 2.0
        instance["mass"] = 0.1
    instance.slave.exitInitializationMode()
    instance.get(NAMES)
    assert part.built - before == 2
    instance.free()


def test_start_time_is_taken(instantiate):
    instance = instantiate()
    instance.initialise(start=7.5)
    instance.step(7.5)
    assert instance["mass[2].z"] > 0.0


def test_reset_gives_a_new_part(instantiate):
    instance = instantiate()
    instance.initialise(**VALUES)
    first = instance.run(10)
    instance.slave.reset()
    assert instance["stiffness"] == 100.12345678901234
    instance.initialise(**VALUES)
    assert instance.run(10) == first


def test_many_instances_one_after_another_and_together(toy_fmu):

    for _ in range(20):
        instance = Instance(toy_fmu)
        instance.initialise()
        instance.step(0.0)
        instance.free()
    together = [Instance(toy_fmu, f"part {i}") for i in range(10)]
    for i, instance in enumerate(together):
        instance.initialise(force=float(i))
    assert [i["spring[1].force"] for i in together] == pytest.approx(range(10))
    for instance in together:
        instance.free()


def test_steps_of_any_length(instantiate):
    instance = instantiate()
    instance.initialise()
    time = 0.0
    for step in (1e-3, 5e-4, 2e-3):
        instance.step(time, step)
        time += step


# State.


def test_restored_state_continues_bit_for_bit(instantiate):
    instance = instantiate()
    instance.initialise(**VALUES)
    instance.run(10)
    state = instance.slave.getFMUstate()
    first = instance.run(30, first=10)
    instance.slave.setFMUstate(state)
    assert instance.run(30, first=10) == first
    instance.slave.setFMUstate(state)
    assert instance["force"] == 1.09
    instance.slave.freeFMUstate(state)


def test_state_travels_as_bytes_to_another_instance(instantiate):
    one, other = instantiate(), instantiate()
    one.initialise(**VALUES)
    one.run(10)
    data = one.slave.serializeFMUstate(one.slave.getFMUstate())
    observed = one.get(NAMES)
    first = one.run(30, first=10)
    other.initialise()  # with other parameters
    other.slave.setFMUstate(other.slave.deSerializeFMUstate(data))
    assert other.get(NAMES) == observed
    assert other["stiffness"] == 300.0
    assert other.run(30, first=10) == first
    assert other.slave.serializeFMUstate(other.slave.getFMUstate()) == one.slave.serializeFMUstate(
        one.slave.getFMUstate()
    )


def test_state_of_each_phase_can_be_restored(instantiate):
    reference = instantiate()
    reference.initialise(force=2.0, **VALUES)
    expected = reference.run(5)
    instance = instantiate()
    instance["stiffness"] = 300.0
    early = instance.slave.getFMUstate()
    instance.slave.setupExperiment(startTime=0.0)
    instance.slave.enterInitializationMode()
    set_all(instance, {**VALUES, "force": 2.0})
    initial = instance.slave.getFMUstate()
    instance["mass"] = 0.5
    instance.get(NAMES)
    instance.slave.setFMUstate(initial)
    assert instance["mass"] == 0.2
    instance.slave.exitInitializationMode()
    assert instance.run(5) == expected
    instance.slave.setFMUstate(early)
    instance["mass"] = 0.2
    instance["substeps"] = 5
    instance.initialise(force=2.0)
    assert instance.run(5) == expected


@pytest.mark.parametrize("damage", ["flip", "cut", "foreign"])
def test_unusable_states_are_refused_in_words(instantiate, damage, capfd):
    instance = instantiate()
    instance.initialise()
    data = bytearray(instance.slave.serializeFMUstate(instance.slave.getFMUstate()))
    if damage == "flip":
        data[len(data) // 2] ^= 4
    elif damage == "cut":
        data = data[:-9]
    else:
        data = bytearray(b"something else")
    with refused():
        instance.slave.setFMUstate(instance.slave.deSerializeFMUstate(bytes(data)))
    assert "state" in instance.errors[0]
    assert instance.errors[0] in capfd.readouterr().err
    with pytest.raises(FMICallException):
        instance.step(0.0)


def test_state_of_another_fmu_is_refused(instantiate, tmp_path):

    instance, other = instantiate(), instantiate(build(toy_recipe(name="Other"), tmp_path))
    instance.initialise()
    other.initialise()
    data = other.slave.serializeFMUstate(other.slave.getFMUstate())
    good = instance.slave.getFMUstate()
    with refused():
        instance.slave.setFMUstate(instance.slave.deSerializeFMUstate(data))
    assert "belongs to Other" in instance.errors[0]
    instance.slave.setFMUstate(good)
    instance.step(0.0)


# Failures.


def failed_step(instance, time=0.0, step=1e-3):
    with pytest.raises(FMICallException) as caught:
        instance.step(time, step)
    assert caught.value.status == 2  # discard
    return instance.errors[-1]


def test_failure_in_a_step_is_reported_and_survived(instantiate, capfd):
    instance = instantiate(name="line")
    instance.initialise()
    instance["force"] = 2e6
    text = failed_step(instance)
    assert text.startswith("the mass slipped by 3 percent of its way: 100 percent (ValueError in part.py, line ")
    assert "Toy (line): the mass slipped" in capfd.readouterr().err
    assert all(math.isnan(v) for v in instance.get(NAMES))
    instance["force"] = 0.0
    assert "slipped" in failed_step(instance)
    for _ in range(5):
        failed_step(instance)
    assert len(instance.errors) == 2  # reported when it happened and once more, not at every step
    instance.slave.reset()
    instance.initialise()
    instance.step(0.0)


def test_interrupt_from_the_keyboard_does_not_reach_the_host_as_a_crash(instantiate):
    instance = instantiate()
    instance.initialise()
    instance["force"] = 2e5
    assert failed_step(instance) == "interrupted from the keyboard"


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_inputs_that_are_no_numbers_are_named(instantiate, value):
    instance = instantiate()
    instance.initialise()
    instance.step(0.0)
    instance["spare"] = value
    text = failed_step(instance, 1e-3)
    assert text.startswith(f"input spare is {value} at t = 0.001 s")


def test_parameter_out_of_range_is_named_and_can_be_corrected(instantiate):
    instance = instantiate()
    instance.slave.setupExperiment()
    instance.slave.enterInitializationMode()
    instance["stiffness"] = -5.0
    with refused():
        instance["mass[1].z"]
    assert math.isnan(instance["mass[1].z"])
    assert instance.errors == ["parameter 'stiffness': -5 N/m is outside 1 ... 1e+06 N/m: check its size and its unit"]
    instance["stiffness"] = 5.0
    instance["force"] = 1.0
    assert instance["mass[1].z"] == 0.2
    instance.slave.exitInitializationMode()
    instance.step(0.0)


def test_failed_initialization_stops_the_first_step(instantiate):
    instance = instantiate()
    with refused():
        instance.initialise(stiffness=math.nan)
    assert "stiffness" in instance.errors[0]
    assert math.isnan(instance["rest"])
    assert failed_step(instance) == instance.errors[0]


def test_an_initialization_that_failed_before_it_ended_is_an_error_when_it_ends(instantiate):
    instance = instantiate()
    instance.slave.setupExperiment()
    instance.slave.enterInitializationMode()
    instance["stiffness"] = -5.0
    with refused():
        instance["mass[1].z"]
    with refused():
        instance.slave.exitInitializationMode()
    assert len(instance.errors) == 2
    assert len(set(instance.errors)) == 1


def test_parameters_are_fixed_after_initialization(instantiate):
    instance = instantiate()
    instance.initialise()
    instance["mass"] = 0.1  # what it is already
    instance.step(0.0)
    with refused():
        instance["mass"] = 0.3
    assert instance["mass"] == 0.1
    assert "mass cannot change from 0.1 to 0.3 after initialization" in failed_step(instance, 1e-3)


def test_computed_variables_cannot_be_set(instantiate):
    instance = instantiate()
    instance.initialise()
    with refused():
        instance["rest"] = 1.0
    assert "rest is computed" in failed_step(instance)


@pytest.mark.parametrize(("time", "step"), [(0.5, 1e-3), (0.0, 0.0), (0.0, -1e-3), (0.0, math.nan)])
def test_steps_that_do_not_follow_are_refused(instantiate, time, step):
    instance = instantiate()
    instance.initialise()
    assert "step" in failed_step(instance, time, step)


def test_a_parameter_that_changes_the_ports_is_refused(instantiate):
    instance = instantiate()
    with refused():
        instance.initialise(masses=3)
    assert "mass[1].z and its like are 3 values, the FMU has 2" in failed_step(instance)


@pytest.mark.parametrize("places", [slice(None), slice(None, None, -1), slice(None, None, 2), [1, 1, 0, 3]])
def test_values_come_in_the_order_they_are_asked_for(instantiate, places):
    instance = instantiate()
    instance.initialise(**VALUES)
    instance.run(5)
    everything = sorted(instance.references.values())
    asked = [everything[i] for i in places] if isinstance(places, list) else everything[places]
    np.testing.assert_array_equal(instance.slave.getReal(asked), [instance.slave.getReal([r])[0] for r in asked])


@pytest.mark.parametrize("count", [1, 2, 50])
def test_references_that_run_beyond_the_last_one_are_refused(instantiate, count):
    instance = instantiate()
    instance.initialise()
    last = max(instance.references.values())
    with refused():
        instance.slave.getReal(list(range(last, last + 1 + count)))
    failed_step(instance)


def test_wrong_references_are_refused(instantiate):
    instance = instantiate()
    instance.initialise()
    wrong = [
        lambda: instance.slave.getReal([999]),
        lambda: instance.slave.setReal([999], [1.0]),
        lambda: instance.slave.getBoolean([0]),
        lambda: instance.slave.getString([0]),
    ]
    for call in wrong:
        with refused():
            call()
    assert instance.slave.getReal([]) == []
    failed_step(instance)


def test_no_message_contains_a_percent_sign(instantiate):
    instance = instantiate(name="100%s")
    instance.initialise()
    instance["force"] = 2e6
    failed_step(instance)
    assert instance.messages
    assert not any("%" in text for _, text in instance.messages)


def test_damaged_definition_makes_no_instance(toy_fmu, tmp_path, capfd):

    folder = fmpy.extract(str(toy_fmu), unzipdir=str(tmp_path))
    path = tmp_path / "resources" / "definition.toml"
    path.write_text(path.read_text().replace("mass =", "mess =").replace('"kg"', '"5%"'))
    with pytest.raises(Exception, match="instantiate"):
        Instance(toy_fmu, unzipped=folder)
    said = capfd.readouterr().err
    assert "mess: unknown key" in said


def test_reading_does_not_change_what_is_computed(instantiate):
    quiet, curious = instantiate(), instantiate()
    for instance in (quiet, curious):
        instance.initialise(**VALUES)
    for n in range(20):
        for instance in (quiet, curious):
            instance["force"] = 1.0 + 0.01 * n
            instance.step(n * 1e-3)
        curious.get(NAMES)
        curious.slave.freeFMUstate(curious.slave.getFMUstate())
    np.testing.assert_array_equal(quiet.get(NAMES), curious.get(NAMES))
