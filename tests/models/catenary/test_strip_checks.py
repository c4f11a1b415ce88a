"""Strips that a line cannot be meant for."""

import numpy as np
import pytest

from models.catenary.strip_checks import WireAtRest, check_strips, start_warning
from models.definition_files.parameter import ParameterError


def wire(stagger, first=0.0, last=200.0, height=5.0, shift=0.0):
    """A wire that zigzags every 50 m about y = ``shift``."""
    x = np.linspace(first, last, 201)
    y = shift + stagger * (2.0 * np.abs(((x / 50.0) % 2.0) - 1.0) - 1.0)
    return WireAtRest(np.column_stack((x, y, np.full_like(x, height))), (first, last))


def strip(x=10.0, z=4.99, half=0.7, offset=0.0):
    """One pantograph's strip, shape (1, 2, 2, 3)."""
    ends = [[[x, offset + side, z], [80.0, 0.0, 0.0]] for side in (half, -half)]
    return np.array([ends])


def check(wires, strips, force=0.0):
    check_strips(wires, strips, np.array([force]))


def test_a_strip_at_work_is_taken():
    check([wire(0.2)], strip(), 150.0)


def test_a_strip_above_the_wire_is_refused_with_its_height():
    with pytest.raises(ParameterError, match=r"stands at 5\.300 m, 300 mm above .* 6e\+03 N: lower .* to 5\.000 m"):
        check([wire(0.2)], strip(z=5.3), 6000.0)


def test_one_that_is_pushed_into_the_wire_is_warned_of():
    wires, strips = [wire(0.2)], strip(z=5.04)
    check(wires, strips, 800.0)
    assert "40 mm above the contact wire" in start_warning(wires, strips, np.array([800.0]))
    assert start_warning(wires, strips, np.array([300.0])) == ""


@pytest.mark.parametrize(("half", "offset", "y"), [(0.15, 0.0, "-0.1"), (0.7, 0.6, "-0.1"), (0.7, -0.6, "0.1")])
def test_a_strip_that_misses_the_wire_is_refused_with_the_place(half, offset, y):
    with pytest.raises(ParameterError, match=rf"lies at y = {y}\d+ m at x = \d+ m: make strip_length longer"):
        check([wire(0.2)], strip(half=half, offset=offset))


def test_a_longer_strip_is_the_cure():
    check([wire(0.2)], strip(half=0.2))


def test_what_lies_behind_or_is_no_longer_at_work_does_not_count():
    wide, narrow = wire(0.2, 0.0, 100.0), wire(0.05, 0.0, 300.0)
    working_behind = WireAtRest(wide.points, (0.0, 5.0))
    check([working_behind], strip(half=0.1))
    check([narrow], strip(half=0.1))


def test_in_an_overlap_one_wire_is_enough():
    """The second wire runs beside the strip where the first one is over it."""
    check([wire(0.1), wire(0.1, shift=1.0)], strip(half=0.2))
    with pytest.raises(ParameterError, match="lies at y = "):
        check([wire(0.1, 0.0, 100.0), wire(0.1, 0.0, 200.0, shift=1.0)], strip(half=0.2))


def test_a_strip_far_below_is_none_at_work():
    check([wire(0.5)], strip(z=-100.0, half=0.1))
