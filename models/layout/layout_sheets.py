"""What a layout is: its sheets and their columns, declared once, and how they are found in a folder or a workbook."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from models.definition_files.message_text import hint, said, shown_value
from models.layout.csv_sheets import SheetGrid, read_csv
from models.layout.sheet_problems import Place, SheetProblems
from models.layout.sheet_table import SheetColumn, SheetTable, read_table
from models.layout.xlsx_sheets import read_xlsx

#: Rows of the sheet supports: where wires end, where an arm holds them, where none does, where a ring closes.
ANCHOR, SUPPORT, UNREGISTERED, SEAM = KINDS = ("anchor", "support", "unregistered", "seam")
#: Rows of the sheet droppers.
DROPPER, HANGER = HUNG = ("dropper", "hanger")
#: Rows of the sheet wires.
COMPONENTS: Final = (
    "contact_wire", "messenger_wire", "stitch_wire", "auxiliary_wire", "dropper", "hanger", "steady_arm",
)  # fmt: skip
_FALLING: Final = "rising"


@dataclass(frozen=True)
class Sheet:
    """A sheet that a layout may have: what it says, and its columns."""

    description: str
    columns: tuple[SheetColumn, ...]


_TRACK: Final = (
    SheetColumn("curvature", "1/m", "of the track; above 0: a curve to the left", minimum=-1.0 / 15.0, maximum=1 / 15),
    SheetColumn("radius", "m", "instead of the curvature; 0: straight track", minimum=-1e7, maximum=1e7),
    SheetColumn("cant", "m", "how much higher the right rail is than the left one", minimum=-0.3, maximum=0.3),
)
SHEETS: Final[Mapping[str, Sheet]] = {
    "supports": Sheet(
        "a row for every support, from anchor to anchor",
        (
            SheetColumn("section", "", "name of the set of wires, in a line of several; empty: the only one"),
            SheetColumn("structure", "", "name of the mast"),
            SheetColumn(
                "kind", "", "`anchor` (first and last row of a section, where it is empty), `support` (others), "
                "`unregistered` (beside an anchor, without a steady arm), `seam` (first and last row of a line that "
                "closes on itself)", choices=KINDS,
            ),
            SheetColumn("position", "m", f"along the track, {_FALLING}", required=True, minimum=-1e7, maximum=1e7),
            SheetColumn("span_length", "m", "of the span that begins here, checked against positions", positive=True),
            SheetColumn(
                "height", "m", "of the contact wire above the rails, without its pre-sag; at an anchor where it ends",
                minimum=2.0, maximum=15.0,
            ),
            SheetColumn("encumbrance", "m", "messenger wire above contact wire", minimum=0.05, maximum=5.0),
            SheetColumn("stagger", "m", "place of the contact wire, to the left", minimum=-10.0, maximum=10.0),
            SheetColumn("messenger_stagger", "m", "of the messenger wire, to the left", minimum=-2.0, maximum=2.0),
            *_TRACK,
            SheetColumn("arm_length", "m", "of the steady arm", minimum=0.1, maximum=10.0),
            SheetColumn(
                "arm_angle", "rad", "of the steady arm, to the horizontal; below 0: falls towards the wire",
                minimum=-1.2, maximum=1.2,
            ),
            SheetColumn("arm_side", "1", "of its registration end: 1 left, -1 right of the wire", whole=True),
        ),
    ),
    "droppers": Sheet(
        "a row for every dropper",
        (
            SheetColumn("section", "", "name of the section, in a line of several"),
            SheetColumn("span", "1", "its number in the section, from 1", required=True, whole=True, minimum=1),
            SheetColumn("dropper", "1", "its number in the span, from 1, checked", whole=True, minimum=1),
            SheetColumn("kind", "", "`hanger`: between auxiliary and messenger wire", choices=HUNG),
            SheetColumn("position", "m", "from the span's start", required=True, minimum=-1e7, maximum=1e7),
            SheetColumn(
                "length", "m", "without tension; without any in a span, form finding gives them",
                minimum=0.02, maximum=10.0,
            ),
        ),
    ),
    "wires": Sheet(
        "a row for every component",
        (
            SheetColumn("component", "", "which one", required=True, choices=COMPONENTS),
            SheetColumn("area", "m2", "cross-section", positive=True),
            SheetColumn("mass", "kg/m", "per length", minimum=0.0),
            SheetColumn("youngs_modulus", "Pa", "Young's modulus", positive=True),
            SheetColumn("tension", "N", "of a wire", positive=True),
            SheetColumn("bending_stiffness", "N.m2", "EI of a wire, if not of a round solid section", minimum=0.0),
            SheetColumn("diameter", "m", "that the wind meets, if not of a round solid section", positive=True),
            SheetColumn("stiffness", "N/m", "of a dropper, instead of area and Young's modulus", positive=True),
            SheetColumn("source", "", "where the values are from"),
        ),
    ),
    "line": Sheet(
        "all else that a definition may say, a row for every key",
        (
            SheetColumn("key", "", "[key of a line](reference/line-keys.md), `damping.alpha`", required=True),
            SheetColumn("value", "", "a number, several with blanks between them, or a text", required=True),
            SheetColumn("unit", "", "of the number"),
            SheetColumn("source", "", "where the value is from"),
        ),
    ),
    "track": Sheet(
        "curves that do not begin and end at supports, instead of those columns of the sheet supports",
        (
            SheetColumn("position", "m", f"along the track, {_FALLING}; twice: a jump", required=True,
                        minimum=-1e7, maximum=1e7),
            *_TRACK,
            SheetColumn("vertical_curvature", "1/m", "of the gradient; above 0: hollow", minimum=-0.01, maximum=0.01),
        ),
    ),
}  # fmt: skip
#: Sheets without which there is no layout.
REQUIRED: Final = ("supports", "droppers")


@dataclass(frozen=True)
class Layout:
    """A layout as read: the sheets that it has, and what deserves a second look.

    Attributes
    ----------
    name : str
        Of the folder or the workbook, without its place.
    sheets : mapping of str to SheetTable
        By name.
    notes : tuple of str
        Sheets that were not read: hidden ones, and those that are none of a layout's.
    """

    name: str
    sheets: Mapping[str, SheetTable]
    notes: tuple[str, ...]


def read_layout(path: Path, problems: SheetProblems) -> Layout:
    """Read the sheets of a layout, a folder of CSV files or a workbook, telling all that is wrong with their cells.

    Raises
    ------
    LayoutError
        If there are no sheets to be read.
    """
    grids = _grids(path, problems)
    known = {name: grid for name, grid in grids.items() if name in SHEETS}
    if not known:
        if not problems.found:
            there = f"; it has {', '.join(map(repr, sorted(grids)))}" if grids else ""
            if path.is_dir() and (books := sorted(path.glob("*.xlsx"))):
                there += f"; if {books[0].name} is one, name that file"
            what = "folder of CSV files" if path.is_dir() else "workbook"
            text = f"is no layout: a {what} with the sheets {', '.join(REQUIRED)} and wires is wanted{there}"
            problems.add(Place(""), text)
        problems.finish()
    for name in REQUIRED:
        if name not in known and not problems.has(name):
            near = hint(name, [other for other in grids if other not in SHEETS])
            is_hidden = name in [title.strip().casefold() for title in problems.hidden]
            problems.add(Place(name), "the sheet is hidden: show it" if is_hidden else f"the sheet is missing{near}")
    tables = {name: read_table(grid, SHEETS[name].columns, problems) for name, grid in known.items()}
    others = sorted(set(grids) - set(SHEETS))
    notes = tuple(f"{path}: the sheet {shown_value(n)} is none of a layout's and was not read" for n in others)
    return Layout(
        path.name or str(path), {name: t for name, t in tables.items() if t is not None}, (*problems.notes, *notes)
    )


def _grids(path: Path, problems: SheetProblems) -> dict[str, SheetGrid]:
    """Return the sheets by their names in lower case, having told of those that cannot be read."""
    try:
        if path.is_dir():
            return _folder(path, problems)
        if path.suffix.lower() in (".xlsx", ".xlsm"):
            return read_xlsx(path, problems)
        path.stat()
    except OSError as error:
        problems.add(Place(""), f"cannot be read ({said(error)})")
        return {}
    text = "is neither a folder of CSV files nor a workbook (.xlsx)"
    one = path.suffix.lower() == ".csv"
    problems.add(Place(""), text + (": name the folder that this file lies in" if one else ""))
    return {}


def _folder(path: Path, problems: SheetProblems) -> dict[str, SheetGrid]:
    grids: dict[str, SheetGrid] = {}
    seen: set[str] = set()
    for file in sorted(path.iterdir()):
        name = file.stem.casefold()
        if file.suffix.lower() != ".csv" or file.name.startswith("."):
            continue
        if name in seen:
            problems.add(
                Place(name), f"stands in two files, {file.name} and one whose name differs in its letters' case"
            )
            continue
        seen.add(name)
        grid = read_csv(file, name, problems) if name in SHEETS else SheetGrid(name, ())
        if grid is not None:
            grids[name] = grid
    return grids
