"""Local responses of the attachments, and how far they reach."""

import numpy as np
import pytest

from models.catenary.line_model import CatenaryModel
from models.catenary.linear_motion.attachment_solver import CUT
from models.catenary.linear_motion.compliance import Compliance
from models.catenary.linear_motion.step_matrices import StepMatrices
from models.numerics.newmark import Newmark
from tests.models.conftest import make_overlap, shortened


@pytest.fixture(scope="module", params=["short", "Re330", "overlap"])
def model(request, short_line):
    lines = {"short": lambda: short_line, "Re330": lambda: shortened("Re330", 8), "overlap": make_overlap}
    return CatenaryModel(lines[request.param]())


def _matrices(model):
    return StepMatrices(model.modes, Newmark(1e-3))


def _compliance(model, matrices):
    return Compliance(matrices.factor, model.dropper_law.B, model.dropper_law.stiffness)


def test_responses_to_unit_loads_are_columns_of_the_inverse(model):
    matrices = _matrices(model)
    interval = model.wires[0].intervals[40]
    columns = _compliance(model, matrices).units(interval.ends)
    everywhere = np.arange(len(model.modes.attached))
    unit = np.eye(len(everywhere))[interval.ends]
    whole = np.stack([matrices.factor.solve(load) for load in unit], axis=1)
    assert columns.at(everywhere) == pytest.approx(whole, abs=1e-14 * np.abs(whole).max())
    stretch = np.zeros((len(model.dropper_law.stiffness), len(interval.ends)))
    near = columns.dropper_index
    stretch[near] = columns.dropper_force / model.dropper_law.stiffness[near, None]
    # Both ends of a dropper may lie where a column is cut.
    assert stretch == pytest.approx(model.dropper_law.B @ whole, abs=4.0 * CUT * np.abs(whole).max())


def test_what_a_strip_comes_to_is_prepared_one_response_at_a_time(model):
    compliance = _compliance(model, _matrices(model))
    places = model.wires[0].intervals[30].sides[1]
    for count in range(1, len(places) + 1):
        compliance.prepare(places)
        assert sum(place in compliance._kept for place in places.tolist()) == count


def test_compliance_of_droppers_is_symmetric(model):
    columns = _compliance(model, _matrices(model)).dropper_columns
    i, j = 20, 22
    response = {}
    for k in (i, j):
        stretch = columns[k].dropper_force[:, 0] / model.dropper_law.stiffness[columns[k].dropper_index]
        response[k] = dict(zip(columns[k].dropper_index.tolist(), stretch, strict=True))
    assert response[i][j] == pytest.approx(response[j][i], rel=1e-9)
    assert response[i][i] > abs(response[i][j])
