"""Measuring runs as written: units, decimal commas, order, and every mistake told with row and column."""

import pytest

from models.layout.as_built.measured_reading import read_measured_run
from models.layout.sheet_problems import LayoutError


def written(tmp_path, *lines):
    path = tmp_path / "run.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_units_and_decimal_commas(tmp_path):
    path = written(
        tmp_path,
        "Structure;Height [mm];Position [km];Stagger [cm];thickness [mm]",
        "M1;5080,5;12,3450;20;13,2",
        ";;12,3455;19,5;",
        ";5079;12,3460;;13,0",
    )
    run = read_measured_run(path)
    assert run.position == pytest.approx([12345.0, 12345.5, 12346.0])
    assert run.height == pytest.approx([5.0805, float("nan"), 5.079], nan_ok=True)
    assert run.stagger == pytest.approx([0.2, 0.195, float("nan")], nan_ok=True)
    assert run.thickness == pytest.approx([0.0132, float("nan"), 0.013], nan_ok=True)
    assert run.structure == ("M1", "", "")
    assert run.row == (2, 3, 4)
    assert run.way == pytest.approx(1.0)


def test_a_run_against_the_kilometrage_is_turned(tmp_path):
    run = read_measured_run(written(tmp_path, "position,height", "3,5.03", "2,5.02", "1,5.01"))
    assert run.position.tolist() == [1.0, 2.0, 3.0]
    assert run.height.tolist() == [5.01, 5.02, 5.03]
    assert run.row == (4, 3, 2)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["position,height", "1,5", "2,5", "1.5,5", "3,5"], ["row 4, column A (position): 1.5 m comes after 2 m"]),
        (["position,height", "1,5", "1,5", "2,5", "3,5"], ["row 3, column A (position): 1 m stands in the row before"]),
        (["position,height", "1,5", "2,5"], ["has 2 rows, and a run has 3 at least"]),
        (["position,stagger", "1,0", "2,0", "3,0"], ["a column 'height' with the heights of the wire is needed"]),
        (["position,height", "1,5080", "2,x", ",5"], ["row 2, column B", "row 3, column B", "row 4, column A"]),
        (["position,hight", "1,5", "2,5", "3,5"], ["did you mean 'height'?"]),
        (["height", "5", "5", "5"], ["the column 'position' is missing"]),
        ([""], ["is empty"]),
    ],
    ids=["back", "twice", "two rows", "no heights", "cells", "name", "no positions", "empty"],
)
def test_mistakes_are_told_by_row_and_column(tmp_path, lines, said):
    with pytest.raises(LayoutError) as error:
        read_measured_run(written(tmp_path, *lines))
    assert all(text in str(error.value) for text in said), str(error.value)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(LayoutError, match="cannot be read"):
        read_measured_run(tmp_path / "gone.csv")


def test_a_column_in_another_unit_is_told_ten_times_and_counted(tmp_path):
    rows = [f"{x},{5080 + x}" for x in range(500)]
    with pytest.raises(LayoutError) as error:
        read_measured_run(written(tmp_path, "position,height", *rows, "x,5"))
    told = str(error.value).splitlines()
    assert len(told) == 12
    assert told[0].endswith("row 2, column B (height): 5080 is outside 2 ... 10 m: check its size and its unit")
    assert told[-1].endswith("column B (height): ... and 490 more rows are wrong")
    assert any("row 502, column A (position)" in line for line in told)


def test_a_run_beside_hidden_sheets_is_read(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in (["position", "height"], [1.0, 5.01], [2.0, 5.02], [3.0, 5.03]):
        book.active.append(row)
    book.create_sheet("raw").sheet_state = "hidden"
    book.save(tmp_path / "run.xlsx")
    run = read_measured_run(tmp_path / "run.xlsx")
    assert run.height.tolist() == [5.01, 5.02, 5.03]
    assert run.notes == (f"{tmp_path / 'run.xlsx'}: 'raw' is hidden and was not read",)
