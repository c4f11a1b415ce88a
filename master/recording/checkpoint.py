"""The state of a whole system at a communication point, in a file from which a run continues bit for bit.

The file holds what the components gave as their serialised states, the exchanged values and what the coupling scheme
remembers: a magic line, the length of a JSON header, the header, raw bytes, and the SHA-256 of all before. Nothing in
it is ever executed.
"""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, Protocol, runtime_checkable

import numpy as np

from master.arrays import FloatArray
from master.coupling.coupling_schemes import Algorithm, initialise
from master.coupling.macro_steps import TimeGrid
from master.coupling.network import Network
from master.errors import MasterError, RequestError, RunError, one_line
from master.safety.safe_files import write_whole
from master.system.components import Component, System
from master.system.step_rounding import steps_in

#: First bytes of every checkpoint; the digit is the format's version.
MAGIC: Final = b"openpanto checkpoint 1\n"
#: What they begin with in any version.
_FAMILY: Final = b"openpanto checkpoint "
NAME: Final = "checkpoint.state"
_LENGTH: Final = struct.Struct("<Q")
_CHECKSUM: Final = hashlib.sha256().digest_size
#: Share of a step by which a wanted time may miss a communication point.
_ROUNDING: Final = 1e-6


@runtime_checkable
class Storable(Protocol):
    """A slave whose state can be written to a file."""

    def serialise(self) -> bytes:
        """Return the whole state."""

    def deserialise(self, data: bytes) -> None:
        """Return to a state."""


@dataclass(frozen=True)
class Checkpoint:
    """A system's state.

    Attributes
    ----------
    start, step : float
        Start time and macro step of the run that it comes from [s].
    index : int
        Macro steps done.
    components : dict
        What has to be the same when the run goes on: GUID and parameters by component name.
    states : dict
        Serialised states by component name.
    inputs, outputs : dict
        Exchanged values by ``component.variable``.
    memory : ndarray
        What the coupling scheme remembers.
    scheme : str
        Name of the coupling scheme.
    run : str
        Identity of the run that it comes from.
    observers : dict
        What observers remember, by their names.
    options : dict
        What the coupling scheme goes by (`scheme_options`).
    """

    start: float
    step: float
    index: int
    components: dict[str, dict[str, Any]]
    states: dict[str, bytes]
    inputs: dict[str, float]
    outputs: dict[str, float]
    memory: FloatArray
    scheme: str
    run: str = ""
    observers: dict[str, list[float | None]] = field(default_factory=dict)
    options: dict[str, Any] = field(default_factory=dict)

    @property
    def time(self) -> float:
        """When it was taken [s]."""
        return self.start + self.index * self.step


@dataclass(frozen=True)
class Continuation:
    """A checkpoint to go on from.

    Attributes
    ----------
    checkpoint : Checkpoint
    file : str
        Where it was read.
    renewed : tuple of str
        Components that are not taken from it but start anew at its time.
    is_same_run : bool
        Whether it is the run that made the checkpoint that goes on, in its own folder, not a new one.
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
        count = int((system.stop - c.time) / system.step + _ROUNDING)
        return TimeGrid(c.time, system.step, count)

    def check(self, system: System) -> None:
        """Refuse a system that the checkpoint does not belong to.

        Raises
        ------
        RequestError
            Naming every difference.
        """
        unknown = [name for name in self.renewed if name not in {c.name for c in system.components}]
        found = [f"there is no component '{name}' to renew" for name in unknown]
        for component in system.components:
            if component.name not in self.renewed:
                found += _differences(component, self.checkpoint.components.get(component.name))
        grid = self.grid(system)
        if self.is_same_run:
            found += self._changes(system)
        # A run that was ended after its last step has its summary left to write.
        if grid.count < grid.first or (grid.count == grid.first and not self.is_same_run):
            found.append(f"it was saved at {self.checkpoint.time:g} s, the run would end at {system.stop:g} s")
        if found:
            raise RequestError(f"{self.file} does not fit this run: " + "; ".join(found))

    def _changes(self, system: System) -> list[str]:
        c, scheme = self.checkpoint, system.settings.coupling.scheme
        found = [f"a run that goes on in its own folder cannot renew '{name}'" for name in self.renewed]
        if (system.start, system.step) != (c.start, c.step):
            now = f"{system.step:g} s from {system.start:g} s on"
            found.append(f"its step was {c.step:g} s from {c.start:g} s on, is {now}")
        if scheme != c.scheme:
            found.append(f"its scheme was {c.scheme}, is {scheme}")
            return found
        wanted = scheme_options(system)
        found += [
            f"the {name} of its scheme was {_told(c.options.get(name))}, is {_told(value)}"
            for name, value in wanted.items()
            if name in c.options and c.options[name] != value
        ]
        return found

    def prepare(self, network: Network, algorithm: Algorithm, grid: TimeGrid) -> None:
        """Bring slaves, exchanged values and scheme to the checkpoint."""
        kept = [s for s in network.slaves if s.name not in self.renewed]
        # Components that start anew do so at the checkpoint's time, the others where they once did.
        starts = dict.fromkeys(self.renewed, self.checkpoint.time)
        initialise(network, self.checkpoint.start, grid.stop, starts)
        for slave in kept:
            _storable(slave).deserialise(self.checkpoint.states[slave.name])
        network.read()
        kept_outputs = {f"{s.name}.{n}" for s in kept for n in s.output_names}
        self._check_outputs(network, kept_outputs)
        _fill(network.inputs, network.input_names, self.checkpoint.inputs)
        if algorithm.name == self.checkpoint.scheme and not self.renewed:
            algorithm.recall(self.checkpoint.memory)

    def _check_outputs(self, network: Network, kept: set[str]) -> None:
        for name, value in zip(network.output_names, network.outputs.tolist(), strict=True):
            saved = self.checkpoint.outputs.get(name)
            if name in kept and saved is not None and value != saved:
                raise RunError(
                    f"'{name}' is {value!r} after its state was restored from {self.file}, it was {saved!r}: "
                    "the FMU does not restore its whole state"
                )


class Remembering(Protocol):
    """An observer whose work has to go on where it was."""

    name: str

    def memory(self) -> list[float | None]:
        """Return what it remembers from step to step."""

    def recall(self, memory: Sequence[float | None]) -> None:
        """Take such a memory back."""


@dataclass(frozen=True)
class Occasions:
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
    """Observer that writes checkpoints, each in the place of the one before.

    Attributes
    ----------
    take : callable
        index -> Checkpoint.
    path : Path
        The file.
    occasions : Occasions
        When.
    """

    take: Callable[[Network, int], Checkpoint]
    path: Path
    occasions: Occasions

    def begin(self, time: float, network: Network) -> None:
        """Nothing to save yet."""

    def observe(self, index: int, time: float, network: Network) -> None:
        """Write one if it is time."""
        if index in self.occasions:
            write(self.path, self.take(network, index))

    def finish(self) -> None:
        """Nothing to close."""


def index_at(system: System, time: float) -> int:
    """Return the number of macro steps until ``time``.

    Raises
    ------
    RequestError
        If that is no communication point of the run, or a component cannot be saved.
    """
    steps = (time - system.start) / system.step
    index = round(steps)
    if not 0 < index <= system.step_count or abs(steps - index) > _ROUNDING:
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


def scheme_options(system: System) -> dict[str, Any]:
    """Return what the coupling scheme goes by, as JSON has it; an order left open is that of the file."""
    options = dict(system.settings.coupling.options)
    if "order" in options:
        options["order"] = list(options["order"] or (c.name for c in system.components))
    return options


def _told(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)


def take(
    system: System,
    network: Network,
    algorithm: Algorithm,
    index: int,
    observers: Sequence[Remembering] = (),
    run: str = "",
) -> Checkpoint:
    """Return the state of a system after ``index`` macro steps."""
    return Checkpoint(
        system.start,
        system.step,
        index,
        {c.name: _identity(c) for c in system.components},
        {s.name: _storable(s).serialise() for s in network.slaves},
        dict(zip(network.input_names, network.inputs.tolist(), strict=True)),
        dict(zip(network.output_names, network.outputs.tolist(), strict=True)),
        algorithm.memory(),
        algorithm.name,
        run,
        {observer.name: observer.memory() for observer in observers},
        scheme_options(system),
    )


def write(path: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint; readers see the old file or the new one, never half of it."""
    write_whole(path, pack(checkpoint))


def read(path: Path) -> Checkpoint:
    """Read a checkpoint.

    Raises
    ------
    MasterError
        If it is missing, damaged, or something else.
    """
    try:
        return unpack(path.read_bytes())
    except OSError as error:
        raise MasterError(f"{path} cannot be read ({error.strerror})") from error
    except ValueError as error:
        raise MasterError(f"{path} {error}") from error


def pack(checkpoint: Checkpoint) -> bytes:
    """Return a checkpoint as bytes."""
    c = checkpoint
    numbers = np.array([c.start, c.step, *c.inputs.values(), *c.outputs.values()])
    header = {
        "index": c.index,
        "scheme": c.scheme,
        "components": c.components,
        "inputs": list(c.inputs),
        "outputs": list(c.outputs),
        "memory": len(c.memory),
        "states": {name: len(state) for name, state in c.states.items()},
        "run": c.run,
        "observers": c.observers,
        "options": c.options,
    }
    text = json.dumps(header, allow_nan=False).encode()
    raw = numbers.astype("<f8").tobytes() + c.memory.astype("<f8").tobytes() + b"".join(c.states.values())
    body = MAGIC + _LENGTH.pack(len(text)) + text + raw
    return body + hashlib.sha256(body).digest()


def unpack(data: bytes) -> Checkpoint:
    """Return the checkpoint that `pack` was given.

    Raises
    ------
    ValueError
        If the bytes are none, or were cut or changed.
    """
    if not data.startswith(MAGIC):
        raise ValueError(_foreign(data))
    body, checksum = data[:-_CHECKSUM], data[-_CHECKSUM:]
    if hashlib.sha256(body).digest() != checksum:
        raise ValueError("is damaged: its checksum does not fit, it was cut or changed")
    start = len(MAGIC) + _LENGTH.size
    (length,) = _LENGTH.unpack(body[len(MAGIC) : start])
    return _unpack_body(json.loads(body[start : start + length]), body[start + length :])


def _foreign(data: bytes) -> str:
    """Return what is wrong with bytes that do not begin as a checkpoint of this version does."""
    if not data.startswith(_FAMILY):
        return "is not a checkpoint"
    found, own = (raw.partition(b"\n")[0].removeprefix(_FAMILY).decode("ascii", "replace") for raw in (data, MAGIC))
    return f"is a checkpoint of format {one_line(found[:20])}, this version reads {own}: begin the run anew"


def _unpack_body(header: dict[str, Any], raw: bytes) -> Checkpoint:
    inputs, outputs = header["inputs"], header["outputs"]
    count = 2 + len(inputs) + len(outputs) + header["memory"]
    numbers = np.frombuffer(raw, "<f8", count).astype(np.float64)
    ends = 2 + np.cumsum([0, len(inputs), len(outputs), header["memory"]])
    values = [numbers[a:b].tolist() for a, b in pairwise(ends.tolist())]
    states, position = {}, 8 * count
    for name, size in header["states"].items():
        states[name] = raw[position : position + size]
        position += size
    return Checkpoint(
        float(numbers[0]),
        float(numbers[1]),
        header["index"],
        header["components"],
        states,
        dict(zip(inputs, values[0], strict=True)),
        dict(zip(outputs, values[1], strict=True)),
        np.array(values[2]),
        header["scheme"],
        header.get("run", ""),
        header.get("observers", {}),
        header.get("options", {}),
    )


def _identity(component: Component) -> dict[str, Any]:
    return {"guid": component.fmu.guid, "parameters": component.parameters, "tolerance": component.tolerance}


def _differences(component: Component, saved: dict[str, Any] | None) -> list[str]:
    name = component.name
    if saved is None:
        return [f"it holds no component '{name}' (--renew {name} starts it anew)"]
    if saved["guid"] != component.fmu.guid:
        return [f"the FMU of '{name}' is another one now (--renew {name} starts it anew)"]
    told = (saved.get("tolerance"), component.tolerance)
    if told[0] != told[1]:
        was, now_is = ("none" if value is None else f"{value:g}" for value in told)
        return [f"the tolerance that '{name}' is told was {was}, is {now_is} (--renew {name} starts it anew)"]
    now, then = component.parameters, saved["parameters"]
    changed = sorted(n for n in {*now, *then} if now.get(n) != then.get(n))
    return [
        f"{name}.{n} was {then.get(n, 'not set')}, is {now.get(n, 'not set')} (--renew {name} starts it anew)"
        for n in changed
    ]


def _storable(slave: object) -> Storable:
    if not isinstance(slave, Storable):
        raise RunError(f"component '{getattr(slave, 'name', slave)}' cannot be saved to a file")
    return slave


def _fill(array: FloatArray, names: Sequence[str], values: dict[str, float]) -> None:
    for i, name in enumerate(names):
        array[i] = values.get(name, array[i])
