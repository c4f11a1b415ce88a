"""Limits by norms: as printed, and between their rows."""

import pytest

from models.library.norm_tables import gradient_limits, support_limits


@pytest.mark.parametrize(
    ("speed", "ife", "en"),
    [(50, 20, 25), (60, 20, 20), (61, 6, 6), (100, 6, 6), (120, 4, 4), (160, 2, 3.3), (161, 1, 2), (200, 1, 2),
     (250, 0.4, 1), (251, 0.4, 0), (350, 0.4, 0)],
)  # fmt: skip
def test_gradients_by_the_speed_of_the_line(speed, ife, en):
    adif, european = gradient_limits()
    assert (adif.name, european.name) == ("IFE 6.3", "EN 50119:2009, table 12 (from memory: check)")
    assert [1e3 * norm.at(speed / 3.6) for norm in (adif, european)] == pytest.approx([ife, en])
    assert (adif.change, european.change) == (0.5, 0.5)


def test_loads_of_arms():
    limits = support_limits()
    assert (limits.largest_lateral, limits.largest_with_proof, limits.smallest_lateral) == (2500.0, 4000.0, 80.0)
    assert limits.shortest_dropper == 0.25
