"""The command line: exit codes and what is said."""

import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from master.commands import scenario_commands
from master.commands.main import main
from master.report import report_files
from master.report.charts.run_charts import file_charts
from master.results import run_results

ROOT = Path(__file__).parents[3]
SCENARIOS = ROOT / "ssp_scenarios"


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["run"],
        ["x.ssp", "--scheme", "magic"],
        ["x.ssp", "--step", "0"],
        ["x.ssp", "--step", "nan"],
        ["x.ssp", "--stop", "soon"],
        ["x.ssp", "--set", "nonsense"],
        ["x.ssp", "--wrong"],
        ["compare", "one"],
    ],
)
def test_wrong_command_lines_end_with_2(arguments, capsys):
    try:
        code = main(arguments)
    except SystemExit as stop:
        code = stop.code
    assert code == 2
    assert "error" in capsys.readouterr().err


def test_help_names_every_verb(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    out = capsys.readouterr().out
    assert all(verb in out for verb in ("run", "pack", "validate", "compare", "report", "calibrate"))


def test_run_says_figures_and_verdict_in_80_columns(toy, in_folder, capsys):
    assert main([str(toy), "--no-build"]) == 0
    out = capsys.readouterr().out
    assert max(len(line) for line in out.splitlines()) <= 80
    assert "EN 50367, AC, pantograph, 20-45 m, 180 km/h" in out
    assert "mean force [N]" in out
    assert "failed" in out  # 140 N are too many at 180 km/h
    assert "real-time factor" in out
    folder = in_folder / "results" / "toy"
    text = (folder / "report.html").read_text()
    assert "EN 50367" in text
    assert len(list(folder.glob("*.png"))) == 5
    assert not list(folder.glob("*.svg"))
    assert "Incomplete" not in text
    assert "static_force" in text
    assert "time in catenary" in text


def test_quiet_says_nothing(toy, in_folder, capsys):
    assert main(["run", str(toy), "--quiet", "--no-report", "--no-build", "--stop", "0.5", "--out", "r"]) == 0
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", "")
    assert not list((in_folder / "r").glob("*.png"))


def test_json_is_the_summary(toy, in_folder, capsys):
    assert main([str(toy), "--json", "--no-report", "--no-build"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["quality"][0]["mean"] > 100
    assert summary == json.loads((in_folder / "results/toy/summary.json").read_text())


def test_overrides_are_honoured(toy, in_folder):
    options = [
        "--stop",
        "0.6",
        "--step",
        "0.002",
        "--scheme",
        "gauss-seidel",
        "--set",
        "pantograph.static_force=90",
    ]
    assert main([str(toy), *options, "--quiet", "--no-report", "--no-build"]) == 0
    summary = run_results.read(in_folder / "results/toy").summary
    assert summary["steps"] == 300
    assert summary["settings"]["coupling"]["scheme"] == "gauss-seidel"
    assert summary["components"][1]["parameters"]["static_force"] == 90.0


@pytest.mark.parametrize(
    ("assignment", "text"),
    [
        ("pantograph.static_farce=1", "did you mean 'pantograph.static_force'"),
        ("pantograph.A.z=1", "causality 'output'"),
        ("pantograph.static_force=much", "'much' is not a number"),
        ("pantograph.static_force=inf", "is not finite"),
    ],
)
def test_parameters_that_cannot_be_set(toy, in_folder, capsys, assignment, text):
    assert main([str(toy), "--set", assignment, "--no-build"]) == 1
    assert text in " ".join(capsys.readouterr().err.split())
    assert not (in_folder / "results").exists()


def test_a_standalone_archive_holds_one_python_beside_the_fmus(toy, in_folder, monkeypatch):
    def write(folder):
        (folder / "lib").mkdir()
        (folder / "runtime.txt").write_text("format=1\n")
        (folder / "lib" / "libpython.so").write_bytes(b"library")

    monkeypatch.setattr(scenario_commands, "write_runtime", write)
    assert main(["pack", str(toy), "--out", "packed.ssp", "--no-build", "--standalone"]) == 0
    with zipfile.ZipFile("packed.ssp") as file:
        assert file.read("resources/runtime/lib/libpython.so") == b"library"
        assert "SystemStructure.ssd" in file.namelist()
    assert main(["validate", "packed.ssp", "--no-build"]) == 0


def test_why_an_archive_cannot_be_standalone_is_said(toy, in_folder, monkeypatch, capsys):
    def write(folder):
        raise ValueError("the Python in /usr has no shared library")

    monkeypatch.setattr(scenario_commands, "write_runtime", write)
    assert main(["pack", str(toy), "--out", "packed.ssp", "--no-build", "--standalone"]) == 1
    assert "cannot be standalone: the Python in /usr has no shared library" in capsys.readouterr().err
    assert not (in_folder / "packed.ssp").exists()


def test_a_packed_scenario_runs_like_its_folder(toy, in_folder):
    common = ["--quiet", "--no-report", "--no-build"]
    assert main(["pack", str(toy), "--out", "packed.ssp", "--no-build"]) == 0
    assert main([str(toy), "--out", "a", *common]) == 0
    assert main(["packed.ssp", "--out", "b", *common]) == 0
    assert (in_folder / "a/timeseries.csv").read_bytes() == (in_folder / "b/timeseries.csv").read_bytes()


def test_missing_scenario_and_missing_fmu(toy, in_folder, capsys):
    assert main(["none.ssp"]) == 1
    assert "there is no such folder" in capsys.readouterr().err
    (toy / "resources" / "ToyCatenary.fmu").unlink()
    assert main([str(toy)]) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "SystemStructure.ssd:6: component 'catenary': resources/ToyCatenary.fmu does not exist" in said


def test_an_fmu_that_is_none(toy, capsys):
    (toy / "resources" / "ToyCatenary.fmu").write_text("not a zip")
    assert main(["validate", str(toy), "--no-build"]) == 1
    assert "is not a readable FMU" in capsys.readouterr().err


def _only_for(path, *folders):
    """Leave an FMU binaries for these platforms only."""
    with zipfile.ZipFile(path) as file:
        members = {n: file.read(n) for n in file.namelist() if not n.startswith("binaries/")}
    members |= {f"binaries/{folder}/{path.stem}.x": b"" for folder in folders}
    with zipfile.ZipFile(path, "w") as file:
        for name, data in members.items():
            file.writestr(name, data)


@pytest.mark.parametrize(
    ("folders", "text"),
    [
        (["win64"], "holds binaries for win64 only; this machine needs one for "),
        (["darwin64", "win64"], "holds binaries for darwin64 and win64 only; "),
        ([], "holds no binaries; "),
    ],
)
def test_an_fmu_for_other_machines_is_found_without_a_run(toy, capsys, folders, text):
    _only_for(toy / "resources" / "ToyCatenary.fmu", *folders)
    assert main(["validate", str(toy), "--no-build"]) == 1
    assert f"component 'catenary': resources/ToyCatenary.fmu {text}" in capsys.readouterr().err


def _files(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_validate_writes_nothing_where_fmus_are_missing_or_stale(tmp_path, capsys):
    scenario = tmp_path / "cx_ln2.ssp"
    shutil.copytree(SCENARIOS / "cx_ln2.ssp", scenario, ignore=shutil.ignore_patterns("resources"))
    before = _files(tmp_path)
    assert main(["validate", str(scenario)]) == 0
    assert "cx_ln2: valid" in capsys.readouterr().out
    assert _files(tmp_path) == before
    assert not (scenario / "resources").exists()


def test_an_fmu_of_somebody_with_a_name_of_ours_is_kept(toy, capsys):
    """The scenario names Pantograph_CX, but what lies there is another model."""
    path = toy / "SystemStructure.ssd"
    path.write_text(path.read_text().replace("ToyPantograph.fmu", "Pantograph_CX.fmu"))
    theirs = (toy / "resources" / "ToyPantograph.fmu").rename(toy / "resources" / "Pantograph_CX.fmu")
    before = theirs.read_bytes()
    for command in (["validate", str(toy)], ["pack", str(toy), "--out", str(toy.parent / "x.ssp")]):
        assert main(command) == 0
        said = capsys.readouterr()
        assert "Pantograph_CX.fmu is used as it is: it was not built by this project" in said.out + said.err
        assert theirs.read_bytes() == before


def test_validate_lists_all_problems_with_lines(toy, capsys):
    path = toy / "SystemStructure.ssd"
    text = (
        path.read_text()
        .replace('startConnector="A.x"', 'startConnector="A.q"')
        .replace('stopTime="1.0"', 'stopTime="-1"')
    )
    path.write_text(text)
    assert main(["validate", str(toy), "--no-build"]) == 1
    said = capsys.readouterr().err
    line = text[: text.index('startConnector="A.q"')].count("\n") + 1
    assert f"SystemStructure.ssd:{line}: component 'pantograph' declares no connector 'A.q'" in said
    assert "stop time -1 s must lie after start time 0 s" in said


def test_validate_accepts(toy, capsys):
    assert main(["validate", str(toy), "--no-build"]) == 0
    assert "toy: valid; 2 components, 16 connections" in capsys.readouterr().out


def test_results_may_not_lie_in_the_scenario(toy, capsys):
    assert main([str(toy), "--out", str(toy / "results"), "--no-build"]) == 1
    assert main([str(toy), "--out", str(toy.parent), "--no-build"]) == 1
    assert "lie inside each other" in capsys.readouterr().err


def test_compare_shows_the_difference(toy, in_folder, capsys):
    common = ["--quiet", "--no-report", "--no-build"]
    main([str(toy), "--out", "a", *common])
    main([str(toy), "--out", "b", "--set", "pantograph.static_force=150", *common])
    capsys.readouterr()
    assert main(["compare", "a", "b"]) == 0
    assert "differ by" in capsys.readouterr().out
    assert main(["compare", "a", "b", "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    assert found["difference"]["mean"] == pytest.approx(10.0, abs=1.0)
    assert found["rms"] >= abs(found["difference"]["mean"]) - 1e-9  # Jensen
    assert main(["compare", "a", "a", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["rms"] == 0.0


def test_compare_needs_results(in_folder, capsys):
    assert main(["compare", ".", "."]) == 1
    assert "is not a results folder" in capsys.readouterr().err


def test_report_is_written_again(toy, in_folder, capsys):
    main([str(toy), "--out", "a", "--quiet", "--no-report", "--no-build"])
    assert main(["report", "a"]) == 0
    assert (in_folder / "a/report.html").is_file()
    assert (in_folder / "a/contact_force.png").is_file()


def test_charts_are_written_in_the_formats_that_are_asked_for_or_already_there(toy, in_folder, capsys, monkeypatch):
    monkeypatch.setattr(report_files, "file_charts", lambda done: {"uplift": file_charts(done)["uplift"]})
    main([str(toy), "--out", "a", "--quiet", "--no-build", "--figures", "svg"])
    assert not list((in_folder / "a").glob("*.png"))
    drawn = in_folder / "a/uplift.svg"
    before = drawn.read_bytes()
    assert b"</svg>" in before
    drawn.write_text("old")
    assert main(["report", "a"]) == 0  # none that is older than the report
    assert drawn.read_bytes() == before
    assert not list((in_folder / "a").glob("*.png"))
    assert main(["report", "a", "--figures", "png"]) == 0
    assert [p.name for p in sorted((in_folder / "a").glob("*.[ps][nv]g"))] == ["uplift.png", "uplift.svg"]
    assert main([str(toy), "--no-report", "--figures", "svg", "--no-build"]) == 2
    assert "--no-report leaves out" in capsys.readouterr().err


def test_report_with_a_measurement_a_film_and_parquet(toy, in_folder, capsys, monkeypatch):
    monkeypatch.setattr("master.report.film_file._RATE", 4)  # few frames: what they show is tested where they are made
    main([str(toy), "--out", "a", "--quiet", "--no-report", "--no-build"])
    Path("m.csv").write_text("position [m],force [N]\n" + "".join(f"{x},{140 + x % 3}\n" for x in range(15, 48)))
    pytest.importorskip("pyarrow", reason="Parquet needs pyarrow")
    assert main(["report", "a", "--measured", "m.csv", "--film", "film.gif", "--parquet"]) == 0
    out = capsys.readouterr().out
    assert "correlation" in out
    assert "Measured and simulated" in (in_folder / "a/report.html").read_text()
    assert (in_folder / "film.gif").stat().st_size > 1000
    assert main(["report", "a", "--measured", "m.csv", "--contact", "7"]) == 1
    assert "no contact 7" in capsys.readouterr().err


def test_parquet_holds_the_columns_of_the_csv(toy, in_folder):
    parquet = pytest.importorskip("pyarrow.parquet", reason="Parquet needs pyarrow")
    assert main([str(toy), "--out", "a", "--quiet", "--no-report", "--no-build", "--parquet"]) == 0
    for name in ("timeseries", "timeseries_5ms"):
        table = parquet.read_table(in_folder / f"a/{name}.parquet")
        lines = (in_folder / f"a/{name}.csv").read_text().splitlines()
        assert table.column_names == lines[0].split(",")
        assert table.num_rows == len(lines) - 1
    assert main([str(toy), "--out", "a", "--quiet", "--no-report", "--no-build"]) == 0
    assert not list((in_folder / "a").glob("*.parquet"))


def test_compare_writes_a_report_of_several_runs(toy, in_folder, capsys):
    common = ["--quiet", "--no-report", "--no-build"]
    for name, force in (("a", 130), ("b", 140), ("c", 150)):
        main([str(toy), "--out", name, "--set", f"pantograph.static_force={force}", *common])
    assert main(["compare", "a", "b", "c", "--report", "side.html"]) == 0
    out = capsys.readouterr().out
    assert max(len(line) for line in out.splitlines()) <= 80
    assert out.count("differ by") == 2
    page = (in_folder / "side.html").read_text()
    assert page.count("class='tiles'") == 3
    assert "pantograph.static_force" in page


def test_a_failed_run_leaves_a_report_marked_incomplete(toy, in_folder, capsys):
    assert main([str(toy), "--out", "a", "--set", "catenary.fail_at=0.5", "--quiet", "--no-build"]) == 1
    page = (in_folder / "a/report.html").read_text()
    assert "<b>Incomplete.</b> This run failed at t = 0.5 s of 1 s." in page
    assert "the wire broke" in page
    assert "id='chart-force_catenary_1'" in page
    assert main([str(toy), "--out", "b", "--set", "catenary.fail_at=0.5", "--quiet", "--no-build", "--no-report"]) == 1
    assert not (in_folder / "b/report.html").exists()


def test_calibrate_stores_what_it_finds(toy, in_folder, capsys):
    before = (toy / "parameters.ssv").read_text()
    options = ["--parameter", "pantograph.static_force", "--mean", "120", "--no-build"]
    assert main(["calibrate", str(toy), *options, "--dry-run"]) == 0
    assert "stored" not in capsys.readouterr().out
    assert main(["calibrate", str(toy), *options, "--set", "catenary.stiffness=5500"]) == 0
    assert "not stored: it is for the values of --set" in capsys.readouterr().out
    assert (toy / "parameters.ssv").read_text() == before
    assert main(["calibrate", str(toy), *options]) == 0
    after = (toy / "parameters.ssv").read_text()
    assert "<!-- kept as it is -->" in after
    assert "<!-- calibrated: mean force 1" in after
    assert main([str(toy), "--quiet", "--no-report", "--no-build", "--out", "r"]) == 0
    assert run_results.read(in_folder / "r").assessments()[0].quality.mean == pytest.approx(120.0, abs=0.1)


def test_calibrate_without_a_target(toy, capsys):
    assert main(["calibrate", str(toy), "--no-build"]) == 1
    assert "give --parameter and --mean" in capsys.readouterr().err


def test_no_traceback_from_the_module(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "master", str(tmp_path)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert done.stderr.startswith("error: ")
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("file", "text"),
    [("geometry.json", '{"catenary": 1}'), ("geometry.json", "["), ("summary.json", '{"generator": "openpanto master", '
      '"contacts": 1}'), ("timeseries.csv", "time [s],a\n1,0\n0,0\n")],
)  # fmt: skip
def test_damaged_results_are_told_in_a_sentence(toy, in_folder, capfd, file, text):
    run = ["run", str(toy), "--no-build", "--no-report", "--quiet"]
    for name in "ab":
        assert main([*run, "--out", name]) == 0
    assert main(["compare", "a", "b"]) == 0
    (in_folder / "b" / file).write_text(text)
    capfd.readouterr()
    assert main(["compare", "a", "b"]) == 1
    said = capfd.readouterr().err
    assert said.startswith("error: ")
    assert file in said
    assert said.count("\n") == 1
