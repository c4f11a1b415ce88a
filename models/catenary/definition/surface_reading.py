"""Reading a measured running surface: a table of positions and heights in a CSV file beside the line's definition."""

from __future__ import annotations

import csv
import math
import re
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Final

from models.catenary.definition.section_definition import Section
from models.catenary.definition.surface_definition import LARGEST_HEIGHT, RunningSurface
from models.definition_files.message_text import not_utf8, said
from models.definition_files.si_units import shown, to_si
from models.definition_files.toml_reader import Table, beyond_all

#: What the file is called that an FMU carries beside its definition.
CARRIED: Final = "running_surface.csv"
#: Columns of the table, both lengths.
_COLUMNS: Final = ("position", "height")
_HEAD: Final = re.compile(r"\s*(\w+)\s*(?:\[\s*(.*?)\s*\])?\s*")
#: Largest step of the height where a line closes on itself [m].
_SEAM: Final = 1e-6
#: Most mistakes of a file that are listed.
_MOST: Final = 20

_Point = tuple[float, float]


def named_profile(path: Path) -> Path | None:
    """Return the file that a line's definition has its running surface from; None if it names none, or is no TOML."""
    try:
        surface = tomllib.loads(path.read_text(encoding="utf-8-sig")).get("running_surface")
    except (OSError, ValueError):
        return None
    name = surface.get("profile") if isinstance(surface, dict) else None
    return path.parent / name if name and isinstance(name, str) else None


def with_surface(table: Table, surface: RunningSurface, *, carried: bool) -> RunningSurface:
    """Return a running surface with the points of its profile, or the seed that a generated one has by default.

    Parameters
    ----------
    table : Table
        Of the line; mistakes of the profile are recorded there.
    surface : RunningSurface
        As its table says.
    carried : bool
        Whether the profile lies beside the definition under the name that FMUs have for it.
    """
    if not surface.profile:
        return surface if surface.seed is not None or surface.sigma is None else replace(surface, seed=0)
    path = Path(table.file).parent / (CARRIED if carried else surface.profile)
    points, mistakes = _read(path)
    for text in mistakes[:_MOST]:
        table.problem("running_surface.profile", f"{path.name}{text}")
    if len(mistakes) > _MOST:
        table.problem("running_surface.profile", f"{path.name}: ... and {len(mistakes) - _MOST} more mistakes")
    return replace(surface, points=() if mistakes else tuple(points))


def place_problem(points: Sequence[_Point], section: Section) -> str:
    """Return why a profile cannot be that of a section's wire, empty if it can."""
    first, last = points[0], points[-1]
    start, end = section.spans[0].start, section.spans[-1].end
    if first[0] >= end or last[0] <= start:
        return f"lies at {first[0]:g} ... {last[0]:g} m, beside the line, which is at {start:g} ... {end:g} m"
    if section.periodic and not start <= first[0] < last[0] <= end:
        return (
            f"lies at {first[0]:g} ... {last[0]:g} m: a line that closes on itself has one lap, {start:g} ... {end:g} m"
        )
    if section.periodic and abs(last[1] - first[1]) > _SEAM:
        text = "a line that closes on itself begins as high as it ends: the last height must be the first"
        return f"{text}, {1e3 * first[1]:g} mm, not {1e3 * last[1]:g} mm"
    return ""


def _read(path: Path) -> tuple[list[_Point], list[str]]:
    """Return points and mistakes; these begin with where they are in the file, if it could be read."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        return [], [f": there is no such file in {path.parent}"]
    except OSError as error:
        return [], [f": cannot be read ({said(error)})"]
    except UnicodeDecodeError as error:
        return [], [f": {not_utf8(error)}"]
    lines = text.splitlines()
    separator = next((s for s in (";", "\t") if lines and s in lines[0]), ",")
    head = next(csv.reader(lines[:1], delimiter=separator), [])
    places, units, mistakes = _columns(head)
    if mistakes:
        return [], mistakes
    points: list[_Point] = []
    kept: list[int] = []
    for number, line in enumerate(lines[1:], 2):
        if line.strip():
            cells = next(csv.reader([line], delimiter=separator))
            row, wrong = _row(cells, places, units, number, is_comma=separator != ",")
            mistakes += wrong
            if not wrong:
                points.append(row)
                kept.append(number)
    return points, [*mistakes, *_order(points, kept), *_count(points, mistakes)]


def _columns(head: Sequence[str]) -> tuple[list[int], list[str], list[str]]:
    """Return where the columns are, their units, and mistakes."""
    found: dict[str, tuple[int, str]] = {}
    mistakes = []
    for k, cell in enumerate(head):
        match = _HEAD.fullmatch(cell)
        name = match[1].lower() if match else cell.strip()
        if match is None or name not in _COLUMNS:
            mistakes.append(f", line 1, column {k + 1}: '{cell.strip()}' is none of the columns position and height")
        elif name in found:
            mistakes.append(f", line 1, column {k + 1}: '{name}' is the name of a column before it too")
        else:
            found[name] = k, match[2] or "m"
            try:
                to_si(1.0, found[name][1], "m")
            except ValueError as error:
                mistakes.append(f", line 1, column {k + 1}: {error}")
    mistakes += [
        f", line 1: has no column '{name}': write 'position [m],height [mm]'" for name in _COLUMNS if name not in found
    ]
    return [found[n][0] for n in _COLUMNS if n in found], [found[n][1] for n in _COLUMNS if n in found], mistakes


def _row(
    cells: Sequence[str], places: Sequence[int], units: Sequence[str], number: int, *, is_comma: bool
) -> tuple[_Point, list[str]]:
    """Return a point [m] and mistakes."""
    values, mistakes = [], []
    for name, k, unit in zip(_COLUMNS, places, units, strict=True):
        cell = cells[k].strip() if k < len(cells) else ""
        try:
            value = to_si(float(cell.replace(",", ".") if is_comma else cell), unit, "m")
        except ValueError:
            value = math.nan
        if not cell:
            mistakes.append(f", line {number}: has no {name}")
        elif math.isnan(value) or beyond_all(value):
            mistakes.append(f", line {number}, {name}: '{cell}' is not a number that a wire can have")
        elif name == "height" and abs(value) > LARGEST_HEIGHT:
            most = shown(LARGEST_HEIGHT, "m")
            mistakes.append(
                f", line {number}: a height of {value:g} m is more than {most} from the static shape: check its unit"
            )
        values.append(value)
    if len(cells) > len(places) and any(cell.strip() for cell in cells[len(places) :]):
        mistakes.append(f", line {number}: has {len(cells)} values for {len(places)} columns")
    return (values[0], values[1]), mistakes


def _order(points: Sequence[_Point], lines: Sequence[int]) -> Iterator[str]:
    for number, ((before, _), (x, _)) in zip(lines[1:], pairwise(points), strict=True):
        if x <= before:
            yield f", line {number}: the position {x:g} m does not lie beyond that before it, {before:g} m"


def _count(points: Sequence[_Point], mistakes: Sequence[str]) -> Iterator[str]:
    if len(points) < len(_COLUMNS) and not mistakes:
        yield f": has {len(points)} points where a surface takes at least 2"
