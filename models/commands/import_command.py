"""``python -m models import LAYOUT``: the definition of a line from tables as CSV or XLSX."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from models.catenary.definition.line_definition import CatenaryDefinition
from models.commands.physics_files import write_text
from models.commands.physics_options import warn
from models.definition_files.parameter import ParameterError
from models.layout.layout_import import import_layout
from models.library.catalogue import doubts, line_path
from models.library.definition_copy import CopyError, checked_name


def run(arguments: argparse.Namespace) -> int:
    """Read the layout, and write the definition if all of it is right."""
    out: Path = arguments.out
    design = None if arguments.design is None else line_path(arguments.design)
    name = _name(out, design)
    imported = import_layout(arguments.layout, name, design, out)
    warn([*(doubts("lines", arguments.design) if design is not None else ()), *imported.notes])
    write_text(out, imported.text)
    print(_summary(imported.definition))
    print(f"{out}; next: openpanto statics {shlex.quote(str(out))}")
    return 0


def _name(out: Path, design: Path | None) -> str:
    """Return the name of a line that is written to a file."""
    if out.suffix != ".toml":
        raise ParameterError(f"--out {out}: a definition is written, so name a file that ends with .toml")
    if design is not None and out.exists() and out.samefile(design):
        raise ParameterError(f"--out {out}: that is the design, which is left as it is; name another file")
    try:
        return checked_name(out.stem)
    except CopyError as error:
        raise ParameterError(f"--out {out}: {error}") from error


def _summary(line: CatenaryDefinition) -> str:
    """Return what a line has, in a sentence."""
    spans = [span for section in line.sections for span in section.spans]
    hung = sum(len(span.droppers) + len(span.hangers) for span in spans)
    given = sum(len(span.dropper_lengths) + len(span.hanger_lengths) for span in spans)
    lengths = "all with their lengths" if given == hung else f"{given} with their lengths" if given else "lengths open"
    sections = f"{len(line.sections)} sections, " if len(line.sections) > 1 else ""
    start, end = min(span.start for span in spans), max(span.end for span in spans)
    return f"{line.name}: {sections}{len(spans)} spans from {start:g} to {end:g} m, {hung} droppers, {lengths}"
