"""Do the scenarios of the library give the same contact forces as an earlier commit?

    python benchmarks/library_series.py WORKTREE [SCENARIO ...] [--runs FOLDER]

Every scenario is run here and in another working tree (with its ``.venv``), whole, as a user runs it, and the largest
difference of its contact forces is printed, over all steps and contacts. A recorded force has ten digits: one above
100 N is told in steps of 1e-7 N. Where forces differ by more than one such step, the scenario is run twice more in the
other tree with the start of its first pantograph moved to and fro by 1e-15 of its value: forces that this moves as much
differ because the case amplifies rounding, not because the commits differ. Runs are kept in ``--runs`` and not made
again.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from timing import table

from master.arrays import FloatArray
from master.recording.recording import Recording, load

ROOT = Path(__file__).resolve().parents[1]
#: One step of a recorded force, and some room for what subtraction makes of it [N].
ROUNDING = 1.01e-7
#: By which shares of its value a start is moved.
MOVES = (1e-15, -1e-15)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("other", type=Path, metavar="WORKTREE")
    parser.add_argument("scenarios", nargs="*", help="default: all of the library that both have")
    parser.add_argument("--runs", type=Path, help="folder that keeps the runs")
    parser.add_argument("--jobs", type=int, default=1, help="scenarios at a time")
    options = parser.parse_args()
    names = options.scenarios or scenarios(options.other)
    with tempfile.TemporaryDirectory() as scratch:
        runs = (options.runs or Path(scratch)).resolve()
        with ThreadPoolExecutor(options.jobs) as pool:
            rows = list(pool.map(lambda name: row(name, options.other.resolve(), runs), names))
    columns = ("scenario", "largest difference N", "beyond 1e-7 N from s", "start moved: N", "from s")
    table(f"Contact forces here and in {options.other.name}", columns, rows)


def scenarios(other: Path) -> list[str]:
    """Return the names of the library's scenarios that both trees have."""
    here, there = ({path.stem for path in (tree / "ssp_scenarios").glob("*.ssp")} for tree in (ROOT, other))
    return sorted(here & there)


def row(name: str, other: Path, runs: Path) -> tuple[str, ...]:
    """Run a scenario and return what is printed of it."""
    here, there = made(ROOT, name, runs / "here" / name), made(other, name, runs / "there" / name)
    difference, begin = compared(here, there)
    if difference <= ROUNDING:
        return name, f"{difference:.1e}", "", "", ""
    pantograph = contacts(there)[0]["pantograph"]
    start = float(recorded(there)[f"{pantograph}.A.x"][0])
    moved = []
    for share in MOVES:
        setting = f"{pantograph}.start_position={start * (1.0 + share)!r}"
        moved.append(compared(there, made(other, name, runs / f"moved{share:+.0e}" / name, setting)))
    return name, f"{difference:.1e}", f"{begin:.2f}", *_words(*max(moved))


def _words(difference: float, begin: float) -> tuple[str, str]:
    return f"{difference:.1e}", f"{begin:.2f}"


def made(tree: Path, name: str, folder: Path, setting: str = "") -> Path:
    """Run a scenario in a tree, unless its results are there; return their folder."""
    if not (folder / "summary.json").is_file():
        command = [str(tree / ".venv/bin/python"), "openpanto.py", "run", name, "--quiet", "--no-report"]
        command += ["--out", str(folder), *(["--set", setting] if setting else [])]
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        subprocess.run(command, cwd=tree, check=True, env=environment, stdout=subprocess.DEVNULL)
    return folder


def contacts(folder: Path) -> list[dict[str, str]]:
    """Return the contacts of a run."""
    found: list[dict[str, str]] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["contacts"]
    return found


def recorded(folder: Path) -> Recording:
    """Return the time series of a run."""
    return load(folder / "timeseries.csv")


def compared(one: Path, other: Path) -> tuple[float, float]:
    """Return by how much contact forces differ at most [N], and when they begin to differ by more than rounding [s]."""
    series = [recorded(folder) for folder in (one, other)]
    forces: list[FloatArray] = [
        np.stack([each[f"{contact['prefix']}.force"] for contact in contacts(one)], axis=1) for each in series
    ]
    by_step = np.abs(forces[0] - forces[1]).max(axis=1)
    beyond = np.flatnonzero(by_step > ROUNDING)
    return float(by_step.max()), float(series[0].time[beyond[0]]) if len(beyond) else float("nan")


if __name__ == "__main__":
    main()
