"""``python -m models export LINE``: the layout of a line as tables, with the lengths that its droppers are cut to."""

from __future__ import annotations

import argparse
from pathlib import Path

from models.commands.physics_files import write_atomically, write_text
from models.commands.physics_options import check_folder, new_folder, warn
from models.definition_files.parameter import ParameterError
from models.layout.drawing_export import plan_drawing, profile_drawing
from models.layout.layout_export import ExportedLine, csv_text, export_line
from models.layout.layout_sheets import SHEETS
from models.layout.xlsx_sheets import workbook_bytes
from models.library.catalogue import doubts, line_path


def run(arguments: argparse.Namespace) -> int:
    """Find the form of the line and write its tables."""
    folder: Path = arguments.out
    check_folder(folder)
    exported = export_line(line_path(arguments.line))
    warn([*doubts("lines", arguments.line), *exported.notes])
    files = _files(exported, as_workbook=arguments.xlsx)
    if arguments.dxf:
        files |= {"profile.dxf": profile_drawing(exported.state), "plan.dxf": plan_drawing(exported.state)}
    if not arguments.xlsx:
        _check_leftovers(folder, exported)
    new_folder(folder)
    for name, content in files.items():
        if isinstance(content, str):
            write_text(folder / name, content)
        else:
            write_atomically(folder / name, content)
    print(f"{folder}: {', '.join(files)}; {len(exported.sheets['droppers']) - 1} droppers with their lengths")
    return 0


def _files(exported: ExportedLine, *, as_workbook: bool) -> dict[str, str | bytes]:
    if as_workbook:
        return {f"{exported.state.shape.definition.name}.xlsx": workbook_bytes(exported.sheets)}
    return {f"{name}.csv": csv_text(rows) for name, rows in exported.sheets.items()}


def _check_leftovers(folder: Path, exported: ExportedLine) -> None:
    """Refuse a folder with sheets of another layout, which would become part of this one."""
    others = [name for name in SHEETS if name not in exported.sheets and (folder / f"{name}.csv").exists()]
    if others:
        text = f"has {others[0]}.csv of another layout, which this line has not: remove it, or name another folder"
        raise ParameterError(f"--out {folder}: {text}")
