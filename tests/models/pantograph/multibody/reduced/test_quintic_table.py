"""Functions in a table are those that went in, with two continuous derivatives."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from models.pantograph.multibody.reduced.quintic_table import CELLS, points_of, tabulated


def functions(x):
    return np.stack([np.sin(3.0 * x), x**2, np.exp(-x) / (1.2 - x)], axis=-1)


def table_over(edges):
    values = np.stack([functions(points_of(a, b)) for a, b in itertools.pairwise(edges)])
    return tabulated(edges, values)


def test_a_table_gives_the_functions_back():
    table, doubt = table_over(np.linspace(-0.5, 0.7, 9))
    places = np.linspace(-0.5, 0.7, 333)
    found = np.array([table.at(x) for x in places])
    assert doubt.max() < 1e-3
    assert np.abs(found - functions(places)).max() < 1e-11


def test_a_cell_holds_fifth_degree_and_errs_by_the_sixth_power_of_its_length():
    """x^6 less its Hermite polynomial of fifth degree is (x (x - h))^3 over a cell of length h: h^6/64 halfway."""
    for length in (1.0, 2.0):
        powers = points_of(0.0, length)[:, None] ** np.arange(7)
        table, _ = tabulated(np.array([0.0, length]), powers[None])
        h = length / CELLS
        left = table.at(0.5 * h) - (0.5 * h) ** np.arange(7)
        assert np.abs(left[:6]).max() < 1e-14
        assert left[6] == pytest.approx(h**6 / 64.0, rel=1e-6)


def test_a_panel_too_coarse_is_doubted():
    _, doubt = table_over(np.array([-6.0, -2.0, 1.19]))
    assert doubt[0] < doubt[1]
    assert doubt[1] > 1.0
