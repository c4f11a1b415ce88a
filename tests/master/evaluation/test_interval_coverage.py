"""A run is judged where it has passed its interval of interest, and only there."""

import json

import numpy as np
import pytest

from master.batch.batch_session import Runner
from master.batch.study.family import load_family
from master.batch.study.study_session import study
from master.commands.main import main
from master.errors import RequestError
from master.evaluation.en50367_limits import LimitChoice
from master.evaluation.interval_coverage import never_touched, shortfall
from master.recording.recording import Recording
from master.report.html_markup import verdict
from master.results.run_results import Results, read
from master.results.run_summary import figures
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from master.system.contacts import Contact
from tests.master.batch.study.conftest import STUDY

CONTACT = Contact(1, "line", "train", "c")


def record(first, last, force=1.0):
    x = np.linspace(first, last, 101)
    return Recording(np.linspace(0.0, 1.0, 101), ("c.force", "c.x"), ("N", "m"), np.column_stack((force + 0 * x, x)))


@pytest.mark.parametrize(
    ("first", "last", "said"),
    [
        (0.0, 100.0, ""),
        (50.0, 90.0, ""),
        (49.0, 89.7, ""),  # within a step of the end
        (0.0, 80.0, "at 80 m, before the end of the interval of interest, 90 m"),
        (60.0, 100.0, "at 60 m, beyond the start of the interval of interest, 50 m"),
    ],
)
def test_what_is_lacking_is_told(first, last, said):
    found = shortfall(record(first, last), [CONTACT], (50.0, 90.0))
    assert said in found
    assert bool(said) == bool(found)


def test_the_last_of_several_pantographs_counts():
    """One has left the interval, the other one not."""
    ahead, behind = record(50.0, 150.0), record(0.0, 80.0)
    names = ("a.force", "a.x", "b.force", "b.x")
    both = Recording(ahead.time, names, ("N", "m") * 2, np.hstack([ahead.values, behind.values]))
    contacts = [Contact(1, "line", "first", "a"), Contact(2, "line", "last", "b")]
    assert "'last' at 80 m" in shortfall(both, contacts, (60.0, 90.0))


def test_a_record_without_an_interval_lacks_nothing():
    assert shortfall(record(0.0, 1.0), [CONTACT], (None, None)) == ""


def test_a_force_that_never_was():
    assert never_touched(record(0.0, 1.0, 0.0), [CONTACT]) == "train"
    assert never_touched(record(0.0, 1.0), [CONTACT]) == ""


def go(toy, out, *options):
    return main(["run", str(toy), "--no-build", "--out", str(out), *options])


def test_a_part_that_was_asked_for_is_not_judged(toy, tmp_path, capsys):
    """The toy's interval ends at 45 m, which it passes at 0.9 s."""
    assert go(toy, tmp_path / "part", "--stop", "0.8") == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "not judged: the run ends with 'pantograph' at 40 m, before the end" in out
    assert "EN 50367" not in out
    summary = json.loads((tmp_path / "part" / "summary.json").read_text())
    assert summary["status"] == "complete"
    assert summary["quality"] == []
    assert "before the end of the interval" in summary["not_judged"]
    page = (tmp_path / "part" / "report.html").read_text()
    assert "Not judged." in page
    assert "EN 50367 ✓" not in page
    assert "EN 50367 ✗" not in page
    assert read(tmp_path / "part").assessments() == ()


def test_a_stop_time_beyond_the_interval_is_judged(toy, tmp_path):
    assert go(toy, tmp_path / "whole", "--stop", "0.9", "--quiet", "--no-report") == 0
    assert "not_judged" not in read(tmp_path / "whole").summary
    assert read(tmp_path / "whole").assessments()


def test_one_that_is_not_judged_is_not_compared(toy, tmp_path, capsys):
    for name, stop in (("part", "0.8"), ("whole", "0.9")):
        assert go(toy, tmp_path / name, "--stop", stop, "--quiet", "--no-report") == 0
    assert main(["compare", str(tmp_path / "whole"), str(tmp_path / "part")]) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert f"no contact in common that has figures; {tmp_path / 'part'} is not judged: the run ends with" in said


def test_a_scenario_that_stops_early_is_incomplete(toy, toy_text, tmp_path, capsys):
    """Nobody knows where the toy will be; what it has passed is seen at the end."""
    (toy / "SystemStructure.ssd").write_text(toy_text(stop="0.8"))
    assert go(toy, tmp_path / "early", "--quiet") == 1
    assert "before the end of the interval of interest, 45 m; run it longer" in " ".join(
        capsys.readouterr().err.split()
    )
    assert read(tmp_path / "early").summary["status"] == "incomplete"


def test_a_toy_that_cannot_tell_its_speed_needs_a_stop_time(toy, toy_text, capsys):
    (toy / "SystemStructure.ssd").write_text(toy_text('<panto:Interval start="20" end="45" until="end"/>'))
    assert main(["validate", str(toy), "--no-build"]) == 1
    assert "gives no start_position, so when it leaves the interval is not known; give a stop time" in " ".join(
        capsys.readouterr().err.split()
    )


@pytest.mark.parametrize("value", ["4 kN/m", "4000", "4 N/mm"])
def test_units_of_values(toy, value):
    """The toy's FMUs declare no units: a value with one is refused, one without is taken."""
    overrides = Overrides(parameters={"catenary.stiffness": value})
    if value == "4000":
        with open_scenario(toy, overrides, build=False) as scenario:
            assert scenario.system.component("catenary").parameters["stiffness"] == 4000.0
        return
    with pytest.raises(RequestError, match="the FMU declares none"), open_scenario(toy, overrides, build=False):
        pass


def test_an_energy_that_does_not_balance_withholds_the_verdict_not_the_figures(tmp_path):
    """The line's work and the pantograph's differ by 2 % of what is exchanged, the limit is 1 %."""
    time = np.linspace(0.0, 1.0, 1001)
    force, x, speed = 150.0 + 0 * time, 100.0 * time, np.sin(20.0 * time)
    work = np.concatenate(([0.0], np.cumsum(np.abs(150.0 * speed[1:])) * 1e-3))
    names = ("line.p.contact.force", "line.p.contact.x", "train.A.x", "train.B.x", "train.A.vz", "train.B.vz")
    works = ("line.p.contact.work", "train.contact.work")
    for share, withheld in ((0.98, True), (0.995, False)):
        columns = np.column_stack((force, x, x, x, speed, speed, work, share * work))
        units = ("N", "m", "m", "m", "m/s", "m/s", "J", "J")
        run = Recording(time, (*names, *works), units, columns)
        contact = Contact(1, "line", "train", "line.p.contact").as_data()
        summary = {"status": "complete", "contacts": [contact], "settings": {"interval": {"start": 10.0, "end": 90.0}}}
        done = Results(tmp_path, summary, (run,), {})
        (found,) = done.assessments()
        assert found.quality.mean == pytest.approx(150.0)
        assert bool(found.withheld) == withheld
        assert bool(found.criteria) != withheld
        assert ("not judged" in verdict(found, "train", LimitChoice())) == withheld
        (data,) = figures(done)["quality"]
        assert (data["passed"] is None) == withheld


VARIANTS = "variant,catenary.stiffness,pantograph.static_force,stop\none,4000,140,1\ntwo,{},160,1\n"


@pytest.fixture
def family_folder(toy):
    (toy / "study.toml").write_text(STUDY.replace('variants = ["soft"]', 'variants = ["one"]'))
    return toy


@pytest.mark.parametrize(
    ("cell", "said"), [("", "no value for catenary.stiffness"), ("much", "'much' is not a number"), ("1 m", "none")]
)
def test_all_cells_are_checked_before_the_first_run(family_folder, tmp_path, capsys, cell, said):
    (family_folder / "variants.csv").write_text(VARIANTS.format(cell))
    command = ["study", str(family_folder), "--no-build", "--quiet", "--out", str(tmp_path / "out")]
    assert main(command) == 1
    reported = " ".join(capsys.readouterr().err.split())
    assert "variant 'two'" in reported
    assert said in reported
    assert not (tmp_path / "out").exists()


def test_what_was_swept_is_in_table_and_data(family_folder, tmp_path):
    (family_folder / "variants.csv").write_text(VARIANTS.format("8000"))
    family = load_family(str(family_folder))
    study(family, family.variants, tmp_path / "out", Runner(build=False))
    head, *rows = (tmp_path / "out" / "study.csv").read_text().splitlines()
    assert head.endswith("catenary.stiffness,pantograph.static_force,stop")
    assert [row.rsplit(",", 3)[1:] for row in rows] == [["4000", "140", "1"], ["8000", "160", "1"]]
    values = [v["values"] for v in json.loads((tmp_path / "out" / "study.json").read_text())["variants"]]
    assert values[1] == {"catenary.stiffness": "8000", "pantograph.static_force": "160", "stop": "1"}
