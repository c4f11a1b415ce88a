"""What a line's matrices hold: every component's mass, stiffness, torsion, damping, from the definition by hand."""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest

from models.catenary.definition.line_definition import COMPONENTS, Damping, Dropper, MessengerSupport, Rayleigh
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.dropper_set import dropper_set
from models.catenary.shape.line_matrices import beam_properties
from models.catenary.shape.line_mesh import build_mesh, contact_wire_height
from models.catenary.shape.line_shape import line_shape
from models.catenary.shape.support_places import SupportPlaces
from models.library.catalogue import line_names, load_line
from tests.effort import some

GRAVITY = 9.81


@pytest.fixture(
    scope="module", params=some(line_names(), "EN50318_2002", "LN2_overlap", "LN2_ring", "Re330", "Shinkansen")
)
def built(request):
    line = load_line(request.param)
    mesh = build_mesh(line)
    return line, mesh, line_shape(line, mesh, mesh.points).matrices


def _rigid(mesh, axis):
    """Unit translation of every node along an axis; nodes that share degrees of freedom are one."""
    field = np.zeros((len(mesh.points), NODE_DOFS))
    field[np.unique(mesh.owner), axis] = 1.0
    return field.ravel()


def _wire_lengths(mesh):
    """Length of each kind of wire, along the polygon through its nodes."""
    lengths = dict.fromkeys(COMPONENTS, 0.0)
    for chain in mesh.chains:
        for a, b in pairwise(mesh.points[chain.nodes].tolist()):
            lengths[chain.component] += math.dist(a, b)
    return lengths


def _dropper_lengths(mesh, is_hanger):
    ends = mesh.points[mesh.droppers[mesh.is_hanger == is_hanger]].tolist()
    return [math.dist(*pair) for pair in ends]


def _masses(line, mesh):
    """Mass by kind of part, counted from the definition: supports, spans, droppers [kg]."""
    lengths = _wire_lengths(mesh)
    masses = {name: getattr(line, name).mass * lengths[name] for name in COMPONENTS[:4] if getattr(line, name)}
    spans = [span for section in line.sections for span in section.spans]
    droppers, hangers = (sum(len(getattr(span, name)) for span in spans) for name in ("droppers", "hangers"))
    arms = sum(support.has_steady_arm for section in line.sections for support in section.supports)
    if line.steady_arm is not None:
        masses["steady_arm"] = arms * line.steady_arm.mass * line.steady_arm.length
    clamps = line.clamps
    own, hung = _dropper_lengths(mesh, False), _dropper_lengths(mesh, True)
    assert (len(own), len(hung)) == (droppers, hangers)
    masses["dropper"] = line.dropper.mass * sum(own)
    if line.hanger is not None:
        masses["hanger"] = line.hanger.mass * sum(hung)
    stitches = sum(chain.component == "stitch_wire" for chain in mesh.chains)
    masses["clamps"] = (droppers + hangers) * (clamps.dropper_upper + clamps.dropper_lower)
    masses["clamps"] += arms * clamps.steady_arm + 2 * stitches * clamps.stitch_wire
    return masses


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_line_that_moves_as_one_has_the_mass_of_its_parts(built, axis):
    line, mesh, matrices = built
    move = _rigid(mesh, axis)
    assert move @ (matrices.M @ move) == pytest.approx(sum(_masses(line, mesh).values()), rel=1e-9)


def test_the_wires_are_as_long_as_the_line(built):
    """The polygons that the mass is counted along: each from anchor to anchor, and longer by its sag alone."""
    line, mesh, _ = built
    straight = sum(section.spans[-1].end - section.spans[0].start for section in line.sections)
    lengths = _wire_lengths(mesh)
    assert 1.0 <= lengths["contact_wire"] / straight < 1.001
    assert 1.0 <= lengths["messenger_wire"] / straight < 1.01
    if line.auxiliary_wire is not None:
        assert 1.0 <= lengths["auxiliary_wire"] / straight < 1.01


def test_droppers_reach_from_the_wanted_height_upward(built):
    line, mesh, _ = built
    lower = mesh.points[mesh.droppers[~mesh.is_hanger, 0]]
    of = mesh.section[mesh.droppers[~mesh.is_hanger, 0]]
    wanted = [
        contact_wire_height(SupportPlaces(line, line.sections[s]), x) for s, x in zip(of, lower[:, 0], strict=True)
    ]
    assert lower[:, 2] == pytest.approx(wanted)


def test_the_load_along_z_is_the_weight_and_the_springs_pull_on_their_seats(built):
    """Tensions act in pairs and the unbent wire's couples too, so that only weight and elastic supports are left.

    On straight track: what a curve adds is balanced in space (test_track.py)."""
    line, mesh, matrices = built
    if line.track is not None:
        matrices = line_shape(dataclasses.replace(line, track=None), mesh, mesh.points).matrices
    seats = 0.0
    if line.messenger_support is not None:
        seats = line.messenger_support.stiffness * float(np.sum(mesh.seat - mesh.points[mesh.sprung, 2]))
    weight = GRAVITY * sum(_masses(line, mesh).values())
    assert _rigid(mesh, 2) @ matrices.load == pytest.approx(seats - weight, rel=1e-8)


def test_components_have_the_section_of_a_round_rod(built):
    """Radius a: I = pi a^4 / 4, J = pi a^4 / 2, J / A = a^2 / 2, G = E / 2 (1 + 0.3) [2.3-2.6]."""
    line, mesh, _ = built
    found = beam_properties(line, mesh)
    for index, name in enumerate(COMPONENTS[:5]):
        own, item = mesh.component == index, getattr(line, name)
        assert own.any() == (item is not None)
        if item is None:
            continue
        E, a = item.youngs_modulus, math.sqrt(item.area / math.pi)
        EI = getattr(item, "bending_stiffness", None)
        expected = {
            "EA": E * math.pi * a**2,
            "EI": E * math.pi * a**4 / 4.0 if EI is None else EI,
            "GJ": E / 2.6 * math.pi * a**4 / 2.0,
            "mass": item.mass,
            "gyration": a**2 / 2.0,
            "alpha": line.damping.of(name).alpha,
            "beta": line.damping.of(name).beta,
        }
        for field, value in expected.items():
            assert getattr(found, field)[own] == pytest.approx(value, rel=1e-12), (name, field)


def test_every_cross_section_of_the_line_is_under_the_tension_of_its_wires(built):
    """Where a stitch wire bears a part of it the messenger wire lacks as much; arms have none of their own."""
    line, mesh, _ = built
    tension = beam_properties(line, mesh).tension
    assert not tension[mesh.component == COMPONENTS.index("steady_arm")].any()
    wires = ("contact_wire", "messenger_wire", "auxiliary_wire")
    wanted = sum(getattr(line, name).tension for name in wires if getattr(line, name) is not None)
    beams = {tuple(pair): k for k, pair in enumerate(mesh.beams.tolist())}
    for s, section in enumerate(line.sections):
        chains = [chain.nodes for chain in mesh.chains if chain.section == s]
        for x in (place for span in section.spans for place in (span.start + 0.3, 0.5 * (span.start + span.end))):
            total = 0.0
            for nodes in chains:
                k = int(np.searchsorted(mesh.points[nodes, 0], x))
                if 0 < k < len(nodes):
                    total += float(tension[beams[tuple(nodes[k - 1 : k + 1].tolist())]])
            assert total == pytest.approx(wanted), x


def _twisted(line, mesh, nodes, axis_of):
    """Rotate nodes about the x axis by a given share each."""
    field = np.zeros((len(mesh.points), NODE_DOFS))
    field[nodes, 3] = axis_of
    return field.ravel()


def test_a_twisted_wire_stores_what_its_torsion_stores(line_maker):
    """1/2 GJ / L for one radian over a length L of a straight wire, and 1/2 m (J/A) L when it spins as one."""
    line = line_maker(spans=4, stagger={"amplitude": [0.0, "m", "test"]}, steady_arm=None)
    mesh = build_mesh(line)
    points = mesh.points.copy()
    (chain,) = mesh.contact_chains()
    points[chain.nodes, 2] = 5.08  # straight and level, so that the axis of every element is x
    bare = dataclasses.replace(mesh, clamp_mass=np.zeros_like(mesh.clamp_mass))
    matrices = line_shape(line, bare, points).matrices
    x = points[chain.nodes, 0]
    length = x[-1] - x[0]
    twist = _twisted(line, mesh, chain.nodes, (x - x[0]) / length)
    wire = line.contact_wire
    J = wire.area**2 / (2.0 * math.pi)
    assert twist @ (matrices.K @ twist) == pytest.approx(wire.youngs_modulus / 2.6 * J / length, rel=1e-9)
    spin = _twisted(line, mesh, chain.nodes, 1.0)
    assert spin @ (matrices.M @ spin) == pytest.approx(wire.mass * J / wire.area * length, rel=1e-9)
    assert np.abs(matrices.K @ spin).max() < 1e-6 * np.abs(matrices.K.diagonal()).max()


def test_hangers_weigh_what_hangers_weigh():
    """A compound line's hangers, made heavier alone, add their own mass and nothing else's."""
    line = load_line("Shinkansen")
    mesh = build_mesh(line)
    heavier = dataclasses.replace(line, hanger=dataclasses.replace(line.hanger, mass=line.hanger.mass + 1.0))
    added = line_shape(heavier, mesh, mesh.points).matrices.M - line_shape(line, mesh, mesh.points).matrices.M
    move = _rigid(mesh, 2)
    hung = _dropper_lengths(mesh, True)
    assert len(hung) > 50
    assert move @ (added @ move) == pytest.approx(sum(hung))
    ends = np.unique(mesh.droppers[mesh.is_hanger])
    moved = np.unique(added.tocoo().row[np.abs(added.tocoo().data) > 1e-9] // NODE_DOFS)
    assert moved.tolist() == ends.tolist()


def test_a_dropper_swings_about_an_end_that_stands_still_with_a_third_of_its_mass(line_maker):
    """A bar whose velocity falls evenly to 0 along its length: the kinetic energy of m / 3."""
    line = line_maker(spans=4)
    mesh = build_mesh(line)
    heavier = dataclasses.replace(line, dropper=dataclasses.replace(line.dropper, mass=line.dropper.mass + 1.0))
    added = line_shape(heavier, mesh, mesh.points).matrices.M - line_shape(line, mesh, mesh.points).matrices.M
    whole = sum(_dropper_lengths(mesh, False))
    for ends in (mesh.droppers[:, 0], mesh.droppers[:, 1]):
        for axis in range(3):
            move = np.zeros((len(mesh.points), NODE_DOFS))
            move[ends, axis] = 1.0
            assert move.ravel() @ (added @ move.ravel()) == pytest.approx(whole / 3.0)


@pytest.mark.parametrize(("name", "end"), [("dropper_lower", 0), ("dropper_upper", 1)])
def test_the_claws_of_a_dropper_sit_on_the_wires_that_they_grip(line_maker, name, end):
    line = line_maker(spans=4)
    heavier = dataclasses.replace(line, clamps=dataclasses.replace(line.clamps, **{name: 1.0}))
    added = build_mesh(heavier).clamp_mass - build_mesh(line).clamp_mass
    expected = np.zeros_like(added)
    expected[build_mesh(line).droppers[:, end]] = 1.0 - getattr(line.clamps, name)
    assert added == pytest.approx(expected)


def test_hangers_are_as_stiff_as_hangers_are():
    hanger = Dropper(stiffness=3e5, mass=0.1, compression_ratio=0.25)
    line = dataclasses.replace(load_line("Shinkansen"), hanger=hanger)
    mesh = build_mesh(line)
    droppers = dropper_set(line, mesh, mesh.points)
    found, ratio = droppers.stiffness, droppers.compression_ratio
    assert set(found[mesh.is_hanger].tolist()) == {3e5}
    assert set(ratio[mesh.is_hanger].tolist()) == {0.25}
    assert set(ratio[~mesh.is_hanger].tolist()) == {line.dropper.compression_ratio}
    own = line.dropper
    expected = [own.youngs_modulus * own.area / length for length in _dropper_lengths(mesh, False)]
    assert found[~mesh.is_hanger] == pytest.approx(expected if own.stiffness is None else own.stiffness)


@pytest.mark.parametrize(("stiffness", "damping"), [(5e5, 0.0), (3e5, 1500.0)])
def test_a_sprung_support_is_a_spring_and_a_damper_under_the_messenger_wire(stiffness, damping):
    """Against the same line whose supports are as good as none: vertical alone, at the supports alone."""
    line = load_line("EN50318_2018_AC_simple")
    line = dataclasses.replace(line, messenger_support=MessengerSupport(stiffness=stiffness, damping=damping))
    mesh = build_mesh(line)
    without = dataclasses.replace(line, messenger_support=None)
    one, other = line_shape(line, mesh, mesh.points).matrices, line_shape(without, mesh, mesh.points).matrices
    inner = [support.x for support in line.sections[0].supports[1:-1]]
    assert mesh.points[mesh.sprung, 0] == pytest.approx(inner)
    vertical = np.zeros((len(mesh.points), NODE_DOFS))
    vertical[mesh.sprung, 2] = 1.0
    for name, value in (("K", stiffness), ("C", damping)):
        added = getattr(one, name) - getattr(other, name)
        expected = value * vertical.ravel()
        assert added.diagonal() == pytest.approx(expected, abs=1e-6 * max(value, 1.0))
        assert abs(added).sum() == pytest.approx(expected.sum(), abs=1e-3)
    sunk = mesh.points.copy()
    sunk[mesh.sprung, 2] = mesh.seat - 0.01
    pushed = line_shape(line, mesh, sunk).matrices.load - line_shape(without, mesh, sunk).matrices.load
    assert pushed == pytest.approx(0.01 * stiffness * vertical.ravel(), abs=1e-6)


def test_damping_of_the_whole_is_that_of_its_components(line_maker):
    """Rigid motion is damped by beta of each component times its mass; every component has a beta of its own."""
    betas = {name: 0.01 * (k + 1) for k, name in enumerate(COMPONENTS)}
    damping = Damping(alpha=0.01, beta=0.5, **{name: Rayleigh(0.002, beta) for name, beta in betas.items()})
    for line in (line_maker(spans=4), load_line("Re330"), load_line("Shinkansen")):
        damped = dataclasses.replace(line, damping=damping)
        mesh = build_mesh(line)
        masses = _masses(line, mesh)
        hung = masses["dropper"] + masses.get("hanger", 0.0) + masses["clamps"]
        expected = betas["dropper"] * hung
        expected += sum(betas[name] * masses[name] for name in COMPONENTS[:5] if name in masses)
        move = _rigid(mesh, 1)
        C = line_shape(damped, mesh, mesh.points).matrices.C
        assert move @ (C @ move) == pytest.approx(expected, rel=1e-9)


def test_damping_in_proportion_to_stiffness_is_each_component_s_own(line_maker):
    """With beta = 0 and one component damped, C is alpha times what stretching that component alone costs."""
    line = line_maker(spans=4)
    mesh = build_mesh(line)
    stretch = np.zeros((len(mesh.points), NODE_DOFS))
    stretch[:, 0] = mesh.points[:, 0]  # 1 m/m along the track
    along, alpha = stretch.ravel(), 0.03
    for name in ("contact_wire", "messenger_wire"):
        one = Damping(alpha=0.0, beta=0.0, **{name: Rayleigh(alpha, 0.0)})
        C = line_shape(dataclasses.replace(line, damping=one), mesh, mesh.points).matrices.C
        item = getattr(line, name)
        # The wires' slopes take a few per mille off the pure stretch.
        assert along @ (C @ along) == pytest.approx(alpha * item.youngs_modulus * item.area * 200.0, rel=0.02)
