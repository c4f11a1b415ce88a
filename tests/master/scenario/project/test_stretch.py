"""Where a run along a line begins, is evaluated and ends."""

from dataclasses import replace

import pytest

from master.errors import RequestError
from master.scenario.project.stretch import Wire, contained, early, stretch

WIRE = Wire("LN2", 100.0, 1300.0, tuple(range(100, 1301, 50)), 5.03, 5.08)


def test_the_interval_lies_between_supports_behind_the_starts_motion():
    found = stretch(WIRE, 50.0, [], None)
    assert found.starts == (110.0,)  # a margin behind the beginning
    assert found.interval == (300.0, 800.0)  # 3 s later; ten spans
    assert found.stop == pytest.approx((800.0 - 110.0) / 50.0 + 0.5)


def test_every_pantograph_of_a_train_is_on_the_wire_from_the_start_to_the_end():
    found = stretch(WIRE, 50.0, [200.0, 100.0], None)
    assert found.starts == (410.0, 210.0, 110.0)
    assert found.interval == (600.0, 950.0)  # the leading one is 300 m ahead when the last one leaves it
    leading = found.starts[0] + 50.0 * ((found.interval[1] - found.starts[-1]) / 50.0 + 0.5)
    assert leading <= WIRE.end


def test_an_interval_far_along_the_line_is_not_approached_from_its_beginning():
    found = stretch(WIRE, 50.0, [], (1000.0, 1200.0))
    assert found.starts == (700.0,)
    assert found.interval == (1000.0, 1200.0)


def test_a_line_that_is_not_known_needs_an_interval():
    assert stretch(None, 50.0, [20.0], (400.0, 600.0)).starts == (100.0, 80.0)
    with pytest.raises(RequestError, match="give --interval"):
        stretch(None, 50.0, [], None)


def test_a_ring_has_room_for_an_interval_up_to_its_end():
    ring = (
        WIRE._replace(is_ring=True) if hasattr(WIRE, "_replace") else Wire("r", 0.0, 500.0, (0, 250, 500), 5, 5, True)
    )
    assert stretch(ring, 50.0, [], None).interval == (250.0, 500.0)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"speed": 0.0}, "--speed 0: give the speed of the train in km/h, more than 0 and at most 612"),
        ({"speed": -3.0}, "--speed -10.8: "),
        ({"speed": float("nan")}, "--speed nan: "),
        ({"separations": [0.5]}, "--separation 0.5: pantographs of a train stand at least 1 m apart"),
        ({"separations": [float("inf")]}, "--separation inf: "),
        (
            {"separations": [1100.0]},
            "LN2 is at its working height from 100 to 1300 m, too short for a train of pantographs",
        ),
        ({"interval": (500.0, 500.0)}, "--interval 500 500: the first number must be the smaller one"),
        ({"interval": (500.0, 2000.0)}, "so the interval must lie between 110 and 1275 m"),
        ({"interval": (100.0, 400.0)}, "the contact wire of LN2 is at its working height from 100 to 1300 m"),
        ({"interval": (500.0, 600.0), "separations": [900.0]}, "no room for this train and an interval"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(change, said):
    given = {"wire": WIRE, "speed": 50.0, "separations": [], "interval": None} | change
    with pytest.raises(RequestError) as error:
        stretch(**given)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_the_interval_lies_about_an_overlap_that_has_room():
    wire = replace(WIRE, overlaps=((850.0, 950.0),))
    way = stretch(wire, 50.0, [], None)
    assert way.interval == (650.0, 1150.0)  # ten spans, the overlap in the middle
    assert contained(wire, way) == (850.0, 950.0)
    late = replace(WIRE, overlaps=((1150.0, 1250.0),))
    assert stretch(late, 50.0, [], None).interval == (750.0, 1250.0)
    none = replace(WIRE, overlaps=((100.0, 150.0),))  # the start is there
    assert stretch(none, 50.0, [], None).interval == stretch(WIRE, 50.0, [], None).interval
    assert contained(none, stretch(none, 50.0, [], None)) is None


def test_an_interval_in_the_motion_of_the_start_is_told():
    way = stretch(WIRE, 50.0, [], (150.0, 600.0))
    assert way.starts == (110.0,)
    assert "begin at 170 m or later" in early(way, 50.0, 0.2)
    assert early(stretch(WIRE, 50.0, [], (170.0, 600.0)), 50.0, 0.2) == ""
