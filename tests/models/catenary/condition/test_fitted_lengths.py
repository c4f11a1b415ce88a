"""Dropper lengths as fitted: errors of a definition, and the lengths that measured heights ask for."""

import dataclasses

import numpy as np
import pytest

from models.catenary.condition.fitted_lengths import droppers_along, find_fitted_lengths, with_errors
from models.catenary.condition.line_condition import find_condition
from models.catenary.shape.form_finding import EquilibriumError
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.library.catalogue import load_line
from tests.models.conftest import make_fault, make_line


@pytest.fixture(scope="module")
def design():
    line = make_line(4)
    return kept_form(line, build_mesh(line))


def heights(state):
    return state.positions[state.shape.mesh.droppers[:, 0], 2]


def some_errors(count, size, seed=1):
    return size * np.random.default_rng(seed).uniform(-1.0, 1.0, count)


def with_table(design, errors):
    """Return the condition of the design's line with errors in its definition, of the first section."""
    line = design.shape.definition
    section = dataclasses.replace(line.sections[0], length_errors=tuple(errors))
    line = dataclasses.replace(line, sections=(section, *line.sections[1:]))
    return find_condition(dataclasses.replace(design, shape=dataclasses.replace(design.shape, definition=line)))


def test_errors_of_a_definition_are_slips_of_its_droppers(design):
    """As faults, which count droppers in their spans, name them."""
    errors = some_errors(28, 0.01)
    faults = [
        make_fault(kind="dropper_slipped", span=k // 7 + 1, dropper=k % 7 + 1, value=error)
        for k, error in enumerate(errors)
    ]
    line = dataclasses.replace(design.shape.definition, fault=tuple(faults))
    slipped = find_condition(dataclasses.replace(design, shape=dataclasses.replace(design.shape, definition=line)))
    found = with_table(design, errors)
    assert np.abs(found.positions - slipped.positions).max() < 1e-12
    assert found.is_slack.sum() == 0
    assert np.array_equal(found.unstrained_length, with_errors(design, errors).unstrained_length)


def test_no_errors_leave_the_design_alone(design):
    assert np.array_equal(with_table(design, np.zeros(28)).positions, design.positions)


@pytest.mark.parametrize("name", ["LN2_overlap", "Shinkansen"])
def test_droppers_are_counted_along_each_section_without_hangers(name):
    line = load_line(name)
    mesh = build_mesh(line)
    for index, section in enumerate(line.sections):
        chosen = droppers_along(mesh, index)
        places = [x for span in section.spans for x in span.droppers]
        assert mesh.points[mesh.droppers[chosen, 0], 0] == pytest.approx(places, abs=1e-9)
        assert not mesh.is_hanger[chosen].any()


def test_heights_give_back_the_lengths_that_made_them(design):
    errors = some_errors(28, 0.01)
    found = find_fitted_lengths(design, heights(with_errors(design, errors)))
    assert not found.is_slack.any()
    assert np.abs(found.length - design.unstrained_length - errors).max() < 1e-9


def test_where_nothing_was_measured_lengths_are_the_designs(design):
    errors = np.where(np.arange(28) < 14, some_errors(28, 0.01), 0.0)
    height = np.where(np.arange(28) % 14 < 7, heights(with_errors(design, errors)), np.nan)
    found = find_fitted_lengths(design, height)
    length = found.length - design.unstrained_length
    assert np.array_equal(length[np.isnan(height)], np.zeros(14))
    assert np.isfinite(length).all()
    assert heights(found.state)[:7] == pytest.approx(height[:7], abs=1e-9)


def test_a_slack_dropper_is_found_and_pushes_nothing(design):
    """Its length has no trace in the heights: what is told is what it is at least."""
    errors = np.zeros(28)
    errors[10] = 0.08
    fitted = with_errors(design, errors)
    assert fitted.is_slack.tolist() == [k == 10 for k in range(28)]
    height = heights(fitted)
    found = find_fitted_lengths(design, height - 0.01 * (np.arange(28) == 10))
    assert found.is_slack.tolist() == fitted.is_slack.tolist()
    assert (found.state.dropper_force >= 0.0).all()
    assert heights(found.state) == pytest.approx(height, abs=1e-5)
    assert 0.0 < found.length[10] - design.unstrained_length[10] < 0.08
    others = np.arange(28) != 10
    assert (found.length - design.unstrained_length)[others] == pytest.approx(np.zeros(27), abs=1e-5)


def test_a_dropper_without_length_is_refused(design):
    with pytest.raises(EquilibriumError, match=r"leave the dropper at 4\.50 m a length of -1"):
        with_errors(design, np.where(np.arange(28) == 0, -2.4, 0.0))
