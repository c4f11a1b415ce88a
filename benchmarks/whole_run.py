"""What a macro step of a whole run costs, and on what: ``python benchmarks/whole_run.py [--beside WORKTREE]``.

A run as ``openpanto run`` makes it, recording and all observers included, without its start and its report. With
``--beside`` the same run in another working tree of the project, say of an earlier commit: both take turns, block by
block, and the ratio is that of the processor time of this one to that of the other. The shares are measured in a run of
their own, by clocks, which take a few microseconds of a step themselves.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from timing import on_one_thread, table

ROOT = Path(__file__).resolve().parents[1]
#: Macro steps of a turn, and those at the beginning of a run that do not count: raising, first visits.
BLOCK = 100
FIRST = 500
PARTS = ("line: kernels", "line: Python", "line: part and adapter", "pantograph", "master")


def main() -> None:
    options = _options()
    if options.child:
        run_in_turns(options)
        return
    on_one_thread()
    trees = {"this": ROOT, **({"other": options.beside.resolve()} if options.beside else {})}
    blocks = taking_turns(trees, options, with_clocks=False)
    each = {name: [1e6 * row[0] / BLOCK for row in rows] for name, rows in blocks.items()}
    columns = ("", "us a macro step", "times real time", "this / other", "median of the blocks' ratios")
    rows = []
    for name, values in each.items():
        mean = sum(values) / len(values)
        ratios = [a / b for a, b in zip(each["this"], values, strict=True)]
        whole = sum(each["this"]) / sum(values)
        rows.append((name, f"{mean:.1f}", f"{1e3 / mean:.2f}", f"{whole:.3f}", f"{median(ratios):.3f}"))
    table(f"{options.scenario}, {options.stop:g} s: a macro step", columns, rows)
    show_shares(taking_turns(trees, options, with_clocks=True))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("scenario", nargs="?", default="cx_ln2", help="scenario of the library, default cx_ln2")
    parser.add_argument("--beside", type=Path, metavar="WORKTREE", help="another working tree of the project")
    parser.add_argument("--stop", type=float, default=3.0, help="simulated time [s], default 3")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--clocks", action="store_true", help=argparse.SUPPRESS)
    return parser.parse_args()


def taking_turns(trees: Mapping[str, Path], options: argparse.Namespace, with_clocks: bool) -> dict[str, list[Any]]:
    """Return for every tree what each block took: processor time, or medians of its steps if there are clocks [s]."""
    blocks: dict[str, list[Any]] = {name: [] for name in trees}
    with tempfile.TemporaryDirectory() as folder:
        runs = {name: _started(tree, options, Path(folder) / name, with_clocks) for name, tree in trees.items()}
        open_ones = dict(runs)
        while open_ones:
            for name, process in list(open_ones.items()):
                process.stdin.write("go\n")
                process.stdin.flush()
                said = process.stdout.readline()
                if not said or said == "end\n":
                    del open_ones[name]
                else:
                    blocks[name].append([float(word) for word in said.split()])
        for name, process in runs.items():
            process.stdin.close()
            if process.wait() != 0:
                raise SystemExit(f"the run in {trees[name]} failed")
    skipped = FIRST // BLOCK
    return {name: rows[skipped:] for name, rows in blocks.items()}


def _started(tree: Path, options: argparse.Namespace, folder: Path, with_clocks: bool) -> Any:
    command = [sys.executable, __file__, options.scenario, "--stop", str(options.stop), "--child", str(folder)]
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    return subprocess.Popen(
        command + ["--clocks"] * with_clocks,
        cwd=tree,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def show_shares(blocks: Mapping[str, Sequence[Sequence[float]]]) -> None:
    """Print what a macro step is spent on in each tree."""
    means = {}
    for name, of_blocks in blocks.items():
        medians = [1e6 * median(column) for column in zip(*of_blocks, strict=True)]
        whole, kernels, line, line_fmu, pantographs = medians
        means[name] = (kernels, line - kernels, line_fmu - line, pantographs, whole - line_fmu - pantographs)
    mine, last = means["this"], means[list(means)[-1]]
    rows = [
        (part, *(f"{values[i]:.1f}" for values in means.values()), f"{mine[i] / last[i]:.2f}" if last[i] else "")
        for i, part in enumerate(PARTS)
    ]
    table("What it is spent on, with clocks", ("", *(f"{name}, us" for name in means), "this / last"), rows)


def run_in_turns(options: argparse.Namespace) -> None:
    """Run the scenario in the tree that is first on the path, a block for every line of the standard input."""
    from master.run_session import run
    from master.scenario.open_scenario import open_scenario
    from master.scenario.overrides import Overrides

    overrides = Overrides(options.stop, may_stop_early=True)
    with open_scenario(Path(options.scenario), overrides) as scenario:
        sys.stdin.readline()
        run(scenario.system, options.child, [_Turns(options.clocks)])
    print("end", flush=True)


class _Turns:
    """Observer that tells after every block what it took, and waits for the next turn."""

    def __init__(self, with_clocks: bool) -> None:
        self._clocks = _Clocks() if with_clocks else None
        self._begin = 0.0
        self._steps: list[list[float]] = []

    def begin(self, start: float, network: Any) -> None:
        """Set the clocks."""
        if self._clocks is not None:
            self._clocks.set(network)
        self._start()

    def observe(self, index: int, end: float, network: Any) -> None:
        """Hand over after the last step of a block."""
        if self._clocks is not None:
            self._steps.append(self._clocks.read())
        if index % BLOCK:
            return
        if self._clocks is None:
            print(time.process_time() - self._begin, flush=True)
        else:  # by the wall: what other programs take of a few steps does not move the median
            print(*map(median, zip(*self._steps, strict=True)), flush=True)
        sys.stdin.readline()
        self._start()

    def finish(self) -> None:
        """Nothing to close."""

    def _start(self) -> None:
        self._steps.clear()
        if self._clocks is not None:
            self._clocks.read()
        self._begin = time.process_time()


class _Clocks:
    """Clocks around the FMUs, the line in its FMU and its kernels; by the wall, which is read faster."""

    def __init__(self) -> None:
        self._spent = {"kernels": 0.0, "line": 0.0}
        self._before = (0.0, 0.0, 0.0)
        self._slaves: list[Any] = []

    def set(self, network: Any) -> None:
        """Put the clocks in place: the FMUs are loaded and have stepped once."""
        self._slaves = list(network.slaves)
        for name, module in list(sys.modules.items()):
            if name.endswith("models.catenary.line_model") and name.startswith("openpanto_"):
                module.CatenaryModel.step = self._around("line", module.CatenaryModel.step)
            elif name.startswith("openpanto_kernels"):
                for kernel, value in list(vars(module).items()):
                    if hasattr(value, "py_func"):
                        setattr(module, kernel, self._around("kernels", value))

    def read(self) -> list[float]:
        """Return the time since the last call, and of it in kernels, in the line, in its FMU and in all others [s]."""
        now = time.perf_counter()
        lines = sum(s.stepping_time for s in self._slaves if s.name.startswith("catenary"))
        others = sum(s.stepping_time for s in self._slaves if not s.name.startswith("catenary"))
        whole, of_lines, of_others = (a - b for a, b in zip((now, lines, others), self._before, strict=True))
        found = [whole, self._spent["kernels"], self._spent["line"], of_lines, of_others]
        self._spent.update(kernels=0.0, line=0.0)
        self._before = now, lines, others
        return found

    def _around(self, part: str, function: Callable[..., Any]) -> Callable[..., Any]:
        spent, clock = self._spent, time.perf_counter

        def clocked(*arguments: Any) -> Any:
            begin = clock()
            try:
                return function(*arguments)
            finally:
                spent[part] += clock() - begin

        return clocked


if __name__ == "__main__":
    main()
