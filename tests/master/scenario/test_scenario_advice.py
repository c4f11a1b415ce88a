"""Warnings that a scenario's own numbers give rise to."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from master.commands.main import main
from master.scenario.scenario_advice import warnings
from master.ssp.run_settings import RunSettings
from master.system.components import Component, Fmu, System, Variable
from master.system.connections import Connection


def component(name, **values):
    variables = {
        n: Variable(n, i, "Real", "parameter", "tunable", "", str(v), None, None)
        for i, (n, v) in enumerate((n.replace("__", "."), v) for n, v in values.items())
    }
    return Component(name, Fmu(Path("x.fmu"), "", "", variables, True, "", ""), {}, (), ())


LINE = component(
    "line", contact__stiffness=20000.0, contact__exponent=1.0, contact_wire__tension=20000.0, contact_wire__mass=1.334
)
SPEED = math.sqrt(20000.0 / 1.334)


def system(*components, step=1e-3):
    wire = Connection("train", "A.x", "line", "pantograph[1].A.x")
    return System("s", components, (wire,), 0.0, 1.0, step, RunSettings())


@pytest.mark.parametrize(("share", "expected"), [(0.5, 0), (0.699, 0), (0.71, 1), (-0.71, 1), (1.1, 1)])
def test_the_speed_beside_the_waves(share, expected):
    found = list(warnings(system(LINE, component("train", speed=share * SPEED))))
    assert len(found) == expected
    assert all(f"are {abs(share):.2f} of the wave speed of the contact wire of 'line', 441 km/h" in w for w in found)


def test_what_the_scenario_sets_counts_not_the_start_value():
    train = replace(component("train", speed=10.0), parameters={"speed": SPEED})
    assert len(list(warnings(system(LINE, train)))) == 1


def test_steps_too_long_for_the_contact():
    train = component("train", speed=10.0)
    assert list(warnings(system(LINE, train, step=1e-3))) == []
    (found,) = warnings(system(LINE, train, step=5e-3))
    assert found.startswith("macro step 5 ms is long for line.contact.stiffness = 20000 N/m; take 4.1 ms")


def test_nothing_is_said_of_fmus_without_these_parameters():
    foreign = component("line", tension=1.0)
    assert list(warnings(system(foreign, component("train", speed=1e6), step=1.0))) == []
    broken = component("line", contact_wire__tension="x", contact_wire__mass=0.0, contact__stiffness=-1.0)
    assert list(warnings(system(broken, component("train", speed="fast"), step=1.0))) == []


def test_validate_tells_them_and_a_run_leaves_them_to_the_fmus(toy, monkeypatch, tmp_path, capfd):
    monkeypatch.setattr("master.scenario.scenario_advice.warnings", lambda _: iter(["too fast :100:"]))
    assert main(["validate", str(toy), "--no-build"]) == 0
    assert capfd.readouterr().err == "warning: too fast :100:\n"
    assert main(["run", str(toy), "--no-build", "--no-report", "--stop", "0.01", "--out", str(tmp_path / "r")]) == 0
    assert "too fast" not in capfd.readouterr().err
