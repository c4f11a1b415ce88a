"""The energy balance of a multibody pantograph: the error of its integration, and no more."""

import numpy as np
import pytest

from models.library.catalogue import load_pantograph
from models.pantograph.multibody.multibody_part import MultibodyPantographPart
from tests.effort import rest


def run(name, step, roof=0.0, stop=0.25):
    """Run under a force that swings, on a roof that may move."""
    part = MultibodyPantographPart(load_pantograph(name).with_values({"monitor_energy": 1}))
    speed = part.definition.speed
    part.initialise(0.0, 150.0, np.zeros(3), np.zeros(2))
    for n in range(round(stop / step)):
        t = n * step
        base = roof * np.array([1.0 - np.cos(6.0 * t), 6.0 * np.sin(6.0 * t)])
        part.step(150.0 + 40.0 * np.sin(8.0 * t), np.array([speed * t, 0.2 * np.sin(t), 5.0]), base, step)
    return part


@pytest.mark.parametrize(
    ("name", "roof"),
    [
        ("CX_multibody", 0.005),
        ("generic_multibody", 0.0),
        *rest(("CX_multibody", 0.0), ("generic_multibody", 0.005)),
    ],
)
def test_drift_is_the_error_of_the_integration(name, roof):
    """It is small, and falls with the third power of the step or faster."""
    coarse, fine = (run(name, step, roof).energy for step in (1e-3, 5e-4))
    assert coarse[1] > 0.1
    assert coarse[:3] == pytest.approx(fine[:3], abs=1e-3 * np.abs(fine).max())
    assert abs(coarse[3]) < 1e-7 * np.abs(coarse).max()
    assert abs(fine[3]) < abs(coarse[3]) / 6.0


def test_velocities_that_no_force_has_changed_are_found_out():
    part = run("CX_multibody", 1e-3, stop=0.1)
    before = part.energy
    n = part._built.mechanism.count
    part._y[7 * n :] *= 1.001
    assert part.energy[3] - before[3] == pytest.approx(part.energy[0] - before[0])
    assert part.energy[3] > 1e-6 * np.abs(part.energy).max()


def test_a_balance_goes_on_from_a_snapshot():
    first, second = run("CX_multibody", 1e-3, stop=0.05), run("CX_multibody", 1e-3, stop=0.01)
    second.restore(first.snapshot())
    for part in (first, second):
        for _ in range(10):
            part.step(120.0, np.zeros(3), np.zeros(2), 1e-3)
    assert np.array_equal(first.energy, second.energy)
    assert np.array_equal(first.contact_work, second.contact_work)


def test_a_roof_that_rises_with_its_pantograph_lifts_the_weights_and_loses_nothing():
    """At constant speed: the work is that on the weights of the bodies, the base's own aside."""
    given = load_pantograph("CX_multibody").with_values({"monitor_energy": 1, "static_force": 0.0})
    part, speed, h = MultibodyPantographPart(given), 0.2, 1e-3
    part.initialise(0.0, 0.0, np.zeros(3), np.array([0.0, speed]))
    for n in range(100):
        part.step(0.0, np.array([0.0, 0.0, 5.0]), np.array([speed * n * h, speed]), h)
    weight = given.gravity * sum(b.mass for b in given.bodies if b.name not in given.driven)
    stored, dissipated, work, drift = part.energy
    assert stored == pytest.approx(weight * speed * part.time, rel=1e-9)
    assert work == pytest.approx(stored, rel=1e-9)
    assert [dissipated, drift] == pytest.approx([0.0, 0.0], abs=1e-8)
