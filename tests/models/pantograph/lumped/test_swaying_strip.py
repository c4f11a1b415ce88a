"""The strip of a lumped pantograph on a roof that moves sideways and rolls."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.numerics.kernel_cache import SWITCH
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from models.pantograph.operation import Drive, OperationError

POINT, H = np.zeros(3), 1e-3


@pytest.fixture(params=["numpy", "auto"], autouse=True)
def kernel(request, monkeypatch):
    monkeypatch.setenv(SWITCH, request.param)


def sway_at(t):
    return 0.05 * np.sin(3 * t), 0.15 * np.cos(3 * t), 0.04 * np.sin(5 * t), 0.2 * np.cos(5 * t), 0.0, 0.0


def base_at(t):
    return np.array([0.01 * np.sin(4 * t), 0.04 * np.cos(4 * t)])


def run(cx, steps, swaying=True, base_height=4.0):
    part = LumpedPantographPart(replace(cx.with_values({"strip_offset": 0.1}), base_height=base_height))
    part.initialise(0.0, 0.0, POINT, base_at(0.0), Drive(sway=sway_at(0.0)) if swaying else Drive())
    for n in range(steps):
        t = n * H
        part.step(100.0, POINT, base_at(t), H, Drive(sway=sway_at(t)) if swaying else Drive())
    return part


def test_ends_are_turned_about_the_base_and_shifted(cx):
    """By rotation matrices, from where they are on a roof that does not sway; the masses notice nothing."""
    level, turned = run(cx, 200, swaying=False), run(cx, 200)
    assert np.array_equal(level.observation_values(), turned.observation_values())
    t = 199 * H
    y, vy, roll, rate, *_ = sway_at(t)
    y, roll = y + H * vy, roll + H * rate
    base = base_at(t)
    foot = np.array([0.0, 0.0, 4.0 + base[0] + H * base[1]])
    turn = Rotation.from_rotvec([roll, 0.0, 0.0])
    for end in range(2):
        above = level.strip[end, 0] - [level.strip[end, 0, 0], 0.0, foot[2]]
        expected = turn.apply(above) + foot + [level.strip[end, 0, 0], y, 0.0]
        assert turned.strip[end, 0] == pytest.approx(expected, abs=1e-12)
        climbing = level.strip[end, 1] - [0.0, 0.0, base[1]]
        around = np.cross([rate, 0.0, 0.0], turn.apply(above))
        expected = turn.apply(climbing) + around + [0.0, vy, base[1]]
        assert turned.strip[end, 1] == pytest.approx(expected, abs=1e-12)
    assert turned.strip[0, 0, 2] - turned.strip[1, 0, 2] == pytest.approx(np.sin(roll) * cx.strip_length)


def test_a_strip_that_is_level_again_is_as_before(cx):
    part, level = run(cx, 50), run(cx, 51, swaying=False)
    part.step(100.0, POINT, base_at(50 * H), H)
    assert np.array_equal(part.strip, level.strip)


def test_goes_on_from_a_snapshot(cx):
    part, other = run(cx, 50), run(cx, 3, swaying=False)
    other.restore(part.snapshot())
    assert np.array_equal(other.strip, part.strip)


def test_roll_needs_the_height_of_the_base(cx):
    part = run(cx, 1, swaying=False, base_height=None)
    with pytest.raises(OperationError, match=r"base\.roll turns the strip about the base, whose height nothing says"):
        part.step(100.0, POINT, base_at(H), H, Drive(sway=(0.0, 0.0, 0.01, 0.0, 0.0, 0.0)))
    part.step(100.0, POINT, base_at(H), H, Drive(sway=(0.03, 0.0, 0.0, 0.0, 0.0, 0.0)))
    assert part.strip[:, 0, 1].mean() == pytest.approx(0.13)
