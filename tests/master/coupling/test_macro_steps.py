"""The loop: time, observers, failures, interruption."""

import os
import signal

import numpy as np
import pytest

from master.coupling.coupling_schemes import Jacobi
from master.coupling.macro_steps import TimeGrid, simulate
from master.coupling.network import Network
from master.errors import MasterError, SlaveError
from master.safety.interruption import interruptible
from master.ssp.ssp_units import Conversion
from master.system.connections import Connection


def counter(fake_slave, flow=lambda s, u, t, h: s + 1.0):
    slave = fake_slave("clock", ("u",), ("n",), np.zeros(1), flow)
    return slave, Network([slave], [Connection("clock", "n", "clock", "u")])


class Watcher:
    def __init__(self):
        self.rows = []
        self.finished = 0

    def begin(self, time, network):
        self.rows.append((0, time, network.outputs.copy()))

    def observe(self, index, time, network):
        self.rows.append((index, time, network.outputs.copy()))

    def finish(self):
        self.finished += 1


def test_time_is_never_summed(fake_slave):
    slave, network = counter(fake_slave)
    grid = TimeGrid(0.3, 0.1, 1000)
    simulate(network, Jacobi(), grid)
    assert [t for t, _ in slave.steps] == [0.3 + n * 0.1 for n in range(1000)]
    assert {h for _, h in slave.steps} == {0.1}


def test_observers_see_the_start_and_the_end_of_each_step(fake_slave):
    _, network = counter(fake_slave)
    watcher = Watcher()
    outcome = simulate(network, Jacobi(), TimeGrid(1.0, 0.5, 4), [watcher])
    assert [(i, t, v[0]) for i, t, v in watcher.rows] == [(n, 1.0 + 0.5 * n, n) for n in range(5)]
    assert (outcome.status, outcome.steps, outcome.time) == ("complete", 4, 3.0)
    assert watcher.finished == 1


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_values_that_are_not_finite_stop_the_run(fake_slave, bad):
    _, network = counter(fake_slave, lambda s, u, t, h: s + 1.0 if t < 0.25 else np.array([bad]))
    watcher = Watcher()
    outcome = simulate(network, Jacobi(), TimeGrid(0.0, 0.1, 10), [watcher])
    assert outcome.status == "failed"
    assert outcome.steps == 3
    text = str(outcome.error)
    assert f"'clock.n' became {bad}" in text
    assert "t = 0.4 s" in text
    assert "last good value was 3" in text
    assert len(watcher.rows) == 4  # the bad row is not among them
    assert watcher.finished == 1


def test_a_conversion_that_overflows_stops_the_run_with_the_inputs_name(fake_slave):
    """The output itself is finite: it is the connection's factor that makes too much of it."""
    slave = fake_slave("clock", ("u",), ("n",), np.ones(1), lambda s, u, t, h: s * 10.0)
    network = Network([slave], [Connection("clock", "n", "clock", "u", Conversion(1e305, 0.0))])
    watcher = Watcher()
    outcome = simulate(network, Jacobi(), TimeGrid(0.0, 0.1, 10), [watcher])
    assert outcome.status == "failed"
    text = str(outcome.error)
    assert "'clock.u' became inf at t = 0.4 s; its last good value was 1e+308" in text
    assert "Check the factor" in text
    assert len(watcher.rows) == 4


def test_values_too_large_to_be_added_are_still_finite(fake_slave):
    slave = fake_slave("a", (), ("x", "y"), np.zeros(2), lambda s, u, t, h: np.array([1.5e308, 1.5e308]))
    network = Network([slave], [])
    assert simulate(network, Jacobi(), TimeGrid(0.0, 0.1, 3)).status == "complete"


def test_an_observer_that_cannot_finish_fails_the_run_and_the_others_finish(fake_slave):
    class Broken(Watcher):
        def finish(self):
            raise MasterError("no room")

    _, network = counter(fake_slave)
    last = Watcher()
    outcome = simulate(network, Jacobi(), TimeGrid(0.0, 0.1, 3), [Broken(), last])
    assert (outcome.status, str(outcome.error)) == ("failed", "no room")
    assert last.finished == 1


def test_the_slaves_own_words_are_quoted(fake_slave):
    slave, network = counter(fake_slave, lambda s, u, t, h: np.array([np.nan]))
    slave.said = "the strip has left the wire"
    outcome = simulate(network, Jacobi(), TimeGrid(0.0, 0.1, 10))
    assert "component 'clock' says: the strip has left the wire" in str(outcome.error)


def test_a_failing_slave_ends_the_run_without_raising(fake_slave):
    def flow(s, u, t, h):
        if t > 0.15:
            raise SlaveError("gone")
        return s + 1

    _, network = counter(fake_slave, flow)
    watcher = Watcher()
    outcome = simulate(network, Jacobi(), TimeGrid(0.0, 0.1, 10), [watcher])
    assert (outcome.status, outcome.steps, str(outcome.error)) == ("failed", 2, "gone")
    assert watcher.finished == 1


def test_a_wish_to_stop_is_heeded_between_steps(fake_slave):
    slave, network = counter(fake_slave)
    outcome = simulate(network, Jacobi(), TimeGrid(0.0, 0.1, 10), stop_wanted=lambda: len(slave.steps) >= 3)
    assert (outcome.status, outcome.steps) == ("interrupted", 3)
    assert outcome.time == pytest.approx(0.3)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_become_a_wish_and_a_second_one_stops_at_once(number):
    before = signal.getsignal(number)
    with interruptible() as wanted:
        assert not wanted()
        os.kill(os.getpid(), number)
        assert wanted()
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), number)
    assert signal.getsignal(number) == before
