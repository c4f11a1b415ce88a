"""The static contact force of a pantograph over its speed, knuckle leading and trailing, beside the aim of EN 50367."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from models.arrays import FloatArray
from models.commands.physics_files import set_heading, write_csv, write_figure
from models.commands.physics_options import print_table
from models.library.force_laws import force_laws

#: Of the table and the figure [km/h].
SPEEDS: Final = np.array([0.0, 80.0, 120.0, 160.0, 200.0, 250.0, 300.0, 350.0])
_KMH: Final = 3.6
_COLUMNS: Final = ("speed [km/h]", "knuckle leading [N]", "knuckle trailing [N]", "EN 50367 AC target [N]")
_UPLIFT: Final = "static force and published uplift [N]"


def tabulated(leading: FloatArray, trailing: FloatArray) -> FloatArray:
    """Return the table: speeds [km/h], forces at them, the target, the force at rest with the published uplift [N].

    Parameters
    ----------
    leading, trailing : ndarray, shape (len(SPEEDS),)
        Static contact forces at `SPEEDS` [N].
    """
    target, uplift = force_laws()
    speed = SPEEDS / _KMH
    published = leading[0] + np.where(speed > 0.0, uplift.at(speed), 0.0)
    return np.column_stack([SPEEDS, leading, trailing, target.at(speed), published])


def print_over_speed(table: FloatArray) -> None:
    """Print the forces over the speed."""
    rows = ([f"{row[0]:.0f}", *(f"{round(v, 2) + 0.0:.2f}" for v in row[1:4])] for row in table)
    print_table("Static contact force over the speed, on open track without wind", _COLUMNS, rows)


def write_over_speed(folder: Path, title: str, table: FloatArray, digits: int) -> None:
    """Write the forces over the speed as CSV, and their plot as PNG."""
    from matplotlib.figure import Figure

    write_csv(folder / "force_over_speed.csv", (*_COLUMNS, _UPLIFT), list(table.T), digits)
    figure = Figure(figsize=(8, 5), layout="constrained")
    axes = figure.subplots()
    for values, name, line in zip(table.T[1:], (*_COLUMNS[1:], _UPLIFT), ("-", "--", ":", "-."), strict=True):
        axes.plot(table[:, 0], values, line, label=name.removesuffix(" [N]"))
    axes.set_xlabel(_COLUMNS[0])
    axes.set_ylabel("contact force [N]")
    axes.grid(visible=True, alpha=0.4)
    axes.legend()
    set_heading(figure, f"{title}: force over the speed")
    write_figure(folder / "force_over_speed.png", figure, 120)
