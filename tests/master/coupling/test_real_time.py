"""Keeping to the wall clock, tried with a clock that the test moves."""

from __future__ import annotations

import gc
import json

import numpy as np
import pytest

from master.commands.main import main
from master.coupling.coupling_schemes import Jacobi
from master.coupling.macro_steps import TimeGrid, simulate
from master.coupling.network import Network
from master.coupling.real_time import WallClockPacer
from master.system.connections import Connection


class Clock:
    """Moves when it is slept, by a microsecond when it is looked at, and when a step is made to last."""

    def __init__(self):
        self.now = 1000.0
        self.slept = []

    def __call__(self):
        self.now += 1e-6
        return self.now

    def sleep(self, seconds):
        assert seconds > 0.0
        self.slept.append(seconds)
        self.now += seconds


def paced(fake_slave, durations, factor=1.0, step=0.01, first=0):
    """Run steps that last for ``durations``; returns when each began, and the pacer."""
    clock, began = Clock(), []
    waiting = iter(durations)

    def flow(s, u, t, h):
        began.append(clock.now - 1000.0)
        clock.now += next(waiting)
        return s

    slave = fake_slave("slow", ("u",), ("y",), np.zeros(1), flow)
    network = Network([slave], [Connection("slow", "y", "slow", "u")])
    grid = TimeGrid(0.0, step, first + len(durations), first)
    pacer = WallClockPacer(grid, factor, clock, clock.sleep)
    outcome = simulate(network, Jacobi(), grid, [pacer])
    assert outcome.status == "complete"
    return began, pacer.punctuality, clock


@pytest.mark.parametrize("factor", [0.5, 1.0, 4.0])
def test_steps_begin_when_their_time_has_come(fake_slave, factor):
    began, found, clock = paced(fake_slave, [0.001] * 20, factor)
    period = 0.01 / factor
    assert began == pytest.approx(period * np.arange(20), abs=1e-5)
    assert clock.now - 1000.0 == pytest.approx(20 * period, abs=1e-5)  # also the last results hold at their time
    assert (found.steps, found.missed, found.missed_share) == (20, 0, 0.0)
    assert found.lateness.maximum == 0.0
    assert 0.0 <= found.start_jitter.mean <= found.start_jitter.maximum < 1e-5
    assert found.longest_step == pytest.approx(0.001, abs=1e-5)


def test_a_late_step_is_caught_up_with_and_none_left_out(fake_slave):
    """25 ms instead of 10: its results are 15 ms late, the next step's (2 ms) 7 ms; the one after is in time."""
    began, found, _ = paced(fake_slave, [0.002, 0.025, 0.002, 0.002, 0.002, 0.002])
    assert began == pytest.approx([0.0, 0.01, 0.035, 0.037, 0.04, 0.05], abs=2e-5)
    assert found.missed == 2
    assert found.missed_share == pytest.approx(2 / 6)
    assert found.lateness.maximum == pytest.approx(0.015, abs=2e-5)
    assert found.lateness.mean == pytest.approx((0.015 + 0.007) / 6, abs=2e-5)
    assert found.start_jitter.maximum == pytest.approx(0.015, abs=2e-5)
    assert found.longest_step == pytest.approx(0.025, abs=2e-5)
    assert found.mean_step == pytest.approx(0.035 / 6, abs=2e-5)


def test_a_run_that_is_too_slow_misses_every_deadline_and_never_waits(fake_slave):
    _, found, clock = paced(fake_slave, [0.011] * 10)
    assert found.missed == 10
    assert clock.slept == []
    assert found.lateness.maximum == pytest.approx(0.01, abs=1e-4)


def test_the_percentile_leaves_out_one_in_a_hundred(fake_slave):
    durations = [0.001] * 400
    durations[200] = 0.018
    _, found, _ = paced(fake_slave, durations)
    assert found.lateness.maximum == pytest.approx(0.008, abs=1e-5)
    assert found.lateness.percentile_99 == 0.0


def test_a_run_that_goes_on_is_paced_from_where_it_goes_on(fake_slave):
    began, found, _ = paced(fake_slave, [0.001] * 5, first=1000)
    assert began == pytest.approx(0.01 * np.arange(5), abs=1e-5)
    assert found.steps == 5


def test_the_clock_is_watched_at_the_end_of_each_wait(fake_slave):
    *_, clock = paced(fake_slave, [0.001] * 3)
    assert clock.slept == pytest.approx([0.0088] * 3, abs=1e-5)


@pytest.mark.parametrize("before", [0, 7])
def test_garbage_is_not_collected_while_paced(fake_slave, monkeypatch, before):
    """Whoever has objects that are never looked at keeps them so: a test of the suite has, for instance."""
    thawed, seen = [], []
    monkeypatch.setattr(gc, "get_freeze_count", lambda: before)
    monkeypatch.setattr(gc, "unfreeze", lambda: thawed.append(True))
    slave = fake_slave("a", ("u",), ("y",), np.zeros(1), lambda s, u, t, h: (seen.append(gc.isenabled()), s)[1])
    network = Network([slave], [Connection("a", "y", "a", "u")])
    grid, clock = TimeGrid(0.0, 0.01, 3), Clock()
    pacer = WallClockPacer(grid, 1.0, clock, clock.sleep)
    assert gc.isenabled()
    simulate(network, Jacobi(), grid, [pacer])
    assert seen == [False] * 3
    assert gc.isenabled()
    assert thawed == ([] if before else [True])


def test_nothing_is_said_of_a_run_without_steps():
    assert WallClockPacer(TimeGrid(0.0, 0.01, 3)).punctuality is None


def test_figures_are_those_of_a_run_that_is_not_paced(toy, tmp_path, capsys):
    command = [str(toy), "--no-build", "--no-report", "--stop", "0.05"]
    assert main([*command, "--quiet", "--out", str(tmp_path / "a")]) == 0
    assert main([*command, "--out", str(tmp_path / "b"), "--real-time", "0.5"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "real time x 0.5: " in said
    assert "of 50 deadlines missed" in said
    assert "steps began late by" in said
    assert (tmp_path / "a" / "timeseries.csv").read_bytes() == (tmp_path / "b" / "timeseries.csv").read_bytes()
    found = json.loads((tmp_path / "b" / "summary.json").read_text())["performance"]
    assert found["real_time"]["steps"] == 50
    assert found["wall_time"] >= 0.1


@pytest.mark.parametrize("factor", ["0", "-1", "nan", "fast"])
def test_a_factor_is_a_positive_number(toy, tmp_path, capsys, factor):
    with pytest.raises(SystemExit) as caught:
        main([str(toy), "--out", str(tmp_path / "a"), f"--real-time={factor}"])
    assert caught.value.code == 2
    assert "--real-time" in capsys.readouterr().err
