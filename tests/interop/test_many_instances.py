"""A thousand instances of an FMU in one process: none crashes, and none leaves anything behind that adds up."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmus.builder.fmu_build import build
from fmus.builder.recipe import recipe
from master.fmu.extraction import ExtractedFmu
from master.fmu.fmu_description import read_fmu
from master.fmu.instance import Instance
from master.system.components import Component
from tests.effort import count
from tests.fmus.support import short_line_recipe
from tests.interop.support import ROOT

SCRIPT = Path(__file__).with_name("many_instances.py")
only_linux = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


def many(fmu, number, warm_up, folder):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "TMPDIR": str(folder)}
    command = [sys.executable, str(SCRIPT), str(fmu), str(number), str(warm_up)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stderr == ""
    return json.loads(done.stdout)


@only_linux
@pytest.mark.slow
def test_many_pantographs(tmp_path):
    """Each would cost 290 kB if the library were loaded again every time, 7 kB if the class were made again."""
    (tmp_path / "unpacked").mkdir()
    # Many before it counts: Python's memory grows in pieces, the longer the fewer, more so beside numba's.
    fmu = build(recipe("Pantograph_CX"), tmp_path)
    found = many(fmu, count(500, 3000), count(400, 2000), tmp_path / "unpacked")
    assert found["after"] == found["before"]
    assert found["left"] < 5.0
    assert list((tmp_path / "unpacked").iterdir()) == []


@only_linux
@pytest.mark.slow
def test_many_lines(tmp_path):
    """Each holds some 5 MB while it is there."""
    found = many(build(short_line_recipe(tmp_path), tmp_path), count(20, 120), count(10, 15), tmp_path)
    assert found["after"] == found["before"]
    assert found["left"] < 200.0


@pytest.fixture(scope="module")
def pantograph(tmp_path_factory):
    return read_fmu(build(recipe("Pantograph_CX"), tmp_path_factory.mktemp("fmu")))


def folder_of(instance):
    return Path(instance._extracted.folder)


def test_an_unpacked_fmu_serves_one_instance_at_a_time(pantograph):
    component = Component("part", pantograph, {}, (), ())
    first, second = Instance(component), Instance(component)
    places = folder_of(first), folder_of(second)
    assert places[0] != places[1]
    first.close()
    first.close()  # once more gives nothing back twice
    third, fourth = Instance(component), Instance(component)
    assert folder_of(third) == places[0]
    assert len({folder_of(i) for i in (second, third, fourth)}) == 3
    for instance in (second, third, fourth):
        instance.close()


def test_a_file_that_has_changed_is_unpacked_again(pantograph):
    component = Component("part", pantograph, {}, (), ())
    first = Instance(component)
    first.close()
    os.utime(pantograph.path)
    second = Instance(component)
    assert folder_of(second) != folder_of(first)
    second.close()


def test_the_next_instance_knows_nothing_of_the_last(pantograph):
    outputs = tuple(n for n, v in pantograph.variables.items() if v.causality == "output")
    rows = []
    for force in (100.0, 170.0, 100.0):
        component = Component("part", pantograph, {"static_force": force}, (), outputs)
        instance, values = Instance(component), np.zeros(len(outputs))
        instance.bind(np.zeros(0), values)
        instance.start(0.0, 1.0)
        instance.finish_initialisation()
        for n in range(20):
            instance.step(n * 1e-3, 1e-3)
        instance.read()
        rows.append(values.tolist())
        instance.close()
    assert rows[0] == rows[2] != rows[1]


def test_the_folder_of_a_library_that_is_gone_is_removed(pantograph, tmp_path):
    copy = shutil.copy(pantograph.path, tmp_path)
    unpacked = ExtractedFmu(replace(pantograph, path=Path(copy)))  # its library was never loaded
    assert Path(unpacked.folder).is_dir()
    unpacked.release()
    assert not Path(unpacked.folder).exists()
