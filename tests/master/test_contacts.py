"""Finding contacts, interface power, line geometry."""

import numpy as np
import pytest

from master.contacts import Contact, find_contacts, lateral_position
from master.interface import power_residual
from master.line import indexed, support_uplifts
from master.recorder import Recording
from master.system import Connection


def test_contacts_are_found_by_their_connections_in_the_order_of_the_ports():
    connections = [
        Connection("line", "pantograph[2].contact.force", "rear", "contact.force"),
        Connection("line", "pantograph[2].contact.x", "rear", "contact.x"),
        Connection("line", "pantograph[1].contact.force", "front", "contact.force"),
        Connection("front", "A.x", "line", "pantograph[1].A.x"),
    ]
    assert find_contacts(connections) == (
        Contact(1, "line", "front", "line.pantograph[1].contact"),
        Contact(2, "line", "rear", "line.pantograph[2].contact"),
    )


def test_lateral_position_is_measured_from_the_strips_middle():
    contact = Contact(1, "c", "p", "c.contact")
    names = ("c.contact.force", "c.contact.y", "p.A.y", "p.B.y")
    values = np.array([[100.0, 0.15, 0.7, -0.5], [0.0, 0.2, 0.7, -0.5]])
    found = lateral_position(Recording(np.array([0.0, 1.0]), names, ("",) * 4, values), contact)
    assert found[0] == pytest.approx(0.05)
    assert np.isnan(found[1])


def test_power_residual_vanishes_when_both_sides_agree():
    rng = np.random.default_rng(0)
    force, velocity = rng.normal(size=(2, 100))
    assert np.abs(power_residual(force, force, velocity, velocity)).max() == 0.0


def test_a_late_velocity_on_a_loaded_interface_adds_or_takes_power():
    """The catenary believes in 0.2 m/s where the strip does 0.1 m/s against 100 N: 10 W come from nowhere."""
    f = np.array([100.0])
    assert power_residual(f, f, np.array([0.1]), np.array([0.2]))[0] == pytest.approx(10.0)


def test_indexed_values_come_in_numerical_order():
    geometry = {f"support[{i}].x": float(i) for i in (10, 9, 1, 2)} | {
        "support[1].xx": 7.0,
        "dropper[1].x": 8.0,
    }
    assert indexed(geometry, "support", "x").tolist() == [1.0, 2.0, 9.0, 10.0]
    assert indexed(geometry, "support", "y").size == 0


def test_uplifts_are_sorted_by_support():
    names = tuple(f"c.support[{i}].uplift" for i in (10, 2))
    recording = Recording(np.array([0.0, 1.0]), names, ("m", "m"), np.array([[0.0, 0.3], [0.1, 0.2]]))
    found = support_uplifts((recording,), {"c": {"support[2].x": 90.0}})
    assert [(u.support, u.x, u.maximum, u.time) for u in found] == [(2, 90.0, 0.3, 0.0), (10, None, 0.1, 1.0)]
