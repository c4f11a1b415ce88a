"""A corpus of wrong layouts, each answered whole: every problem in one sentence with its sheet, row and column."""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable
from typing import Any

import pytest

from models.commands.physics_main import main
from models.layout.layout_import import import_layout
from models.layout.sheet_problems import LayoutError

SUPPORTS = """\
structure;position [m];span_length;height;encumbrance;stagger;arm_length;arm_angle [deg]
A1;0;50;5.18;1.4;0;;
M1;50;50;5.08;1.4;0.2;1.2;-10
M2;100;50;5.08;1.4;-0.2;1.2;-10
M3;150;50;5.08;1.4;0.2;1.2;-10
M4;200;50;5.08;1.4;-0.2;1.2;-10
A2;250;;5.18;1.4;0;;
"""
DROPPERS = "span;dropper;position;length [mm]\n" + "".join(
    f"{span};{k};{x};{length}\n"
    for span in range(1, 6)
    for k, (x, length) in enumerate([(9, 1300), (25, 1250), (41, 1300)], 1)
)
WIRES = """\
component;area [mm2];mass;youngs_modulus [GPa];tension [kN]
contact_wire;150;1.334;120;20
messenger_wire;65.5;0.605;84.7;14
dropper;12;0.11;84.7;
steady_arm;120;1.07;84.7;
"""
LINE = """\
key;value;unit;source
damping.alpha;1e-4;s;a norm
damping.beta;0,0125;1/s;a norm
clamps.dropper_lower;0.165;kg;choice: as LN2
"""
WIRES = WIRES.replace("contact_wire", "Contact wire")
BASE = {"supports": SUPPORTS, "droppers": DROPPERS, "wires": WIRES, "line": LINE}


def change(sheet: str, *pairs: str) -> Callable[[dict[str, Any]], None]:
    """Return an edit of a sheet: every odd text replaced by the one that follows it, the first time that it stands."""

    def edit(sheets: dict[str, Any]) -> None:
        for old, new in zip(pairs[::2], pairs[1::2], strict=True):
            assert old in sheets[sheet], old
            sheets[sheet] = sheets[sheet].replace(old, new, 1)

    return edit


def instead(sheet: str, text: str | bytes | None) -> Callable[[dict[str, Any]], None]:
    """Return an edit that gives a sheet another text, or takes it away."""

    def edit(sheets: dict[str, Any]) -> None:
        if text is None:
            del sheets[sheet]
        else:
            sheets[sheet] = text

    return edit


def every(*edits: Callable[[dict[str, Any]], None]) -> Callable[[dict[str, Any]], None]:
    def edit(sheets: dict[str, Any]) -> None:
        for one in edits:
            one(sheets)

    return edit


def falling(sheets: dict[str, Any]) -> None:
    head, *rows = sheets["supports"].splitlines()
    sheets["supports"] = "\n".join([head.replace("span_length", "#span"), *rows[::-1]])


#: What is wrong -> the edit of the layout, and all problems: place and the beginning, or a part, of the sentence.
CASES: dict[str, tuple[Callable[[dict[str, Any]], None], list[tuple[str, str]]]] = {
    # sheets and files
    "no droppers": (instead("droppers", None), [("droppers", "the sheet is missing")]),
    "a sheet by another name": (
        lambda s: s.update(suports=s.pop("supports")),
        [("supports", "the sheet is missing; did you mean 'suports'?")],
    ),
    "no wires": (instead("wires", None), [("wires", "the sheet is missing: add it, or name a line")]),
    "an empty file": (instead("supports", ""), [("supports", "is empty: the first row has the names")]),
    "names alone": (instead("droppers", DROPPERS[: DROPPERS.index("\n")]), [("droppers, row 1", "has no rows below")]),
    "old code page": (
        instead("supports", SUPPORTS.replace("M1", "M\u00fcnster").encode("cp1252")),
        [("supports, row 3", "is not UTF-8 text (byte 111): save the file as 'CSV UTF-8'")],
    ),
    "a workbook named csv": (instead("wires", b"PK\x03\x04..."), [("wires", "is a workbook or an archive, not CSV")]),
    "an open quotation mark": (change("supports", "M2", '"M2'), [("supports, row 4", "cannot be split into cells")]),
    # names of columns
    "a title above": (
        lambda s: s.update(supports="Line 12;;;\n" + s["supports"]),
        [("supports, row 1", "and row 2 has: delete the rows above it, or begin them with #")],
    ),
    "no names": (
        instead("droppers", DROPPERS[DROPPERS.index("\n") + 1 :]),
        [("droppers, row 1", "has none of the names of columns (section, span, dropper")],
    ),
    "a mistyped name": (
        change("supports", "encumbrance", "encumberance"),
        [("supports, row 1, column E", "there is no column 'encumberance'; did you mean 'encumbrance'?"),
         ("supports, row 1", "the column 'encumbrance' is missing")],
    ),
    "a name twice": (
        change("supports", "span_length", "Height [mm]"),
        [("supports, row 1, column D", "'height' stands in column C already"),
         *[(f"supports, row {r}, column C (height)", "0.05 is outside 2 ... 15 m") for r in range(2, 7)],
         ("supports, row 7, column C (height)", "is empty: every support needs a value")],
    ),
    "a foreign column": (
        change("droppers", "dropper", "colour"),
        [("droppers, row 1, column B", "there is no column 'colour'; known here: section, span")],
    ),
    "positions without a name": (
        change("supports", "position [m]", ""),
        [("supports, row 1", "the column 'position' is missing"),
         ("supports, row 2, column B", "stands in a column without a name")],
    ),
    # units
    "an unknown unit": (
        change("supports", "[m]", "[miles]"),
        [("supports, row 1, column B (position)", "unknown unit 'miles' (known for 'm': m, mm, cm, km)")],
    ),
    "another kind of unit": (
        change("wires", "[kN]", "[kg]"),
        [("wires, row 1, column E (tension)", "unit 'kg' where a unit of 'N' is needed")],
    ),
    "heights in mm, not said": (
        change("supports", "5.18", "5180", "5.08", "5080"),
        [("supports, row 2, column D (height)", "5180 is outside 2 ... 15 m: check its size and its unit"),
         ("supports, row 3, column D (height)", "5080 is outside 2 ... 15 m: check its size and its unit")],
    ),
    "lengths in m, said mm": (
        change("droppers", "1;1;9;1300", "1;1;9;1.3", "2;3;41;1300", "2;3;41;0,0"),
        [("droppers, row 2, column D (length)", "0.0013 is outside 0.02 ... 10 m"),
         ("droppers, row 7, column D (length)", "0 is outside 0.02 ... 10 m")],
    ),
    "kilometres, not said": (
        change("supports", ";50;50;", ";0.05;50;", ";100;", ";0.1;"),
        [("supports, row 3, column B (position)", "0.05 m is the place of the row before, or less than 1 m"),
         ("supports, row 4, column B (position)", "0.1 m is the place of the row before, or less than 1 m")],
    ),
    # numbers
    "a unit in the cell": (
        change("supports", "1.2;-10", "1.2 m;-10", "1.2;-10", "1.2;-10°"),
        [("supports, row 3, column G (arm_length)", "'1.2 m' is not a number; write the number alone, and the unit"),
         ("supports, row 4, column H (arm_angle)", "'-10°' is not a number")],
    ),
    "words for numbers": (
        change("supports", "-0.2", "left", "-0.2", "?"),
        [("supports, row 4, column F (stagger)", "'left' is not a number"),
         ("supports, row 6, column F (stagger)", "'?' is not a number")],
    ),
    "no number and infinity": (
        change("droppers", "1300", "NaN", "1250", "-inf"),
        [("droppers, row 2, column D (length)", "'NaN' is not a number; leave the cell empty"),
         ("droppers, row 3, column D (length)", "'-inf' is not a number; leave the cell empty")],
    ),
    "a number beyond all": (
        change("wires", "1.334", "1e30"), [("wires, row 2, column C (mass)", "1e+30 is not finite, or larger than")]
    ),
    "thousands or a decimal comma": (
        change("droppers", "1250", "1,250", ";9;", ";9.0;"),
        [("droppers, row 3, column D (length)", "'1,250' may have a decimal comma or one for thousands")],
    ),
    "marks for thousands": (
        change("droppers", "1300", "1 300,0"),
        [("droppers, row 2, column D (length)", "'1 300,0' is not a number; write it without marks for thousands")],
    ),
    "decimal commas between commas": (
        instead("supports", "position,height,encumbrance,stagger\n0,5,18,1,4,0\n50,5,08,1,4,0.2\n100,5.0,1.4,0\n"),
        [("supports, row 2, column E", "has 6 cells for the 4 names"),
         ("supports, row 3, column E", "has 6 cells for the 4 names of the first row: are there decimal commas"),
         ("supports, row 2, column C (encumbrance)", "18 is outside 0.05 ... 5 m"),
         ("supports, row 3, column C (encumbrance)", "8 is outside 0.05 ... 5 m"),
         ("supports, row 1", "the column 'arm_length' is missing, and nothing else gives the length"),
         ("supports, row 1", "the column 'arm_angle' is missing, and nothing else gives the angle"),
         ("droppers, row 8, column A (span)", "there is no span 3"),
         *[(f"droppers, row {r}, column A (span)", "there is no span") for r in range(9, 17)]],
    ),
    "kilometrage with a plus": (
        change("supports", ";100;", ";0+100;"),
        [("supports, row 4, column B (position)", "'0+100' is not a number; write a kilometrage as one number")],
    ),
    # places
    "falling kilometrage": (
        falling, [("supports, row 3, column B (position)", "the kilometrage falls, from 250 to 0 m: list supports")]
    ),
    "supports out of order": (
        change("supports", "M2;100", "M2;10", "M4;200", "M4;130"),
        [("supports, row 4, column B (position)", "10 m comes after 50 m: positions rise along the track"),
         ("supports, row 6, column B (position)", "130 m comes after 150 m: positions rise along the track")],
    ),
    "two supports in one place": (
        change("supports", "M2;100", "M2;50"),
        [("supports, row 4, column B (position)", "50 m is the place of the row before")],
    ),
    "a support that is missing": (
        change("supports", "M4;200", "M4;400", "A2;250", "A2;450"),
        [("supports, row 6, column B (position)", "the span from 150 to 400 m is 250 m long, and 200 m are the most")],
    ),
    "spans that do not sum": (
        change("supports", ";50;50;", ";50;51;", "150;50", "150;49,9"),
        [("supports, row 3, column C (span_length)", "a span of 51 m ends at 101 m, and the next support"),
         ("supports, row 5, column C (span_length)", "a span of 49.9 m ends at 199.9 m")],
    ),
    "a structure twice": (
        change("supports", "M3", "M1"), [("supports, row 5, column A (structure)", "'M1' is the structure of row 3")]
    ),
    "two supports alone": (
        instead("supports", "position;height;encumbrance;stagger\n0;5;1.4;0\n50;5;1.4;0\n"),
        [("supports", "has 2 supports: two anchors and at least one support between them are needed"),
         ("supports, row 1", "the column 'arm_length' is missing, and nothing else gives the length"),
         ("supports, row 1", "the column 'arm_angle' is missing, and nothing else gives the angle")],
    ),
    # cells that lack, or are too many
    "gaps": (
        change("supports", "M2;100;50;5.08;1.4", "M2;100;50;;", "150;50;5.08;1.4;0.2", "150;50;5.08;1.4;"),
        [("supports, row 4, column D (height)", "is empty: every support needs a value"),
         ("supports, row 4, column E (encumbrance)", "is empty: every support needs a value"),
         ("supports, row 5, column F (stagger)", "is empty: every support needs a value")],
    ),
    "an arm without an angle, an anchor with one": (
        change("supports", "1.2;-10", "1.2;", "1.4;0;;", "1.4;0;1.2;-9"),
        [("supports, row 2, column H (arm_angle)", "anchor has no steady arm: empty the cell, or write what"),
         ("supports, row 3, column H (arm_angle)", "is empty: every support needs a value")],
    ),
    "an anchor lower than the wire": (
        change("supports", "A1;0;50;5.18", "A1;0;50;5.00"),
        [("supports, row 2, column D (height)", "5 m: a wire rises to its anchor by 0 ... 5 m, here from 5.08 m")],
    ),
    "a kind in the wrong row": (
        change("supports", "structure", "kind", "M1", "anchor", "M2", "pole", "M3", "support", "M4", "", "A1", "",
               "A2", "seam"),
        [("supports, row 4, column A (kind)", "'pole' is none of anchor, support, unregistered, seam"),
         ("supports, row 3, column A (kind)", "'anchor' cannot be here: it lies between them"),
         ("supports, row 7, column A (kind)", "is 'seam', and the first row of the section 'anchor'")],
    ),
    "unregistered in the middle": (
        change("supports", "structure", "kind", "M1", "", "M2", "unregistered", "M3", "", "M4", "", "A1", "", "A2", ""),
        [("supports, row 4, column A (kind)", "'unregistered' is for supports beside an anchor: this one has arms")],
    ),
    "arms where there are none": (
        change("supports", "structure", "kind", "M1", "Unregistered", "M2", "", "M3", "", "M4", "", "A1", "", "A2", "",
               "1.2;-10", "1.3;-10"),
        [("supports, row 3, column G (arm_length)", "unregistered has no steady arm: empty the cell")],
    ),
    "a stagger beyond the strip": (
        change("supports", "-0.2", "-200", "-0.2", "-2"),
        [("supports, row 4, column F (stagger)", "-200 is outside -10 ... 10 m: check its size and its unit")],
    ),
    "a stagger in another unit": (
        change("supports", "-0.2", "-2"), [("supports, row 4, column F (stagger)", "-2 m is outside -1 ... 1 m")]
    ),
    # droppers
    "droppers outside": (
        change("droppers", "2;3;41", "2;3;91", "1;1;9;", "1;1;-9;"),
        [("droppers, row 2, column C (position)", "-9 m lies outside span 1 of 50 m: positions count from the span's"),
         ("droppers, row 7, column C (position)", "91 m lies outside span 2 of 50 m: positions count from the span's")],
    ),
    "droppers out of order": (
        change("droppers", "3;2;25", "3;2;5"),
        [("droppers, row 9, column C (position)", "5 m comes after 9 m: droppers of a span are in rising order")],
    ),
    "a span that is none": (
        change("droppers", "\n5;1", "\n6;1", "\n5;2", "\n1,5;2", "\n5;3", "\n0;3"),
        [("droppers, row 15, column A (span)", "1.5 is not a whole number"),
         ("droppers, row 16, column A (span)", "0 is less than 1"),
         ("droppers, row 14, column A (span)", "there is no span 6: the supports of the section make 5")],
    ),
    "a span without droppers": (
        change("droppers", "3;1;9;1300\n3;2;25;1250\n3;3;41;1300\n", ""),
        [("droppers, row 1, column A (span)", "span 3, 100 ... 150 m, has no dropper: add its rows")],
    ),
    "a dropper that is missing": (
        change("droppers", "4;2;25;1250\n", ""),
        [("droppers, row 12, column B (dropper)", "is 3, and it is dropper 2 of its span: is a row missing")],
    ),
    "a length that is missing": (
        change("droppers", "4;2;25;1250", "4;2;25;"),
        [("droppers, row 12, column D (length)", "is empty, and other droppers of span 4 have a length")],
    ),
    # wires and keys
    "a component that is none": (
        change("wires", "messenger_wire", "messanger_wire", "dropper;12", "contact_wire;12"),
        [("wires, row 3, column A (component)", "'messanger_wire' is none of contact_wire, messenger_wire"),
         ("wires, row 4, column A (component)", "'contact_wire' stands in row 2 already"),
         ("wires", "there is no row 'messenger_wire': add it"),
         ("wires", "there is no row 'dropper': add it")],
    ),
    "values that a component has not, or lacks": (
        change("wires", "84.7;\n", "84.7;5\n", "1.334", "", "0.605", "0"),
        [("wires, row 4, column E (tension)", "a dropper has no tension: empty the cell"),
         ("wires, row 2, column C (mass)", "is missing"),
         ("wires, row 3, column C (mass)", "0 kg/m must be greater than 0")],
    ),
    "a column of wires that lacks": (
        change("wires", "mass;", "#mass;"),
        [(f"wires, row {r}, column A (component)", f"'{name}.mass' is missing")
         for r, name in enumerate(("contact_wire", "messenger_wire", "dropper", "steady_arm"), 2)],
    ),
    "wires of another unit": (
        change("wires", "[mm2]", "[m2]"),
        [(f"wires, row {r}, column B (area)", "m2 is outside 1e-0") for r in (2, 3, 4, 5)],
    ),
    "keys that are none": (
        change("line", "damping.alpha", "damping.alfa", "clamps.dropper_lower", "clamps"),
        [("line, row 2, column A (key)", "there is no key 'damping.alfa' (known here: alpha, auxiliary_wire"),
         ("line, row 4, column A (key)", "'clamps' is a table: name a key in it, as damping.alpha is in damping")],
    ),
    "keys that lack": (
        every(instead("line", "key;value;unit\ndamping.alpha;0;s\ndropper.slack_law;tension;\nmesh.a.b;1;1\n"),
              change("wires", "dropper;12;0.11;84.7;\n", "")),
        [("line, row 4, column A (key)", "there is no key 'mesh.a.b': a table in a table is in damping"),
         ("line", "'damping.beta' is missing"),
         ("wires", "there is no row 'dropper': add it, or name a line")],
    ),
    "keys that other sheets give": (
        lambda s: s.update(line=s["line"] + "profile.encumbrance;1.4;m;\nspans.start;0;m;\nwires;x;;\n"
                           "contact_wire.tension;20;kN;\ndamping.beta;1;1/s;\nname;my;;\n"),
        [("line, row 6, column A (key)", "'spans.start' cannot stand here: the sheets supports and droppers give this"),
         ("line, row 9, column A (key)", "'damping.beta' stands in row 3 already"),
         ("line, row 10, column A (key)", "'name' cannot stand here: its name is that of its file"),
         ("line, row 8, column B (value)", "'contact_wire.tension' is what row 2 of the sheet wires gives"),
         ("line, row 5, column B (value)", "'profile.encumbrance' is what the sheet supports gives: remove this row"),
         ("line, row 7, column A (key)", "there is no key 'wires' (known here: ")],
    ),
    "faults that are not counted": (
        lambda s: s.update(line=s["line"] + "fault.kind;arm_loose;;\nfault[0].kind;arm_loose;;\n"),
        [("line, row 5, column B (value)", "'fault' must be an array of tables [[fault]]"),
         ("line, row 6, column A (key)", "there is no 'fault[0]': they are counted from 1")],
    ),
    "a key with a wrong value": (
        change("line", "1e-4", "soon", "0.165;kg", "0.165;N"),
        [("line, row 2, column B (value)", "'soon' is no number, and has the unit 's'"),
         ("line, row 4, column B (value)", "unit 'N' where a unit of 'kg' is needed (kg)")],
    ),
    "arms that are missing": (
        change("wires", "steady_arm;120;1.07;84.7;\n", ""),
        [("wires", "there is no row 'steady_arm': add it, or name a line that has one with --design, as the sheet")],
    ),
    # the track
    "curvature and radius": (
        instead("supports", "position;height;encumbrance;stagger;arm_length;arm_angle;radius;curvature\n"
                "0;5;1.4;0;;;0;0\n50;5;1.4;0.1;1.2;-0.1;5;0\n100;5;1.4;0.1;1.2;-0.1;;0\n150;5;1.4;0;;;0;\n"),
        [("supports, row 1, column G (radius)", "says what curvature says: give one of them"),
         ("supports, row 4, column G (radius)", "is empty: every row needs a value, 0 for none"),
         ("supports, row 5, column H (curvature)", "is empty: every row needs a value, 0 for none"),
         *[(f"droppers, row {r}, column A (span)", "there is no span") for r in range(11, 17)]],
    ),
    "a track that goes back": (
        lambda s: s.update(track="position;curvature\n0;0\n100;0.001\n50;0\n80;0\n70;0\n"),
        [("track, row 4, column A (position)", "50 m comes after 100 m: positions rise along the track"),
         ("track, row 6, column A (position)", "70 m comes after 80 m: positions rise along the track")],
    ),
    "a track in two sheets": (
        every(change("supports", "structure", "cant [mm]", "A1", "0", "M1", "0", "M2", "50", "M3", "50", "M4", "0",
                     "A2", "0"),
              lambda s: s.update(track="position;cant [mm]\n0;0\n100;100\n90;0\n")),
        [("supports, row 1, column A (cant)", "the sheet 'track' gives the track: remove it, or this column"),
         ("track, row 4, column A (position)", "90 m comes after 100 m: positions rise along the track")],
    ),
    # sections
    "sections that are none": (
        every(change("supports", "structure", "section", "M1", "A1", "M2", "A1", "M3", "A1", "M4", "A1", "A2", ""),
              change("droppers", "span;", "section;", "dropper", "span", "\n1;1", "\nA1;1", "\n1;2", "\nB;2")),
        [("supports, row 7, column A (section)", "is empty, and other rows name their section"),
         ("supports", "has 1 supports: two anchors and at least one"),
         ("droppers, row 3, column A (section)", "there is no section 'B' in the sheet supports"),
         *[(f"droppers, row {r}, column A (section)", "there is no section") for r in range(4, 17)],
         *[("droppers, row 1, column B (span)", f"span {k}") for k in range(2, 5)],
         ("supports, row 6, column C (span_length)", "no span begins at the last support: empty the cell")],
    ),
    "hangers of no wire": (
        instead("droppers", re.sub(r";[123];", ";;", DROPPERS.replace("dropper", "kind").replace(";1;9", ";hanger;9"))),
        [(f"droppers, row {r}, column B (kind)", "'hanger' is between auxiliary and messenger wire, and the line has")
         for r in range(2, 17, 3)],
    ),
    "an auxiliary wire without hangers": (
        change("wires", "dropper;12", "auxiliary_wire;65;0.6;84.7;4\nhanger;12;0.1;84.7;\ndropper;12"),
        [("droppers, row 1", f"span {k}, {50 * k - 50} ... {50 * k} m, has no hanger, and the line an auxiliary wire")
         for k in range(1, 6)],
    ),
    "sections of the supports alone": (
        change("supports", "structure", "section", "A1", "A", "M1", "A", "M2", "A", "M3", "A", "M4", "A", "A2", "A"),
        [("droppers, row 1", "the column 'section' is missing: which of the sections A is each dropper of?")],
    ),
    "units in a row of their own": (
        change("supports", "[m]", "", "[deg]", "", "A1;", ";m;[m];m;m;m;m;°\nA1;", "-10", "-0.2", "-10", "-0.2",
               "-10", "-0.2", "-10", "-0.2"),
        [("supports, row 2", "holds units: write them behind the names in brackets, as 'height [mm]'")],
    ),
}  # fmt: skip


def answer(tmp_path, sheets: dict[str, Any]) -> list[str]:
    """Write a layout, import it and return the problems, without the file's name."""
    for name, text in sheets.items():
        (tmp_path / f"{name}.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(LayoutError) as error:
        import_layout(tmp_path, "wrong")
    return [str(problem).removeprefix(f"{tmp_path}: ") for problem in error.value.problems]


def test_the_layout_that_the_wrong_ones_are_made_from_is_right(tmp_path):
    for name, text in BASE.items():
        (tmp_path / f"{name}.csv").write_text(text)
    line = import_layout(tmp_path, "right").definition
    assert [s.structure for s in line.sections[0].supports] == ["A1", "M1", "M2", "M3", "M4", "A2"]
    assert line.damping.beta == 0.0125
    assert line.contact_wire.tension == 20e3


@pytest.mark.parametrize("name", CASES)
def test_every_problem_of_a_wrong_layout_is_told(tmp_path, name):
    edit, expected = CASES[name]
    sheets = dict(BASE)
    edit(sheets)
    found = answer(tmp_path, sheets)
    told = [tuple(text.split(": ", 1)) for text in found]
    assert sorted(place for place, _ in told) == sorted(place for place, _ in expected), "\n".join(found)
    for place, part in expected:
        assert any(part in text for where, text in told if where == place), f"{place}: {part}\n" + "\n".join(found)


def test_the_corpus_is_large():
    assert len(CASES) >= 50


def test_every_problem_of_a_wrong_workbook_is_told(tmp_path):
    """What only workbooks can have: merged cells, formulas that were never calculated, dates, truth."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.title = "Notes"
    for name, text in BASE.items():
        sheet = book.create_sheet(name.upper())
        for line in text.splitlines():
            cells = [float(c.replace(",", ".")) if re.fullmatch(r"-?[\d.,]+", c) else c for c in line.split(";")]
            sheet.append([cell if cell != "" else None for cell in cells])
    supports, droppers = book["SUPPORTS"], book["DROPPERS"]
    supports.merge_cells("E3:E5")
    supports["D6"] = "=5+0.08"
    supports["B7"] = 0.25
    droppers["D4"] = datetime.date(2026, 8, 5)
    droppers["D5"] = True
    book["WIRES"]["C2"] = "=SUM("
    path = tmp_path / "survey.xlsx"
    book.save(path)
    with pytest.raises(LayoutError) as error:
        import_layout(path, "wrong")
    told = [str(problem).removeprefix(f"{path}: ").split(": ", 1) for problem in error.value.problems]
    expected = [
        ("supports, row 4, column E (encumbrance)", "belongs to the merged cells E3:E5: unmerge them"),
        ("supports, row 5, column E (encumbrance)", "belongs to the merged cells E3:E5: unmerge them"),
        ("supports, row 6, column D (height)", "holds a formula without a stored value: open the file"),
        ("supports, row 7, column B (position)", "0.25 m comes after 200 m: positions rise along the track"),
        ("droppers, row 4, column D (length)", "holds the date or time 2026-08-05 00:00:00: format the cell"),
        ("droppers, row 5, column D (length)", "holds TRUE, which is no number"),
        ("wires, row 2, column C (mass)", "holds a formula without a stored value"),
    ]
    assert [place for place, _ in told] == [place for place, _ in expected]
    assert all(text.startswith(part) for (_, text), (_, part) in zip(told, expected, strict=True))


def test_sheets_of_one_name_and_merged_cells_without_anything(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.title = "droppers "
    for name in ("Droppers", "supports"):
        sheet = book.create_sheet(name)
        for line in BASE[name.lower()].splitlines():
            sheet.append([cell or None for cell in line.split(";")])
    book["supports"].merge_cells("J20:K21")
    book["supports"].merge_cells("G2:H2")  # an anchor has no arm
    path = tmp_path / "survey.xlsx"
    book.save(path)
    with pytest.raises(LayoutError) as error:
        import_layout(path, "wrong")
    told = [str(problem).removeprefix(f"{path}: ") for problem in error.value.problems]
    assert told[0].startswith("droppers: stands in two sheets, 'droppers ' and 'Droppers': remove one")
    assert not [text for text in told if text.startswith("supports")]


def test_a_wrong_layout_writes_nothing(tmp_path, capsys):
    sheets = dict(BASE)
    CASES["gaps"][0](sheets)
    folder = tmp_path / "layout"
    folder.mkdir()
    for name, text in sheets.items():
        (folder / f"{name}.csv").write_text(text)
    out = tmp_path / "line.toml"
    assert main(["import", str(folder), "--out", str(out)]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert re.fullmatch(r"error: .*: supports, row 4, column D \(height\): is empty.*", said.err.splitlines()[0])
    assert len(said.err.splitlines()) == 3
    assert sorted(p.name for p in tmp_path.iterdir()) == ["layout"]
