"""Progress of a run on the terminal: share done, time left, real-time factor."""

from __future__ import annotations

import time
from typing import Final

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from master.network import Network

#: Steps between looks at the clock, and seconds between updates.
_STEPS: Final = 16
_SECONDS: Final = 0.1


class ProgressObserver:
    """Observer that draws a progress bar on standard error."""

    def __init__(self, console: Console, start: float, stop: float) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=28),
            TextColumn("{task.percentage:>3.0f} %"),
            TextColumn("left"),
            TimeRemainingColumn(),
            TextColumn("real time x {task.fields[factor]:.2f}"),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task: TaskID = self._progress.add_task("initializing", total=None, factor=0.0)
        self._start = start
        self._stop = stop
        self._began = self._seen = time.perf_counter()
        self._progress.start()

    def begin(self, start: float, network: Network) -> None:
        """Initialization is over."""
        self._began = self._seen = time.perf_counter()
        self._progress.update(self._task, description="running", total=self._stop - self._start)

    def observe(self, index: int, end: float, network: Network) -> None:
        """Update now and then."""
        if index % _STEPS:
            return
        now = time.perf_counter()
        if now - self._seen < _SECONDS:
            return
        self._seen = now
        done = end - self._start
        self._progress.update(self._task, completed=done, factor=done / (now - self._began))

    def finish(self) -> None:
        """Take the bar away."""
        self._progress.stop()
