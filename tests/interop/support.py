"""Running the packed scenario in other tools, each in a separate process."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
TOOLS = Path(__file__).parent / "tools"
#: Where CoFmuPy lies: its wheel pins other versions of our packages, and brings packages named ``tests`` and ``docs``.
COFMUPY = ROOT / "build" / "cofmupy"
STEP = 1e-3


@dataclass(frozen=True)
class ToolRun:
    """What a tool made of a scenario: times and forces at the ends of the steps, wall times [s]."""

    time: np.ndarray
    force: np.ndarray
    wall: dict[str, float]


def run_tool(tool: str, archive: Path, stop: float, out: Path, step: float = STEP) -> ToolRun:
    """Run ``tools/run_TOOL.py`` and read what it leaves."""
    command = [sys.executable, str(TOOLS / f"run_{tool}.py"), str(archive), str(stop), str(step), str(out)]
    path = os.pathsep.join([str(ROOT), *([str(COFMUPY)] if tool == "cofmupy" else [])])
    environment = {**os.environ, "PYTHONPATH": path, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=out.parent, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{tool} ended with {done.returncode}:\n{done.stdout[-1000:]}\n{done.stderr[-3000:]}"
    time, force = np.loadtxt(out, delimiter=",", skiprows=1).T
    return ToolRun(time, force, json.loads(done.stdout.strip().splitlines()[-1]))


def require(package: str) -> None:
    """Skip where a tool is not installed; where all must be there (CI says so), fail instead."""
    found = (COFMUPY / package).is_dir() if package == "cofmupy" else importlib.util.find_spec(package) is not None
    if found:
        return
    text = f"{package} is not installed; docs/interoperability.md says how"
    if os.environ.get("OPENPANTO_INTEROP") == "required":
        pytest.fail(text)
    pytest.skip(text)
