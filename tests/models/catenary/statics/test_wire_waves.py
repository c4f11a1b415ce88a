"""Waves with the tensions of the day: against the formula, with what weights and fixed ends leave of the tension."""

import dataclasses
import math

import pytest

from models.catenary.condition.tensioning import anchored_tension
from models.catenary.definition.tensioning_definition import Tensioning, TensioningDevice
from models.catenary.statics.temperature_table import temperature_table
from models.catenary.statics.wire_waves import contact_wire_wave_speed, waves
from models.interface.line_and_pantograph import Line
from models.interface.line_statics import statics
from tests.models.conftest import make_fault

REFERENCE = 288.15


def tensioned(line, temperature=REFERENCE, **devices):
    made = {name: TensioningDevice(**values) for name, values in devices.items()}
    tensioning = Tensioning(temperature=temperature, reference_temperature=REFERENCE, **made)
    return dataclasses.replace(line, tensioning=tensioning)


def test_a_wire_between_fixed_ends_carries_slower_waves_in_the_heat(line_maker):
    """Without pre-sag it has T = T_0 - EA expansion: of 20 kN 30 K take 9.18."""
    line = line_maker(profile={n: [v, "m", "t"] for n, v in (("contact_wire_height", 5.08), ("encumbrance", 1.4))})
    fixed = tensioned(line, contact_wire={"kind": "fixed"})
    hot, design = temperature_table(fixed, [REFERENCE + 30.0, REFERENCE], speed=60.0)
    wire = line.contact_wire
    EA = wire.area * wire.youngs_modulus
    T = anchored_tension(wire.tension, EA, 0.0, 50.0, 17e-6 * 30.0)
    assert pytest.approx(wire.tension - EA * 17e-6 * 30.0) == T
    C = math.sqrt((T + wire.EI * (math.pi / 50.0) ** 2) / wire.mass)
    assert hot.waves.speed == pytest.approx(C, rel=1e-9)
    above, below = (math.sqrt(tension * w.mass) for tension, w in ((14e3, line.messenger_wire), (T, wire)))
    assert hot.waves.reflection == pytest.approx(above / (above + below), rel=5e-3)  # the messenger wire loses some
    assert hot.waves.doppler == pytest.approx((C - 60.0) / (C + 60.0))
    assert design.waves == waves(line, 60.0, 50.0)
    # The line at rest of that temperature says the same of a span without losses.
    found = statics(Line(fixed.with_values({"tensioning.temperature": REFERENCE + 30.0})), speed=60.0)
    assert found.waves.speed == pytest.approx(C, rel=1e-9)


def test_friction_in_the_weights_slows_waves_by_its_root(short_line):
    line = tensioned(short_line, contact_wire={"efficiency": 0.95})
    line = line.with_values({"tensioning.direction": 1})
    (found,) = temperature_table(line, [REFERENCE])
    share = found.waves.speed / waves(short_line, 0.0, 50.0).speed
    assert share == pytest.approx(math.sqrt(0.95), rel=1e-3)  # bending stays


def test_a_wire_that_has_lost_tension_carries_slower_waves(ln2):
    """By the square root of what is left, where the fault acts: in the warning of the speed and in the FMU."""
    loss = make_fault("tension_loss", wire="contact_wire", value=0.19)
    faster, slower = (
        contact_wire_wave_speed(dataclasses.replace(ln2, fault=(fault,)))
        for fault in (dataclasses.replace(loss, active=0), loss)
    )
    assert faster == contact_wire_wave_speed(ln2)
    assert slower / faster == pytest.approx(0.9, rel=1e-3)  # it bends as before
    of_another = make_fault("tension_loss", wire="messenger_wire", value=0.19)
    assert contact_wire_wave_speed(dataclasses.replace(ln2, fault=(of_another,))) == faster
