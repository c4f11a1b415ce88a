"""What must not matter does not: order and names of components, units on the wires, recording, interruption."""

from __future__ import annotations

import shutil
from itertools import pairwise

import numpy as np
import pytest

from master.evaluation.energy_balance import DRIFT
from master.recording import checkpoint
from master.recording.continuation import Continuation
from master.recording.recording import load
from master.run_session import RunOptions, run
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from master.ssp.archive import extract
from master.ssp.ssp_units import Conversion
from tests.effort import IS_LONG, rest

STOP = 0.4
ANNOTATION = '<panto:Coupling scheme="jacobi"/>'


@pytest.fixture(scope="module")
def original(packed, tmp_path_factory):
    folder = tmp_path_factory.mktemp("original") / "cx_ln2.ssp"
    folder.mkdir()
    extract(packed, folder)
    return folder


@pytest.fixture
def scenario(original, tmp_path):
    """A copy of the scenario, to be changed."""
    copy = tmp_path / "cx_ln2.ssp"
    shutil.copytree(original, copy)
    return copy


def change(scenario, *pairs, file="SystemStructure.ssd"):
    path = scenario / file
    text = path.read_text()
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    path.write_text(text)


def go(scenario, folder, stop=STOP, step=None, scheme=None, parameters=(), **way):
    overrides = Overrides(stop, step, scheme, dict(parameters), may_stop_early=True)
    with open_scenario(scenario, overrides, build=False) as opened:
        return run(opened.system, folder, options=RunOptions(**way))


def force(done):
    names = [n for n in done.recordings[0].names if n.endswith("pantograph[1].contact.force")]
    return done.recordings[0][names[0]]


@pytest.fixture(scope="module")
def expected(original, tmp_path_factory):
    """Function scheme -> contact force of the scenario as it is."""
    done = {}

    def get(scheme):
        if scheme not in done:
            done[scheme] = force(go(original, tmp_path_factory.mktemp(scheme) / "results", scheme=scheme))
        assert done[scheme].max() > 100.0
        return done[scheme]

    return get


def _swap_components(scenario):
    path = scenario / "SystemStructure.ssd"
    text = path.read_text()
    parts = text.split("<ssd:Component ")
    first, (second, rest) = parts[1], parts[2].split("</ssd:Component>", 1)
    swapped = f"{parts[0]}<ssd:Component {second}</ssd:Component>\n<ssd:Component {first}{rest}"
    path.write_text(swapped)


def test_order_of_components(scenario, expected, tmp_path):
    _swap_components(scenario)
    with open_scenario(scenario, build=False) as opened:
        assert [c.name for c in opened.system.components] == ["pantograph", "catenary"]
    assert force(go(scenario, tmp_path / "out")).tolist() == expected("jacobi").tolist()


def test_order_of_components_when_they_step_in_turn(scenario, expected, tmp_path):
    """Gauss-seidel steps in the order of the SSD unless the scenario gives one; either way the physics is the same."""
    _swap_components(scenario)
    other = force(go(scenario, tmp_path / "swapped", scheme="gauss-seidel"))
    assert np.abs(other - expected("gauss-seidel")).max() < 0.3
    change(scenario, (ANNOTATION, '<panto:Coupling scheme="gauss-seidel" order="catenary pantograph"/>'))
    assert force(go(scenario, tmp_path / "ordered")).tolist() == expected("gauss-seidel").tolist()


def test_names_of_components(scenario, expected, tmp_path):
    for old, new in (("catenary", "zz_line"), ("pantograph", "a_collector")):
        change(scenario, (f'"{old}"', f'"{new}"'))
    change(scenario, ('parameter="pantograph.', 'parameter="a_collector.'))
    assert force(go(scenario, tmp_path / "out")).tolist() == expected("jacobi").tolist()


def test_recording(scenario, expected, tmp_path):
    every = '<panto:Record variables="*.dropper[*].force" every="0"/><panto:Record variables="*.mass*" every="0.05"/>'
    change(scenario, (ANNOTATION, ANNOTATION + every))
    done = go(scenario, tmp_path / "out")
    assert any("dropper" in n for n in done.recordings[0].names)
    assert force(done).tolist() == expected("jacobi").tolist()


def test_units_on_the_wires(scenario, expected, tmp_path):
    """The line's connectors talk in mm, mm/s and kN, the speed is given in km/h: numbers are converted, not physics."""
    path = scenario / "SystemStructure.ssd"
    head, tail = path.read_text().split('<ssd:Component name="pantograph"')
    for old, new in (("m", "mm"), ("m/s", "mm/s"), ("N", "kN")):
        head = head.replace(f'<ssc:Real unit="{old}"/>', f'<ssc:Real unit="{new}"/>')
    path.write_text(f'{head}<ssd:Component name="pantograph"{tail}')
    change(scenario, ('value="83.3333333333333" unit="m/s"', 'value="300" unit="km/h"'), file="parameters.ssv")
    with open_scenario(scenario, build=False) as opened:
        assert {c.conversion for c in opened.system.connections} == {Conversion()}
        assert opened.system.components[1].parameters["speed"] == pytest.approx(300.0 / 3.6, rel=1e-12)
    assert force(go(scenario, tmp_path / "out")) == pytest.approx(expected("jacobi"), abs=1e-6)


@pytest.mark.parametrize("scheme", ["jacobi", *rest("iterative")])
def test_a_continued_run_is_the_uninterrupted_one(original, tmp_path, scheme):
    whole = go(original, tmp_path / "whole", scheme=scheme, checkpoint=0.25)
    state = checkpoint.read(tmp_path / "whole" / checkpoint.NAME)
    go(original, tmp_path / "rest", scheme=scheme, continuation=Continuation(state, "state"))
    rows, again = ((tmp_path / name / "timeseries.csv").read_text().splitlines() for name in ("whole", "rest"))
    assert again[0] == rows[0]
    assert again[1:] == rows[1 + 250 :]
    assert len(again) == 1 + 151
    coarse = [load(tmp_path / name / "timeseries_5ms.csv") for name in ("whole", "rest")]
    assert (coarse[1].values == coarse[0].values[50:]).all()
    assert whole.summary["status"] == "complete"


def test_a_line_in_motion_takes_a_new_pantograph(original, tmp_path):
    go(original, tmp_path / "first", checkpoint=0.2, stop=0.2)
    state = checkpoint.read(tmp_path / "first" / checkpoint.NAME)
    way = Continuation(state, "state", ("pantograph",))
    done = go(original, tmp_path / "next", parameters={"pantograph.start_position": "400"}.items(), continuation=way)
    recording = done.recordings[0]
    assert recording.time[0] == pytest.approx(0.2)
    assert recording["pantograph.A.x"][0] == pytest.approx(400.0)
    assert force(done)[-1] > 50.0


@pytest.mark.slow
def test_energy_added_by_the_coupling_is_reported_and_falls_with_the_step(original, tmp_path):
    added = []
    for step in (2e-3, 1e-3, *([5e-4] if IS_LONG else [])):
        steps = {f"{part}.time_step": str(step) for part in ("catenary", "pantograph")}
        done = go(original, tmp_path / str(step), stop=1.5, step=step, parameters=steps.items())
        power = done.summary["interface_power"][0]
        assert power["transferred"] > 1.0
        added.append((abs(power["energy"]), power["rms"]))
    for coarse, fine in pairwise(added):
        assert fine[0] < 0.75 * coarse[0]
        assert fine[1] < 0.75 * coarse[1]


@pytest.mark.parametrize("scheme", ["jacobi", *rest("gauss-seidel", "iterative")])
def test_energy_is_kept_by_the_parts_and_nearly_by_their_coupling(original, tmp_path, expected, scheme):
    """Also where steps are repeated from saved states; and watching changes no figure."""
    watched = Overrides(STOP, scheme=scheme, energy=True, may_stop_early=True)
    with open_scenario(original, watched, build=False) as opened:
        done = run(opened.system, tmp_path / "watched")
    parts = {b["what"]: b for b in done.summary["energy"]}
    assert set(parts) == {"catenary", "pantograph", "pantograph - catenary"}
    assert max(parts[name]["share"] for name in ("catenary", "pantograph")) < 1e-10
    assert parts["pantograph - catenary"]["share"] < 1e-3
    assert not any(e["kind"] == DRIFT for e in done.summary["events"])
    assert np.array_equal(force(done), expected(scheme))


def test_inputs_that_are_held_are_found_to_add_energy(original, tmp_path):
    held = {f"{part}.extrapolation_order": "0" for part in ("catenary", "pantograph")}
    watched = Overrides(1.0, parameters=held, energy=True, may_stop_early=True)
    with open_scenario(original, watched, build=False) as opened:
        done = run(opened.system, tmp_path / "held")
    (event,) = (e for e in done.events if e.kind == DRIFT)
    assert event.what == "pantograph - catenary"
    assert done.balances[-1].drift > 0.0
