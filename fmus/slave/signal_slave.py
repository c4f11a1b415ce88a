"""Ports of signals from a table: outputs alone."""

from __future__ import annotations

from operator import attrgetter
from pathlib import Path
from typing import ClassVar

from fmus.slave.adapter import Adapter
from fmus.slave.ports import Port, Ports, Signal
from models.arrays import FloatArray
from models.signals.signal_definition import Output, SignalDefinition, load_signals
from models.signals.signal_part import SignalPart

_TEXTS = {"value": "{} of the table", "rate": "rate of {}", "integral": "integral of {} from the table's first row"}


class SignalSlave(Adapter[SignalDefinition, SignalPart]):
    """Signals from a table: no inputs, a value of every column at each communication point."""

    models: ClassVar[str] = (
        "Nothing: it plays back the columns of a table over time, in SI units, times a gain plus an offset, time_shift "
        "later than written. Between the rows values are held, linear or follow the monotone cubic, as chosen when it "
        "was built; rates and integrals are those of what lies between the rows, exactly."
    )
    limits: ClassVar[tuple[str, ...]] = (
        "Values are those of the communication points; steps longer than the table's pass over rows.",
        "Before the first row and after the last their values hold, at rate 0, unless the table repeats itself.",
    )

    def _read_definition(self, path: Path) -> SignalDefinition:
        return load_signals(path)

    def _make_part(self, definition: SignalDefinition) -> SignalPart:
        return SignalPart(definition)

    def _make_ports(self, part: SignalPart) -> Ports:
        signals = tuple(_signal(part.definition, output) for output in part.definition.outputs)
        return Ports(inputs=(), outputs=(Port(signals, attrgetter("outputs")),))

    def _told(self, part: SignalPart) -> list[str]:
        return part.told

    def _initialise(self, part: SignalPart, time: float, inputs: FloatArray) -> None:
        part.initialise(time)

    def _advance(self, part: SignalPart, inputs: FloatArray, step: float) -> None:
        part.move(self._time + step)  # the host's own time: sums of steps would drift


def _signal(definition: SignalDefinition, output: Output) -> Signal:
    return Signal(output.name, output.unit, _TEXTS[output.kind].format(definition.columns[output.column][0]))
