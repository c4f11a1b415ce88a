"""``python -m models spans LINE``: smallest radius for a span and largest span for a radius, in the wind."""

from __future__ import annotations

import argparse
from pathlib import Path

from models.catenary.definition.line_definition import CatenaryDefinition
from models.commands import spans_report
from models.commands.desk import spans_page
from models.commands.physics_files import write_csv, write_figure, write_text
from models.commands.physics_options import check_folder, new_folder, own_settings, print_table, warn
from models.definition_files.parameter import ParameterError
from models.interface.line_spans import SpanTable, tabulated
from models.library.catalogue import doubts, line_path, load_line


def run(arguments: argparse.Namespace) -> int:
    """Compute, print, and write if asked to."""
    check_folder(arguments.out)
    definition = load_line(arguments.line)
    warn(doubts("lines", arguments.line))
    definition = definition.with_values(own_settings(arguments.set, "line", definition))
    found = tabulated(
        definition,
        arguments.wind,
        arguments.pressure,
        _limit(arguments),
        arguments.head or "",
        arguments.radius or (),
        [tuple(pair) for pair in arguments.stagger],
        ("--wind", "--pressure"),
    )
    warn(spans_report.warnings(definition, found))
    text = spans_report.heading(found)
    rows = spans_report.rows(found.lengths, found.smallest_radius, 0)
    print_table(f"Smallest radius [m]: {text}", ("span [m]", *found.names), rows)
    rows = spans_report.span_rows(found)
    print_table(f"Largest span [m]: {text}", spans_report.span_heads(found), rows)
    if arguments.out is not None:
        write(new_folder(arguments.out), found, definition, arguments)
        print(f"page, tables and plot: {arguments.out}")
    return 0


def write(folder: Path, found: SpanTable, definition: CatenaryDefinition, arguments: argparse.Namespace) -> None:
    """Write ``spans.html``, ``radii.csv``, ``spans.csv`` and ``spans.png``."""
    for name, (titles, columns) in found.tables.items():
        write_csv(folder / f"{name}.csv", titles, columns)
    write_figure(folder / "spans.png", spans_report.figure(found), 150)
    asked = [("changed", f"{s.part}.{s.parameter} = {s.value}") for s in arguments.set if s.part == "line"]
    if arguments.head is not None:
        asked.insert(0, ("limit of", f"a head of {arguments.head} mm, EN 50367 and EN 15273"))
    write_text(folder / "spans.html", spans_page.page(definition, found, str(line_path(arguments.line)), asked))


def _limit(arguments: argparse.Namespace) -> float | None:
    """Return the permissible offset as given [m], None where it is that of a head."""
    if arguments.limit is None and arguments.head is None:
        raise ParameterError("how far may the wire be blown? give --limit, in m, or --head 1600 or 1950")
    return None if arguments.limit is None else float(arguments.limit)
