"""Ports of a lumped pantograph, and those that every pantograph has."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from operator import attrgetter, methodcaller
from pathlib import Path
from typing import Any, ClassVar

from fmus.slave.adapter import Adapter
from fmus.slave.ports import Port, Ports, Signal, energy_ports, vector
from models.arrays import FloatArray
from models.pantograph.lumped.lumped_advice import idle_values, working_height_warning
from models.pantograph.lumped.lumped_definition import LumpedDefinition, load_lumped
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from models.pantograph.operation import Drive
from models.pantograph.train_motion import acceleration_warning

#: Inputs of `operation.Drive`, in its order.
DRIVE_SIGNALS = (
    Signal("reference.vz", "m/s", "rate of the line's nominal height under the strip (pantograph[p].nominal.vz)", 0.0),
    Signal("air.u", "m/s", "speed of the air along the track, for the aerodynamic uplift", 0.0),
    Signal("uplift_force", "N", "force added to the static force, of a controller say", 0.0),
)
#: Inputs of `operation.Drive.sway`, in its order; a lumped pantograph has no yaw.
SWAY_SIGNALS = (
    Signal("base.y", "m", "displacement of the vehicle's roof, to the left", 0.0),
    Signal("base.vy", "m/s", "velocity of the vehicle's roof, to the left", 0.0),
    Signal("base.roll", "rad", "roll of the vehicle's roof about the base, left side up", 0.0),
    Signal("base.roll_rate", "rad/s", "rate of the roll of the vehicle's roof", 0.0),
    Signal("base.yaw", "rad", "yaw of the vehicle's roof about the base, nose to the left", 0.0),
    Signal("base.yaw_rate", "rad/s", "rate of the yaw of the vehicle's roof", 0.0),
)
#: Inputs of `operation.Drive.train`, in its order.
TRAIN_SIGNALS = (
    Signal("train.x", "m", "way along the track from the start position, if use_train is 1", 0.0),
    Signal("train.vx", "m/s", "speed along the track, if use_train is 1", 0.0),
)


class LumpedPantographSlave(Adapter[LumpedDefinition, LumpedPantographPart]):
    """Pantograph of lumped masses: contact force and point in, collector strip out."""

    models: ClassVar[str] = (
        "A pantograph as a chain of masses above each other, joined by springs and dampers, the lowest to the "
        "vehicle's roof, the highest carrying the collector strip; it moves along the track at its speed, by its speed "
        "profile or as train.x and train.vx say. A "
        "static force lifts the lowest mass, raised smoothly from raise_start over raise_duration. It starts at rest "
        "at reference_height, where the springs carry the weights. The contact force acts on the highest mass; "
        "between communication points it is continued from its last values, so hosts that hold inputs lose no accuracy."
    )
    limits: ClassVar[tuple[str, ...]] = (
        "Vertical motion only: the strip does not roll, and the lateral point of application has no effect.",
        "Linear springs and dampers, identified at one working height; friction and stops only where the definition "
        "has them. With follow_height = 1 the reference "
        "of the lowest spring follows the height with the time constant reference_time, which makes it "
        "another model below 1 / (2 pi reference_time).",
        "Aerodynamic uplift is a coefficient times the square of the speed, as on open track.",
        "Straight track; the roof's motion is an input (base.z, base.vz; base.y, base.roll and their "
        "rates, which shift and turn the strip but do not excite the masses; 0 if not connected).",
    )

    def _read_definition(self, path: Path) -> LumpedDefinition:
        return load_lumped(path)

    def _make_part(self, definition: LumpedDefinition) -> LumpedPantographPart:
        return LumpedPantographPart(definition)

    def _make_ports(self, part: LumpedPantographPart) -> Ports:
        ports = pantograph_ports(part, (*DRIVE_SIGNALS, *SWAY_SIGNALS[:4], *TRAIN_SIGNALS))
        signals = tuple(signal for port in ports.outputs for signal in port.signals)
        return replace(ports, outputs=(Port(signals, attrgetter("outputs")),))  # read in one piece

    def _start_warnings(self, part: LumpedPantographPart, inputs: FloatArray) -> Iterable[str]:
        yield working_height_warning(part.definition, float(inputs[1]), float(inputs[3]))
        yield idle_values(part.definition)
        yield acceleration_warning(part.definition.speed_profile)

    def _told(self, part: LumpedPantographPart) -> list[str]:
        return part.told

    def _initialise(self, part: LumpedPantographPart, time: float, inputs: FloatArray) -> None:
        part.initialise(time, float(inputs[0]), inputs[1:4], inputs[4:6], _drive(inputs))

    def _advance(self, part: LumpedPantographPart, inputs: FloatArray, step: float) -> None:
        part.step(float(inputs[0]), inputs[1:4], inputs[4:6], step, _drive(inputs))


def _drive(inputs: FloatArray) -> Drive:
    rate, air, uplift, *sway, x, vx = inputs[6:15].tolist()
    return Drive(rate, air, uplift, 0.0, (*sway, 0.0, 0.0), (x, vx))


def pantograph_ports(part: Any, more: Iterable[Signal] = ()) -> Ports:
    """Return the ports that every pantograph has, more inputs if it has some, and those of its observations."""
    return Ports(
        inputs=(
            Signal("contact.force", "N", "contact force; positive pushes the strip down", 0.0),
            *vector("contact.", "m", "point of application of the contact force", (0.0, 0.0, 0.0)),
            Signal("base.z", "m", "displacement of the vehicle's roof, up", 0.0),
            Signal("base.vz", "m/s", "velocity of the vehicle's roof, up", 0.0),
            *more,
        ),
        outputs=(
            Port(tuple(s for end in "AB" for s in _end(end)), attrgetter("strip")),
            Port(tuple(Signal(*observed) for observed in part.observed), methodcaller("observation_values")),
        ),
        local=energy_ports(["contact"]),
    )


def _end(end: str) -> tuple[Signal, ...]:
    text = f"of end {end} of the collector strip"
    return vector(f"{end}.", "m", f"position {text}") + vector(f"{end}.v", "m/s", f"velocity {text}")
