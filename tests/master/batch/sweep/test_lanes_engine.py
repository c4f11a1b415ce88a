"""Runs side by side: the same table as FMUs make, and a refusal in words where they cannot be."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import master
from master.batch.sweep import lanes_engine
from master.batch.sweep.engine_selection import engine_of
from master.batch.sweep.lane_evaluation import LaneOutput, evaluated_run
from master.batch.sweep.lane_system import check_scenario, dropper_rate, grouped
from master.batch.sweep.lanes_engine import LanesEngine
from master.batch.sweep.sweep_plan import SweepRequest
from master.batch.sweep.sweep_run import RunPlace
from master.batch.sweep.sweep_session import PreparedSweep, sweep
from master.errors import MasterError, RequestError, RunError, UsageError
from master.recording.recording_plan import recording_plans
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from master.ssp.ssp_units import Conversion
from master.system.connections import Connection

SCENARIOS = Path(master.__file__).parents[1] / "ssp_scenarios"
STOP = 0.9


@pytest.fixture(scope="module")
def base():
    with open_scenario(SCENARIOS / "cx_ln2.ssp", Overrides(stop=STOP, may_stop_early=True)) as found:
        yield found.system


@pytest.fixture
def prepared(base):
    """Function that prepares a sweep over a request."""
    return lambda **request: PreparedSweep.of(base, SweepRequest.read({"stop": STOP, **request}))


GRID = {"over": {"speed": "240,300", "static_force": "150N,190N"}}


def test_lanes_and_fmus_agree_over_the_whole_run(prepared, tmp_path):
    """Two runs are made both ways; the engine itself ends the sweep if they differ."""
    engine, asked = LanesEngine(2), prepared(**GRID, engine="lanes", check=2)
    done = sweep(asked, tmp_path / "out", engine)
    assert not done.failures
    assert len(done.finished) == 4
    assert [check["run"] for check in done.checks] == [1, 4]
    assert all(0.0 < check["largest difference [N]"] < lanes_engine.AGREEMENT for check in done.checks)
    told = json.loads((tmp_path / "out" / "sweep.json").read_text())
    assert told["checks"] == list(done.checks)
    assert {row["static force [N]"] for row in done.rows if "static force [N]" in row} <= {150.0, 190.0}


def test_lanes_that_disagree_with_fmus_end_the_sweep(prepared, tmp_path, monkeypatch):
    monkeypatch.setattr(lanes_engine, "AGREEMENT", 1e-13)
    with pytest.raises(MasterError, match=r"run 1 made side by side and by FMUs differs by .* N in its contact force"):
        sweep(prepared(over={"speed": "300"}, engine="lanes"), tmp_path / "out", LanesEngine(1))


def test_runs_of_one_line_are_one_group(base, prepared):
    runs = prepared(over={"speed": "240,300", "catenary.contact_wire.tension": "19kN,20kN,21kN"}).outcome.runs
    groups = list(grouped(base, runs))
    assert [len(g.runs) for g in groups] == [2, 2, 2]
    assert len({g.runs[0].parameters["catenary"]["contact_wire.tension"] for g in groups}) == 3


def changed(system, **coupling):
    settings = system.settings.model_copy(update={"coupling": system.settings.coupling.model_copy(update=coupling)})
    return replace(system, settings=settings)


def test_another_scheme_is_refused(base):
    with pytest.raises(RequestError, match="by the scheme jacobi, and the scenario by iterative; use --engine fmu"):
        check_scenario(changed(base, scheme="iterative"))


def test_another_connection_is_refused(base):
    more = Connection("pantograph", "A.z", "pantograph", "base.z")
    with pytest.raises(RequestError, match=r"no connection from pantograph\.A\.z to pantograph\.base\.z"):
        check_scenario(replace(base, connections=(*base.connections, more)))


def test_a_connection_that_is_missing_or_converts_is_refused(base):
    kept = [c for c in base.connections if c.output != "A.vz"]
    with pytest.raises(RequestError, match=r"always leads pantograph\.A\.vz"):
        check_scenario(replace(base, connections=tuple(kept)))
    first, *others = base.connections
    with pytest.raises(RequestError, match="does not convert"):
        check_scenario(replace(base, connections=(replace(first, conversion=Conversion(2.0)), *others)))


def test_another_component_and_an_energy_balance_are_refused(base):
    twin = replace(base.component("pantograph"), name="another")
    with pytest.raises(RequestError, match="'another' is something else"):
        check_scenario(replace(base, components=(*base.components, twin)))
    monitored = tuple(replace(c, parameters={**c.parameters, "monitor_energy": 1}) for c in base.components)
    with pytest.raises(RequestError, match="no balance of energy"):
        check_scenario(replace(base, components=monitored))


def test_a_reference_that_follows_is_refused_with_what_to_do(base):
    """New projects have it, so this is what their first sweep of this kind says."""
    parts = [replace(c, parameters={**c.parameters, "follow_height": 1}) for c in base.components]
    with pytest.raises(RequestError, match=r"set pantograph\.follow_height=0 \(spring on the roof\), or use --engine"):
        check_scenario(
            replace(
                base,
                components=tuple(
                    c if c.name == "pantograph" else o for c, o in zip(parts, base.components, strict=True)
                ),
            )
        )


def test_a_multibody_pantograph_is_refused():
    path = SCENARIOS / "generic_multibody_ln2.ssp"
    with (
        open_scenario(path, Overrides()) as found,
        pytest.raises(RequestError, match="steps lumped pantographs, and 'pantograph' is of type multibody"),
    ):
        check_scenario(found.system)


def test_a_foreign_fmu_is_refused(toy_system):
    with pytest.raises(RequestError, match="use --engine fmu"):
        check_scenario(toy_system)


@pytest.mark.parametrize(
    ("request_", "words"), [({"keep": "all"}, "--keep all"), ({"mean_force": "157 N"}, "--mean-force")]
)
def test_what_lanes_do_not_have_is_refused(prepared, tmp_path, request_, words):
    asked = prepared(over={"speed": "300"}, engine="lanes", **request_)
    with pytest.raises(RequestError, match=words):
        sweep(asked, tmp_path / "out", LanesEngine(0))
    with pytest.raises(UsageError, match="leave --jobs and --scheduler out"):
        engine_of(2, None, print, request=asked.outcome.request)


def output(base, contact, strip):
    """What lanes would leave of a run with these contact forces."""
    count, rate = len(contact), dropper_rate(recording_plans(base), "catenary")
    line = base.component("catenary").fmu.variables
    supports = sum(name.startswith("support[") and name.endswith("].uplift") for name in line)
    droppers = sum(name.startswith("dropper[") and name.endswith("].slack") for name in line)
    points = np.stack([contact, strip[:, 0], np.zeros(count), strip[:, 1], contact], axis=1)
    arrays = {
        "contact": points[:, None],
        "strip": np.concatenate([strip, np.zeros((count, 2))], axis=1)[:, None],
        "uplift": np.zeros((count, supports)),
        "slack": np.zeros((-(-count // rate), droppers), dtype=np.bool_),
        "dropper_force": np.zeros((-(-count // rate), droppers)),
    }
    return LaneOutput({"failure": "", "ends": [[0.7, -0.7]]}, arrays)


def test_a_pantograph_that_has_left_the_wire_fails_as_with_fmus(base):
    system = replace(base, stop=1.5)
    count = system.step_count + 1
    strip = np.stack([60.0 + 80.0 * np.arange(count) * system.step, np.full(count, 5.0)], axis=1)
    force = np.full(count, 100.0)
    force[300:] = 0.0
    with pytest.raises(RunError, match=r"has left the wire: no contact since t = 0\.299 s"):
        evaluated_run(system, output(base, force, strip), {"contact_wire.begin": 0.0, "contact_wire.end": 1e4})
    with pytest.raises(RunError, match="beyond the contact wire"):
        evaluated_run(system, output(base, force, strip), {"contact_wire.begin": 500.0, "contact_wire.end": 1e4})
    force[300:] = 50.0
    done = evaluated_run(system, output(base, force, strip), {"contact_wire.begin": 0.0, "contact_wire.end": 1e4})
    assert done.recordings[0]["catenary.pantograph[1].contact.force"][-1] == 50.0


def test_a_line_that_has_no_equilibrium_fails_its_runs_alone(base, prepared, tmp_path):
    asked = prepared(over={"catenary.messenger_wire.tension": "14kN,14.5kN"}, engine="lanes")
    place = RunPlace(tmp_path, "figures")
    broken = replace(
        asked.outcome.runs[0], parameters={**asked.outcome.runs[0].parameters, "catenary": {"nothing": 1.0}}
    )
    with LanesEngine(0).opened(base, place) as make:
        failed, made = make([broken, asked.outcome.runs[1]])
    assert "nothing" in failed.reason
    assert made.reason == ""
