"""Plots of a line's statics. Every function returns a Matplotlib figure and touches nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from models.catenary.definition.section_definition import Span
from models.catenary.statics.elasticity import Elasticity
from models.catenary.statics.rest_profile import Droppers, Profile, within

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS: Final = {
    "contact_wire": "#c2571a",
    "messenger_wire": "#1f5fa8",
    "stitch_wire": "#2e7d4f",
    "auxiliary_wire": "#2e7d4f",
}
GREY: Final = "#9aa0a6"


def span_profile(profiles: Sequence[Profile], droppers: Droppers, span: Span) -> Figure:
    """Line from anchor to anchor; one span with its droppers; its contact wire, magnified."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 8.0), layout="constrained")
    whole, detail, contact = figure.subplots(3, 1)
    _wires(whole, profiles)
    whole.axvspan(span.start, span.end, color="#f4e7b4", zorder=0)
    whole.set_title("whole line", loc="left", fontsize=9)
    _wires(detail, profiles)
    _hung(detail, profiles, droppers, span)
    detail.set_title(f"span {span.start:g} ... {span.end:g} m", loc="left", fontsize=9)
    for p in profiles:
        if p.component == "contact_wire":
            inside = within(p, span)
            contact.plot(p.x[inside], 1e3 * (p.z[inside] - p.z[inside].max()), color=COLOURS[p.component])
    contact.set_ylabel("contact wire [mm]\nbelow its highest point")
    for axes in (detail, contact):
        axes.set_xlim(span.start, span.end)
    for axes in (whole, detail):
        axes.set_ylabel("height [m]")
    whole.legend(fontsize=8, ncols=4, frameon=False, loc="lower left", bbox_to_anchor=(0.25, 1.0))
    contact.set_xlabel("position along the track [m]")
    return figure


def elasticity(result: Elasticity, span: Span) -> Figure:
    """Elasticity along a span, droppers marked."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    axes = figure.subplots()
    axes.plot(result.x, 1e3 * result.value, color=COLOURS["contact_wire"])
    for x in span.droppers:
        axes.axvline(x, color=GREY, linewidth=0.6)
    for value, name, above in ((result.minimum, "minimum", -11), (result.maximum, "maximum", 3)):
        axes.axhline(1e3 * value, color=GREY, linewidth=0.6, linestyle="--")
        label, place = f"{name} {1e3 * value:.3f}", (span.start, 1e3 * value)
        paper = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
        axes.annotate(label, place, xytext=(4, above), textcoords="offset points", fontsize=8, bbox=paper)
    axes.set_ylim(0.0, 1.15e3 * result.maximum)
    axes.set_xlim(span.start, span.end)
    axes.set_xlabel("position along the track [m]; grey: droppers")
    axes.set_ylabel(f"elasticity at {result.force:g} N [mm/N]")
    axes.set_title(f"non-uniformity u = {100.0 * result.non_uniformity:.1f} %", loc="left", fontsize=9)
    return figure


def droppers(result: Droppers, span: Span) -> Figure:
    """Unstrained lengths and static tensions of a span's droppers."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    length, force = figure.subplots(2, 1, sharex=True)
    for chosen, name, colour in (
        (~result.is_hanger, "droppers", COLOURS["contact_wire"]),
        (result.is_hanger, "hangers", COLOURS["messenger_wire"]),
    ):
        if chosen.any():
            for axes, values in ((length, result.length), (force, result.force)):
                axes.bar(result.x[chosen], values[chosen], width=0.018 * span.length, color=colour, label=name)
    if result.is_hanger.any():
        length.legend(fontsize=8, frameon=False, ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    length.set_ylabel("unstrained length [m]")
    force.set_ylabel("tension [N]")
    force.set_xlim(span.start, span.end)
    force.set_xlabel("position along the track [m]")
    return figure


def _wires(axes: Axes, profiles: Sequence[Profile]) -> None:
    named = set()
    for p in profiles:
        label = None if p.component in named else p.component.replace("_", " ")
        named.add(p.component)
        axes.plot(p.x, p.z, color=COLOURS[p.component], linewidth=1.0, label=label)


def _hung(axes: Axes, profiles: Sequence[Profile], droppers: Droppers, span: Span) -> None:
    """Draw a span's droppers up from the contact wire, hangers down from the messenger wire."""
    lower = next(p for p in profiles if p.component == "contact_wire")
    upper = next(p for p in profiles if p.component == "messenger_wire")
    for x, length, hanger in zip(droppers.x, droppers.length, droppers.is_hanger, strict=True):
        if span.start <= x <= span.end:
            wire = upper if hanger else lower
            end = float(np.interp(x, wire.x, wire.z))
            axes.plot([x, x], [end, end - length if hanger else end + length], color=GREY, linewidth=0.8)
