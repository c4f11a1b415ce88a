"""Waves with the tensions of the day: against the formula, with what weights and fixed ends leave of the tension."""

import dataclasses
import math

import pytest

from models.catenary.condition.tensioning import anchored_tension
from models.catenary.definition.tensioning_definition import Tensioning, TensioningDevice
from models.catenary.statics.temperature_table import temperature_table
from models.catenary.statics.wire_waves import waves
from models.interface.line_and_pantograph import Line
from models.interface.line_statics import statics

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
