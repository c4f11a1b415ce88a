"""Multibody pantographs on LN2: the lumped CX in both codes, and the generic mechanism's bounds."""

import shutil
from pathlib import Path

import numpy as np
import pytest

GENERIC = Path(__file__).parents[2] / "ssp_scenarios" / "generic_multibody_ln2.ssp"

pytestmark = pytest.mark.slow


def test_lumped_masses_in_both_codes_give_the_same_figures(simulate):
    """P. Antunes (2012), table 5.7: no figure differs by more than 0.172 N between the two formulations."""
    lumped, multibody = simulate("cx_ln2"), simulate("cx_multibody_ln2")
    for figure in ("maximum", "minimum", "amplitude", "mean", "sigma", "statistical_maximum", "statistical_minimum"):
        assert multibody.quality[figure] == pytest.approx(lumped.quality[figure], abs=0.17)


@pytest.fixture(scope="module")
def source_form(tmp_path_factory):
    """The generic mechanism under the source's form of LN2: its sag from support to support, without N/L."""
    folder = tmp_path_factory.mktemp("source") / "generic_source.ssp"
    shutil.copytree(GENERIC, folder, ignore=shutil.ignore_patterns("resources"))
    description = folder / "SystemStructure.ssd"
    text = description.read_text(encoding="utf-8")
    assert text.count("Catenary_LN2.fmu") == 1
    description.write_text(text.replace("Catenary_LN2.fmu", "Catenary_LN2_supports.fmu"), encoding="utf-8")
    return folder, "--set", "catenary.dynamics.geometric_stiffness=0", "--set", "pantograph.static_moment=1410.53"


def test_generic_mechanism_keeps_contact_under_the_line_of_the_source(simulate, source_form):
    """Under ours, whose sag begins at the outer droppers, it loses contact once (its README says so)."""
    run = simulate(*source_form)
    assert run.quality["losses"]["count"] == 0
    assert run.quality["mean"] == pytest.approx(157.5, abs=0.5)
    assert run["pantograph.joints.violation"].max() < 1e-6
    assert run["pantograph.joints.violation_rate"].max() < 1e-6


@pytest.mark.long
def test_generic_mechanism_keeps_its_constraints(simulate):
    run = simulate("generic_multibody_ln2")
    assert run.quality["mean"] == pytest.approx(157.5, abs=0.5)
    assert run["pantograph.joints.violation"].max() < 1e-6
    assert run["pantograph.joints.violation_rate"].max() < 1e-6


def test_stagger_rolls_the_head_and_the_strip_follows(simulate, source_form):
    """The contact sweeps the stagger; the strip's ends rise and fall with the roll."""
    run = simulate(*source_form)
    inside = run.time > 3.6
    lateral = run["pantograph.strip.contact_y"][inside]
    assert lateral.min() < -0.18
    assert lateral.max() > 0.18
    roll = run["pantograph.strip.roll"][inside]
    tilt = (run["pantograph.A.z"] - run["pantograph.B.z"])[inside] / 1.45
    assert np.ptp(roll) > 0.02
    assert np.abs(tilt - np.sin(roll)).max() < 1e-6
