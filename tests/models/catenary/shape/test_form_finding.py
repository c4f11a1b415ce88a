"""Form finding: equilibrium checked independently, heights, tensions, published lengths."""

import dataclasses
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from models.catenary.definition.line_definition import COMPONENTS, GRAVITY
from models.catenary.line_model import CatenaryModel
from models.catenary.line_state import StripMotion
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.form_finding import EquilibriumError, find_form, weight
from models.catenary.shape.line_matrices import LineAssembly
from models.catenary.shape.line_mesh import build_mesh
from models.catenary.shape.line_shape import line_shape
from models.commands.physics_main import main
from models.library.catalogue import line_names, load_line
from tests.effort import some
from tests.models.conftest import shortened


@cache
def form_of(name):
    """Return a line of the library, its mesh and its form."""
    line = load_line(name)
    mesh = build_mesh(line)
    return line, mesh, find_form(line, mesh)


@pytest.fixture(scope="module", params=some(line_names(), "AC_mixed", "LN2", "LN2_ring", "Re330", "Shinkansen"))
def found(request):
    return form_of(request.param)


def droppers_as_springs(line, mesh, state):
    """Return the displacement of the line about its static points, droppers as springs of their unstrained lengths."""
    shape = line_shape(line, mesh, state.shape.points)
    matrices, B, k = shape.matrices, shape.droppers.rows, shape.droppers.stiffness
    stretch = shape.droppers.length - state.unstrained_length
    free = np.flatnonzero(~mesh.fixed.ravel())
    K = matrices.K + B.T @ sp.diags(k) @ B
    load = matrices.load - B.T @ (k * stretch)
    displacement = np.zeros(load.size)
    displacement[free] = spsolve(K[free][:, free].tocsc(), load[free])
    return displacement, k * (stretch + B @ displacement)


def test_forces_balance_at_every_node(found):
    line, mesh, state = found
    matrices = line_shape(line, mesh, state.shape.points).matrices
    unbalanced = matrices.K @ state.displacement + state.droppers.rows.T @ state.dropper_force
    unbalanced = (unbalanced - matrices.load).reshape(-1, NODE_DOFS)[~mesh.fixed]
    assert np.abs(unbalanced).max() < 1e-6 * weight(matrices)
    assert state.residual < 1e-6


def test_the_line_stands_still_on_droppers_of_the_lengths_found(found):
    line, mesh, state = found
    displacement, force = droppers_as_springs(line, mesh, state)
    moved = (displacement.reshape(-1, NODE_DOFS)[mesh.owner] - state.displacement.reshape(-1, NODE_DOFS))[:, :3]
    assert np.abs(moved).max() < 1e-6
    assert np.abs(force - state.dropper_force).max() < 1e-6 * weight(state.shape.matrices)


def test_supports_carry_the_weight(found):
    line, mesh, state = found
    if line.track is not None:
        pytest.skip("in curves they carry what tension gives besides: test_curved_line.py")
    matrices = state.shape.matrices
    internal = matrices.K @ state.displacement + state.shape.droppers.rows.T @ state.dropper_force
    reactions = (internal - matrices.load).reshape(-1, NODE_DOFS)
    held = np.where(mesh.fixed, reactions, 0.0)[:, :3].sum(axis=0)
    if line.messenger_support is not None:
        held[2] += (line.messenger_support.stiffness * (mesh.seat - state.positions[mesh.sprung, 2])).sum()
    total = weight(matrices)
    mass = GRAVITY * matrices.M.diagonal().reshape(-1, NODE_DOFS)[:, 2].sum()
    assert total > mass > 0.5 * total  # a consistent mass has the rest beside its diagonal
    assert held == pytest.approx([0.0, 0.0, total], abs=1e-6 * total)


def test_weight_is_that_of_the_parts(found):
    line, mesh, state = found
    per_length = np.array([getattr(getattr(line, c), "mass", 0.0) for c in COMPONENTS])
    start, end = (state.shape.points[mesh.beams[:, k]] for k in (0, 1))
    wires = per_length[mesh.component] @ np.linalg.norm(end - start, axis=1)
    hung = np.where(mesh.is_hanger, getattr(line.hanger, "mass", 0.0), line.dropper.mass)
    parts = wires + hung @ state.shape.droppers.length + mesh.clamp_mass.sum()
    assert weight(state.shape.matrices) == pytest.approx(GRAVITY * parts, rel=1e-6)


def test_wires_stand_at_the_wanted_heights(found):
    _, mesh, state = found
    assert np.abs(state.positions[mesh.droppers[:, 0], 2] - mesh.target).max() < 1e-4


def test_every_dropper_is_in_tension(found):
    _, _, state = found
    assert state.dropper_force.min() > 10.0
    assert state.unstrained_length.min() > 0.0
    stiffness = state.shape.droppers.stiffness
    assert stiffness * (state.droppers.length - state.unstrained_length) == pytest.approx(state.dropper_force, rel=1e-6)


def slid(line, state):
    """Return by how much weight along their slope stretches wires whose supports are not equally high, at most."""
    supports = [s for section in line.sections for s in section.inner_supports]
    heights = [s.contact_wire_height + s.encumbrance for s in supports if s.contact_wire_height and s.encumbrance]
    length = sum(np.ptp([s.x for s in section.supports]) for section in line.sections)
    per_length = weight(state.shape.matrices) / length
    wire = line.messenger_wire
    longest = max(np.ptp([s.x for s in section.supports]) for section in line.sections)
    return per_length * np.ptp(heights or [0.0]) * 0.5 * longest / (wire.youngs_modulus * wire.area)


def test_wires_keep_the_tension_that_they_are_strung_with(found):
    """Not so, were the tension of the messenger wire the same on both sides of a stitch wire's clamp."""
    line, mesh, state = found
    stretch = np.abs(state.displacement.reshape(-1, NODE_DOFS)[:, 0]).max()
    assert stretch < 1e-4 + slid(line, state)
    for chain in mesh.chains:
        wire = getattr(line, chain.component)
        points, move = state.shape.points[chain.nodes], state.displacement.reshape(-1, NODE_DOFS)[chain.nodes, :3]
        along = np.diff(points, axis=0)
        strain = np.einsum("ij,ij->i", along, np.diff(move, axis=0)) / (along**2).sum(axis=1)
        assert np.abs(wire.youngs_modulus * wire.area * strain).max() < 0.01 * wire.tension


def test_a_regular_span_is_symmetric(found):
    line, mesh, state = found
    spans = line.sections[0].spans
    span = next(s for s in spans[len(spans) // 2 :] if s.length == spans[len(spans) // 2].length)
    x = mesh.points[mesh.droppers[:, 0], 0]
    inside = (x > span.start) & (x < span.end) & ~mesh.is_hanger
    force = state.dropper_force[inside][np.argsort(x[inside])]
    assert force == pytest.approx(force[::-1], rel=2e-3)


def test_compound_line_has_its_three_wires_at_their_heights():
    _, mesh, state = form_of("Shinkansen")
    z = state.positions[:, 2]
    working = (mesh.points[:, 0] > 200.0) & (mesh.points[:, 0] < 1000.0)
    lower = mesh.droppers[:, 0]
    contact, auxiliary = (lower[working[lower] & (mesh.is_hanger == h)] for h in (False, True))
    assert z[contact] == pytest.approx(np.full(len(contact), 5.0), abs=1e-4)
    assert z[auxiliary] == pytest.approx(np.full(len(auxiliary), 5.25), abs=1e-4)
    supports = mesh.sprung[working[mesh.sprung]]
    assert z[supports] == pytest.approx(np.full(len(supports), 6.5), abs=1e-4)


def test_dropper_lengths_of_EN_50318_2018():
    """AC simple: the standard's lengths within 4 mm."""
    line = load_line("EN50318_2018_AC_simple")
    mesh = build_mesh(line)
    state = find_form(line, mesh)
    x = mesh.points[mesh.droppers[:, 0], 0]
    inside = (x > 550.0) & (x < 605.0)
    given = [1.017, 0.896, 0.810, 0.758, 0.741, 0.758, 0.810, 0.896, 1.017]
    assert state.unstrained_length[inside] == pytest.approx(given, abs=4e-3)


@cache
def _lengths_of_LN2(pre_sag_between):
    line = load_line("LN2")
    line = dataclasses.replace(line, profile=dataclasses.replace(line.profile, pre_sag_between=pre_sag_between))
    mesh = build_mesh(line)
    x = mesh.points[mesh.droppers[:, 0], 0]
    return find_form(line, mesh).unstrained_length[(x > 501.7) & (x < 551.2)]


def test_dropper_lengths_of_LN2():
    """Lengths printed 1.25 to 1.075 m (Table 5.2), independently found 1.27 to 1.06 m from support to support."""
    found = _lengths_of_LN2("supports")
    assert found.max() == pytest.approx(1.27, abs=0.01)
    assert found.min() == pytest.approx(1.06, abs=0.01)


def test_the_printed_lengths_of_LN2_decide_where_its_sag_begins():
    """They are 0.175 m apart, in spans of 49.5 m: between the outer droppers is the nearer reading, and the line's."""
    apart = {between: float(np.ptp(_lengths_of_LN2(between))) for between in ("supports", "droppers")}
    assert apart == {"supports": pytest.approx(0.208, abs=1e-3), "droppers": pytest.approx(0.168, abs=1e-3)}
    nearer = min(apart, key=lambda between: abs(apart[between] - 0.175))
    assert load_line("LN2").profile.pre_sag_between == load_line("LN2_ring").profile.pre_sag_between == nearer


def test_stitch_wire_carries_its_droppers_like_a_string():
    """Slope change at a dropper times the stitch wire's tension is the dropper's force and what hangs there."""
    fine = 24
    line = shortened("Re330", 7).with_values({"mesh.elements_between_droppers": fine})
    mesh = build_mesh(line)
    state = find_form(line, mesh)
    stitch = [c for c in mesh.chains if c.component == "stitch_wire"][1]
    x, _, z = state.positions[stitch.nodes].T
    middles = [fine // 2, fine + fine // 2]  # away from the dropper and from the clamp, where bending rounds the kinks
    slopes = [(z[i + 1] - z[i]) / (x[i + 1] - x[i]) for i in middles]
    force = state.dropper_force[np.isin(mesh.droppers[:, 1], stitch.nodes)]
    wire = (x[middles[1]] - x[middles[0]]) * line.stitch_wire.mass * GRAVITY
    hung = GRAVITY * (line.clamps.dropper_upper + 0.5 * line.dropper.mass * state.droppers.length.mean())
    assert line.stitch_wire.tension * (slopes[1] - slopes[0]) == pytest.approx(force[0] + wire + hung, rel=5e-3)


@pytest.mark.parametrize("name", some(["LN2", "Re330", "Shinkansen", "EN50318_2018_AC_simple"], "LN2"))
def test_given_lengths_reproduce_the_profile_that_they_were_found_for(name):
    line, mesh, state = form_of(name)
    again = find_form(line, dataclasses.replace(mesh, given_length=state.unstrained_length))
    assert again.positions == pytest.approx(state.positions, abs=1e-6)
    assert again.dropper_force == pytest.approx(state.dropper_force, abs=1e-3)


def with_lengths(line, *lengths):
    """Return a line whose spans have droppers of given lengths, the last given repeated."""
    section = line.sections[0]
    wanted = [*lengths, *([lengths[-1]] * (len(section.spans) - len(lengths)))]
    spans = tuple(dataclasses.replace(s, dropper_lengths=d) for s, d in zip(section.spans, wanted, strict=True))
    return dataclasses.replace(line, sections=(dataclasses.replace(section, spans=spans),))


def test_longer_droppers_lower_the_wire(short_line):
    lines = [with_lengths(short_line, (length,) * 7) for length in (1.10, 1.15)]
    states = [find_form(line, build_mesh(line)) for line in lines]
    lower = build_mesh(lines[0]).droppers[:, 0]
    inner = np.abs(states[0].shape.points[lower, 0] - 150.0) < 40.0
    drop = (states[0].positions - states[1].positions)[lower[inner], 2]
    assert drop == pytest.approx(np.full(inner.sum(), 0.05), abs=1e-3)


def test_a_dropper_much_too_long_hangs_slack_and_stays_so(short_line):
    mesh = build_mesh(short_line)
    lengths = find_form(short_line, mesh).unstrained_length.copy()
    middle = len(lengths) // 2
    lengths[middle] += 0.1
    state = find_form(short_line, dataclasses.replace(mesh, given_length=lengths))
    assert state.dropper_force[middle] == 0.0
    assert state.elastic_force[middle] < 0.0
    assert (np.delete(state.dropper_force, middle) > 0.0).all()
    assert state.residual < 1e-6


def test_a_line_with_a_slack_dropper_is_at_rest(short_line):
    regular = (1.25, 1.15, 1.09, 1.07, 1.09, 1.15, 1.25)
    model = CatenaryModel(with_lengths(short_line, regular, regular, (*regular[:3], 1.17, *regular[4:]), regular))
    state = model.initial_state()
    assert state.slack.size == 1
    for _ in range(3):
        model.step(state, 1e-3, StripMotion(np.full((1, 2, 2, 3), -100.0), np.zeros(1)))
    assert np.abs(model.displacement(state)).max() < 1e-9
    assert model.dropper_force(state) == pytest.approx(model.static.dropper_force, abs=1e-6)


def test_too_much_pre_sag_makes_droppers_push(short_line):
    line = short_line.with_values({"profile.pre_sag": 0.009})
    mesh = build_mesh(line)
    with pytest.raises(EquilibriumError, match="would have to push"):
        find_form(line, mesh)


@pytest.mark.parametrize(
    ("name", "value"),
    [("contact_wire.tension", 1.0), ("messenger_wire.tension", 1.0), ("contact_wire.mass", 900.0),
     ("profile.pre_sag", -0.01), ("profile.encumbrance", 0.05)],
)  # fmt: skip
def test_a_shape_that_runs_away_is_one_sentence(line_maker, name, value):
    """No number overflows on the way: a RuntimeWarning would fail the test."""
    line = line_maker(spans=3)
    part, field = name.split(".")  # beyond the ranges that a definition is held to
    line = dataclasses.replace(line, **{part: dataclasses.replace(getattr(line, part), **{field: value})})
    with pytest.raises(EquilibriumError, match="line 'short' has no static equilibrium of the wanted shape") as caught:
        find_form(line, build_mesh(line))
    assert "\n" not in str(caught.value)


def test_a_messenger_wire_that_sags_below_the_contact_wire_is_named(line_maker):
    """T 14 kN, 23 N/m: its sag of half a metre takes more than the encumbrance."""
    line = line_maker(spans=3)
    line = dataclasses.replace(line, profile=dataclasses.replace(line.profile, encumbrance=0.3))
    with pytest.raises(EquilibriumError, match=r"the upper ends of \d+ dropper\(s\) would hang below the lower ones"):
        find_form(line, build_mesh(line))


def test_what_nothing_holds_is_one_sentence(line_maker, monkeypatch):
    line = line_maker(spans=3)
    mesh = build_mesh(line)
    inner = mesh.chains[0].nodes[5]

    def loose(*given, **more):
        matrices = matrices_of(*given, **more)
        kept = np.ones(matrices.load.size)
        kept[inner * NODE_DOFS + 3] = 0.0  # nothing keeps it from twisting
        return dataclasses.replace(matrices, K=(sp.diags(kept) @ matrices.K @ sp.diags(kept)).tocsc())

    matrices_of = LineAssembly.matrices
    monkeypatch.setattr(LineAssembly, "matrices", loose)
    with pytest.raises(EquilibriumError, match="equations are singular, as they are where nothing holds a wire"):
        find_form(line, mesh)


def test_a_command_tells_it_without_a_traceback(capfd):
    assert main(["statics", "LN2", "--set", "line.contact_wire.tension=1"]) == 1
    shown = capfd.readouterr().err
    assert shown.startswith("error: ")
    assert shown.count("\n") == 1


def test_a_line_without_mass_is_one_sentence(line_maker, monkeypatch):
    def weightless(*given):
        state = find_form(*given)
        matrices = dataclasses.replace(state.shape.matrices, M=0.0 * state.shape.matrices.M)
        return dataclasses.replace(state, shape=dataclasses.replace(state.shape, matrices=matrices))

    monkeypatch.setattr("models.catenary.line_model.kept_form", weightless)
    with pytest.raises(EquilibriumError, match=r"line 'short' cannot move in modes .*not positive"):
        CatenaryModel(line_maker(spans=3))


def test_a_line_that_buckles_is_one_sentence(line_maker):
    line = line_maker(spans=3)
    model = CatenaryModel(line)
    model._line = dataclasses.replace(model._line, modes=dataclasses.replace(model.modes, K=-1e9 * model.modes.K))
    strips = StripMotion(np.full((1, 2, 2, 3), -100.0), np.zeros(1))
    with pytest.raises(EquilibriumError, match=r"line 'short' cannot make steps of 0.001 s: .*not positive"):
        model.step(model.initial_state(), 1e-3, strips)
