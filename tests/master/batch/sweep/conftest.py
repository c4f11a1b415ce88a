"""Sweeps of the toy scenario, from the command line in a process of its own and from here."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest
from pythonfmu.builder import FmuBuilder

from master.batch.sweep.sweep_engines import HereEngine
from master.batch.sweep.sweep_plan import SweepRequest
from master.batch.sweep.sweep_session import PreparedSweep, sweep
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from tests import forked_commands
from tests.foreign_fmus import component, connector, ssd, system
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
        words = ["sweep", toy, *options, "--out", tmp_path / out, "--no-build", *(["--quiet"] if quiet else [])]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        begun.append(forked_commands.start("master", *words, cwd=tmp_path, env=environment, crew="sweep", **pipes))
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


ISHIGAMI = '''
from math import sin

from pythonfmu import Fmi2Causality as C, Fmi2Slave, Fmi2Variability as V, Real


class Ishigami(Fmi2Slave):
    """sin x1 + 7 sin^2 x2 + 0.1 x3^4 sin x1; none where x1 is greater than fail_above."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.x1 = self.x2 = self.x3 = self.idle = 0.0
        self.fail_above = 10.0
        for name in ("x1", "x2", "x3", "idle", "fail_above"):
            self.register_variable(Real(name, causality=C.parameter, variability=V.tunable))
        self.register_variable(Real("y", causality=C.output, getter=self.value))

    def value(self):
        return sin(self.x1) + 7.0 * sin(self.x2) ** 2 + 0.1 * self.x3**4 * sin(self.x1)

    def do_step(self, time, step):
        if self.x1 > self.fail_above:
            raise RuntimeError("x1 is too great")
        return True
'''


@pytest.fixture(scope="session")
def ishigami_fmu(tmp_path_factory):
    """The Ishigami function as an FMU."""
    folder = tmp_path_factory.mktemp("ishigami")
    (folder / "ishigami.py").write_text(ISHIGAMI)
    FmuBuilder.build_FMU(folder / "ishigami.py", dest=folder)
    return folder / "Ishigami.fmu"


@pytest.fixture
def ishigami(ishigami_fmu, tmp_path):
    """A scenario without a contact: the Ishigami function, one step of it."""
    folder = tmp_path / "ishigami.ssp"
    (folder / "resources").mkdir(parents=True)
    shutil.copy(ishigami_fmu, folder / "resources")
    part = component("f", connector("y", "output"), source="resources/Ishigami.fmu")
    (folder / "SystemStructure.ssd").write_text(ssd(system(part), stop=' stopTime="0.1"'))
    return folder


@pytest.fixture
def ishigami_swept(ishigami, tmp_path):
    """Function that makes a sweep of the Ishigami function; returns the outcome."""

    def made(folder="out", engine=None, tell=lambda _: None, **request):
        with open_scenario(ishigami, Overrides(), build=False) as found:
            prepared = PreparedSweep.of(found.system, SweepRequest.read(request))
            return sweep(prepared, tmp_path / folder, engine or HereEngine(), tell)

    return made
