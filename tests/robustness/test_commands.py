"""Wrong command lines of the three packages."""

from __future__ import annotations

import itertools
import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmus.__main__ import main as fmus
from master.commands.main import main as master
from models.commands.physics_main import main as models
from tests.robustness.support import PROFILE, TRIED, ask, assert_accepted, assert_quick, assert_refused, put_file

MAINS = {"master": master, "models": models, "fmus": fmus}
BAD_NUMBERS = ("", "x", "nan", "inf", "-inf", "1e999", "1,5", "0x10", "--", "٣x", "٣", "1_0", "9" * 500 + "x", "1 2")
NOT_POSITIVE = ("0", "-1", "-0.0", "-1e-300")
#: Options that take a number, with the command in front of them; positive ones refuse 0 and less as well.
FINITE = {
    "master": (["run", "none.ssp", "--stop"], ["run", "none.ssp", "--checkpoint"]),
    "models": (["couple", "LN2", "CX", "--start"], ["couple", "LN2", "CX", "--end"], ["pantograph", "CX", "--force"],
               ["pantograph", "CX", "--height"]),
}  # fmt: skip
POSITIVE = {
    "master": (["run", "none.ssp", "--step"], ["calibrate", "none.ssp", "--mean"], ["calibrate", "none.ssp",
    "--tolerance"]),
    "models": (["couple", "LN2", "CX", "--speed"], ["couple", "LN2", "CX", "--step"], ["statics", "LN2", "--speed"],
               ["statics", "LN2", "--force"]),
    "fmus": (["build", "Catenary_LN2", "--pantographs"],),
}  # fmt: skip


def bad_numbers():
    for options, bad in ((FINITE, BAD_NUMBERS), (POSITIVE, BAD_NUMBERS + NOT_POSITIVE)):
        for who, lists in options.items():
            yield from ((who, [*command, value]) for command, value in itertools.product(lists, bad))


@pytest.mark.parametrize("who", MAINS)
def test_numbers_that_are_none(who):
    found = [command for name, command in bad_numbers() if name == who]
    for command in found:
        TRIED["command line, number"] += 1
        assert_refused(ask(MAINS[who], *command), code=2)
    assert len(found) >= 12


#: Command lines that nobody can understand, and such as ask for what is not there.
WRONG = [
    ("master", []), ("master", ["run"]), ("master", ["none.ssp", "--wrong"]), ("master", ["validate"]),
    ("master", ["validate", "a", "b"]), ("master", ["run", "none.ssp", "--scheme", "magic"]), ("master", ["compare"]),
    ("master", ["compare", "one"]), ("master", ["report"]), ("master", ["study", "--only"]),
    ("master", ["run", "x", "--set"]), ("master", ["run", "x", "--set", "a.b"]),
    ("master", ["run", "x", "--set", "=1"]), ("master", ["run", "x", "--set", "a.b="]),
    ("master", ["report", "x", "--contact", "one"]), ("master", ["run", "x", "--out"]), ("master", ["study"]),
    ("master", ["report", "x", "--magnify", "much"]), ("models", []), ("models", ["nothing"]),
    ("models", ["statics"]), ("models", ["statics", "LN2", "--span", "x"]), ("models", ["pantograph"]),
    ("models", ["pantograph", "CX", "--heights", "nan", "5"]), ("models", ["pantograph", "CX", "--heights", "5"]),
    ("models", ["couple", "LN2"]), ("models", ["identify"]), ("fmus", []), ("fmus", ["nothing"]),
    ("fmus", ["fingerprint"]), ("fmus", ["doctor"]), ("fmus", ["build", "Catenary_LN2", "--pantographs", "17"]),
    ("fmus", ["signal"]), ("fmus", ["signal", "x.csv", "--interpolation", "cubic"]),
    ("fmus", ["signal", "x.csv", "--rate"]),
]  # fmt: skip
IN_VAIN = [
    ("master", ["study", "none"]), ("models", ["statics", "none"]), ("models", ["statics", ""]),
    ("fmus", ["signal", "none.csv"]), ("fmus", ["signal", "none.csv", "--name", "a-b"]),
    ("models", ["statics", "../LN2"]), ("models", ["statics", "none.toml"]),
    ("models", ["statics", "LN2", "--span", "0"]), ("models", ["statics", "LN2", "--span", "1000"]),
    ("models", ["statics", "LN2", "--section", "0"]), ("models", ["statics", "LN2", "--section", "2"]),
    ("models", ["pantograph", "none"]), ("models", ["pantograph", "CX", "--heights", "5", "4"]),
    ("models", ["couple", "LN2", "none"]), ("models", ["couple", "LN2", "generic_multibody"]),
    ("models", ["couple", "LN2", "CX", "--step", "1"]), ("models", ["couple", "LN2", "CX", "--step", "1e-9"]),
    ("models", ["identify", "none.csv"]), ("fmus", ["build", "none"]), ("fmus", ["build", "Catenary_"]),
    ("fmus", ["build", "Catenary_../lines/LN2"]), ("fmus", ["build", "Pantograph_../pantographs/CX"]),
    ("fmus", ["build", "/etc/passwd"]), ("fmus", ["fingerprint", "Catenary_LN2_P0"]),
    ("fmus", ["fingerprint", "Catenary_LN2_P99"]), ("fmus", ["fingerprint", "Catenary_LN2_P²"]),
    ("fmus", ["fingerprint", "Catenary_LN2_P" + "9" * 500]), ("fmus", ["fingerprint", "x" * 500]),
    ("fmus", ["fingerprint", ""]),
]  # fmt: skip


@pytest.mark.parametrize(("who", "command"), WRONG, ids=[f"{i}" for i in range(len(WRONG))])
def test_wrong_command_lines(who, command):
    TRIED["command line, by hand"] += 1
    assert_refused(ask(MAINS[who], *command), code=2)


@pytest.mark.parametrize(("who", "command"), IN_VAIN, ids=[f"{i}" for i in range(len(IN_VAIN))])
def test_command_lines_that_ask_for_what_is_not_there(who, command):
    TRIED["command line, by hand"] += 1
    assert_refused(ask(MAINS[who], *command), code=2 if "" in command else 1)


MALFORMED = [
    "contact_wire.tension=1", "line", "line.", "line.contact_wire.tension", "line.contact_wire.tension=",
]  # fmt: skip
SETTINGS = [
    "line.contact_wire.tension=x", "line.contact_wire.tension=nan", "line.contact_wire.tension=inf",
    "line.contact_wire.tension=1e300", "line.contact_wire.tension=0", "line.contact_wire.tension=-1", "line.nix=1",
    "line.contact_wire.nix=1", "line.contact_wire=1", "line.sections[1]=1", "line.sections[0].x=1", "line.name=1",
    "line.sections[²].x=1", "line.sections[].x=1", "line.sections[" + "9" * 500 + "].x=1", "line.time_step=0",
    "line.time_step=1e-9", "line.time_step=1", "line.mesh.elements_between_droppers=2.5",
    "line.mesh.elements_between_droppers=0", "line.dynamics.highest_frequency=-1",
    "line.dynamics.highest_frequency=1", "line.damping.alpha=-1", "line.contact.exponent=0",
    "line." + "a." * 300 + "b=1",
]  # fmt: skip


@pytest.mark.parametrize("setting", MALFORMED, ids=range(len(MALFORMED)))
def test_settings_that_are_none(setting):
    TRIED["command line, --set"] += 1
    assert_refused(ask(models, "statics", "LN2", "--set", setting), code=2)


@pytest.mark.parametrize("setting", SETTINGS, ids=range(len(SETTINGS)))
def test_settings_that_cannot_be(setting):
    TRIED["command line, --set"] += 1
    assert_refused(ask(models, "statics", "LN2", "--set", setting))


MASTER_SETTINGS = [
    ("pantograph.static_force=nan", "is not finite"), ("pantograph.static_force=inf", "is not finite"),
    ("pantograph.static_force=x", "'x' is not a number"), ("pantograph.static_force=1e999", "is not finite"),
    ("pantograph.static_farce=1", "did you mean 'pantograph.static_force'"), ("x=1", "there is no parameter 'x'"),
    ("pantograph.A.x=1", "causality 'output'"), (".static_force=1", "there is no parameter"),
    ("pantograph.=1", "there is no parameter"), ("a" * 500 + "=1", "there is no parameter"),
]  # fmt: skip


@pytest.mark.parametrize(("setting", "said"), MASTER_SETTINGS, ids=range(len(MASTER_SETTINGS)))
def test_parameters_that_cannot_be(scenario, tmp_path, setting, said):
    TRIED["command line, --set"] += 1
    answer = ask(master, "run", scenario, "--set", setting, "--no-build", "--out", tmp_path / "out")
    assert_refused(answer, said)
    assert not (tmp_path / "out").exists()


WORDS = ["run", "validate", "pack", "compare", "report", "calibrate", "--step", "--stop", "--set", "--scheme", "--out",
         "--quiet", "--json", "--report", "--contact", "--measured", "--no-build", "jacobi", "0.001", "a.b=1",
         "none.ssp",
         "-x", "--", "", "-", "nan", "1e999", "\x1b[2J", "ä", "../..", "a" * 300, "statics", "couple", "LN2.toml",
         "--fix", "doctor", "fingerprint", "--pantographs", "--standalone", "%s%n", "\udcff"]  # fmt: skip


@pytest.mark.parametrize("who", MAINS)
@settings(PROFILE, max_examples=250)
@given(words=st.lists(st.sampled_from(WORDS), min_size=1, max_size=6))
def test_words_in_any_order(tmp_path_factory, who, words):
    """None of the files exists: whatever the words mean, nothing can come of them."""
    first = {"master": "validate", "models": "identify", "fmus": "fingerprint"}[who]
    TRIED["command line, words"] += 1
    command = words if words[0] in ("run", "validate", "pack", "compare", "report", "calibrate") else [first, *words]
    answer = ask(MAINS[who], *command)
    assert_quick(answer)
    assert answer.code == (2 if "usage: " in answer.err else 1), answer
    assert "error: " in answer.err


@pytest.mark.parametrize(
    ("stop", "step", "said"),
    [
        ("1", "1e-12", "makes 1e+12 steps"),
        ("1e300", "1", "makes 1e+300 steps"),
        ("1e308", "1e-308", "steps"),
        ("-5", "0.001", "must lie after start time"),
        ("0", "0.001", "must lie after start time"),
        ("0.5", "0.6", "must lie between 0 and 0.5 s"),
    ],
)
def test_times_that_no_run_can_have(scenario, tmp_path, stop, step, said):
    TRIED["command line, times"] += 1
    command = ["run", scenario, "--stop", stop, "--step", step, "--no-build", "--out", tmp_path / "out"]
    assert_refused(ask(master, *command), said)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("who", MAINS)
def test_help_is_no_error(who):
    assert_accepted(ask(MAINS[who], "--help"), f"python -m {who}")


def foreign(folder):
    """A folder that is somebody else's."""
    folder.mkdir()
    put_file(folder / "thesis.tex", "years of work")
    put_file(folder / "summary.json", json.dumps({"generator": "something else"}))
    return folder


def test_results_of_others_are_left_alone(scenario, tmp_path):
    folder = foreign(tmp_path / "out")
    before = {p: p.read_bytes() for p in folder.iterdir()}
    answer = ask(master, "run", scenario, "--out", folder, "--no-build", "--quiet")
    assert_refused(answer, "is left alone, choose another with --out")
    assert {p: p.read_bytes() for p in folder.iterdir()} == before


def test_a_file_in_the_place_of_the_results_is_left_alone(scenario, tmp_path):
    path = tmp_path / "out"
    put_file(path, "years of work")
    assert_refused(ask(master, "run", scenario, "--out", path, "--no-build", "--quiet"), "choose another with --out")
    assert path.read_text() == "years of work"
