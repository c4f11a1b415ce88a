"""Ports of a pantograph."""

from __future__ import annotations

from operator import attrgetter, methodcaller
from pathlib import Path
from typing import Any

from fmus.adapter import Adapter
from fmus.ports import Port, Ports, Signal, vector
from models.pantograph.lumped import LumpedPantographPart
from models.pantograph.parameters import LumpedDefinition, load_lumped
from models.part import FloatArray


class LumpedPantographSlave(Adapter[LumpedDefinition, LumpedPantographPart]):
    """Pantograph of lumped masses: contact force and point in, collector strip out."""

    def _read_definition(self, path: Path) -> LumpedDefinition:
        return load_lumped(path)

    def _make_part(self, definition: LumpedDefinition) -> LumpedPantographPart:
        return LumpedPantographPart(definition)

    def _make_ports(self, part: LumpedPantographPart) -> Ports:
        return pantograph_ports(part)

    def _initialise(self, part: LumpedPantographPart, time: float, inputs: FloatArray) -> None:
        part.initialise(time, float(inputs[0]), inputs[1:4], inputs[4:6])

    def _advance(self, part: LumpedPantographPart, inputs: FloatArray, step: float) -> None:
        part.step(float(inputs[0]), inputs[1:4], inputs[4:6], step)


def pantograph_ports(part: Any) -> Ports:
    """Return the ports that every pantograph has, and those of its own observations."""
    return Ports(
        inputs=(
            Signal("contact.force", "N", "contact force; positive pushes the strip down", 0.0),
            *vector("contact.", "m", "point of application of the contact force", (0.0, 0.0, 0.0)),
            Signal("base.z", "m", "displacement of the vehicle's roof, up", 0.0),
            Signal("base.vz", "m/s", "velocity of the vehicle's roof, up", 0.0),
        ),
        outputs=(
            Port(tuple(s for end in "AB" for s in _end(end)), attrgetter("strip")),
            Port(tuple(Signal(*observed) for observed in part.observed), methodcaller("observation_values")),
        ),
    )


def _end(end: str) -> tuple[Signal, ...]:
    text = f"of end {end} of the collector strip"
    return vector(f"{end}.", "m", f"position {text}") + vector(f"{end}.v", "m/s", f"velocity {text}")
