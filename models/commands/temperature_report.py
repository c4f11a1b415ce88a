"""A line over temperature: the table of ``statics --temperature``, and its figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from models.catenary.definition.tensioning_definition import COLDEST, HOTTEST
from models.catenary.statics.temperature_table import LineAtTemperature
from models.commands.physics_files import write_csv, write_figure
from models.commands.statics_plots import COLOURS
from models.definition_files.parameter import ParameterError
from models.definition_files.si_units import OFFSETS
from models.library.norm_tables import support_limits

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: 0 degC [K].
ZERO: Final = OFFSETS["degC"]
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
    if not COLDEST <= temperature + ZERO <= HOTTEST:
        span = f"{COLDEST - ZERO:g} ... {HOTTEST - ZERO:g}"
        raise ParameterError(f"--temperature {temperature:g}: is outside {span} degC, in which wires can be")
    return temperature + ZERO


def rows(states: Sequence[LineAtTemperature]) -> list[Sequence[str]]:
    """Return the rows of the table of wires."""
    return [
        (
            each.wire.component.removesuffix("_wire"),
            f"{state.temperature - ZERO:g}",
            f"{each.wire.at_tensioner:.0f}",
            f"{each.wire.at_fixed_point:.0f}",
            f"{1e3 * each.wire.movement:.1f}",
            "" if math.isnan(each.weight_movement) else f"{1e3 * each.weight_movement:.1f}",
            f"{1e3 * each.sag:.1f}",
        )
        for state in states
        for each in state.wires
    ]


def swings(states: Sequence[LineAtTemperature]) -> list[tuple[str, str]]:
    """Return the rows of what follows from movements: what, value with unit; first the loss of tension, judged."""
    return [
        ("largest loss of tension [% of nominal]", _verdict(states)),
        *(
        row
        for state in states
        for row in (
            (f"largest angle of a cantilever at {state.temperature - ZERO:g} degC [deg]",
             f"{math.degrees(state.cantilever_angle):.2f}"),
            (f"largest change of stagger at {state.temperature - ZERO:g} degC [mm]",
             f"{1e3 * state.stagger_change:.1f}"),
            (f"largest slant of a dropper at {state.temperature - ZERO:g} degC [1]", f"{state.dropper_slant:.4f}"),
        )
        ),
    ]  # fmt: skip


def write(folder: Path, states: Sequence[LineAtTemperature]) -> None:
    """Write ``temperature.csv``, and figures of tensions along the track and of sags over temperature."""
    names = [each.wire.component for each in states[0].wires]
    titles, columns = ["temperature [degC]"], [[s.temperature - ZERO for s in states]]
    for k, name in enumerate(names):
        wires = [s.wires[k] for s in states]
        titles += [
            f"{name} {what}"
            for what in ("at the tensioner [N]", "at the fixed point [N]", "loss [N]", "D [m]", "D_v [m]", "sag [m]")
        ]
        columns += [
            [w.wire.at_tensioner for w in wires],
            [w.wire.at_fixed_point for w in wires],
            [w.wire.loss for w in wires],
            [w.wire.movement for w in wires],
            [w.weight_movement for w in wires],
            [w.sag for w in wires],
        ]
    titles += ["cantilever angle [deg]", "stagger change [m]", "dropper slant [1]"]
    columns += [
        [math.degrees(s.cantilever_angle) for s in states],
        [s.stagger_change for s in states],
        [s.dropper_slant for s in states],
    ]
    write_csv(folder / "temperature.csv", titles, [np.array(column) for column in columns])
    write_figure(folder / "tension.png", tension(states), 150)
    write_figure(folder / "sag.png", sag(states), 150)


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


def _verdict(states: Sequence[LineAtTemperature]) -> str:
    losses = [(w.wire.loss / w.wire.nominal, s.temperature - ZERO, w.wire.component) for s in states for w in s.wires]
    share, temperature, component = max(losses)
    largest = support_limits().largest_loss
    kept = "within" if share <= largest else "beyond"
    where = f"{component.replace('_', ' ')} at {temperature:g} degC"
    return f"{100.0 * share:.1f}, {where}: {kept} {100.0 * largest:g} (TB 10009-2016)"
