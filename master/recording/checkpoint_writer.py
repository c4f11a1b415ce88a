"""Writing checkpoints during a run: when, of what, and by which observer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from master.coupling.coupling_schemes import Algorithm
from master.coupling.network import Network
from master.errors import RequestError
from master.recording.checkpoint import Checkpoint, scheme_options, storable, write
from master.system.components import Component, System
from master.system.step_rounding import ROUNDING, steps_in


class StatefulObserver(Protocol):
    """An observer that has to continue where it was."""

    name: str

    def save(self) -> list[float | None]:
        """Return what the observer keeps from step to step."""

    def restore(self, memory: Sequence[float | None]) -> None:
        """Restore what `save` returned."""


@dataclass(frozen=True)
class CheckpointSchedule:
    """After how many macro steps checkpoints are written.

    Attributes
    ----------
    once : int, optional
        After so many.
    every : int, optional
        After every so many.
    """

    once: int | None = None
    every: int | None = None

    def __bool__(self) -> bool:
        return self.once is not None or self.every is not None

    def __contains__(self, index: int) -> bool:
        return index == self.once or (self.every is not None and index % self.every == 0)


@dataclass(frozen=True)
class CheckpointObserver:
    """Observer that writes checkpoints, each replacing the one before.

    Attributes
    ----------
    take : callable
        index -> Checkpoint.
    path : Path
        The file.
    schedule : CheckpointSchedule
        When.
    """

    take: Callable[[Network, int], Checkpoint]
    path: Path
    schedule: CheckpointSchedule

    def begin(self, time: float, network: Network) -> None:
        """Nothing to save yet."""

    def observe(self, index: int, time: float, network: Network) -> None:
        """Write a checkpoint if one is due."""
        if index in self.schedule:
            write(self.path, self.take(network, index))

    def finish(self) -> None:
        """Nothing to close."""


def index_at(system: System, time: float) -> int:
    """Return the number of macro steps until ``time``.

    Raises
    ------
    RequestError
        If this is not a communication point of the run, or a component cannot be saved.
    """
    steps = (time - system.start) / system.step
    index = round(steps)
    if not 0 < index <= system.step_count or abs(steps - index) > ROUNDING:
        raise RequestError(
            f"--checkpoint {time:g}: not a communication point of the run, which goes from {system.start:g} s to "
            f"{system.stop:g} s in steps of {system.step:g} s"
        )
    _check_serialisable(system, "--checkpoint")
    return index


def steps_between(system: System, period: float) -> int:
    """Return the number of macro steps nearest to ``period`` [s], at least one.

    Raises
    ------
    RequestError
        If a component cannot be saved.
    """
    _check_serialisable(system, "--checkpoint-every")
    return steps_in(period, system.step)


def _check_serialisable(system: System, option: str) -> None:
    cannot = [c.name for c in system.components if not c.fmu.can_serialise]
    if cannot:
        raise RequestError(f"{option}: the FMU of {', '.join(cannot)} cannot serialise its state")
    texts = [f"{c.name}.{name}" for c in system.components for name in c.texts]
    if texts:
        raise RequestError(f"{option}: '{texts[0]}' is a text that is exchanged, which a checkpoint cannot hold")


def take(
    system: System,
    network: Network,
    algorithm: Algorithm,
    index: int,
    observers: Sequence[StatefulObserver] = (),
    run: str = "",
) -> Checkpoint:
    """Return the state of a system after ``index`` macro steps."""
    return Checkpoint(
        system.start,
        system.step,
        index,
        {c.name: _identity(c) for c in system.components},
        {s.name: storable(s).serialise() for s in network.slaves},
        dict(zip(network.input_names, network.inputs.tolist(), strict=True)),
        dict(zip(network.output_names, network.outputs.tolist(), strict=True)),
        algorithm.save(),
        algorithm.name,
        run,
        {observer.name: observer.save() for observer in observers},
        scheme_options(system),
    )


def _identity(component: Component) -> dict[str, Any]:
    return {"guid": component.fmu.guid, "parameters": component.parameters, "tolerance": component.tolerance}
