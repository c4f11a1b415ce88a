"""Standalone FMUs: with nothing on the machine but libc, the same bits as the ordinary ones."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from fmus.builder.standalone import runtime_of, write_runtime
from tests.effort import count
from tests.interop.support import STEP
from tests.interop.test_host import host, numbers, plan, plain, pytestmark, run_host, system  # noqa: F401

STEPS = count(60, 300)
#: What every Linux with glibc has; libdl and libpthread are names that older programs ask for.
LIBC = ("libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0", "librt.so.1", "libutil.so.1")
LOADER = Path("/lib64/ld-linux-x86-64.so.2")


def orders(system, unpacked):
    lines = plan(system, unpacked).splitlines()[:-1]
    return "\n".join([*lines, f"run {STEPS} {STEP!r}"]) + "\n"


def in_prison(root):
    """The command that runs another one in a folder as if that were the whole machine; as a user in a namespace."""
    command = ["chroot", str(root)]
    return command if os.geteuid() == 0 else ["unshare", "--user", "--map-root-user", *command]


@pytest.fixture(scope="module")
def bare_machine(tmp_path_factory, host):  # noqa: F811
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
    if subprocess.run([*in_prison(root), "/host"], input="", capture_output=True, text=True, check=False).returncode:
        pytest.skip("neither root's chroot nor a user namespace is to be had here")
    return root


class Elsewhere:
    """An unpacked FMU as it is called inside the bare machine."""

    def __init__(self, name):
        self.name, self.folder = name, Path("/fmus") / name
        self.library = self.folder / "binaries" / "linux64" / f"{name}.so"


def put_into(root, fmus, with_runtime):
    """Unpack FMUs on the bare machine, with a runtime in each as a standalone one has it."""
    shutil.rmtree(root / "fmus", ignore_errors=True)
    for fmu in fmus:
        with zipfile.ZipFile(fmu) as file:
            file.extractall(root / "fmus" / fmu.stem)
        if with_runtime:
            write_runtime(runtime_of(), root / "fmus" / fmu.stem / "resources" / "runtime")
    return [Elsewhere(fmu.stem) for fmu in fmus]


def run_on_bare_machine(root, text, **environment):
    return run_host([*in_prison(root), "/host"], text, **environment)


@pytest.fixture(scope="module")
def ordinary(host, system, plain):  # noqa: F811
    """The numbers of the ordinary FMUs, with the step in numpy: a runtime is without numba."""
    return numbers(
        run_host(host, orders(system, plain), OPENPANTO_PYTHON=sys.executable, OPENPANTO_KERNEL="numpy")
    )


def test_bits_of_the_ordinary_ones_on_a_machine_with_nothing_but_libc(bare_machine, system, ordinary):  # noqa: F811
    there = put_into(bare_machine, [c.fmu.path for c in system.components], with_runtime=True)
    done = run_on_bare_machine(bare_machine, orders(system, there))
    assert numbers(done) == ordinary


def test_one_runtime_beside_the_fmus_serves_both(bare_machine, system, ordinary):  # noqa: F811
    there = put_into(bare_machine, [c.fmu.path for c in system.components], with_runtime=False)
    write_runtime(runtime_of(), bare_machine / "runtime")
    done = run_on_bare_machine(bare_machine, orders(system, there), OPENPANTO_RUNTIME="/runtime")
    assert numbers(done) == ordinary


def test_without_a_runtime_there_is_a_sentence(bare_machine, system):  # noqa: F811
    there = put_into(bare_machine, [c.fmu.path for c in system.components], with_runtime=False)
    done = run_on_bare_machine(bare_machine, orders(system, there))
    assert done.returncode == 1
    assert "no Python 3 found" in done.stderr
