"""Coupling schemes: which slave receives what, and when, within a macro step.

To add one, write a class with ``name`` and ``step`` and put it into `_SCHEMES`, its name into
``master.ssp.run_settings.Scheme`` and its options into ``OPTIONS`` there: `tests/test_registries.py` walks all three.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, Protocol

import numpy as np

from master.arrays import FloatArray
from master.coupling.network import Network
from master.errors import RunError
from master.ssp.run_settings import Coupling

#: Exchanges at the start before the values must be consistent, and their relative tolerance.
MAX_INITIAL_EXCHANGES: Final = 50
INITIAL_TOLERANCE: Final = 1e-10
#: Magnitude below which an exchanged value's changes are not taken relative to itself (m, m/s or N).
_LEAST_SCALE: Final = 1e-3


class Algorithm(Protocol):
    """A coupling scheme."""

    name: str

    def step(self, network: Network, time: float, step: float) -> None:
        """Advance all slaves from ``time`` to ``time + step``.

        On entry ``network.outputs`` holds the outputs at ``time``, on return those at ``time + step``;
        ``network.inputs`` holds what the slaves received for this step.
        """

    def save(self) -> FloatArray:
        """Return what the scheme keeps from step to step, as a flat array."""

    def restore(self, memory: FloatArray) -> None:
        """Restore what `save` returned."""


class _Stateless:
    """A scheme that keeps nothing from step to step."""

    def save(self) -> FloatArray:
        """See `Algorithm.save`."""
        return np.zeros(0)

    def restore(self, memory: FloatArray) -> None:
        """See `Algorithm.restore`."""


class Jacobi(_Stateless):
    """All slaves step with the outputs of the beginning of the step; order does not matter."""

    name = "jacobi"

    def step(self, network: Network, time: float, step: float) -> None:
        """See `Algorithm.step`."""
        network.gather()
        network.write()
        for slave in network.slaves:
            slave.step(time, step)
        network.read()


class GaussSeidel(_Stateless):
    """Slaves step one after the other; each receives the latest outputs, also those of the step's end.

    Parameters
    ----------
    order : sequence of str
        Names of the slaves in the order in which they step; empty: as in the network.
    """

    name = "gauss-seidel"

    def __init__(self, order: Sequence[str] = ()) -> None:
        self._order = tuple(order)

    def step(self, network: Network, time: float, step: float) -> None:
        """See `Algorithm.step`."""
        for index in self._indices(network):
            slave = network.slaves[index]
            network.gather_for(index)
            slave.write()
            slave.step(time, step)
            slave.read()

    def _indices(self, network: Network) -> Sequence[int]:
        if not self._order:
            return range(len(network.slaves))
        names = [s.name for s in network.slaves]
        return [names.index(name) for name in self._order]


class Iterative:
    """The step is repeated from restored states until the exchanged values settle: the yardstick.

    The slaves receive the outputs of the step's end (``weight`` 1), as components that recognise such values
    and interpolate need it. For components that simply hold their inputs over the step, ``weight`` 1/2 gives
    them the mean of beginning and end, which makes the converged coupling second order in the step.

    Parameters
    ----------
    tolerance : float
        Largest change of an output between two repetitions, relative to its largest magnitude so far.
    max_iterations : int
        Repetitions before giving up.
    weight : float
        Weight of the step's end in the inputs (the beginning has 1 - weight).
    """

    name = "iterative"

    def __init__(self, tolerance: float = 1e-8, max_iterations: int = 50, weight: float = 1.0) -> None:
        self._tolerance = tolerance
        self._max_iterations = max_iterations
        self._weight = weight
        self._scale: FloatArray | None = None
        self.iterations = 0

    def step(self, network: Network, time: float, step: float) -> None:
        """See `Algorithm.step`."""
        states = [slave.save() for slave in network.slaves]
        try:
            self._iterate(network, states, time, step)
        finally:
            for slave, state in zip(network.slaves, states, strict=True):
                slave.release(state)

    def save(self) -> FloatArray:
        """See `Algorithm.save`."""
        return np.zeros(0) if self._scale is None else self._scale.copy()

    def restore(self, memory: FloatArray) -> None:
        """See `Algorithm.restore`."""
        self._scale = memory.copy() if len(memory) else None

    def _iterate(self, network: Network, states: Sequence[object], time: float, step: float) -> None:
        start = network.outputs.copy()
        end = start.copy()
        for _ in range(self._max_iterations):
            self.iterations += 1
            mean = (1.0 - self._weight) * start + self._weight * end
            network.gather(np.where(network.is_discrete, end, mean))
            self._attempt(network, time, step)
            change = self._change(network.outputs, end)
            if change.max(initial=0.0) <= self._tolerance:
                return
            np.copyto(end, network.outputs)
            for slave, state in zip(network.slaves, states, strict=True):
                slave.restore(state)
        worst = int(np.argmax(change))
        raise RunError(
            f"scheme iterative: '{network.output_names[worst]}' still changes by {change[worst]:.3g} "
            f"(relative) after {self._max_iterations} repetitions of the step at t = {time:.6g} s; "
            "use a smaller --step"
        )

    def _attempt(self, network: Network, time: float, step: float) -> None:
        network.write()
        for slave in network.slaves:
            slave.step(time, step)
        network.read()

    def _change(self, new: FloatArray, old: FloatArray) -> FloatArray:
        scale = np.maximum(np.abs(new), _LEAST_SCALE if self._scale is None else self._scale)
        self._scale = scale
        change: FloatArray = np.abs(new - old) / scale
        return change


_SCHEMES: Final[tuple[type[Algorithm], ...]] = (Jacobi, GaussSeidel, Iterative)
#: What makes the schemes, out of their options.
ALGORITHMS: Final = {scheme.name: scheme for scheme in _SCHEMES}


def make_algorithm(coupling: Coupling) -> Algorithm:
    """Return the scheme that the settings ask for.

    Raises
    ------
    RunError
        If there is no scheme of this name.
    """
    if coupling.scheme not in ALGORITHMS:
        raise RunError(f"there is no coupling scheme '{coupling.scheme}' (known: {', '.join(ALGORITHMS)})")
    return ALGORITHMS[coupling.scheme](**coupling.options)


def initialise(network: Network, start: float, stop: float, starts: Mapping[str, float] | None = None) -> int:
    """Start the slaves and exchange values until they are consistent; returns the number of exchanges.

    Parameters
    ----------
    network : Network
    start, stop : float
        Start and stop time [s].
    starts : mapping, optional
        Other start times [s] by the names of slaves.

    Raises
    ------
    RunError
        If the values have not settled after `MAX_INITIAL_EXCHANGES` exchanges.
    """
    for slave in network.slaves:
        slave.start((starts or {}).get(slave.name, start), stop)
    network.read()
    exchanges = _settle(network)
    for slave in network.slaves:
        slave.finish_initialisation()
    network.read()
    return exchanges


def _settle(network: Network) -> int:
    for exchange in range(1, MAX_INITIAL_EXCHANGES + 1):
        before = network.outputs.copy()
        network.gather()
        network.write()
        network.read()
        change = np.abs(network.outputs - before)
        allowed = INITIAL_TOLERANCE * np.maximum(1.0, np.abs(network.outputs))
        if not np.any(change > allowed):
            return exchange
    worst = int(np.argmax(change - allowed))
    raise RunError(
        f"initialization: '{network.output_names[worst]}' still changes by {change[worst]:.3g} after "
        f"{MAX_INITIAL_EXCHANGES} exchanges; the start values of the components contradict each other"
    )
