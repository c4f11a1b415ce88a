"""Ports of an overhead contact line."""

from __future__ import annotations

from collections.abc import Iterable
from operator import attrgetter
from pathlib import Path
from typing import ClassVar

import models.scipy_start  # noqa: F401  before all that imports SciPy
from fmus.slave.adapter import Adapter
from fmus.slave.ports import Port, Ports, Signal, energy_ports, vector
from models.arrays import FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.line_reading import load
from models.catenary.line_advice import (
    slack_law_warning,
    slack_warning,
    speed_warning,
    step_warning,
    surface_warning,
    track_warning,
)
from models.catenary.line_part import CatenaryPart

#: An unconnected port is a strip far below the wire, which touches nothing.
_FAR_BELOW = -100.0
_HALF_WIDTH = {"A": 0.5, "B": -0.5}


class CatenarySlave(Adapter[CatenaryDefinition, CatenaryPart]):
    """Overhead contact line: collector strips in, contact forces and points out."""

    pantographs: ClassVar[int] = 1
    models: ClassVar[str] = (
        "An overhead contact line of several spans in three dimensions: contact wire and messenger wire (and stitch "
        "wires, where the definition has them) as tensioned Euler-Bernoulli beams, droppers that carry tension only, "
        "steady arms, stagger, clamps as lumped masses, proportional damping. The static shape is found first (given "
        "contact-wire height and pre-sag, the dropper lengths follow), then, with errors of assembly, active faults or "
        "another temperature, where the line comes to rest with the lengths and supports that these leave it; the "
        "dynamics are linear about "
        "it, except for slackening droppers and the contact, and are integrated with constant steps. The pantograph "
        "gives the ends of its collector strip; the line finds where the wire crosses the strip, the contact force "
        "from the interpenetration, and its point of application. Between communication points the strip is continued "
        "from its last positions and velocities, so hosts that hold inputs lose no accuracy."
    )
    limits: ClassVar[tuple[str, ...]] = (
        "Displacements are small against the spans: geometry is linearised about the static shape.",
        "Droppers and steady arms are held back across their axes by their tension at rest, unless "
        "dynamics.geometric_stiffness is 0; a dropper that goes slack in the run keeps that, an error of second order "
        "in a lateral force.",
        "What a slack dropper does is the definition's slack_law: with tension it carries nothing, with elastic_only, "
        "the form of the 2012 thesis, its damper goes on acting. dropper[...].force is all that a dropper carries, the "
        "damper's part included; dropper[...].slack says whether it is slack.",
        "The contact is unilateral, without friction along the strip. A running surface is the same over the wire's "
        "width, and what it takes from the train's traction is in no output.",
        "Errors of assembly and faults are there from the start of a run; uplift "
        "counts from where they have left the line, not from the design. No wire breaks.",
        "On a curved or canted track x is the length of the track's axis, y and z lie in the rail plane. Curves act as "
        "loads on the wires at rest: offsets between supports are wrong by about (L/2R)^2/6 of themselves, lengths by "
        "y/R; no crossing of two tracks, no inertia of the curve along the track, radii of 150 m and more.",
        "Temperature and tensioning devices act on the line at rest, before the run; in it tensions stay.",
        "No wind in a run, no wear that goes on, no aerodynamic forces; no electrical model.",
        "Parameters that change how many elements or droppers there are need another FMU, built from an edited "
        "definition.",
        "A strip beyond the modelled length finds no wire. A line that closes on itself has no end: a strip meets the "
        "same wire again after every lap, with what its last passage has left of the wire's motion.",
        "Whatever the definition marks as a choice is not taken from the source.",
    )

    def _read_definition(self, path: Path) -> CatenaryDefinition:
        return load(path, carried=True)

    def _make_part(self, definition: CatenaryDefinition) -> CatenaryPart:
        return CatenaryPart(definition, pantographs=self.pantographs)

    def _make_ports(self, part: CatenaryPart) -> Ports:
        numbers = range(1, self.pantographs + 1)
        return Ports(
            inputs=tuple(s for p in numbers for end in "AB" for s in _end(p, end)),
            outputs=(_output_port(numbers, part),),
            asked=(_nominal_port(numbers),),
            local=(*_dropper_ports(part), *energy_ports([f"pantograph[{p}].contact" for p in numbers])),
            calculated=(
                *_geometry_ports(part),
                *_section_ports(part),
                *_extent_ports(part),
                _wave_port(),
                _elasticity_port(),
            ),
        )

    def _initialise(self, part: CatenaryPart, time: float, inputs: FloatArray) -> None:
        part.initialise(time, inputs.reshape(self.pantographs, 2, 2, 3))

    def _advance(self, part: CatenaryPart, inputs: FloatArray, step: float) -> None:
        part.step(inputs.reshape(self.pantographs, 2, 2, 3), step)

    def _start_warnings(self, part: CatenaryPart, inputs: FloatArray) -> Iterable[str]:
        strips = inputs.reshape(self.pantographs, 2, 2, 3)
        along_track = strips[:, :, 1, 0]
        part.check_strips(strips)
        yield part.start_warning(strips)
        yield slack_warning(part.droppers, part.model.static.is_slack)
        yield slack_law_warning(part.definition)
        yield track_warning(part.definition)
        speed = float(abs(along_track).max())
        yield speed_warning(part.definition, speed)
        yield surface_warning(part.definition, speed, part.definition.time_step)

    def _step_warning(self, part: CatenaryPart, step: float) -> str:
        return step_warning(part.definition, step)


def _end(number: int, end: str) -> tuple[Signal, ...]:
    name, text = f"pantograph[{number}].{end}", f"of end {end} of the collector strip"
    position = vector(f"{name}.", "m", f"position {text}", (0.0, _HALF_WIDTH[end], _FAR_BELOW))
    return position + vector(f"{name}.v", "m/s", f"velocity {text}", (0.0, 0.0, 0.0))


def _output_port(numbers: range, part: CatenaryPart) -> Port:
    """Return what the part hands out in one piece: resultants, their points, forces per wire if several, uplifts."""
    force = tuple(
        Signal(
            f"pantograph[{p}].contact.force",
            "N",
            "contact force; positive pushes the wire up, the strip down",
        )
        for p in numbers
    )
    point = tuple(
        s
        for p in numbers
        for s in vector(f"pantograph[{p}].contact.", "m", "point of application of the contact force")
    )
    sections = range(1, part.section_count + 1) if part.section_count > 1 else ()
    of_sections = tuple(
        Signal(f"pantograph[{p}].section[{s}].force", "N", f"part of the contact force on wire section {s}")
        for p in numbers
        for s in sections
    )
    uplift = tuple(
        Signal(f"support[{i}].uplift", "m", f"uplift of the contact wire at support {s.name}, x = {s.x:g} m")
        for i, s in enumerate(part.supports, 1)
    )
    return Port((*force, *point, *of_sections, *uplift), attrgetter("outputs"))


def _nominal_port(numbers: range) -> Port:
    text = "height of the contact wire under the strip's middle, its supports joined by straight lines"
    height = tuple(Signal(f"pantograph[{p}].nominal.z", "m", f"nominal {text}") for p in numbers)
    rate = tuple(Signal(f"pantograph[{p}].nominal.vz", "m/s", f"rate of nominal.z as strip {p} runs") for p in numbers)
    return Port((*height, *rate), attrgetter("nominal"))


def _dropper_ports(part: CatenaryPart) -> tuple[Port, ...]:
    observed = (("force", "N", "tension of"), ("slack", "1", "1 while it is slack, else 0:"))
    return tuple(
        Port(
            tuple(
                Signal(f"dropper[{j}].{name}", unit, f"{text} dropper {d.name}, x = {d.x:g} m")
                for j, d in enumerate(part.droppers, 1)
            ),
            attrgetter(f"dropper_{name}"),
        )
        for name, unit, text in observed
    )


def _geometry_ports(part: CatenaryPart) -> tuple[Port, ...]:
    supports = [
        ("x", "support_x", "position along the track"),
        ("y", "support_y", "static lateral position of the contact wire"),
        ("z", "support_z", "static height of the contact wire"),
        ("messenger_wire.z", "support_messenger_z", "static height of the messenger wire"),
    ]
    droppers = [
        ("x", "dropper_x", "position along the track"),
        ("lower.y", "dropper_lower_y", "static lateral position of the lower end"),
        ("lower.z", "dropper_lower_z", "static height of the lower end"),
        ("upper.z", "dropper_upper_z", "static height of the upper end"),
        ("length", "dropper_length", "unstressed length"),
    ]
    return (
        *(_length_port("support", len(part.supports), *row) for row in supports),
        *(_length_port("dropper", len(part.droppers), *row) for row in droppers),
    )


def _section_ports(part: CatenaryPart) -> tuple[Port, ...]:
    """Say of every support and dropper which section it belongs to, where there are several."""
    if part.section_count == 1:
        return ()
    counts = (("support", len(part.supports)), ("dropper", len(part.droppers)))
    return tuple(
        Port(
            tuple(Signal(f"{thing}[{i}].section", "1", f"section of {thing} {i}") for i in range(1, count + 1)),
            attrgetter(f"geometry.{thing}_section"),
        )
        for thing, count in counts
    )


def _extent_ports(part: CatenaryPart) -> tuple[Port, ...]:
    """Say where the wire begins and ends, or after which length a line repeats that closes on itself."""
    if not part.period.any():
        ends = ("begin", "end")
        signals = tuple(Signal(f"contact_wire.{e}", "m", f"{e} of the contact wire along the track") for e in ends)
        return (Port(signals, attrgetter("contact_wire_ends")),)
    text = "length after which the line repeats: its last span ends where its first one begins"
    return (Port((Signal("period", "m", text),), attrgetter("period")),)


def _wave_port() -> Port:
    signal = Signal("contact_wire.wave_speed", "m/s", "speed of transverse waves in the contact wire, longest span")
    return Port((signal,), attrgetter("contact_wire_wave_speed"))


def _elasticity_port() -> Port:
    text = "static uplift per force under 100 N in the middle span"
    signals = (
        Signal("elasticity.mid_span", "m/N", f"{text}, at its middle"),
        Signal("elasticity.support", "m/N", f"{text}, at its first support"),
    )
    return Port(signals, attrgetter("elasticity"))


def _length_port(thing: str, count: int, name: str, attribute: str, text: str) -> Port:
    signals = tuple(Signal(f"{thing}[{i}].{name}", "m", f"{text}, {thing} {i}") for i in range(1, count + 1))
    return Port(signals, attrgetter(f"geometry.{attribute}"))
