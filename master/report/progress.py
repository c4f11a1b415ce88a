"""The progress of a run on the terminal: share done, time left, real-time factor and contact force."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from master.arrays import FloatArray
from master.coupling.macro_steps import Observer
from master.coupling.network import Network
from master.system.components import System

#: Steps between looks at the clock, and seconds between updates.
_STEPS: Final = 16
_SECONDS: Final = 0.1
#: Number of forces that fit on the line.
_MOST_FORCES: Final = 3


class ProgressObserver:
    """Observer that shows a progress bar on standard error, in one line of 80 columns."""

    def __init__(self, console: Console, start: float, stop: float) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=14),
            TextColumn("{task.percentage:>3.0f} %, left"),
            TimeRemainingColumn(compact=True),
            TextColumn("real time x {task.fields[factor]:.2f} {task.fields[force]}"),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task: TaskID = self._progress.add_task("starting", total=None, factor=0.0, force="")
        self._start = start
        self._stop = stop
        self._forces: list[int] = []
        self._began = self._seen = time.perf_counter()
        self._progress.start()

    def begin(self, start: float, network: Network) -> None:
        """Start the clock: initialisation is over."""
        self._began = self._seen = time.perf_counter()
        self._forces = [i for i, n in enumerate(network.output_names) if n.endswith("contact.force")]
        self._progress.update(self._task, description="running", total=self._stop - self._start)

    def observe(self, index: int, end: float, network: Network) -> None:
        """Update the bar, but not more often than it can be read."""
        if index % _STEPS:
            return
        now = time.perf_counter()
        if now - self._seen < _SECONDS:
            return
        self._seen = now
        done = end - self._start
        force = force_text(network.outputs[self._forces])
        self._progress.update(self._task, completed=done, factor=done / (now - self._began), force=force)

    def finish(self) -> None:
        """Remove the bar."""
        self._progress.stop()


def force_text(forces: FloatArray) -> str:
    """Return contact forces as a short text.

    Examples
    --------
    >>> import numpy as np
    >>> force_text(np.array([157.26, 98.0]))
    '157 98 N'
    """
    if not len(forces):
        return ""
    more = " .." if len(forces) > _MOST_FORCES else ""
    return " ".join(f"{f:.0f}" for f in forces[:_MOST_FORCES]) + f"{more} N"


@contextmanager
def progress_shown(console: Console, system: System) -> Iterator[Sequence[Observer]]:
    """Yield the observer that shows the progress of a run, and remove the bar afterwards."""
    progress = ProgressObserver(console, system.start, system.stop)
    try:
        yield [progress]
    finally:
        progress.finish()
