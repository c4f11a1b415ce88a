"""The state of a whole system at a communication point, in a file from which a run continues bit for bit.

The file is an array container (`master.safety.array_container`) that holds what the components gave as their serialised
states, the exchanged values, and what the coupling scheme and the observers keep from step to step.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Protocol, runtime_checkable

import numpy as np

from master.arrays import FloatArray
from master.errors import MasterError, RunError, one_line, said
from master.safety import array_container
from master.safety.safe_files import write_atomically
from master.system.components import System

NAME: Final = "checkpoint.state"
#: Version of what a checkpoint holds. 1 had a layout of bytes for itself; 2: arrays in a container.
FORMAT: Final = 2
#: What checkpoints of format 1 and before begin with.
_BEFORE: Final = b"openpanto checkpoint "


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
        What has to be the same when the run continues: GUID, parameters and tolerance by component name.
    states : dict
        Serialised states by component name.
    inputs, outputs : dict
        Exchanged values by ``component.variable``.
    memory : ndarray
        What the coupling scheme keeps from step to step.
    scheme : str
        Name of the coupling scheme.
    run : str
        Identity of the run that it comes from.
    observers : dict
        What observers keep from step to step, by their names.
    options : dict
        Options of the coupling scheme (`scheme_options`).
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


def scheme_options(system: System) -> dict[str, Any]:
    """Return the options of the coupling scheme, as JSON has them; an order left open is that of the file."""
    options = dict(system.settings.coupling.options)
    if "order" in options:
        options["order"] = list(options["order"] or (c.name for c in system.components))
    return options


def write(path: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint; readers see the old file or the new one, never half of it."""
    write_atomically(path, pack(checkpoint))


def read(path: Path) -> Checkpoint:
    """Read a checkpoint.

    Raises
    ------
    MasterError
        If it is missing, damaged, or not a checkpoint.
    """
    try:
        return unpack(path.read_bytes())
    except OSError as error:
        raise MasterError(f"{path} cannot be read ({said(error)})") from error
    except ValueError as error:
        raise MasterError(f"{path} {error}") from error


def pack(checkpoint: Checkpoint) -> bytes:
    """Return a checkpoint as bytes."""
    c = checkpoint
    header = {
        "checkpoint": FORMAT,
        "index": c.index,
        "scheme": c.scheme,
        "components": c.components,
        "inputs": list(c.inputs),
        "outputs": list(c.outputs),
        "states": list(c.states),
        "run": c.run,
        "observers": c.observers,
        "options": c.options,
    }
    arrays = {
        "times": np.array([c.start, c.step]),
        "inputs": np.array(list(c.inputs.values()), dtype=np.float64),
        "outputs": np.array(list(c.outputs.values()), dtype=np.float64),
        "memory": c.memory,
        **{f"state of {name}": np.frombuffer(state, np.uint8) for name, state in c.states.items()},
    }
    return array_container.pack(header, arrays)


def unpack(data: bytes) -> Checkpoint:
    """Return the checkpoint that `pack` was given.

    Raises
    ------
    ValueError
        If the bytes are not a checkpoint, or were cut or changed.
    """
    if data.startswith(_BEFORE):
        raise _of_another_format(data.partition(b"\n")[0].removeprefix(_BEFORE).decode("ascii", "replace"))
    if not data.startswith(array_container.MAGIC):
        raise ValueError("is not a checkpoint")
    header, arrays = array_container.unpack(data)
    if header.get("checkpoint") != FORMAT:
        raise (
            _of_another_format(str(header["checkpoint"]))
            if "checkpoint" in header
            else ValueError("is not a checkpoint")
        )
    start, step = arrays["times"].tolist()
    return Checkpoint(
        start,
        step,
        header["index"],
        header["components"],
        {name: arrays[f"state of {name}"].tobytes() for name in header["states"]},
        dict(zip(header["inputs"], arrays["inputs"].tolist(), strict=True)),
        dict(zip(header["outputs"], arrays["outputs"].tolist(), strict=True)),
        arrays["memory"],
        header["scheme"],
        header["run"],
        header["observers"],
        header["options"],
    )


def _of_another_format(found: str) -> ValueError:
    text = f"is a checkpoint of format {one_line(found[:20])}, this version reads {FORMAT}: start the run again"
    return ValueError(text)


def storable(slave: object) -> Storable:
    """Return ``slave`` if its state can be saved; RunError otherwise."""
    if not isinstance(slave, Storable):
        raise RunError(f"component '{getattr(slave, 'name', slave)}' cannot be saved to a file")
    return slave
