"""A line at several temperatures: tensions, movements, sags, and how far cantilevers and droppers slant."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from models.arrays import FloatArray
from models.catenary.condition.faults import tension_left
from models.catenary.condition.line_condition import find_condition
from models.catenary.condition.tensioning import WireTension, ruling_span, swing, wire_tensions
from models.catenary.definition.line_definition import COMPONENTS, CatenaryDefinition
from models.catenary.definition.section_definition import Section, Span
from models.catenary.shape.form_finding import EquilibriumError, StaticState
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.catenary.statics.overbridge_room import highest_wires
from models.catenary.statics.wire_waves import Waves, waves
from models.definition_files.parameter import ParameterError


@dataclass(frozen=True)
class WireAtTemperature:
    """One wire of a section at one temperature.

    Attributes
    ----------
    wire : WireTension
        Tensions and movement.
    weight_movement : float
        Downwards, of the weights at the end that moves farthest [m]; NaN without weights.
    sag : float
        Below the line between its supports, in the middle of the span that is nearest to the ruling span [m].
    """

    wire: WireTension
    weight_movement: float
    sag: float


@dataclass(frozen=True)
class LineAtTemperature:
    """A section of a line at one temperature.

    Attributes
    ----------
    temperature : float
        [K].
    wires : tuple of WireAtTemperature
    cantilever_angle : float
        Largest of the contact wire's cantilevers in plan [rad].
    stagger_change : float
        Largest movement of a registration end towards its mast [m].
    dropper_slant : float
        Largest slant of droppers along the track, difference of movements over mean length.
    waves : Waves
        In the span where the contact wire's waves are slowest, with the tensions that the wires have there.
    highest : ndarray, shape (n_overbridges,)
        Height of the highest wire under each of the line's bridges [m]; NaN where there is none.
    """

    temperature: float
    wires: tuple[WireAtTemperature, ...]
    cantilever_angle: float
    stagger_change: float
    dropper_slant: float
    waves: Waves
    highest: FloatArray


def temperature_table(
    definition: CatenaryDefinition, temperatures: Iterable[float], section: int = 0, speed: float = 0.0
) -> tuple[LineAtTemperature, ...]:
    """Return a section of a line at some temperatures [K], with the wave figures at a train speed [m/s].

    Temperatures are asked for one by one, each when the one before is done.

    Raises
    ------
    ParameterError
        If the line says nothing of its tensioning, or a temperature is out of range.
    EquilibriumError
        If the line has no equilibrium at one of them.
    """
    check_tensioned(definition)
    design = kept_form(definition, build_mesh(definition))
    return tuple(_at(design, temperature, section, speed) for temperature in temperatures)


def check_tensioned(definition: CatenaryDefinition) -> None:
    """Refuse a line that says nothing of its tensioning.

    Raises
    ------
    ParameterError
    """
    if definition.tensioning is None:
        raise ParameterError(
            f"line '{definition.name}' has no table [tensioning]: what it does over temperature is not known; give at "
            "least temperature and reference_temperature there"
        )


def ruling(section: Section) -> tuple[float, Span]:
    """Return the ruling span of a section [m], and a span to look at: of nearest length, nearest to the middle.

    It is one at the working height, if there is any.
    """
    wanted = ruling_span([span.length for span in section.spans])
    middle = 0.5 * (section.spans[0].start + section.spans[-1].end)
    first, last = section.ends.working
    level = [span for span in section.spans if first <= span.start and span.end <= last] or section.spans
    nearest = min(abs(span.length - wanted) for span in level)
    alike = [span for span in level if abs(span.length - wanted) < nearest + 1e-6]
    return wanted, min(alike, key=lambda span: abs(0.5 * (span.start + span.end) - middle))


def _at(design: StaticState, temperature: float, index: int, speed: float) -> LineAtTemperature:
    definition = design.shape.definition.with_values({"tensioning.temperature": temperature})
    tensioning, section = definition.tensioning, definition.sections[index]
    assert tensioning is not None
    designed = replace(design, shape=replace(design.shape, definition=definition))
    try:
        state = find_condition(designed)
        wires = [_left(state, wire) for wire in wire_tensions(designed) if wire.section == index]
    except EquilibriumError as error:
        where = f"at {temperature - 273.15:g} degC"
        raise EquilibriumError(str(error) if where in str(error) else f"{where}: {error}") from error
    contact, upper = wires[0], wires[2] if len(wires) > 2 else wires[1]
    x = contact.ends[1:-1]
    moved = np.abs(contact.strain * (x - contact.fixed_point)).max(initial=0.0)
    slant = abs(contact.strain - upper.strain) * np.abs(x - contact.fixed_point).max(initial=0.0)
    span = ruling(section)[1]
    return LineAtTemperature(
        temperature=temperature,
        wires=tuple(
            WireAtTemperature(wire, _weight_movement(definition, wire), _sag(state, wire, span)) for wire in wires
        ),
        cantilever_angle=math.asin(moved / tensioning.cantilever_length),
        stagger_change=float(swing(np.array(moved), tensioning.cantilever_length)),
        dropper_slant=float(slant / _mean_length(design, index)),
        waves=_slowest(definition, contact, upper, speed),
        highest=highest_wires(state, definition.overbridge),
    )


def _left(state: StaticState, wire: WireTension) -> WireTension:
    """Return what a fault leaves of the tensions of a wire: the same share everywhere."""
    mesh = state.shape.mesh
    share = tension_left(state.shape.definition, mesh)
    own = (mesh.component == COMPONENTS.index(wire.component)) & (mesh.section[mesh.beams[:, 0]] == wire.section)
    left = float(share[own][0])
    return replace(wire, tension=left * wire.tension, at_tensioner=left * wire.at_tensioner)


def _slowest(definition: CatenaryDefinition, contact: WireTension, upper: WireTension, speed: float) -> Waves:
    """Return the wave figures in the span in which waves are slowest, at a train speed [m/s]."""
    every = [
        waves(definition, speed, float(length), float(below), float(above))
        for length, below, above in zip(np.diff(contact.ends), contact.tension, upper.tension, strict=True)
    ]
    return min(every, key=lambda each: each.speed)


def _weight_movement(definition: CatenaryDefinition, wire: WireTension) -> float:
    assert definition.tensioning is not None
    device = definition.tensioning.of(wire.component)
    return float(device.ratio * wire.movement) if device.kind == "weights" else math.nan


def _mean_length(design: StaticState, index: int) -> float:
    mesh = design.shape.mesh
    chosen = (mesh.section[mesh.droppers[:, 0]] == index) & ~mesh.is_hanger
    return float(design.droppers.length[chosen].mean()) if chosen.any() else 1.0


def _sag(state: StaticState, wire: WireTension, span: Span) -> float:
    nodes = next(
        c.nodes for c in state.shape.mesh.chains if c.component == wire.component and c.section == wire.section
    )
    x: FloatArray = state.shape.mesh.points[nodes, 0]
    start, middle, end = np.interp([span.start, 0.5 * (span.start + span.end), span.end], x, state.positions[nodes, 2])
    return float(0.5 * (start + end) - middle)
