"""An FMU instance on a real FMU: groups, state, errors."""

import dataclasses

import numpy as np
import pytest

from master.errors import SlaveError
from master.fmu.fmu_description import read_fmu
from master.fmu.instance import Instance
from master.system.components import Component

INPUTS = ("contact.force",)
OUTPUTS = ("A.z", "A.vz", "A.x")


@pytest.fixture
def make(toy_fmus):
    made = []

    def build(**parameters):
        component = Component("pan", read_fmu(toy_fmus / "ToyPantograph.fmu"), parameters, INPUTS, OUTPUTS)
        made.append(Instance(component))
        return made[-1]

    yield build
    for instance in made:
        instance.close()


def started(make, **parameters):
    instance = make(**parameters)
    inputs, outputs = np.zeros(1), np.zeros(3)
    instance.bind(inputs, outputs)
    instance.start(0.0, 1.0)
    instance.finish_initialisation()
    return instance, inputs, outputs


def test_values_pass_through_the_bound_arrays(make):
    """Four substeps of 0.25 s with 100 N on 20 kg without damping: v = 5 m/s, and z by the toy's own rule."""
    instance, inputs, outputs = started(make, static_force=150.0, damping=0.0, speed=10.0)
    inputs[0] = 50.0
    instance.write()
    instance.step(0.0, 1.0)
    instance.read()
    assert outputs == pytest.approx([5.0 + 1.25 * 0.25 * (1 + 2 + 3 + 4), 5.0, 10.0])


def test_a_group_reads_in_the_order_of_its_names(make):
    instance, _, _ = started(make, speed=7.0)
    group = instance.group(["speed", "A.z", "static_force"])
    group.read()
    assert group.values == pytest.approx([7.0, 5.0, 150.0])
    instance.group([]).read()


def test_further_variables_are_read_along_with_the_outputs(make):
    instance, inputs, outputs = started(make, static_force=150.0, damping=0.0, speed=10.0)
    along = instance.read_along(["static_force", "contact.force"])
    inputs[0] = 50.0
    instance.write()
    instance.step(0.0, 1.0)
    assert along.tolist() == [0.0, 0.0]
    instance.read()
    assert outputs == pytest.approx([5.0 + 1.25 * 0.25 * (1 + 2 + 3 + 4), 5.0, 10.0])
    assert along.tolist() == [150.0, 50.0]


def test_two_runs_from_a_saved_state_are_the_same(make):
    instance, inputs, outputs = started(make)
    instance.step(0.0, 0.1)
    state = instance.save()
    found = []
    for _ in range(2):
        inputs[0] = 80.0
        instance.write()
        instance.step(0.1, 0.1)
        instance.read()
        found.append(outputs.copy())
        inputs[0] = 0.0
        instance.write()
        instance.step(0.2, 0.1)
        instance.restore(state)
    instance.release(state)
    assert found[0].tolist() == found[1].tolist()


def test_instances_do_not_share_state(make):
    a, _, out_a = started(make, static_force=150.0)
    b, _, out_b = started(make, static_force=10.0)
    for instance in (a, b):
        instance.step(0.0, 0.1)
        instance.read()
    assert out_a[0] > out_b[0]


def test_an_fmu_that_cannot_be_loaded_is_named(toy_fmus, tmp_path):
    fmu = read_fmu(toy_fmus / "ToyPantograph.fmu")
    broken = dataclasses.replace(fmu, identifier="Other")
    with pytest.raises(SlaveError, match=r"component 'pan': ToyPantograph\.fmu cannot be loaded"):
        Instance(Component("pan", broken, {}, INPUTS, OUTPUTS))


def test_errors_quote_the_fmu(toy_fmus):
    fmu = read_fmu(toy_fmus / "ToyCatenary.fmu")
    instance = Instance(Component("wire", fmu, {"fail_at": 0.0}, (), ("pantograph[1].contact.force",)))
    instance.bind(np.zeros(0), np.zeros(1))
    instance.start(0.0, 1.0)
    instance.finish_initialisation()
    with pytest.raises(
        SlaveError, match=r"'wire' \(ToyCatenary\.fmu\) failed in a step at t = 0 s.*broke at 100 percent"
    ):
        instance.step(0.0, 0.1)
    assert "broke" in instance.remark()
    instance.close()
    instance.close()
