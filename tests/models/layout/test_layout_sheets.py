"""The sheets that a layout may have: as declared, as documented, as a definition has them, and where they are found."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path
from typing import get_args, get_type_hints

import pytest

from models.catenary.definition.line_definition import CatenaryDefinition
from models.definition_files.si_units import SI
from models.layout.layout_import import WIRE_COLUMNS
from models.layout.layout_sheets import COMPONENTS, SHEETS, read_layout
from models.layout.sheet_problems import LayoutError, SheetProblems

PAGE = (Path(__file__).parents[3] / "docs" / "layouts.md").read_text(encoding="utf-8")


def documented(name: str) -> str:
    """Return the table of a sheet as the page has it."""
    rows = ["| column | SI unit | range | meaning |", "|---|---|---|---|"]
    for column in SHEETS[name].columns:
        head = f"**`{column.name}`**" if column.required else f"`{column.name}`"
        text = column.description
        if column.choices and name == "wires":
            text += ": " + ", ".join(f"`{choice}`" for choice in column.choices)
        rows.append(f"| {head} | {f'`{column.unit}`' if column.unit else 'text'} | {reach(column)} | {text} |")
    return "\n".join(rows)


def reach(column) -> str:
    low, high = column.minimum, column.maximum
    if column.positive:
        return "above 0"
    parts = [f"from {low:.4g}" if math.isfinite(low) else "", f"to {high:.4g}" if math.isfinite(high) else ""]
    return " ".join(filter(None, ["whole" if column.whole else "", *parts]))


@pytest.mark.parametrize("name", SHEETS)
def test_the_page_has_the_sheets_as_they_are_declared(name):
    assert documented(name) in PAGE, documented(name)


def test_units_and_names_are_known_ones():
    for sheet in SHEETS.values():
        names = [column.name for column in sheet.columns]
        assert len(set(names)) == len(names)
        assert all(re.fullmatch("[a-z_]+", name) for name in names)
        assert all(column.unit in SI and SI[column.unit][1] == 1.0 for column in sheet.columns if column.unit)


def test_components_are_those_of_a_line():
    """Every column of a component is a field of its dataclass, and the sheet has it."""
    fields = get_type_hints(CatenaryDefinition)
    columns = {column.name for column in SHEETS["wires"].columns}
    assert set(COMPONENTS) == set(WIRE_COLUMNS)
    for component, own in WIRE_COLUMNS.items():
        kind = next(k for k in (fields[component], *get_args(fields[component])) if dataclasses.is_dataclass(k))
        assert set(own) <= columns & {field.name for field in dataclasses.fields(kind)}


def test_files_are_found_whatever_their_letters_case(tmp_path):
    (tmp_path / "SUPPORTS.CSV").write_text("position\n0\n")
    (tmp_path / "Droppers.csv").write_text("span,position\n1,5\n")
    (tmp_path / "notes.csv").write_text("anything \x00")
    (tmp_path / "readme.txt").write_text("no sheet")
    layout = read_layout(tmp_path, SheetProblems("here"))
    assert set(layout.sheets) == {"supports", "droppers"}
    assert layout.notes == (f"{tmp_path}: the sheet 'notes' is none of a layout's and was not read",)
    (tmp_path / "supports.csv").write_text("position\n0\n")
    problems = SheetProblems("here")
    read_layout(tmp_path, problems)
    assert [p.text[:22] for p in problems.found] == ["stands in two files, s"]


def test_a_folder_with_a_workbook_in_it_is_told_to_name_that(tmp_path):
    (tmp_path / "survey.xlsx").write_bytes(b"")
    (tmp_path / "poles.csv").write_text("a")
    with pytest.raises(LayoutError, match=r"is no layout: .*; it has 'poles'; if survey\.xlsx is one, name that file"):
        read_layout(tmp_path, SheetProblems("here"))


def test_a_link_to_a_layout_is_one_and_a_broken_link_is_told(tmp_path):
    folder = tmp_path / "layout"
    folder.mkdir()
    (folder / "supports.csv").symlink_to(tmp_path / "elsewhere.csv")
    (folder / "droppers.csv").write_text("span,position\n1,5\n")
    (tmp_path / "link").symlink_to(folder)
    problems = SheetProblems("link")
    read_layout(tmp_path / "link", problems)
    assert [str(p) for p in problems.found] == [
        "link: supports: cannot be read (there is no such file or folder: check the name)"
    ]
    (tmp_path / "circle").symlink_to(tmp_path / "circle")
    with pytest.raises(LayoutError, match="cannot be read"):
        read_layout(tmp_path / "circle", SheetProblems("circle"))


def test_hidden_sheets_are_left_out_and_that_is_said(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.title = "supports"
    book.active.append(["position"])
    book.active.append([0.0])
    for name in ("droppers", "Supports ", "old"):
        book.create_sheet(name).append(["position", "#N/A"])
    book["Supports "].sheet_state, book["old"].sheet_state = "hidden", "veryHidden"
    book.save(tmp_path / "survey.xlsx")
    problems = SheetProblems("survey.xlsx")
    layout = read_layout(tmp_path / "survey.xlsx", problems)
    assert layout.notes == ("survey.xlsx: 'Supports ' and 'old' are hidden and were not read",)
    assert layout.sheets["supports"].numbers("position").tolist() == [0.0]
    book["droppers"].sheet_state = "hidden"
    book.save(tmp_path / "survey.xlsx")
    problems = SheetProblems("survey.xlsx")
    read_layout(tmp_path / "survey.xlsx", problems)
    assert [str(p) for p in problems.found] == ["survey.xlsx: droppers: the sheet is hidden: show it"]
