"""A line over its track as a strip chart: curvature and cant, plan, heights, gradients."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from models.catenary.definition.track_definition import Track
from models.catenary.shape.track import track_at
from models.catenary.statics import rest_profile
from models.commands.statics_plots import COLOURS, GREY
from models.interface.line_statics import LineStatics
from models.library.norm_tables import gradient_limits

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: How far collector strips reach from the middle of the track [m]: those of a head of 1.95 m (choice).
_REACH: Final = 0.725
#: Lines of the limits of different norms.
_DASHES: Final = ("--", ":", "-.")


def profile(result: LineStatics) -> Figure:
    """Curvature and cant if the line has a track, plan and heights of its wires, gradients between its supports."""
    from matplotlib.figure import Figure

    track = result.model.definition.track
    ratios = [1.0, 1.6, 1.6, 1.0] if track is not None else [1.6, 1.6, 1.0]
    figure = Figure(figsize=(10.0, 1.9 * sum(ratios)), layout="constrained")
    panels = list(figure.subplots(len(ratios), 1, sharex=True, height_ratios=ratios))
    if track is not None:
        ends = result.profiles[0].x[[0, -1]]
        _track(panels.pop(0), track, float(ends[0]), float(ends[1]))
    plan, heights, gradients = panels
    _plan(plan, result)
    _heights(heights, result)
    _gradients(gradients, result)
    gradients.set_xlim(result.profiles[0].x[0], result.profiles[0].x[-1])
    gradients.set_xlabel(f"position along the track [m]; grey in plan: strips' reach, {_REACH:g} m")
    return figure


def _track(axes: Axes, track: Track, start: float, end: float) -> None:
    knots = np.array(track.positions)
    inside = knots[(knots > start) & (knots < end)]
    x = np.unique(np.concatenate([[start, end], inside, inside - 1e-6]))
    place = track_at(track, x)
    axes.plot(x, 1e3 * place.curvature, color=COLOURS["messenger_wire"])
    axes.set_ylabel("curvature [1/km]\nleft > 0", color=COLOURS["messenger_wire"])
    cant = axes.twinx()
    cant.plot(x, 1e3 * track.base * np.sin(place.cant), color=COLOURS["contact_wire"], linestyle="--")
    cant.set_ylabel("cant [mm]\nright rail > 0", color=COLOURS["contact_wire"])
    for each in (axes, cant):
        each.margins(y=0.15)


def _plan(axes: Axes, result: LineStatics) -> None:
    axes.axhspan(-_REACH, _REACH, color="#f1f3f4", zorder=0)
    _wires(axes, result, "y")
    s = result.supports
    axes.plot(s.x, s.stagger, "o", color=COLOURS["contact_wire"], markersize=3)
    axes.set_ylabel("plan [m]\nleft > 0")


def _heights(axes: Axes, result: LineStatics) -> None:
    _wires(axes, result, "z")
    s = result.supports
    axes.plot(s.x, s.height, "o", color=COLOURS["contact_wire"], markersize=3)
    axes.margins(y=0.1)
    for number, over in enumerate(result.model.definition.overbridge, 1):
        axes.hlines(over.underside, over.start, over.end, color="black", linewidth=3.0)
        place = 0.5 * (over.start + over.end), over.underside
        axes.annotate(str(number), place, xytext=(0, 3), textcoords="offset points", fontsize=8, ha="center")
    axes.set_ylabel("height above\nthe rail plane [m]")
    axes.legend(fontsize=8, ncols=4, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0))


def _gradients(axes: Axes, result: LineStatics) -> None:
    s = result.supports
    known = np.isfinite(s.gradient)
    if known.any():
        ends = np.append(s.x[1:], s.x[0] + result.model.definition.sections[result.section].period)[known]
        axes.hlines(1e3 * s.gradient[known], s.x[known], ends, color=COLOURS["contact_wire"])
    speed = result.waves.train_speed
    for norm, dashes in zip(gradient_limits(), _DASHES, strict=False):
        for sign in (1.0, -1.0):
            label = f"{norm.name}, {3.6 * speed:.0f} km/h" if sign > 0.0 else None
            axes.axhline(sign * 1e3 * norm.at(speed), color=GREY, linewidth=0.8, linestyle=dashes, label=label)
    axes.legend(fontsize=8, ncols=2, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    axes.set_ylabel("gradient [permil]")
    axes.margins(y=0.2)


def _wires(axes: Axes, result: LineStatics, coordinate: str) -> None:
    """Draw the wires of the section, and thin those of others beside it."""
    others = [s for s in range(len(result.model.definition.sections)) if s != result.section]
    for p in (p for s in others for p in rest_profile.profiles(result.model, s)):
        axes.plot(p.x, getattr(p, coordinate), color=GREY, linewidth=0.6)
    named = set()
    for p in result.profiles:
        label = None if p.component in named else p.component.replace("_", " ")
        named.add(p.component)
        axes.plot(p.x, getattr(p, coordinate), color=COLOURS[p.component], linewidth=1.0, label=label)
