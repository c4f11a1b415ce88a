"""Inputs that cannot be meant: each ends before the run or at its first second, with exit code 1 and one sentence.

Every mistake stands with what its sentence must say, the cure among it.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from fmus.builder.fmu_build import build
from fmus.builder.recipe import recipe
from master.commands.main import main as master
from models.commands.physics_main import main as models
from tests.effort import rest
from tests.robustness.support import TRIED, ask, assert_lines, put_file

ROOT = Path(__file__).parents[2]
SCENARIO = ROOT / "ssp_scenarios" / "en50318_2002_300.ssp"


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    """A reference scenario with its FMUs, which nobody builds again."""
    folder = tmp_path_factory.mktemp("mistakes") / SCENARIO.name
    shutil.copytree(SCENARIO, folder, ignore=shutil.ignore_patterns("resources"))
    for name in ("Catenary_EN50318_2002", "Pantograph_EN50318_2002"):
        build(recipe(name), folder / "resources")
    return folder


def refused(answer, *parts):
    """One sentence, exit code 1, every part said; the FMU's own words on standard error aside."""
    TRIED["mistakes"] += 1
    assert answer.code == 1, answer
    said = [line for line in answer.err.splitlines() if line.startswith("error: ")]
    assert len(said) == 1, answer
    assert_lines(said)
    for part in parts:
        assert part in said[0], (part, said[0])


#: What is set in the scenario, and what is said: the mistake and the cure.
SET = [
    ("catenary.contact_wire.tension=12", "12 N is below its minimum 500", "write its unit"),
    ("catenary.contact_wire.tension=12 m", "give it in N, daN, kN"),
    ("catenary.contact_wire.tension=12 kg", "give it in N, daN, kN"),
    ("catenary.contact_wire.tension=20000 kN", "is above its maximum 100000", "check its size"),
    ("catenary.messenger_wire.tension=16", "16 N is below its minimum 500", "write its unit"),
    ("catenary.contact_wire.mass=1350", "1350 kg/m is above its maximum 20", "write its unit"),
    ("catenary.contact_wire.area=150", "150 m2 is above its maximum 0.01", "write its unit"),
    ("catenary.contact_wire.youngs_modulus=110", "110 Pa is below its minimum", "write its unit"),
    ("catenary.profile.contact_wire_height=5080", "5080 m is above its maximum 10", "write its unit"),
    ("catenary.profile.encumbrance=1200", "1200 m is above its maximum 5", "write its unit"),
    ("catenary.contact.stiffness=50", "50 N/m is below its minimum 100", "write its unit"),
    ("catenary.damping.alpha=27.5", "27.5 s is above its maximum 10", "write its unit"),
    ("catenary.time_step=1", "1 s is above its maximum 0.1", "write its unit"),
    ("pantograph.speed=300", "300 m/s is above its maximum 170", "write its unit"),
    ("pantograph.speed=300 kph", "unit 'kph' is not known", "km/h"),
    ("pantograph.speed=fast", "'fast' is not a number", "a number with its unit"),
    ("pantograph.reference_height=5050", "5050 m is above its maximum 10", "write its unit"),
    ("pantograph.strip_length=1450", "1450 m is above its maximum 4", "write its unit"),
    ("pantograph.strip_offset=200", "200 m is above its maximum 2", "write its unit"),
    ("pantograph.static_force=120 kN", "is above its maximum 5000", "check its size"),
    ("pantograph.static_force=0", "never lifts the strip to the wire", "give it more than 0"),
    ("pantograph.raise_duration=2000", "2000 s is above its maximum 100", "write its unit"),
    ("pantograph.speed=0", "before the end of the interval of interest, 360 m", "--stop"),
    ("pantograph.speed=50 km/h", "before the end of the interval of interest, 360 m", 'until="end"'),
    ("pantograph.start_position=300", "beyond the start of the interval of interest, 240 m", "earlier start_position"),
    ("pantograph.start_position=2000", "beyond the start of the interval of interest", "earlier start_position"),
]


@pytest.mark.parametrize(("assignment", "parts"), [(a, p) for a, *p in SET], ids=[a for a, *_ in SET])
def test_values_that_cannot_be_meant_end_before_the_run(scenario, tmp_path, assignment, parts):
    out = tmp_path / "out"
    refused(ask(master, "run", scenario, "--no-build", "--quiet", "--out", out, "--set", assignment), *parts)
    assert not out.exists()


#: What is set, the stop time, and what is said at the first second.
AT_FIRST = [
    ("pantograph.reference_height=5.3", "0.5", "above the contact wire", "lower its reference_height"),
    ("pantograph.start_position=700", "0.5", "beyond the contact wire of 'catenary'", "change its start_position"),
    ("pantograph.start_position=-50", "5.16", "starts at -50 m, beyond the contact wire", "change its start_position"),
    ("pantograph.speed=600 km/h", "5.16", "by the end of the run, beyond the contact wire", "stop at 3.42 s or"),
    ("pantograph.reference_height=2.5", "5.16", "has not touched the wire", "check static force, reference_height"),
]


@pytest.mark.parametrize(("assignment", "stop", "parts"), [(a, s, p) for a, s, *p in AT_FIRST])
def test_places_that_cannot_be_meant_end_the_run_at_its_first_second(scenario, tmp_path, assignment, stop, parts):
    out = tmp_path / "out"
    options = ["--no-build", "--quiet", "--no-report", "--out", out, "--stop", stop, "--set", assignment]
    refused(ask(master, "run", scenario, *options), *parts)


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ('stopTime="5.16"', 'stopTime="3.0"', ("at 280 m, before the end of the interval", "stop at 4 s or later")),
        ('start="240" end="360"', 'start="10" end="360"', ("starts at 30 m", "the interval a later start")),
        (' end="360"', ' until="end"', ("has no end that the run could end at", "give it one")),
    ],
)
def test_stop_times_and_intervals_that_do_not_go_together(scenario, tmp_path, old, new, parts):
    folder = tmp_path / "changed.ssp"
    shutil.copytree(scenario, folder)
    description = folder / "SystemStructure.ssd"
    assert old in description.read_text()
    put_file(description, description.read_text().replace(old, new))
    refused(ask(master, "validate", folder, "--no-build"), *parts)


@pytest.mark.parametrize("stop", ['stopTime="0.1"', "", *rest('stopTime="5.16"')])
def test_a_run_until_the_end_of_its_interval_ends_there(scenario, tmp_path, stop):
    """It has 60 m to go at 300 km/h, 0.72 s, and continues for 0.5 s, whatever stop time other tools are given."""
    folder, out = tmp_path / "changed.ssp", tmp_path / "out"
    shutil.copytree(scenario, folder)
    description = folder / "SystemStructure.ssd"
    text = description.read_text().replace('stopTime="5.16"', stop)
    put_file(description, text.replace('start="240" end="360"', 'start="60" end="90" until="end"'))
    assert "0 s to 1.22 s" in ask(master, "validate", folder, "--no-build").out
    assert ask(master, "run", folder, "--no-build", "--quiet", "--no-report", "--out", out).code == 0
    done = json.loads((out / "summary.json").read_text())
    assert (done["status"], done["settings"]["stop"]) == ("complete", pytest.approx(1.22))
    assert "not_judged" not in done
    (quality,) = done["quality"]
    assert (quality["start"], quality["end"]) == (pytest.approx(60.0, abs=0.1), pytest.approx(90.0, abs=0.1))
    assert quality["criteria"]
    last = (out / "timeseries.csv").read_text().splitlines()[-1]
    assert float(last.split(",")[0]) == pytest.approx(1.22)


@pytest.mark.parametrize(
    ("setting", "parts"),
    [
        ("line.contact_wire.tension=12", ("12 N is outside 500 ... 100000 N", "check its size and its unit")),
        ("line.contact_wire.tension=12 m", ("a unit of 'N' is needed", "give it in N")),
        ("line.profile.contact_wire_height=5080", ("5080 m is outside 2 ... 10 m", "check its size and its unit")),
    ],
)
def test_the_physics_refuses_them_too(setting, parts):
    refused(ask(models, "statics", "LN2", "--set", setting), *parts)


@pytest.mark.parametrize(
    ("setting", "parts"),
    [
        ("pantograph.reference_height=5.35", ("mm above the contact wire at x = 500 m", "lower its reference_height")),
        ("pantograph.reference_height=5020", ("5020 m is outside 2 ... 10 m", "check its size and its unit")),
        ("pantograph.strip_length=0.3", ("the contact wire lies at y = ", "make strip_length longer than the stagger")),
        ("pantograph.strip_offset=1.5", ("the contact wire lies at y = ", "or mend strip_offset")),
        ("pantograph.static_force=0", ("static_force = 0 N never lifts the strip", "give it more than 0")),
        ("pantograph.speed=80", ("pantograph.speed: the run's own options say that", "give --speed")),
        ("pantograph.start_position=0", ("the run's own options say that", "give --start")),
        ("pantograph.reference_height=2.5", ("'CX' never touches the wire", "check static_force, reference_height")),
    ],
)
def test_the_monolithic_run_refuses_them_too(setting, parts):
    refused(ask(models, "couple", "LN2", "CX", "--start", "500", "--end", "595", "--quiet", "--set", setting), *parts)


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("line.profile.contact_wire_height=5.30", "at the wire's, 5.30 m, 114 N are left: set reference_height"),
        ("pantograph.reference_height=5.12", "mm above the contact wire at x = 500 m, and would begin with"),
        ("pantograph.reference_height=5.02", ""),
    ],
)
def test_the_monolithic_run_warns_as_the_fmus_do(setting, said):
    options = ["--start", "500", "--end", "512", "--quiet", "--set", setting]
    answer = ask(models, "couple", "LN2", "CX", *options)
    assert answer.code == 0
    assert [said in line for line in answer.err.splitlines() if line.startswith("warning: ")] == [True] * bool(said)


def test_values_with_units_are_taken(scenario, tmp_path):
    """The same value with a unit gives the same run."""
    for name, speed in (("plain", "83.3333333333333333"), ("unit", "300 km/h")):
        out = tmp_path / name
        options = ["--no-build", "--quiet", "--no-report", "--out", out, "--stop", "0.02"]
        assert ask(master, "run", scenario, *options, "--set", f"pantograph.speed={speed}").code == 0
    plain, unit = ((tmp_path / n / "timeseries.csv").read_bytes() for n in ("plain", "unit"))
    assert plain == unit
