"""What a scenario has to know of definitions: where a line can be run on, what lifts a pantograph."""

from __future__ import annotations

import itertools
from typing import Final, NamedTuple

import numpy as np

from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.section_definition import Section
from models.pantograph.lumped.lumped_definition import LumpedDefinition
from models.pantograph.multibody.mechanism_definition import MechanismDefinition

#: Heights of a level contact wire at its supports differ by less than this [m] (choice).
_LEVEL: Final = 0.02


class LineFacts(NamedTuple):
    """A line along the track, all in m.

    Attributes
    ----------
    begin, end : float
        Where the contact wire is at its working height.
    supports : tuple of float
        Within that.
    lowest, height : float
        Height of the contact wire: the lowest, and at the supports, if these differ at the first.
    is_ring : bool
        Whether the line closes on itself at ``end``.
    overlaps : tuple of (begin, end)
        Where a section and the next one both have wires.
    changes_height : bool
        Whether the supports hold the contact wire at different heights.
    """

    begin: float
    end: float
    supports: tuple[float, ...]
    lowest: float
    height: float
    is_ring: bool
    overlaps: tuple[tuple[float, float], ...] = ()
    changes_height: bool = False


class LiftFacts(NamedTuple):
    """What lifts a pantograph.

    Attributes
    ----------
    parameter, unit : str
    value : float
    can_follow : bool
        Whether ``follow_height`` makes it the force at every height.
    """

    parameter: str
    unit: str
    value: float
    can_follow: bool


def line_facts(line: CatenaryDefinition) -> LineFacts:
    """Return where a line can be run on."""
    begin = min(_working(section)[0] for section in line.sections)
    end = max(_working(section)[1] for section in line.sections)
    supports = sorted({x for section in line.sections for span in section.spans for x in (span.start, span.end)})
    inside = tuple(x for x in supports if begin <= x <= end)
    height = next(h for section in line.sections for h in _heights(line, section))
    changes = any(_changes_height(line, section) for section in line.sections)
    is_ring = line.sections[0].periodic
    return LineFacts(begin, end, inside, _lowest(line), height, is_ring, _overlaps(line), changes)


def lift_facts(pantograph: LumpedDefinition | MechanismDefinition) -> LiftFacts:
    """Return what lifts a pantograph."""
    if isinstance(pantograph, LumpedDefinition):
        return LiftFacts("static_force", "N", pantograph.static_force, True)
    if pantograph.static_moment is not None:
        return LiftFacts("static_moment", "N.m", pantograph.static_moment, False)
    return LiftFacts("static_force", "N", pantograph.static_force or 0.0, False)


def _overlaps(line: CatenaryDefinition) -> tuple[tuple[float, float], ...]:
    ordered = sorted(line.sections, key=lambda section: section.spans[0].start)
    zones = ((ahead.spans[0].start, behind.spans[-1].end) for behind, ahead in itertools.pairwise(ordered))
    return tuple((begin, end) for begin, end in zones if begin < end)


def raised_after(pantograph: LumpedDefinition | MechanismDefinition) -> float:
    """Return how long after the start the uplift has grown to its value [s]."""
    return pantograph.raise_start + pantograph.raise_duration


def _working(section: Section) -> tuple[float, float]:
    if section.periodic:
        return section.spans[0].start, section.spans[-1].end
    return section.ends.working


def _changes_height(line: CatenaryDefinition, section: Section) -> bool:
    """Return whether the specified heights at the supports differ by more than these are set to."""
    if not section.measured:
        return float(np.ptp(_heights(line, section))) > _LEVEL
    supports = sorted({x for span in section.spans for x in (span.start, span.end)})
    x, z = zip(*section.measured, strict=True)
    return float(np.ptp(np.interp(supports, x, z))) > _LEVEL


def _lowest(line: CatenaryDefinition) -> float:
    """Return the lowest height that is prescribed for the contact wire [m]."""
    longest = max(span.length for section in line.sections for span in section.spans)
    measured = [z for section in line.sections for _, z in section.measured]
    supports = min(h for section in line.sections for h in _heights(line, section))
    return min(measured, default=supports - max(0.0, line.profile.pre_sag) * longest)


def _heights(line: CatenaryDefinition, section: Section) -> list[float]:
    """Return the heights of the contact wire at a section's supports [m]."""
    nominal = line.profile.contact_wire_height
    return [nominal if s.contact_wire_height is None else s.contact_wire_height for s in section.supports]
