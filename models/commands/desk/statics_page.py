"""The page of ``statics``: verdicts, then the line from the track to the dropper sheet of every span."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.section_definition import Span
from models.catenary.shape.track import track_at
from models.catenary.statics.rest_profile import Droppers, largest_offset
from models.commands import route_plots, statics_plots, temperature_report, wind_report
from models.commands.desk import page_markup as markup
from models.commands.desk.inline_figure import inline_figure
from models.commands.desk.page_markup import NOTHING, Part
from models.interface.line_in_wind import LineInWind
from models.interface.line_over_temperature import ZERO, LineOverTemperature
from models.interface.line_statics import LineStatics
from models.interface.norm_judgement import Judgement

_WIRES: Final = ("contact_wire", "auxiliary_wire", "messenger_wire", "stitch_wire")
_SIDES: Final = {1.0: "left", -1.0: "right"}


@dataclass(frozen=True)
class Found:
    """What a page shows.

    Attributes
    ----------
    result : LineStatics
    over : LineOverTemperature, optional
    wind : LineInWind, optional
    file : str
        Of the line.
    asked : tuple of (str, str)
        What was asked for: what, value with unit.
    """

    result: LineStatics
    over: LineOverTemperature | None
    wind: LineInWind | None
    file: str
    asked: tuple[tuple[str, str], ...]

    @property
    def judgements(self) -> tuple[Judgement, ...]:
        """Return everything that was held against a limit."""
        over = () if self.over is None else self.over.judgements
        return (*self.result.judgements, *over, *(() if self.wind is None else self.wind.judgements))


def page(found: Found) -> str:
    """Return the page of a line at rest."""
    definition = found.result.model.definition
    title = definition.title or definition.name
    head = [
        f"<h1>{markup.text(title)}</h1>",
        markup.note(f"the line {definition.name} at rest, for its designer"),
        markup.badge(found.judgements),
        *(markup.warning(words) for words in found.result.warnings),
        markup.pairs([("file", found.file), *conditions(definition, found.result.section), *found.asked]),
    ]
    return markup.document(f"{definition.name} at rest", head, [part for part in _parts(found) if part.body])


def _parts(found: Found) -> Iterator[Part]:
    result = found.result
    yield Part("verdicts", "Verdicts", (markup.verdicts(found.judgements),) if found.judgements else ())
    yield _figures(result)
    chart = inline_figure(route_plots.profile(result), "route", "track, plan, heights and gradients along the line")
    remarks = []
    if result.model.definition.overbridge:
        remarks.append("Black: undersides of the bridges, by their number.")
    if result.others:
        remarks.append("Thin grey: the wires of other sections.")
    yield Part(
        "route", "Plan, profile and gradients", (markup.figure("The line along its track", chart, " ".join(remarks)),)
    )
    yield Part("supports", "Supports", tuple(_supports(result)))
    yield Part("overbridges", "Bridges over the line", tuple(_overbridges(result)))
    yield Part("span", f"Span {result.number} in detail", tuple(_span(result)))
    yield Part("temperature", "Temperature", tuple(_temperature(found.over)))
    yield Part("wind", "Wind", tuple(_wind(found.wind)))
    yield Part("droppers", "Dropper sheet", tuple(_droppers(result)), is_sheet=True)


def conditions(definition: CatenaryDefinition, section: int) -> Iterator[tuple[str, str]]:
    """Yield the conditions of reference of a line: what, value with unit."""
    wires = ((name, getattr(definition, name)) for name in _WIRES)
    tensions = [f"{name.replace('_', ' ')} {1e-3 * wire.tension:g} kN" for name, wire in wires if wire is not None]
    yield "tensions of the design", ", ".join(tensions)
    profile = definition.profile
    heights = f"{profile.contact_wire_height:g} m, encumbrance {profile.encumbrance:g} m"
    own = any(s.contact_wire_height is not None for s in definition.sections[section].inner_supports)
    yield "contact wire at the supports", f"{heights}{', single supports differ' if own else ''}"
    yield "sag wanted over the span", f"{1e3 * profile.pre_sag:g} permil"
    if (t := definition.tensioning) is not None:
        friction = {1: ", wires have lengthened", -1: ", wires have shortened"}.get(t.direction, "")
        yield "temperature of reference", f"{t.reference_temperature - ZERO:g} \u00b0C"
        yield "temperature of the line as shown", f"{t.temperature - ZERO:g} \u00b0C{friction}"
    if definition.track is not None:
        yield "track", _track(definition, section)
    e = definition.irregularity
    sigmas = {
        "dropper lengths": e.dropper_length_sigma,
        "dropper places": e.dropper_position_sigma,
        "support heights": e.support_height_sigma,
        "stagger": e.stagger_sigma,
    }
    if any(sigmas.values()):
        sigma = ", ".join(f"{name} {1e3 * value:g} mm" for name, value in sigmas.items() if value)
        yield "errors of assembly, sigma", f"{sigma}; seed {e.seed}"
    if count := sum(fault.active for fault in definition.fault):
        yield "faults that act", str(count)


def _track(definition: CatenaryDefinition, section: int) -> str:
    track, spans = definition.track, definition.sections[section].spans
    assert track is not None
    along = track_at(track, np.linspace(spans[0].start, spans[-1].end, 2001))
    tightest = float(np.abs(along.curvature).max())
    cant = float(np.abs(np.sin(along.cant)).max() * track.base)
    course = f"smallest radius {1.0 / tightest:.0f} m" if tightest else "straight"
    return f"{course}, largest cant {1e3 * cant:.0f} mm" if cant else f"{course}, without cant"


def _figures(result: LineStatics) -> Part:
    e, w, d = result.elasticity, result.waves, result.span_droppers
    contact = next(p for p in result.profiles if p.component == "contact_wire")
    place, offset = largest_offset(contact, result.supports.x)
    side = "left" if offset > 0.0 else "right"
    hung = "droppers and hangers" if d.is_hanger.any() else "droppers"
    body = [
        markup.tiles([
            (f"elasticity at {e.force:g} N, least", f"{1e3 * e.minimum:.3f}", "mm/N"),
            (f"elasticity at {e.force:g} N, greatest", f"{1e3 * e.maximum:.3f}", "mm/N"),
            ("non-uniformity u", f"{100.0 * e.non_uniformity:.1f}", "%"),
            (f"{hung}, shortest", f"{1e3 * d.length.min():.0f}" if len(d.length) else NOTHING, "mm"),
            (f"{hung}, longest", f"{1e3 * d.length.max():.0f}" if len(d.length) else NOTHING, "mm"),
            ("contact wire's largest offset", f"{1e3 * abs(offset):.0f}", "mm"),
            ("wave speed C", f"{3.6 * w.speed:.0f}", "km/h"),
            ("limit of operation 0.7 C", f"{3.6 * w.limit:.0f}", "km/h"),
            ("reflection factor r", f"{w.reflection:.3f}", ""),
            (f"Doppler factor at {3.6 * w.train_speed:g} km/h", f"{w.doppler:.3f}", ""),
            ("amplification r / Doppler", f"{w.amplification:.2f}" if math.isfinite(w.amplification) else NOTHING, ""),
        ]),
        markup.note(
            f"Elasticity and droppers of span {result.number}, {result.span.start:g} ... {result.span.end:g} m; the "
            f"largest offset at rest is {side} of the middle at {place:.0f} m, between the supports; waves "
            "with the tensions that the wires have there."
        ),
    ]  # fmt: skip
    if result.others:
        rows = [
            (str(section + 1), str(number), f"{1e3 * e.minimum:.4f}", f"{1e3 * e.maximum:.4f}",
             f"{100.0 * e.non_uniformity:.1f}")
            for section, (number, e) in sorted(result.others.items())
        ]  # fmt: skip
        body += [
            "<h3>Other sections, their middle spans</h3>",
            markup.table(("section", "span", "least [mm/N]", "greatest [mm/N]", "u [%]"), rows, leading=0),
            markup.note("Supports, droppers, temperature and wind are those of one section; --section shows another."),
        ]
    return Part("figures", "Elasticity and waves", tuple(body))


def _supports(result: LineStatics) -> Iterator[str]:
    s = result.supports
    if not len(s.x):
        return
    names = [support.structure for support in result.model.definition.sections[result.section].inner_supports]
    heads = ("support", "x [m]", "height [m]", "encumbrance [m]", "stagger [mm]", "arm", "lateral [N]", "lift [N]",
             "N [N]", "N/l [N/m]", "gradient [\u2030]", "change [\u2030]")  # fmt: skip
    rows = [
        (
            names[k] or str(k + 1), f"{s.x[k]:.2f}", f"{s.height[k]:.3f}", f"{s.encumbrance[k]:.3f}",
            f"{1e3 * s.stagger[k]:.0f}", _SIDES.get(float(s.side[k]), NOTHING), _cell(s.lateral[k], 0),
            _cell(s.lift[k], 0), _cell(s.tension[k], 0), _cell(s.pendulum[k], 0), _cell(1e3 * s.gradient[k], 2),
            _cell(1e3 * s.change[k], 2),
        )
        for k in range(len(s.x))
    ]  # fmt: skip
    yield markup.table(heads, rows, leading=0)
    yield markup.note(
        "Lateral force of the arm on the wire, left positive; lift upwards, by the arm's tension N alone; the gradient "
        "to the next support, and its change at the support. Arm: the side of its registration end."
    )


def _overbridges(result: LineStatics) -> Iterator[str]:
    over, room = result.model.definition.overbridge, result.overbridges
    if not over:
        return
    heads = ("no.", "bridge", "from ... to [m]", "underside [m]", "highest wire [m]", "encumbrance left [m]",
             "clearance [m]", "lift [mm]", "lifted [m]")  # fmt: skip
    rows = [
        (
            str(k + 1), s.name, f"{s.start:g} ... {s.end:g}", f"{s.underside:.3f}", _cell(room.highest[k], 3),
            _cell(room.encumbrance[k], 3), _cell(room.clearance[k], 3), _cell(1e3 * room.lift[k], 0),
            _cell(room.clearance_lifted[k], 3),
        )
        for k, s in enumerate(over)
    ]  # fmt: skip
    yield markup.table(heads, rows, leading=2)
    yield markup.note(
        f"Lift of the messenger wire as the file says, or by {result.elasticity.force:g} N on the contact wire under "
        "the bridge, at rest; a run says what pantographs do."
    )


def _span(result: LineStatics) -> Iterator[str]:
    name = f"span {result.number}, {result.span.start:g} ... {result.span.end:g} m"
    drawn = statics_plots.span_profile(result.profiles, result.droppers, result.span)
    yield markup.figure(f"Shape: {name}", inline_figure(drawn, "span", f"shape of {name}"))
    drawn = statics_plots.elasticity(result.elasticity, result.span)
    yield markup.figure("Elasticity", inline_figure(drawn, "elasticity", f"elasticity along {name}"))
    if len(result.span_droppers.x):
        drawn = statics_plots.droppers(result.span_droppers, result.span)
        yield markup.figure("Droppers", inline_figure(drawn, "lengths", f"dropper lengths and tensions of {name}"))


def _temperature(over: LineOverTemperature | None) -> Iterator[str]:
    if over is None:
        return
    wanted, span = over.ruling
    heads = ("wire", "T [\u00b0C]", "tensioner [N]", "fixed point [N]", "D [mm]", "D_v [mm]", "sag [mm]")
    wires = sorted(temperature_report.rows(over.states), key=lambda row: row[0])
    yield markup.table(heads, [tuple(c or NOTHING for c in row) for row in wires], group=0)
    yield markup.note(
        f"D: outward movement of the wire's end, D_v: of the weights, downwards; sag in the span {span.start:g} ... "
        f"{span.end:g} m, the ruling span is {wanted:.2f} m."
    )
    of_line = ("T [\u00b0C]", "cantilever [deg]", "stagger changes by [mm]", "dropper slant", "slowest waves C [km/h]",
             "0.7 C [km/h]", "reflection r", "Doppler")  # fmt: skip
    rows = [
        (
            f"{s.temperature - ZERO:g}", f"{math.degrees(s.cantilever_angle):.2f}", f"{1e3 * s.stagger_change:.1f}",
            f"{s.dropper_slant:.4f}", f"{3.6 * s.waves.speed:.1f}", f"{3.6 * s.waves.limit:.1f}",
            f"{s.waves.reflection:.3f}", f"{s.waves.doppler:.3f}",
        )
        for s in over.states
    ]  # fmt: skip
    yield markup.table(of_line, rows, leading=0)
    overbridges = over.definition.overbridge
    if overbridges:
        left = [
            (f"{s.temperature - ZERO:g}", *(_cell(o.underside - s.highest[k], 3) for k, o in enumerate(overbridges)))
            for s in over.states
        ]
        yield "<h3>Clearance under bridges, at rest [m]</h3>"
        yield markup.table(("T [\u00b0C]", *(o.name for o in overbridges)), left, leading=0)
    drawn = temperature_report.tension(over.states)
    yield markup.figure("Tension along the track", inline_figure(drawn, "tension", "tension along the track"))
    if len(over.states) > 1:
        drawn = temperature_report.sag(over.states)
        yield markup.figure("Sag over temperature", inline_figure(drawn, "sag", "sag over temperature"))


def _wind(wind: LineInWind | None) -> Iterator[str]:
    if wind is None:
        return
    yield markup.pairs(wind_report.summary(wind))
    drawn = inline_figure(wind_report.plan(wind), "wind", "contact wire in plan without wind and with it")
    yield markup.figure("Contact wire in plan", drawn)
    heads = ("span", "from ... to [m]", "offset [mm]", "of a string [mm]", "limit [mm]", "verdict")
    yield markup.table(heads, [tuple(c or NOTHING for c in row) for row in wind_report.rows(wind)], leading=0)
    yield markup.note(
        "Offset: largest distance of the contact wire from the middle of the track, wind from either side, found with "
        "the mesh; beside it that of the contact wire as a string between its supports."
    )
    f = wind.found
    if f.lift.size:
        rows = [
            (f"{x:.2f}", _cell(1e3 * left, 1), _cell(1e3 * right, 1))
            for x, (left, right) in zip(f.arm_x.tolist(), f.lift.tolist(), strict=True)
        ]
        yield "<h3>How far the contact wire rises at the arms</h3>"
        yield markup.table(("x [m]", "wind to the left [mm]", "wind to the right [mm]"), rows, leading=0)


def _droppers(result: LineStatics) -> Iterator[str]:
    d, spans = result.droppers, result.model.definition.sections[result.section].spans
    if not len(d.x):
        return
    heads = ["span", "dropper", "x [m]", "from the support [m]", "length [mm]", "tension [N]"]
    hangers = bool(d.is_hanger.any())
    rows = [row if hangers else row[:-1] for row in _sheet(d, spans)]
    yield markup.table([*heads, "kind"] if hangers else heads, rows, leading=0, group=0)
    yield markup.note("Unstrained lengths between clamps; tensions of the line at rest, as shown on this page.")


def _sheet(d: Droppers, spans: Sequence[Span]) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a section's droppers and hangers, each kind counted in its span."""
    ends = np.array([span.end for span in spans])
    counts: dict[tuple[int, bool], int] = {}
    for x, length, force, hanger in zip(d.x, d.length, d.force, d.is_hanger.tolist(), strict=True):
        span = min(int(np.searchsorted(ends, x)), len(ends) - 1)
        counts[span, hanger] = number = counts.get((span, hanger), 0) + 1
        yield (
            str(span + 1), str(number), f"{x:.2f}", f"{x - spans[span].start:.2f}", f"{1e3 * length:.0f}",
            f"{force:.1f}" if force > 0.0 else "slack", "hanger" if hanger else "dropper",
        )  # fmt: skip


def _cell(value: float, digits: int) -> str:
    return NOTHING if math.isnan(value) else f"{round(float(value), digits) + 0.0:.{digits}f}"
