"""Starting from a checkpoint: whether it matches the system, and restoring the system from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from master.arrays import FloatArray
from master.coupling.coupling_schemes import Algorithm, initialise
from master.coupling.macro_steps import TimeGrid
from master.coupling.network import Network
from master.errors import RequestError, RunError, hint
from master.recording.checkpoint import Checkpoint, scheme_options, storable
from master.system.components import Component, System
from master.system.step_rounding import ROUNDING


@dataclass(frozen=True)
class Continuation:
    """A checkpoint to continue from.

    Attributes
    ----------
    checkpoint : Checkpoint
    file : str
        Where it was read.
    renewed : tuple of str
        Components that are not taken from it but start afresh at its time.
    is_same_run : bool
        Whether the run that made the checkpoint continues in its own folder, rather than a new run starting from it.
    """

    checkpoint: Checkpoint
    file: str
    renewed: tuple[str, ...] = ()
    is_same_run: bool = False

    def grid(self, system: System) -> TimeGrid:
        """Return the communication points: those of the first run if the step is the same."""
        c = self.checkpoint
        if system.step == c.step and system.start == c.start:
            return TimeGrid(c.start, c.step, system.step_count, c.index)
        count = int((system.stop - c.time) / system.step + ROUNDING)
        return TimeGrid(c.time, system.step, count)

    def check(self, system: System) -> None:
        """Refuse a system that does not match the checkpoint.

        Raises
        ------
        RequestError
            Naming every difference.
        """
        unknown = [name for name in self.renewed if name not in {c.name for c in system.components}]
        names = [c.name for c in system.components]
        found = [f"there is no component '{name}' to renew{hint(name, names)}" for name in unknown]
        for component in system.components:
            if component.name not in self.renewed:
                found += _differences(component, self.checkpoint.components.get(component.name))
        grid = self.grid(system)
        if self.is_same_run:
            found += self._changes(system)
        # A run that was stopped after its last step still has to write its summary.
        if grid.count < grid.first or (grid.count == grid.first and not self.is_same_run):
            found.append(f"it was saved at {self.checkpoint.time:g} s, the run would end at {system.stop:g} s")
        if found:
            raise RequestError(f"{self.file} does not fit this run: " + "; ".join(found))

    def _changes(self, system: System) -> list[str]:
        c, scheme = self.checkpoint, system.settings.coupling.scheme
        found = [f"a run that continues in its own folder cannot renew '{name}'" for name in self.renewed]
        if (system.start, system.step) != (c.start, c.step):
            now = f"{system.step:g} s from {system.start:g} s on"
            found.append(f"its step was {c.step:g} s from {c.start:g} s on, is {now}")
        if scheme != c.scheme:
            found.append(f"its scheme was {c.scheme}, is {scheme}")
            return found
        wanted = scheme_options(system)
        found += [
            f"the {name} of its scheme was {_as_text(c.options.get(name))}, is {_as_text(value)}"
            for name, value in wanted.items()
            if name in c.options and c.options[name] != value
        ]
        return found

    def prepare(self, network: Network, algorithm: Algorithm, grid: TimeGrid) -> None:
        """Bring slaves, exchanged values and scheme to the checkpoint."""
        kept = [s for s in network.slaves if s.name not in self.renewed]
        # Renewed components start at the checkpoint's time, the others where they once did.
        starts = dict.fromkeys(self.renewed, self.checkpoint.time)
        initialise(network, self.checkpoint.start, grid.stop, starts)
        for slave in kept:
            storable(slave).deserialise(self.checkpoint.states[slave.name])
        network.read()
        kept_outputs = {f"{s.name}.{n}" for s in kept for n in s.output_names}
        self._check_outputs(network, kept_outputs)
        _fill(network.inputs, network.input_names, self.checkpoint.inputs)
        if algorithm.name == self.checkpoint.scheme and not self.renewed:
            algorithm.restore(self.checkpoint.memory)

    def _check_outputs(self, network: Network, kept: set[str]) -> None:
        for name, value in zip(network.output_names, network.outputs.tolist(), strict=True):
            saved = self.checkpoint.outputs.get(name)
            if name in kept and saved is not None and value != saved:
                raise RunError(
                    f"'{name}' is {value!r} after its state was restored from {self.file}, it was {saved!r}: "
                    "the FMU does not restore its whole state"
                )


def _as_text(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)


def _differences(component: Component, saved: dict[str, Any] | None) -> list[str]:
    name = component.name
    if saved is None:
        return [f"it holds no component '{name}' (--renew {name} starts it afresh)"]
    if saved["guid"] != component.fmu.guid:
        return [f"the FMU of '{name}' is a different one now (--renew {name} starts it afresh)"]
    tolerances = (saved.get("tolerance"), component.tolerance)
    if tolerances[0] != tolerances[1]:
        was, now_is = ("none" if value is None else f"{value:g}" for value in tolerances)
        return [f"the tolerance of '{name}' was {was}, is {now_is} (--renew {name} starts it afresh)"]
    now, then = component.parameters, saved["parameters"]
    changed = sorted(n for n in {*now, *then} if now.get(n) != then.get(n))
    return [
        f"{name}.{n} was {then.get(n, 'not set')}, is {now.get(n, 'not set')} (--renew {name} starts it afresh)"
        for n in changed
    ]


def _fill(array: FloatArray, names: Sequence[str], values: dict[str, float]) -> None:
    for i, name in enumerate(names):
        array[i] = values.get(name, array[i])
