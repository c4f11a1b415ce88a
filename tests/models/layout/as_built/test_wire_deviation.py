"""A straight course between knots: exact without noise, with stated errors that noise keeps to, and what is left."""

import numpy as np
import pytest
import scipy.sparse as sp

from models.layout.as_built.measured_run import AsBuiltError
from models.layout.as_built.wire_deviation import wire_deviation

KNOTS = np.array([0.0, 4.5, 11.0, 18.0, 24.75, 31.5, 38.0, 45.0, 49.5])
VALUE = np.array([0.0, 3.0, -4.0, 8.0, 0.0, -2.0, 1.0, 5.0, 2.0]) * 1e-3
X = np.arange(0.25, 49.5, 0.5)


def course(x):
    return np.interp(x, KNOTS, VALUE)


def fitted(x, deviation):
    """Fit a string, which does not bend."""
    shapes = np.array([np.interp(x, KNOTS, unit) for unit in np.eye(len(KNOTS))]).T
    return wire_deviation(x, deviation, KNOTS, sp.csr_matrix(shapes))


def test_heights_without_noise_give_the_course():
    found = fitted(X, course(X))
    assert found.value == pytest.approx(VALUE, abs=1e-8)
    assert found.is_measured.all()
    assert np.abs(found.left).max() < 1e-8
    assert found.sigma < 1e-8


def test_errors_are_those_of_many_runs():
    """Of the values, and of sums of them with any weights, against the scatter of 100 runs with noise of 1 mm."""
    rng = np.random.default_rng(3)
    rows = rng.standard_normal((3, len(KNOTS)))
    runs = [fitted(X, course(X) + 1e-3 * rng.standard_normal(len(X))) for _ in range(100)]
    values = np.array([run.value for run in runs])
    assert np.mean([run.sigma for run in runs]) == pytest.approx(1e-3, rel=0.02)
    assert values.mean(axis=0) == pytest.approx(VALUE, abs=3e-4)
    assert values.std(axis=0) == pytest.approx(1e-3 * runs[0].error, rel=0.25)
    stated = np.mean([run.covariance(rows) for run in runs if run.is_noise], axis=0)
    assert (values @ rows.T).var(axis=0) == pytest.approx(stated, rel=0.4)
    assert sum(run.is_noise for run in runs) > 96


def test_a_knot_in_a_gap_is_not_measured():
    kept = (X < 12.0) | (X > 30.0)
    found = fitted(X[kept], course(X[kept]))
    assert found.is_measured.tolist() == [True, True, True, False, False, True, True, True, True]
    assert found.value[found.is_measured] == pytest.approx(VALUE[found.is_measured], abs=1e-6)


def test_heights_at_knots_alone_are_enough_but_say_nothing_of_their_noise():
    found = fitted(KNOTS[1:-1], VALUE[1:-1])
    assert found.is_measured.tolist() == [False] + 7 * [True] + [False]
    assert found.value[1:-1] == pytest.approx(VALUE[1:-1], abs=1e-6)
    assert np.isnan(found.sigma)


def test_heights_far_from_their_neighbours_are_left_out():
    wrong = course(X) + 1e-4 * np.sin(7.0 * X)
    wrong[[20, 61]] += [0.3, -0.06]
    found = fitted(X, wrong)
    assert np.flatnonzero(found.is_outlier).tolist() == [20, 61]
    assert found.value == pytest.approx(VALUE, abs=2e-4)


def test_a_wave_of_the_wire_is_no_noise_and_is_left():
    wave = 1e-3 * np.sin(2.0 * np.pi * X / 3.1)
    found = fitted(X, course(X) + wave)
    assert found.likeness > 0.3
    assert not found.is_noise
    assert np.corrcoef(found.left, wave)[0, 1] > 0.98


def test_nothing_on_the_line_is_refused():
    with pytest.raises(AsBuiltError, match="no measured height lies on the line"):
        fitted(np.zeros(0), np.zeros(0))
