"""``python -m models asbuilt DESIGN MEASURED``: a line as it hangs, from a measuring run, and what to correct."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from models.commands import as_built_plots, as_built_tables
from models.commands.desk.as_built_page import page
from models.commands.physics_files import write_csv, write_figure, write_text
from models.commands.physics_options import check_folder, new_folder, print_table, warn
from models.definition_files.parameter import ParameterError
from models.layout.as_built.alignment import LARGEST_SCALE
from models.layout.as_built.as_built_definition import as_built_text
from models.layout.as_built.as_built_line import Tell, silent
from models.layout.as_built.as_built_outcome import AGREEMENT, AsBuiltOutcome, judge_as_built
from models.layout.as_built.dropper_corrections import Allowed
from models.layout.as_built.measured_reading import read_measured_run
from models.library.catalogue import doubts, line_path, load_line
from models.library.norm_tables import support_limits

#: Files that are written; a measuring run or a design of such a name in the same folder would be lost.
BUILT, CORRECTED, SURFACE, DROPPERS = "asbuilt.toml", "corrected.toml", "running_surface.csv", "droppers.csv"
FIGURES: Final = ("errors.png", "heights.png")
#: What a tolerance or a step may be [mm]; less was written in metres.
MILLIMETRES: Final = (0.1, 500.0)
#: Droppers that are printed at most.
_PRINTED: Final = 40
PAGE: Final = "asbuilt.html"


def run(arguments: argparse.Namespace) -> int:
    """Align, find lengths as fitted, correct; print and write."""
    check_folder(arguments.out)
    for name in ("tolerance", "step"):
        _check_millimetres(name, getattr(arguments, name))
    definition = load_line(arguments.line)
    design_path = line_path(arguments.line)
    _check_written(arguments.out, design_path, arguments.measured)
    warn(doubts("lines", arguments.line))
    measured = read_measured_run(arguments.measured)
    warn(measured.notes)
    allowed = Allowed(1e-3 * arguments.step, arguments.only, support_limits().shortest_dropper)
    with _progress(quiet=arguments.quiet) as tell:
        found = judge_as_built(definition, measured, 1e-3 * arguments.tolerance, allowed, tell)
    doubtful = tuple(_doubts(found))
    warn(doubtful)
    folder = new_folder(arguments.out)
    write(folder, found, design_path, measured.source)
    drawn = {"errors": as_built_plots.errors(found), "heights": as_built_plots.heights(found)}
    for name, figure in drawn.items():
        write_figure(folder / f"{name}.png", figure, 150)
    write_text(folder / PAGE, page(found, str(design_path), doubtful, drawn))
    _print(arguments.line, found)
    print(f"page: {folder / PAGE}, with definitions, tables and figures beside it")
    return 0


def _print(line: str, found: AsBuiltOutcome) -> None:
    print_table(f"{line} as built", ("quantity", "value"), as_built_tables.summary(found))
    if rows := as_built_tables.worst_rows(found, _PRINTED):
        columns, *found_rows = ([row[k] for k in as_built_tables.PRINTED] for row in (as_built_tables.COLUMNS, *rows))
        lines = [[cell.removeprefix("failed, ") for cell in row] for row in found_rows]  # as all of them have
        count = int(found.is_beyond.sum())
        which = f", the worst {len(rows)} of {count} ({DROPPERS} has all)" if len(rows) < count else ""
        print_table(f"Droppers that failed, beyond the tolerance{which}", columns, lines)


def write(folder: Path, found: AsBuiltOutcome, design_path: Path, source: str) -> None:
    """Write the definitions as built and as corrected, the running surface and the table."""
    text, built = design_path.read_text(encoding="utf-8-sig"), found.built
    surface = "" if found.surface.is_even else SURFACE
    designed = built.design.unstrained_length
    where = f"openpanto asbuilt, from {source}".replace("\\", "/").replace('"', "'")
    missing = int((~built.is_measured).sum())
    as_designed = f"; {missing} droppers were not measured and are as designed" if missing else ""
    for name, state, what in (
        (BUILT, built.fitted.state, "as it hangs"),
        (CORRECTED, found.corrections.state, "with droppers changed as droppers.csv says"),
    ):
        remark = f"Line '{built.definition.name}' {what}, by {where}{as_designed}."
        error = state.unstrained_length - designed
        stem = name.removesuffix(".toml")
        write_text(folder / name, as_built_text(text, stem, built.design, error, where, remark, surface))
    write_csv(folder / SURFACE, ("position [m]", "height [mm]"), (found.surface.x, 1e3 * found.surface.r), 8)
    write_text(folder / DROPPERS, as_built_tables.droppers_csv(found))


def _check_millimetres(name: str, value: float) -> None:
    low, high = MILLIMETRES
    if not low <= value <= high:
        raise ParameterError(f"--{name} {value:g}: is outside {low:g} ... {high:g} mm, in which it is given")


def _check_written(folder: Path, *read: Path) -> None:
    """Refuse to write over what is read."""
    written = {(folder / name).resolve() for name in (BUILT, CORRECTED, SURFACE, DROPPERS, PAGE, *FIGURES)}
    if lost := [path for path in read if path.resolve() in written]:
        raise ParameterError(f"--out {folder}: {lost[0]} would be written over; name another folder")


def _doubts(found: AsBuiltOutcome) -> Iterator[str]:
    built = found.built
    if not built.alignment.by:
        yield (
            f"{built.run.source} has neither staggers nor structures that the design names: its positions are taken "
            "as the design's, and an error of a metre moves heights by millimetres"
        )
    named = [s.structure for section in built.definition.sections for s in section.supports if s.structure]
    if named and (strange := sorted({name for name in built.run.structure if name} - set(named))):
        yield (
            f"{built.run.source}: {len(strange)} structures, '{strange[0]}' the first, are none of the design's and "
            "say nothing here"
        )
    if abs(built.alignment.scale) > LARGEST_SCALE:
        yield (
            f"the way of {built.run.source} differs by {100.0 * built.alignment.scale:+.2f} % from the design's, and "
            f"{100.0 * LARGEST_SCALE:g} % is what a vehicle's may: check positions, and lengths of spans"
        )
    if built.difference > AGREEMENT:
        yield (
            f"form finding and the influences of lengths differ by {1e3 * built.difference:.2f} mm: what droppers are "
            "to be changed by is less sure than it looks"
        )
    if slack := int((built.is_slack & built.is_measured).sum()):
        yield (
            f"droppers that hang slack, or may: {slack}; they may be longer than heights tell, by which they are to be "
            "changed: measure them before they are cut"
        )
    if missing := int((~built.is_measured).sum()):
        yield f"{missing} droppers have too few measured heights beside them: they are taken as designed"


@contextmanager
def _progress(*, quiet: bool) -> Iterator[Tell]:
    """Show what is being done, on a terminal."""
    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield silent
        return
    with Progress(TextColumn("{task.description}"), BarColumn(), console=console, transient=True) as bar:
        task = bar.add_task("reading")
        yield lambda what, done, whole: bar.update(task, description=what, completed=done, total=whole)
