"""Patterns of variable names."""

import pytest

from master.system.variable_names import matcher

NAME = "clock.pantograph[1].contact.force"


@pytest.mark.parametrize(
    ("pattern", "name", "fits"),
    [
        ("*.dropper[*].force", "catenary.dropper[12].force", True),
        ("*.dropper[*].force", "catenary.dropper[12].forces", False),
        ("catenary.support[1].uplift", "catenary.support[1].uplift", True),
        ("catenary.support[1].uplift", "catenary.support1.uplift", False),
        ("a.b", "a_b", False),
    ],
)
def test_patterns_take_only_the_star_as_special(pattern, name, fits):
    assert matcher(pattern)(name) is fits
