"""What a scenario has to know of lines and pantographs."""

import pytest

from models.library.catalogue import line_names, load_line, load_pantograph
from models.library.definition_facts import LiftFacts, lift_facts, line_facts


@pytest.mark.parametrize("name", line_names())
def test_the_supports_lie_where_the_wire_is_at_its_working_height(name):
    found = line_facts(load_line(name))
    assert found.begin < found.end
    assert found.begin <= found.supports[0] < found.supports[-1] <= found.end
    assert list(found.supports) == sorted(set(found.supports))
    assert found.lowest <= found.height
    assert found.changes_height == (name == "AC_mixed")
    assert found.height - found.lowest < (0.3 if found.changes_height else 0.1)
    assert found.is_ring == (name == "LN2_ring")


def test_figures_of_ln2_are_those_of_its_definition():
    found = line_facts(load_line("LN2"))
    assert (found.begin, found.end, len(found.supports)) == (86.9, 1046.9, 21)
    assert found.lowest == pytest.approx(5.08 - 0.05)


@pytest.mark.parametrize(
    ("name", "facts"),
    [
        ("CX", LiftFacts("static_force", "N", 168.0, True)),
        ("CX_multibody", LiftFacts("static_force", "N", 168.0, False)),
        ("generic_multibody", LiftFacts("static_moment", "N.m", 1313.7, False)),
    ],
)
def test_what_lifts_a_pantograph_is_a_force_or_a_moment(name, facts):
    assert lift_facts(load_pantograph(name)) == facts


@pytest.mark.parametrize(("rise", "changes"), [(0.01, False), (0.2, True)])
def test_a_line_changes_height_if_its_supports_do(line_maker, rise, changes):
    heights = {"positions": [[-50.0, 20.0, 350.0], "m", "test"], "heights": [[5.0, 5.0, 5.0 + rise], "m", "test"]}
    assert line_facts(line_maker(measured=heights)).changes_height is changes
    assert not line_facts(line_maker()).changes_height
