"""A host in plain C: what a tool does that is not Python, and the same numbers as in Python, bit for bit."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from dataclasses import dataclass
from pathlib import Path

import fmpy
import pytest

from fmus.builder.fmu_build import build
from fmus.builder.recipe import recipe
from fmus.loader.loader_build import INNER_SUFFIX
from master.run_session import connected_fmus
from master.scenario.open_scenario import open_scenario
from master.ssp.archive import extract
from tests.effort import rest
from tests.interop.support import STEP

linux = pytest.mark.skipif(
    not sys.platform.startswith("linux") or shutil.which(os.environ.get("CC", "cc")) is None,
    reason="needs Linux and a C compiler (set CC, or install gcc)",
)
pytestmark = linux
STEPS = 200
EXCHANGES = 6
FORCE = "pantograph[1].contact.force"
LIBPYTHON = Path(sysconfig.get_config_var("LIBDIR") or "") / (sysconfig.get_config_var("INSTSONAME") or "none")


@dataclass(frozen=True)
class Unpacked:
    """An FMU as a tool unpacks it."""

    folder: Path
    name: str
    fmu: Path

    @property
    def library(self):
        return self.folder / "binaries" / "linux64" / f"{self.name}.so"

    @property
    def guid(self):
        return fmpy.read_model_description(str(self.fmu)).guid

    @property
    def references(self):
        return {v.name: v.valueReference for v in fmpy.read_model_description(str(self.fmu)).modelVariables}


@pytest.fixture(scope="module")
def system(packed, tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenario")
    extract(packed, folder)
    with open_scenario(folder, build=False) as scenario:
        return scenario.system


def unpack(fmu, folder):
    with zipfile.ZipFile(fmu) as file:
        file.extractall(folder / fmu.stem)
    return Unpacked(folder / fmu.stem, fmu.stem, fmu)


@pytest.fixture(scope="module")
def unpacked(system, tmp_path_factory):
    """The scenario's FMUs, unpacked."""
    folder = tmp_path_factory.mktemp("unpacked")
    return [unpack(c.fmu.path, folder) for c in system.components]


@pytest.fixture(scope="module")
def stock(system, tmp_path_factory):
    """The same FMUs with pythonfmu's library alone."""
    built, folder = tmp_path_factory.mktemp("built"), tmp_path_factory.mktemp("stock")
    return [unpack(build(recipe(c.fmu.path.stem), built, loader=False), folder) for c in system.components]


def order(*words):
    """An order of the host with words that may hold blanks."""
    return "\x01".join(map(str, words))


def plan(system, unpacked):
    """The host's orders."""
    pairs = zip(unpacked, system.components, strict=True)
    lines = [order("fmu", u.library, c.fmu.guid, f"file://{u.folder}/resources") for u, c in pairs]
    names = [c.name for c in system.components]
    variables = [c.fmu.variables for c in system.components]
    for i, component in enumerate(system.components):
        lines += [f"parameter {i} {variables[i][n].reference} {v!r}" for n, v in component.parameters.items()]
    for c in system.connections:
        i, j = names.index(c.source), names.index(c.target)
        lines.append(f"connect {i} {variables[i][c.output].reference} {j} {variables[j][c.input].reference}")
    for i, component in enumerate(system.components):
        lines += [f"observe {i} {variables[i][name].reference}" for name in component.outputs]
    return "\n".join([*lines, f"run {STEPS} {STEP!r}"]) + "\n"


@pytest.fixture(scope="module")
def in_python(system):
    """The numbers that the host is to find, from FMPy."""
    with connected_fmus(system) as network:
        for slave in network.slaves:
            slave.start(0.0, STEPS * STEP)
        for _ in range(EXCHANGES):
            network.read()
            network.gather()
            network.write()
        for slave in network.slaves:
            slave.finish_initialisation()
        values = []
        for n in range(STEPS):
            network.read()
            network.gather()
            network.write()
            for slave in network.slaves:
                slave.step(n * STEP, STEP)
            network.read()
            values += network.outputs.tolist()
        force = network.output_names.index(f"catenary.{FORCE}")
        assert max(values[force :: len(network.output_names)]) > 50.0
    return values


def run_host(host, orders, **environment):
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL_ENV", "LD_"))}
    clean |= {"OMP_NUM_THREADS": "1", "PATH": "/usr/bin:/bin", **environment}
    done = subprocess.run(host, input=os.fsencode(orders), env=clean, capture_output=True, check=False)
    said = done.stderr.decode("utf-8", "backslashreplace")
    return subprocess.CompletedProcess(done.args, done.returncode, done.stdout.decode(), said)


def numbers(done):
    assert done.returncode == 0, f"ended with {done.returncode}: {done.stderr[-3000:]}"
    assert done.stderr.count("same bits:") == 6
    return [float.fromhex(line) for line in done.stdout.split()]


def test_bits_as_in_python(host, system, unpacked, in_python):
    """Nothing is preloaded, PATH does not lead to this Python: one variable names it. The host stays as it was."""
    assert all(u.library.with_suffix(INNER_SUFFIX).is_file() for u in unpacked)
    done = run_host(host, plan(system, unpacked), OPENPANTO_PYTHON=sys.executable, HOST_STAYS="1", LC_ALL="C.UTF-8")
    assert numbers(done) == in_python


def test_bits_as_in_python_with_python_on_path(host, system, unpacked, in_python):
    done = run_host(host, plan(system, unpacked), PATH=f"{Path(sys.executable).parent}:/usr/bin:/bin")
    assert numbers(done) == in_python


@pytest.mark.skipif(not LIBPYTHON.is_file(), reason="this Python has no shared library that could be preloaded")
@pytest.mark.parametrize("which", ["stock", *rest("unpacked")])
def test_bits_as_in_python_with_libpython_preloaded(host, system, request, in_python, which):
    """As FMUs without our loader need it; with it, it does no harm."""
    path = f"{Path(sys.executable).parent}:/usr/bin:/bin"
    orders = plan(system, request.getfixturevalue(which))
    assert numbers(run_host(host, orders, PATH=path, LD_PRELOAD=str(LIBPYTHON))) == in_python


@pytest.mark.parametrize(
    ("python", "text"),
    [("/nowhere/python3", "no Python 3 found"), ("BARE", "lacks the packages numpy and scipy")],
)
def test_the_loader_says_what_is_missing(host, system, unpacked, tmp_path, python, text):
    if python == "BARE":
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(tmp_path / "bare")], check=True)
        python = str(tmp_path / "bare" / "bin" / "python")
    done = run_host(host, plan(system, unpacked), OPENPANTO_PYTHON=python)
    assert done.returncode == 1
    assert text in done.stderr
    assert "cannot be instantiated" in done.stderr


_IN_PYTHON = """
import sys, fmpy
for path in sys.argv[1:]:
    rows = fmpy.simulate_fmu(path, stop_time=0.05, step_size=1e-3, output_interval=1e-3)
    print([float(v) for v in rows[-1]])
"""


def test_the_loader_keeps_out_of_the_way_where_the_host_is_python(system, tmp_path):
    pantograph = system.components[1].fmu.path
    stock = build(recipe(pantograph.stem), tmp_path, loader=False)
    command = [sys.executable, "-c", _IN_PYTHON, str(pantograph), str(stock)]
    environment = {**os.environ, "OPENPANTO_PYTHON": "/nowhere/python3"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    one, other = done.stdout.splitlines()
    assert one == other
    assert "nan" not in one
