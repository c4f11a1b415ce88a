"""Tables of CSV files and workbooks: what is read from them, and what is said of those that cannot be."""

import math

import numpy as np
import pytest

from models.layout.csv_sheets import LARGEST_FILE, read_csv
from models.layout.sheet_problems import LayoutError, Place, SheetProblems
from models.layout.sheet_table import SheetColumn, read_table
from models.layout.xlsx_sheets import read_xlsx, workbook_bytes

COLUMNS = (
    SheetColumn("position", "m", "along the track", required=True),
    SheetColumn("height", "m", "of the wire", required=True, minimum=2.0, maximum=10.0),
    SheetColumn("angle", "rad", "of the arm"),
    SheetColumn("span", "1", "number of the span", whole=True, minimum=1.0),
    SheetColumn("kind", "", "what it is", choices=("support", "anchor")),
    SheetColumn("structure", "", "name of the mast"),
)


def read(path, text, columns=COLUMNS):
    path = path / "table.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    problems = SheetProblems("table.csv")
    grid = read_csv(path, "", problems)
    table = read_table(grid, columns, problems) if grid is not None else None
    return table, [str(p).removeprefix("table.csv: ") for p in problems.found]


def told(path, text):
    _, problems = read(path, text)
    assert problems
    return problems


@pytest.mark.parametrize(
    "text",
    [
        "position,height\n100,5.08\n150,5.1\n",
        "position;height\n100;5,08\n150;5,1\n",
        "Position\tHEIGHT\n100\t5,08\n150\t5.1\n",
        '# measured in spring, by "us\n\nheight [mm], position [km]\n5080,0.1\n\n# here\n5100,.15\n',
        "sep=;\nheight (cm);position\n508;1e2\n510;+150\n",
        'position,height\n"100","5,08"\n"150","5,1"\n',
        "\ufeffposition,height,#remark\r\n100,5.08,low\r\n150,5.1,\r\n",
        "position,height\n100,5.08\n150,5.1\n".encode("utf-16"),
    ],
)
def test_tables_as_programs_of_any_country_write_them(tmp_path, text):
    table, problems = read(tmp_path, text)
    assert problems == []
    np.testing.assert_allclose(table.numbers("position"), [100, 150], rtol=1e-15)
    np.testing.assert_allclose(table.numbers("height"), [5.08, 5.1], rtol=1e-15)
    assert np.isnan(table.numbers("angle")).all()
    assert table.texts("structure") == ("", "")


def test_a_name_with_a_point_says_nothing_of_decimal_commas(tmp_path):
    table, problems = read(tmp_path, "position [km];height;structure\n1,250;5,08;12.5\n")
    assert problems == []
    assert table.numbers("position") == [1250.0]
    assert table.texts("structure") == ("12.5",)


def test_values_know_where_they_stand(tmp_path):
    table, _ = read(tmp_path, "# first\nkind;position;structure;height;angle [°]\n\nAnchor;0;17;5;180\n;1;M 2;5;\n")
    assert table.rows == (4, 5)
    assert str(table.place(1, "height")) == "row 5, column D (height)"
    assert table.place(0) == Place("", 4)
    assert table.texts("structure") == ("17", "M 2")
    assert table.texts("kind") == ("anchor", "")
    assert table.numbers("angle")[0] == pytest.approx(math.pi)


@pytest.mark.parametrize(
    ("text", "sentences"),
    [
        ("", ["is empty: the first row has the names of the columns, position, height, [angle]"]),
        ("position;height\n", ["row 1: has no rows below the names"]),
        ("position\n1\n", ["row 1: the column 'height' is missing"]),
        ("a;b\n1;2\n", ["row 1: has none of the names of columns (position, height"]),
        ("Line 5;\nposition;height\n1;5\n", ["row 1: has none of the names of columns", "and row 2 has: delete"]),
        ("0;5\n1;5\n", ["row 1: has none of the names of columns"]),
        ("position;hight;height\n1;;5\n", ["row 1, column B: there is no column 'hight'; did you mean 'height'?"]),
        ("position;foo;height\n1;;5\n", ["row 1, column B: there is no column 'foo'; known here: position, height"]),
        ("height;position;Height [mm]\n5;1;5000\n", ["row 1, column C: 'height' stands in column A already"]),
        ("position [kg];height\n1;5\n", ["row 1, column A (position): unit 'kg' where a unit of 'm' is needed"]),
        ("position [mi];height\n1;5\n", ["row 1, column A (position): unknown unit 'mi' (known for 'm': m, mm"]),
        ("position;height;kind [m]\n1;5;\n", ["row 1, column C (kind): holds text, and has no unit: remove '[m]'"]),
        ("position;height\n1;5.08 m\n", ["row 2, column B (height): '5.08 m' is not a number; write the number alone"]),
        (
            "position;height\n1;high\n2;nan\n",
            ["row 2, column B (height): 'high' is not", "row 3, column B (height): 'n"],
        ),
        ("position;height\n1;inf\n", ["row 2, column B (height): 'inf' is not a number; leave the cell empty"]),
        ("position;height\n12+345.6;5\n", ["write a kilometrage as one number, 12+345.6 as 12.3456 in [km]"]),
        ("position;height\n1 234,5;5\n", ["'1 234,5' is not a number; write it without marks for thousands"]),
        ("position;height\n1,234;5.0\n", ["'1,234' may have a decimal comma or one for thousands"]),
        ("position;height\n1;\n", ["row 2, column B (height): is empty: every row needs a value"]),
        ("position;height\n1;5080\n", ["row 2, column B (height): 5080 is outside 2 ... 10 m: check its size and its"]),
        ("position;height\n1e99;5\n", ["row 2, column A (position): 1e+99 is not finite, or larger"]),
        ("position;height;span\n1;5;1,5\n2;5;0\n", ["1.5 is not a whole number", "0 is less than 1"]),
        ("position;height;kind\n1;5;ancor\n", ["'ancor' is none of support, anchor; did you mean 'anchor'?"]),
        ("position,height\n1,5,08\n", ["row 2, column C: has 3 cells for the 2 names of the first row: are there de"]),
        ("position;;height\n1;7;5\n2;8;5\n", ["row 2, column B: stands in a column without a name"]),
        ('position;height\n1;5\n"2;5\n', ["row 3: cannot be split into cells"]),
        (b"position;height\n1;5\nm\xfctze;5\n", ["row 3: is not UTF-8 text (byte 21): save the file as 'CSV UTF-8'"]),
        (b"position;height\n1;\0\n", ["row 2: is not text: save the table as CSV"]),
        (b"PK\x03\x04", ["is a workbook or an archive, not CSV"]),
        (b"\xd0\xcf\x11\xe0", ["is a workbook of old Excel (.xls)"]),
    ],
)
def test_what_is_said_of_a_wrong_table(tmp_path, text, sentences):
    found = "\n".join(told(tmp_path, text))
    assert [s for s in sentences if s not in found] == [], found


def test_every_problem_is_told_at_once_and_only_once(tmp_path):
    found = told(tmp_path, "position;height [kN];kind\n;5;\nx;;pole\n2;5;\n")
    assert [f.split(":")[0] for f in found] == [
        "row 1, column B (height)",
        "row 2, column A (position)",
        "row 3, column A (position)",
        "row 3, column B (height)",
        "row 3, column C (kind)",
    ]


def test_files_that_cannot_be_read(tmp_path, monkeypatch):
    problems = SheetProblems("there")
    (tmp_path / "broken.csv").symlink_to(tmp_path / "nowhere")
    (tmp_path / "circle.csv").symlink_to(tmp_path / "circle.csv")
    (tmp_path / "folder.csv").mkdir()
    for name in ("absent", "broken", "circle", "folder"):
        assert read_csv(tmp_path / f"{name}.csv", name, problems) is None
    assert [str(p).split(" (")[0] for p in problems.found] == [
        "there: absent: cannot be read",
        "there: broken: cannot be read",
        "there: circle: cannot be read",
        "there: folder: folder.csv is not a file",
    ]
    monkeypatch.setattr("models.layout.csv_sheets.LARGEST_FILE", 10)
    assert "read at most: split it" in told(tmp_path, "position;height\n")[0]
    assert LARGEST_FILE > 1e8


def test_an_error_lists_every_problem():
    problems = SheetProblems("x.xlsx")
    problems.finish()
    for row in range(1, 1502):
        problems.add(Place("supports", row, "C (height)"), "is empty")
    with pytest.raises(LayoutError) as error:
        problems.finish()
    lines = str(error.value).splitlines()
    assert lines[0] == "x.xlsx: supports, row 1, column C (height): is empty"
    assert lines[999].startswith("x.xlsx: supports, row 1000,")
    assert lines[1000:] == ["... and 501 more problems"]


# Workbooks


@pytest.fixture
def openpyxl():
    return pytest.importorskip("openpyxl")


def book(openpyxl, path, rows, change=None):
    made = openpyxl.Workbook()
    sheet = made.active
    sheet.title = "Table"
    for row in rows:
        sheet.append(row)
    if change is not None:
        change(sheet)
    path = path / "book.xlsx"
    made.save(path)
    problems = SheetProblems("book.xlsx")
    grids = read_xlsx(path, problems)
    table = read_table(grids["table"], COLUMNS, problems) if "table" in grids else None
    return table, [str(p).removeprefix("book.xlsx: ") for p in problems.found]


def test_a_workbook_is_read_as_a_file_is(openpyxl, tmp_path):
    rows = [["# title"], ["Height [mm]", None, "position", "structure"], [], [5080, None, 1, 12], ["5100,5", None, 2]]
    table, problems = book(openpyxl, tmp_path, rows)
    assert problems == []
    np.testing.assert_allclose(table.numbers("height"), [5.08, 5.1005])
    assert table.texts("structure") == ("12", "")
    assert str(table.place(1, "position")) == "table, row 5, column C (position)"


def test_formulas_are_their_stored_values(openpyxl, tmp_path):
    """A workbook as Excel saves it: the formula, and beside it what it came to."""
    import re
    import zipfile

    _, problems = book(openpyxl, tmp_path, [["position", "height"], ["=1+1", 5.0], [3, "=1/0"]])
    text = "holds a formula without a stored value: open the file in a spreadsheet program and save it"
    assert [p.startswith(f"table, row {r}, column {c}: {text}") for p, (r, c) in
            zip(problems, [(2, "A (position)"), (3, "B (height)")], strict=True)] == [True, True]  # fmt: skip
    packed = tmp_path / "calculated.xlsx"
    with zipfile.ZipFile(tmp_path / "book.xlsx") as old, zipfile.ZipFile(packed, "w") as new:
        for name in old.namelist():
            data = old.read(name).decode()
            data = re.sub(r"<f>1\+1</f><v ?/>|<f>1\+1</f><v></v>", "<f>1+1</f><v>2</v>", data)
            data = re.sub(r'<c r="B3"([^>]*)><f>1/0</f><v ?/>', r'<c r="B3" t="e"><f>1/0</f><v>#DIV/0!</v>', data)
            data = re.sub(r'<c r="B3"([^>]*)><f>1/0</f><v></v>', r'<c r="B3" t="e"><f>1/0</f><v>#DIV/0!</v>', data)
            new.writestr(name, data)
    found = SheetProblems("calculated.xlsx")
    table = read_table(read_xlsx(packed, found)["table"], COLUMNS, found)
    assert table.numbers("position").tolist() == [2.0, 3.0]
    assert [str(p) for p in found.found] == [
        "calculated.xlsx: table, row 3, column B (height): holds the error #DIV/0!: correct its formula, or write the "
        "value"
    ]


def test_cells_that_hold_no_number(openpyxl, tmp_path):
    import datetime

    rows = [["position", "height"], [True, 5], [datetime.datetime(2026, 8, 5), 5], [1, 5], [2, 5], [3, 5]]
    _, problems = book(openpyxl, tmp_path, rows, lambda sheet: sheet.merge_cells("B4:B6"))
    assert [p.split(": ")[0] for p in problems] == [
        "table, row 2, column A (position)",
        "table, row 3, column A (position)",
        "table, row 5, column B (height)",
        "table, row 6, column B (height)",
    ]
    assert "TRUE, which is no number" in problems[0]
    assert "the date or time 2026-08-05" in problems[1]
    assert "belongs to the merged cells B4:B6: unmerge them" in problems[2]


def test_a_sheet_that_reaches_to_the_end_of_the_program(openpyxl, tmp_path):
    _, problems = book(openpyxl, tmp_path, [["position", "height"], [1, 5]], lambda sheet: sheet.cell(1048576, 9, " "))
    assert problems == ["table: reaches as far as cell I1048576: delete what stands beyond the table"]


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (b"", "is not an XLSX workbook"),
        (b"position;height", "is not an XLSX workbook"),
        (b"\xd0\xcf\x11\xe0" + bytes(600), "is a workbook of old Excel (.xls), or one with a password"),
        (b"PK\x05\x06" + bytes(18), "cannot be read as a workbook"),
    ],
)
def test_files_that_are_no_workbooks(openpyxl, tmp_path, data, sentence):
    path = tmp_path / "book.xlsx"
    path.write_bytes(data)
    problems = SheetProblems("book.xlsx")
    assert read_xlsx(path, problems) == {}
    assert sentence in str(problems.found[0])
    assert read_xlsx(tmp_path / "absent.xlsx", problems) == {}
    assert "there is no such file" in str(problems.found[1])


def test_without_openpyxl_a_sentence_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    problems = SheetProblems("book.xlsx")
    assert read_xlsx(tmp_path / "book.xlsx", problems) == {}
    assert str(problems.found[0]).startswith("book.xlsx: needs openpyxl, which is not installed: pip install")
    with pytest.raises(LayoutError, match="needs openpyxl"):
        workbook_bytes({})


def test_a_workbook_that_is_too_large(openpyxl, tmp_path, monkeypatch):
    monkeypatch.setattr("models.layout.xlsx_sheets._LARGEST", 3000)
    _, problems = book(openpyxl, tmp_path, [["position", "height"], [1, 5]])
    assert len(problems) == 1
    assert "MB are read at most: split it" in problems[0]


def test_a_written_workbook_is_read_back(openpyxl, tmp_path):
    path = tmp_path / "written.xlsx"
    path.write_bytes(workbook_bytes({"table": [["position [km]", "height", "kind"], [0.1, 5.25, "support"]]}))
    problems = SheetProblems("written.xlsx")
    table = read_table(read_xlsx(path, problems)["table"], COLUMNS, problems)
    assert not problems.found
    assert (table.numbers("position")[0], table.numbers("height")[0]) == (100.0, 5.25)
