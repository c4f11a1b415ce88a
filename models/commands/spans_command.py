"""``python -m models spans LINE``: smallest radius for a span and largest span for a radius, in the wind."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from models.arrays import FloatArray
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.shape.line_mesh import contact_wire_height
from models.catenary.shape.support_places import SupportPlaces
from models.catenary.statics.span_table import LENGTHS, String, radii
from models.commands.physics_files import write_csv, write_figure
from models.commands.physics_options import check_folder, new_folder, print_table, settings, warn
from models.commands.wind_report import asked_wind
from models.definition_files.parameter import ParameterError
from models.library.catalogue import doubts, load_line
from models.library.norm_tables import lateral_norm

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Radii for which the largest span is given unless others are asked for; infinite: straight track [m].
RADII: Final = (200.0, 300.0, 400.0, 500.0, 600.0, 800.0, 1000.0, 1500.0, 2000.0, 3000.0, 5000.0, math.inf)


def run(arguments: argparse.Namespace) -> int:
    """Compute, print, and write if asked to."""
    check_folder(arguments.out)
    definition = load_line(arguments.line)
    warn(doubts("lines", arguments.line))
    definition = definition.with_values(settings(arguments.set, "line", definition))
    wind, pressure = asked_wind(definition, arguments)
    string = String(definition.contact_wire.tension, wind.force(definition.contact_wire.width, pressure))
    limit, staggers = _limit(definition, arguments), _staggers(definition, arguments)
    asked = tuple(arguments.radius or RADII)
    smallest = [radii(string, limit, *pair) for pair in staggers]
    largest = [np.array([string.largest_span(limit, 1.0 / R, *pair) for R in asked]) for pair in staggers]
    heads = [_name(pair) for pair in staggers]
    text = f"{pressure:.2f} Pa, {string.wind:.3f} N/m on {string.tension:g} N, limit {limit:g} m"
    print_table(f"Smallest radius [m]: {text}", ("span [m]", *heads), _rows(LENGTHS, smallest, 0))
    print_table(f"Largest span [m]: {text}", ("radius [m]", *heads), _rows(asked, largest, 2))
    if arguments.out is not None:
        folder = new_folder(arguments.out)
        write_csv(folder / "radii.csv", ["span [m]", *heads], [np.array(LENGTHS), *smallest])
        write_csv(folder / "spans.csv", ["radius [m]", *heads], [np.array(asked), *largest])
        write_figure(folder / "spans.png", figure(smallest, heads, text), 150)
        print(f"tables and plot: {folder}")
    return 0


def figure(smallest: Sequence[FloatArray], names: Sequence[str], text: str) -> Figure:
    """Smallest radius over the length of the span, a line for each pair of staggers."""
    from matplotlib.figure import Figure

    drawn = Figure(figsize=(8.0, 4.5), layout="constrained")
    axes = drawn.subplots()
    for values, name in zip(smallest, names, strict=True):
        axes.plot(LENGTHS, values, "o-", markersize=3, label=f"stagger {name}")
    axes.set_yscale("log")
    axes.grid(visible=True, which="both", linewidth=0.3)
    axes.set_xlabel("length of the span [m]")
    axes.set_ylabel("smallest radius [m]")
    axes.set_title(text, loc="left", fontsize=9)
    axes.legend(fontsize=8, frameon=False)
    return drawn


def _limit(definition: CatenaryDefinition, arguments: argparse.Namespace) -> float:
    """Return the permissible offset [m]: as given, or that of a head on straight track at the line's largest height."""
    if arguments.head is not None:
        height = max(_heights(definition))
        return lateral_norm().permissible(arguments.head, height, 0.0, 0.0).permissible
    if arguments.limit is None:
        raise ParameterError("how far may the wire be blown? give --limit, in m, or --head 1600 or 1950")
    return float(arguments.limit)


def _heights(definition: CatenaryDefinition) -> Iterator[float]:
    """Yield the heights of the contact wire at the supports where it is at its working height [m]."""
    for section in definition.sections:
        places = SupportPlaces(definition, section)
        first, last = (-math.inf, math.inf) if section.periodic else section.ends.working
        yield from (contact_wire_height(places, s.x) for s in section.inner_supports if first <= s.x <= last)


def _staggers(definition: CatenaryDefinition, arguments: argparse.Namespace) -> list[tuple[float, float]]:
    """Return pairs of staggers, positive to the outside [m]: as given, or the line's, alternating and not."""
    if arguments.stagger:
        return [tuple(pair) for pair in arguments.stagger]
    largest = max(abs(s.stagger) for section in definition.sections for s in section.inner_supports)
    return [(largest, -largest), (largest, largest)]


def _name(pair: tuple[float, float]) -> str:
    return " / ".join(f"{100.0 * b:+g} cm" for b in pair)


def _rows(first: Sequence[float], columns: Sequence[FloatArray], digits: int) -> list[Sequence[str]]:
    def cell(value: float) -> str:
        return "none" if math.isnan(value) else "any" if math.isinf(value) else f"{value:.{digits}f}"

    heads = ["straight" if math.isinf(value) else f"{value:g}" for value in first]
    return [(head, *(cell(float(c[k])) for c in columns)) for k, head in enumerate(heads)]
