"""Layouts of lines: what is exported is imported as the same line, and what a layout cannot say is told."""

from __future__ import annotations

import copy
import csv

import numpy as np
import pytest

from models.catenary.definition.line_reading import read
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.commands.physics_main import main
from models.definition_files.toml_reader import Table
from models.layout.definition_draft import toml_text
from models.layout.layout_export import csv_text, export_line
from models.layout.layout_import import import_layout
from models.layout.sheet_problems import LayoutError
from models.layout.xlsx_sheets import workbook_bytes
from models.library.catalogue import line_names, line_path
from tests.effort import some

SOURCE = "test"


def data_of(name: str) -> dict:
    return copy.deepcopy(Table.load(line_path(name)).data)


def short(name: str, spans: int = 6, **changes) -> dict:
    """Return a line of the library with few spans."""
    data = data_of(name)
    own = data["spans"]
    own.pop("end", None)
    if "lengths" in own:
        own["lengths"][0] = own["lengths"][0][:spans]
    else:
        own["count"] = spans
    return data | changes


def section(position: float, lengths: list[float], **ends) -> dict:
    return {
        "spans": {"start": [position, "m", SOURCE], "lengths": [lengths, "m", SOURCE],
                  "droppers": {"first": [4.5, "m", SOURCE], "count": 5}},
        "stagger": {"amplitude": [0.2, "m", SOURCE]},
        "ends": {name: {"spans": n, "rise": [rise, "m", SOURCE]} for name, (n, rise) in ends.items()},
    }  # fmt: skip


def sections() -> dict:
    data = {k: v for k, v in data_of("LN2").items() if k not in ("spans", "stagger", "ends")}
    first = section(-50.0, [50.0, 49.5, 45.0, 49.5, 50.0, 48.25], start=(2, 0.4), end=(1, 0.2))
    second = section(195.25, [48.0, 48.25, 49.5, 50.0, 49.5], start=(1, 0.2), end=(1, 0.3))
    second["supports"] = {"structure": ["A", "B", "", "D", "E", "F"]}
    return data | {"section": [first, second]}


def route() -> dict:
    """Return a line in a curve whose supports differ in all that they can."""
    data = short("LN2", 5, ends={"spans": [1, "1", SOURCE], "rise": [0.2, "m", SOURCE]})
    data["stagger"] = {"anchor": [[0.3, -0.4], "m", SOURCE]}
    data["supports"] = {
        "contact_wire_height": [[5.1, 5.09, 5.08, 5.08], "m", SOURCE],
        "encumbrance": [[1.4, 1.35, 1.4, 1.45], "m", SOURCE],
        "stagger": [[0.2, 0.15, 0.2, 0.2], "m", SOURCE],
        "messenger_stagger": [[0.1, 0.1, 0.12, 0.1], "m", SOURCE],
        "arm_length": [[1.2, 1.1, 1.2, 1.3], "m", SOURCE],
        "arm_angle": [[-10, -9, -10, -8], "deg", SOURCE],
        "arm_side": [[1, 1, 1, 1], "1", SOURCE],
        "structure": ["12-1", "12-2", "12-3", "12-4"],
    }
    data["track"] = {
        "positions": [[0, 30, 30, 200], "m", SOURCE],
        "radius": [[0, 0, -1500, -800], "m", SOURCE],
        "cant": [[0, -20, -20, -50], "mm", SOURCE],
        "base": [1.5, "m", SOURCE],
    }
    data["damping"]["dropper"] = {"alpha": [1e-4, "s", SOURCE], "beta": [0, "1/s", SOURCE]}
    data["fault"] = [{"kind": "dropper_slipped", "span": 2, "dropper": 3, "value": [0, "mm", SOURCE], "active": 0}]
    return data


LINES = {
    "stitched": lambda: short("LN1"),
    "compound": lambda: short("Shinkansen", 5),
    "a ring": lambda: short("LN2_ring", 4),
    "two sections with an overlap": sections,
    "a curve": route,
    "without arms": lambda: short("EN50318_2002", 4),
}


def written(folder, data: dict, name: str = "line"):
    path = folder / f"{name}.toml"
    path.write_text(toml_text(data, "a test's"), encoding="utf-8")
    return path


def returned(folder, exported, *, as_workbook=False):
    """Return what importing an exported line gives."""
    if as_workbook:
        path = folder / "layout.xlsx"
        path.write_bytes(workbook_bytes(exported.sheets))
    else:
        path = folder / "layout"
        path.mkdir(exist_ok=True)
        for name, rows in exported.sheets.items():
            (path / f"{name}.csv").write_text(csv_text(rows), encoding="utf-8")
    return import_layout(path, "back")


def difference(exported, line) -> float:
    """Return by how much two lines at rest differ in shape [m]."""
    state = kept_form(line.definition, build_mesh(line.definition))
    return float(np.abs(state.positions - exported.state.positions).max())


@pytest.mark.parametrize("kind", LINES)
def test_a_line_comes_back_from_its_layout(tmp_path, kind):
    exported = export_line(written(tmp_path, LINES[kind]()))
    line = returned(tmp_path, exported)
    assert line.notes == ()
    assert difference(exported, line) < 1e-6
    design, back = exported.state.shape.definition, line.definition
    for ours, theirs in zip(design.sections, back.sections, strict=True):
        assert theirs.ends == ours.ends
        assert [s.structure for s in theirs.supports] == [s.structure for s in ours.supports]
        assert [s.has_steady_arm for s in theirs.supports] == [s.has_steady_arm for s in ours.supports]
        assert [s.arm_side for s in theirs.supports] == [s.arm_side for s in ours.supports]
    assert (back.type, back.clamps, back.damping, back.mesh) == (
        design.type,
        design.clamps,
        design.damping,
        design.mesh,
    )
    assert (back.track, back.fault) == (design.track, design.fault)


@pytest.mark.parametrize("name", some(line_names(), "EN50318_2002"))
def test_every_line_of_the_library_comes_back(tmp_path, name):
    exported = export_line(line_path(name))
    assert difference(exported, returned(tmp_path, exported)) < 1e-7


def test_a_workbook_is_the_same_layout(tmp_path):
    pytest.importorskip("openpyxl")
    exported = export_line(written(tmp_path, route()))
    tables, book = returned(tmp_path, exported), returned(tmp_path, exported, as_workbook=True)
    assert book.definition.sections == tables.definition.sections
    assert book.text.replace("layout.xlsx", "layout") == tables.text


@pytest.mark.parametrize("as_workbook", [False, True])
def test_text_that_looks_like_a_formula_stays_text(tmp_path, as_workbook):
    if as_workbook:
        pytest.importorskip("openpyxl")
    names = ["'=1+1", "-12"]
    data = short("EN50318_2002", 3, title="=SUM(A1)", supports={"structure": ["a", *names[:2], "b"]})
    exported = export_line(written(tmp_path, data))
    assert as_workbook or not [line for line in csv_text(exported.sheets["line"]).splitlines() if ",=" in line]
    line = returned(tmp_path, exported, as_workbook=as_workbook)
    assert [s.structure for s in line.definition.sections[0].supports] == ["a", *names[:2], "b"]
    assert line.definition.title == "=SUM(A1)"


def test_values_name_file_sheet_and_row_as_their_source(tmp_path):
    line = returned(tmp_path, export_line(written(tmp_path, route())))
    found = line.definition.provenance
    assert found["contact_wire.tension"].source == "Table 5.2 (layout, wires, row 2)"
    assert found["supports.encumbrance"].source == "layout, supports, rows 2-7"
    assert found["spans.listed[2].lengths"].source == "layout, droppers, rows 9-15"
    assert found["track.radius"].source == "layout, track, rows 2-5"
    assert found["contact_wire.area"].value == 150e-6
    assert not found["damping.alpha"].is_choice


def test_lengths_are_those_of_form_finding_in_mm(tmp_path):
    """The sheet that a workshop cuts from, against the table that statics prints."""
    path = written(tmp_path, short("LN2", 5, ends={"spans": [1, "1", SOURCE], "rise": [0.2, "m", SOURCE]}))
    assert main(["export", str(path), "--out", str(tmp_path / "out")]) == 0
    with (tmp_path / "out" / "droppers.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    line = read(Table.load(path))
    state = kept_form(line, build_mesh(line))
    assert [float(row["length [mm]"]) for row in rows] == pytest.approx(1e3 * state.unstrained_length, abs=1e-4)
    assert [(row["span"], row["dropper"]) for row in rows][6:8] == [("1", "7"), ("2", "1")]


def test_what_a_layout_cannot_say_is_told(tmp_path):
    data = short("EN50318_2002", 3)
    data["measured"] = {"positions": [[0, 90, 180], "m", SOURCE], "heights": [[5.08, 5.07, 5.08], "m", SOURCE]}
    exported = export_line(written(tmp_path, data))
    assert [note.split(": ")[1] for note in exported.notes] == ["[measured] is not in the layout"]
    assert difference(exported, returned(tmp_path, exported)) < 1e-6


def test_a_surface_lies_beside_the_definition(tmp_path):
    (tmp_path / "wear.csv").write_text("position [m],height [mm]\n0,0\n90,-0.1\n180,0\n")
    exported = export_line(written(tmp_path, short("EN50318_2002", 3, running_surface={"profile": "wear.csv"})))
    assert [note.split(": ")[1] for note in exported.notes] == ["wear.csv is named in the layout and no part of it"]
    folder = tmp_path / "layout"
    folder.mkdir()
    for name, rows in exported.sheets.items():
        (folder / f"{name}.csv").write_text(csv_text(rows))
    assert import_layout(folder, "back", out=tmp_path / "back.toml").definition.running_surface.profile == "wear.csv"
    with pytest.raises(LayoutError, match=r"line, row \d+, column B \(value\): wear.csv"):
        import_layout(folder, "back", out=folder / "back.toml")


def test_a_design_gives_what_the_layout_does_not(tmp_path):
    """Supports and droppers of a survey, all else of a line that is there already."""
    design = written(tmp_path, short("LN2", 5, ends={"spans": [1, "1", SOURCE], "rise": [0.2, "m", SOURCE]}), "design")
    exported = export_line(design)
    layout = tmp_path / "layout"
    layout.mkdir()
    for name in ("supports", "droppers"):
        (layout / f"{name}.csv").write_text(csv_text(exported.sheets[name]))
    line = import_layout(layout, "survey", design)
    assert difference(exported, line) < 1e-6
    assert line.definition.provenance["contact_wire.tension"].source == "Table 5.2"
    (layout / "supports.csv").write_text(
        "position\n" + "\n".join(str(s.x) for s in line.definition.sections[0].supports)
    )
    (layout / "droppers.csv").write_text(
        "span,position\n" + "".join(f"{n},{x}\n" for n in range(1, 6) for x in (4.5, 14, 22.5, 31, 40.5))
    )
    bare = import_layout(layout, "bare", design).definition
    assert [s.stagger for s in bare.sections[0].supports] == [0.0, 0.2, -0.2, 0.2, -0.2, 0.0]
    assert bare.sections[0].ends == exported.state.shape.definition.sections[0].ends
    assert bare.profile == exported.state.shape.definition.profile


def test_curvature_and_cant_at_the_supports(tmp_path):
    exported = export_line(written(tmp_path, short("LN2", 5, ends={"spans": 1, "rise": [0.2, "m", SOURCE]})))
    rows = exported.sheets["supports"]
    rows[0] += ["Radius [km]", "cant [mm]"]
    for row, radius, cant in zip(rows[1:], (0, 0, 2, 1, 1, 1), (0, 0, 20, 40, 40, 40), strict=True):
        row += [radius, cant]
    track = returned(tmp_path, exported).definition.track
    assert track.positions == tuple(row[1] for row in rows[1:])
    assert track.curvatures == pytest.approx((0.0, 0.0, 5e-4, 1e-3, 1e-3, 1e-3))
    assert track.cant == pytest.approx((0.0, 0.0, 0.02, 0.04, 0.04, 0.04))


def test_the_command_writes_what_it_says(tmp_path, capsys):
    path = written(tmp_path, short("EN50318_2002", 3))
    out, back = tmp_path / "out", tmp_path / "back.toml"
    assert main(["export", str(path), "--out", str(out)]) == 0
    assert "droppers.csv" in capsys.readouterr().out
    assert main(["import", str(out), "--out", str(back)]) == 0
    said = capsys.readouterr().out
    assert said.startswith("back: 3 spans from 0 to 180 m, 27 droppers, all with their lengths\n")
    assert read(Table.load(back)).sections[0].spans[0].dropper_lengths
    (out / "track.csv").write_text("position,cant\n")
    assert main(["export", str(path), "--out", str(out)]) == 1
    assert "has track.csv of another layout" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("import", "nowhere", "--out", "a.toml"), "nowhere: cannot be read (there is no such file or folder"),
        (("import", "layout", "--out", "a.txt"), "--out a.txt: a definition is written, so name a file that ends"),
        (("import", "layout", "--out", "a-b.toml"), "--out a-b.toml: 'a-b' cannot name a definition"),
        (("import", "layout", "--out", "LN2.toml", "--design", "LN2.toml"), "that is the design, which is left as it"),
        (
            ("import", "layout", "--out", "a.toml"),
            "layout: is no layout: a folder of CSV files with the sheets supports",
        ),
        (("import", "layout", "--out", "a.toml", "--design", "LN22"), "no line 'LN22' in the library"),
        (
            ("import", "LN2.toml", "--out", "a.toml"),
            "LN2.toml: is neither a folder of CSV files nor a workbook (.xlsx)",
        ),
        (("export", "LN22", "--out", "out"), "no line 'LN22' in the library"),
        (("export", "LN2", "--out", "LN2.toml"), "--out LN2.toml: LN2.toml is a file; name a folder"),
    ],
)
def test_what_is_said_of_a_wrong_command(tmp_path, monkeypatch, capsys, arguments, sentence):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "layout").mkdir()
    (tmp_path / "LN2.toml").write_bytes(line_path("LN2").read_bytes())
    assert main(list(arguments)) == 1
    assert sentence in capsys.readouterr().err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["LN2.toml", "layout"]
