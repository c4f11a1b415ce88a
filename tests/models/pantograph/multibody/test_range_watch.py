"""Stops and ranges of a mechanism in a run: what holds, and what is told of it once."""

import re

import numpy as np
import pytest

from models.library.catalogue import load_pantograph
from models.pantograph.multibody.analysis.posture import check_heights
from models.pantograph.multibody.mechanism_reading import read_mechanism
from models.pantograph.multibody.multibody_part import MultibodyPantographPart
from tests.effort import rest
from tests.models.pantograph.multibody.mechanisms import LIBRARY

NOTHING = np.zeros(2)


@pytest.fixture(scope="module")
def cam():
    return MultibodyPantographPart(load_pantograph("generic_multibody_cam"))


def driven(part, force, stop, height=None, step=2e-3):
    """Return the places of all bodies step by step, and what was told; the contact is at the strip, or at a height."""
    definition = part.definition
    part.initialise(0.0, force(0.0), np.array([0.0, 0.0, 5.02]), NOTHING)
    rows, told = [], []
    for n in range(round(stop / step)):
        t = n * step
        z = part.strip[0, 0, 2] if height is None else height
        part.step(force(t), np.array([definition.speed * t, 0.0, z]), NOTHING, step)
        rows.append(part.observation_values()[: 3 * 6 : 3] - 3.533)
        told += part.told
        part.told.clear()
    return np.array(rows), told


def test_ten_kilonewtons_press_it_on_its_stops_and_no_body_through_the_roof(cam):
    """The base's origin stands on the roof; so does every body in the end, and the strip within 0.1 m of its stop."""
    bodies, told = driven(cam, lambda t: 1e4 * min(1.0, 2.0 * t), 1.6)
    assert bodies[-1].min() > 0.0
    assert cam.strip[0, 0, 2] > 4.456 - 0.1
    stops = [text for text in told if "at its stop" in text]
    assert ["head_stop" in text for text in stops] == [True, False]
    assert "at its stops, head_stop_left (shortest) and head_stop_right (shortest)" in stops[0]
    assert "at its stop, arm_stops (lowest)" in stops[1]


def test_a_hit_of_five_kilonewtons_does_not_drive_the_head_through_what_carries_it(cam):
    bodies, told = driven(cam, lambda t: 157.5 if not 0.1 <= t < 0.12 else 5e3, 0.3)
    assert (bodies[:, 5] - bodies[:, 4]).min() > 0.0
    assert sum("at its stop" in text for text in told) == 1
    assert told[0].startswith("t = 0.110 s, x = 9.2 m")


def test_it_is_raised_from_folded_and_says_that_it_has_met_no_wire():
    table = load_table("generic_multibody_cam")
    table.data["start_height"] = [4.5, "m", "test"]
    part = MultibodyPantographPart(read_mechanism(table).with_values({"raise_duration": 0.2}))
    bodies, told = driven(part, lambda t: 0.0, 1.7, step=5e-3)
    assert np.all(np.diff(bodies[2:200, 5]) > 0.0)
    assert "arm_stops (highest)" in told[0]
    assert told[0].endswith("it has met no wire on the way")


def test_a_contact_outside_the_range_is_told_with_the_range(cam):
    _, told = driven(cam, lambda t: 157.5, 0.1, height=6.4)
    assert len(told) == 1
    assert "contact at a height of 6.400 m, outside the range of the pantograph, 4.456 to 6.224 m" in told[0]


def test_a_cam_that_is_left_is_told_and_held():
    """A table from -2 to 2 degrees about the written place, and a moment that lifts beyond."""
    table = load_table("generic_multibody")
    table.data["force"]["lift"]["cam"] = {
        "angle": [[-2.0, 0.0, 2.0], "deg", "test"], "moment": [[1.0, 1.0, 1.0], "N.m", "test"]
    }  # fmt: skip
    part = MultibodyPantographPart(read_mechanism(table).with_values({"static_moment": 1500.0}))
    _, told = driven(part, lambda t: 0.0, 0.6)
    assert len(told) == 1
    assert "'lift' is at 2." in told[0]
    assert "outside the table of its cam, -2.00 deg to 2.00 deg" in told[0]


def load_table(name):
    from models.definition_files.toml_reader import Table

    return Table.load(LIBRARY / f"{name}.toml")


@pytest.mark.parametrize("height", [6.3, *rest(4.4)])
def test_a_start_beyond_the_stops_is_refused_with_the_range_between_them(height):
    table = load_table("generic_multibody_cam")
    table.data["start_height"] = [height, "m", "test"]
    part = MultibodyPantographPart(read_mechanism(table))
    told = rf"start_height = {height} m is beyond the stop 'arm_stops': .* goes from 4\.456 to 6\.224 m"
    with pytest.raises(ValueError, match=told):
        part.initialise(0.0, 0.0, np.zeros(3), NOTHING)
    assert re.match(told, check_heights(part.definition))
