"""What contacts, slack droppers and a moving force cost a step of a line, and how near the memory that is.

    python benchmarks/line_contacts.py [LINE] [--before WORKTREE]

Strips that stay in contact run along the line, one to four of them; a force stands where it leaves one dropper slack,
and runs along; nothing of a pantograph is in the times. With ``--before`` the same jobs run in a worktree of another
commit, in a process of its own, by turns. With kernels a last table tells how much a step of the bare line has to move
at least, and at what rate this machine moves as much in a loop of NumPy.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from timing import on_one_thread, table

from models.arrays import FloatArray
from models.catenary.line_model import CatenaryModel
from models.catenary.line_state import StripMotion
from models.library.catalogue import load_line

STEP = 1e-3
#: Steps to a round, and rounds.
STEPS, ROUNDS = 100, 15
#: Speed [m/s], distance between strips [m], how far they press the wire up from its place at rest [m].
SPEED, BEHIND, LIFT = 20.0, 85.0, 0.03
#: Forces that leave no dropper slack, and one [N].
TAUT, SLACK = 60.0, 230.0


def main() -> None:
    on_one_thread()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("line", nargs="?", default="LN2")
    parser.add_argument("--before", type=Path, help="worktree of the commit to compare with")
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    model = CatenaryModel(load_line(options.line))
    steps = jobs(model)
    for job in steps.values():
        job()
    if options.worker:
        answer(steps)
        return
    compare(options, steps)
    if hasattr(model._engine(STEP), "kernels"):
        roofline(model)


def jobs(model: CatenaryModel) -> dict[str, Callable[[], float]]:
    """Return what is measured: functions that do steps, and return what one took [s]."""
    found = {"bare": pushed(model, lambda _: [])}
    middle = 0.5 * sum(model.wires[0].ends)
    found["a force that stands"] = pushed(model, lambda _: [(0, middle, TAUT)])
    found["a force that stands, a dropper slack"] = pushed(model, lambda _: [(0, middle, SLACK)])
    found["a force that moves"] = pushed(model, lambda n: [(0, middle + 300.0 * np.sin(n / 4e3), TAUT)])
    for count in (1, 2, 3, 4):
        found[f"closed contacts: {count}"] = in_contact(model, count)
    return found


def pushed(model: CatenaryModel, forces: Callable[[int], list[tuple[int, float, float]]]) -> Callable[[], float]:
    """Return a function that steps a line under given forces; those of every step are known before its clock runs."""
    state, clock = model.initial_state(), {"n": 0}

    def steps() -> float:
        clock["n"] += STEPS
        given = [forces(n) for n in range(clock["n"], clock["n"] + STEPS)]
        begin = time.process_time()
        for each in given:
            model.push(state, STEP, each)
        return (time.process_time() - begin) / STEPS

    for _ in range(10):
        steps()
    return steps


def in_contact(model: CatenaryModel, count: int) -> Callable[[], float]:
    """Return a function that steps a line under strips that stay in contact."""
    state, clock = model.initial_state(count), {"n": 0}
    first, last = model.wires[0].ends
    wire = model.static.positions[model.mesh.contact_chains()[0].nodes]
    compliance = np.full(count, 2e-5)

    def steps() -> float:
        begin_at, clock["n"] = clock["n"], (clock["n"] + STEPS) % 20000
        motions = [StripMotion(strips(begin_at + n), compliance) for n in range(STEPS)]
        begin = time.process_time()
        for motion in motions:
            result = model.step(state, STEP, motion)
        spent = time.process_time() - begin
        assert (result.force > 0.0).any(axis=1).all(), "a contact has opened"
        return spent / STEPS

    def strips(n: int) -> FloatArray:
        x = first + 0.3 * (last - first) - BEHIND * np.arange(count) + SPEED * STEP * n
        z = np.interp(x, wire[:, 0], wire[:, 2]) + LIFT
        return np.array([[[[a, y, b], [SPEED, 0.0, 0.0]] for y in (0.7, -0.7)] for a, b in zip(x, z, strict=True)])

    return steps


def answer(steps: dict[str, Callable[[], float]]) -> None:
    """Do a job for every name that comes in, and tell what its step took."""
    for name in sys.stdin:
        print(steps[name.strip()](), flush=True)


def compare(options: argparse.Namespace, steps: dict[str, Callable[[], float]]) -> None:
    """Print what the jobs take here and, by turns, in the other worktree."""
    here: dict[str, list[float]] = {name: [] for name in steps}
    before: dict[str, list[float]] = {name: [] for name in steps}
    other = _elsewhere(options) if options.before else None
    for _ in range(ROUNDS):
        for name, job in steps.items():
            here[name].append(job())
            if other is not None:
                assert other.stdin is not None
                assert other.stdout is not None
                print(name, file=other.stdin, flush=True)
                before[name].append(float(other.stdout.readline()))
    if other is not None:
        other.communicate()
    first = min(here["closed contacts: 1"])
    rows = []
    for name, times in here.items():
        best, was = min(times), min(before[name], default=float("nan"))
        rows.append((name, f"{1e6 * best:.1f}", f"{best / first:.2f}", f"{1e6 * was:.1f}", f"{best / was:.3f}"))
    columns = ("", "us a step", "of one contact", "before", "ratio")
    table(f"{options.line}: steps of {1e3 * STEP:g} ms", columns, rows)


def _elsewhere(options: argparse.Namespace) -> subprocess.Popen[str]:
    python = options.before / ".venv" / "bin" / "python"
    command = [str(python if python.exists() else sys.executable), __file__, options.line, "--worker"]
    place = str(options.before.resolve())
    code = "import runpy, sys; sys.path.insert(0, sys.argv.pop(1)); sys.argv = sys.argv[1:]; "
    code += "sys.path.insert(1, sys.argv[0].rpartition('/')[0]); runpy.run_path(sys.argv[0], run_name='__main__')"
    command = [command[0], "-c", code, place, *command[1:]]
    return subprocess.Popen(command, cwd=place, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def roofline(model: CatenaryModel) -> None:
    """Print what a step of the bare line moves at least, how fast, and how fast NumPy moves as much."""
    engine = model._engine(STEP)
    rows, units = engine.kernels.ROWS, engine.units
    moved = {
        "attachments, -2 K and a2 M": engine.lanes.arrays.values.nbytes,
        "attachments, factor, there and back": 2 * engine.lanes.arrays.factor.nbytes,
        "modes, coupling and motion, read": units.table.nbytes,
        "modes, motion, written": units.table.nbytes * 2 // rows,
        "modes, ends": units.arrays.places.nbytes + units.arrays.shares.nbytes,
    }
    whole = sum(moved.values())
    job, third = pushed(model, lambda _: []), [np.ones(whole // 24) for _ in range(3)]
    steps, copies = [], []
    for _ in range(ROUNDS):
        steps.append(job())
        begin = time.process_time()
        for _ in range(STEPS):
            np.add(third[0], third[1], out=third[2])
        copies.append((time.process_time() - begin) / STEPS)
    speed, of_numpy = whole / min(steps), whole / min(copies)
    lines = [(name, f"{size / 1e3:.0f}") for name, size in moved.items()]
    lines += [("in all", f"{whole / 1e3:.0f}"), ("moved by a step [GB/s]", f"{speed / 1e9:.1f}")]
    lines += [("moved by NumPy, c = a + b [GB/s]", f"{of_numpy / 1e9:.1f}"), ("ratio", f"{speed / of_numpy:.2f}")]
    table("What a step of the bare line moves", ("", "kB"), lines)


if __name__ == "__main__":
    main()
