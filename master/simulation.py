"""The loop over macro steps: time, observers, checks of exchanged values, interruption."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Literal, Protocol

import numpy as np

from master.algorithm import Algorithm, initialise
from master.arrays import FloatArray
from master.errors import MasterError, RunError
from master.network import Network

Status = Literal["complete", "interrupted", "failed"]


class Observer(Protocol):
    """Looks on; outside the loop's logic."""

    def begin(self, time: float, network: Network) -> None:
        """After initialization, at the start time."""

    def observe(self, index: int, time: float, network: Network) -> None:
        """At the end of macro step ``index`` (1, 2, ...), at its end time."""

    def finish(self) -> None:
        """When the run has ended, however it ended."""


@dataclass(frozen=True)
class TimeGrid:
    """Communication points t_n = start + n step, never summed up; a run goes from ``first`` to ``count``."""

    start: float
    step: float
    count: int
    first: int = 0

    def time(self, index: int) -> float:
        """Return t_n."""
        return self.start + index * self.step

    @property
    def begin(self) -> float:
        """Return the communication point that the run begins with."""
        return self.time(self.first)

    @property
    def stop(self) -> float:
        """Return the last communication point."""
        return self.time(self.count)


@dataclass(frozen=True)
class Outcome:
    """How a run ended.

    Attributes
    ----------
    status : str
        complete, interrupted or failed.
    steps : int
        Completed macro steps.
    time : float
        Time reached [s].
    error : MasterError, optional
        Why it failed.
    """

    status: Status
    steps: int
    time: float
    error: MasterError | None = None


def _initialise(network: Network, _algorithm: Algorithm, grid: TimeGrid) -> None:
    initialise(network, grid.start, grid.stop)


def simulate(
    network: Network,
    algorithm: Algorithm,
    grid: TimeGrid,
    observers: Sequence[Observer] = (),
    stop_wanted: Callable[[], bool] = lambda: False,
    prepare: Callable[[Network, Algorithm, TimeGrid], None] = _initialise,
) -> Outcome:
    """Initialise (or otherwise prepare) and step the network over the grid.

    A failure does not raise: it ends the run, and the outcome carries it, so that what was computed is kept.
    """
    index = grid.first
    try:
        prepare(network, algorithm, grid)
        check_finite(network, grid.begin, None)
        for observer in observers:
            observer.begin(grid.begin, network)
        previous = network.outputs.copy()
        for index in range(grid.first, grid.count):
            if stop_wanted():
                return Outcome("interrupted", index, grid.time(index))
            _advance(network, algorithm, grid, index, observers, previous)
    except MasterError as error:
        return Outcome("failed", index, grid.time(index), error)
    finally:
        for observer in observers:
            observer.finish()
    return Outcome("complete", grid.count, grid.stop)


def _advance(
    network: Network,
    algorithm: Algorithm,
    grid: TimeGrid,
    index: int,
    observers: Sequence[Observer],
    previous: FloatArray,
) -> None:
    algorithm.step(network, grid.time(index), grid.step)
    end = grid.time(index + 1)
    if not np.isfinite(network.outputs).all():
        check_finite(network, end, previous)
    previous[:] = network.outputs
    for observer in observers:
        observer.observe(index + 1, end, network)


def check_finite(network: Network, time: float, last_good: FloatArray | None) -> None:
    """Refuse exchanged values that are not finite.

    Raises
    ------
    RunError
        Naming the variable, the time and its last good value.
    """
    bad = np.flatnonzero(~np.isfinite(network.outputs))
    if bad.size == 0:
        return
    first = int(bad[0])
    good = "" if last_good is None else f"; its last good value was {last_good[first]:.6g}"
    more = f" (and {bad.size - 1} more variables)" if bad.size > 1 else ""
    raise RunError(
        f"'{network.output_names[first]}' became {network.outputs[first]} at t = {time:.6g} s{more}{good}. "
        f"{_remarks(network) or 'Try a smaller --step, and check the parameters'}"
    )


def _remarks(network: Network) -> str:
    """Return what the slaves themselves have said."""
    said = ((slave.name, slave.remark()) for slave in network.slaves)
    return "; ".join(f"component '{name}' says: {text}" for name, text in said if text)


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Turn Ctrl-C and SIGTERM into a wish to stop after the current step; a second one stops at once."""
    wished = threading.Event()

    def handle(number: int, _frame: FrameType | None) -> None:
        if wished.is_set():
            signal.default_int_handler(number, _frame)
        wished.set()

    if threading.current_thread() is not threading.main_thread():
        yield wished.is_set
        return
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, handle) for number in numbers]
    try:
        yield wished.is_set
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
