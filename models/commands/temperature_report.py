"""A line over temperature: the table of ``statics --temperature``, and its figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from models.catenary.statics.temperature_table import LineAtTemperature
from models.commands.physics_files import write_csv, write_figure
from models.commands.statics_plots import COLOURS
from models.interface.line_over_temperature import ZERO, LineOverTemperature, checked_temperature

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Lines of the wires' colours, from the coldest to the hottest.
_DASHES: Final = (":", "-.", "--", "-")
COLUMNS: Final = (
    "wire", "T [degC]", "tensioner [N]", "fixed point [N]", "D [mm]", "D_v [mm]", "sag [mm]",
)  # fmt: skip


def kelvin(temperature: float) -> float:
    """Return a temperature of the command line, in degC, in K.

    Raises
    ------
    ParameterError
        If no line is as cold or hot.
    """
    return checked_temperature(temperature + ZERO, f"--temperature {temperature:g}")


def rows(states: Sequence[LineAtTemperature]) -> list[Sequence[str]]:
    """Return the rows of the table of wires."""
    return [
        (
            each.wire.component.removesuffix("_wire"),
            f"{state.temperature - ZERO:g}",
            f"{each.wire.at_tensioner:.0f}",
            f"{each.wire.at_fixed_point:.0f}",
            _millimetres(each.wire.movement),
            "" if math.isnan(each.weight_movement) else _millimetres(each.weight_movement),
            _millimetres(each.sag),
        )
        for state in states
        for each in state.wires
    ]


def swings(states: Sequence[LineAtTemperature]) -> list[tuple[str, str]]:
    """Return the rows of what follows from movements and tensions: what, value with unit."""
    return [
        row
        for state in states
        for row in (
            (f"largest angle of a cantilever at {state.temperature - ZERO:g} degC [deg]",
             f"{math.degrees(state.cantilever_angle):.2f}"),
            (f"largest change of stagger at {state.temperature - ZERO:g} degC [mm]",
             f"{1e3 * state.stagger_change:.1f}"),
            (f"largest slant of a dropper at {state.temperature - ZERO:g} degC [1]", f"{state.dropper_slant:.4f}"),
            (f"slowest waves of the contact wire at {state.temperature - ZERO:g} degC [km/h]",
             f"{3.6 * state.waves.speed:.1f}"),
        )
    ]  # fmt: skip


def write(folder: Path, found: LineOverTemperature) -> None:
    """Write ``temperature.csv``, and figures of tensions along the track and of sags over temperature."""
    titles, columns = found.tables["temperature"]
    write_csv(folder / "temperature.csv", titles, columns)
    write_figure(folder / "tension.png", tension(found.states), 150)
    write_figure(folder / "sag.png", sag(found.states), 150)


def tension(states: Sequence[LineAtTemperature]) -> Figure:
    """Tension along the track, a panel for each kind of wire."""
    from matplotlib.figure import Figure

    count = len(states[0].wires)
    figure = Figure(figsize=(9.0, 1.0 + 2.2 * count), layout="constrained")
    panels = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    for k, axes in enumerate(panels):
        for n, state in enumerate(states):
            wire = state.wires[k].wire
            label = f"{state.temperature - ZERO:g} °C"
            axes.stairs(
                1e-3 * wire.tension, wire.ends, baseline=None, color=COLOURS[wire.component], label=label,
                linestyle=_DASHES[n % len(_DASHES)],
            )  # fmt: skip
        axes.axvline(wire.fixed_point, color="#9aa0a6", linewidth=0.6)
        axes.set_ylabel(f"{wire.component.replace('_', ' ')} [kN]")
        axes.margins(y=0.2)
        axes.ticklabel_format(axis="y", useOffset=False)  # losses are small beside the tension, which is to be read
    panels[0].legend(fontsize=8, ncols=6, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    panels[-1].set_xlabel("position along the track [m]; grey: fixed point")
    return figure


def sag(states: Sequence[LineAtTemperature]) -> Figure:
    """Sags in the ruling span over temperature."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 3.6), layout="constrained")
    axes = figure.subplots()
    ordered = sorted(states, key=lambda state: state.temperature)
    for k, each in enumerate(ordered[0].wires):
        values = [1e3 * state.wires[k].sag for state in ordered]
        name = each.wire.component
        axes.plot([s.temperature - ZERO for s in ordered], values, "o-", color=COLOURS[name],
                  label=name.replace("_", " "))  # fmt: skip
    axes.set_xlabel("temperature [°C]")
    axes.set_ylabel("sag in the ruling span [mm]")
    axes.legend(fontsize=8, frameon=False)
    return figure


def _millimetres(value: float) -> str:
    """Return a length in m as text in mm, without a sign where nothing is left of it."""
    return f"{round(1e3 * value, 1) + 0.0:.1f}"
