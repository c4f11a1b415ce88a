"""Verdicts in words: every limit on both of its sides, the norm named."""

import dataclasses

import numpy as np
import pytest

from models.catenary.line_model import CatenaryModel
from models.catenary.statics.rest_profile import droppers
from models.catenary.statics.support_loads import support_loads
from models.interface.support_verdicts import support_verdicts
from models.library.norm_tables import gradient_limits, support_limits


@pytest.fixture(scope="module")
def model(line_maker):
    heights = {"contact_wire_height": [[5.3, 5.3, 5.2, 5.2, 5.2], "m", "x"]}
    return CatenaryModel(line_maker(supports=heights))


def said(model, speed=100.0, shortest=None, **changes):
    supports = dataclasses.replace(support_loads(model), **changes)
    hung = droppers(model)
    if shortest is not None:
        hung = dataclasses.replace(hung, length=np.full_like(hung.length, shortest))
    found = support_verdicts(supports, hung, support_limits(), gradient_limits(), speed / 3.6)
    return {judged.what: judged.text for judged in found}


def test_loads_of_arms(model):
    for load, verdict in (
        (2499.0, "2499 at 50 m: passed, limit 2500 (ADIF, standard arm)"),
        (-2600.0, "2600 at 50 m: with proof, limit 2500, and 4000 with proof (ADIF)"),
        (4100.0, "4100 at 50 m: failed, limit 4000 (ADIF, with proof)"),
    ):
        assert said(model, lateral=np.array([load, 81.0, np.nan]))["largest lateral load of an arm [N]"] == verdict
    for load, verdict in (
        (79.0, "79 at 50 m: failed, limit 80 at least (from memory: check)"),
        (81.0, "81 at 50 m: passed, limit 80 at least (from memory: check)"),
    ):
        assert said(model, lateral=np.array([-load, 100.0]))["smallest lateral load of an arm [N]"] == verdict


def test_lengths_of_droppers(model):
    assert said(model, shortest=0.24)["shortest dropper [m]"].startswith("0.240 at ")
    assert "failed, limit 0.25" in said(model, shortest=0.24)["shortest dropper [m]"]
    assert "passed, limit 0.25" in said(model, shortest=0.26)["shortest dropper [m]"]


def test_gradients_by_speed_and_norm(model):
    assert said(model, 160.0)["steepest gradient [permil], IFE 6.3"] == "2.00 at 100 m: passed, limit 2 at 160 km/h"
    table = "steepest gradient [permil], EN 50119:2009, table 12 (from memory: check)"
    assert "passed, limit 3.3 at" in said(model, 160.0)[table]
    change = said(model, 160.0)["largest change of gradient [permil], IFE 6.3"]
    assert change == "2.00 at 100 m: failed, limit 1 at 160 km/h"
    assert (
        "failed, limit 0 at 300"
        in said(model, 300.0)["steepest gradient [permil], EN 50119:2009, table 12 (from memory: check)"]
    )


def test_a_level_line_has_no_gradients_to_judge(short_line):
    assert not [what for what in said(CatenaryModel(short_line)) if "gradient" in what]
