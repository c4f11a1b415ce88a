"""Seeded numbers: those of the published generator, normal, and the same bits wherever they are drawn."""

import os
import subprocess
import sys
from itertools import islice
from statistics import NormalDist

import numpy as np
import pytest
from numpy.random import Philox
from scipy import stats

from models.numerics import random_numbers
from models.numerics.random_numbers import normal_numbers


@pytest.mark.parametrize(("seed", "stream"), [(0, 1), (1, 1), (1, 3), (2**31 - 1, 2)])
def test_they_are_those_of_the_published_generator_as_numpy_has_it(seed, stream):
    words = Philox(key=np.array([seed, stream], dtype=np.uint64)).random_raw(1001)
    assert list(islice(random_numbers._words(seed, stream), 1001)) == words.tolist()
    inverse = NormalDist().inv_cdf
    expected = [round(inverse(((int(word) >> 11) + 0.5) / 2.0**53), 12) for word in words]
    assert normal_numbers(seed, stream, 1001).tolist() == expected
    shares = ((words >> np.uint64(11)).astype(np.float64) + 0.5) / 2.0**53
    assert np.abs(np.array(expected) - stats.norm.ppf(shares)).max() < 1e-9


def test_they_are_the_same_bits_as_ever():
    """These figures decide which line a seed means: studies of the past rest on them."""
    assert normal_numbers(1, 1, 4).tolist() == [-1.438464503155, 2.139320345835, 1.620276449648, 0.517643276223]
    assert normal_numbers(7, 3, 2).tolist() == [-0.044811945217, 0.595171476173]


def test_they_are_the_same_bits_in_every_process():
    code = "from models.numerics.random_numbers import normal_numbers as n; print(n(5, 1, 40).tobytes().hex())"
    said = [
        subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | {"PYTHONHASHSEED": hashing, "OMP_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
        for hashing in ("1", "2")
    ]
    assert said == [normal_numbers(5, 1, 40).tobytes().hex()] * 2


def test_they_are_normal_and_independent():
    n = 20000
    drawn = normal_numbers(11, 1, n)
    assert abs(drawn.mean()) < 4.0 / np.sqrt(n)
    assert abs(drawn.std() - 1.0) < 4.0 / np.sqrt(2.0 * n)
    assert stats.kstest(drawn, "norm").pvalue > 1e-3
    for other in (normal_numbers(12, 1, n), normal_numbers(11, 2, n), np.roll(drawn, 1)):
        assert abs(np.corrcoef(drawn, other)[0, 1]) < 4.0 / np.sqrt(n)


def test_the_first_ones_do_not_depend_on_how_many_are_drawn():
    assert normal_numbers(3, 1, 5).tolist() == normal_numbers(3, 1, 50)[:5].tolist()
    assert len(normal_numbers(3, 1, 0)) == 0


def test_they_are_rounded_where_libraries_may_differ():
    drawn = normal_numbers(3, 1, 100)
    assert drawn.tolist() == [round(x, 12) for x in drawn.tolist()]


@pytest.mark.parametrize("word", [0, 2**64 - 1])
def test_the_outermost_words_have_finite_numbers(monkeypatch, word):
    monkeypatch.setattr(random_numbers, "_words", lambda _seed, _stream: iter([word] * 2))
    assert np.isfinite(normal_numbers(1, 1, 2)).all()
