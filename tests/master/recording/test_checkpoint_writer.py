"""When checkpoints are written, and of what."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from master.errors import RequestError
from master.recording.checkpoint_writer import CheckpointSchedule, index_at
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides

ROOT = Path(__file__).parents[3]
SERIES = ("timeseries.csv", "timeseries_5ms.csv")


def test_a_schedule_holds_the_steps_after_which_checkpoints_are_written():
    due = [n for n in range(1, 10) if n in CheckpointSchedule(5, 3)]
    assert due == [3, 5, 6, 9]
    assert not CheckpointSchedule()
    assert not any(n in CheckpointSchedule() for n in range(10))


def test_fmus_that_cannot_serialise_are_named(toy):
    with open_scenario(toy, Overrides(), build=False) as scenario:
        system = scenario.system
        mute = replace(system.components[0], fmu=replace(system.components[0].fmu, can_serialise=False))
        with pytest.raises(RequestError, match="FMU of catenary cannot serialise"):
            index_at(replace(system, components=(mute, system.components[1])), 0.1)
