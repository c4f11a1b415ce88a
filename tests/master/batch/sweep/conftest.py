"""Sweeps of the toy scenario, from the command line in a process of its own and from here."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from pythonfmu.builder import FmuBuilder

from master.batch.sweep.sweep_engines import HereEngine
from master.batch.sweep.sweep_plan import SweepRequest
from master.batch.sweep.sweep_session import PreparedSweep, sweep
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from tests.master.conftest import CATENARY, SSV, ssd_text

ROOT = Path(__file__).parents[4]
GRID = ("--over", "speed=40,50,60", "--over", "catenary.stiffness=4000:6000:1000")


GRID_REQUEST = {"over": {"speed": "40,50,60", "catenary.stiffness": "4000:6000:1000"}}


@pytest.fixture(scope="session")
def whole_table(toy_fmus, tmp_path_factory):
    """The table of the sweep over GRID that nobody has disturbed."""
    folder = tmp_path_factory.mktemp("whole")
    scenario = folder / "toy.ssp"
    shutil.copytree(toy_fmus, scenario / "resources", ignore=shutil.ignore_patterns("*.py"))
    (scenario / "SystemStructure.ssd").write_text(ssd_text())
    (scenario / "parameters.ssv").write_text(SSV)
    with open_scenario(scenario, Overrides(), build=False) as found:
        sweep(PreparedSweep.of(found.system, SweepRequest.read(GRID_REQUEST)), folder / "out")
    return (folder / "out" / "sweep.csv").read_bytes()


@pytest.fixture
def toy_system(toy):
    """The toy scenario's system."""
    with open_scenario(toy, Overrides(), build=False) as found:
        yield found.system


@pytest.fixture
def swept(toy_system, tmp_path):
    """Function that makes a sweep of the toy scenario in a folder; returns the outcome."""

    def made(folder="out", engine=None, **request):
        prepared = PreparedSweep.of(toy_system, SweepRequest.read(request))
        return sweep(prepared, tmp_path / folder, engine or HereEngine())

    return made


@pytest.fixture
def command(toy, tmp_path):
    """Function that starts ``python -m master sweep`` on the toy scenario; returns the process."""
    begun = []

    def start(*options, out="out", quiet=True):
        words = [
            sys.executable,
            "-m",
            "master",
            "sweep",
            str(toy),
            *options,
            "--out",
            str(tmp_path / out),
            "--no-build",
        ]
        words += ["--quiet"] if quiet else []
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        begun.append(subprocess.Popen(words, cwd=tmp_path, env=environment, **pipes))
        return begun[-1]

    yield start
    for process in begun:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.fixture
def ending_toy(toy, tmp_path):
    """Function that gives the toy scenario a line that does something instead of failing; returns the scenario."""

    def made(instead):
        source = CATENARY.replace('raise RuntimeError("the wire broke at 100 percent load")', instead)
        assert source != CATENARY
        script = tmp_path / "ending_toy.py"
        script.write_text(source)
        shutil.copy(FmuBuilder.build_FMU(script, dest=tmp_path), toy / "resources" / "ToyCatenary.fmu")
        return toy

    return made


@pytest.fixture
def exiting_toy(ending_toy):
    """The toy scenario with a line whose FMU ends its process instead of failing."""
    return ending_toy("import os; os._exit(3)")


def ended(process, seconds=120):
    """Wait for a process; return its exit code and what it wrote to standard error."""
    _, error = process.communicate(timeout=seconds)
    return process.returncode, error


def journal(folder):
    """The finished runs in a sweep's journal."""
    path = folder / "sweep_runs.jsonl"
    lines = path.read_text().splitlines() if path.is_file() else []
    return [json.loads(line) for line in lines]
