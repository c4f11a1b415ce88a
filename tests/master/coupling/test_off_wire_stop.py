"""A pantograph that is not under the wire: it begins beyond it, would or has run off it, or never touches it."""

import numpy as np
import pytest

from master.coupling.network import Network
from master.coupling.off_wire_stop import OffWireStop
from master.errors import RunError
from master.system.contacts import Contact
from tests.master.scenario.test_value_checks import pantograph, system

CONTACT = Contact(1, "line", "train", "line.contact")
EXTENT = {"line": {"contact_wire.begin": 10.0, "contact_wire.end": 500.0}}
RAISED = {"raise_start": "0.2", "raise_duration": "0.3"}


def watching(fake_slave, x, known=EXTENT, stop=5.0, start=0.0, **starts):
    """A watch that has begun, and a function that shows it a time, a force and a place."""
    line = fake_slave("line", (), ("contact.force",), np.zeros(1), lambda s, u, t, h: s)
    names = ("A.x", "B.x", "A.z", "B.z")
    train = fake_slave("train", (), names, np.zeros(4), lambda s, u, t, h: s)
    network = Network([line, train], [])

    def show(force, place, height=4.5):
        network.outputs[:] = force, place + 0.1, place - 0.1, height + 0.01, height - 0.01

    show(0.0, x)
    run = system(pantograph(**{**RAISED, **starts}), stop=stop, start=start)
    watch = OffWireStop(run, [CONTACT], network, lambda: known)
    watch.begin(start, network)

    def at(time, force, place):
        show(force, place)
        watch.observe(0, time, network)

    return at


@pytest.mark.parametrize("x", [9.9, 500.1, -50.0])
def test_one_that_starts_beyond_the_wire(fake_slave, x):
    with pytest.raises(RunError, match=rf"'train' starts at {x:g} m, beyond the contact wire of 'line', 10 m to 500 m"):
        watching(fake_slave, x)


@pytest.mark.parametrize("x", [10.0, 500.0, 250.0])
def test_one_that_starts_under_it(fake_slave, x):
    watching(fake_slave, x)


def test_one_that_would_end_beyond_it_is_told_the_latest_stop(fake_slave):
    """30 m + 80 m/s * 6 s = 510 m; the wire ends at 500 m, 5.875 s after the start."""
    with pytest.raises(RunError, match=r"would be at 510 m by the end .* ends at 500 m: stop at 5\.87 s or earlier"):
        watching(fake_slave, 30.0, stop=6.0)
    with pytest.raises(RunError, match=r"would be at 510 m by the end .*: stop at 7\.87 s or earlier"):
        watching(fake_slave, 30.0, stop=8.0, start=2.0)
    watching(fake_slave, 30.0, stop=5.87)


def test_one_that_has_run_off_is_told_the_place(fake_slave):
    at = watching(fake_slave, 30.0)
    at(0.1, 100.0, 400.0)
    at(0.2, 100.0, 500.2)  # a force proves that there is a wire
    with pytest.raises(RunError, match=r"run off the contact wire of 'line' at x = 500\.2 m \(it lies from 10 m"):
        at(0.3, 0.0, 500.2)


def test_one_that_has_not_touched_it_a_second_after_its_uplift_acts_fully(fake_slave):
    at = watching(fake_slave, 30.0)
    at(1.5, 0.0, 100.0)
    with pytest.raises(RunError, match=r"not touched the wire by t = 1\.51 s.*z = 4\.500 m.*strip_offset against"):
        at(1.51, 0.0, 100.0)


def test_the_second_counts_from_the_start_time(fake_slave):
    at = watching(fake_slave, 30.0, start=2.0, stop=5.0)
    at(3.5, 0.0, 100.0)
    with pytest.raises(RunError, match="not touched the wire"):
        at(3.51, 0.0, 100.0)


def test_one_that_has_touched_it_may_lose_it(fake_slave):
    at = watching(fake_slave, 30.0)
    at(0.1, 1.0, 100.0)
    at(2.0, 0.0, 200.0)


@pytest.mark.parametrize("unknown", RAISED)
def test_what_is_not_told_is_not_looked_at(fake_slave, unknown):
    at = watching(fake_slave, -5000.0, known={}, **{unknown: "none"})
    at(4.0, 0.0, 9000.0)
