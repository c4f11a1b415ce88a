"""What a step of a run costs side by side with others, against runs of FMUs and runs as one system.

    python benchmarks/lanes.py [--rounds N] [--beside WORKTREE]

The pair of cx_ln2 at 300 km/h. All of them do as many steps of 1 ms in a round, by turns in this process, in contact.
With ``--beside`` whole runs as well, recording included, as a sweep makes them without lanes: here and in another
working tree, say of an earlier commit, each in a process of its own, 100 steps of them in every round.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import whole_run
from timing import on_one_thread, table

from master.coupling.coupling_schemes import initialise, make_algorithm
from master.coupling.network import Network
from master.run_session import connected_fmus
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from models.catenary.line_model import CatenaryModel
from models.coupled.lane_block import LaneBlock
from models.coupled.monolithic import CoupledModel
from models.library.catalogue import load_line, load_lumped

STEP = 1e-3
#: Macro steps of a block in a round, and of a run before the first: the strips are in contact then.
ROUND, SETTLED = 30, 1200
#: Where a strip starts [m], its height [m] and its static force [N].
START, HEIGHT, FORCE = 100.0, 5.06, 157.0
PLACE = Path(__file__).parents[1] / "ssp_scenarios" / "cx_ln2.ssp"


def main() -> None:
    on_one_thread()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--beside", type=Path, metavar="WORKTREE", help="another working tree of the project")
    options = parser.parse_args()
    trees = {}
    if options.beside is not None:
        there = options.beside.resolve()
        trees = {f"whole runs, {there.name}": there, "whole runs, here": whole_run.ROOT}
    model = CatenaryModel(load_line("LN2"))
    block = filled(model)
    steps = ROUND * block.lanes
    with (
        whole_runs(trees, options.rounds) as whole,
        open_scenario(PLACE, Overrides()) as found,
        connected_fmus(found.system) as network,
    ):
        algorithm = make_algorithm(found.system.settings.coupling)
        initialise(network, 0.0, found.system.stop)
        jobs = {
            "FMUs, one run": stepped_fmus(network, algorithm, steps),
            "one system, one run": stepped_system(model, steps),
            f"lanes, {block.lanes} runs": lambda: [block.step() for _ in range(ROUND)] and None,
        }
        each = whole | {name: timed(job, steps) for name, job in jobs.items()}
        times = [{name: turn() for name, turn in each.items()} for _ in range(options.rounds + 1)][1:]
    best = {name: min(row[name] for row in times) for name in each}
    median = {name: sorted(row[name] for row in times)[options.rounds // 2] for name in each}
    first = next(iter(best))
    rows = [
        (name, f"{1e6 * best[name]:.1f}", f"{best[first] / best[name]:.2f}", f"{median[first] / median[name]:.2f}")
        for name in best
    ]
    title = f"A step of one run, least of {options.rounds} rounds; how many more of them a core does in the same time"
    table(title, ("", "us", "as many (least)", "as many (median)"), rows)
    rate = 3600.0 / median[f"lanes, {block.lanes} runs"] / found.system.step_count
    print(f"{rate:.0f} runs of cx_ln2 an hour and core, stepping alone")


def timed(job: Callable[[], None], steps: int) -> Callable[[], float]:
    """Return a function that does a job of so many steps and returns what one took of the processor [s]."""

    def turn() -> float:
        begin = time.process_time()
        job()
        return (time.process_time() - begin) / steps

    return turn


@contextmanager
def whole_runs(trees: Mapping[str, Path], rounds: int) -> Iterator[dict[str, Callable[[], float]]]:
    """Start a run in each working tree; yields functions that let one run on and return what a step of it took [s]."""
    stop = 1e-3 * (whole_run.FIRST + whole_run.BLOCK * (rounds + 2))
    options = argparse.Namespace(scenario="cx_ln2", stop=stop)
    with tempfile.TemporaryDirectory() as folder:
        runs = {name: whole_run._started(tree, options, Path(folder, name), False) for name, tree in trees.items()}
        turns = {name: _turn_of(process) for name, process in runs.items()}
        for turn in turns.values():
            for _ in range(whole_run.FIRST // whole_run.BLOCK):
                turn()
        try:
            yield turns
        finally:
            for process in runs.values():
                process.kill()
                process.wait()


def _turn_of(process: Any) -> Callable[[], float]:
    def turn() -> float:
        process.stdin.write("go\n")
        process.stdin.flush()
        return float(process.stdout.readline()) / whole_run.BLOCK

    return turn


def filled(model: CatenaryModel) -> LaneBlock:
    """Return a block whose lanes all hold a run of other speed, start and force, in contact."""
    block = LaneBlock(model, 1, 0.0, STEP)
    pantograph = load_lumped("CX").with_values({"reference_height": HEIGHT})
    for lane in range(block.lanes):
        values = {"speed": 60.0 + lane, "start_position": START + 20.0 * lane, "static_force": FORCE + lane}
        block.enter(lane, (pantograph.with_values(values),))
    for _ in range(SETTLED):
        block.step()
    return block


def stepped_fmus(network: Network, algorithm: object, steps: int) -> Callable[[], None]:
    """Return a function that lets FMUs run on."""
    clock = {"n": 0}

    def run(count: int = steps) -> None:
        for _ in range(count):
            algorithm.step(network, clock["n"] * STEP, STEP)
            clock["n"] += 1

    run(SETTLED)
    return run


def stepped_system(model: CatenaryModel, steps: int) -> Callable[[], None]:
    """Return a function that lets line and pantograph run on as one system."""
    values = {"start_position": START, "reference_height": HEIGHT, "static_force": FORCE}
    system, clock = CoupledModel(model, [load_lumped("CX").with_values(values)]), {"n": 0}

    def run(count: int = steps) -> None:
        for _ in range(count):
            clock["n"] += 1
            system.step(STEP, clock["n"] * STEP)

    run(SETTLED)
    return run


if __name__ == "__main__":
    main()
