"""The first signal is a request, granted at once where nothing is lost; the second is an order."""

from __future__ import annotations

import json
import signal

import pytest

from master.commands.main import main
from master.fmu.instance import Instance
from master.safety import interruption
from master.safety.interruption import end_signals, interruptible, interruptible_at_once

SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


@pytest.mark.parametrize("number", SIGNALS)
def test_the_first_one_is_a_wish_and_the_second_an_order(number):
    with interruptible() as wanted:
        assert not wanted()
        signal.raise_signal(number)
        assert wanted()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)
    with interruptible() as wanted:
        assert not wanted()


def test_where_nothing_is_lost_the_first_one_is_interruptible_at_once():
    with interruptible() as wanted:
        with pytest.raises(KeyboardInterrupt), interruptible_at_once():
            signal.raise_signal(signal.SIGTERM)
        assert wanted()
        assert interruption.is_stop_requested()


def test_handlers_are_those_from_before():
    before = [signal.getsignal(number) for number in SIGNALS]
    with interruptible():
        assert [signal.getsignal(number) for number in SIGNALS] != before
    assert [signal.getsignal(number) for number in SIGNALS] == before


def test_who_ignores_the_end_of_the_terminal_goes_on(monkeypatch):
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert set(end_signals()) == {signal.SIGINT, signal.SIGTERM}
        with interruptible() as wanted:
            signal.raise_signal(signal.SIGHUP)
            assert not wanted()
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("method", ["_load", "start", "finish_initialisation", "close"])
def test_one_signal_ends_loading_initialising_and_freeing(toy, tmp_path, monkeypatch, capsys, method, number):
    real, done = getattr(Instance, method), []

    def interrupted(self, *arguments):
        signal.raise_signal(number)
        done.append(self)
        return real(self, *arguments)

    monkeypatch.setattr(Instance, method, interrupted)
    folder = tmp_path / "out"
    options = ["--no-build", "--quiet", "--no-report", "--stop", "0.01", "--out", str(folder)]
    assert main([str(toy), *options]) == 1
    assert done == []  # none gets beyond its signal
    assert json.loads((folder / "summary.json").read_text())["status"] == "interrupted"
    said = " ".join(capsys.readouterr().err.split())
    assert said.startswith("error: interrupted. What was computed up to t = 0")
