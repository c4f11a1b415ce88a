"""Timing by turns: what is compared is measured in the same run, round after round, and told as ratios."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping


def by_turns(jobs: Mapping[str, Callable[[], None]], rounds: int = 7) -> dict[str, float]:
    """Return the least time of every job over some rounds, in which the jobs take turns [s]."""
    best = dict.fromkeys(jobs, float("inf"))
    for job in jobs.values():
        job()  # warm-up
    for _ in range(rounds):
        for name, job in jobs.items():
            begin = time.perf_counter()
            job()
            best[name] = min(best[name], time.perf_counter() - begin)
    return best


def table(title: str, columns: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    """Print a table with columns as wide as they need."""
    widths = [max(len(row[i]) for row in [columns, *rows]) for i in range(len(columns))]
    print(f"\n{title}")
    for row in [columns, *rows]:
        first, *others = zip(row, widths, strict=True)
        print("  ".join([first[0].ljust(first[1]), *(cell.rjust(width) for cell, width in others)]))
