"""What a run records by itself: all outputs but those that are computed for whoever asks."""

from pathlib import Path

from master.recording.recording_plan import recording_plans
from master.ssp.run_settings import Record, RunSettings
from master.system.components import Component, Fmu, System, Variable


def plans(*records):
    names = ("support[1].uplift", "pantograph[1].nominal.z", "pantograph[1].nominal.vz")
    variables = {n: Variable(n, i, "Real", "output", "continuous", "m", None, None, None) for i, n in enumerate(names)}
    fmu = Fmu(Path("line.fmu"), "guid", "line", variables, can_restore=True, sha256="", tool="")
    settings = RunSettings(records=tuple(records))
    system = System("s", (Component("line", fmu, {}, (), ()),), (), 0.0, 1.0, 1e-3, settings)
    return {plan.every: plan.names.get("line", []) for plan in recording_plans(system)}


def test_what_is_computed_on_request_is_recorded_if_it_is_named():
    assert plans() == {1: ["support[1].uplift"]}
    assert plans(Record(variables=("line.*.nominal.z",), every=0.01)) == {
        1: ["support[1].uplift"],
        10: ["pantograph[1].nominal.z"],
    }
