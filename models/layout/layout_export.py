"""From a line to its layout: the sheets that an import reads, with the dropper lengths that form finding gives."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from models.catenary.definition import line_reading
from models.catenary.definition.line_definition import CatenaryDefinition
from models.catenary.definition.section_definition import Section, Span
from models.catenary.definition.section_reading import SECTION_TABLES
from models.catenary.shape.form_finding import StaticState
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.catenary.shape.support_places import SupportPlaces
from models.definition_files.toml_reader import Table
from models.layout.csv_sheets import safe_text
from models.layout.definition_draft import flattened
from models.layout.layout_import import WIRE_COLUMNS
from models.layout.layout_sheets import ANCHOR, DROPPER, HANGER, SEAM, SUPPORT, UNREGISTERED

Cell = str | float | None
Rows = list[list[Cell]]

#: Units of wires in a layout, and their size in SI.
_WIRE_UNITS: Final = {
    "area": ("mm2", 1e-6), "mass": ("kg/m", 1.0), "youngs_modulus": ("GPa", 1e9), "tension": ("N", 1.0),
    "bending_stiffness": ("N.m2", 1.0), "diameter": ("mm", 1e-3), "stiffness": ("N/m", 1.0),
}  # fmt: skip
#: Keys that the sheet supports has as columns.
_OF_SUPPORTS: Final = (
    "profile.contact_wire_height", "profile.encumbrance", "steady_arm.length", "steady_arm.angle",
)  # fmt: skip
#: Lists of [track], which the sheet track has.
_OF_TRACK: Final = ("track.positions", "track.curvature", "track.radius", "track.cant", "track.vertical_curvature")


@dataclass(frozen=True)
class ExportedLine:
    """A line as a layout: its sheets, rows of cells of which the first has the names, its shape, and what lacks."""

    sheets: Mapping[str, Rows]
    state: StaticState
    notes: tuple[str, ...]


def export_line(path: Path) -> ExportedLine:
    """Return the layout of a line, read from its definition file.

    Raises
    ------
    DefinitionError
        If the file is wrong.
    EquilibriumError
        If the line cannot hang as designed.
    """
    definition, data = line_reading.load(path), Table.load(path).data
    state = kept_form(definition, build_mesh(definition))
    sheets = {
        "supports": _supports(definition),
        "droppers": _droppers(definition, state),
        "wires": _wires(definition, data),
        "line": _line(data),
    }
    if definition.track is not None:
        sheets["track"] = _track(definition)
    return ExportedLine(sheets, state, tuple(_notes(path, data)))


def csv_text(rows: Rows) -> str:
    """Return a sheet as the text of a CSV file."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([["" if cell is None else _shown(cell) for cell in row] for row in rows])
    return text.getvalue()


def _shown(cell: str | float) -> str:
    return safe_text(cell) if isinstance(cell, str) else f"{cell:.12g}"


def _notes(path: Path, data: Mapping[str, Any]) -> Iterator[str]:
    """Yield what of a line its layout does not say."""
    if (surface := data.get("running_surface", {}).get("profile")) is not None:
        yield f"{path}: {surface} is named in the layout and no part of it: copy it to where the definition will lie"
    for table in data.get("section", [data]):
        if "measured" in table:
            yield f"{path}: [measured] is not in the layout: the droppers have the lengths that its heights give"
        if "as_built" in table:
            yield f"{path}: [as_built] is not in the layout: the droppers have their lengths as designed"
        ends = table.get("ends", {})
        if any("length" in end for end in (ends, ends.get("start", {}), ends.get("end", {}))):
            yield f"{path}: the length in [ends] is not in the layout: wires rise from the last support with an arm"


# Supports


def _supports(definition: CatenaryDefinition) -> Rows:
    several = len(definition.sections) > 1
    rows = [
        {"section": str(number) if several else None, **row}
        for number, section in enumerate(definition.sections, 1)
        for row in _section(definition, section)
    ]
    units = {
        "position": "m", "span_length": "m", "height": "m", "encumbrance": "m", "stagger": "mm",
        "messenger_stagger": "mm", "arm_length": "m", "arm_angle": "deg",
    }  # fmt: skip
    names = ("section", "structure", "kind", *units, "arm_side")
    used = [name for name in names if any(row.get(name) not in (None, "") for row in rows)]
    heading: list[Cell] = [f"{name} [{units[name]}]" if name in units else name for name in used]
    return [heading, *([row.get(name) for name in used] for row in rows)]


def _section(definition: CatenaryDefinition, section: Section) -> Iterator[dict[str, Cell]]:
    """Yield the rows of a section's supports, by column."""
    places = SupportPlaces(definition, section)
    lengths = [span.length for span in section.spans]
    last = len(places.supports) - 1
    arms = definition.steady_arm
    registered = [k for k, s in enumerate(places.supports) if s.has_steady_arm or arms is None]
    for k, support in enumerate(places.supports):
        end = k in (0, last)
        kind = (SEAM if section.periodic else ANCHOR) if end else SUPPORT if k in registered else UNREGISTERED
        has_arm = arms is not None and kind in (SUPPORT, SEAM)
        row: dict[str, Cell] = {
            "structure": support.structure,
            "kind": kind,
            "position": support.x,
            "span_length": lengths[k] if k < last else None,
            "height": places.height(support.x) + section.ends.rise_at(support.x),
            "encumbrance": places.encumbrance(support.x),
            "stagger": 1e3 * support.stagger,
            "messenger_stagger": None if support.messenger_stagger is None else 1e3 * support.messenger_stagger,
        }
        if has_arm:
            assert arms is not None
            angle = arms.angle if support.arm_angle is None else support.arm_angle
            row["arm_length"] = arms.length if support.arm_length is None else support.arm_length
            row["arm_angle"] = math.degrees(angle)
            row["arm_side"] = None if support.arm_side is None else float(support.arm_side)
        yield row


# Droppers


def _droppers(definition: CatenaryDefinition, state: StaticState) -> Rows:
    lengths = _lengths(state)
    several, compound = len(definition.sections) > 1, definition.auxiliary_wire is not None
    heading: list[Cell] = ["section"] if several else []
    heading += ["span", "dropper", *(["kind"] if compound else []), "position [m]", "length [mm]"]
    rows: Rows = [heading]
    for number, section in enumerate(definition.sections, 1):
        for span_number, span in enumerate(section.spans, 1):
            for kind, places in _hung(span):
                for count, x in enumerate(places, 1):
                    row: list[Cell] = [str(number)] if several else []
                    row += [span_number, count, *([kind] if compound else []), round(x - span.start, 9)]
                    rows.append([*row, round(1e3 * lengths[number - 1, kind == HANGER, x], 4)])
    return rows


def _hung(span: Span) -> tuple[tuple[str, Sequence[float]], ...]:
    return (DROPPER, span.droppers), (HANGER, span.hangers)


def _lengths(state: StaticState) -> dict[tuple[int, bool, float], float]:
    """Return the unstrained length of every dropper [m] by section, whether it is a hanger, and place."""
    mesh = state.shape.mesh
    lower = mesh.droppers[:, 0]
    # Nodes have the places of the definition, to the bit.
    keys = zip(mesh.section[lower].tolist(), mesh.is_hanger.tolist(), mesh.points[lower, 0].tolist(), strict=True)
    return _Nearest(zip(keys, state.unstrained_length.tolist(), strict=True))


class _Nearest(dict[tuple[int, bool, float], float]):
    """Lengths by place; a place that a node shares with another is found within a micrometre."""

    def __missing__(self, key: tuple[int, bool, float]) -> float:
        section, hanger, x = key
        near = min((k for k in self if k[:2] == (section, hanger)), key=lambda k: abs(k[2] - x))
        if abs(near[2] - x) > 1e-6:
            raise KeyError(key)
        return self[near]


# Wires, all else


def _wires(definition: CatenaryDefinition, data: Mapping[str, Any]) -> Rows:
    there = {name: part for name in WIRE_COLUMNS if (part := getattr(definition, name)) is not None}
    used = [n for n in _WIRE_UNITS if any(getattr(part, n, None) is not None for part in there.values())]
    heading: list[Cell] = ["component", *(f"{n} [{_WIRE_UNITS[n][0]}]" for n in used), "source"]
    rows: Rows = [heading]
    for name, part in there.items():
        values = [getattr(part, n, None) if n in WIRE_COLUMNS[name] else None for n in used]
        cells = [None if v is None else v / _WIRE_UNITS[n][1] for n, v in zip(used, values, strict=True)]
        sources = dict.fromkeys(data[name][n][2] for n in WIRE_COLUMNS[name] if n in data[name])
        rows.append([name, *cells, "; ".join(sorted(sources, key=lambda text: text.startswith("choice")))])
    return rows


def _line(data: Mapping[str, Any]) -> Rows:
    """Return the sheet of all keys that no other sheet has."""
    rows: Rows = [["key", "value", "unit", "source"]]
    for key, value in flattened(data):
        table, _, name = key.partition(".")
        elsewhere = table.partition("[")[0] in (*SECTION_TABLES, "section", "name") or key in (
            *_OF_SUPPORTS,
            *_OF_TRACK,
        )
        if elsewhere or name in WIRE_COLUMNS.get(table, ()):
            continue
        is_quantity = isinstance(value, list) and len(value) == 3 and isinstance(value[1], str)
        number, unit, source = value if is_quantity else (value, None, None)
        many = number if isinstance(number, list) else [number]
        rows.append([key, " ".join(map(_written, many)), unit, source])
    return rows


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.15g}" if isinstance(value, float) else str(value)


def _track(definition: CatenaryDefinition) -> Rows:
    track = definition.track
    assert track is not None
    columns = {
        "position [m]": track.positions,
        "curvature [1/m]": track.curvature,
        "radius [m]": track.radius,
        "cant [mm]": tuple(1e3 * D for D in track.cant),
        "vertical_curvature [1/m]": track.vertical_curvature,
    }
    given = {name: values for name, values in columns.items() if values}
    return [list(given), *map(list, zip(*given.values(), strict=True))]
