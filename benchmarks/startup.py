"""What a line needs before its first step: ``python benchmarks/startup.py [--spans 200] [--beside WORKTREE]``.

LN2 and a longer line of its materials, each in a process of its own, phase by phase, as bare model and as FMU. With
``--beside`` whole commands instead, from start to end, by turns with those of another worktree (with its ``.venv``):
every row the least processor time of all processes of a command.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from timing import on_one_thread, table

STEP = 1e-3
#: Runs of each line; the best of every phase counts.
ROUNDS = 3


class Phases:
    """Durations of what is done one after the other [s]."""

    def __init__(self) -> None:
        self.durations: dict[str, float] = {}

    def run(self, name: str, job: Callable):
        """Do a job and note how long it takes."""
        begin = time.process_time()
        result = job()
        self.durations[name] = time.process_time() - begin
        return result


def main() -> None:
    on_one_thread()
    options = _options()
    if options.alone is not None:
        print(json.dumps(model_phases(options.alone) | fmu_phases(options.alone)))
        return
    if options.beside is not None:
        commands_beside(options.beside, options.rounds)
        return
    lines = {"LN2": 0, f"{options.spans} spans": options.spans}
    best = {title: _alone(spans) for title, spans in lines.items()}
    first, second = best.values()
    rows = [(phase, f"{t:.3f}", f"{second[phase]:.3f}", f"{second[phase] / t:.1f}") for phase, t in first.items()]
    table("Start-up", ("phase", *(f"{title} s" for title in best), "ratio"), rows)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--spans", type=int, default=200, help="of the longer line, default 200")
    parser.add_argument("--beside", type=Path, metavar="WORKTREE", help="compare whole commands with those there")
    parser.add_argument("--rounds", type=int, default=5, help="of the commands, default 5")
    # The argument of the process that starts one line; 0 is LN2.
    parser.add_argument("--alone", type=int, help=argparse.SUPPRESS)
    return parser.parse_args()


#: Whole commands, by what they show; a run builds what is stale, which `validate` would build for itself each time.
COMMANDS = {
    "help": ("run", "--help"),
    "run cx_ln2 to 1 ms, no report": ("run", "cx_ln2", "--stop", "0.001", "--quiet", "--no-report"),
    "run cx_ln2, no report": ("run", "cx_ln2", "--quiet", "--no-report"),
    "run cx_ln2": ("run", "cx_ln2", "--quiet"),
    "validate cx_ln2": ("validate", "cx_ln2"),
}


def commands_beside(other: Path, rounds: int) -> None:
    """Print the time of whole commands here and in another worktree, by turns, after one round that warms up."""
    places = (other.resolve(), Path(__file__).resolve().parents[1])
    rows = []
    for title, words in COMMANDS.items():
        times = [[_command(place, words) for place in places] for _ in range(rounds + 1)][1:]
        there, here = (min(column) for column in zip(*times, strict=True))
        rows.append((title, f"{there:.2f}", f"{here:.2f}", f"{here / there:.2f}"))
    table("Whole commands", ("command", f"{other.name} s", "here s", "ratio"), rows)


def _command(place: Path, words: Sequence[str]) -> float:
    """Return the processor time of ``openpanto`` of a worktree and of all that it starts [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        out = ["--out", folder + "/out"] if words[0] == "run" and "--help" not in words else []
        command = [str(place / ".venv/bin/python"), "openpanto.py", *words, *out]
        # Python keeps bytecode, as it does for users: the round that warms up has left it.
        kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
        silent = subprocess.DEVNULL
        subprocess.run(command, cwd=place, check=True, stdout=silent, stderr=silent, env=kept)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _alone(spans: int) -> dict[str, float]:
    command = [sys.executable, __file__, "--alone", str(spans)]
    runs = [
        json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[-1])
        for _ in range(ROUNDS)
    ]
    return {phase: min(run[phase] for run in runs) for phase in runs[0]}


def _file(spans: int, folder: Path) -> Path:
    """Return the definition file of a line; 0 spans are LN2's own."""
    from lines import long_line_file

    from models.library.catalogue import line_path

    if spans == 0:
        return line_path("LN2")
    path = folder / "line.toml"
    path.write_text(long_line_file(spans), encoding="utf-8")
    return path


def model_phases(spans: int) -> dict[str, float]:
    """Return the phases of the bare model [s]; what is imported within them is part of start-up."""
    phases = Phases()
    begin = time.process_time()
    from clocks import Clocks

    import models.catenary.line_model as line
    from models.library.catalogue import load_line

    phases.durations["model: import"] = time.process_time() - begin
    with tempfile.TemporaryDirectory() as folder:
        path = str(_file(spans, Path(folder)))
        definition = phases.run("model: definition", lambda: load_line(path))
    clocks = Clocks()
    with clocks.running({"model: mesh": (line, ("build_mesh",)), "model: form finding": (line, ("kept_form",))}):
        model = phases.run("model: matrices", lambda: line.CatenaryModel(definition))
    phases.durations["model: matrices"] -= sum(clocks.spent.values())
    phases.durations |= clocks.spent
    state = model.initial_state()
    phases.run("model: factorisation, first step", lambda: model.push(state, STEP, ()))
    phases.run("model: second step", lambda: model.push(state, STEP, ()))
    order = ("import", "definition", "mesh", "form finding", "matrices", "factorisation, first step", "second step")
    return {f"model: {name}": phases.durations[f"model: {name}"] for name in order}


def fmu_phases(spans: int) -> dict[str, float]:
    """Return the phases of the FMU [s]; numpy and scipy are loaded already."""
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    from fmus.builder.fmu_build import build
    from fmus.builder.recipe import recipe

    phases = Phases()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wanted = replace(recipe("Catenary_LN2"), definition=_file(spans, folder))
        path = str(phases.run("FMU: build", lambda: build(wanted, folder)))
        unzipped = phases.run("FMU: unzip", lambda: extract(path))
        description = phases.run("FMU: model description", lambda: read_model_description(path))
        slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=unzipped,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="line",
        )
        phases.run("FMU: instantiate", slave.instantiate)
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        phases.run("FMU: initialise", slave.exitInitializationMode)
        phases.run("FMU: first step", lambda: slave.doStep(0.0, STEP))
        phases.run("FMU: second step", lambda: slave.doStep(STEP, STEP))
        slave.terminate()
        slave.freeInstance()
    return phases.durations


if __name__ == "__main__":
    main()
