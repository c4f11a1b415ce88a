"""Named signals and where they lie in one flat array, by value reference."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, Literal

import numpy as np

from models.arrays import FloatArray
from models.definition_files.parameter import Parameter
from models.numerics.energy_ledger import BALANCE

Causality = Literal["parameter", "input", "output", "local", "calculatedParameter"]
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Signal:
    """A variable as the outside sees it.

    Attributes
    ----------
    name, unit, description : str
    start : float or None
        Start value in ``unit``; None where the model computes it.
    minimum, maximum : float or None
        Allowed range, if there is one.
    is_integer : bool
    """

    name: str
    unit: str
    description: str
    start: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    is_integer: bool = False


@dataclass(frozen=True)
class Port:
    """An array of a part and the names of its elements, in the array's own order.

    Attributes
    ----------
    signals : tuple of Signal
    read : callable
        part -> array with as many elements as there are signals.
    """

    signals: tuple[Signal, ...]
    read: Callable[[Any], FloatArray]


@dataclass(frozen=True)
class Ports:
    """All that a part takes and gives.

    Attributes
    ----------
    inputs : tuple of Signal
        In the order of the array that the part is given.
    outputs, asked, local, calculated : tuple of Port
        Outputs read after every step; outputs and local variables read when asked for; read once the part is built.
    """

    inputs: tuple[Signal, ...]
    outputs: tuple[Port, ...] = ()
    asked: tuple[Port, ...] = ()
    local: tuple[Port, ...] = ()
    calculated: tuple[Port, ...] = ()


@dataclass(frozen=True)
class Variable:
    """A signal in its place: the value reference is the position in ``Table.variables``."""

    signal: Signal
    causality: Causality


class Table:
    """Every variable of an FMU; value references count from 0 in the order of this table.

    Parameters come first and computed values last, so that one comparison shows what a value reference means.

    Attributes
    ----------
    variables : tuple of Variable
        Indexed by value reference.
    parameters, inputs, outputs, asked, local, calculated : slice
        Value references by causality, ``asked`` those of outputs that are computed only for whoever asks.
    """

    def __init__(self, parameters: Sequence[Parameter], ports: Ports) -> None:
        self.ports = ports
        self._variables: list[Variable] = []
        self.parameters = self._add("parameter", map(_parameter_signal, parameters))
        self.inputs = self._add("input", ports.inputs)
        self.outputs = self._add("output", _signals(ports.outputs))
        self.asked = self._add("output", _signals(ports.asked))
        self.local = self._add("local", _signals(ports.local))
        self.calculated = self._add("calculatedParameter", _signals(ports.calculated))
        self.variables = tuple(self._variables)

    def __len__(self) -> int:
        return len(self.variables)

    def start_values(self) -> FloatArray:
        """Return the values before anything is set or computed: start values, and NaN for what is not known yet."""
        starts = [v.signal.start for v in self.variables]
        return np.array([np.nan if s is None else s for s in starts], dtype=np.float64)

    def name(self, reference: int) -> str:
        """Return a variable's name."""
        return self.variables[reference].signal.name

    def places(self, kind: slice, ports: Iterable[Port]) -> list[tuple[slice, Port]]:
        """Return where the arrays of ``ports`` lie within the slice ``kind``."""
        places, start = [], kind.start
        for port in ports:
            end = start + len(port.signals)
            places.append((slice(start, end), port))
            start = end
        return places

    def _add(self, causality: Causality, signals: Iterable[Signal]) -> slice:
        start = len(self._variables)
        self._variables += [Variable(s, causality) for s in signals]
        return slice(start, len(self._variables))


def vector(prefix: str, unit: str, description: str, start: Sequence[float] | None = None) -> tuple[Signal, ...]:
    """Return the signals ``prefix + x``, ``y`` and ``z``.

    Examples
    --------
    >>> [s.name for s in vector("A.v", "m/s", "velocity of end A")]
    ['A.vx', 'A.vy', 'A.vz']
    """
    starts = start if start is not None else (None, None, None)
    return tuple(
        Signal(f"{prefix}{axis}", unit, f"{description}, {axis}", value)
        for axis, value in zip(AXES, starts, strict=True)
    )


def energy_ports(contacts: Sequence[str]) -> tuple[Port, ...]:
    """Return the ports of a part's energy balance and of the work at its contacts, which have these prefixes."""
    unless = "0 unless monitor_energy is 1"
    balance = tuple(Signal(f"energy.{name}", "J", f"{text}; {unless}") for name, text in BALANCE)
    work = tuple(
        Signal(f"{prefix}.work", "J", f"work of the strip against the contact force; {unless}") for prefix in contacts
    )
    return Port(balance, attrgetter("energy")), Port(work, attrgetter("contact_work"))


def _signals(ports: Iterable[Port]) -> Iterable[Signal]:
    return (signal for port in ports for signal in port.signals)


def _parameter_signal(parameter: Parameter) -> Signal:
    source = f" [{parameter.source}]" if parameter.source else ""
    return Signal(
        parameter.name,
        parameter.unit,
        parameter.description + source,
        parameter.value,
        parameter.minimum,
        parameter.maximum,
        parameter.is_integer,
    )
