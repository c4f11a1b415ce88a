"""The search finds known optima in few points, whatever fails, and tries the same points for the same seed."""

import numpy as np
import pytest

from master.batch.optimisation.candidate_search import SearchEnd, search


def searched(function, start, most=60, seed=1):
    """The points that a search tries, their merits, and why it ended."""
    tried, merits = [], []

    def evaluate(points):
        for point in points:
            if len(tried) == most:
                raise SearchEnd
            tried.append(point.copy())
            merits.append(function(point))
        return np.array(merits[-len(points) :])

    ended = search(evaluate, np.array(start), most, seed)
    return np.array(tried), np.array(merits), ended


def bowl(point):
    return 10.0 + np.sum((point - 0.3) ** 2)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("size", [1, 2, 3])
def test_a_bowl_has_its_bottom_where_it_is(size, seed):
    tried, merits, ended = searched(bowl, [0.9] * size, most=150 * size, seed=seed)
    assert np.abs(tried[np.argmin(merits)] - 0.3).max() < 2e-3
    assert ended == "converged"
    assert len(tried) < 60 * size
    assert tried[0] == pytest.approx([0.9] * size)


def test_of_two_valleys_the_deeper_is_found():
    """The start lies in the one that is less deep."""
    tried, merits, _ = searched(lambda p: min(4 * abs(p[0] - 0.8), 6 * abs(p[0] - 0.2) - 0.3), [0.8])
    assert tried[np.argmin(merits)][0] == pytest.approx(0.2, abs=5e-3)


def test_an_optimum_at_a_bound_is_found_and_no_point_lies_outside():
    tried, merits, _ = searched(lambda p: p[0] - p[1], [0.5, 0.5], most=120)
    assert tried[np.argmin(merits)] == pytest.approx([0.0, 1.0], abs=1e-6)
    assert tried.min() >= 0.0
    assert tried.max() <= 1.0


def test_failed_runs_are_worse_than_all_others():
    tried, merits, _ = searched(lambda p: bowl(p) if p[0] > 0.4 else np.inf, [0.9])
    assert np.isinf(merits).any()
    assert tried[np.argmin(merits)][0] == pytest.approx(0.4, abs=5e-3)


def test_where_nothing_can_be_run_the_first_generation_is_the_last():
    tried, _, ended = searched(lambda _: np.inf, [0.9])
    assert (len(tried), ended) == (8, "no run of the first generation has the figure")


def test_the_same_seed_tries_the_same_points_and_no_more_than_it_may():
    one, again, other = (searched(bowl, [0.9, 0.1], most=40, seed=s) for s in (5, 5, 6))
    assert np.array_equal(one[0], again[0])
    assert not np.array_equal(one[0], other[0])
    assert (len(one[0]), one[2]) == (40, "as many runs as were allowed")
    assert len(searched(bowl, [0.9], most=3)[0]) == 3
