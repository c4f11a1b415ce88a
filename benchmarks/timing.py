"""Timing by turns: what is compared is measured in the same run, round after round, and given as ratios.

Jobs run within this process, on one thread, so it is processor time that counts: what other programs take of a busy
machine does not.
"""

from __future__ import annotations

import os
import resource
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

#: What a table may take where no terminal says how wide it is.
_WIDTH = 160


def on_one_thread() -> None:
    """Restart the script with one BLAS thread, unless it runs so already: libraries read that when they load."""
    if os.environ.get("OMP_NUM_THREADS") != "1":
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], environment)


def rounds_of(jobs: Mapping[str, Callable[[], None]], rounds: int) -> dict[str, list[float]]:
    """Return the time of every job in every round, after one that warms up; in a round the jobs take turns [s]."""
    times: dict[str, list[float]] = {name: [] for name in jobs}
    for job in jobs.values():
        job()
    for _ in range(rounds):
        for name, job in jobs.items():
            begin = time.process_time()
            job()
            times[name].append(time.process_time() - begin)
    return times


def by_turns(jobs: Mapping[str, Callable[[], None]], rounds: int = 7) -> dict[str, float]:
    """Return the least time of every job over some rounds, in which the jobs take turns [s]."""
    return {name: min(times) for name, times in rounds_of(jobs, rounds).items()}


def memory() -> float:
    """Return what the process has in memory at present [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 2**20


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table: text in the first column, figures in the others."""
    result = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    for index, column in enumerate(columns):
        result.add_column(column, justify="left" if index == 0 else "right", no_wrap=True)
    for row in rows:
        result.add_row(*row)
    Console(width=None if sys.stdout.isatty() else _WIDTH, markup=False, highlight=False).print(result)
