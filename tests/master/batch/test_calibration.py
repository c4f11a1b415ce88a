"""Finding a value, and writing it into a parameter file."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from master.batch.calibration import MAX_RUNS, find_value, find_values, store_value
from master.errors import MasterError


@given(st.floats(0.3, 3.0), st.floats(-50, 50), st.floats(60, 250))
@settings(max_examples=50)
def test_a_linear_relation_takes_three_runs(slope, offset, target):
    found = find_value(lambda x: slope * x + offset, target, 168.0, 1e-6)
    assert slope * found.value + offset == pytest.approx(target, abs=1e-6)


def test_a_curved_relation_is_found_within_few_runs():
    found = find_value(lambda x: 0.9 * x + 2e-3 * (x - 150.0) ** 2, 157.5, 168.0, 0.01)
    assert found.result == pytest.approx(157.5, abs=0.01)
    assert len(found.trials) <= 6


def test_a_kink_is_overcome_by_bisection():
    found = find_value(lambda x: 100.0 if x < 170.0 else 100.0 + 50.0 * (x - 170.0), 120.0, 168.0, 0.5, guess=175.0)
    assert found.value == pytest.approx(170.4, abs=0.02)


def test_a_value_once_enclosed_is_looked_for_between_its_nearest_neighbours():
    """After the target has been passed every further trial lies between the best trials below and above it."""
    for centre in (3.0, 7.3, 11.0):
        found = find_value(lambda v, c=centre: 100.0 + 50.0 * np.tanh(4.0 * (v - c)), 120.0, 1.0, 0.01, guess=14.0)
        assert abs(found.result - 120.0) <= 0.01
        assert len(found.trials) > 4
        for n in range(2, len(found.trials)):
            before = found.trials[:n]
            below = [t.value for t in before if t.result < 120.0]
            above = [t.value for t in before if t.result > 120.0]
            assert max(below) < found.trials[n].value < min(above)


def test_nothing_is_run_twice_when_the_start_is_right():
    assert len(find_value(lambda x: x, 157.5, 157.45, 0.1).trials) == 1


def test_a_parameter_without_effect_is_told():
    with pytest.raises(MasterError, match="does not depend on the parameter"):
        find_value(lambda x: 100.0, 157.5, 168.0, 0.1)


def test_the_unreachable_ends_after_a_bounded_number_of_runs():
    calls = []

    def saturated(x):
        calls.append(x)
        return 100.0 + 50.0 * x / (1.0 + abs(x))

    with pytest.raises(MasterError, match="no value found"):
        find_value(saturated, 157.5, 1.0, 0.1)
    assert len(calls) <= MAX_RUNS


TEXT = """<?xml version="1.0"?>
<ssv:ParameterSet version="1.0" name="p">
  <ssv:Parameters>
    <!-- about speed -->
    <ssv:Parameter name="speed"><ssv:Real value="83.3" unit="m/s"/></ssv:Parameter>
    <ssv:Parameter name="static_force">
      <ssv:Real unit="N" value="168"/>
    </ssv:Parameter>
  </ssv:Parameters>
</ssv:ParameterSet>
"""


def test_only_the_value_and_its_comment_change(tmp_path):
    path = tmp_path / "p.ssv"
    path.write_text(TEXT)
    store_value(path, "static_force", 167.1234567, "mean 157.5 N -- by > hand")
    first = path.read_text()
    assert (
        first.replace('value="167.123"', 'value="168"').replace(
            "    <!-- calibrated: mean 157.5 N - - by  hand -->\n", ""
        )
        == TEXT
    )
    store_value(path, "static_force", 150.0, "again")
    assert path.read_text().count("calibrated:") == 1
    assert 'value="150"' in path.read_text()


def test_a_parameter_that_is_not_there_is_told(tmp_path):
    path = tmp_path / "p.ssv"
    path.write_text(TEXT)
    with pytest.raises(MasterError, match="occurs 0 times"):
        store_value(path, "mass", 1.0, "x")
    assert path.read_text() == TEXT


def test_several_values_are_found_in_the_same_runs():
    calls = []

    def trains(values):
        calls.append(values)
        one, two = values
        return 0.9 * one + 3.0 + 0.02 * two, 0.95 * two - 0.05 * one

    found = find_values(trains, 157.5, (170.0, 170.0), 0.05)
    assert [f.result for f in found] == pytest.approx([157.5, 157.5], abs=0.05)
    assert trains(tuple(f.value for f in found)) == pytest.approx((157.5, 157.5), abs=0.05)
    assert len(calls) <= 6


def test_a_value_that_is_right_stays_while_others_are_looked_for():
    calls = []

    def trains(values):
        calls.append(values)
        return values[0], 0.5 * values[1] + 50.0

    found = find_values(trains, 150.0, (150.0, 170.0), 0.1)
    assert {values[0] for values in calls} == {150.0}
    assert found[1].value == pytest.approx(200.0, abs=0.3)


def test_several_values_that_cannot_be_found_are_told():
    with pytest.raises(MasterError, match="no values found after"):
        find_values(lambda v: (100.0 + 50.0 * v[0] / (1.0 + abs(v[0])),), 157.5, (1.0,), 0.1)
