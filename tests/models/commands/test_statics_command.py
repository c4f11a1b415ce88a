"""What ``statics`` writes: tables and figures of a line in a curve."""

import csv
from pathlib import Path

import pytest

from models.commands.physics_main import main

ROUTE = Path(__file__).parents[3] / "docs" / "build_site" / "probes" / "line_route.toml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("statics") / "out"
    assert main(["statics", str(ROUTE), "--out", str(out), "--speed", "120"]) == 0
    return out


def test_supports_with_their_loads(folder):
    with (folder / "supports.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["x [m]"]) for row in rows] == [50.0, 100.0, 150.0]
    assert [float(row["side of the arm [1: left]"]) for row in rows] == [-1.0] * 3
    assert all(float(row["lateral force on the wire [N]"]) < -500.0 for row in rows)
    assert all(float(row["lift [N]"]) > 0.0 for row in rows)


def test_the_strip_chart_is_there_as_both_kinds_of_file(folder):
    assert (folder / "profile.png").read_bytes().startswith(b"\x89PNG")
    text = (folder / "profile.svg").read_text()
    assert "<svg" in text
    assert {p.name for p in folder.glob("*.png")} == {"profile.png", "span.png", "elasticity.png", "droppers.png"}


def test_verdicts_are_in_the_summary(folder):
    text = (folder / "summary.csv").read_text()
    assert "keeps 0.25 at least (ADIF)" in text
    assert '"steepest gradient [permil], IFE 6.3","1.00 at 50 m: keeps 4 at 120 km/h"' in text
