"""Statistics of samples against values from elsewhere."""

import math

import numpy as np
import pytest
from scipy import stats

from master.batch.sweep.pages.sample_statistics import linear_effects, mean, running_mean, running_share, share

#: Exact 95 % limits, in percent: tables of the binomial distribution by C. Lentner (ed.), Geigy Scientific Tables 2
#: (1982), as many textbooks print them.
TABLES = [
    (0, 10, 0.00, 30.85),
    (1, 10, 0.25, 44.50),
    (5, 10, 18.71, 81.29),
    (10, 10, 69.15, 100.0),
    (8, 100, 3.52, 15.16),
]


@pytest.mark.parametrize(("count", "total", "low", "high"), TABLES)
def test_the_interval_of_a_share_is_that_of_the_tables(count, total, low, high):
    found = share(count, total)
    assert found.value == count / total
    assert (100 * found.low, 100 * found.high) == pytest.approx((low, high), abs=0.006)


def test_at_the_ends_of_the_interval_what_was_seen_has_a_probability_of_one_in_forty():
    found = share(7, 40)
    assert stats.binom.sf(6, 40, found.low) == pytest.approx(0.025)
    assert stats.binom.cdf(7, 40, found.high) == pytest.approx(0.025)


def test_no_sample_says_nothing():
    found = share(0, 0)
    assert math.isnan(found.value)
    assert (found.low, found.high) == (0.0, 1.0)


def test_the_interval_of_a_mean_is_students():
    """Student's own sleep data: mean 1.58, 95 % interval 0.70 to 2.46."""
    found = mean(np.array([1.2, 2.4, 1.3, 1.3, 0.0, 1.0, 1.8, 0.8, 4.6, 1.4]))
    assert (found.value, found.low, found.high) == pytest.approx((1.58, 0.700, 2.460), abs=5e-4)


def test_a_mean_passes_over_what_is_missing():
    assert mean(np.array([1.0, math.nan, 3.0])).value == 2.0
    assert math.isnan(mean(np.array([math.nan])).value)
    one = mean(np.array([4.0, math.nan]))
    assert one.value == 4.0
    assert math.isnan(one.low)


def test_running_estimates_end_at_the_whole():
    happened = np.array([True, False, False, True, False])
    value, low, high = running_share(happened)
    whole = share(2, 5)
    assert value.tolist() == pytest.approx([1.0, 0.5, 1 / 3, 0.5, 0.4])
    assert (low[-1], high[-1]) == (whole.low, whole.high)
    numbers = np.array([3.0, 5.0, 10.0])
    means, _, ends = running_mean(numbers)
    assert means.tolist() == [3.0, 4.0, 6.0]
    assert ends[-1] == mean(numbers).high


def test_a_linear_figure_gives_back_its_effects():
    rng = np.random.default_rng(3)
    x = rng.normal(size=(60, 2))
    found = linear_effects(("a", "b"), x, 40.0 + 2.0 * x[:, 0] - 0.5 * x[:, 1])
    spans = np.quantile(x, 0.95, axis=0) - np.quantile(x, 0.05, axis=0)
    assert [e.value for e in found.change] == pytest.approx([2.0 * spans[0], -0.5 * spans[1]])
    assert found.explained == pytest.approx(1.0)


def test_intervals_of_effects_hold_the_truth_as_often_as_they_say():
    rng = np.random.default_rng(4)
    held = 0
    for _ in range(400):
        x = rng.normal(size=(25, 2))
        y = 1.5 * x[:, 0] + rng.normal(size=25)
        found = linear_effects(("a", "b"), x, y)
        span = np.quantile(x[:, 0], 0.95) - np.quantile(x[:, 0], 0.05)
        held += found.change[0].low <= 1.5 * span <= found.change[0].high
    assert 0.92 < held / 400 < 0.98


def test_rank_correlation_knows_order_alone():
    x = np.linspace(0.1, 3.0, 20)[:, None]
    found = linear_effects(("a",), x, -np.exp(3.0 * x[:, 0]))
    assert found.rank_correlation == pytest.approx((-1.0,))
    assert found.explained < 0.8


@pytest.mark.parametrize(
    "inputs",
    [np.array([[1.0], [2.0]]), np.ones((9, 1)), np.repeat(np.arange(9.0)[:, None], 2, axis=1)],
    ids=["two samples", "does not vary", "twice the same"],
)
def test_effects_that_cannot_be_told_apart_are_not_given(inputs):
    figure = np.arange(float(len(inputs)))
    assert linear_effects(tuple("ab")[: inputs.shape[1]], inputs, figure) is None
