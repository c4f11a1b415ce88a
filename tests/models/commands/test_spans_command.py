"""``spans`` and ``statics --wind``: the same wind, tables and figures, and what is missing said in words."""

import csv

import pytest

from models.commands.physics_main import main


@pytest.fixture
def said(capsys):
    def ask(*arguments):
        code = main(list(arguments))
        return code, capsys.readouterr()

    return ask


def test_spans_of_ca160(said, tmp_path):
    wind = ("--pressure", "961.04", "--limit", "0.55")
    spans = ("--radius", "800", "--stagger", "0.2", "0.2")
    code, text = said("spans", "CA160", *wind, *spans, "--out", str(tmp_path / "out"))
    assert code == 0
    assert "961.04 Pa" in text.out
    with (tmp_path / "out" / "spans.csv").open() as file:
        assert [row["radius [m]"] for row in csv.DictReader(file)] == ["800"]
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "radii.csv", "spans.csv", "spans.html", "spans.png",
    }  # fmt: skip


def test_a_limit_is_needed(said):
    code, text = said("spans", "LN2", "--wind", "29")
    assert code == 1
    assert text.err == "error: how far may the wire be blown? give --limit, in m, or --head 1600 or 1950\n"


def test_a_head_has_a_limit_for_every_radius_and_more_cant_is_told(said):
    code, text = said(
        "spans", "AC_mixed", "--wind", "29", "--head", "1600", "--radius", "400", "--stagger", "0.2", "0.2"
    )
    assert code == 0
    assert text.err.startswith(
        "warning: the limits of the head are those of curves with up to 66 mm of cant; this line's"
    )
    assert "limit [m]" in text.out
    assert "0.400" in text.out.splitlines()[-2]


def test_a_limit_without_wind_is_refused(said):
    code, text = said("statics", "LN2", "--head", "1600")
    assert code == 1
    assert "give --wind, in m/s, or --pressure, in Pa" in text.err


def test_statics_in_the_wind(statics_folder):
    with (statics_folder / "wind.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["limit [m]"] for row in rows] == ["nan", "0.4", "0.4", "nan"]
    assert (statics_folder / "wind.png").stat().st_size > 5000


def test_the_limit_of_a_head_is_kept(said):
    code, text = said("statics", "LN2", "--wind", "29", "--head", "1600")
    assert code == 0
    assert "passed, limit 400 there" in text.out
    assert "failed" not in text.out


@pytest.mark.parametrize(
    ("arguments", "answer"),
    [
        (("spans", "LN2", "--wind", "104.4", "--limit", "0.5"), "--wind 104.4: no wind is stronger than 100 m/s"),
        (("statics", "LN2", "--pressure", "1e6"), "--pressure 1e+06: no wind is stronger than 50000 Pa"),
        (("spans", "LN2", "--limit", "400"), "limit 400 m: no wire may be as far from the middle of the track"),
        (("statics", "LN2", "--set", "pantograph.m=3"), "--set pantograph.m=3: there is no pantograph here"),
        (("spans", "LN2", "--limit", "1", "--set", "pantograph.m=3"), "there is no pantograph here"),
        (("pantograph", "CX", "--set", "line.m=3"), "--set line.m=3: there is no line here"),
        (("statics", "LN2", "--speed", "3e5"), "speed 300000 km/h is faster than any train"),
        (("statics", "LN2", "--temperature", "293"), "--temperature 293: is outside -100 ... 200 degC"),
    ],
)
def test_numbers_of_another_unit(said, arguments, answer):
    code, text = said(*arguments)
    assert code == 1
    assert answer in text.err
