"""Values between the rows of a table, against scipy's interpolants and numerical integrals."""

import time

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator

from models.numerics.sampled_signal import HELD, INTERPOLATIONS, LINEAR, SMOOTH, SampledSignal, monotone_slopes

TIME = np.array([0.5, 1.0, 1.1, 2.0, 3.5, 3.6, 5.0])
VALUES = np.array([[0.0, 1.0], [2.0, 1.0], [2.5, -3.0], [2.5, 4.0], [-1.0, 4.5], [-1.2, 4.0], [3.0, 9.0]])
INSIDE = np.linspace(0.5, 5.0, 61)


def pchip():
    return PchipInterpolator(TIME, VALUES)


@pytest.mark.parametrize("t", INSIDE)
def test_smooth_values_rates_and_integrals_are_scipys(t):
    found, curve = SampledSignal(TIME, VALUES, SMOOTH).at(t), pchip()
    np.testing.assert_allclose(found.value, curve(t), atol=1e-13)
    np.testing.assert_allclose(found.rate, curve.derivative()(t), atol=1e-11)
    np.testing.assert_allclose(found.integral, curve.antiderivative()(t), atol=1e-13)


def test_smooth_is_monotone_where_the_rows_are_and_linear_between_two():
    x = np.sort(np.random.default_rng(1).uniform(0.0, 1.0, 30))
    y = np.cumsum(np.random.default_rng(2).exponential(size=(30, 1)), axis=0)
    signal = SampledSignal(x, y, SMOOTH)
    assert all(signal.at(t).rate[0] >= 0.0 for t in np.linspace(x[0], x[-1], 500))
    np.testing.assert_allclose(monotone_slopes(np.array([0.0, 2.0]), np.array([[1.0], [5.0]])), 2.0)


def test_linear_is_numpys_and_its_rate_the_secant():
    signal = SampledSignal(TIME, VALUES, LINEAR)
    for t in INSIDE:
        assert signal.at(t).value[1] == pytest.approx(np.interp(t, TIME, VALUES[:, 1]), abs=1e-14)
    assert signal.at(1.5).rate[0] == 0.0
    assert signal.at(2.75).rate[0] == pytest.approx(-3.5 / 1.5)


def test_held_values_are_those_of_the_last_row():
    signal = SampledSignal(TIME, VALUES, HELD)
    for t in INSIDE:
        row = np.searchsorted(TIME, t, side="right") - 1
        assert np.array_equal(signal.at(t).value, VALUES[row])
        assert not signal.at(t).rate.any()


@pytest.mark.parametrize("way", INTERPOLATIONS)
def test_rows_are_told_to_the_last_bit_and_the_integral_is_of_the_value(way):
    signal = SampledSignal(TIME, VALUES, way)
    for t, row in zip(TIME, VALUES, strict=True):
        assert np.array_equal(signal.at(t).value, row)
    for t in (0.0, 0.9, 2.3, 5.0, 6.0):
        points = [s for s in TIME if min(0.5, t) < s < max(0.5, t)] or None
        exact = quad(lambda s: signal.at(s).value[1], 0.5, t, points=points, epsabs=1e-12)[0]
        assert signal.at(t).integral[1] == pytest.approx(exact, abs=1e-9), t


@pytest.mark.parametrize("way", INTERPOLATIONS)
def test_outside_the_ends_hold(way):
    signal = SampledSignal(TIME, VALUES, way)
    for t, row in ((-1.0, 0), (9.0, -1)):
        assert np.array_equal(signal.at(t).value, VALUES[row])
        assert not signal.at(t).rate.any()
    assert signal.at(0.5).integral[0] == 0.0


@pytest.mark.parametrize("way", INTERPOLATIONS)
def test_a_table_that_repeats_goes_on_as_it_began(way):
    once, again = (SampledSignal(TIME, VALUES, way, repeats) for repeats in (False, True))
    lap = once.at(5.0).integral
    for t in (0.5, 1.7, 4.9):
        for laps in (-1, 2):
            np.testing.assert_allclose(again.at(t + 4.5 * laps).value, once.at(t).value, atol=1e-12)
            np.testing.assert_allclose(again.at(t + 4.5 * laps).integral, once.at(t).integral + laps * lap, atol=1e-12)


def test_any_order_of_times_finds_the_same():
    x = np.cumsum(np.random.default_rng(4).uniform(0.1, 1.0, 500))
    signal = SampledSignal(x, x[:, None] ** 2, LINEAR)
    for t in np.random.default_rng(5).uniform(x[0], x[-1], 500):
        assert signal.at(t).value[0] == pytest.approx(np.interp(t, x, x**2), rel=1e-14)


def test_a_step_costs_the_same_however_long_the_table_is():
    def cost(rows):
        signal = SampledSignal(np.arange(rows) * 1e-3, np.zeros((rows, 2)), LINEAR)
        times = (0.5 * rows + np.arange(500)) * 1e-3
        signal.at(times[0])
        least = np.inf
        for _ in range(5):
            begin = time.process_time()
            for t in times.tolist():
                signal.at(t)
            least = min(least, time.process_time() - begin)
        return least

    assert cost(300_000) < 3.0 * cost(1_000)
