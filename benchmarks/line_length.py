"""How a line's cost grows with its length and with the pantographs on it.

    python benchmarks/line_length.py [--spans 10 20 50 100 200] [--pantographs 1 2 3 4]

A simple line of 50 m spans in LN2's materials under CX pantographs at 300 km/h. Start-up and memory are those of a
process of its own for every length; steps of 1 ms run by turns. Ratios are to the first of each list.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable

from lines import long_line
from timing import by_turns, memory, on_one_thread, table

from master.results.run_summary import peak_memory
from models.catenary.line_model import CatenaryModel
from models.coupled.monolithic import CoupledModel
from models.library.catalogue import load_lumped

STEP = 1e-3
STEPS = 50
#: Where the first pantograph starts, and how far the others are behind it [m].
START, BEHIND = 350.0, 85.0


def main() -> None:
    on_one_thread()
    options = _options()
    if options.alone is not None:
        print(json.dumps(start_up(options.alone)))
        return
    lengths(options.spans)
    pantographs(options.pantographs)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--spans", nargs="+", type=int, default=[10, 20, 50, 100, 200])
    parser.add_argument("--pantographs", nargs="+", type=int, default=[1, 2, 3, 4])
    # The argument of the process that measures one length.
    parser.add_argument("--alone", type=int, help=argparse.SUPPRESS)
    return parser.parse_args()


def coupled(model: CatenaryModel, count: int = 1) -> CoupledModel:
    """Return a line under pantographs, its first step done."""
    places = [START - BEHIND * i for i in range(count)]
    result = CoupledModel(model, [load_lumped("CX").with_values({"start_position": x}) for x in places])
    result.step(STEP, STEP)
    return result


def steps(system: CoupledModel) -> Callable[[], None]:
    """Return a function that runs on."""
    clock = {"n": 1}

    def run() -> None:
        for _ in range(STEPS):
            clock["n"] += 1
            system.step(STEP, clock["n"] * STEP)

    return run


def start_up(spans: int) -> dict[str, float]:
    """Return what building a line takes and what it needs."""
    before = memory()
    begin = time.process_time()
    model = CatenaryModel(long_line(spans))
    built = time.process_time()
    coupled(model)
    first = time.process_time()
    unknowns = int((~model.mesh.fixed).sum())
    grown, peak = memory() - before, peak_memory() - before
    return {"unknowns": unknowns, "build": built - begin, "first": first - built, "memory": grown, "peak": peak}


def _start_up_apart(spans: int) -> dict[str, float]:
    command = [sys.executable, __file__, "--alone", str(spans)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def lengths(spans: list[int]) -> None:
    """Print the cost over the number of spans."""
    alone = {n: _start_up_apart(n) for n in spans}
    best = by_turns({str(n): steps(coupled(CatenaryModel(long_line(n)))) for n in spans})
    each = {n: best[str(n)] / STEPS for n in spans}
    first = spans[0]
    rows = [
        (
            str(n),
            f"{a['unknowns']:.0f}",
            f"{a['build']:.2f}",
            f"{a['build'] / alone[first]['build']:.1f}",
            f"{a['first']:.2f}",
            f"{a['memory']:.0f}",
            f"{a['peak']:.0f}",
            f"{1e3 * each[n]:.3f}",
            f"{each[n] / each[first]:.2f}",
            f"{n / first:.1f}",
        )
        for n, a in alone.items()
    ]
    columns = ("spans", "unknowns", "build s", "ratio", "first step s", "MB", "peak", "ms a step", "ratio", "of spans")
    table("Cost over length", columns, rows)


def pantographs(counts: list[int]) -> None:
    """Print the cost over the number of pantographs."""
    model = CatenaryModel(long_line(20))
    best = by_turns({str(n): steps(coupled(model, n)) for n in counts})
    first = best[str(counts[0])]
    rows = [(name, f"{1e3 * t / STEPS:.3f}", f"{t / first:.2f}") for name, t in best.items()]
    table("Cost over pantographs, 20 spans", ("pantographs", "ms a step", "ratio"), rows)


if __name__ == "__main__":
    main()
