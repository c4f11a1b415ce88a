"""A line at rest in the wind: the table of ``statics --wind``, and its figure."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from models.arrays import BoolArray, FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.wind_definition import DesignWind, Wind
from models.catenary.shape.line_mesh import contact_wire_height
from models.catenary.shape.support_places import SupportPlaces
from models.catenary.shape.track import track_at
from models.catenary.statics.blow_off import BlowOff, blow_off
from models.commands.physics_files import write_csv, write_figure
from models.commands.statics_plots import COLOURS, GREY
from models.definition_files.parameter import ParameterError
from models.interface.line_statics import LineStatics
from models.library.norm_tables import lateral_norm

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Strongest wind that is meant [m/s], [Pa].
_FASTEST, _HIGHEST = 100.0, 50e3
COLUMNS = ("span", "from ... to [m]", "offset [mm]", "of a string [mm]", "limit [mm]", "verdict")


@dataclass(frozen=True)
class InTheWind:
    """A section in the wind, and what it may be blown by.

    Attributes
    ----------
    pressure : float
        [Pa].
    found : BlowOff
    start, end, limit : ndarray, shape (n_spans,)
        Of every span [m]; the limit is NaN where none is known, or no strip runs.
    works : ndarray, shape (n_spans,)
        Whether the wire is at its working height.
    """

    pressure: float
    found: BlowOff
    start: FloatArray
    end: FloatArray
    limit: FloatArray
    works: BoolArray


def asked_wind(definition: CatenaryDefinition, arguments: argparse.Namespace) -> tuple[DesignWind, float]:
    """Return the wind of a line's definition with the speed or pressure of the command line, and its pressure [Pa].

    Raises
    ------
    ParameterError
        If it is stronger than any wind.
    """
    wind = (definition.wind or Wind()).design
    for option, given, most, unit in (("wind", arguments.wind, _FASTEST, "m/s"),
                                      ("pressure", arguments.pressure, _HIGHEST, "Pa")):  # fmt: skip
        if given is not None and given > most:
            raise ParameterError(f"--{option} {given:g}: no wind is stronger than {most:g} {unit}; check the unit")
    if arguments.wind is not None:
        wind = replace(wind, speed=arguments.wind)
    return wind, wind.pressure if arguments.pressure is None else arguments.pressure


def in_the_wind(result: LineStatics, arguments: argparse.Namespace) -> InTheWind:
    """Find a section in the wind, blown from both sides.

    Raises
    ------
    ParameterError
        If a height is outside the range of the permissible deviations.
    """
    definition = result.model.definition
    _, pressure = asked_wind(definition, arguments)
    section = definition.sections[result.section]
    spans = section.spans
    start, end = np.array([s.start for s in spans]), np.array([s.end for s in spans])
    first, last = (start[0], end[-1]) if section.periodic else section.ends.working
    limit = np.full(len(spans), math.nan)
    works = (start >= first) & (end <= last)
    for k in np.flatnonzero(works).tolist():
        limit[k] = _limit(definition, result.section, float(start[k]), float(end[k]), arguments)
    return InTheWind(pressure, blow_off(result.model, pressure, result.section), start, end, limit, works)


def rows(wind: InTheWind) -> list[Sequence[str]]:
    """Return the rows of the table of spans."""
    return [
        (
            str(k + 1),
            f"{wind.start[k]:g} ... {wind.end[k]:g}",
            f"{1e3 * wind.found.offset[k]:.0f}",
            "" if math.isnan(wind.found.string[k]) else f"{1e3 * wind.found.string[k]:.0f}",
            "" if math.isnan(limit) else f"{1e3 * limit:.0f}",
            "" if math.isnan(limit) else "keeps" if wind.found.offset[k] <= limit else "does not keep",
        )
        for k, limit in enumerate(wind.limit.tolist())
    ]


def summary(wind: InTheWind) -> list[tuple[str, str]]:
    """Return the rows of figures: what, value with unit."""
    found = wind.found
    worst = int(np.where(wind.works, found.offset, 0.0).argmax())
    result = [
        ("pressure of the wind [Pa]", f"{wind.pressure:.2f}"),
        ("largest offset at the working height [mm]", f"{1e3 * found.offset[worst]:.0f} in span {worst + 1}"),
    ]
    if found.lift.size:
        arm = int(np.abs(found.lift).max(axis=1).argmax())
        text = " and ".join(f"{1e3 * v:+.0f}" for v in found.lift[arm])
        result.append(("largest rise of the wire at an arm, wind to the left and to the right [mm]",
                       f"{text} at {found.arm_x[arm]:g} m"))  # fmt: skip
    return result


def write(folder: Path, wind: InTheWind) -> None:
    """Write ``wind.csv`` and the plan view ``wind.png``."""
    f = wind.found
    titles = ("from [m]", "to [m]", "offset [m]", "offset of a string [m]", "limit [m]", "blown from the line between "
              "clamps [m]", "the same of a string [m]")  # fmt: skip
    columns = [wind.start, wind.end, f.offset, f.string, wind.limit, f.blown, f.string_blown]
    write_csv(folder / "wind.csv", titles, columns)
    write_figure(folder / "wind.png", plan(wind), 150)


def plan(wind: InTheWind) -> Figure:
    """Plan view of the contact wire at rest and in the wind, with the limit."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    axes = figure.subplots()
    f, colour = wind.found, COLOURS["contact_wire"]
    axes.fill_between(f.x, f.to_left, f.to_right, color=colour, alpha=0.2, linewidth=0.0)
    axes.plot(f.x, f.still, color=colour, linewidth=1.2, label="without wind")
    axes.plot(f.x, f.to_left, color=colour, linewidth=0.7, linestyle="--", label="wind to the left")
    axes.plot(f.x, f.to_right, color=colour, linewidth=0.7, linestyle=":", label="wind to the right")
    known = ~np.isnan(wind.limit)
    for sign, label in ((1.0, "limit"), (-1.0, "_nolegend_")):
        axes.hlines(sign * wind.limit[known], wind.start[known], wind.end[known], color=GREY, label=label)
    axes.set_xlim(f.x[0], f.x[-1])
    axes.set_xlabel("position along the track [m]")
    axes.set_ylabel("contact wire in plan [m], left > 0")
    axes.set_title(f"wind of {wind.pressure:.0f} Pa from either side", loc="left", fontsize=9)
    axes.legend(fontsize=8, ncols=4, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return figure


def _limit(
    definition: CatenaryDefinition, section: int, start: float, end: float, arguments: argparse.Namespace
) -> float:
    """Return the permissible offset in a span [m]: as given, or by the head with the span's curvature and cant."""
    if arguments.head is None:
        return math.nan if arguments.limit is None else float(arguments.limit)
    places = SupportPlaces(definition, definition.sections[section])
    # The higher the wire, the less is permissible.
    height = max(contact_wire_height(places, x) for x in (start, end))
    curvature = cant = 0.0
    if definition.track is not None:
        along = track_at(definition.track, np.linspace(start, end, 51))
        curvature = float(np.abs(along.curvature).max())
        cant = float(np.abs(np.sin(along.cant)).max() * definition.track.base)
    return lateral_norm().permissible(arguments.head, height, curvature, cant).permissible
