"""A line at rest in the wind: the table of ``statics --wind``, and its figure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from models.commands.physics_files import write_csv, write_figure
from models.commands.statics_plots import COLOURS, GREY
from models.interface.line_in_wind import LineInWind
from models.interface.norm_judgement import verdict_word

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = ("span", "from ... to [m]", "offset [mm]", "of a string [mm]", "limit [mm]", "verdict")


def rows(wind: LineInWind) -> list[Sequence[str]]:
    """Return the rows of the table of spans."""
    return [
        (
            str(k + 1),
            f"{wind.start[k]:g} ... {wind.end[k]:g}",
            f"{1e3 * wind.found.offset[k]:.0f}",
            "" if math.isnan(wind.found.string[k]) else f"{1e3 * wind.found.string[k]:.0f}",
            "" if math.isnan(limit) else f"{1e3 * limit:.0f}",
            "" if math.isnan(limit) else verdict_word(is_kept=wind.found.offset[k] <= limit),
        )
        for k, limit in enumerate(wind.limit.tolist())
    ]


def summary(wind: LineInWind) -> list[tuple[str, str]]:
    """Return the rows of figures: what, value with unit."""
    found = wind.found
    worst = int(np.where(wind.works, found.offset, 0.0).argmax())
    result = [
        ("pressure of the wind [Pa]", f"{wind.pressure:.2f}"),
        ("largest offset at the working height [mm]", f"{1e3 * found.offset[worst]:.0f} in span {worst + 1}"),
    ]
    if found.lift.size:
        arm = int(np.abs(found.lift).max(axis=1).argmax())
        text = " and ".join(f"{round(1e3 * v):+d}" for v in found.lift[arm].tolist())
        result.append(("largest rise of the wire at an arm, wind to the left and to the right [mm]",
                       f"{text} at {found.arm_x[arm]:g} m"))  # fmt: skip
    return result


def write(folder: Path, wind: LineInWind) -> None:
    """Write ``wind.csv``, ``wind_arms.csv`` and the plan view ``wind.png``."""
    for name, table in (("wind", "wind"), ("wind_arms", "arms")):
        titles, columns = wind.tables[table]
        write_csv(folder / f"{name}.csv", titles, columns)
    write_figure(folder / "wind.png", plan(wind), 150)


def plan(wind: LineInWind) -> Figure:
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
    axes.set_title(f"wind: {wind.pressure:.0f} Pa", loc="left", fontsize=9)
    axes.legend(fontsize=8, ncols=4, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return figure
