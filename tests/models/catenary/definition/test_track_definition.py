"""The tables [track] and [supports]: what they take, and every mistake in words, all at once."""

import pytest

from models.catenary.definition.track_definition import Track
from models.definition_files.parameter import ParameterError
from models.definition_files.toml_reader import DefinitionError


def of(unit, *values):
    return [list(values), unit, "test"]


def test_a_radius_is_a_curvature():
    by_radius = Track(positions=(0.0, 10.0, 20.0), radius=(0.0, 500.0, -250.0))
    assert by_radius.curvatures == (0.0, 0.002, -0.004)
    assert by_radius.cants == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"curvature": of("1/m", 0.0)}, "track.positions: is missing"),
        ({"positions": of("m", 0, 50)}, "track: says nothing of the track"),
        ({"positions": of("m", 50, 0), "radius": of("m", 0, 600)}, "not in rising order: 0 m comes after 50 m"),
        ({"positions": of("m", 0, 0, 0), "radius": of("m", 0, 600, 0)}, "one place more than twice"),
        ({"positions": of("m", 0, 50), "radius": of("m", 600)}, "track.radius: gives 1 values for 2 positions"),
        (
            {"positions": of("m", 0), "radius": of("m", 600), "curvature": of("1/m", 0.001)},
            "track.radius: says what curvature says",
        ),
        ({"positions": of("m", 0), "radius": of("m", -5)}, "track.radius: -5 m: no track is as tight"),
        ({"positions": of("m", 9, 9), "cant": of("mm", 0, 100)}, "track.cant: jumps from 0 to 100 mm at 9 m"),
        ({"positions": of("m", 0), "cant": of("mm", 450)}, "track.cant: 0.45 m is outside"),
        ({"positions": of("m", 0), "cant": of("m", 0.29), "base": [0.4, "mi", "x"]}, "track.base: unknown unit"),
        (
            {"positions": of("m", 0), "radius": of("m", 600), "base": [1.0, "m", "x"]},
            "track.base: 1 m says nothing where no cant is measured over it",
        ),
        ({"positions": of("m", 0), "curvature": of("1/m", float("nan"))}, "track.curvature: "),
        ({"positions": of("m", 0), "bank": of("mm", 0)}, "track.bank: unknown key"),
        ({"positions": of("m", 0, 0.01), "cant": of("mm", 0, 100)}, "track.cant: goes from 0 to 100 mm within 0.01 m"),
        ({"positions": of("m"), "radius": of("m", 600)}, "track.positions: gives no value"),
        ({"positions": of("m", 0), "cant": of("mm")}, "track.cant: gives no value"),
    ],
)
def test_mistakes_of_a_track(line_maker, table, said):
    with pytest.raises(DefinitionError) as caught:
        line_maker(track=table)
    assert said in str(caught.value)


def test_all_mistakes_are_said_at_once(line_maker):
    track = {"positions": of("m", 50, 0), "radius": of("m", 5, 5, 5), "cant": of("mm", 1)}
    with pytest.raises(DefinitionError) as caught:
        line_maker(track=track, supports={"stagger": of("m", 0.1, 0.2), "arm_side": "left"})
    text = str(caught.value)
    for key in ("track.positions", "track.radius", "track.cant", "supports.stagger", "supports.arm_side"):
        assert key in text


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({}, "supports: gives nothing of any support"),
        ({"stagger": of("m", 0.1, 0.2)}, "gives 2 values for 5 supports between the anchors"),
        ({"stagger": of("m")}, "supports.stagger: gives no value"),
        ({"encumbrance": of("m", 0.01)}, "supports.encumbrance: 0.01 m is outside"),
        ({"contact_wire_height": of("cm", 53)}, "supports.contact_wire_height: 0.53 m is outside"),
        ({"arm_side": of("1", 1, 1, 0.5, 1, 1)}, "supports.arm_side: 0.5: a side is 1"),
        ({"arm_side": "left"}, "supports.arm_side: 'left': a side is 1, to the left"),
        ({"arm_length": [1.2, "m"]}, "supports.arm_length: "),
        ({"heights": of("m", 5.3)}, "supports.heights: unknown key"),
        ({"structure": ["1", 2]}, "supports.structure: ['1', 2] is not a list of texts"),
        ({"structure": ["1", "2"]}, "gives 2 names for 5 supports, or 7 with the anchors"),
        ({"structure": ["1", "", "", "2", "1"]}, "supports.structure: '1' is the name of two supports"),
    ],
)
def test_mistakes_of_supports(line_maker, table, said):
    with pytest.raises(DefinitionError) as caught:
        line_maker(supports=table)
    assert said in str(caught.value)


@pytest.mark.parametrize("names", [["1", "2", "", "4", "5"], ["A", "1", "2", "", "4", "5", "B"]])
def test_supports_have_the_names_of_their_structures(line_maker, names):
    supports = line_maker(supports={"structure": names}).sections[0].supports
    assert [s.structure for s in supports] == (names if len(names) == 7 else ["", *names, ""])


def test_a_wrong_stagger_of_supports_is_one_mistake(line_maker):
    with pytest.raises(DefinitionError) as caught:
        line_maker(stagger=None, supports={"stagger": of("m", 0.1, 0.2)})
    assert str(caught.value).count("\n") == 0
    assert "gives 2 values for 5 supports" in str(caught.value)


def places_with(line_maker, anchor):
    """Return the places of the contact wire in plan, the anchors' and the others."""
    supports = line_maker(stagger={"amplitude": [0.2, "m", "x"], "anchor": anchor}).sections[0].supports
    return supports[0].stagger, supports[-1].stagger, [s.stagger for s in supports[1:-1]]


def test_anchors_have_a_place_in_plan_each_or_one_for_both(line_maker):
    inner = [0.2, -0.2, 0.2, -0.2, 0.2]
    assert places_with(line_maker, [0.1, "m", "x"]) == (0.1, 0.1, inner)
    assert places_with(line_maker, of("m", -0.3, 0.1)) == (-0.3, 0.1, inner)
    with pytest.raises(DefinitionError, match=r"stagger\.anchor: gives 3 values: give one for both"):
        places_with(line_maker, of("m", 1, 2, 3))


def test_values_of_arms_need_arms(line_maker):
    with pytest.raises(DefinitionError, match=r"supports\.arm_length: the line has no steady arms"):
        line_maker(supports={"arm_length": of("m", 1.0)}, steady_arm=None)


def test_heights_are_given_once(line_maker):
    measured = {"positions": of("m", 0, 300), "heights": of("m", 5.08, 5.08)}
    with pytest.raises(DefinitionError, match=r"contact_wire_height: gives the contact wire's heights, and so does"):
        line_maker(supports={"contact_wire_height": of("m", 5.3)}, measured=measured)


def test_a_ring_takes_a_constant_track_only(ring_maker):
    assert ring_maker(track={"positions": of("m", 0, 90), "radius": of("m", 600, 600)}).track.is_constant
    with pytest.raises(DefinitionError, match=r"track\.positions: a line that closes on itself takes a constant track"):
        ring_maker(track={"positions": of("m", 0, 90), "radius": of("m", 600, 700)})


def test_supports_have_values_of_their_own_and_others_are_line_wide(line_maker):
    line = line_maker(stagger=None, supports={"stagger": of("m", 0.1), "encumbrance": of("m", 1.4, 1.3, 1.2, 1.1, 1.0)})
    supports = line.sections[0].supports
    assert [s.stagger for s in supports] == [0.0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.0]
    assert [s.encumbrance for s in supports] == [1.4, 1.4, 1.3, 1.2, 1.1, 1.0, 1.0]
    assert {s.contact_wire_height for s in supports} == {None}


def test_what_every_support_has_of_its_own_is_no_parameter_of_the_line(line_maker):
    line = line_maker(supports={"contact_wire_height": of("m", 5.3)})
    names = {p.name for p in line.parameters()}
    assert "profile.encumbrance" in names
    assert "profile.contact_wire_height" not in names
    with pytest.raises(ParameterError, match=r"profile\.contact_wire_height': every support has its own"):
        line.with_values({"profile.contact_wire_height": 5.0})
