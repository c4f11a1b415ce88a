"""The package as it is installed, and FMUs that go from one version of Python to another."""

from __future__ import annotations

import csv
import os
import shutil
import subprocess
import sys
import zipfile
from itertools import product
from pathlib import Path

import pytest

from tests.interop.support import ROOT

VERSIONS = ("3.11", "3.12", "3.13")
#: Largest difference of a contact force between versions [N].
TOLERANCE = 1e-9
RUNNER = ROOT / "tests" / "interop" / "tools" / "run_ours.py"
_WHEEL = "import sys; from setuptools.build_meta import build_wheel; print(build_wheel(sys.argv[1]))"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel, built of what a checkout holds."""
    source, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    ignore = shutil.ignore_patterns("__pycache__", "*.so", "resources")
    for name in ("models", "fmus", "master", "ssp_scenarios"):
        shutil.copytree(ROOT / name, source / name, ignore=ignore)
    for name in ("setup.py", "pyproject.toml", "README.md", "LICENSE", "openpanto.py"):
        if (ROOT / name).is_file():
            shutil.copy(ROOT / name, source / name)
    _python(sys.executable, "-m", "venv", out / "env", cwd=out)
    python = out / "env" / "bin" / "python"
    _python(python, "-m", "pip", "install", "-q", "setuptools>=77.0.3", cwd=out)
    done = _python(python, "-c", _WHEEL, out, cwd=source)
    return out / done.stdout.split()[-1]


def _python(executable, *words, cwd, path="", check=True):
    environment = {**os.environ, "PYTHONPATH": str(path), "OMP_NUM_THREADS": "1"}
    command = [str(executable), *map(str, words)]
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0 or not check, f"{command}: {done.stdout[-2000:]} {done.stderr[-3000:]}"
    return done


@pytest.mark.long
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the loader is for Linux")
def test_the_wheel_brings_the_loader_and_says_what_it_runs_on(wheel):
    assert wheel.name.endswith("-py3-none-manylinux_2_17_x86_64.whl")
    with zipfile.ZipFile(wheel) as file:
        assert sum(n.startswith("fmus/loader/loader-linux64-") and n.endswith(".so") for n in file.namelist()) == 1


@pytest.mark.long
@pytest.mark.parametrize("what", ["Pantograph_CX", "Catenary_LN2_P2", "own"])
def test_a_definition_has_one_guid_and_its_licence_wherever_the_package_lies(wheel, tmp_path, what):
    installed, elsewhere = tmp_path / "installed", tmp_path / "elsewhere"
    elsewhere.mkdir()
    with zipfile.ZipFile(wheel) as file:
        file.extractall(installed)
    if what == "own":
        what = elsewhere / "Mine.toml"
        shutil.copy(ROOT / "models" / "library" / "lines" / "C270.toml", what)
    fmus = []
    for place in (ROOT, installed):
        said = _python(sys.executable, "-m", "fmus", "fingerprint", what, cwd=elsewhere, path=place).stdout
        built = _python(sys.executable, "-m", "fmus", "build", what, "--out", place.name, cwd=elsewhere, path=place)
        fmus.append((said.strip(), (elsewhere / built.stdout.strip()).read_bytes()))
        with zipfile.ZipFile(elsewhere / built.stdout.strip()) as file:
            for name, text in (("openpanto", b"MIT License"), ("pythonfmu", b"MIT License")):
                assert text in file.read(f"documentation/licenses/{name}.txt")
            assert said.strip() in file.read("modelDescription.xml").decode()
    assert fmus[0][0] == fmus[1][0]


def _base_interpreter(version):
    """Return an interpreter that answers, and can make environments: one on PATH may be pyenv's stand-in for none."""
    places = sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python"), reverse=True)
    for place in (shutil.which(f"python{version}"), *places):
        if place and _python(place, "-c", "import ensurepip, venv", cwd=Path.home(), check=False).returncode == 0:
            return str(place)
    return None


@pytest.fixture(scope="module")
def interpreters(wheel, tmp_path_factory):
    """Version -> an interpreter of it with the package installed: one found ready, or a new environment."""
    ready = dict(pair.split("=", 1) for pair in os.environ.get("OPENPANTO_PYTHONS", "").split(":") if "=" in pair)
    made = {}
    for version in VERSIONS:
        base = ready.get(version) or _base_interpreter(version)
        if base is None:
            print(f"Python {version} is not on this machine")
            continue
        folder = tmp_path_factory.mktemp(f"python{version}") / "env"
        options = ["--system-site-packages", "--without-pip"] if version in ready else []
        _python(base, "-m", "venv", *options, folder, cwd=folder.parent)
        made[version] = _installed(folder, wheel, Path(base) if version in ready else None)
    return made


def _installed(folder, wheel, base):
    """Install the wheel into an environment; into one on top of a ready one without pip, its packages linked."""
    python = folder / "bin" / "python"
    if base is None:
        _python(python, "-m", "pip", "install", "-q", wheel, cwd=folder)
        return python
    show = "import sysconfig; print(sysconfig.get_path('purelib'))"
    own = Path(_python(python, "-c", show, cwd=folder).stdout.strip())
    places = "import sys; print(*(p for p in sys.path if p.endswith('site-packages')), sep='\\n')"
    (own / "base.pth").write_text(_python(base, "-c", places, cwd=folder).stdout)
    with zipfile.ZipFile(wheel) as file:
        file.extractall(own)
    return python


@pytest.mark.long
def test_fmus_of_every_version_run_on_every_version(interpreters, tmp_path):
    if len(interpreters) < 2:
        pytest.skip(f"only Python {', '.join(interpreters) or 'none'} is here, of {', '.join(VERSIONS)}")
    forces = {}
    for builder in interpreters:
        scenario = tmp_path / builder / "cx_ln2.ssp"
        shutil.copytree(ROOT / "ssp_scenarios" / "cx_ln2.ssp", scenario, ignore=shutil.ignore_patterns("resources"))
        shutil.rmtree(scenario / "resources", ignore_errors=True)
        words = ["-m", "master", "pack", scenario, "--out", _packed(tmp_path, builder)]
        _python(interpreters[builder], *words, cwd=tmp_path)
    for builder, runner in product(interpreters, interpreters):
        out = tmp_path / f"{builder}-{runner}.csv"
        # With all digits: those of a recording end at the tenth, 1e-7 N.
        _python(interpreters[runner], RUNNER, _packed(tmp_path, builder), "0.5", "0.001", out, cwd=tmp_path)
        forces[builder, runner] = _forces(out)
    first = next(iter(forces.values()))
    assert max(first) > 50.0
    for pair, values in forces.items():
        worst = max(abs(a - b) for a, b in zip(first, values, strict=True))
        print(f"built on {pair[0]}, run on {pair[1]}: {worst:.3g} N")
        assert worst <= TOLERANCE, pair


def _forces(path):
    with path.open(encoding="utf-8") as file:
        return [float(row["force"]) for row in csv.DictReader(file)]


def _packed(folder, builder):
    return folder / f"built_on_{builder}.ssp"
