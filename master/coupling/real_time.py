"""Running by the wall clock: each macro step starts on time, and steps that finish late are counted.

The results of step n, from t_n to t_n+1, have to be recorded when the wall clock reaches t_n+1: this is its deadline.
No step is left out and the clock is not reset: after a late step the next ones start at once, until the run has caught
up with the clock.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from master.arrays import FloatArray
from master.coupling.macro_steps import TimeGrid
from master.coupling.network import Network

#: Last stretch before a start that is spent polling the clock instead of sleeping [s].
_WATCHFUL: Final = 2e-4


@dataclass(frozen=True)
class Lateness:
    """How late something was, over all steps [s]; never negative.

    Attributes
    ----------
    mean, percentile_99, maximum : float
    """

    mean: float
    percentile_99: float
    maximum: float


@dataclass(frozen=True)
class Punctuality:
    """How a run kept up with the wall clock.

    Attributes
    ----------
    factor : float
        Simulated seconds per second of wall clock that were wanted.
    steps : int
        Macro steps.
    missed : int
        Steps whose results came after their deadline.
    missed_share : float
        Their share of all steps.
    start_jitter : Lateness
        How much later than planned steps began.
    lateness : Lateness
        By how much results missed their deadline (0 for those in time).
    longest_step, mean_step : float
        Wall time from the beginning of a step until its results were recorded [s].
    """

    factor: float
    steps: int
    missed: int
    missed_share: float
    start_jitter: Lateness
    lateness: Lateness
    longest_step: float
    mean_step: float


class WallClockPacer:
    """Observer that paces a run by the wall clock; it has to be the last one, so that the work of all others counts.

    Python's garbage collector is off while the run is paced: nothing in the loop makes reference cycles.

    Parameters
    ----------
    grid : TimeGrid
        The communication points.
    factor : float
        Simulated seconds per second of wall clock.
    clock, sleep : callable
        Return the time [s]; wait for a number of seconds.
    """

    def __init__(
        self,
        grid: TimeGrid,
        factor: float = 1.0,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._period = grid.step / factor
        self._factor = factor
        self._clock, self._sleep = clock, sleep
        # For each step: how late it began, how long it took, how late it ended. Filled now: no page faults later.
        self._rows: FloatArray = np.full((grid.count - grid.first, 3), np.nan)
        self._count = 0
        self._start = self._began = 0.0
        self._had_collector = self._had_frozen = False

    def begin(self, time: float, network: Network) -> None:
        """Set the clock: the first step begins now."""
        self._had_frozen = gc.get_freeze_count() > 0
        gc.collect()
        gc.freeze()
        self._had_collector = gc.isenabled()
        gc.disable()
        self._start = self._began = self._clock()

    def observe(self, index: int, time: float, network: Network) -> None:
        """Record when the step's results were ready, and wait for the start of the next one."""
        done = self._clock()
        planned = self._start + self._count * self._period
        deadline = planned + self._period
        self._rows[self._count] = self._began - planned, done - self._began, done - deadline
        self._count += 1
        self._wait(deadline)

    def finish(self) -> None:
        """Turn the garbage collector on again, for all objects unless the process keeps some from it itself."""
        if self._had_collector:
            gc.enable()
        if not self._had_frozen:
            gc.unfreeze()

    @property
    def punctuality(self) -> Punctuality | None:
        """How the run kept up, None if there was no step."""
        if self._count == 0:
            return None
        jitter, duration, late = self._rows[: self._count].T
        missed = int(np.count_nonzero(late > 0.0))
        return Punctuality(
            self._factor,
            self._count,
            missed,
            missed / self._count,
            _lateness(jitter),
            _lateness(late),
            float(duration.max()),
            float(duration.mean()),
        )

    def _wait(self, until: float) -> None:
        now = self._clock()
        if until - now > _WATCHFUL:
            self._sleep(until - now - _WATCHFUL)
            now = self._clock()
        while now < until:
            now = self._clock()
        self._began = now


def _lateness(values: FloatArray) -> Lateness:
    late = np.maximum(values, 0.0)
    return Lateness(float(late.mean()), float(np.percentile(late, 99.0)), float(late.max()))
