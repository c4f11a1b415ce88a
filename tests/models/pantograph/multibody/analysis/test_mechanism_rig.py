"""Figures of a pantograph on a rig."""

import numpy as np
import pytest

from models.pantograph.lumped.lumped_rig import chain_stiffness
from models.pantograph.multibody.analysis.mechanism_rig import Rig
from tests.models.pantograph.multibody.mechanisms import library


@pytest.fixture(scope="module")
def cx():
    return Rig(library("CX_multibody"))


@pytest.fixture(scope="module")
def rig():
    return Rig(library("generic_multibody"))


def test_lumped_masses_have_their_chains_response(cx):
    f = np.linspace(0.5, 20.0, 40)
    found = cx.dynamics(5.05, f)
    D = chain_stiffness(f, [5.58, 8.78, 7.75], [108.39, 0.009, 45.85], [178.45, 15487.0, 7000.0])
    np.testing.assert_allclose(found.receptance, 1.0 / D, rtol=1e-8)
    np.testing.assert_allclose(found.apparent_mass, -D / (2 * np.pi * f) ** 2, rtol=1e-8)


def test_lumped_statics_fall_with_the_lowest_spring(cx):
    found = cx.statics(np.linspace(4.8, 5.3, 6))
    np.testing.assert_allclose(found.balance, 178.45 * (found.height - 5.02), atol=1e-7)
    softened = 1.0 + 178.45 / 15487.0 + 178.45 / 7000.0  # a held strip: the stages above give way
    np.testing.assert_allclose(found.contact_force, (168.0 - found.balance) / softened, atol=1e-6)
    assert cx.lift_unit == "N"


def test_statics_reach_the_working_range_and_leave_out_what_is_beyond(rig):
    found = rig.statics(np.array([3.0, 4.6, 5.02, 5.3, 6.0, 9.0]))
    np.testing.assert_allclose(found.height, [4.6, 5.02, 5.3, 6.0])
    assert found.balance[1] == pytest.approx(936.1, abs=0.05)
    assert found.contact_force[1] == pytest.approx(157.5, abs=0.1)
    assert (np.diff(found.lift) > 0.0).all()
    assert rig.lift_unit == "N.m"


def test_modes_are_raise_roll_and_heave(rig):
    found = rig.dynamics(5.08, np.array([1.0, 5.0]))
    slow, roll, heave = sorted(found.modes, key=lambda m: m.frequency)
    head, arm = rig.mechanism.numbers["pan_head"], rig.mechanism.numbers["lower_arm"]
    assert abs(slow.shape[arm, 4]) > 0.1
    assert abs(roll.shape[head, 3]) == pytest.approx(1.0)
    assert abs(heave.shape[head, 2]) > abs(heave.shape[arm, 2])
    assert roll.frequency == pytest.approx(np.sqrt(2 * 3000 * 0.335**2 / 6.62) / (2 * np.pi), rel=0.02)


def test_response_off_centre_also_rolls(rig):
    f = np.array([roll_frequency := 1.6])
    centre, side = (rig.dynamics(5.08, f, lateral=y).receptance[0] for y in (0.0, 0.3))
    assert roll_frequency > 0.0
    assert abs(side - centre) > 1e-4
