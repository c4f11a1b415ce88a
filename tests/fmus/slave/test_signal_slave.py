"""Signal FMUs: built from a table by the command, in FMPy, and in a scenario of the master."""

import shutil

import fmpy
import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from fmus.__main__ import main
from fmus.builder.fmu_build import build
from fmus.builder.recipe import recipe
from master.commands.main import main as master
from models.library.catalogue import load_pantograph
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from models.pantograph.operation import Drive
from tests.fmus.support import Instance, names_of
from tests.robustness.support import ask

TABLE = "time [s],base.z [mm],train.vx [km/h]\n0,0,270\n0.02,4,270\n0.05,-2,270.2\n1,0,275\n"
OPTIONS = ["--rate", "base.z=base.vz", "--integral", "train.vx=train.x", "--interpolation", "smooth"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("signal")
    (made / "roof.csv").write_text(TABLE, encoding="utf-8")
    return made


@pytest.fixture(scope="module")
def fmu(folder):
    assert main(["signal", str(folder / "roof.csv"), *OPTIONS, "--out", str(folder)]) == 0
    return folder / "Signal_roof.fmu"


@pytest.fixture(scope="module")
def curves():
    rows = np.genfromtxt(TABLE.splitlines()[1:], delimiter=",")
    return PchipInterpolator(rows[:, 0], rows[:, 1] / 1e3), PchipInterpolator(rows[:, 0], rows[:, 2] / 3.6)


def test_another_tool_gets_values_rates_and_integrals(fmu, curves):
    z, v = curves
    found = fmpy.simulate_fmu(str(fmu), stop_time=0.1, step_size=1e-3, output_interval=1e-3)
    t = found["time"]
    np.testing.assert_allclose(found["base.z"], z(t), atol=1e-12)
    np.testing.assert_allclose(found["base.vz"], z.derivative()(t), atol=1e-9)
    np.testing.assert_allclose(found["train.vx"], v(t), atol=1e-12)
    np.testing.assert_allclose(found["train.x"], v.antiderivative()(t), atol=1e-12)


def test_gain_offset_and_shift_act_on_all_that_is_made_of_a_column(fmu, curves):
    z, v = curves
    instance = Instance(fmu)
    assert names_of(instance, "input") == []
    parameters = ["base.z.gain", "base.z.offset", "train.vx.gain", "train.vx.offset", "time_shift"]
    assert names_of(instance, "parameter") == parameters
    assert {x.name: x.unit for x in instance.description.modelVariables if x.causality == "output"} == {
        "base.z": "m", "train.vx": "m/s", "base.vz": "m/s", "train.x": "m",
    }  # fmt: skip
    instance.slave.setupExperiment(startTime=0.0)
    instance.slave.enterInitializationMode()
    for name, value in zip(parameters, (2.0, 0.01, -1.0, 5.0, 0.01), strict=True):
        instance[name] = value
    instance.slave.exitInitializationMode()
    instance.step(0.0, 0.05)
    t = 0.04
    assert instance["base.z"] == pytest.approx(2.0 * z(t) + 0.01)
    assert instance["base.vz"] == pytest.approx(2.0 * z.derivative()(t))
    assert instance["train.vx"] == pytest.approx(5.0 - v(t))
    assert instance["train.x"] == pytest.approx(5.0 * t - v.antiderivative()(t))
    instance.free()


def test_the_end_of_the_table_is_told_once_and_a_state_goes_on(fmu):
    instance = Instance(fmu)
    instance.initialise(start=0.9)
    state = instance.slave.getFMUState()
    for n in range(4):
        instance.step(0.9 + 0.1 * n, 0.1)
    told = [text for status, text in instance.messages if status == 1]
    assert len(told) == 1
    assert "roof: the table ends at t = 1 s and its last values hold on" in told[0]
    assert instance.get(["base.z", "base.vz"]) == [0.0, 0.0]
    instance.slave.setFMUState(state)
    before = instance["train.x"]
    instance.step(0.9, 0.1)
    assert instance["train.x"] - before == pytest.approx(0.1 * 274.7 / 3.6, rel=1e-3)
    instance.slave.freeFMUState(state)
    instance.free()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--rate", "base.z"], "--rate base.z: write COLUMN=NAME, such as base.z=base.vz"),
        (["--rate", "base.x=v"], "has no column 'base.x'; did you mean 'base.z'?"),
        (["--integral", "base.z=train.vx"], "there is an output 'train.vx' already"),
        (["--rate", "base.z=v", "--interpolation", "held"], "values that are held have none"),
        (["--rate", "base.z=base.z.gain"], "'base.z.gain' is the name of a parameter of the FMU"),
        (["--integral", "base.z=a b"], "write COLUMN=NAME"),
        (["--name", "a-b"], "'a-b' is no name for an FMU"),
        (["--time", "tme"], "there is no column 'tme' of times"),
    ],
)
def test_what_cannot_be_made_is_told_in_a_sentence(folder, options, said):
    answer = ask(main, "signal", folder / "roof.csv", *options, "--out", folder / "not")
    assert answer.code == 1
    assert said in answer.err
    assert answer.err.startswith("error: ")
    assert not (folder / "not").exists()


def test_a_jump_where_a_table_begins_again_is_noted(folder):
    answer = ask(main, "signal", folder / "roof.csv", "--repeat", "--name", "again", "--out", folder)
    assert answer.code == 0
    assert "note: train.vx jump where the table begins again" in answer.err


SSD = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
    xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" version="1.0" name="carried">
  <ssd:System name="carried"><ssd:Elements>{elements}</ssd:Elements>
    <ssd:Connections>{wires}</ssd:Connections></ssd:System>
  <ssd:Units><ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit>
    <ssc:Unit name="m/s"><ssc:BaseUnit m="1" s="-1"/></ssc:Unit></ssd:Units>
  <ssd:DefaultExperiment startTime="0" stopTime="0.06"/>
</ssd:SystemStructureDescription>
"""
NAMES = {"base.z": "m", "base.vz": "m/s", "train.x": "m", "train.vx": "m/s"}


def _scenario(folder, fmu):
    """Return a scenario of a pantograph that signals carry, under no line."""
    made = folder / "carried.ssp"
    (made / "resources").mkdir(parents=True)
    build(recipe("Pantograph_CX"), made / "resources")
    shutil.copy(fmu, made / "resources")
    port = '<ssd:Connector name="{}" kind="{}"><ssc:Real unit="{}"/></ssd:Connector>'
    whole = '<ssd:Component name="{}" source="resources/{}.fmu" type="application/x-fmu-sharedlibrary">'
    parts = [("roof", fmu.stem, "output"), ("pantograph", "Pantograph_CX", "input")]
    elements = "".join(
        f"{whole.format(name, file)}<ssd:Connectors>{''.join(port.format(n, kind, u) for n, u in NAMES.items())}"
        "</ssd:Connectors></ssd:Component>"
        for name, file, kind in parts
    )
    wire = '<ssd:Connection startElement="roof" startConnector="{0}" endElement="pantograph" endConnector="{0}"/>'
    text = SSD.format(elements=elements, wires="".join(wire.format(n) for n in NAMES))
    (made / "SystemStructure.ssd").write_text(text, encoding="utf-8")
    return made


def test_a_pantograph_is_carried_by_signals_in_a_scenario(folder, fmu, curves):
    """Roof and train as the table says: the run is that of the part itself under the same values."""
    out = folder / "results"
    set_values = ("--set", "pantograph.use_train=1", "--set", "pantograph.start_position=100")
    answer = ask(master, "run", _scenario(folder, fmu), "--out", out, *set_values)
    assert answer.code == 0, answer.err
    run = np.genfromtxt(out / "timeseries.csv", delimiter=",", names=True, deletechars="", replace_space=" ")
    column = {name.split(" [")[0]: run[name] for name in run.dtype.names}
    (z, v), t = curves, column["time"]
    np.testing.assert_allclose(column["pantograph.A.x"] - 100.0, v.antiderivative()(t), atol=1e-6)
    np.testing.assert_allclose(column["roof.base.z"], z(t), atol=1e-10)
    values = {"start_position": 100.0, "use_train": 1}
    part = LumpedPantographPart(load_pantograph("CX").with_values(values))
    inputs = np.stack([column[f"roof.{name}"] for name in NAMES], axis=1)
    part.initialise(0.0, 0.0, np.zeros(3), inputs[0, :2], Drive(train=tuple(inputs[0, 2:])))
    for row, step in zip(inputs[:-1], np.diff(t).tolist(), strict=True):
        part.step(0.0, np.zeros(3), row[:2], step, Drive(train=tuple(row[2:])))
    assert part.strip[0, 0, 2] == pytest.approx(column["pantograph.A.z"][-1], abs=1e-8)
    assert np.ptp(column["pantograph.A.z"]) > 1e-4
