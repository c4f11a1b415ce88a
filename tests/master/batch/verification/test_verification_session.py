"""The command: toy cases from toy FMUs."""

import json
import re
import shutil

import pytest

from master.batch.batch_session import Runner
from master.batch.verification import verification_session
from master.batch.verification.case import load_cases
from master.batch.verification.case_runs import Runs
from master.commands.main import main
from master.errors import InterruptedRunError

CASE = """
title = "A <toy>"
description = "One mass & springs"
scenario = "toy.ssp"

[[rows]]
quantity = "mean"
value = 140
tolerance_percent = 5
source = "static force"

[[rows]]
quantity = "uplift_at"
at = [0, 50]
value = [21, 42]
tolerance_percent = 5
source = "by hand: the second support rises twice as far"
kind = "indicative"

[[rows]]
quantity = "uplift"
range = [1, 1000]
source = "by hand"

[[rows]]
quantity = "slack_share"
within = 5
maximum = 0
source = "a toy dropper never slackens"

[[rows]]
quantity = "en50367"
is = true
source = "nobody"
kind = "report"
"""
FAILING = CASE + '\n[[rows]]\nquantity = "sigma"\nminimum = 1000\nsource = "wishful"\n'


@pytest.fixture
def case(toy, toy_text, in_folder):
    """Write a case beside the toy scenario, whose interval ends just before its second support."""
    (toy / "SystemStructure.ssd").write_text(toy_text('<panto:Interval start="20" end="49.5"/>'))

    def write(text=CASE, name="toy"):
        path = in_folder / f"{name}.toml"
        path.write_text(text)
        return str(path)

    return write


def _verify(*arguments):
    return main(["verify", *arguments, "--no-build", "--out", "v"])


def _data(in_folder):
    return json.loads((in_folder / "v" / "verify.json").read_text())


def test_a_case_that_holds(case, in_folder, capsys):
    assert _verify(case()) == 0
    out = capsys.readouterr().out
    assert max(len(line) for line in out.splitlines()) <= 80
    said = (
        "mean force",
        "static",
        "force",
        "passed",
        "departs",
        "5 rows: 4 passed",
        "indicative",
        "page: v/verify.html",
    )
    assert [text for text in said if text not in out] == []
    data = _data(in_folder)
    assert data["passed"] is True
    assert data["status"] == "complete"
    rows = {row["quantity"]: row for row in data["cases"][0]["rows"]}
    assert rows["mean"]["values"][0] == pytest.approx(140.0, rel=0.05)
    assert rows["uplift_at"]["labels"] == ["0 m", "50 m"]
    assert rows["slack_share"]["values"] == [0.0]
    assert rows["en50367"]["verdict"] == "departs"


def test_the_page_stands_alone_and_says_every_row(case, in_folder):
    assert _verify(case(FAILING), "--quiet") == 1
    text = (in_folder / "v" / "verify.html").read_text()
    assert "A &lt;toy&gt;" in text
    assert "One mass &amp; springs" in text
    for row in _data(in_folder)["cases"][0]["rows"]:
        assert row["title"] in text
        assert row["reference"] in text
        assert row["source"] in text
    assert "Not verified." in text
    assert "FAILED" in text
    assert "id='chart-toy_force_catenary_1'" in text
    assert not re.search(r"https?://", text.split("<script>")[0])
    assert "sha256" in text


def test_a_row_that_fails_ends_with_1(case, capsys):
    assert _verify(case(FAILING)) == 1
    out = capsys.readouterr().out
    assert "1 FAILED" in out
    assert "FAILED: toy, standard deviation: " in out
    assert "wanted at least 1000 N" in out


def test_quiet_and_json(case, in_folder, capsys):
    assert _verify(case(), "--quiet") == 0
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", "")
    assert _verify(case(), "--json", "--quiet") == 0
    assert json.loads(capsys.readouterr().out) == _data(in_folder)


def test_wrong_command_lines_and_files(case, capsys):
    assert _verify("no_such_case") == 1
    assert "there is no case 'no_such_case'" in " ".join(capsys.readouterr().err.split())
    assert _verify(case("title = 3")) == 1
    assert "toy.toml: title" in capsys.readouterr().err


def test_the_list_names_every_case_and_runs_nothing(in_folder, capsys):
    assert main(["verify", "--list"]) == 0
    out = capsys.readouterr().out
    assert "cx_ln2" in out
    assert "wave_speeds" in out
    assert not list(in_folder.iterdir())


def test_a_folder_of_something_else_is_left_alone(case, in_folder, capsys):
    (in_folder / "v").mkdir()
    (in_folder / "v" / "letter.txt").write_text("dear")
    assert _verify(case()) == 1
    assert "left alone" in " ".join(capsys.readouterr().err.split())
    assert [p.name for p in (in_folder / "v").iterdir()] == ["letter.txt"]


def test_a_run_that_fails_fails_its_case_and_the_next_goes_on(case, toy, in_folder, capsys):
    broken = in_folder / "broken.ssp"
    shutil.copytree(toy, broken)
    text = (broken / "parameters.ssv").read_text().replace('"ripple"', '"rippel"')
    (broken / "parameters.ssv").write_text(text)
    assert _verify(case(CASE.replace("toy.ssp", "broken.ssp"), "broken"), case()) == 1
    assert "run 'run' failed" in capsys.readouterr().out
    first, second = _data(in_folder)["cases"]
    assert (first["passed"], second["passed"]) == (False, True)
    assert "rippel" in first["failures"]["run"]
    assert {row["verdict"] for row in first["rows"]} == {"failed", "departs"}


PAIR = """
title = "Two"
[runs]
soft = "toy.ssp"
hard = "copy.ssp"
start = { scenario = "toy.ssp", start_only = true }
[[rows]]
quantity = "mean"
run = "soft"
below = ["hard"]
source = "by hand"
"""


def test_runs_are_made_once_and_told_apart_by_content(case, toy, in_folder):
    shutil.copytree(toy, in_folder / "copy.ssp")
    assert _verify(case(PAIR, "pair"), case(), "--quiet") == 1  # equal is not below
    assert [p.name for p in (in_folder / "v" / "runs").iterdir()] == ["toy"]
    values = (toy / "parameters.ssv").read_text()
    (in_folder / "copy.ssp" / "parameters.ssv").write_text(values.replace('value="140"', 'value="160"'))
    assert _verify(case(PAIR, "pair"), case(), "--quiet") == 0
    assert sorted(p.name for p in (in_folder / "v" / "runs").iterdir()) == ["copy", "toy"]
    assert _data(in_folder)["cases"][0]["rows"][0]["verdict"] == "passed"


def test_a_later_verification_runs_anew(case, toy, in_folder):
    assert _verify(case(), "--quiet") == 0
    text = (toy / "parameters.ssv").read_text()
    (toy / "parameters.ssv").write_text(text.replace('value="140"', 'value="160"'))
    assert _verify(case(), "--quiet") == 1


def test_start_only_needs_a_single_step(case, in_folder):
    text = CASE.replace('scenario = "toy.ssp"', 'runs = { run = { scenario = "toy.ssp", start_only = true } }')
    assert _verify(case(text), "--quiet") == 1
    (found,) = _data(in_folder)["cases"]
    assert found["runs"]["run"]["settings"]["stop"] == pytest.approx(0.001)
    assert "no figures in the interval of interest" in found["rows"][0]["remark"]


def test_an_interruption_leaves_the_finished_cases(case, in_folder):
    cases = load_cases([in_folder / "toy.toml" for _ in [case()]]) * 2
    shown = []

    class Interrupted(Runs):
        def get(self, case, name):
            if shown:
                raise InterruptedRunError("interrupted")
            return super().get(case, name)

    runs = Interrupted(in_folder / "v" / "runs", Runner(build=False))
    with pytest.raises(InterruptedRunError):
        verification_session.verify(cases, in_folder / "v", runs, shown.append)
    data = _data(in_folder)
    assert data["status"] == "interrupted"
    assert data["passed"] is False
    assert [c["name"] for c in data["cases"]] == ["toy"]
    text = (in_folder / "v" / "verify.html").read_text()
    assert "Not finished." in text
    assert "1 of 2 cases" in text
