"""The names that `master` and `models` hand out to Python: what they promise, and in which words they refuse."""

from __future__ import annotations

import ast
import builtins
import dataclasses
import json
import os
import pickle
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import master
import models
from master.interface import parameter_sweeps
from tests.master.conftest import SSV, ssd_text, toy_fmus  # noqa: F401 (a fixture)

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))

USER_SCRIPT = """
from pathlib import Path

from master import MasterError, Results, Scenario, calibrate, compare, open_scenario, optimise, read_results, run, sweep
from models import Line, couple, in_wind, open_line, open_pantograph, over_temperature, span_table, statics


def mean(results: Results) -> float:
    return results.figures_of(1)["mean force [N]"]


scenario: Scenario = open_scenario("cx_ln2", stop="5 s", scheme="jacobi").set(static_force=160)
scenario = scenario.set({"catenary.contact_wire.tension": "22 kN"}, speed="300 km/h")
try:
    results = run(scenario, Path("out"), report=True)
except MasterError as error:
    print(error)
else:
    print(mean(results) + 1.0, results.verdict.upper(), results.passed is None)
    print(results.frame("*.force").describe(), results.contact_force(1).head())
    print(compare(results, read_results("other")), calibrate(scenario, mean=150.0).value + 1.0)
table = sweep(scenario, over={"speed": "280:300:20", "catenary.contact_wire.tension": ["20 kN"]}, jobs=2).table
print(table.head())
found = optimise(scenario, minimise="sigma", vary={"static_force": "100:200 N"}, subject_to=["maximum<=350 N"])
print(found.best["static_force [N]"] + 1.0, found.at_bounds, found.table.head(), sweep(scenario).sensitivity.head())
line: Line = open_line("LN2").set({"contact_wire.tension": 22e3})
print(statics(line, span=3).elasticity.maximum + 1.0, line.spans[0].length + 1.0)
rest = statics(line, section=1)
blown = in_wind(rest, speed="29 m/s", head=1600)
print(blown.offset.max() + 1.0, blown.frame().head(), rest.judgements[0].source.upper(), rest.verdicts[0][1].upper())
print(over_temperature(rest, ["-20 degC", 288.15]).frame("tension").head())
print(span_table(line, pressure=961.0, limit="0.4 m", radii=[800], staggers=[(0.2, "-20 cm")]).smallest_radius.min())
run_of = couple(line, open_pantograph("CX").set(static_force="160 N"), speed=83.3)
print(run_of.force.max(), run_of.warnings[0].upper())
"""


@pytest.fixture(scope="module")
def toy_run(toy_fmus, tmp_path_factory):  # noqa: F811
    """A toy scenario and the results of its run."""
    folder = tmp_path_factory.mktemp("interface") / "toy.ssp"
    (folder / "resources").mkdir(parents=True)
    for path in toy_fmus.glob("*.fmu"):
        shutil.copy(path, folder / "resources")
    (folder / "SystemStructure.ssd").write_text(ssd_text())
    (folder / "parameters.ssv").write_text(SSV)
    scenario = master.open_scenario(folder)
    return scenario, master.run(scenario, folder.parent / "out")


def test_every_name_is_there_and_shown():
    for package in (master, models):
        assert set(package.__all__) <= set(dir(package))
        for name in package.__all__:
            assert getattr(package, name).__doc__
        with pytest.raises(AttributeError, match=f"module '{package.__name__}' has no attribute 'open_sesame'; it has"):
            package.open_sesame  # noqa: B018


@pytest.mark.parametrize("package", [master, models], ids=lambda p: p.__name__)
def test_what_a_type_checker_sees_is_what_is_handed_out(package):
    """The imports for type checkers and the table for the interpreter name the same things in the same places."""
    tree = ast.parse(Path(package.__file__).read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If) and isinstance(node.test, ast.Name))
    seen = {node.module: tuple(a.name for a in node.names) for node in block.body if isinstance(node, ast.ImportFrom)}
    assert seen == {f"{package.__name__}.{place}": names for place, names in package._PLACES.items()}
    assert sorted(name for names in seen.values() for name in names) == package.__all__


@pytest.mark.parametrize("package", ["master", "models"])
def test_importing_a_package_imports_nothing_else(package):
    code = f"import {package}, sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-S", "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert not {name for name in loaded if name.startswith((f"{package}.", "numpy", "pandas", "lxml"))}


@pytest.mark.long  # a step of `.ci/run`
def test_a_users_script_passes_a_strict_type_checker(tmp_path):
    pytest.importorskip("mypy", reason="the extra 'dev' is not installed")
    good, bad = tmp_path / "good.py", tmp_path / "bad.py"
    good.write_text(USER_SCRIPT)
    bad.write_text(USER_SCRIPT.replace("results.verdict", "results.verdikt").replace("open_pantograph,", "opened,"))
    found = type_errors(good, bad)
    assert all("bad.py:" in line for line in found)
    assert len([line for line in found if "verdikt" in line or "opened" in line]) == 2


def type_errors(*scripts: Path) -> list[str]:
    options = [
        "--strict",
        "--follow-imports=silent",
        "--config-file=",
        f"--cache-dir={os.devnull}",
        "--no-error-summary",
    ]
    command = [
        sys.executable,
        "-m",
        "mypy",
        *options,
        "--no-error-summary",
        "--ignore-missing-imports",
        *map(str, scripts),
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode in (0, 1), done.stderr
    return done.stdout.splitlines()


# A scenario, its run and results.


def test_values_are_numbers_or_texts_with_units(toy_run):
    scenario, _ = toy_run
    assert scenario.parameters["pantograph.static_force"].value == 140.0
    assert scenario.parameters["pantograph.static_force"].is_set
    assert not scenario.parameters["pantograph.speed"].is_set
    for value in (160, 160.0, np.float64(160.0), np.int64(160), "160"):
        changed = scenario.set(static_force=value)
        assert changed.parameters["pantograph.static_force"].value == 160.0
    assert scenario.parameters["pantograph.static_force"].value == 140.0
    both = scenario.set({"catenary.stiffness": 4e3}).set(static_force=1.0 / 3.0)
    assert both.parameters["catenary.stiffness"].value == 4e3
    assert both.parameters["pantograph.static_force"].value == 1.0 / 3.0


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"pantograph.static_forc": 1}, "did you mean 'pantograph.static_force'"),
        ({"static_forc": 1}, "there is no parameter 'static_forc' in the scenario"),
        ({"pantograph.static_force": "much"}, "'much' is not a number"),
        ({"pantograph.static_force": float("nan")}, "pantograph.static_force"),
        ({"pantograph.static_force": [1]}, "give a number, a text or True or False, not a list"),
        ({"pantograph.static_force": "1 parsec"}, "parsec"),
        ({3: 1.0}, "set: 3 is not the name of a parameter"),
    ],
)
def test_wrong_values_are_refused_at_once(toy_run, values, said):
    with pytest.raises(master.MasterError) as caught:
        toy_run[0].set(values)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_short_names_must_be_of_one_parameter(toy_run):
    scenario = toy_run[0]
    with pytest.raises(master.MasterError, match=r"'pantograph\.static_force' is given twice"):
        scenario.set({"pantograph.static_force": 120.0}, static_force=130.0)
    fmu = scenario.system.components[0].fmu
    wires = ("contact_wire.tension", "messenger_wire.tension")
    variables = {n: replace(fmu.variables["stiffness"], name=n) for n in (*wires, "damping")}
    line = replace(scenario.system.components[0], fmu=replace(fmu, variables={**fmu.variables, **variables}))
    system = replace(scenario.system, components=(line, *scenario.system.components[1:]))
    with pytest.raises(master.MasterError, match=r"are catenary\.contact_wire\.tension, catenary\.mess"):
        replace(scenario, system=system).set(tension=2e4)
    with pytest.raises(master.MasterError, match="catenary and pantograph have a parameter 'damping'"):
        replace(scenario, system=system).set(damping=1.0)


def test_changed_values_reach_the_run_and_the_figures_are_those_of_the_folder(toy_run, tmp_path):
    scenario, results = toy_run
    stiff = master.run(scenario.set(static_force="170"), tmp_path / "stiff")
    difference = stiff.figures_of()["mean force [N]"] - results.figures_of()["mean force [N]"]
    assert difference == pytest.approx(30.0, abs=1.5)
    reported = json.loads((stiff.folder / "summary.json").read_text())["quality"][0]
    assert stiff.figures_of()["mean force [N]"] == reported["mean"]
    assert master.read_results(tmp_path / "stiff").figures_of() == pytest.approx(stiff.figures_of(), nan_ok=True)
    assert stiff.status == "complete"
    assert stiff.pantographs == ("pantograph",)
    assert stiff.interval == (20.0, 45.0)


def test_frames_have_units_in_their_titles(toy_run):
    pytest.importorskip("pandas")
    results = toy_run[1]
    force = results.contact_force()
    assert force.index.name == "time [s]"
    assert list(force.columns) == ["track_position [m]", "force [N]", "filtered_force [N]", "in_interval"]
    inside = force.loc[force["in_interval"], "filtered_force [N]"]
    column = results.figures["pantograph"]
    assert inside.mean() == pytest.approx(column["mean force [N]"], rel=1e-12)
    assert inside.std(ddof=0) == pytest.approx(column["standard deviation [N]"], rel=1e-12)
    raw = results.frame("*.contact.force")
    assert len(raw) == len(force)
    assert "catenary.pantograph[1].contact.force" in raw  # the toy declares no unit
    assert "catenary.pantograph[1].contact.force" in results.variables
    assert set(results.criteria["verdict"]) <= {"passed", "failed", "at the limit"}
    assert list(results.geometry("support").columns[:1]) == ["x [m]"]
    assert len(results.geometry("dropper")) == len(results.uplifts) == 3
    assert "uplift [m]" in results.uplifts
    assert "duration [s]" in results.events
    assert "mean [N]" in results.spans


def test_variables_are_found_by_their_unit_and_others_are_answered_by_their_likes(toy_run):
    pytest.importorskip("pandas")
    recording = toy_run[1].stored.recordings[0]
    units = tuple("N" if n.endswith(".force") else "m" for n in recording.names)
    stored = dataclasses.replace(toy_run[1].stored, recordings=(dataclasses.replace(recording, units=units),))
    results = master.Results(stored)
    forces = [name for name in recording.names if name.endswith(".force")]
    assert forces
    assert list(results.frame("*[N]")) == list(results.frame("*[N]", "nothing")) == [f"{name} [N]" for name in forces]
    assert list(results.frame("*contact.force [N]")) == [f"{n} [N]" for n in forces if n.endswith("contact.force")]
    with pytest.raises(master.MasterError, match=r"units are \[N\], \[m\].* lists them all"):
        results.frame("*[kN]")
    with pytest.raises(master.MasterError, match=r"did you mean .*contact\.force"):
        results.frame("catenary.pantograph[1].contact.forse")


def test_what_is_no_scenario_and_no_value_is_one_sentence(toy_run):
    with pytest.raises(master.MasterError, match=r"^open_scenario\(None\): give the path"):
        master.open_scenario(None)
    with pytest.raises(master.MasterError, match=r"^open_scenario\(''\): give the path"):
        master.open_scenario("")
    with pytest.raises(master.MasterError, match=r"^set\('static_force=120'\) says no parameter with its value: write"):
        toy_run[0].set("static_force=120")


def test_a_report_names_what_was_changed_of_its_scenario(toy_run, tmp_path):
    changed = master.run(toy_run[0].set(static_force="160"), tmp_path / "changed")
    changed.write_report()
    head = (tmp_path / "changed" / "report.html").read_text(encoding="utf-8").split("</h1>")[1].split("</p>")[0]
    assert "with pantograph.static_force = 160" in head
    assert "changes" not in toy_run[1].stored.summary


def test_scenario_and_results_travel_between_processes(toy_run):
    scenario, results = (pickle.loads(pickle.dumps(each)) for each in toy_run)
    assert scenario.parameters == toy_run[0].parameters
    assert results.figures_of() == pytest.approx(toy_run[1].figures_of(), nan_ok=True)


def test_a_run_of_the_command_and_one_from_python_are_the_same(toy_run, tmp_path):
    from master.commands.main import main

    arguments = [str(toy_run[0].path), "--quiet", "--no-report", "--set", "pantograph.static_force=160"]
    assert main([*arguments, "--out", str(tmp_path / "command")]) == 0
    own = master.run(toy_run[0].set(static_force=160), tmp_path / "python")
    for name in ("timeseries.csv", "contact_force.csv"):
        assert (own.folder / name).read_bytes() == (tmp_path / "command" / name).read_bytes()


def test_verdict_and_words(toy_run):
    results = toy_run[1]
    assert results.passed is (results.verdict == "passed")
    assert "toy" in repr(results)
    assert results.verdict in repr(results)
    assert (
        "not judged" in master.run(master.open_scenario(toy_run[0].path, stop=0.1), results.folder.parent / "t").verdict
    )


def test_figure_and_report(toy_run, tmp_path):
    results = toy_run[1]
    results.force_figure(1).savefig(tmp_path / "force.png")
    assert (tmp_path / "force.png").stat().st_size > 5000
    assert results.write_report().name == "report.html"


def test_runs_side_by_side(toy_run, tmp_path):
    pytest.importorskip("pandas")
    scenario, results = toy_run
    other = master.run(scenario.set(ripple=0.0), tmp_path / "smooth")
    frame = master.compare(results, other)
    assert list(frame.columns) == ["out", "smooth"]
    assert master.compare(results.folder, tmp_path / "smooth").equals(frame)
    assert frame.loc["standard deviation [N]", "smooth"] < frame.loc["standard deviation [N]", "out"]
    assert frame.attrs["notes"] == ()
    with pytest.raises(master.MasterError, match="nothing to compare"):
        master.compare(results)
    with pytest.raises(master.MasterError, match="nothing to compare: give the results of two runs"):
        master.compare()


def test_calibration_returns_a_scenario_and_stores_nothing(toy_run):
    scenario, _ = toy_run
    with pytest.raises(master.MasterError, match="out: 3 is not the path of a results folder"):
        master.run(scenario, 3)
    before = (scenario.path / "parameters.ssv").read_bytes()
    found = master.calibrate(scenario, parameter="pantograph.static_force", mean=150.0)
    assert found.mean_force == pytest.approx(150.0, abs=0.1)
    assert found.scenario.parameters["pantograph.static_force"].value == found.value
    assert len(found.trials) >= 2
    assert (scenario.path / "parameters.ssv").read_bytes() == before
    with pytest.raises(master.MasterError, match="does not say what to calibrate"):
        master.calibrate(scenario)


def test_figures_of_a_foreign_record_are_those_of_the_run(toy_run):
    pytest.importorskip("pandas")
    results = toy_run[1]
    force = results.contact_force()
    found = master.contact_figures(force["track_position [m]"], force["force [N]"], 0.001, interval=(20.0, 45.0))
    own = results.figures_of()
    assert {name: own[name] for name in found if "contact" not in name} == pytest.approx(
        {name: value for name, value in found.items() if "contact" not in name}, rel=1e-9
    )


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda r: r.frame("*.nothing"), "no recorded variable is named '*.nothing'"),
        (lambda r: r.frame(every=3.0), "nothing is recorded every 3 s; there are recordings of every 0.001 s"),
        (lambda r: r.contact_force(2), "no contact 2"),
        (lambda r: r.figures_of(2), "contact 2 has no figures: the run has contacts 1 (pantograph)"),
        (lambda r: r.geometry("mast"), "no geometry of 'mast' for the line; known: support, dropper"),
        (lambda _: master.open_scenario("x.ssp", stop="5 m"), "stop: '5 m' is not a time"),
        (lambda _: master.contact_figures([0, 1], [1, 2, 3], 0.1), "equally long rows"),
        (lambda _: master.contact_figures([0, 1], [1, 2], 0.1), "cutoff 20 Hz"),
        (lambda _: master.contact_figures([0, 1], [1, 2], [0, 1]), "step must be one number"),
        (lambda _: master.contact_figures([0, 1], [1, 2], 0.001), "fewer than two samples"),
        (lambda _: master.read_results("nowhere"), "is not a results folder"),
        # What is of another type than it should be is a sentence as well.
        (lambda _: master.contact_figures("a", "b", 0.1), "position and force must be rows of numbers"),
        (lambda _: master.contact_figures([0, 1], [1, 2], "0.1"), "step must be one number"),
        (lambda _: master.read_results(None), "read_results(None): give the path of a results folder"),
        (lambda r: r.frame(3), "frame(3): names are texts"),
        (lambda r: master.compare([r, r]), "compare: a list is neither results nor a results folder"),
        (lambda _: master.compare("nowhere", "nowhere"), "nowhere is not a results folder"),
    ],
)
def test_what_is_not_there_is_said_in_a_sentence(toy_run, ask, said):
    with pytest.raises(master.MasterError) as caught:
        ask(toy_run[1])
    assert said in str(caught.value)


def test_without_pandas_one_sentence_says_what_to_install(toy_run, monkeypatch):
    original = builtins.__import__

    def refuse(name, *rest, **options):
        if name == "pandas":
            raise ImportError(name)
        return original(name, *rest, **options)

    monkeypatch.setattr(builtins, "__import__", refuse)
    assert toy_run[1].figures_of()["mean force [N]"] > 0.0
    for ask in (
        lambda: toy_run[1].figures,
        lambda: toy_run[1].contact_force(),
        lambda: models.statics("CA160").frame("droppers"),
    ):
        with pytest.raises((master.MasterError, ImportError)) as caught:
            ask()
        assert str(caught.value) == "data frames need pandas: pip install 'openpanto[pandas]'"


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ("200:300:10", "200:300:10"),
        (["18 kN", 20], "18 kN,20"),
        (range(1, 4), "1,2,3"),
        (np.arange(2), "0,1"),
        (np.array([0.1, 2.0]), "0.1,2.0"),
        ([True, False], "true,false"),
    ],
)
def test_values_of_a_grid_are_written_as_on_the_command_line(values, text):
    assert parameter_sweeps._listed("x", values) == text


def test_what_is_given_by_parameter_is_a_mapping(toy_run):
    for ask in (
        lambda: master.sweep(toy_run[0], over="speed=40"),
        lambda: master.optimise(toy_run[0], minimise="sigma", vary="speed=40:50"),
    ):
        with pytest.raises(master.MasterError, match=r"'speed=40.*' is not a mapping, such as"):
            ask()


@pytest.mark.parametrize("values", [200, [None], [[1, 2]]])
def test_values_that_are_no_list_are_one_sentence(values):
    with pytest.raises(master.MasterError, match=r"x: .* is neither a text nor a list of numbers or texts"):
        parameter_sweeps._listed("x", values)


# A line and a pantograph.


def test_definitions_by_name_and_path(tmp_path):
    line = models.open_line("LN2")
    file = tmp_path / "mine.toml"
    file.write_text((ROOT / "models/library/lines/LN2.toml").read_text(encoding="utf-8"), encoding="utf-8")
    assert models.open_line(file).parameters == line.parameters
    assert "LN2" in models.line_names()
    assert "CX" in models.pantograph_names()
    assert line.set({"contact_wire.tension": "22 kN"}).parameters["contact_wire.tension"].value == 22e3
    assert models.open_pantograph("CX").set(static_force=160).parameters["static_force"].value == 160.0
    assert not models.open_pantograph("generic_multibody").is_lumped
    assert "LN2" in repr(line)


@pytest.mark.parametrize(
    ("ask", "kind", "said"),
    [
        (lambda: models.open_line("LN9"), models.UnknownNameError, "LN9"),
        (lambda: models.open_line("LN2").set({"contact_wire.tension": "22 kg"}), models.ParameterError, "give it in N"),
        (lambda: models.open_line("LN2").set({"contact_wire.tensio": 1.0}), models.ParameterError, "tensio"),
        (
            lambda: models.open_line("LN2").set({"contact_wire.tension": [1]}),
            models.ParameterError,
            "contact_wire.tension = [1]: this is neither a number nor a text",
        ),
        (lambda: models.statics("LN2", span=99), models.ParameterError, "span 99: the line has spans 1 to"),
        (lambda: models.statics("LN2", section=2), models.ParameterError, "section 2: the line has sections 1 to 1"),
        (lambda: models.statics("LN2", speed=300), models.ParameterError, "'300 km/h'"),
        (lambda: models.statics("LN2", force="-5 N"), models.ParameterError, "greater than 0 N"),
        (lambda: models.couple("LN2", "generic_multibody"), models.ParameterError, "couple needs a lumped one"),
        (lambda: models.couple("LN2", "CX", step=1.0), models.ParameterError, "must lie between"),
        (lambda: models.couple("CA160", "CX", start=1e6), models.ParameterError, "does not lie on the line"),
        (lambda: models.couple("CA160", "CX", start=300, end=200), models.ParameterError, "ends before it begins"),
    ],
)
def test_what_cannot_be_meant_is_said_in_a_sentence(ask, kind, said):
    with pytest.raises(kind) as caught:
        ask()
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_name_that_two_definitions_have_is_told(tmp_path, monkeypatch):
    (tmp_path / "pantographs").mkdir()
    copy = shutil.copy(ROOT / "models" / "library" / "pantographs" / "CX.toml", tmp_path / "pantographs")
    monkeypatch.setenv("OPENPANTO_LIBRARY", str(tmp_path))
    with pytest.warns(UserWarning, match="two definitions are named 'CX'") as told:
        models.open_pantograph("CX")
    assert str(copy) in str(told[0].message)
    assert told[0].filename == __file__


def test_statics_follow_the_tension():
    pytest.importorskip("pandas")
    line = models.open_line("LN2")
    soft, stiff = (models.statics(line.set({"contact_wire.tension": t}), span=12) for t in ("16 kN", "24 kN"))
    assert soft.elasticity.maximum > stiff.elasticity.maximum
    assert stiff.waves.speed > soft.waves.speed
    droppers = stiff.frame("droppers")
    assert list(droppers.columns) == ["x [m]", "unstrained length [m]", "tension [N]", "hanger"]
    assert len(droppers) == sum(len(span.droppers) for span in line.spans)
    assert {"contact_wire", "messenger_wire", "elasticity", "steady_arms"} <= set(stiff.tables)
    with pytest.raises(models.ParameterError, match="there is no table 'poles'; there are droppers"):
        stiff.frame("poles")


@pytest.mark.slow
def test_a_coupled_run_is_that_of_the_command(tmp_path):
    pandas = pytest.importorskip("pandas")
    from models.commands.physics_main import main

    found = models.couple("LN2", "CX", start=500.0, end=600.0)
    options = ["--start", "500", "--end", "600", "--quiet", "--out", str(tmp_path)]
    assert main(["couple", "LN2", "CX", "--speed", "300", *options]) == 0
    written = pandas.read_csv(tmp_path / "timeseries.csv", index_col="time [s]")
    frame = found.frame()
    assert frame["force [N]"].to_numpy() == pytest.approx(
        written["catenary.pantograph[1].contact.force [N]"].to_numpy()
    )
    assert found.uplift_frame().shape[0] == len(found.time) == len(written)
    figures = master.contact_figures(found.position, found.force, found.step, interval=(590.0, 600.0))
    assert figures["mean force [N]"] > 0.0


# Documentation.


def code_of(notebook: Path) -> list[str]:
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return ["".join(c["source"]) for c in cells if c["cell_type"] == "code"]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebooks_are_kept_without_outputs_and_use_names_that_exist(notebook):
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    assert not any(c.get("outputs") or c.get("execution_count") for c in cells)
    for text in code_of(notebook):
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and node.module in ("master", "models"):
                package = {"master": master, "models": models}[node.module]
                assert {a.name for a in node.names} <= set(package.__all__)


@pytest.mark.long
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebooks_run(notebook, tmp_path):
    """Cell after cell, in a process and an empty folder of the notebook's own."""
    pytest.importorskip("pandas")
    script = tmp_path / "cells.py"
    script.write_text("\n\n".join(code_of(notebook)), encoding="utf-8")
    code = f"import sys, runpy; sys.path.insert(0, {str(ROOT)!r}); runpy.run_path({str(script)!r})"
    command = [sys.executable, "-c", code]
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr[-3000:]


def test_samples_of_the_documentation_use_names_that_exist():
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    found = [m for page in pages for m in re.findall(r"from (master|models) import ([^\n(]+)", page.read_text("utf-8"))]
    assert found
    for package, names in found:
        assert {n.strip() for n in names.split(",")} <= set({"master": master, "models": models}[package].__all__)
