"""Slaves and the wires between them; all exchanged values live in two arrays.

The coupling algorithms see slaves only through the small `Slave` protocol, so that they can be tried on plain
functions.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Any, Protocol

import numpy as np

from master.arrays import BoolArray, FloatArray, IntArray
from master.errors import RunError
from master.system.connections import Connection


class Slave(Protocol):
    """What a coupling algorithm needs of a component.

    `bind` is called first. `start`, exchanges, `finish_initialisation` follow in this order, then steps.
    """

    name: str
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]

    def bind(self, inputs: FloatArray, outputs: FloatArray) -> None:
        """Take the arrays through which values are exchanged."""

    def start(self, start: float, stop: float) -> None:
        """Enter initialization."""

    def finish_initialisation(self) -> None:
        """Leave initialization."""

    def write(self) -> None:
        """Take the values of the inputs array."""

    def read(self) -> None:
        """Put the outputs into the outputs array."""

    def step(self, time: float, step: float) -> None:
        """Advance from ``time`` to ``time + step``."""

    def save(self) -> Any:
        """Return the state."""

    def restore(self, state: Any) -> None:
        """Return to a saved state."""

    def release(self, state: Any) -> None:
        """Give up a saved state."""

    def remark(self) -> str:
        """Return the last warning or error message of the slave, empty if there was none."""


class Network:
    """Slaves connected by wires.

    Parameters
    ----------
    slaves : sequence of Slave
        The components.
    connections : sequence of Connection
        Wires; every input has exactly one.
    discrete : collection of str
        Outputs that are not Real, whose values cannot be interpolated.

    Attributes
    ----------
    inputs : ndarray, shape (n_inputs,)
        What the slaves received last.
    outputs : ndarray, shape (n_outputs,)
        What the slaves returned last.
    input_names, output_names : tuple of str
        ``component.variable`` for each entry.
    is_plain : bool
        Whether no wire converts what passes through it.
    is_discrete : ndarray, shape (n_outputs,)
        Which outputs are not Real.
    """

    def __init__(
        self, slaves: Sequence[Slave], connections: Sequence[Connection], discrete: Collection[str] = ()
    ) -> None:
        self.slaves = tuple(slaves)
        self.input_names = tuple(f"{s.name}.{n}" for s in slaves for n in s.input_names)
        self.output_names = tuple(f"{s.name}.{n}" for s in slaves for n in s.output_names)
        self.inputs: FloatArray = np.zeros(len(self.input_names))
        self.outputs: FloatArray = np.zeros(len(self.output_names))
        self.is_discrete: BoolArray = np.array([name in discrete for name in self.output_names], dtype=np.bool_)
        self._factor: FloatArray = np.ones_like(self.inputs)
        self._offset: FloatArray = np.zeros_like(self.inputs)
        self._from: IntArray = np.zeros(len(self.inputs), dtype=np.intp)
        self._wire(connections)
        self._slices = self._bind()
        self.is_plain = bool(np.all(self._factor == 1.0) and np.all(self._offset == 0.0))

    def gather(self, outputs: FloatArray | None = None) -> None:
        """Set all inputs from ``outputs`` (default: the current ones)."""
        (self.outputs if outputs is None else outputs).take(self._from, out=self.inputs, mode="clip")
        if not self.is_plain:
            self.inputs *= self._factor
            self.inputs += self._offset

    def converted(self, outputs: FloatArray) -> FloatArray:
        """Return what the inputs would be if the outputs were these, shape (n_inputs,)."""
        with np.errstate(over="ignore", invalid="ignore"):  # the caller checks whether the result is finite
            return np.take(outputs, self._from) * self._factor + self._offset

    def gather_for(self, index: int) -> None:
        """Set the inputs of one slave from the current outputs."""
        part = self._slices[index]
        self.inputs[part] = self.outputs[self._from[part]] * self._factor[part] + self._offset[part]

    def write(self) -> None:
        """Pass all inputs to the slaves."""
        for slave in self.slaves:
            slave.write()

    def read(self) -> None:
        """Take all outputs from the slaves."""
        for slave in self.slaves:
            slave.read()

    def _wire(self, connections: Iterable[Connection]) -> None:
        inputs = {name: i for i, name in enumerate(self.input_names)}
        outputs = {name: i for i, name in enumerate(self.output_names)}
        for c in connections:
            target = inputs.pop(f"{c.target}.{c.input}")
            self._from[target] = outputs[f"{c.source}.{c.output}"]
            self._factor[target] = c.conversion.factor
            self._offset[target] = c.conversion.offset
        if inputs:
            raise RunError(f"input '{next(iter(inputs))}' is not connected")

    def _bind(self) -> list[slice]:
        parts, first_in, first_out = [], 0, 0
        for slave in self.slaves:
            part = slice(first_in, first_in + len(slave.input_names))
            end_out = first_out + len(slave.output_names)
            slave.bind(self.inputs[part], self.outputs[first_out:end_out])
            parts.append(part)
            first_in, first_out = part.stop, end_out
        return parts
