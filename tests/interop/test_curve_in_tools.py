"""A short line in a curve, with cant, another temperature and errors from a seed: another tool gives the same force."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from models.library.catalogue import line_path
from tests import forked_commands
from tests.interop.support import ROOT, STEP, require, run_tool

STOP = 0.4
FORCE = "catenary.pantograph[1].contact.force [N]"
#: What makes AC_curve a line of six spans: a spiral into a curve to the left, errors of its droppers, 15 degC less.
SHORTER = (
    ('name = "AC_curve"', 'name = "bend"'),
    ("count = [16", "count = [6"),
    ("end = [880", "end = [330"),
    ("[[165, 315, 565, 715]", "[[60, 170]"),
    ("[[0, 1200, 1200, 0]", "[[0, 1200]"),
    ("[[0, 150, 150, 0]", "[[0, 110]"),
    ("    0.2, -0.2, -0.2, -0.2, -0.2, -0.2, -0.2, -0.2, -0.2, -0.2, 0.2,\n    -0.2, 0.2,", "    -0.2, -0.2, -0.2,"),
    ("    0.2, -0.2,\n    -0.2, -0.2, -0.2,", "    0.2, -0.2, -0.2, -0.2, -0.2,"),
)
CONDITION = """
[irregularity]
seed = 7
dropper_length_sigma = [5, "mm", "choice: test"]

[tensioning]
temperature = [-5, "degC", "choice: test"]
reference_temperature = [10, "degC", "choice: test"]
direction = -1
contact_wire = { efficiency = [0.95, "1", "choice: test"] }
"""


def changed(text, pairs):
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    return text


@pytest.fixture(scope="module")
def bend(tmp_path_factory):
    """A project with a short line in a curve, packed."""
    project = tmp_path_factory.mktemp("bend")
    scenario = project / "bend.ssp"
    shutil.copytree(ROOT / "ssp_scenarios" / "cx_ac_curve.ssp", scenario, ignore=shutil.ignore_patterns("*.fmu"))
    for name, pairs in (
        ("SystemStructure.ssd", [("Catenary_AC_curve", "Catenary_bend")]),
        ("parameters.ssv", [('"start_position"><ssv:Real value="70"', '"start_position"><ssv:Real value="115"')]),
    ):
        (scenario / name).write_text(changed((scenario / name).read_text(), pairs))
    (project / "openpanto.toml").write_text('name = "bend"\n')
    (project / "lines").mkdir()
    (project / "lines" / "bend.toml").write_text(changed(line_path("AC_curve").read_text(), SHORTER) + CONDITION)
    done = forked_commands.run("master", "pack", scenario, "--out", project / "packed.ssp")
    assert done.returncode == 0, done.stderr
    return project / "packed.ssp"


def test_a_line_in_a_curve_gives_the_same_force_in_ecos(bend, tmp_path):
    require("ecospy")
    words = ("--scheme", "jacobi", "--stop", STOP, "--step", STEP, "--out", tmp_path / "ours")
    done = forked_commands.run("master", bend, *words, "--quiet", "--no-report")
    assert done.returncode == 0, done.stderr
    with (tmp_path / "ours" / "timeseries.csv").open() as file:
        column = file.readline().strip().split(",").index(FORCE)
        ours = np.loadtxt(file, delimiter=",", usecols=column)[1:]
    run = run_tool("ecos", bend, STOP, tmp_path / "force.csv")
    assert ours.max() > 100.0
    assert np.abs(run.force - ours).max() < 1e-7  # rounding of the recording's ten digits
