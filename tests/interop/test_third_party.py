"""The worked example of docs/third-party-pantograph.md, as it stands there."""

from __future__ import annotations

import re
import shutil

import numpy as np
import pytest
from pythonfmu.builder import FmuBuilder

from master.commands.main import main
from master.recording.recording import load
from master.scenario.open_scenario import open_scenario
from master.ssp.archive import extract
from tests.interop.support import ROOT

PAGE = (ROOT / "docs" / "third-party-pantograph.md").read_text(encoding="utf-8")
SOURCE = ROOT / "docs" / "examples" / "third_party_pantograph.py"


def block(name):
    """The XML after the page's mark of this name."""
    text = re.search(rf"<!-- {name} -->\s*```xml\n(.*?)```", PAGE, re.DOTALL)[1]
    return "\n".join(line.removeprefix("   ") for line in text.splitlines())


@pytest.fixture(scope="module")
def scenario(packed, tmp_path_factory):
    folder = tmp_path_factory.mktemp("third") / "other_ln2.ssp"
    folder.mkdir()
    extract(packed, folder)
    FmuBuilder.build_FMU(shutil.copy(SOURCE, folder.parent), dest=folder / "resources")
    path = folder / "SystemStructure.ssd"
    text = path.read_text()
    text = re.sub(r'<ssd:Component name="pantograph".*?</ssd:Component>', block("component"), text, flags=re.DOTALL)
    text = re.sub(r"<ssd:Connections>.*?</ssd:Connections>", block("connections"), text, flags=re.DOTALL)
    path.write_text(re.sub(r"<panto:Calibration[^>]*/>", "", text))
    return folder


def test_it_is_valid_and_needs_nothing_but_the_ssd(scenario, capsys):
    assert main(["validate", str(scenario), "--no-build"]) == 0
    assert "2 components, 13 connections" in capsys.readouterr().out


def test_it_presses_against_the_wire_as_its_uplift_says(scenario, tmp_path, capsys):
    """Once settled, the mean force over some spans is the uplift force, less what the damper takes."""
    command = [str(scenario), "--no-build", "--no-report", "--out", str(tmp_path / "out"), "--stop", "3"]
    assert main(command) == 0
    recording = load(tmp_path / "out" / "timeseries.csv")
    force = recording["catenary.pantograph[1].contact.force"]
    assert force[recording.time > 1.5].mean() == pytest.approx(150.0, abs=15.0)
    assert np.isfinite(force).all()
    said = capsys.readouterr().out
    assert "interface residual, contact 1: " in said


def test_its_force_is_judged_though_its_names_are_its_own(scenario):
    with open_scenario(scenario, build=False) as opened:
        (contact,) = opened.system.contacts
    assert contact.pantograph == "pantograph"
    assert contact.force_input == "pantograph.push"
    assert contact.end("A", "x") == "pantograph.left_x"
