"""The nominal height of a line: straight from support to support, of the lowest wire, around a ring."""

import numpy as np
import pytest

from models.catenary.line_part import CatenaryPart
from models.catenary.statics.nominal_height import NominalHeight
from models.coupled.monolithic import CoupledModel
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from models.pantograph.operation import Drive


def graded(line_maker, rise):
    """Return a line whose wire is level to 100 m, then rises to 200 m."""
    heights = [5.0, 5.0, 5.0 + rise, 5.0 + rise]
    return line_maker(
        measured={"positions": [[-50.0, 100.0, 200.0, 350.0], "m", "test"], "heights": [heights, "m", "test"]}
    )


@pytest.fixture(scope="module")
def slope(line_maker):
    part = CatenaryPart(graded(line_maker, 0.2), pantographs=2)
    part.initialise(0.0, strips(30.0, 140.0, 40.0))
    return part


def strips(first, second, speed, z=4.5):
    ends = [[[[x, side, z], [speed, 0.0, 0.0]] for side in (0.7, -0.7)] for x in (first, second)]
    return np.array(ends)


def test_it_is_straight_between_supports_and_its_rate_goes_with_the_strip(slope):
    z1, z2, rate1, rate2 = slope.nominal
    assert (z1, rate1) == (pytest.approx(5.0, abs=1e-12), pytest.approx(0.0, abs=1e-12))
    # 0.2 m over 100 m: slope 0.002, at 40 m/s 0.08 m/s; no sag, which is 50 mm here.
    assert (z2, rate2) == (pytest.approx(5.08, abs=1e-12), pytest.approx(0.08, abs=1e-12))


def test_it_goes_with_the_steps(slope):
    slope.step(strips(30.0, 140.0, 40.0), 0.5)
    assert slope.nominal[1] == pytest.approx(5.12, abs=1e-12)


def test_beyond_the_supports_it_is_level(slope):
    nominal = NominalHeight(slope.definition)
    assert nominal.at(-500.0) == (pytest.approx(5.0, abs=1e-12), 0.0)
    assert nominal.at(900.0)[1] == 0.0


def test_where_sections_overlap_it_is_the_lower_wire(sections_maker, section_maker):
    zigzag = [0.2, -0.2] * 2
    first, second = section_maker(0.0, 5, zigzag), section_maker(150.0, 5, zigzag)
    nominal = NominalHeight(sections_maker(first, second))
    assert nominal.at(225.0) == (pytest.approx(5.08, abs=1e-12), pytest.approx(0.0, abs=1e-12))


def test_a_ring_goes_on_where_it_begins(ring_maker):
    nominal = NominalHeight(ring_maker())
    assert nominal.at(5.0 * 500.0 + 120.0) == nominal.at(120.0)
    assert nominal.at(-30.0) == nominal.at(470.0)


def test_one_system_gives_a_following_pantograph_the_rate_of_its_line(slope, cx):
    """As the part in a co-simulation does that is told 0.08 m/s by the line: the strip is below any wire."""
    values = {"follow_height": 1, "speed": 40.0, "start_position": 120.0, "raise_duration": 0.0, "static_force": 0.0}
    definition = cx.with_values(values | {"reference_height": 3.0})
    coupled, part = CoupledModel(slope.model, [definition]), LumpedPantographPart(definition)
    part.initialise(0.0, 0.0, np.zeros(3), np.zeros(2), Drive(reference_rate=0.08))
    for n in range(100):
        coupled.step(1e-3, (n + 1) * 1e-3)
        part.step(0.0, np.zeros(3), np.zeros(2), 1e-3, Drive(reference_rate=0.08))
    (state,) = coupled.states
    assert state.reference == pytest.approx(part.state.reference, rel=1e-9)
    assert state.displacement[-1] == pytest.approx(part.state.displacement[-1], rel=1e-6)
    assert state.reference > 1e-3


def test_supports_with_heights_of_their_own_are_joined(line_maker):
    heights = [[5.3, 5.3, 5.2, 5.2, 5.2], "m", "test"]
    nominal = NominalHeight(line_maker(supports={"contact_wire_height": heights}))
    assert nominal.at(125.0) == (pytest.approx(5.25, abs=1e-12), pytest.approx(-0.002, abs=1e-12))
