"""How fast the same packed scenario runs in our master, Ecos, libcosim, FMPy and CoFmuPy, side by side.

    python benchmarks/coupling_tools.py [--stop T | --whole] [--rounds N] [--tools TOOL ...] [SCENARIO]

Each tool runs in a process of its own and records the contact force of every step, no more (CoFmuPy and FMPy record all
outputs, they cannot do otherwise). Rounds are interleaved, so that a busy machine slows all of them; the best of each
counts. The contact forces are compared with ours, step by step.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from timing import table

from models.arrays import FloatArray

ROOT = Path(__file__).resolve().parents[1]
TOOLS = ("ours", "ecos", "libcosim", "fmpy", "cofmupy")
RUNNERS = ROOT / "tests" / "interop" / "tools"
STEP = 1e-3


def main() -> None:
    options = _options()
    stop = default_stop(options.scenario) if options.whole else options.stop
    with tempfile.TemporaryDirectory() as folder:
        archive = options.scenario if options.scenario.is_file() else pack(options.scenario, Path(folder))
        best: dict[str, dict[str, float]] = {}
        for _ in range(options.rounds):
            for tool in options.tools:
                measured = measure(tool, archive, stop, Path(folder))
                if measured and measured["stepping"] < best.get(tool, {"stepping": float("inf")})["stepping"]:
                    best[tool] = measured
        forces = {tool: contact_force(Path(folder) / f"{tool}.csv") for tool in best}
    show(best, forces, stop)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("scenario", nargs="?", type=Path, default=ROOT / "ssp_scenarios" / "cx_ln2.ssp")
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--stop", type=float, default=2.0, help="simulated time [s], default 2")
    length.add_argument("--whole", action="store_true", help="simulate as long as the scenario says")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--tools", nargs="+", choices=TOOLS, default=list(TOOLS))
    return parser.parse_args()


def default_stop(scenario: Path) -> float:
    """Return the stop time in the scenario's folder [s]."""
    root = ElementTree.parse(scenario / "SystemStructure.ssd").getroot()
    return next(float(e.attrib["stopTime"]) for e in root.iter() if e.tag.endswith("DefaultExperiment"))


def pack(scenario: Path, folder: Path) -> Path:
    """Write the scenario's archive."""
    archive = folder / scenario.name
    command = [sys.executable, "-m", "master", "pack", str(scenario), "--out", str(archive)]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return archive


def measure(tool: str, archive: Path, stop: float, folder: Path) -> dict[str, float] | None:
    """Return the wall times of a run [s], None (and a message) if the tool is not there or fails."""
    out = folder / f"{tool}.csv"
    command = [sys.executable, str(RUNNERS / f"run_{tool}.py"), str(archive), str(stop), str(STEP), str(out)]
    # CoFmuPy lies apart: it brings packages whose names are ours too.
    path = [str(ROOT), *([str(ROOT / "build" / "cofmupy")] if tool == "cofmupy" else [])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        print(f"{tool}: {(done.stderr.strip().splitlines() or ['failed'])[-1]}", file=sys.stderr)
        return None
    times: dict[str, float] = json.loads(done.stdout.strip().splitlines()[-1])
    return times


def contact_force(file: Path) -> FloatArray:
    """Return the contact force of every step [N], shape (n,)."""
    return np.loadtxt(file, delimiter=",", skiprows=1)[:, 1]


def show(best: dict[str, dict[str, float]], forces: dict[str, FloatArray], stop: float) -> None:
    """Print the table; FMPy initializes within its one call, so its stepping holds both."""
    rows = []
    for tool, times in best.items():
        ratio, difference = "", ""
        if "ours" in best:
            ratio = f"{times['stepping'] / best['ours']['stepping']:.2f}"
            n = min(len(forces[tool]), len(forces["ours"]))
            difference = f"{np.abs(forces[tool][:n] - forces['ours'][:n]).max():.1e}"
        rows.append((tool, f"{times['stepping']:.3f}", f"{stop / times['stepping']:.2f}", ratio, difference))
    columns = ("tool", "stepping s", "times real time", "tool / ours", "largest difference in contact force N")
    table(f"{stop:g} s, the same FMUs, steps of {1e3 * STEP:g} ms", columns, rows)


if __name__ == "__main__":
    main()
