"""From a layout to the definition of a line: every value with the sheet and row that it comes from as its source."""

from __future__ import annotations

import copy
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, get_type_hints

import numpy as np

from models.catenary.definition import line_reading
from models.catenary.definition.line_definition import CatenaryDefinition, LineType
from models.catenary.definition.section_reading import SECTION_TABLES
from models.definition_files.given_value import WITH_UNIT
from models.definition_files.toml_reader import DefinitionError, Problem, Table
from models.layout.definition_draft import DefinitionDraft, KeyFormError, toml_text
from models.layout.layout_sections import read_sections, spanned
from models.layout.layout_sheets import Layout, read_layout
from models.layout.layout_supports import put_sections
from models.layout.sheet_problems import Place, ProblemsOfOthers, SheetProblems
from models.layout.sheet_table import SheetTable

_WIRE: Final = ("area", "mass", "youngs_modulus", "tension", "bending_stiffness", "diameter")
_HUNG: Final = ("area", "mass", "youngs_modulus", "stiffness")
#: Component -> columns of the sheet wires that it has.
WIRE_COLUMNS: Final[Mapping[str, tuple[str, ...]]] = {
    "contact_wire": _WIRE,
    "messenger_wire": _WIRE,
    "stitch_wire": _WIRE,
    "auxiliary_wire": _WIRE,
    "dropper": _HUNG,
    "hanger": _HUNG,
    "steady_arm": ("area", "mass", "youngs_modulus"),
}
_UNITS: Final = {
    "area": "m2", "mass": "kg/m", "youngs_modulus": "Pa", "tension": "N", "bending_stiffness": "N.m2",
    "diameter": "m", "stiffness": "N/m",
}  # fmt: skip
#: Without which there is no line.
_NEEDED: Final = ("contact_wire", "messenger_wire", "dropper")
#: Tables of a definition, of which a key names a value, and those that have tables in them.
_TABLES: Final = {
    k for k, hint in get_type_hints(CatenaryDefinition).items() if hint not in (str, int, float, LineType)
}
_NESTED: Final = ("damping", "tensioning", "wind")
_TRACK: Final = {"curvature": "1/m", "radius": "m", "cant": "m", "vertical_curvature": "1/m"}
#: How the reader of definitions begins to tell of a key that there is not.
_UNKNOWN: Final = "unknown key"
#: Tables of a definition in which something lacks where a sheet is wrong.
_CONSEQUENT: Final = (*SECTION_TABLES, "section", "profile", "track", *WIRE_COLUMNS)
#: What a layout without a design and without damping gets.
_DAMPING: Final = {"alpha": (1e-4, "s"), "beta": (0.0125, "1/s")}
_NO_DAMPING: Final = "choice: the layout says nothing of damping; as the reference lines of EN 50318"


@dataclass(frozen=True)
class ImportedLine:
    """A line made from a layout: its definition, the text of its file, and what deserves a second look."""

    definition: CatenaryDefinition
    text: str
    notes: tuple[str, ...]


def import_layout(path: Path, name: str, design: Path | None = None, out: Path | None = None) -> ImportedLine:
    """Return the line that a layout describes.

    Parameters
    ----------
    path : Path
        Folder of CSV files, or workbook.
    name : str
        Of the line.
    design : Path, optional
        Definition file of the line that gives what the layout does not.
    out : Path, optional
        Where the definition will lie; files that it names lie beside it.

    Raises
    ------
    DefinitionError
        Of the design, or ``LayoutError`` with everything that is wrong with the layout.
    """
    behind = None if design is None else _Design(design)
    problems = SheetProblems(str(path))
    layout = read_layout(path, problems)
    maker = _Maker(layout, behind, problems)
    maker.fill(name)
    text = toml_text(maker.draft.data, f"Imported from {layout.name} by openpanto import.")
    definition = maker.read(text, out or Path(name))
    problems.finish()
    assert definition is not None
    return ImportedLine(definition, text, (*layout.notes, *maker.notes))


class _Design:
    """A line whose values stand where a layout has none."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.definition = line_reading.load(path)
        self.data = Table.load(path).data

    def behind(self) -> dict[str, Any]:
        """Return what a layout does not replace as a whole."""
        return {k: copy.deepcopy(v) for k, v in self.data.items() if k not in (*SECTION_TABLES, "section")}

    def stagger(self) -> Any:
        """Return the table [stagger], of the first section if there are several."""
        return copy.deepcopy(self.data.get("section", [self.data])[0].get("stagger"))


class _Maker:
    """Makes a definition from the sheets, one after the other."""

    def __init__(self, layout: Layout, design: _Design | None, problems: SheetProblems) -> None:
        self.layout, self.design, self.problems = layout, design, problems
        self.draft = DefinitionDraft({} if design is None else design.behind())
        self.notes: list[str] = []
        self.keys: dict[str, Place] = {}

    def fill(self, name: str) -> None:
        """Put all sheets into the draft, telling what is wrong."""
        nothing = Place("")
        self.draft.put("name", name, nothing)
        self.draft.put("title", f"imported from {self.layout.name}", nothing)
        self.draft.put("type", self._type(), nothing)
        sheets = self.layout.sheets
        if "line" in sheets:
            self._put_keys(sheets["line"])
        if "wires" in sheets:
            self._put_wires(sheets["wires"])
        self._check_components()
        if "supports" in sheets:
            self._put_supports(sheets["supports"])
        self._put_track()
        if not self.draft.has("damping"):
            for key, (value, unit) in _DAMPING.items():
                self.draft.put(f"damping.{key}", [value, unit, _NO_DAMPING], nothing)
            what = "alpha 1e-4 s and beta 0.0125 1/s, as the reference lines of EN 50318, were written as a choice"
            self.notes.append(f"{self.layout.name} says nothing of damping: {what}")

    def read(self, text: str, out: Path) -> CatenaryDefinition | None:
        """Return the definition as its file will be read, or tell what is wrong, with the places in the sheets."""
        try:
            return line_reading.read(Table.from_dict(tomllib.loads(text), str(out)))
        except DefinitionError as error:
            consequent = _CONSEQUENT if self.problems.found else ()
            for problem in error.problems:
                self._tell(problem, consequent)
        return None

    def _tell(self, problem: Problem, consequent: tuple[str, ...]) -> None:
        """Tell a problem of the definition where its value stands; what stands nowhere may follow from others."""
        if problem.key in (*self.draft.told, "steady_arm.length", "steady_arm.angle") and "missing" in problem.text:
            return  # told with the supports
        if problem.key in self.draft.told:
            return
        place = self.draft.place(problem.key)
        if problem.key in self.keys and problem.text.startswith(_UNKNOWN):
            text = problem.text.replace(_UNKNOWN, f"there is no key '{problem.key}'", 1)
            self.problems.add(self.keys[problem.key], text)
            return
        if place is not None and place.sheet:
            is_its_own = problem.key in self.draft.places
            self.problems.add(place, problem.text if is_its_own else f"'{problem.key}' {problem.text}")
            return
        first = re.sub(r"^section\[\d+\]\.", "", problem.key).partition(".")[0].partition("[")[0]
        if first not in consequent:
            where = "" if self.design is None else f" (it may be of {self.design.path})"
            sheet = "wires" if first in WIRE_COLUMNS else "line"
            self.problems.add(Place(sheet), f"'{problem.key}' {problem.text}{where}")

    def _type(self) -> str:
        """Return the type of the line by its wires, or the design's."""
        wires = self.layout.sheets.get("wires")
        listed = wires.texts("component") if wires is not None else ()
        if "stitch_wire" in listed:
            return "stitched"
        if "auxiliary_wire" in listed:
            return "compound"
        return "simple" if self.design is None else self.design.definition.type

    def _put_keys(self, sheet: SheetTable) -> None:
        """Put the sheet line: a key and its value in every row."""
        seen: dict[str, int] = {}
        for k, (key, value) in enumerate(zip(sheet.texts("key"), sheet.texts("value"), strict=True)):
            if not key or not value:
                continue  # told
            place = sheet.place(k, "key")
            if key.partition(".")[0].partition("[")[0] in (*SECTION_TABLES, "section", "name"):
                what = "its name is that of its file" if key == "name" else "the sheets supports and droppers give this"
                self.problems.add(place, f"'{key}' cannot stand here: {what}")
            elif (first := seen.setdefault(key, k)) != k:
                self.problems.add(place, f"'{key}' stands in row {sheet.rows[first]} already")
            elif key in _TABLES:
                self.problems.add(place, f"'{key}' is a table: name a key in it, as damping.alpha is in damping")
            elif key.count(".") > 1 and key.partition(".")[0] not in _NESTED:
                self.problems.add(
                    place, f"there is no key '{key}': a table in a table is in {', '.join(_NESTED)} alone"
                )
            else:
                self._put_key(sheet, k, key, value)

    def _put_key(self, sheet: SheetTable, k: int, key: str, text: str) -> None:
        unit, source = sheet.texts("unit")[k], sheet.texts("source")[k]
        self.keys[key] = sheet.place(k, "key")
        try:
            self.draft.put(key, _entry(text, unit, self._source(sheet, k, source)), sheet.place(k, "value"))
        except KeyFormError as error:
            self.problems.add(sheet.place(k, "key"), str(error))
        except ValueError as error:
            self.problems.add(sheet.place(k, "value"), str(error))
            self.draft.told.add(key)

    def _put_wires(self, sheet: SheetTable) -> None:
        seen: dict[str, int] = {}
        for k, component in enumerate(sheet.texts("component")):
            if not component:
                continue  # told
            if (first := seen.setdefault(component, k)) != k:
                text = f"'{component}' stands in row {sheet.rows[first]} already"
                self.problems.add(sheet.place(k, "component"), text)
                continue
            self._put_component(sheet, k, component)

    def _put_component(self, sheet: SheetTable, k: int, component: str) -> None:
        source = self._source(sheet, k, sheet.texts("source")[k])
        self.draft.places[component] = sheet.place(k, "component")
        for name, unit in _UNITS.items():
            value, key = float(sheet.numbers(name)[k]), f"{component}.{name}"
            if name not in WIRE_COLUMNS[component]:
                if not np.isnan(value):
                    self.problems.add(sheet.place(k, name), f"a {component} has no {name}: empty the cell")
                continue
            if sheet.told(name)[k]:
                self.draft.told.add(key)
            elif not np.isnan(value):
                self._check_once(key, sheet, k, name)
                self.draft.put(key, [float(f"{value:.15g}"), unit, source], sheet.place(k, name))
            elif sheet.has(name) and key not in self.draft.places:
                self.draft.places[key] = sheet.place(k, name)
        area, stiffness = (sheet.numbers(name)[k] for name in ("area", "stiffness"))
        if "stiffness" in WIRE_COLUMNS[component] and area == area and stiffness != stiffness:
            self.draft.data[component].pop("stiffness", None)  # of the design, in whose place the area is

    def _check_once(self, key: str, sheet: SheetTable, k: int, column: str) -> None:
        place = self.draft.places.get(key)
        if place is not None and place.sheet == "line":
            self.problems.add(place, f"'{key}' is what row {sheet.rows[k]} of the sheet {sheet.name} gives: remove one")

    def _check_components(self) -> None:
        if "wires" not in self.layout.sheets and self.design is None:
            if not self.problems.has("wires"):
                text = "the sheet is missing: add it, or name a line that has its values with --design"
                self.problems.add(Place("wires"), text)
            return
        for component in _NEEDED:
            given = self.draft.data.get(component, {})
            if not given.keys() & set(_UNITS) and component not in self.draft.places:
                text = f"there is no row '{component}': add it, or name a line that has one with --design"
                self.problems.add(Place("wires"), text)

    def _put_supports(self, supports: SheetTable) -> None:
        droppers = self.layout.sheets.get("droppers", SheetTable("droppers", 0, (), {}))
        told = self.problems if "droppers" in self.layout.sheets else ProblemsOfOthers(self.problems, "droppers")
        sections = read_sections(supports, droppers, told)
        definition = None if self.design is None else self.design.definition
        self._check_arms(supports)
        kept = {key: place for key, place in self.draft.places.items() if place.sheet == "line"}
        put_sections(self.draft, sections, (supports, droppers), self.layout.name, definition, self.problems)
        for key, place in kept.items():
            if self.draft.places[key] != place:
                self.problems.add(place, f"'{key}' is what the sheet supports gives: remove this row")
        if self.design is not None and not supports.has("stagger"):
            for table in self.draft.data.get("section", [self.draft.data]):
                table["stagger"] = self.design.stagger() or {}

    def _check_arms(self, supports: SheetTable) -> None:
        """Check that there are arms where the sheet says something of them, or wires stand beside the track."""
        if self.draft.has("steady_arm") or "steady_arm" in self.draft.places:
            for name in ("length", "angle"):
                column = f"arm_{name}"
                is_empty = np.isnan(supports.numbers(column)).all() and not supports.told(column).any()
                if not self.draft.has(f"steady_arm.{name}") and is_empty:
                    what = "is empty" if supports.has(column) else "is missing"
                    text = f"the column '{column}' {what}, and nothing else gives the {name} of the steady arms"
                    self.problems.add(supports.heading(column), text)
            return
        if "wires" not in self.layout.sheets and self.design is None:
            return  # told
        text = "there is no row 'steady_arm': add it, or name a line that has one with --design"
        columns = [name for name in ("arm_length", "arm_angle", "arm_side") if supports.has(name)]
        if columns:
            self.problems.add(Place("wires"), f"{text}, as the sheet supports has '{columns[0]}'")
        elif np.nan_to_num(supports.numbers("stagger")).any():
            self.problems.add(Place("wires"), f"{text}, as nothing else holds the wire at its stagger")

    def _put_track(self) -> None:
        own, supports = self.layout.sheets.get("track"), self.layout.sheets.get("supports")
        beside = [name for name in _TRACK if supports is not None and supports.has(name)]
        if own is not None:
            for name in beside:
                assert supports is not None
                self.problems.add(
                    supports.heading(name), "the sheet 'track' gives the track: remove it, or this column"
                )
            self._put_knots(own, list(range(len(own))))
        elif supports is not None and beside:
            x = supports.numbers("position")
            order = [k for k in np.argsort(x, kind="stable") if not np.isnan(x[k])]
            self._put_knots(supports, _without_repeats(supports, order, beside, self.problems))

    def _put_knots(self, sheet: SheetTable, rows: list[int]) -> None:
        """Put the track at its knots, in the order of their places."""
        named = [name for name in _TRACK if sheet.has(name)]
        if "curvature" in named and "radius" in named:
            self.problems.add(sheet.heading("radius"), "says what curvature says: give one of them")
        if not named:
            self.problems.add(sheet.heading(), "has none of the columns curvature, radius, cant, vertical_curvature")
            return
        for key in [k for k in self.draft.places if k.startswith("track.") and k != "track.base"]:
            self.problems.add(self.draft.places[key], f"the sheet {sheet.name} gives the track: remove this row")
        table = self.draft.data.get("track", {})
        for name in ("positions", *_TRACK):
            table.pop(name, None)  # of the design
        source = f"{self.layout.name}, {spanned(sheet, rows)}" if rows else ""
        x = sheet.numbers("position")[rows]
        for k in np.flatnonzero(np.diff(x) < 0.0) + 1:
            text = f"{x[k]:g} m comes after {x[k - 1]:g} m: positions rise along the track"
            self.problems.add(sheet.place(rows[k], "position"), text)
            self.draft.told.add("track.positions")
        for name, unit in (("position", "m"), *((name, _TRACK[name]) for name in named)):
            values = sheet.numbers(name)[rows]
            for k in np.flatnonzero(np.isnan(values) & ~sheet.told(name)[rows]):
                self.problems.add(sheet.place(rows[k], name), "is empty: every row needs a value, 0 for none")
            key = "track.positions" if name == "position" else f"track.{name}"
            if np.isnan(values).any():
                self.draft.told |= {key, "track"}
                self.draft.places[key] = sheet.heading(name)
                continue
            self.draft.put(key, [[float(f"{v:.15g}") for v in values], unit, source], sheet.heading(name))

    def _source(self, sheet: SheetTable, k: int, given: str) -> str:
        """Return the source of a value: its row, and what the row says of where it is from."""
        row = f"{self.layout.name}, {spanned(sheet, [k])}"
        return f"{given} ({row})" if given else row


def _without_repeats(sheet: SheetTable, order: list[int], names: list[str], problems: SheetProblems) -> list[int]:
    """Return the rows at different places; supports of two sections at one place stand on the same track."""
    kept: list[int] = []
    x = sheet.numbers("position")
    for k in order:
        if not kept or x[k] - x[kept[-1]] > 1e-6:
            kept.append(k)
            continue
        for name in names:
            a, b = sheet.numbers(name)[kept[-1]], sheet.numbers(name)[k]
            if abs(a - b) > 1e-12 + 1e-9 * abs(a):
                text = f"{b:g}, and row {sheet.rows[kept[-1]]} has {a:g} at the same place of the track"
                problems.add(sheet.place(k, name), text)
    return kept


def _entry(text: str, unit: str, source: str) -> Any:
    """Return a value of the sheet line as a definition has it: a number with its unit, a whole one, a text, a list."""
    words = text.split()
    numbers = list(_numbers(words))
    if unit:
        if len(numbers) != len(words):
            raise ValueError(f"'{text}' is no number, and has the unit '{unit}'")
        return [numbers if len(numbers) > 1 else numbers[0], unit, source]
    if text in ("true", "false"):
        return text == "true"
    if len(words) == 1 and numbers:
        return int(numbers[0]) if numbers[0].is_integer() else [numbers[0], "1", source]
    return text


def _numbers(words: list[str]) -> Iterator[float]:
    for word in words:
        match = WITH_UNIT.fullmatch(word.replace(",", ".", 1).replace("\u2212", "-"))
        if match is not None and not match[2] and np.isfinite(value := float(match[1])):
            yield value
