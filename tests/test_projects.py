"""Projects by the installed command: written, valid, run, and run again after an edit of the line."""

from __future__ import annotations

import json
import re

import pytest

import openpanto
from models.library.catalogue import line_names
from models.library.search_path import LIBRARY
from tests.effort import rest, some


@pytest.fixture
def call(tmp_path, monkeypatch, capsys):
    """Call the command in an empty folder and return exit code, output and errors."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("OPENPANTO_LIBRARY", raising=False)
    monkeypatch.setenv("COLUMNS", "1000")

    def called(line):
        code = openpanto._worked(line.split())
        said = capsys.readouterr()
        return code, said.out, said.err

    return called


@pytest.mark.parametrize("line", some(line_names(), "EN50318_2002", "LN2_overlap", "LN2_ring", "Shinkansen"))
def test_every_line_of_the_library_has_room_for_a_train(call, tmp_path, line):
    assert call(f"new demo --line {line} --pantograph CX --speed 200")[0] == 0
    assert (tmp_path / "demo" / "lines" / f"demo_{line}.toml").is_file()


@pytest.mark.parametrize("pantograph", ["generic_multibody", *rest("DSA380")])
def test_a_project_is_valid_as_it_is_written(call, tmp_path, pantograph):
    assert call(f"new demo --line EN50318_2002 --pantograph {pantograph} --speed 250") == (
        0,
        "wrote demo for 250 km/h; demo/README.md says what each file is and what was chosen\n"
        "next: openpanto run demo\n",
        "",
    )
    code, out, _ = call("validate demo --strict")
    assert (code, out.split(";")[0]) == (0, "demo: valid")
    data = (tmp_path / "demo" / "demo.ssp" / "SystemStructure.ssd").read_text()
    assert 'meanForce="130.625"' in data  # 0.00097 v^2 + 70 at 250 km/h


def test_a_train_is_valid_and_the_mean_force_is_that_of_its_speed(call, tmp_path):
    train = "--pantograph CX --pantograph DSA380 --separation 80"
    assert call(f"new train --line EN50318_2002 {train} --speed 160")[0] == 0
    code, out, _ = call("validate train --strict")
    assert (code, out.split(",")[0]) == (0, "train: valid; 3 components")
    data = (tmp_path / "train" / "train.ssp" / "SystemStructure.ssd").read_text()
    assert f'meanForce="{0.00047 * 160**2 + 90:.6g}"' in data


def test_copies_of_definitions_lie_in_the_project_and_are_found_there(call, tmp_path, monkeypatch):
    assert call("new demo --line EN50318_2002 --pantograph EN50318_2002 --speed 250")[0] == 0
    (tmp_path / "demo" / "notes").mkdir()
    monkeypatch.chdir(tmp_path / "demo" / "notes")
    assert call("new-line mine --like demo_EN50318_2002") == (0, f"{tmp_path}/demo/lines/mine.toml\n", "")
    assert call("new-pantograph mine --like CX")[0] == 0
    assert call("pantograph mine")[0] == 0
    assert call("new-line mine --like LN2")[2].endswith("is named 'mine' already: take another name\n")
    monkeypatch.chdir(tmp_path)
    assert "no pantograph 'mine'" in call("pantograph mine")[2]
    code, out, err = call("new-line mine --like LN2")
    assert (code, out) == (0, "lines/mine.toml\n")
    assert "this folder lies in no project" in err


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("new . --line LN2 --pantograph CX --speed 250", ". exists and is not empty: name a new folder, or empty it"),
        (
            "new d --line LN22 --pantograph CX --speed 250",
            "no line 'LN22' in the library; known: .*; did you mean 'LN2'?",
        ),
        (
            "new d --line LN2 --pantograph DSA --speed 250",
            "no pantograph 'DSA' in the library; .* did you mean 'DSA380'?",
        ),
        ("new d --line nix.toml --pantograph CX --speed 250", "nix.toml: there is no such file; .*"),
        ("new d --line LN2 --pantograph nix.fmu --speed 250", "nix.fmu: there is no such FMU"),
        ("new d --line bad.toml --pantograph CX --speed 250", r"bad.toml: type: is missing(\nbad.toml: .*)+"),
        ("new d --line binary.toml --pantograph CX --speed 250", "binary.toml.*"),
        (
            "new d --line LN2 --pantograph CX --speed 0",
            "--speed 0: give the speed of the train in km/h, more than 0 .*",
        ),
        ("new d --line LN2 --pantograph CX --speed 250 --interval 300 2000", "--interval 300 2000: .* 97 and 1012 m"),
        ("new d --line LN2 --pantograph CX --pantograph CX --speed 250", "2 pantographs: give --separation, .* once"),
        (
            "new d --line LN2 --pantograph CX --pantograph CX --separation 0 --speed 250",
            "--separation 0: .* 1 m apart.*",
        ),
        (
            "new d --line LN2 --pantograph CX --speed 250 --map A.x=q",
            "--map A.x=q: catenary is made from a definition.*",
        ),
        (
            "new-line a/b --like LN2",
            "'a/b' cannot name a definition, its file and its FMU: take letters, digits and _ .*",
        ),
        ("new-line LN2 --like LN2", ".*LN2.toml is named 'LN2' already: take another name"),
        ("new-pantograph mine --like CX_", "no pantograph 'CX_' in the library; known: .*; did you mean 'CX'?"),
    ],
)
def test_a_mistake_is_one_sentence_that_says_what_to_do(call, tmp_path, line, said):
    (tmp_path / "bad.toml").write_text("name = 'bad'\n")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe")
    code, _, err = call(line)
    assert code == 1
    assert re.fullmatch(rf"error: {said}\n".replace("?", r"\?"), err), err
    assert not (tmp_path / "d").exists()


@pytest.mark.slow
def test_an_edit_of_the_line_changes_the_figures_with_nothing_else_done_by_hand(call, tmp_path):
    assert call("new demo --line LN2 --pantograph DSA380 --speed 250 --interval 150 200")[0] == 0
    code, out, err = call("run demo --out before --no-report")
    assert code == 0, err
    assert "building Catenary_demo_LN2.fmu\n" in err
    assert "definitions: catenary demo/lines/demo_LN2.toml, pantograph demo/pantographs/demo_DSA380.toml" in out
    line = tmp_path / "demo" / "lines" / "demo_LN2.toml"
    text = line.read_text()
    assert "45.3, 45.5, 45.0, 45.0, 45.0" in text
    line.write_text(text.replace("45.3, 45.5, 45.0, 45.0, 45.0", "45.3, 47.5, 43.0, 45.0, 45.0"))  # within the interval
    code, out, err = call("run demo --out after --no-report")
    assert code == 0, err
    assert "building Catenary_demo_LN2.fmu again: what it is made of has changed" in err
    assert "building Pantograph" not in err
    found = [json.loads((tmp_path / name / "summary.json").read_text()) for name in ("before", "after")]
    (before,), (after,) = (summary["quality"] for summary in found)
    assert abs(before["sigma"] - after["sigma"]) > 0.1
    assert {c["name"]: c["definition"] for c in found[0]["components"]} == {
        "catenary": str(line),
        "pantograph": str(tmp_path / "demo" / "pantographs" / "demo_DSA380.toml"),
    }
    # A second definition of the name, nearer to the scenario: it counts, and that is said.
    nearer = tmp_path / "demo" / "demo.ssp" / "lines" / line.name
    nearer.parent.mkdir()
    nearer.write_text(text)
    _, out, err = call("run demo --out again --no-report")
    assert f"two definitions are named 'demo_LN2': {nearer} is used, {line} is not" in err
    assert re.search(r"definitions: catenary demo/demo\.ssp/lines/demo_LN2\.toml", out)
    assert (tmp_path / "before" / "timeseries.csv").read_bytes() == (tmp_path / "again" / "timeseries.csv").read_bytes()


def test_a_folder_with_a_blank_is_quoted_where_it_is_to_be_typed(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert openpanto._worked(["new", "my line", "--line", "LN2", "--pantograph", "CX", "--speed", "69.4"]) == 0
    said = capsys.readouterr().out
    assert "69.4 km/h" in said  # who meant m/s sees it
    assert "openpanto run 'my line'" in said
    assert "openpanto run 'my line'" in (tmp_path / "my line" / "README.md").read_text()


def test_statics_of_a_name_that_two_definitions_have_says_which_is_used(call, tmp_path, monkeypatch):
    for folder in (tmp_path, tmp_path / "company"):
        (folder / "lines").mkdir(parents=True)
        text = (LIBRARY / "lines" / "EN50318_2002.toml").read_text()
        (folder / "lines" / "mine.toml").write_text(text.replace('"EN50318_2002"', '"mine"'))
    monkeypatch.setenv("OPENPANTO_LIBRARY", str(tmp_path / "company"))
    code, _, said = call("statics mine")
    assert code == 0
    assert "two definitions are named 'mine'" in said
    for line in ("new demo --line mine --pantograph CX --speed 160", "new-line copy --like mine"):
        assert "two definitions are named 'mine'" in call(line)[2]
    said = call("new cx_ln2 --line EN50318_2002 --pantograph CX --speed 160")[2]
    assert "note: 'cx_ln2' is a scenario of the library too" in said


def test_a_definition_that_does_not_build_is_answered_once(call, tmp_path):
    call("new demo --line LN2 --pantograph CX --speed 200")
    path = tmp_path / "demo" / "lines" / "demo_LN2.toml"
    path.write_text(path.read_text().replace('20000, "N"', '20000, "kN"').replace("45.5, 45.0", "455, 45.0"))
    code, _, said = call("validate demo")
    assert code == 1
    assert f"error: {path}: contact_wire.tension" in said
    assert f"\n{path}: spans.lengths: 455 m is outside" in said
    assert re.search(r"spans\.end: .*; so resources/Catenary_demo_LN2\.fmu of component 'catenary' ", said)
    assert said.count("; so resources/") == 1


def test_a_dc_project_is_judged_and_calibrated_by_its_limits(call, tmp_path):
    assert call("new demo --line EN50318_2002 --pantograph CX --speed 160 --supply DC3kV")[0] == 0
    data = (tmp_path / "demo" / "demo.ssp" / "SystemStructure.ssd").read_text()
    assert '<panto:Limits supply="DC3"/>' in data
    assert f'meanForce="{0.00097 * 160**2 + 110:.6g}"' in data
    assert "DC 3 kV (recalled)" in (tmp_path / "demo" / "README.md").read_text()
    with pytest.raises(SystemExit):
        call("new other --line EN50318_2002 --pantograph CX --speed 160 --supply 25kV")


def test_a_line_with_an_overlap_is_judged_over_it_and_an_early_interval_is_told(call, tmp_path):
    assert call("new demo --line LN2_overlap --pantograph CX --speed 250")[::2] == (0, "")
    data = (tmp_path / "demo" / "demo.ssp" / "SystemStructure.ssd").read_text()
    start, end = map(float, re.search(r'Interval start="(.*?)" end="(.*?)"', data).groups())
    assert start <= 997.1
    assert end >= 1095.7
    assert "from 997.1 to 1095.7 m: this overlap lies in the interval" in (tmp_path / "demo" / "README.md").read_text()
    code, _, said = call("new early --line LN2 --pantograph CX --speed 250 --interval 100 600")
    assert code == 0
    assert re.fullmatch(r"note: figures are taken from 100 m and .* begin at \d+ m or later, with --interval\n", said)


def test_a_pantograph_with_a_speed_of_its_own_is_told_before_anything_is_written(call, tmp_path):
    text = (LIBRARY / "pantographs" / "CX.toml").read_text(encoding="utf-8").replace('name = "CX"', 'name = "mine"')
    profile = '[speed_profile]\ntime = [[0, 5], "s", "choice: t"]\nspeed = [[70, 75], "m/s", "choice: t"]\n'
    (tmp_path / "mine.toml").write_text(f"{text}\n{profile}", encoding="utf-8")
    code, _, err = call("new demo --line EN50318_2002 --pantograph mine.toml --speed 250")
    assert code == 1
    assert err.startswith("error: mine.toml has a [speed_profile], and a project begins with the speed that --speed")
    assert not (tmp_path / "demo").exists()
