"""Table and plot of a cam: what the lifting element gives for the weights, and for each newton on the strip."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from models.commands.physics_files import set_heading, write_csv, write_figure
from models.pantograph.multibody.analysis.mechanism_rig import CamCurves

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_cam(folder: Path, title: str, cam: CamCurves, digits: int) -> None:
    """Write ``cam.csv`` and ``cam.png``."""
    place, unit = ("angle [deg]", "N.m") if cam.is_moment else ("length [m]", "N")
    names = (place, "strip height [m]", f"for the weights [{unit}]", f"per lift set [{unit} each]")
    places = np.degrees(cam.place) if cam.is_moment else cam.place
    write_csv(folder / "cam.csv", names, (places, cam.height, cam.for_weights, cam.per_lift), digits)
    write_figure(folder / "cam.png", _plot(title, names, cam), 120)


def _plot(title: str, names: tuple[str, ...], cam: CamCurves) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6), layout="constrained")
    places = np.degrees(cam.place) if cam.is_moment else cam.place
    panels = figure.subplots(2, 2, sharex="col")
    for row, (values, name) in enumerate(((cam.for_weights, names[2]), (cam.per_lift, names[3]))):
        for column, x in enumerate((places, cam.height)):
            panels[row, column].plot(x, values)
            panels[row, column].grid(visible=True, alpha=0.4)
        panels[row, 0].set_ylabel(name)
    panels[1, 0].set_xlabel(names[0])
    panels[1, 1].set_xlabel(names[1])
    set_heading(figure, f"{title}: cam")
    return figure
