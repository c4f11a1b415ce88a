"""The packed reference scenario, and runs of it in other tools."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import fmpy
import pytest

from tests import forked_commands
from tests.interop.support import ROOT, ToolRun, run_tool


@pytest.fixture(scope="session")
def packed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """cx_ln2.ssp, as ``python -m master pack`` writes it."""
    archive = tmp_path_factory.mktemp("packed") / "cx_ln2.ssp"
    scenario = ROOT / "ssp_scenarios" / "cx_ln2.ssp"
    done = forked_commands.run("master", "pack", scenario, "--out", archive)
    assert done.returncode == 0, done.stderr
    return archive


@pytest.fixture(scope="session")
def tool_run(packed: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, float], ToolRun]:
    """Function (tool, stop) -> its run of the packed scenario, made once."""
    done: dict[tuple[str, float], ToolRun] = {}

    def run(tool: str, stop: float) -> ToolRun:
        if (tool, stop) not in done:
            out = tmp_path_factory.mktemp(tool) / "force.csv"
            done[tool, stop] = run_tool(tool, packed, stop, out)
        return done[tool, stop]

    return run


@pytest.fixture(scope="session")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The C host, compiled with FMPy's copy of the FMI headers."""
    headers = Path(fmpy.__file__).parent / "c-code"
    program = tmp_path_factory.mktemp("host") / "host"
    source = Path(__file__).parent / "host" / "host.c"
    command = [os.environ.get("CC", "cc"), "-std=gnu11", "-O1", "-Wall", "-Werror", f"-I{headers}", str(source)]
    subprocess.run([*command, "-o", str(program), "-ldl"], check=True)
    return program
