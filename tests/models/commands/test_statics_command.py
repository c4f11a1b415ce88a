"""What ``statics`` writes: tables and figures of a line in a curve."""

import csv
from types import SimpleNamespace

import pytest

from models import statics
from models.commands.physics_main import main
from models.commands.physics_options import shown_progress
from models.commands.statics_command import _asked, summary
from models.interface.line_and_pantograph import Line
from tests.models.commands.conftest import ROUTE


def test_supports_with_their_loads(statics_folder):
    with (statics_folder / "supports.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["x [m]"]) for row in rows] == [50.0, 100.0, 150.0]
    assert [float(row["side of the arm [1: left]"]) for row in rows] == [-1.0] * 3
    assert all(float(row["lateral force on the wire [N]"]) < -500.0 for row in rows)
    assert all(float(row["lift [N]"]) > 0.0 for row in rows)


def test_the_strip_chart_is_there_as_both_kinds_of_file(statics_folder):
    assert (statics_folder / "profile.png").read_bytes().startswith(b"\x89PNG")
    text = (statics_folder / "profile.svg").read_text()
    assert "<svg" in text
    drawn = {"profile", "span", "elasticity", "droppers", "tension", "sag", "wind"}
    assert {p.stem for p in statics_folder.glob("*.png")} == drawn


def test_verdicts_are_in_the_summary(statics_folder):
    text = (statics_folder / "summary.csv").read_text()
    assert "speed of the train,120 km/h\n" in text.replace('"', "")
    assert "passed, limit 0.25 at least (ADIF)" in text
    assert '"steepest gradient [permil], IFE 6.3","1.00 at 50 m: passed, limit 4 at 120 km/h"' in text


def test_room_under_the_bridge_at_rest_lifted_and_over_temperature(statics_folder):
    with (statics_folder / "overbridges.csv").open() as file:
        (row,) = csv.DictReader(file)
    found = {name: float(value) for name, value in row.items()}
    assert found["clearance at rest [m]"] == pytest.approx(7.1 - found["highest wire [m]"])
    assert found["clearance lifted [m]"] == pytest.approx(found["clearance at rest [m]"] - 0.05)
    with (statics_folder / "temperature.csv").open() as file:
        cold, warm = csv.DictReader(file)
    left = "clearance under bridge 1 [m]"
    assert float(cold[left]) < float(warm[left])  # a messenger wire between springs is tighter in the cold
    left = 0.95 * 0.9 * 20e3  # after friction and the fault that takes a tenth
    assert float(cold["wave speed [km/h]"]) == pytest.approx(3.6 * (left / 1.334) ** 0.5, rel=1e-3)


def test_the_offset_at_rest_is_that_of_a_chord(statics_folder):
    """From 100 to 150 m, where the curve is sharpest between arms: the mean of the staggers, and kappa L^2 / 8.

    Weight in the canted plane, errors and the fault add a few centimetres; the ends beyond the arms do not count.
    """
    with (statics_folder / "summary.csv").open() as file:
        rows = {row["quantity"]: row["value"] for row in csv.DictReader(file)}
    offset, side, _, place, _ = rows["largest offset of the contact wire [mm]"].split()
    assert float(offset) == pytest.approx(1e3 * (0.5 * (0.1 + 0.15) + 0.00125 * 50.0**2 / 8.0), abs=40.0)
    assert side == "left"
    assert float(place) == pytest.approx(125.0, abs=5.0)


def test_the_summary_can_be_read_whatever_a_bridge_is_called(statics_folder):
    with (statics_folder / "summary.csv").open() as file:
        names = [row["quantity"] for row in csv.DictReader(file)]
    assert "clearance under <b>A-4</b> & 'x' $a_b$, at rest [m]" in names


def test_a_span_without_droppers_has_no_figures_of_them(section_maker, sections_maker):
    section = section_maker(0.0, 4, [0.2, -0.2, 0.2])
    section["spans"]["listed"] = [{"span": 2, "positions": [[], "m", "test"]}]
    rows = dict(summary(statics(Line(sections_maker(section)), span=2)))
    assert "contact wire, highest and lowest [m]" in rows
    assert not [what for what in rows if what.startswith("dropper ")]


def test_progress_is_for_terminals(capsys):
    with shown_progress([1.0, 2.0], "temperatures", is_quiet=False) as one_by_one:
        assert [*one_by_one] == [1.0, 2.0]
    assert capsys.readouterr() == ("", "")


def test_the_bar_is_gone_before_an_error_is_told(capsys, monkeypatch):
    """At a terminal it is wiped away, and with it the line above, if that came first."""
    monkeypatch.setenv("FORCE_COLOR", "1")

    def interrupted():
        with shown_progress([1.0], "temperatures", is_quiet=False) as one_by_one:
            for _ in one_by_one:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as kept:
        interrupted()
    drawn = capsys.readouterr().err
    assert "temperatures" in drawn
    del kept
    assert capsys.readouterr().err == ""


def test_an_interrupted_list_of_temperatures_leaves_no_half_results(capsys, monkeypatch, tmp_path):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("models.catenary.statics.temperature_table._at", interrupted)
    line = tmp_path / "probe.toml"
    line.write_text(ROUTE.read_text(encoding="utf-8"))
    assert main(["statics", str(line), "--temperature", "5", "10", "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr()
    assert said.err.endswith("error: interrupted\n")
    assert said.out == ""
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("given", "told"), [(None, "300 km/h, as no --speed is given"), (250.0, "250 km/h")])
def test_a_speed_that_nobody_gave_is_told(given, told):
    asked = SimpleNamespace(speed=given, force=100.0, temperature=[], set=[])
    asked.wind = asked.pressure = asked.limit = asked.head = None
    line = SimpleNamespace(model=SimpleNamespace(definition=SimpleNamespace(sections=[0])))
    assert dict(_asked(line, asked)) == {"speed of the train": told, "force of the elasticity": "100 N"}
