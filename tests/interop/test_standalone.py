"""Standalone FMUs: on a machine with nothing but libc, the same bits as the ordinary ones."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from fmus.__main__ import main
from fmus.builder.fmu_build import build
from fmus.builder.recipe import recipe
from fmus.builder.standalone_fmu import bundled_platform, runtime_of, write_runtime
from master.scenario.open_scenario import open_scenario
from tests.effort import IS_LONG, count
from tests.interop.support import ROOT, STEP
from tests.interop.test_host import linux, numbers, plan, run_host, unpack

pytestmark = linux
STEPS = count(30, 300)
#: What every Linux with glibc has; libdl and libpthread are names that older programs ask for.
LIBC = ("libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0", "librt.so.1", "libutil.so.1")
LOADER = Path("/lib64/ld-linux-x86-64.so.2")
#: The line with a lumped pantograph, and with one in the multibody code, which uses more of LAPACK.
SCENARIOS = ["cx_ln2", "cx_multibody_ln2"] if IS_LONG else ["cx_ln2"]


def orders(system, unpacked):
    lines = plan(system, unpacked).splitlines()[:-1]
    return "\n".join([*lines, f"run {STEPS} {STEP!r}"]) + "\n"


def in_prison(root):
    """The command that runs another one in a folder as if that were the whole machine; as a user in a namespace."""
    command = [shutil.which("chroot", path="/usr/sbin:/usr/bin:/sbin:/bin") or "chroot", str(root)]
    return command if os.geteuid() == 0 else ["unshare", "--user", "--map-root-user", *command]


@pytest.fixture(scope="module")
def bare_machine(tmp_path_factory, host):
    """A folder with libc and the host, and nothing else."""
    root = tmp_path_factory.mktemp("machine")
    folder = root / "lib" / "x86_64-linux-gnu"
    for place in (folder, root / "lib64", root / "tmp"):
        place.mkdir(parents=True)
    shutil.copy(LOADER, root / "lib64")
    where = subprocess.run(["ldd", host], capture_output=True, text=True, check=True).stdout
    libc = next(Path(line.split()[2]) for line in where.splitlines() if "libc.so.6" in line).parent
    for name in LIBC:
        shutil.copy(libc / name, folder)
    shutil.copy(host, root / "host")
    if run_host([*in_prison(root), "/host"], "").returncode:
        pytest.skip("neither root's chroot nor a user namespace is to be had here")
    return root


class Elsewhere:
    """An unpacked FMU as it is called inside the bare machine."""

    def __init__(self, name):
        self.name, self.folder = name, Path("/fmus") / name
        self.library = self.folder / "binaries" / "linux64" / f"{name}.so"


def put_into(root, fmus):
    """Unpack FMUs on the bare machine."""
    shutil.rmtree(root / "fmus", ignore_errors=True)
    for fmu in fmus:
        with zipfile.ZipFile(fmu) as file:
            file.extractall(root / "fmus" / fmu.stem)
    return [Elsewhere(fmu.stem) for fmu in fmus]


@pytest.fixture(scope="module", params=SCENARIOS)
def system(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenario") / f"{request.param}.ssp"
    shutil.copytree(ROOT / "ssp_scenarios" / folder.name, folder, ignore=shutil.ignore_patterns("*.fmu"))
    with open_scenario(folder) as scenario:
        return scenario.system


def compressed_less(patch, kind, level=None):
    """Let archives be written fast; in `.ci/long` they are written as they are by users."""
    write = zipfile.ZipFile.writestr
    if not IS_LONG:
        patch.setattr(
            zipfile.ZipFile,
            "writestr",
            lambda self, name, data, wanted=None, _=None: write(self, name, data, wanted and kind, wanted and level),
        )


@pytest.fixture(scope="module")
def standalone(system, tmp_path_factory):
    """The scenario's FMUs, each with its own Python."""
    folder, (line, pantograph) = tmp_path_factory.mktemp("standalone"), (c.fmu.path.stem for c in system.components)
    with pytest.MonkeyPatch.context() as patch:
        compressed_less(patch, zipfile.ZIP_STORED)
        first = build(recipe(line), folder, runtime=runtime_of(None).files)
    with pytest.MonkeyPatch.context() as patch:
        compressed_less(patch, zipfile.ZIP_DEFLATED, 6)  # its size is tested: one of level 9 is smaller
        return [first, build(recipe(pantograph), folder, runtime=runtime_of(None).files)]


@pytest.fixture(scope="module")
def ordinary(host, system, tmp_path_factory):
    """The numbers of the ordinary FMUs, with the step in numpy: a runtime has no numba."""
    folder = tmp_path_factory.mktemp("ordinary")
    text = orders(system, [unpack(c.fmu.path, folder) for c in system.components])
    return numbers(run_host(host, text, OPENPANTO_PYTHON=sys.executable, OPENPANTO_KERNEL="numpy"))


def test_bits_of_the_ordinary_ones_on_a_machine_with_nothing_but_libc(bare_machine, system, standalone, ordinary):
    there = put_into(bare_machine, standalone)
    assert numbers(run_host([*in_prison(bare_machine), "/host"], orders(system, there))) == ordinary


@pytest.fixture(scope="module")
def shared_runtime(bare_machine):
    """The Python that several FMUs share, on the bare machine."""
    return write_runtime(runtime_of(None), bare_machine / "runtime")


def test_one_runtime_beside_the_fmus_serves_both(bare_machine, shared_runtime, system, ordinary):
    there = put_into(bare_machine, [c.fmu.path for c in system.components])
    command = [*in_prison(bare_machine), "/host"]
    assert numbers(run_host(command, orders(system, there), OPENPANTO_RUNTIME="/runtime")) == ordinary


def test_without_a_runtime_there_is_a_sentence(bare_machine, system):
    there = put_into(bare_machine, [c.fmu.path for c in system.components])
    done = run_host([*in_prison(bare_machine), "/host"], orders(system, there))
    assert done.returncode == 1
    assert "no Python 3 found" in done.stderr


@pytest.mark.parametrize(
    ("lack", "text"),
    [
        ("lib/libz.so.1", "the Python that came with the FMU is incomplete"),
        (f"lib/python{sys.version_info.major}{sys.version_info.minor}.zip", "Python does not start"),
        ("packages/scipy", "lacks the package scipy"),
        ("runtime.txt", "which holds no runtime.txt"),
    ],
)
def test_an_incomplete_runtime_is_one_sentence(bare_machine, shared_runtime, system, tmp_path, lack, text):
    there = put_into(bare_machine, [c.fmu.path for c in system.components])
    lacking = shared_runtime / lack
    shutil.move(lacking, tmp_path / "away")
    done = run_host([*in_prison(bare_machine), "/host"], orders(system, there), OPENPANTO_RUNTIME="/runtime")
    shutil.move(tmp_path / "away", lacking)
    assert done.returncode == 1
    assert text in done.stderr


def test_what_replaces_a_standalone_fmu_is_standalone(standalone, tmp_path, capsys, monkeypatch):
    compressed_less(monkeypatch, zipfile.ZIP_STORED)
    fmu = Path(shutil.copy(standalone[1], tmp_path))
    assert main(["build", fmu.stem, "--out", str(tmp_path)]) == 0
    assert bundled_platform(fmu) == "linux64"
    assert main(["build", fmu.stem, "--out", str(tmp_path), "--no-standalone"]) == 0
    assert bundled_platform(fmu) == ""
    assert capsys.readouterr().err == ""


def test_a_runtime_is_small_and_carries_the_licences_of_all_it_holds(standalone):
    files = runtime_of(None).files
    assert standalone[1].stat().st_size < 21e6
    texts = {name.removeprefix("licences/"): data for name, data in files.items() if name.startswith("licences/")}
    assert {"python.txt", "numpy-LICENSE.txt", "scipy-LICENSE.txt"} <= texts.keys()
    everything = b"".join(texts.values())
    for words in (b"PYTHON SOFTWARE FOUNDATION", b"GCC RUNTIME LIBRARY EXCEPTION", b"GNU LESSER GENERAL", b"OpenBLAS"):
        assert words in everything
    bundled = [name for name in files if name.startswith("lib/lib")]
    assert {name.split("/")[1].split(".")[0].split("-")[0] for name in bundled} >= {"libffi", "libz", "libstdc++"}
    assert not any("_hashlib" in name or "_ssl" in name for name in files)
