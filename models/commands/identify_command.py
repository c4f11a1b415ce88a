"""``python -m models identify FILE``: the lumped model that fits a measured frequency response [section 3.4]."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from models.commands.physics_files import check_figure, write_figure
from models.commands.physics_options import print_table
from models.definition_files.parameter import ParameterError
from models.pantograph.identification import (
    IdentifiedModel,
    Response,
    identify,
    read_response,
)
from models.pantograph.lumped.lumped_rig import chain_stiffness

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def run(arguments: argparse.Namespace) -> int:
    """Identify and print the values with their standard deviations."""
    if arguments.plot is not None:
        check_figure(arguments.plot)
    response = read_response(arguments.response, arguments.kind)
    try:
        model = identify(response, arguments.stages, _all_fixed(arguments.fix), following=arguments.following)
    except ValueError as error:
        raise ParameterError(str(error)) from error
    print_table("Identified stages, bottom to top", ("value", "found", "standard deviation"), _rows(model))
    print(f"root mean square misfit {100.0 * model.misfit:.3g} %")
    if arguments.plot is not None:
        write_figure(arguments.plot, _plot(response, model), 120)
        print(f"plot: {arguments.plot}")
    return 0


def _all_fixed(given: Sequence[tuple[str, float]]) -> dict[str, float]:
    if twice := [name for name, _ in given if sum(name == other for other, _ in given) > 1]:
        raise ParameterError(f"--fix {twice[0]}: is given twice")
    return dict(given)


def _rows(model: IdentifiedModel) -> list[tuple[str, str, str]]:
    rows = []
    for letter, unit, values in (
        ("m", "kg", model.masses),
        ("c", "N s/m", model.dampings),
        ("k", "N/m", model.stiffnesses),
    ):
        for i, value in enumerate(values, 1):
            spread = model.deviations.get(f"{letter}{i}")
            rows.append((f"{letter}{i} [{unit}]", f"{value:.6g}", "fixed" if spread is None else f"{spread:.2g}"))
    if math.isfinite(model.reference_time):
        spread = model.deviations.get("T")
        rows.append(("T [s]", f"{model.reference_time:.6g}", "fixed" if spread is None else f"{spread:.2g}"))
    return rows


def _plot(response: Response, model: IdentifiedModel) -> Figure:
    from matplotlib.figure import Figure

    stages = (model.masses, model.dampings, model.stiffnesses)
    fitted = chain_stiffness(response.frequency, *stages, model.reference_time)
    figure = Figure(figsize=(8, 5), layout="constrained")
    axes = figure.subplots()
    axes.semilogy(response.frequency, np.abs(1.0 / response.stiffness), ".", label="given")
    axes.semilogy(response.frequency, np.abs(1.0 / fitted), label="identified")
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("receptance [m/N]")
    axes.grid(visible=True, alpha=0.4)
    axes.legend()
    return figure
