"""Inputs between communication points: polynomials, and the position as a time stamp."""

import numpy as np
import pytest

from models.numerics.extrapolation import ForceExtrapolation, StripExtrapolation, lead_of


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_polynomial_of_its_order_is_continued_exactly(order):
    coefficients = [200.0, 300.0, -4000.0][: order + 1]

    def force(t):
        return sum(c * t**k for k, c in enumerate(coefficients))

    extrapolation = ForceExtrapolation(order)
    extrapolation.start(0.0, force(0.0))
    for n in range(1, 4):
        extrapolation.receive(n * 1e-3, force(n * 1e-3))
    assert extrapolation.at(3.7e-3) == pytest.approx(force(3.7e-3), rel=1e-12)


def test_a_force_never_pulls_and_a_lost_contact_stays_lost():
    extrapolation = ForceExtrapolation(1)
    extrapolation.start(0.0, 20.0)
    extrapolation.receive(1e-3, 5.0)
    assert extrapolation.at(2e-3) == 0.0
    extrapolation.receive(2e-3, 0.0)
    assert extrapolation.at(3e-3) == 0.0


@pytest.mark.parametrize("order", [1, 2])
def test_a_lost_contact_has_no_trend(order):
    """A parabola through 100, 5, 0 N turns upward again, but a contact that is lost is not about to come back."""
    extrapolation = ForceExtrapolation(order)
    extrapolation.start(0.0, 100.0)
    extrapolation.receive(1e-3, 5.0)
    extrapolation.receive(2e-3, 0.0)
    assert [extrapolation.at(t) for t in (2e-3, 2.5e-3, 3e-3, 4e-3)] == [0.0] * 4
    extrapolation.receive(3e-3, 0.0)
    assert extrapolation.at(4e-3) == 0.0
    extrapolation.receive(4e-3, 30.0)
    assert extrapolation.at(4.5e-3) > 30.0


def test_a_value_for_the_same_time_replaces_the_last():
    extrapolation = ForceExtrapolation(1)
    extrapolation.start(0.0, 10.0)
    extrapolation.receive(1e-3, 11.0)
    extrapolation.receive(1e-3, 12.0)
    assert extrapolation.at(2e-3) == pytest.approx(14.0)


@pytest.mark.parametrize("speed", [10.0, 83.3, -83.3])
@pytest.mark.parametrize("step", [1e-4, 1e-3, 1e-2])
def test_position_tells_the_time(speed, step):
    assert lead_of(100.0 + speed * step, 100.0, speed, step) == step
    assert lead_of(100.0, 100.0, speed, step) == 0.0
    assert lead_of(100.0 + 0.02 * speed * step, 100.0, speed, step) == 0.0


def test_a_standing_pantograph_stamps_nothing():
    assert lead_of(100.0, 100.0, 0.0, 1e-3) == 0.0


def _strip(t, speed=80.0):
    """A strip that accelerates upward with 3 m/s2."""
    z, vz = 5.0 + 0.1 * t + 1.5 * t**2, 0.1 + 3.0 * t
    return np.array([[[speed * t, y, z], [speed, 0.0, vz]] for y in (0.7, -0.7)])


@pytest.mark.parametrize("lead", [0, 1])
def test_a_strip_of_constant_acceleration_is_found_at_the_end_of_the_step(lead):
    """Received at the step's beginning (jacobi) or stepped already (gauss-seidel): the same place at its end."""
    step = 1e-3
    extrapolation = StripExtrapolation(2)
    extrapolation.start(0.0, _strip(0.0))
    out = np.empty((2, 2, 3))
    for n in range(5):
        extrapolation.receive(n * step, _strip((n + lead) * step), step)
        extrapolation.at((n + 1) * step, out)
    assert out[:, 0] == pytest.approx(_strip(5 * step)[:, 0], abs=1e-12)
    assert out[:, 1] == pytest.approx(_strip(5 * step)[:, 1], abs=1e-12)


def test_snapshots_continue_identically():
    first, second = StripExtrapolation(2), StripExtrapolation(2)
    first.start(0.0, _strip(0.0))
    first.receive(0.0, _strip(0.0), 1e-3)
    first.receive(1e-3, _strip(1e-3), 1e-3)
    second.restore(first.snapshot())
    for extrapolation in (first, second):
        extrapolation.receive(2e-3, _strip(2e-3), 1e-3)
    assert np.array_equal(first.at(3e-3, np.empty((2, 2, 3))), second.at(3e-3, np.empty((2, 2, 3))))
