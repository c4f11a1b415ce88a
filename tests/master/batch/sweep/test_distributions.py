"""Samples have the distribution that was asked for, and are the same for the same seed."""

import math

import numpy as np
import pytest
from scipy import stats

from master.batch.sweep.distributions import Distribution, draw, read_distribution
from master.batch.sweep.swept_parameter import ParameterReader, SweptParameter
from master.errors import RequestError

PARAMETER = SweptParameter("a", ("c.a",), "")


def _of(kind, *arguments):
    return Distribution(PARAMETER, kind, arguments)


@pytest.mark.parametrize("method", ["lhs", "sobol"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_normal_sample_has_its_mean_and_sd_within_their_confidence_intervals(method, seed):
    """99 % intervals of independent samples; those of a stratified sample are narrower."""
    n, mean, sd = 256, 20.0, 0.4
    found = draw([_of("normal", mean, sd), _of("uniform", 0.0, 1.0)], n, seed, method)[:, 0]
    assert abs(found.mean() - mean) < 2.576 * sd / math.sqrt(n)
    low, high = stats.chi2.ppf([0.005, 0.995], n - 1)
    assert low < (n - 1) * found.var(ddof=1) / sd**2 < high


@pytest.mark.parametrize(
    ("wanted", "mean", "sd"),
    [
        (_of("uniform", 2.0, 8.0), 5.0, 6.0 / math.sqrt(12.0)),
        (_of("lognormal", 3.0, 0.6), 3.0, 0.6),
        (_of("truncnormal", 0.0, 1.0, -1e3, 1e3), 0.0, 1.0),
        (_of("triangular", 0.0, 1.0, 5.0), 2.0, math.sqrt((25.0 + 1.0 - 5.0) / 18.0)),
    ],
)
def test_mean_and_sd_of_each_kind(wanted, mean, sd):
    found = draw([wanted], 4096, 7)[:, 0]
    assert found.mean() == pytest.approx(mean, abs=0.02 * sd)
    assert found.std() == pytest.approx(sd, rel=0.02)


def test_a_latin_hypercube_has_one_value_in_each_part():
    found = draw([_of("uniform", 0.0, 100.0), _of("uniform", 0.0, 100.0)], 100, 5)
    assert np.array_equal(np.sort(np.floor(found), axis=0), np.tile(np.arange(100.0)[:, None], 2))


def test_the_same_seed_gives_the_same_bits_and_another_seed_other_values():
    wanted = [_of("normal", 0.0, 1.0)]
    assert np.array_equal(draw(wanted, 50, 3), draw(wanted, 50, 3))
    assert not np.array_equal(draw(wanted, 50, 3), draw(wanted, 50, 4))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("normal(20, 0)", "is impossible: its standard deviation must be greater than 0"),
        ("normal(20, -1)", "is impossible"),
        ("uniform(3, 2)", "its bounds must rise"),
        ("uniform(2, 2)", "its bounds must rise"),
        ("lognormal(-1, 1)", "its mean must be greater than 0"),
        ("triangular(1, 9, 5)", "its bounds must rise"),
        ("truncnormal(0, 1, 3, 2)", "its bounds must rise"),
        ("normal(20)", "2 numbers are needed"),
        ("normla(20, 1)", "there is no distribution 'normla'; did you mean 'normal'"),
        ("20", "is not a distribution; known: normal(mean, sd)"),
        ("normal(a, b)", "'a' is not a number"),
    ],
)
def test_what_is_impossible_is_one_sentence(toy_system, text, said):
    with pytest.raises(RequestError) as caught:
        read_distribution(ParameterReader(toy_system, "catenary.stiffness"), text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_sobol_sequence_is_balanced_or_refused():
    with pytest.raises(RequestError, match="take 128"):
        draw([_of("uniform", 0.0, 1.0)], 100, 1, "sobol")
