"""Responses are made once while strips are near, and a part at a time before."""

import pytest

from models.catenary.contact_and_slack.response_cache import ResponseCache


class _Interval:
    def __init__(self, ends):
        self.ends = ends


class _Compliance:
    """One that has found all responses to unit loads after a few calls."""

    def __init__(self, calls):
        self.left = calls

    def units(self, places):
        return tuple(places)

    def prepare(self, places):
        self.left -= 1
        return self.left < 0


@pytest.fixture
def intervals():
    return [_Interval((k, k + 1)) for k in range(40)]


def _cache(calls=0, wires=1):
    made = []

    def make(interval, columns):
        made.append(interval.ends)
        return columns

    return ResponseCache(make, _Compliance(calls), wires), made


def test_a_response_is_made_once(intervals):
    cache, made = _cache()
    assert cache.of(intervals[3]) == cache.of(intervals[3]) == (3, 4)
    assert made == [(3, 4)]


@pytest.mark.parametrize("wires", [1, 2])
def test_those_left_behind_are_forgotten(intervals, wires):
    cache, made = _cache(wires=wires)
    for interval in intervals:
        cache.of(interval)
    for interval in intervals[-12 * wires :]:
        cache.of(interval)
    assert len(made) == len(intervals)
    cache.of(intervals[0])
    assert made[-1] == (0, 1)


def test_a_response_is_prepared_before_it_is_asked_for(intervals):
    cache, made = _cache(calls=2)
    for expected in ([], [], [(5, 6)], [(5, 6)]):
        cache.prepare(intervals[5])
        assert made == expected
