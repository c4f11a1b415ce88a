"""Ports of the toy."""

from __future__ import annotations

from operator import attrgetter
from pathlib import Path

from fmus.slave.adapter import Adapter
from fmus.slave.ports import Port, Ports, Signal
from models.arrays import FloatArray
from toy.part import ToyDefinition, ToyPart, load


class ToySlave(Adapter[ToyDefinition, ToyPart]):
    def _read_definition(self, path: Path) -> ToyDefinition:
        return load(path)

    def _make_part(self, definition: ToyDefinition) -> ToyPart:
        return ToyPart(definition)

    def _make_ports(self, part: ToyPart) -> Ports:
        springs = tuple(Signal(f"spring[{i}].force", "N", f"force of spring {i}") for i in (1, 2))
        return Ports(
            inputs=(
                Signal("force", "N", "force on the masses", 0.0),
                Signal("spare", "N.m.s/rad", "not used", 0.1),
            ),
            outputs=(Port(tuple(Signal(*o) for o in part.observed), attrgetter("x")),),
            local=(Port(springs, attrgetter("spring_force")),),
            calculated=(Port((Signal("rest", "m", "sag under its weight"),), attrgetter("rest")),),
        )

    def _initialise(self, part: ToyPart, time: float, inputs: FloatArray) -> None:
        part.initialise(time, inputs)

    def _advance(self, part: ToyPart, inputs: FloatArray, step: float) -> None:
        part.step(inputs, step)
