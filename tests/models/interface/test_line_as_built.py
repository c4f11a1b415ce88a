"""A line as built from Python: lines to go on with, tables, and what cannot be meant."""

import numpy as np
import pytest

import models
from models.catenary.condition.fitted_lengths import with_errors
from models.catenary.condition.line_condition import find_condition
from models.catenary.shape.form_finding import find_form
from models.catenary.shape.line_mesh import build_mesh
from models.interface.line_and_pantograph import Line
from tests.models.conftest import make_line
from tests.models.layout.as_built.measuring_vehicle import measured


@pytest.fixture(scope="module")
def hung(tmp_path_factory):
    line = make_line(4, stagger={"listed": [[0.2, -0.1, 0.25], "m", "test"]})
    design = find_form(line, build_mesh(line))
    errors = np.zeros(28)
    errors[[9, 16]] = [0.012, -0.008]
    run, _ = measured(with_errors(design, errors), np.random.default_rng(2), origin=-40.0)
    path = tmp_path_factory.mktemp("run") / "run.csv"
    rows = zip(run.position, run.height, run.stagger, strict=True)
    path.write_text("position;height [mm];stagger\n" + "".join(f"{x:.3f};{1e3 * z:.3f};{y:.4f}\n" for x, z, y in rows))
    return models.as_built(Line(line), path, only=2, step="1 mm"), errors


def heights(line):
    state = find_condition(find_form(line.definition, build_mesh(line.definition)))
    return state.positions[state.shape.mesh.droppers[:, 0], 2]


def test_what_comes_back_are_lines(hung):
    found, errors = hung
    table = dict(zip(*found.tables["droppers"], strict=True))
    assert found.line.definition.sections[0].length_errors == pytest.approx(errors, abs=1e-4)
    assert found.shift == pytest.approx(-40.0, abs=0.01)
    assert np.flatnonzero(table["change [mm]"]).tolist() == [9, 16]
    assert table["change [mm]"][[9, 16]] == pytest.approx([-12.0, 8.0])
    assert heights(found.corrected) == pytest.approx(table["height expected [m]"], abs=1e-6)
    assert heights(found.corrected) == pytest.approx(table["height designed [m]"], abs=2e-4)
    assert [k for k, word in enumerate(found.verdicts) if word != "passed"] == [9]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"step": "5 m"}, "step: 5 m is outside 0.0001 ... 0.5 m"),
        ({"tolerance": "10 N"}, "unit 'N'"),
        ({"only": 0}, "only: 0 must be 1 or more"),
        ({}, "cannot be read"),
    ],
)
def test_what_cannot_be_meant_is_refused(options, said):
    with pytest.raises((models.ParameterError, models.DefinitionError), match=said):
        models.as_built("LN2", "gone.csv", **options)
