"""Small systems with FMUs in C: the values that our master gives are those of other tools."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from master.run_session import run
from master.scenario.open_scenario import open_scenario
from master.ssp.pack import pack
from tests.foreign_fmus import (
    compile_library,
    component,
    connector,
    description,
    ssd,
    system,
    values,
    wire,
    write_fmu,
)  # fmt: skip
from tests.interop.support import ROOT, require

TOOLS = Path(__file__).parent / "tools"
T, U, X, Y = (connector(n, kind) for n, kind in (("t", "output"), ("u", "input"), ("x", "output"), ("y", "output")))
GAIN = values(("k", 'Real value="3"'))


def chain():
    """t -> 3 t -> x' = 3 t - x with the factor 2 and the offset -1 of a connection."""
    elements = component("clock", T) + component("gain", U, Y, bindings=GAIN) + component("lag", U, X)
    linear = '<ssc:LinearTransformation factor="2" offset="-1"/>'
    return system(elements, wire("clock.t", "gain.u") + wire("gain.y", "lag.u", linear)), (
        "gain::y::Real", "lag::x::Real",
    )  # fmt: skip


def whole_numbers():
    """An Integer and a Boolean handed on twice."""
    ends = [connector(n, kind, what) for what, names in (("Integer", ("i_in", "i_out")), ("Boolean", ("b_in", "b_out")))
            for n, kind in zip(names, ("input", "output"), strict=True)]  # fmt: skip
    first = values(("i_in", 'Integer value="5"'), ("i_set", 'Integer value="2"'), ("b_in", 'Boolean value="true"'))
    elements = component("one", *ends, bindings=first) + component("two", *ends) + component("three", *ends)
    wires = "".join(wire(f"{a}.{k}_out", f"{b}.{k}_in") for a, b in (("one", "two"), ("two", "three")) for k in "ib")
    return system(elements, wires), ("three::i_out::Integer", "three::b_out::Boolean")


def open_input():
    """An input that nothing feeds, with a value of the scenario, and one with that of its FMU."""
    given = values(("u", 'Real value="4"'), ("k", 'Real value="3"'))
    return system(component("given", U, Y, bindings=given) + component("own", U, Y)), ("given::y::Real", "own::y::Real")


@pytest.mark.parametrize("tool", ["ecos", "libcosim"])
@pytest.mark.parametrize("make", [chain, whole_numbers, open_input])
def test_other_tools_give_the_same_values(tool, make, tmp_path):
    require({"ecos": "ecospy", "libcosim": "libcosimpy"}[tool])
    folder = tmp_path / "small.ssp"
    inside, names = make()
    write_fmu(folder / "resources/panel.fmu", compile_library(tmp_path), description())
    (folder / "SystemStructure.ssd").write_text(ssd(inside))
    with open_scenario(folder, build=False) as scenario:
        recording = run(scenario.system, tmp_path / "out").recordings[0]
    ours = np.column_stack([recording[".".join(name.split("::")[:2])][1:] for name in names])
    archive, out = pack(folder, tmp_path / "packed" / "small.ssp"), tmp_path / "values.csv"
    command = [sys.executable, TOOLS / "run_values.py", tool, archive, "0.1", "10", out, *names]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    options = {"env": environment, "cwd": tmp_path, "capture_output": True, "text": True, "check": False}
    done = subprocess.run([*map(str, command)], **options)
    assert done.returncode == 0, done.stdout[-500:] + done.stderr[-2000:]
    theirs = np.loadtxt(out, delimiter=",", ndmin=2)
    assert ours == pytest.approx(theirs, rel=1e-9, abs=1e-12)
    assert np.ptp(ours, axis=0).max() > 0 or make is not chain
