"""Broken tables: measured forces, frequency responses, the variants and settings of studies."""

from __future__ import annotations

import csv
import io
import itertools
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from master.batch.study.family import STUDY, VARIANTS, load_family
from master.commands.main import main as master
from master.errors import MasterError
from master.evaluation.measured_force import read_measured
from master.safety.safe_files import plain_cell, safe_cell
from models.commands.physics_main import main as models
from models.definition_files.toml_reader import DefinitionError
from models.pantograph.identification import read_response
from tests.effort import count
from tests.robustness.mutation import changes
from tests.robustness.support import (
    PROFILE,
    TRIED,
    ask,
    assert_accepted,
    assert_lines,
    assert_refused,
    assert_worded,
    put_file,
)

SCENARIOS = Path(__file__).parents[2] / "ssp_scenarios"
BAD_CELLS = (
    "",
    " ",
    "nan",
    "inf",
    "-inf",
    "1e999",
    "1e300",
    "x",
    "1_000",
    "1,5",
    "0x10",
    "--1",
    "1 2",
    "9" * 5000,
    "٣",
)
ROWS = 12

numbers = st.floats(-1e6, 1e6).map(lambda v: round(v, 6))
tables = st.lists(st.tuples(st.floats(0.01, 10.0), numbers), min_size=3, max_size=ROWS)


def csv_text(head, rows, separator=","):
    return "\n".join([head, *(separator.join(map(str, row)) for row in rows)]) + "\n"


def refused(error):
    assert_lines(str(error.value).splitlines())
    return str(error.value)


@settings(PROFILE, max_examples=count(48, 150))
@given(table=tables, unit=st.sampled_from(["m", "km", "s", "ms"]), force=st.sampled_from(["N", "kN"]),
       separator=st.sampled_from(",;"))  # fmt: skip
def test_sound_measurements_are_read_as_written(tmp_path_factory, table, unit, force, separator):
    TRIED["measurement, sound"] += 1
    place = np.cumsum([step for step, _ in table]).tolist()
    name = "time" if unit.endswith("s") else "position"
    rows = [(repr(x), repr(f)) for x, (_, f) in zip(place, table, strict=True)]
    path = tmp_path_factory.getbasetemp() / "m.csv"
    put_file(path, csv_text(f"{name} [{unit}]{separator}force [{force}]", rows, separator))
    found = read_measured(path)
    assert found.over_time == (name == "time")
    factor = {"m": 1.0, "s": 1.0, "km": 1e3, "ms": 1e-3}[unit]
    assert found.abscissa == pytest.approx(np.array(place) * factor)
    assert found.force == pytest.approx(np.array([f for _, f in table]) * (1e3 if force == "kN" else 1.0))


@pytest.mark.parametrize("bad", BAD_CELLS)
@pytest.mark.parametrize("column", [0, 1])
def test_a_bad_cell_of_a_measurement_is_told_with_its_line(tmp_path, bad, column):
    for row in range(ROWS):
        TRIED["measurement, bad cell"] += 1
        rows = [[f"{x}", f"{100 + x}"] for x in range(ROWS)]
        rows[row][column] = f'"{bad}"'
        put_file(tmp_path / "m.csv", csv_text("position [m],force [N]", rows))
        with pytest.raises(MasterError) as error:
            read_measured(tmp_path / "m.csv")
        assert f"m.csv:{row + 2}: " in refused(error)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no column named position or time"),
        ("\n\n\n", "no column named position or time"),
        ("force [N],position [m]\n", "at least three rows"),
        ("position [m]\n1\n2\n3\n", "no column named force"),
        ("force [N]\n1\n2\n3\n", "no column named position or time"),
        ("position [N],force [N]\n1,2\n2,3\n3,4\n", "column 'position' has the unit 'n'; m or km is needed"),
        ("time [m],force [N]\n1,2\n2,3\n3,4\n", "column 'time' has the unit 'm'; s or ms is needed"),
        ("time [s],force [m]\n1,2\n2,3\n3,4\n", "column 'force' has the unit 'm'; N or daN or kN is needed"),
        ("time [s],force [lbf]\n1,2\n2,3\n3,4\n", "column 'force' has the unit 'lbf'"),
        ("km [m],time [s],force [N]\n1,2\n2,3\n3,4\n", "m.csv:2: has 2 cells, the head has 3"),
        ("time [s],force [N]\n1,2\n2,3,4\n3,4\n", "m.csv:3: has 3 cells, the head has 2"),
        ("time [s],force [N],Force [kN]\n1,2,3\n2,3,4\n3,4,5\n", "several columns of the same meaning"),
        ("time [s],t [ms],force [N]\n1,2,3\n2,3,4\n3,4,5\n", "several columns of the same meaning"),
        ("time [s],force [N]\n1,2\n1,3\n3,4\n", "m.csv:3: the time does not increase"),
        ("position [m],force [N]\n3,2\n1,3\n2,4\n", "m.csv:4: the position does not fall"),
        ("position [m],force [N]\n3,2\n2,3\n4,4\n", "m.csv:3: the position does not increase"),
        ("time [s],force [N]\n1,2\n\n2,3\n\n1,4\n", "m.csv:6: the time does not increase"),
        ("time [s],force [N]\n1,2\n2,3\n", "it holds 2"),
        ('time [s],force [N]\n1,"' + "2" * 200_000 + '"\n', "not a table of separated values"),
    ],
)
def test_measurements_that_cannot_be_read(tmp_path, text, said):
    TRIED["measurement, by hand"] += 1
    put_file(tmp_path / "m.csv", text)
    with pytest.raises(MasterError) as error:
        read_measured(tmp_path / "m.csv")
    assert said in refused(error)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-32", "cp500"])
def test_measurements_in_other_encodings(tmp_path, encoding):
    TRIED["measurement, by hand"] += 1
    put_file(tmp_path / "m.csv", "time [s],force [N]\n1,2\n2,3\n3,4\n".encode(encoding))
    with pytest.raises(MasterError) as error:
        read_measured(tmp_path / "m.csv")
    assert "m.csv" in refused(error)


@settings(PROFILE, max_examples=count(72, 400))
@given(change=changes())
def test_measurements_blindly(tmp_path_factory, change):
    TRIED["measurement, blindly"] += 1
    path = tmp_path_factory.getbasetemp() / "m.csv"
    put_file(path, change(csv_text("position [m],force [N]", [(x, 100 + x) for x in range(20)]).encode()))
    try:
        found = read_measured(path)
    except MasterError as error:
        assert_worded(error, "m.csv")
        return
    written = path.read_text(encoding="utf-8-sig")
    cells = [c.strip(' "') for line in written.splitlines() for c in line.replace(";", ",").split(",")]
    for value in (*found.abscissa.tolist(), *found.force.tolist()):
        assert any(_same(cell, value) for cell in cells), value


def _same(cell, value):
    try:
        return any(float(cell) * factor == pytest.approx(value) for factor in (1.0, 1e3, 1e-3))
    except ValueError:
        return False


RESPONSE = [(0.5 + 0.5 * i, 1e-3 / (1 + i), -1e-4) for i in range(ROWS)]


def test_a_sound_response_is_read_as_written(tmp_path):
    for head in ("", "frequency [Hz],real,imaginary\n", "# measured\nf,re,im\n"):
        put_file(tmp_path / "r.csv", head + csv_text("", RESPONSE).lstrip())
        found = read_response(tmp_path / "r.csv")
        assert found.frequency == pytest.approx([f for f, _, _ in RESPONSE])
        assert 1.0 / found.stiffness == pytest.approx([re + 1j * im for _, re, im in RESPONSE])


@pytest.mark.parametrize("bad", [*BAD_CELLS, "1e-300"])
@pytest.mark.parametrize("column", [0, 1, 2])
def test_a_bad_cell_of_a_response_is_told_with_its_line(tmp_path, bad, column):
    for row in range(ROWS):
        if bad == "1e-300" and column:
            continue  # next to nothing beside the other part
        TRIED["response, bad cell"] += 1
        rows = [list(map(str, r)) for r in RESPONSE]
        rows[row][column] = f'"{bad}"'
        put_file(tmp_path / "r.csv", csv_text("f,re,im", rows))
        if bad == "1e-300":
            assert read_response(tmp_path / "r.csv").frequency[row] == 1e-300
            continue
        with pytest.raises(DefinitionError) as error:
            read_response(tmp_path / "r.csv")
        assert f"r.csv: line {row + 2}: " in refused(error)


@settings(PROFILE, max_examples=count(72, 400))
@given(change=changes())
def test_responses_blindly(tmp_path_factory, change):
    TRIED["response, blindly"] += 1
    path = tmp_path_factory.getbasetemp() / "r.csv"
    put_file(path, change(csv_text("f,re,im", RESPONSE).encode()))
    try:
        found = read_response(path)
    except DefinitionError as error:
        assert_worded(error, "r.csv")
        return
    assert np.isfinite(found.frequency).all()
    assert np.isfinite(found.stiffness).all()
    cells = [c.strip(' "') for line in path.read_text("utf-8-sig").splitlines() for c in line.split(",")]
    assert all(any(_same(cell, f) for cell in cells) for f in found.frequency.tolist())


#: What argparse says of options that it cannot read.
UNREAD = ("invalid int value", "invalid choice", "write NAME=VALUE", "'x' is not a number")


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        ("", [], "has no line of three numbers"),
        ("f,re,im\n", [], "has no line of three numbers"),
        ("1;2;3\n", [], "has no line of three numbers"),
        ("1,2\n", [], "line 1: has 2 columns"),
        ("1,2,3,4\n", [], "line 1: has 4 columns"),
        ("x,1,2\n1,2,3\n", [], "line 1: could not convert"),
        ("a,b,c\nd,e,f\n1,2,3\n", [], "line 2: could not convert"),
        ("0,1,1\n", [], "line 1: frequency 0 Hz"),
        ("-1,1,1\n", [], "line 1: frequency -1 Hz"),
        ("1,0,0\n", [], "line 1: the response is 0"),
        ("1,1e-3,0\n", [], "too few"),
        ("1,1e-3,0\n", ["--stages", "0"], "0 stages"),
        ("1,1e-3,0\n", ["--stages", "-3"], "-3 stages"),
        ("1,1e-3,0\n", ["--stages", "1000000000"], "1000000000 stages"),
        ("1,1e-3,0\n", ["--stages", "x"], "invalid int value"),
        ("1,1e-3,0\n", ["--kind", "x"], "invalid choice"),
        ("1,1e-3,0\n", ["--fix", "m3"], "write NAME=VALUE"),
        ("1,1e-3,0\n", ["--fix", "m9=1"], "there is no value m9"),
        ("1,1e-3,0\n", ["--fix", "m1=nan"], "m1 = nan cannot be"),
        ("1,1e-3,0\n", ["--fix", "m1=inf"], "m1 = inf cannot be"),
        ("1,1e-3,0\n", ["--fix", "m1=0"], "m1 = 0 cannot be"),
        ("1,1e-3,0\n", ["--fix", "c1=-1"], "c1 = -1 cannot be"),
        ("1,1e-3,0\n", ["--fix", "m1=x"], "'x' is not a number"),
        ("1,1e-3,0\n", ["--fix", "m1=1", "--fix", "m1=2"], "m1: is given twice"),
        ("1,1e-3,0\n", ["--stages", "1", "--fix", "m1=1", "--fix", "c1=1", "--fix", "k1=1"], "every value is fixed"),
    ],
)
def test_identify_says_what_is_wrong(tmp_path, text, options, said):
    TRIED["models identify"] += 1
    put_file(tmp_path / "r.csv", text)
    assert_refused(ask(models, "identify", tmp_path / "r.csv", *options), said, code=2 if said in UNREAD else 1)


FAMILY = SCENARIOS / "cx_generic_pair.ssp"


def family(folder, **changed):
    for name in (STUDY, VARIANTS):
        shutil.copy(FAMILY / name, folder / name)
    for name, data in changed.items():
        put_file(folder / name.replace("__", "."), data)


@pytest.mark.parametrize("name", [STUDY, VARIANTS])
@settings(PROFILE, max_examples=count(60, 200))
@given(change=changes())
def test_studies_blindly(tmp_path_factory, name, change):
    TRIED["study, blindly"] += 1
    folder = tmp_path_factory.getbasetemp()
    family(folder, **{name.replace(".", "__"): change((FAMILY / name).read_bytes())})
    answer = ask(master, "study", folder, "--list")
    if answer.code:
        assert_refused(answer)
        assert name in answer.err or "there is no" in answer.err
        return
    assert_accepted(answer)
    found = load_family(str(folder))
    text = (folder / name).read_text(encoding="utf-8")
    if name == VARIANTS:
        assert all(f"{v.name}" in text for v in found.variants)
        assert all(value in text for v in found.variants for value in v.values.values())


CELLS = ("nan", "inf", "-1", "x", "1e999")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "first column must be 'variant'"),
        ("a,b\n", "first column must be 'variant'"),
        ("variant\n", "has no variant"),
        ("variant,stop\n,1\n", "name"),
        ("variant,stop\na,1\na,2\n", "'a' appears more than once"),
        ("variant,stop\na b,1\na_b,2\n", "same folder"),
        ("variant,stop\nA,1\na,2\n", "same folder"),
        ("variant,stop,stop\na,1,2\n", "column 'stop' appears 2 times"),
        ("variant,p.f,p.f\na,1,2\n", "column 'p.f' appears 2 times"),
        ("variant,speed\na,1\n", "column 'speed' is neither"),
        ("variant,stop\na,1,2\n", "variants.csv:2: has 3 cells"),
        ("variant,stop\na\n", "variants.csv:2: has 1 cells"),
        *((f"variant,stop\na,{c}\n", "variants.csv:2: stop") for c in CELLS),
        *((f"variant,step\na,{c}\n", "variants.csv:2: step") for c in CELLS),
    ],
)
def test_variants_that_cannot_be(tmp_path, text, said):
    TRIED["study, by hand"] += 1
    family(tmp_path, variants__csv=text.encode())
    assert_refused(ask(master, "study", tmp_path, "--list"), said)


@pytest.mark.parametrize("name", ["..", ".", "../../x", "/etc/passwd", "a/../../b", "\\..\\x", "con\x00"])
def test_no_variant_climbs_out_of_the_results(tmp_path, name):
    from master.batch.study.family import folder_name

    TRIED["study, by hand"] += 1
    place = (tmp_path / folder_name(name)).resolve()
    assert place.parent == tmp_path.resolve()
    assert place != tmp_path.resolve()


BROKEN_STUDIES = [
    "", "title = 1", "title = 'x'", "title = 'x'\ninterval = []", "a = " + "[" * 5000, "a = " + "9" * 5000, "\x00",
    "title = 'x'\n[[interval]]\nname = 'a'\nstart = 2\nend = 1",
    "title = 'x'\n[[interval]]\nname = 'a'\nstart = nan\nend = 1",
    "title = 'x'\n[[interval]]\nname = 'a'\nstart = 0\nend = 1\nextra = 1", "title = 'x'\ntitle = 'y'",
]  # fmt: skip


@pytest.mark.parametrize("text", BROKEN_STUDIES, ids=range(len(BROKEN_STUDIES)))
def test_settings_of_a_study_that_cannot_be(tmp_path, text):
    TRIED["study, by hand"] += 1
    family(tmp_path, study__toml=text.encode())
    assert_refused(ask(master, "study", tmp_path, "--list"), "study.toml")


def test_measurements_reach_the_command(measured_run, tmp_path):
    """``report --measured``: the same words, and no report is written."""
    for bad, column in itertools.product(BAD_CELLS, (0, 1)):
        TRIED["master report --measured"] += 1
        rows = [[f"{x}", f"{100 + x}"] for x in range(ROWS)]
        rows[5][column] = f'"{bad}"'
        put_file(tmp_path / "m.csv", csv_text("position [m],force [N]", rows))
        assert_refused(ask(master, "report", measured_run, "--measured", tmp_path / "m.csv"), "m.csv:7: ")
        assert not (measured_run / "report.html").exists()


#: What people and machines put into cells: control sequences, formulas, separators, quotes, numbers of all kinds.
CELL = st.one_of(
    st.text(max_size=12),
    st.sampled_from(["=cmd|' /C calc'!A0", "+1", "-1", "@x", "\x1b[2J", "\u202e", "'", '"', "a,b", "a\nb", "\x00",
                     "1e300", "nan", "inf", "", " ", "A" * 5000, "\ud7ff", "[/]", "[red]", "../..", "0", "1", "0.5"]),
)  # fmt: skip


@settings(PROFILE, max_examples=count(48, 4000))
@given(head=st.lists(CELL, max_size=3), rows=st.lists(st.lists(CELL, min_size=1, max_size=4), min_size=1, max_size=4))
def test_study_tables_of_any_cells(tmp_path_factory, head, rows):
    """Reported in words with the file, or listed; whatever the cells hold, all that is printed can be read."""
    TRIED["study table, any cells"] += 1
    folder = tmp_path_factory.getbasetemp()
    text = io.StringIO()
    csv.writer(text).writerows([["variant", "stop", *head], *rows])
    family(folder, variants__csv=text.getvalue().encode())
    answer = ask(master, "study", folder, "--list")
    assert answer.code in (0, 1), answer
    assert_lines(answer.err.splitlines())
    assert all(line.isprintable() for line in answer.out.splitlines()), answer.out
    if answer.code:
        assert_refused(answer)
        assert VARIANTS in answer.err or STUDY in answer.err, answer.err


@settings(PROFILE, max_examples=count(36, 2000))
@given(names=st.lists(CELL.filter(lambda c: c.strip()), min_size=1, max_size=5, unique=True))
def test_a_table_that_is_written_reads_the_same_and_computes_nothing(names):
    """Names of components and variables as titles: no spreadsheet takes one for a formula, none is lost."""
    TRIED["table, titles"] += 1
    cells = [safe_cell(name) for name in names]
    assert not any(cell.startswith(("=", "+", "-", "@", "\t", "\r")) for cell in cells)
    assert [plain_cell(cell) for cell in cells] == names
