"""Ports of a multibody pantograph: those of every pantograph."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import ClassVar

from fmus.slave.adapter import Adapter
from fmus.slave.lumped_slave import DRIVE_SIGNALS, SWAY_SIGNALS, TRAIN_SIGNALS, pantograph_ports
from fmus.slave.ports import Ports, Signal
from models.arrays import FloatArray
from models.pantograph.multibody.analysis.posture import check_heights
from models.pantograph.multibody.mechanism import MechanismError
from models.pantograph.multibody.mechanism_definition import MechanismDefinition
from models.pantograph.multibody.mechanism_reading import load_mechanism
from models.pantograph.multibody.multibody_part import MultibodyPantographPart
from models.pantograph.operation import Drive
from models.pantograph.train_motion import acceleration_warning


class MultibodyPantographSlave(Adapter[MechanismDefinition, MultibodyPantographPart]):
    """Pantograph of rigid bodies and joints: contact force and point in, collector strip out."""

    models: ClassVar[str] = (
        "A pantograph as rigid bodies with joints, springs, dampers and an actuator, on a roof that moves along the "
        "track at its speed, by its speed profile or as train.x and train.vx say. "
        "It starts at rest with the strip at reference_height, the actuator just carrying "
        "the weights; from raise_start the actuator grows to its value over raise_duration. The contact force acts "
        "on the head where the line says, so that a staggered wire makes the head roll, and the strip's ends follow. "
        "Where the mechanism allows it, the equations of motion are solved in as few coordinates as it has, otherwise "
        '(and with formulation = "general" in the definition) for all bodies; the log says which when a run starts.'
    )
    limits: ClassVar[tuple[str, ...]] = (
        "Rigid bodies and ideal joints, unless the definition says otherwise (bushings, friction, stops). Dry friction "
        "goes with the hyperbolic tangent of the speed, so that it creeps at rest.",
        "Aerodynamic uplift is a coefficient times the square of the speed, as on open track, brought to the strip by "
        "the lifting element; an element that has a cam holds its force ideally, real cams deviate by their tolerance.",
        "Straight track; the roof's motion is an input (base.z, base.y, base.roll, base.yaw and "
        "their rates; 0 if not connected).",
    )

    def _read_definition(self, path: Path) -> MechanismDefinition:
        return load_mechanism(path)

    def _make_part(self, definition: MechanismDefinition) -> MultibodyPantographPart:
        return MultibodyPantographPart(definition)

    def design_problem(self) -> str:
        """Return why it cannot stand where its heights say, empty if it can."""
        return check_heights(self._definition)

    def _make_ports(self, part: MultibodyPantographPart) -> Ports:
        unit = "N.m" if part.definition.lifts_by_moment else "N"
        text = "what the lifting element gives, in place of all else, if lift_input is 1"
        lift = Signal("lift.value", unit, text, 0.0)
        return pantograph_ports(part, (*DRIVE_SIGNALS[1:], lift, *SWAY_SIGNALS, *TRAIN_SIGNALS))

    def _start_remark(self, part: MultibodyPantographPart) -> str:
        return part.form()

    def _start_warnings(self, part: MultibodyPantographPart, inputs: FloatArray) -> Iterable[str]:
        yield part.working_height_warning(float(inputs[1]), float(inputs[3]))
        yield part.mechanism_warning()
        yield acceleration_warning(part.definition.speed_profile)

    def _told(self, part: MultibodyPantographPart) -> list[str]:
        return part.told

    def _initialise(self, part: MultibodyPantographPart, time: float, inputs: FloatArray) -> None:
        try:
            part.initialise(time, float(inputs[0]), inputs[1:4], inputs[4:6], _drive(inputs))
        except MechanismError as error:
            file = type(self).__name__.removeprefix("Pantograph_")
            raise MechanismError(f"{error} (see {file}.toml, or the values that were set of its parameters)") from error

    def _advance(self, part: MultibodyPantographPart, inputs: FloatArray, step: float) -> None:
        part.step(float(inputs[0]), inputs[1:4], inputs[4:6], step, _drive(inputs))


def _drive(inputs: FloatArray) -> Drive:
    air, uplift, lift, y, vy, roll, roll_rate, yaw, yaw_rate, x, vx = inputs[6:17].tolist()
    return Drive(0.0, air, uplift, lift, (y, vy, roll, roll_rate, yaw, yaw_rate), (x, vx))
