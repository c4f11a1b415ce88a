"""Power that the coupling adds at a contact."""

import json

import numpy as np
import pytest

from master.coupling.coupling_power import CouplingPowerObserver, power_residual
from master.coupling.network import Network
from master.system.connections import Connection
from master.system.contacts import Contact


def test_power_residual_vanishes_when_both_sides_agree():
    rng = np.random.default_rng(0)
    force, velocity = rng.normal(size=(2, 100))
    assert np.abs(power_residual(force, force, velocity, velocity)).max() == 0.0


def test_a_late_velocity_on_a_loaded_interface_adds_or_takes_power():
    """The catenary believes in 0.2 m/s where the strip does 0.1 m/s against 100 N: 10 W come from nowhere."""
    f = np.array([100.0])
    assert power_residual(f, f, np.array([0.1]), np.array([0.2]))[0] == pytest.approx(10.0)


def coupled_network(fake_slave):
    ends = ("A.vz", "B.vz")
    reported = tuple(f"pantograph[1].{e}" for e in ends)
    line = fake_slave("line", reported, ("pantograph[1].contact.force",), np.zeros(1), None)
    pan = fake_slave("pan", ("contact.force",), ends, np.zeros(2), None)
    wires = [Connection("pan", e, "line", f"pantograph[1].{e}") for e in ends]
    wires.append(Connection("line", "pantograph[1].contact.force", "pan", "contact.force"))
    return Network([line, pan], wires)


def observed(observer, network, rows):
    for n, (given, reported) in enumerate(rows):
        network.outputs[:], network.inputs[:] = given, reported
        observer.observe(n, 1e-3 * n, network)


def test_interface_power_is_summed_over_the_steps(fake_slave):
    """Against the sums of whole arrays; and a run in two parts has the sums of the whole one, bit for bit."""
    network = coupled_network(fake_slave)
    contacts = [Contact(1, "line", "pan", "line.pantograph[1].contact")]
    random = np.random.default_rng(1)
    given, reported = random.normal(size=(2, 50, 3))
    rows = list(zip(given, reported, strict=True))
    whole, first, second = (CouplingPowerObserver(contacts, network) for _ in range(3))
    observed(whole, network, rows)
    observed(first, network, rows[:20])
    second.restore(json.loads(json.dumps(first.save())))
    observed(second, network, rows[20:])
    assert second.summary(0.01) == whole.summary(0.01)
    (found,) = whole.summary(0.01)
    velocity, velocity_told = given[:, 1:].mean(axis=1), reported[:, :2].mean(axis=1)
    residual = power_residual(given[:, 0], reported[:, 2], velocity, velocity_told)
    assert found.energy == pytest.approx(0.01 * residual.sum())
    assert found.transferred == pytest.approx(0.01 * np.abs(given[:, 0] * velocity).sum())
    assert found.rms == pytest.approx(np.sqrt(np.mean(residual**2)))
