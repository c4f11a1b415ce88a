"""Changes of droppers: the best few against trying all, limits of length, steps, and no dropper made slack."""

import itertools

import numpy as np
import pytest
import scipy.sparse as sp

from models.catenary.condition.fitted_lengths import FittedLengths, with_errors
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.catenary.statics.dropper_influence import dropper_influence
from models.layout.as_built.dropper_corrections import Allowed, correct, most_useful
from tests.models.conftest import make_line

ALL = np.arange(28)


def influences(seed, count=7):
    rng = np.random.default_rng(seed)
    return -0.4 * np.eye(count) + 0.1 * rng.standard_normal((count, count)), 1e-2 * rng.standard_normal(count)


def left(J, rise, chosen):
    found = np.linalg.lstsq(J[:, chosen], rise, rcond=None)[0]
    return np.linalg.norm(J[:, chosen] @ found - rise)


@pytest.mark.parametrize("seed", range(5))
def test_every_choice_is_the_best_with_those_before_it(seed):
    J, rise = influences(seed)
    chosen = most_useful(sp.csc_matrix(J), rise, 5)
    for k in range(5):
        others = [j for j in range(7) if j not in chosen[:k]]
        best = min(others, key=lambda j: left(J, rise, [*chosen[:k], j]))
        assert chosen[k] == best


def test_the_first_is_the_best_of_all_and_seven_of_seven_leave_nothing():
    J, rise = influences(9)
    assert most_useful(sp.csc_matrix(J), rise, 1)[0] == min(range(7), key=lambda j: left(J, rise, [j]))
    best = min(itertools.combinations(range(7), 2), key=lambda pair: left(J, rise, list(pair)))
    two = most_useful(sp.csc_matrix(J), rise, 2)
    assert left(J, rise, list(two)) < 1.2 * left(J, rise, list(best))
    assert sorted(most_useful(sp.csc_matrix(J), rise, 7)) == list(range(7))
    assert not len(most_useful(sp.csc_matrix(J), np.zeros(7), 3))


@pytest.fixture(scope="module")
def design():
    line = make_line(4)
    return kept_form(line, build_mesh(line))


def heights(state):
    return state.positions[state.shape.mesh.droppers[:, 0], 2]


def corrected(design, errors, **allowed):
    built = with_errors(design, errors)
    fitted = FittedLengths(built, built.unstrained_length, built.is_slack)
    allowed = Allowed(**({"step": 1e-3, "only": None, "shortest": 0.25} | allowed))
    rise = heights(design) - heights(built)
    return correct(design, fitted, ALL, dropper_influence(built, ALL), rise, allowed)


def test_errors_are_taken_back(design):
    errors = 0.008 * np.random.default_rng(4).uniform(-1.0, 1.0, 28)
    found = corrected(design, errors)
    assert found.exact == pytest.approx(-errors, abs=5e-5)
    assert found.change == pytest.approx(1e-3 * np.rint(1e3 * found.exact), abs=1e-12)
    assert np.abs(heights(found.state) - heights(design)).max() < 1e-3


def test_few_changes_go_to_the_worst(design):
    errors = np.zeros(28)
    errors[[8, 11, 17]] = [0.012, -0.009, 0.004]
    found = corrected(design, errors, only=2, step=5e-3)
    assert np.flatnonzero(found.is_changed).tolist() == [8, 11]
    assert found.change[[8, 11]] == pytest.approx([-0.010, 0.010])


def test_no_dropper_is_made_shorter_than_allowed(design):
    """The others make up for it as far as they can: what is left is less than if they stayed."""
    errors = 0.02 * (ALL == 10)
    length = design.unstrained_length[10]
    found = corrected(design, errors, shortest=length + 0.0081)
    assert found.change[10] == pytest.approx(-0.020)  # the design is as short: that is allowed
    shorter = design.unstrained_length[10] + 0.02
    assert corrected(design, errors, shortest=shorter).change.min() >= -0.020 - 1e-12
    assert (found.state.unstrained_length >= 0.25).all()


def test_a_dropper_below_the_norm_is_not_shortened_further(design):
    errors = np.zeros(28)
    errors[10] = -0.006
    found = corrected(design, -errors, shortest=5.0)
    assert found.state.unstrained_length == pytest.approx(np.maximum(design.unstrained_length, 0.0), abs=1.1e-3)
    assert (found.state.unstrained_length >= design.unstrained_length - 1e-12).all()


def test_changes_leave_no_dropper_slack(design):
    """Its neighbours are raised by few changes; lengthening the dropper between them by as much would slacken it."""
    errors = np.zeros(28)
    errors[[9, 11]] = 0.024
    errors[10] = -0.055
    found = corrected(design, errors, only=1, step=5e-3)
    assert not (found.state.is_slack & ~with_errors(design, errors).is_slack).any()


def test_a_loose_dropper_stays_and_the_others_do_without_it(design):
    """80 mm too long it moves nothing; its neighbours, right themselves, bring the wire nearer to the design."""
    errors = 0.08 * (ALL == 10)
    found = corrected(design, errors)
    assert with_errors(design, errors).is_slack[10]
    assert found.change[10] == 0.0
    before, after = (np.sum((heights(s) - heights(design)) ** 2) for s in (with_errors(design, errors), found.state))
    assert after < before
