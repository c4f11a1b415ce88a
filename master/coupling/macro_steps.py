"""The loop over macro steps: time, observers, checks of exchanged values."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from master.arrays import FloatArray
from master.coupling.coupling_schemes import Algorithm, initialise
from master.coupling.network import Network
from master.errors import MasterError, RunError
from master.safety.interruption import interruptible_at_once
from master.safety.supervision import phase

Status = Literal["complete", "interrupted", "failed", "incomplete"]


class Observer(Protocol):
    """Watches the loop from outside."""

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
class RunOutcome:
    """How a run ended.

    Attributes
    ----------
    status : str
        complete, interrupted, failed, or incomplete: it reached its end, which is not enough to judge it.
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
) -> RunOutcome:
    """Initialise (or otherwise prepare) and step the network over the grid.

    A failure does not raise: it ends the run, and the outcome carries it, so that what was computed is kept.
    """
    try:
        outcome = _run(network, algorithm, grid, observers, stop_wanted, prepare)
    finally:
        failure = _finish(observers)
    if failure is not None and outcome.error is None:
        return RunOutcome("failed", outcome.steps, outcome.time, failure)
    return outcome


def _run(
    network: Network,
    algorithm: Algorithm,
    grid: TimeGrid,
    observers: Sequence[Observer],
    stop_wanted: Callable[[], bool],
    prepare: Callable[[Network, Algorithm, TimeGrid], None],
) -> RunOutcome:
    index = grid.first
    try:
        with phase("loading"), interruptible_at_once():
            prepare(network, algorithm, grid)
        check_finite(network, grid.begin, None)
        check_inputs(network, grid.begin, None)
        for observer in observers:
            observer.begin(grid.begin, network)
        previous, observed = network.outputs.copy(), [observer.observe for observer in observers]
        with phase("stepping"):
            for index in range(grid.first, grid.count):
                if stop_wanted():
                    return RunOutcome("interrupted", index, grid.time(index))
                _advance(network, algorithm, grid, index, observed, previous)
    except KeyboardInterrupt:
        return RunOutcome("interrupted", index, grid.time(index))
    except MasterError as error:
        # An FMU in Python reports the interruption as if it had failed itself.
        if stop_wanted():
            return RunOutcome("interrupted", index, grid.time(index))
        return RunOutcome("failed", index, grid.time(index), error)
    return RunOutcome("complete", grid.count, grid.stop)


def _finish(observers: Sequence[Observer]) -> MasterError | None:
    """Finish every observer, also after one that fails; return the first failure."""
    first = None
    for observer in observers:
        try:
            observer.finish()
        except MasterError as error:
            first = first or error
    return first


def _advance(
    network: Network,
    algorithm: Algorithm,
    grid: TimeGrid,
    index: int,
    observed: Sequence[Callable[[int, float, Network], None]],
    previous: FloatArray,
) -> None:
    algorithm.step(network, grid.time(index), grid.step)
    end = grid.time(index + 1)
    # Cheap enough for every step: the sum is not finite if a value is not (or if they are too large to be added).
    if not math.isfinite(sum(network.outputs.tolist())):
        check_finite(network, end, previous)
    if not network.is_plain:
        check_inputs(network, end, previous)
    previous[:] = network.outputs
    for observe in observed:
        observe(index + 1, end, network)


def check_finite(network: Network, time: float, last_good: FloatArray | None) -> None:
    """Refuse exchanged values that are not finite.

    Raises
    ------
    RunError
        Naming the variable, the time and its last good value.
    """
    found = _not_finite(network.output_names, network.outputs, last_good, time)
    said = _remarks(network) if found else ""
    if said and last_good is None:
        raise RunError(f"the run cannot begin: {said}")
    if found:
        raise RunError(f"{found}. {said or 'Try a smaller --step, and check the parameters'}")


def check_inputs(network: Network, time: float, last_good: FloatArray | None) -> None:
    """Refuse finite outputs that the conversion of a connection turns into values that are not.

    Parameters
    ----------
    last_good : ndarray, shape (n_outputs,), optional
        The outputs of the step before.

    Raises
    ------
    RunError
        Naming the input, the time and its last good value.
    """
    before = None if last_good is None else network.converted(last_good)
    found = _not_finite(network.input_names, network.converted(network.outputs), before, time)
    if found:
        raise RunError(f"{found}. Check the factor and the offset of its connection")


def _not_finite(names: Sequence[str], values: FloatArray, last_good: FloatArray | None, time: float) -> str:
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size == 0:
        return ""
    first = int(bad[0])
    good = "" if last_good is None else f"; its last good value was {last_good[first]:.6g}"
    more = f" (and {bad.size - 1} more variables)" if bad.size > 1 else ""
    return f"'{names[first]}' became {values[first]} at t = {time:.6g} s{more}{good}"


def _remarks(network: Network) -> str:
    """Return what the slaves themselves have reported."""
    said = ((slave.name, slave.remark()) for slave in network.slaves)
    return "; ".join(f"component '{name}' says: {text}" for name, text in said if text)
