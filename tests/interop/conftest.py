"""The packed reference scenario, and runs of it in other tools."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.interop.support import ROOT, ToolRun, run_tool


@pytest.fixture(scope="session")
def packed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """cx_ln2.ssp, as ``python -m master pack`` writes it."""
    archive = tmp_path_factory.mktemp("packed") / "cx_ln2.ssp"
    scenario = ROOT / "ssp_scenarios" / "cx_ln2.ssp"
    command = [sys.executable, "-m", "master", "pack", str(scenario), "--out", str(archive)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
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
