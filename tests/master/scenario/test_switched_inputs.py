"""Inputs that a parameter switches on, against what is connected."""

from dataclasses import replace
from pathlib import Path

import pytest

from master.scenario.switched_inputs import doubts
from master.ssp.run_settings import RunSettings
from master.system.components import Component, Fmu, System, Variable
from master.system.connections import Connection

NAMES = ("use_train", "lift_input", "follow_height")
INPUTS = ("train.x", "train.vx", "lift.value", "reference.vz")


def system(*connected, **values):
    variables = {
        name: Variable(name, i, "Integer" if name in NAMES else "Real", kind, "fixed", "", "0", None, None)
        for i, (name, kind) in enumerate([*((n, "parameter") for n in NAMES), *((n, "input") for n in INPUTS)])
    }
    train = Component("train", Fmu(Path("x.fmu"), "", "", variables, True, "", ""), values, (), ())
    wires = tuple(Connection("signal", name, "train", name) for name in connected)
    return System("s", (train,), wires, 0.0, 1.0, 1e-3, RunSettings())


@pytest.mark.parametrize(
    ("connected", "values"),
    [
        ((), {}),
        (("train.x", "train.vx"), {"use_train": "1"}),
        (("lift.value",), {"lift_input": "1"}),
        (("reference.vz",), {"follow_height": "1"}),
        ((), {"follow_height": "1", "speed": "40"}),
        ((), {"lift_input": "1", "lift.value": "1100"}),
    ],
)
def test_nothing_is_said_where_both_fit(connected, values):
    assert list(doubts(system(*connected, **values))) == []


@pytest.mark.parametrize(
    ("connected", "values", "said"),
    [
        (("train.x",), {}, "train.train.x is connected, but does nothing while use_train is 0"),
        (("lift.value",), {}, "train.lift.value is connected, but does nothing while lift_input is 0"),
        (("reference.vz",), {}, "train.reference.vz is connected, but does nothing while follow_height is 0"),
        (
            ("train.vx",),
            {"use_train": "1"},
            "train.use_train = 1, but nothing is connected to train.x: it stands still",
        ),
        (
            ("train.x", "train.vx"),
            {"use_train": "1", "speed": "40"},
            "train.speed is set, but does nothing while use_train is 1: "
            "the inputs train.x and train.vx say where it is",
        ),
        ((), {"lift_input": "1"}, "train.lift_input = 1, but nothing is connected to lift.value: nothing lifts it"),
    ],
)
def test_inputs_in_vain_are_told(connected, values, said):
    assert list(doubts(system(*connected, **values))) == [said]


def test_other_fmus_have_no_such_switches():
    given = system()
    (train,) = given.components
    foreign = replace(train, fmu=replace(train.fmu, variables={}))
    assert list(doubts(replace(given, components=(foreign,)))) == []
