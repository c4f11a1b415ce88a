"""Test-rig figures of lumped pantographs against the equations of motion: statics over height, modes, apparent mass."""

from __future__ import annotations

import numpy as np
import pytest

from models.pantograph.lumped.lumped_definition import Stage
from models.pantograph.lumped.lumped_model import LumpedModel
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from models.pantograph.lumped.lumped_rig import apparent_mass, contact_force_over_height, modes


def _one(cx, mass, stiffness, damping):
    return cx.__class__(**{**cx.__dict__, "stage": (Stage(mass, stiffness, damping),)})


def test_the_contact_force_is_what_holds_the_strip_at_a_height(cx):
    """From K y = f with the uplift on the lowest mass and the contact on the strip, whose height comes out."""
    definition = cx.with_values({"static_force": 130.0})
    heights = cx.reference_height + np.array([-0.1, 0.0, 0.02, 0.15])
    found = contact_force_over_height(definition, heights)
    K = LumpedModel(definition).K
    for height, force in zip(heights, found, strict=True):
        rise = np.linalg.solve(K, [130.0, 0.0, -force])
        assert cx.reference_height + rise[-1] == pytest.approx(height, abs=1e-12)
    # Of springs in a row: each newton pushes the strip down by all of them, the uplift lifts by the lowest alone.
    k = [stage.stiffness for stage in cx.stage]
    assert found[1] == pytest.approx(130.0 / k[0] / sum(1.0 / each for each in k))
    assert (np.diff(found) < 0.0).all()


@pytest.mark.parametrize(("damping", "frequency", "share"), [(4.0, 10.0 / (2.0 * np.pi), 0.1), (80.0, 0.0, None)])
def test_modes_of_one_mass_are_those_of_the_damped_oscillator(cx, damping, frequency, share):
    """2 kg on 200 N/m: 10 rad/s; c / 2 sqrt(k m) of its critical damping, and no oscillation beyond it."""
    found = modes(_one(cx, 2.0, 200.0, damping))
    assert found[0].frequency == pytest.approx(frequency)
    if share is None:
        assert [mode.damping for mode in found] == pytest.approx([1.0, 1.0])
    else:
        (mode,) = found
        assert mode.damping == pytest.approx(share)


def test_a_mode_dies_out_as_its_frequency_and_damping_say(cx):
    """From mode to eigenvalue and back: det(s^2 M + s C + K) vanishes at s = w (-share + i sqrt(1 - share^2))."""
    model = LumpedModel(cx)
    swinging = [mode for mode in modes(cx) if mode.frequency > 0.0]
    assert swinging
    for mode in swinging:
        s = 2.0 * np.pi * mode.frequency * complex(-mode.damping, np.sqrt(1.0 - mode.damping**2))
        singular = np.linalg.svd(s**2 * model.M + s * model.C + model.K, compute_uv=False)
        assert singular[-1] < 1e-8 * singular[0]
        assert mode.damping > 0.0


def test_apparent_mass_far_above_all_modes_is_that_of_the_strip_and_below_them_that_of_the_spring(cx):
    high, low = apparent_mass(cx, np.array([1e4, 1e-3]))
    assert high.real == pytest.approx(cx.stage[-1].mass, rel=1e-3)
    in_a_row = 1.0 / sum(1.0 / stage.stiffness for stage in cx.stage)
    assert low.real == pytest.approx(-in_a_row / (2.0 * np.pi * 1e-3) ** 2, rel=1e-3)


def test_apparent_mass_is_force_over_acceleration_of_the_moving_pantograph(cx):
    """Shaken at its strip by a sine: the part in step with the acceleration, from the time integration."""
    frequency, h, amplitude = 5.0, 1e-3, 50.0
    part = LumpedPantographPart(cx.with_values({"static_force": 0.0, "speed": 0.0}))
    part.initialise(0.0, 0.0, np.zeros(3), np.zeros(2))
    count, last = round(8.0 / h), round(2.0 / h)
    time, acceleration = h * np.arange(1, count + 1), np.empty(count)
    for n in range(count):
        # A contact force pushes down; a rig's force is positive up.
        part.step(amplitude * (1.0 + np.sin(2.0 * np.pi * frequency * n * h)), np.zeros(3), np.zeros(2), h)
        acceleration[n] = part.state.acceleration[-1]
    wave = np.exp(-2j * np.pi * frequency * time[-last:])
    of_force = -amplitude * np.mean(np.sin(2.0 * np.pi * frequency * time[-last:]) * wave)
    of_acceleration = np.mean(acceleration[-last:] * wave)
    assert of_force / of_acceleration == pytest.approx(apparent_mass(cx, np.array([frequency]))[0], rel=5e-3)
