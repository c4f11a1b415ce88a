"""What a step of a run costs side by side with others, against runs of FMUs and runs as one system.

    python benchmarks/lanes.py [--rounds N]

The pair of cx_ln2 at 300 km/h. All of them do as many steps of 1 ms in a round, by turns in this process, in contact.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from timing import on_one_thread, rounds_of, table

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
    options = parser.parse_args()
    model = CatenaryModel(load_line("LN2"))
    block = filled(model)
    steps = ROUND * block.lanes
    with open_scenario(PLACE, Overrides()) as found, connected_fmus(found.system) as network:
        algorithm = make_algorithm(found.system.settings.coupling)
        initialise(network, 0.0, found.system.stop)
        jobs = {
            "FMUs, one run": stepped_fmus(network, algorithm, steps),
            "one system, one run": stepped_system(model, steps),
            f"lanes, {block.lanes} runs": lambda: [block.step() for _ in range(ROUND)] and None,
        }
        times = rounds_of(jobs, options.rounds)
    best = {name: min(found) / steps for name, found in times.items()}
    median = {name: sorted(found)[len(found) // 2] / steps for name, found in times.items()}
    first = next(iter(best))
    rows = [
        (name, f"{1e6 * best[name]:.1f}", f"{best[first] / best[name]:.2f}", f"{median[first] / median[name]:.2f}")
        for name in best
    ]
    title = f"A step of one run, least of {options.rounds} rounds; how many more of them a core does in the same time"
    table(title, ("", "us", "as many (least)", "as many (median)"), rows)
    rate = 3600.0 / median[f"lanes, {block.lanes} runs"] / found.system.step_count
    print(f"{rate:.0f} runs of cx_ln2 an hour and core, stepping alone")


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
