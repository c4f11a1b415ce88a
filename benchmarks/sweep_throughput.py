"""What a sweep gains by a second worker, what a run costs beside its steps, and how large a worker grows.

    python benchmarks/sweep_throughput.py [SCENARIO] [--runs N] [--turns N] [--stop T]

Runs of one scenario that differ in the static force are made by one worker and by two, turn about; both crews stay up
and have made runs before. Throughput is runs in a second of wall time, and so as good as the machine is quiet: beside
it stands the processor time that workers took for a run, which tells whether two hinder each other (caches, memory),
and how much of two cores they got.
"""

from __future__ import annotations

import argparse
import os
import statistics
import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from timing import on_one_thread, table

from master.batch.sweep.dask_engine import DaskEngine
from master.batch.sweep.sweep_engines import MakeRuns
from master.batch.sweep.sweep_plan import SweepRequest
from master.batch.sweep.sweep_run import RunPlace, SweepResult
from master.batch.sweep.sweep_session import PreparedSweep
from master.batch.sweep.swept_systems import SweepRun
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides

#: Static forces of the runs: about that of the scenario, each another one [N].
FIRST, SPREAD = 160.0, 20.0


@dataclass(frozen=True)
class Turn:
    """What a crew took for its runs.

    Attributes
    ----------
    wall, processor : float
        Time of all runs [s].
    results : tuple of SweepResult
    """

    wall: float
    processor: float
    results: tuple[SweepResult, ...]


def main() -> None:
    on_one_thread()
    options = _options()
    crews: dict[str, list[Turn]] = {"1 worker": [], "2 workers": []}
    with ExitStack() as stack:
        found = stack.enter_context(open_scenario(options.scenario, Overrides(may_stop_early=True)))
        prepared = PreparedSweep.of(found.system, _request(options))
        place = RunPlace(Path(stack.enter_context(tempfile.TemporaryDirectory())), "figures")
        engines = {name: DaskEngine(jobs=jobs, renew_after=1_000_000) for jobs, name in enumerate(crews, 1)}
        makers = {name: stack.enter_context(e.opened(prepared.base, place)) for name, e in engines.items()}
        for make in makers.values():
            turn(make, prepared.outcome.runs, "warm")
        for number in range(options.turns):
            for name, make in makers.items():
                crews[name].append(turn(make, prepared.outcome.runs, str(number)))
    report(crews, options.runs)


def _request(options: argparse.Namespace) -> SweepRequest:
    forces = ",".join(f"{FIRST + SPREAD * i / options.runs:.9g}" for i in range(options.runs))
    return SweepRequest.read({"over": {"static_force": f"{forces}N"}, "stop": options.stop})


def turn(make: MakeRuns, runs: Sequence[SweepRun], name: str) -> Turn:
    """Let a crew make its runs, under names of their own."""
    named = [replace(run, key=f"{name}-{run.key}") for run in runs]
    begin, busy = time.monotonic(), _processor_time()
    results = tuple(make(named))
    failed = [r.reason for r in results if r.failed]
    if failed:
        raise SystemExit(failed[0])
    return Turn(time.monotonic() - begin, _processor_time() - busy, results)


def _processor_time() -> float:
    """Return the processor time of all processes that this one has started, workers included (on Linux) [s]."""
    parents, times = {}, {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended meanwhile
            continue
        parents[int(path.parent.name)], times[int(path.parent.name)] = int(fields[1]), int(fields[11]) + int(fields[12])
    ours, found = {os.getpid()}, -1
    while len(ours) != found:
        found = len(ours)
        ours |= {child for child, parent in parents.items() if parent in ours}
    return sum(times.get(process, 0) for process in ours) / os.sysconf("SC_CLK_TCK")


def report(crews: dict[str, list[Turn]], runs: int) -> None:
    """Print the figures of the crews, and the ratios of every turn."""
    rows = []
    for name, turns in crews.items():
        results = [r for t in turns for r in t.results]
        beside = statistics.median(r.seconds - r.stepping for r in results)
        rows.append(
            (
                name,
                f"{max(runs / t.wall for t in turns):.3f}",
                f"{statistics.median(t.processor / runs for t in turns):.2f}",
                f"{statistics.median(t.processor / t.wall for t in turns):.2f}",
                f"{statistics.median(r.stepping for r in results):.2f}",
                f"{beside:.2f}",
                f"{max(r.memory for r in results):.0f}",
            )
        )
    heads = ("runs a second", "processor s a run", "cores", "stepping s", "beside it s", "MB a worker")
    table(f"{runs} runs a turn, {len(crews['1 worker'])} turns", ("", *heads), rows)
    pairs = list(zip(crews["1 worker"], crews["2 workers"], strict=True))
    wall = sorted(one.wall / two.wall for one, two in pairs)
    free = sorted(2.0 * one.processor / two.processor for one, two in pairs)
    table(
        "2 workers against 1",
        ("", "least", "median", "most"),
        [
            ("throughput", *(f"{f(wall):.2f}" for f in (min, statistics.median, max))),
            ("by processor time, two cores to themselves", *(f"{f(free):.2f}" for f in (min, statistics.median, max))),
        ],
    )


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("scenario", nargs="?", type=Path, default=Path("ssp_scenarios/cx_ln2.ssp"))
    parser.add_argument("--runs", type=int, default=8, help="of a turn, default 8")
    parser.add_argument("--turns", type=int, default=3, help="of each crew, default 3")
    parser.add_argument("--stop", type=float, help="of every run [s], default the scenario's own")
    return parser.parse_args()


if __name__ == "__main__":
    main()
