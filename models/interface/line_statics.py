"""A line at rest: shape, droppers and steady arms of a section, elasticity and waves of one of its spans."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from models.arrays import FloatArray
from models.catenary import line_advice
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.overbridge_definition import Overbridge
from models.catenary.definition.section_definition import Span
from models.catenary.line_model import CatenaryModel
from models.catenary.line_part import CatenaryPart
from models.catenary.statics import elasticity as under_force
from models.catenary.statics import rest_profile, wire_waves
from models.catenary.statics.found_tension import found_tension
from models.catenary.statics.overbridge_room import OverbridgeRoom, overbridge_room
from models.catenary.statics.support_loads import SupportLoads, support_loads
from models.definition_files.given_value import quantity
from models.definition_files.parameter import ParameterError
from models.interface.column_frames import Table, Tabled
from models.interface.line_and_pantograph import Line, open_line
from models.interface.norm_judgement import Judgement
from models.interface.support_verdicts import overbridge_verdicts, support_verdicts
from models.library.norm_tables import gradient_limits, support_limits

_T = TypeVar("_T")


@dataclass(frozen=True)
class LineStatics(Tabled):
    """A section of a line at rest, and one span in detail; SI.

    Attributes
    ----------
    model : CatenaryModel
        The line in its static state; no promise is kept for this attribute.
    section : int
        Index of the section, from 0.
    number : int
        Number of the span in detail, from 1.
    span : Span
        Its ``start``, ``end`` and ``droppers`` [m].
    profiles : tuple of Profile
        ``component``, ``x``, ``y``, ``z`` of every wire [m].
    droppers : Droppers
        ``x``, ``length`` [m], ``force`` [N], ``is_hanger`` of every dropper.
    arms : ArmLoads
        ``x`` [m], ``lateral``, ``lift`` [N] of every steady arm.
    supports : SupportLoads
        ``x``, ``height`` [m], ``lateral`` [N] (left > 0), ``gradient`` and more of every support between the anchors.
    overbridges : OverbridgeRoom
        ``highest``, ``clearance``, ``encumbrance``, ``lift`` [m] of every bridge over the line.
    judgements : tuple of Judgement
        What norms say of supports, droppers, gradients and overbridges: ``what``, ``figure``, ``word``, ``limit``,
        ``source``, ``passed``.
    elasticity : Elasticity
        ``x`` [m], ``value`` [m/N] along the span, ``minimum``, ``maximum``, ``non_uniformity``.
    others : dict
        Number and elasticity of the middle span of every other section, by its index.
    waves : Waves
        ``speed``, ``limit`` [m/s], ``reflection``, ``doppler``, ``amplification``.
    warnings : tuple of str
        What deserves a second look.
    """

    model: CatenaryModel
    section: int
    number: int
    span: Span
    profiles: tuple[rest_profile.Profile, ...]
    droppers: rest_profile.Droppers
    arms: rest_profile.ArmLoads
    supports: SupportLoads
    overbridges: OverbridgeRoom
    judgements: tuple[Judgement, ...]
    elasticity: under_force.Elasticity
    others: dict[int, tuple[int, under_force.Elasticity]]
    waves: wire_waves.Waves
    warnings: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<LineStatics of {self.model.definition.name}, span {self.number}>"

    @property
    def verdicts(self) -> tuple[tuple[str, str], ...]:
        """Return what was judged, and figure, verdict and limit in a line."""
        return tuple((judged.what, judged.text) for judged in self.judgements)

    @property
    def span_droppers(self) -> rest_profile.Droppers:
        """Return the droppers (and hangers) of the span in detail."""
        return rest_profile.droppers(self.model, self.span.start, self.span.end, self.section)

    @property
    def tables(self) -> dict[str, Table]:
        """Columns by name: ``droppers``, ``elasticity``, ``steady_arms``, ``supports``, and every kind of wire.

        Of a line with bridges over it, ``overbridges`` too, in the order of the file.
        """
        d, a = self.droppers, self.arms
        all_sections = {self.section: self.elasticity} | {section: other for section, (_, other) in self.others.items()}
        parts = [(np.full_like(e.x, section + 1), e.x, 1e3 * e.value) for section, e in sorted(all_sections.items())]
        titles = ("x [m]", "unstrained length [m]", "tension [N]", "hanger")
        found: dict[str, Table] = {
            "droppers": (titles, (d.x, d.length, d.force, d.is_hanger)),
            "elasticity": (("section", "x [m]", "elasticity [mm/N]"), _joined(parts)),
            "steady_arms": (("x [m]", "lateral load [N]", "lift [N]"), (a.x, a.lateral, a.lift)),
        }
        found["supports"] = _support_table(self.supports)
        if self.model.definition.overbridge:
            found["overbridges"] = _overbridge_table(self.model.definition.overbridge, self.overbridges)
        for component in dict.fromkeys(p.component for p in self.profiles):
            same = [(p.x, p.y, p.z) for p in self.profiles if p.component == component]  # stitch wires one by one
            found[component] = (("x [m]", "y [m]", "z [m]"), _joined(same))
        return found


def statics(
    line: Line | str | Path,
    *,
    span: int | None = None,
    section: int = 1,
    speed: float | str = "300 km/h",
    force: float | str = "100 N",
) -> LineStatics:
    """Find the shape of a line at rest, its droppers and steady arms, and elasticity and waves of one span.

    Parameters
    ----------
    line : Line, str or Path
        From `open_line`, or what it takes.
    span : int, optional
        Span in detail, from 1; by default the middle one.
    section : int
        Section of a line with overlaps, from 1.
    speed : float or str
        Speed of the train for the wave figures, in m/s or with a unit.
    force : float or str
        Force of the elasticity, in N or with a unit.

    Raises
    ------
    ParameterError
        If the line has no such section or span, or speed or force cannot be meant.

    Examples
    --------
    >>> found = statics("LN2", span=12)
    >>> round(1e3 * found.elasticity.maximum, 2), round(3.6 * found.waves.speed)
    (0.43, 441)
    """
    found = line if isinstance(line, Line) else open_line(line)
    whole("section", section)
    if span is not None:
        whole("span", span)
    values = {"speed": given("speed", speed, "m/s"), "force": given("force", force, "N")}
    return at_rest(found.definition, span, section, **values)


#: Highest speed of a train that is meant in m/s: above it km/h were [m/s].
FASTEST = 200.0
#: Greatest force of an elasticity that is meant [N].
_STRONGEST = 10e3


def given(name: str, value: float | str, unit: str, fastest: float = FASTEST) -> float:
    """Return a quantity greater than 0 that was given from Python, in SI; a speed of trains unless it may be faster.

    Raises
    ------
    ParameterError
        If it is none.
    """
    try:
        found = quantity(name, value, unit)
    except (TypeError, ValueError) as error:
        raise ParameterError(str(error)) from error
    if found <= 0.0:
        raise ParameterError(f"{name}: {value} must be greater than 0 {unit}")
    if unit == "m/s" and found > fastest:
        raise ParameterError(f"{name}: {found:g} m/s is faster than any train; give it with its unit ('{value} km/h')")
    return found


def whole(name: str, value: object) -> None:
    """Refuse what is not a whole number where one was to be given from Python.

    Raises
    ------
    ParameterError
    """
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise ParameterError(f"{name}: {value!r} is not a whole number")


def listed(name: str, values: Iterable[_T], example: str) -> list[_T]:
    """Return what was to be given as a list from Python.

    Raises
    ------
    ParameterError
        If it is a single value; `example` shows a list.
    """
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise ParameterError(f"{name}: {values!r} is not a list; write {example}")
    return list(values)


def at_rest(definition: CatenaryDefinition, span: int | None, section: int, speed: float, force: float) -> LineStatics:
    """Return the statics of a section and a span, both counted from 1, at a speed [m/s] and under a force [N].

    Raises
    ------
    ParameterError
        If the line has no such section or span, or speed or force are none of a train.
    """
    if speed > FASTEST:
        raise ParameterError(f"speed {3.6 * speed:g} km/h is faster than any train; check the unit")
    if force > _STRONGEST:
        raise ParameterError(f"force {force:g} N is more than any pantograph pushes with; check the unit")
    if not 1 <= section <= len(definition.sections):
        raise ParameterError(f"section {section}: the line has sections 1 to {len(definition.sections)}")
    index = section - 1
    spans = definition.sections[index].spans
    number = span if span is not None else (len(spans) + 1) // 2
    if not 1 <= number <= len(spans):
        raise ParameterError(f"span {number}: the line has spans 1 to {len(spans)}")
    chosen = spans[number - 1]
    part = CatenaryPart(definition)
    model = part.model
    warnings = (
        line_advice.speed_warning(definition, speed),
        line_advice.slack_warning(part.droppers, model.static.is_slack),
        line_advice.slack_law_warning(definition),
        line_advice.track_warning(definition),
    )
    hung = rest_profile.droppers(model, section=index)
    supports, room = support_loads(model, index), overbridge_room(model, force)
    return LineStatics(
        model=model,
        section=index,
        number=number,
        span=chosen,
        profiles=rest_profile.profiles(model, index),
        droppers=hung,
        arms=rest_profile.arm_loads(model, index),
        supports=supports,
        overbridges=room,
        judgements=(
            *support_verdicts(supports, hung, support_limits(), gradient_limits(), speed),
            *overbridge_verdicts(definition.overbridge, room, force),
        ),
        elasticity=_elasticity(model, index, number, force),
        others={
            other: (middle := (len(s.spans) + 1) // 2, _elasticity(model, other, middle, force))
            for other, s in enumerate(definition.sections)
            if other != index
        },
        waves=_waves(model, index, chosen, speed),
        warnings=tuple(filter(None, warnings)),
    )


def _waves(model: CatenaryModel, section: int, span: Span, speed: float) -> wire_waves.Waves:
    """Return the wave figures in a span, with the tensions that the wires have there as the line is found."""
    middle, definition = np.array([0.5 * (span.start + span.end)]), model.definition
    upper = "messenger_wire" if definition.auxiliary_wire is None else "auxiliary_wire"
    above, below = (float(found_tension(model.static, w, section, middle)[0]) for w in (upper, "contact_wire"))
    return wire_waves.waves(definition, speed, span.length, below, above)


def _overbridge_table(overbridges: Sequence[Overbridge], room: OverbridgeRoom) -> Table:
    columns = {
        "bridge": np.arange(1.0, len(overbridges) + 1.0),
        "from [m]": np.array([s.start for s in overbridges]),
        "to [m]": np.array([s.end for s in overbridges]),
        "underside [m]": np.array([s.underside for s in overbridges]),
        "highest wire [m]": room.highest,
        "encumbrance left [m]": room.encumbrance,
        "clearance at rest [m]": room.clearance,
        "lift [m]": room.lift,
        "clearance lifted [m]": room.clearance_lifted,
    }
    return tuple(columns), tuple(columns.values())


def _support_table(s: SupportLoads) -> Table:
    columns = {
        "x [m]": s.x,
        "contact wire height [m]": s.height,
        "encumbrance [m]": s.encumbrance,
        "stagger [m]": s.stagger,
        "side of the arm [1: left]": s.side,
        "lateral force on the wire [N]": s.lateral,
        "lift [N]": s.lift,
        "N [N]": s.tension,
        "N/l [N/m]": s.pendulum,
        "gradient to the next [permil]": 1e3 * s.gradient,
        "change of gradient [permil]": 1e3 * s.change,
    }
    return tuple(columns), tuple(columns.values())


def _elasticity(model: CatenaryModel, section: int, number: int, force: float) -> under_force.Elasticity:
    span = model.definition.sections[section].spans[number - 1]
    return under_force.elasticity(model, under_force.positions_in_span(span), force, section)


def _joined(parts: Sequence[tuple[FloatArray, ...]]) -> tuple[FloatArray, ...]:
    """Return columns of several tables, one table after the other."""
    return tuple(np.concatenate(column) for column in zip(*parts, strict=True))
