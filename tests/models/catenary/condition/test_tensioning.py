"""Tensions over temperature: published tables, an exact catenary, losses, and the line's rest under them."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import brentq

from models.catenary.condition.line_condition import find_condition
from models.catenary.condition.tensioning import (
    WireTension,
    anchored_tension,
    cantilever_losses,
    dropper_losses,
    ruling_span,
    swing,
    wire_tensions,
)
from models.catenary.definition.tensioning_definition import Tensioning, TensioningDevice
from models.catenary.definition.track_definition import Track
from models.catenary.shape.form_finding import EquilibriumError, find_form
from models.catenary.shape.line_mesh import build_mesh
from models.catenary.statics.temperature_table import temperature_table
from models.definition_files.parameter import ParameterError
from models.definition_files.toml_reader import DefinitionError
from models.library.catalogue import line_path, load_line

EA, LOAD, SPAN, EXPANSION = 120e-6 * 120e9, 10.6222, 55.0, 17e-6


def test_the_published_table_of_a_wire_between_fixed_ends():
    tension = [anchored_tension(20e3, EA, LOAD, SPAN, EXPANSION * dt) for dt in range(0, 70, 10)]
    np.testing.assert_allclose(tension, [20e3, 17.69e3, 15.45e3, 13.30e3, 11.30e3, 9.51e3, 8.00e3], rtol=1e-3)


def test_the_exact_catenary_of_the_same_wire():
    """Its horizontal tension from the length that it has: 8.0015 kN at the hot end."""

    def unstrained(tension, strain):
        length = 2.0 * tension / LOAD * np.sinh(LOAD * SPAN / (2.0 * tension))
        return length / (1.0 + tension / EA + strain)

    wanted = unstrained(20e3, 0.0)
    exact = brentq(lambda T: unstrained(T, 60.0 * EXPANSION) - wanted, 1e3, 20e3)
    assert exact == pytest.approx(8001.5, abs=1.0)
    assert anchored_tension(20e3, EA, LOAD, SPAN, 60.0 * EXPANSION) == pytest.approx(exact, rel=1e-3)


def test_a_spring_gives_way():
    """Without sag: T_0 - T = E' expansion, the movement of its end is (T_0 - T) / k."""
    k, half, strain = 15e3, 600.0, 3e-4
    tension = anchored_tension(20e3, 1.0 / (1.0 / EA + 1.0 / (k * half)), 0.0, SPAN, strain)
    assert (20e3 - tension) / k == pytest.approx(strain * half + (tension - 20e3) * half / EA)


def test_nothing_is_left_of_a_straight_wire_that_is_too_hot():
    assert np.isnan(anchored_tension(20e3, EA, 0.0, SPAN, 0.01))


def test_the_ruling_span():
    assert ruling_span([50.0, 60.0]) == pytest.approx(np.sqrt((50.0**3 + 60.0**3) / 110.0))


def moved(half, warming):
    return WireTension("contact_wire", 0, np.array([-half, half]), np.ones(1), 1.0, 1.0, EXPANSION * warming, 0.0)


def test_movements_of_wire_and_weights():
    assert moved(600.0, 10.0).movement == pytest.approx(0.102)
    assert 5.0 * moved(410.0, -10.0).movement == pytest.approx(-0.3485)
    assert swing(np.array([0.306]), 3.0)[0] == pytest.approx(15.6e-3, abs=5e-5)


def test_published_losses():
    u = EXPANSION * 30.0 * 50.0 * np.arange(1, 16)
    assert cantilever_losses(np.full(15, 1000.0), u, 3.0).sum() == pytest.approx(1020.0)
    assert cantilever_losses(np.full(15, 2000.0), u, 3.0).sum() == pytest.approx(2040.0)
    assert dropper_losses(13.5, np.full(14, 50.0), u[:14], 1.0).sum() == pytest.approx(1807.0, abs=0.5)


REFERENCE = 283.15


def tensioned(line, warming=0.0, direction=0, mast_side=(-1.0,), **devices):
    tensioning = Tensioning(
        temperature=REFERENCE + warming, reference_temperature=REFERENCE, direction=direction, mast_side=mast_side,
        **devices,
    )  # fmt: skip
    return dataclasses.replace(line, tensioning=tensioning)


def designed(line):
    return find_form(line, build_mesh(line))


@pytest.fixture(scope="module")
def half_length(line_maker):
    """Supports of 15 spans of 50 m on both sides of the middle, at R 1000 to the left."""
    line = line_maker(spans=32, stagger={"listed": [[0.1] * 31, "m", "x"], "anchor": [0.1, "m", "x"]},
                      mesh={"elements_between_droppers": 2})  # fmt: skip
    return dataclasses.replace(line, track=Track(positions=(0.0,), curvature=(1e-3,)))


@pytest.fixture(scope="module")
def design(half_length):
    return designed(half_length)


def as_tensioned(design, **values):
    line = tensioned(design.shape.definition, **values)
    return dataclasses.replace(design, shape=dataclasses.replace(design.shape, definition=line))


@pytest.mark.parametrize(("warming", "side", "sign"), [(30.0, -1.0, 1.0), (-30.0, -1.0, -1.0), (30.0, 1.0, -1.0)])
def test_the_tension_of_a_curve_is_lost_towards_the_fixed_point(design, warming, side, sign):
    """Masts outside, on the right: warm it falls, cold it rises; masts inside: the other way round."""
    for wire in wire_tensions(as_tensioned(design, warming=warming, mast_side=(side,))):
        tension = {"contact_wire": 20e3, "messenger_wire": 14e3}[wire.component]
        assert wire.tension[0] == wire.at_tensioner == tension
        assert tension - wire.at_fixed_point == pytest.approx(sign * 1020.0 * tension / 20e3, rel=0.03)
        np.testing.assert_allclose(wire.tension, wire.tension[::-1], rtol=1e-9)
        assert (np.diff(sign * wire.tension[:16]) <= 1e-9).all()


def test_a_wire_moves_no_farther_than_cantilevers_reach(design):
    """17e-6 x 750 m x 40 K is 0.51 m at the support that is farthest from the fixed point."""
    near = as_tensioned(design, warming=39.0, cantilever_length=0.5)
    assert wire_tensions(near)[0].movement > 0.5  # at the anchor, where no cantilever is
    with pytest.raises(EquilibriumError, match=r"at 50 degC the contact wire moves by 0\.51 m at a support"):
        wire_tensions(as_tensioned(design, warming=40.0, cantilever_length=0.5))


def test_a_wire_that_moves_alone_loses_by_its_droppers_what_the_other_gains(design):
    still = TensioningDevice(expansion=0.0)
    contact, messenger = wire_tensions(as_tensioned(design, warming=30.0, messenger_wire=still))
    by_arms, _ = wire_tensions(as_tensioned(design, warming=30.0))
    by_droppers = by_arms.at_fixed_point - contact.at_fixed_point
    assert by_droppers == pytest.approx(messenger.at_fixed_point - 14e3)
    mean = design.droppers.length.mean()
    weight = design.dropper_force.sum() / 1600.0
    u = EXPANSION * 30.0 * 50.0 * np.arange(1, 16)
    assert by_droppers == pytest.approx(dropper_losses(weight, np.full(15, 50.0), u, mean).sum())


def test_friction_of_the_devices_by_the_last_movement(short_line):
    device = TensioningDevice(efficiency=0.95)
    for direction, tension in ((0, 20e3), (1, 19e3), (-1, 20e3 / 0.95)):
        line = tensioned(short_line, direction=direction, contact_wire=device)
        assert wire_tensions(designed(line))[0].at_tensioner == pytest.approx(tension)


def test_the_reference_without_friction_is_the_design_bit_for_bit(short_line):
    line = tensioned(short_line, contact_wire=TensioningDevice(efficiency=0.9, kind="weights"))
    design = designed(line)
    assert find_condition(design) is design
    assert np.array_equal(design.positions, designed(short_line).positions)
    fixed = wire_tensions(designed(tensioned(short_line, contact_wire=TensioningDevice(kind="fixed"))))
    assert all((wire.tension == wire.nominal).all() for wire in fixed)


def sags(state):
    """Sum of tension and sag of both wires in the middle span, from the line between the supports [N m]."""
    total = 0.0
    for chain in state.shape.mesh.chains:
        x, z = state.positions[chain.nodes][:, [0, 2]].T
        start, middle, end = np.interp([100.0, 125.0, 150.0], x, z)
        beam = np.flatnonzero(state.shape.mesh.beams[:, 0] == chain.nodes[len(chain.nodes) // 2])[0]
        tension = getattr(state.shape.definition, chain.component).tension * state.shape.mesh.tension_factor[beam]
        total += tension * (0.5 * (start + end) - middle)
    return total


@pytest.mark.parametrize("direction", [1, -1])
def test_the_wires_sag_by_the_tension_that_they_have(short_line, direction):
    """The weight of a span wants the same sum of tension times sag, whatever the tensions."""
    device = TensioningDevice(efficiency=0.9)
    design = designed(tensioned(short_line, direction=direction, contact_wire=device, messenger_wire=device))
    state = find_condition(design)
    assert sags(state) == pytest.approx(sags(design), rel=0.01)
    assert np.abs(state.positions - design.positions).max() > 5e-3
    assert state.residual < 1e-12


def test_registration_ends_come_towards_their_masts(short_line):
    """Free of stagger and of other forces they do so by u^2 / 2a; here the points that arms are held at."""
    design = designed(tensioned(short_line, warming=60.0, mast_side=(1.0, 1.0, 1.0, 1.0, -1.0)))
    state = find_condition(design)
    end, _ = state.shape.mesh.arms.T
    u = EXPANSION * 60.0 * np.array([100.0, 50.0, 0.0, 50.0, 100.0])
    towards = (state.shape.points - design.shape.points)[end, 1]
    np.testing.assert_allclose(towards, u**2 / 6.0 * [1, 1, 1, 1, -1], atol=1e-9)


def test_a_wire_without_tension_is_refused_in_words(short_line):
    flat = dataclasses.replace(short_line, profile=dataclasses.replace(short_line.profile, pre_sag=0.0))
    line = tensioned(flat, warming=70.0, contact_wire=TensioningDevice(kind="fixed"))
    with pytest.raises(EquilibriumError, match="at 80 degC the contact wire has no tension left"):
        find_condition(designed(line))


def test_a_fixed_point_set_outside_the_line_is_refused_in_words(short_line):
    line = tensioned(short_line, warming=1.0, fixed_point=150.0).with_values({"tensioning.fixed_point": 900.0})
    with pytest.raises(
        EquilibriumError, match=r"tensioning\.fixed_point, 900 m, lies outside the line, 0 \.\.\. 300 m"
    ):
        find_condition(designed(line))


def test_the_table_over_temperature(short_line):
    spring = TensioningDevice(kind="spring", stiffness=15e3)
    line = tensioned(short_line, contact_wire=TensioningDevice(ratio=3.0), messenger_wire=spring)
    cold, mild, hot = temperature_table(line, [REFERENCE - 30.0, REFERENCE, REFERENCE + 30.0])
    assert (mild.cantilever_angle, mild.stagger_change, mild.dropper_slant) == (0.0, 0.0, 0.0)
    contact, messenger = hot.wires
    assert contact.wire.movement == pytest.approx(EXPANSION * 30.0 * 150.0)
    assert contact.weight_movement == pytest.approx(3.0 * contact.wire.movement)
    assert np.isnan(messenger.weight_movement)
    assert cold.wires[1].wire.at_tensioner > 14e3 > messenger.wire.at_tensioner
    assert cold.wires[1].sag < mild.wires[1].sag < messenger.sag
    assert np.sin(hot.cantilever_angle) == pytest.approx(EXPANSION * 30.0 * 100.0 / 3.0)
    assert cold.stagger_change == pytest.approx((EXPANSION * 30.0 * 100.0) ** 2 / 6.0)
    with pytest.raises(ParameterError, match="'short' has no table \\[tensioning\\]"):
        temperature_table(short_line, [300.0])


def of(unit, value):
    return [value, unit, "test"]


TABLE = {"temperature": of("degC", 20), "reference_temperature": of("degC", 10)}


def test_the_table_as_read(line_maker):
    line = line_maker(tensioning=TABLE | {"direction": -1, "contact_wire": {"kind": "fixed"}})
    assert (line.tensioning.temperature, line.tensioning.warming) == (293.15, pytest.approx(10.0))
    assert line.tensioning.contact_wire.kind == "fixed"
    names = {p.name: p for p in line.parameters()}
    assert {"tensioning.temperature", "tensioning.direction", "tensioning.contact_wire.efficiency",
            "tensioning.messenger_wire.ratio", "tensioning.messenger_wire.expansion"} <= set(names)  # fmt: skip
    assert line.with_values({"tensioning.direction": 1}).tensioning.direction == 1


def test_several_sections_share_no_fixed_point(tmp_path):
    table = "\n[tensioning]\ntemperature = [40, 'degC', 'x']\nreference_temperature = [15, 'degC', 'x']\n"
    file = tmp_path / "AC_mixed.toml"
    text = line_path("AC_mixed").read_text(encoding="utf-8") + table
    file.write_text(text + "fixed_point = [700, 'm', 'x']\n", encoding="utf-8")
    with pytest.raises(DefinitionError) as raised:
        load_line(str(file))
    (problem,) = raised.value.problems
    assert problem.key == "tensioning.fixed_point"
    assert problem.text.endswith("the line has several: leave it out, and each is fixed in its middle")
    file.write_text(text, encoding="utf-8")
    assert load_line(str(file)).tensioning.fixed_point is None


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"temperature": None}, "tensioning.temperature: is missing"),
        ({"temperature": of("m", 3)}, "tensioning.temperature: unit 'm' where a unit of 'K' is needed"),
        ({"temperature": of("degC", 900)}, "tensioning.temperature: "),
        ({"direction": 2}, "tensioning.direction: 2 is outside -1 ... 1"),
        ({"fixed_point": of("m", 900)}, "tensioning.fixed_point: 900 m lies outside the line"),
        ({"mast_side": of("1", [1, -1])}, "tensioning.mast_side: gives 2 values"),
        ({"mast_side": of("1", 0.5)}, "tensioning.mast_side: 0.5: masts stand on the side 1"),
        ({"contact_wire": {"kind": "spring"}}, "contact_wire.stiffness: is missing: how stiff is the spring?"),
        ({"contact_wire": {"stiffness": of("kN/m", 15)}}, "stiffness: means nothing for kind 'weights'"),
        ({"contact_wire": {"kind": "fixed", "efficiency": of("1", 0.9)}}, "efficiency: means nothing for kind 'fixed'"),
        ({"contact_wire": {"kind": "fixed", "ratio": of("1", 3.0)}}, "ratio: means nothing for kind 'fixed'"),
        ({"contact_wire": {"kind": "rope"}}, "tensioning.contact_wire.kind: 'rope' is none of weights, spring, fixed"),
        ({"auxiliary_wire": {"ratio": of("1", 3)}}, "tensioning.auxiliary_wire: the line has no auxiliary wire"),
        ({"stitch_wire": {}}, "tensioning.stitch_wire: unknown key"),
    ],
)
def test_mistakes(line_maker, changes, said):
    table = {k: v for k, v in (TABLE | changes).items() if v is not None}
    with pytest.raises(DefinitionError) as caught:
        line_maker(tensioning=table)
    assert said in str(caught.value)


def test_a_ring_has_no_devices(ring_maker):
    with pytest.raises(DefinitionError, match="tensioning: a line that closes on itself has no ends"):
        ring_maker(tensioning=TABLE)


def test_a_messenger_wire_that_a_stitch_wire_leaves_no_tension_is_told(line_maker):
    """9 kN of 14 kN are taken between the clamps; in the heat a wire with fixed ends has less than these."""
    stitch = {
        "area": [35, "mm2", "x"], "mass": [0.31, "kg/m", "x"], "youngs_modulus": [84.7, "GPa", "x"],
        "tension": [9, "kN", "x"], "length": [14, "m", "x"],
    }  # fmt: skip
    hot = TABLE | {"temperature": [90, "degC", "x"], "messenger_wire": {"kind": "fixed"}}
    line = line_maker(type="stitched", stitch_wire=stitch, tensioning=hot)
    with pytest.raises(EquilibriumError, match=r"messenger wire under a stitch wire.* of -\d+ N: a wire must pull"):
        find_condition(find_form(line, build_mesh(line)))
    with pytest.raises(EquilibriumError, match=r"of -1000 N: .* give the stitch wire less \(stitch_wire\.tension"):
        find_form(line.with_values({"stitch_wire.tension": 15e3}), build_mesh(line))
