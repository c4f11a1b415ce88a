"""The second equilibrium: the design itself without errors, and with them what other models of the line say."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from models.catenary.condition import line_condition
from models.catenary.condition.irregularities import dropper_length_errors, support_height_errors
from models.catenary.condition.line_condition import find_condition
from models.catenary.line_model import CatenaryModel
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.form_finding import EquilibriumError, find_rest, weight
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.library.catalogue import line_names, load_line
from tests.effort import IS_LONG, count, rest, some
from tests.models.catenary.shape.test_nonlinear_truss import limp
from tests.models.conftest import make_fault, make_line, make_overlap, make_ring, shortened
from tests.models.nonlinear_truss import Truss

#: Span of LN2 with 49.5 m and seven droppers, 4.5 m from the supports and 6.75 m apart.
SPAN = 12


def design_of(line):
    return kept_form(line, build_mesh(line))


def with_faults(line, *faults):
    return dataclasses.replace(line, fault=tuple(make_fault(**fault) for fault in faults))


def broken(dropper, span=SPAN, **more):
    return {"kind": "dropper_broken", "span": span, "dropper": dropper} | more


def slipped(dropper, value, span=SPAN, **more):
    return {"kind": "dropper_slipped", "span": span, "dropper": dropper, "value": value} | more


def changed(design, line):
    """Return the condition of a line that has the design already."""
    return find_condition(dataclasses.replace(design, shape=dataclasses.replace(design.shape, definition=line)))


def of_span(design, line, span=SPAN):
    """Return which droppers are those of a span."""
    x, span = design.positions[design.shape.mesh.droppers[:, 0], 0], line.sections[0].spans[span - 1]
    return np.flatnonzero((x > span.start) & (x < span.end))


def rises(condition, design):
    """Return how far the wire has gone up at every dropper [mm]."""
    return 1e3 * (condition.positions - design.positions)[design.shape.mesh.droppers[:, 0], 2]


@pytest.fixture(scope="module")
def printed():
    """LN2 with its sag from support to support, as the figures of the specification have it, and its design."""
    line = load_line("LN2")
    line = dataclasses.replace(line, profile=dataclasses.replace(line.profile, pre_sag_between="supports"))
    return line, design_of(line)


@pytest.fixture(scope="module")
def short():
    line = make_line()
    return line, design_of(line)


@pytest.mark.parametrize("name", some(line_names(), "LN2_ring", "Re330", "Shinkansen"))
def test_the_lengths_of_the_design_give_the_design(name):
    design = design_of(shortened(name, None if IS_LONG else 8))
    mesh = dataclasses.replace(design.shape.mesh, given_length=design.unstrained_length)
    rest = find_rest(design, mesh, design.shape.points)
    assert np.abs(rest.positions - design.positions).max() < 1e-9
    assert np.abs(rest.displacement - design.displacement).max() < 1e-8
    assert np.abs(rest.dropper_force - design.dropper_force).max() < 1e-6
    assert rest.arm_force == pytest.approx(design.arm_force, abs=1e-6)


def test_a_line_without_errors_and_active_faults_is_its_design(short):
    line, design = short
    dormant = with_faults(line, broken(2, span=3, active=0), slipped(3, 0.1, span=3, active=0))
    for same in (line, line.with_values({"irregularity.seed": 9}), dormant):
        given = dataclasses.replace(design, shape=dataclasses.replace(design.shape, definition=same))
        assert find_condition(given) is given
    assert CatenaryModel(dormant).static.positions.tobytes() == design.positions.tobytes()


def test_errors_and_faults_of_size_zero_leave_the_design(short):
    line, design = short
    for same in (
        with_faults(line, slipped(3, 0.0, span=3)),
        line.with_values({"irregularity.dropper_length_sigma": 1e-13, "irregularity.support_height_sigma": 1e-13}),
    ):
        assert np.abs(changed(design, same).positions - design.positions).max() < 1e-9


@pytest.mark.parametrize(
    "errors",
    [{"support_height_sigma": 0.01}, *rest({"dropper_length_sigma": 0.01})],
    ids=["support heights", "dropper lengths"],
)
def test_a_line_with_errors_hangs_as_a_nonlinear_truss_does(errors):
    """Every error 10 mm at one sigma; the truss has its bars cut, and its supports raised, by the same."""
    line = limp("LN2", 16, None if IS_LONG else 10)
    line = dataclasses.replace(line, irregularity=dataclasses.replace(line.irregularity, seed=9, **errors))
    design, truss = design_of(line), Truss(line)
    condition, mesh, before = find_condition(design), design.shape.mesh, truss.rest
    n = len(truss.wires)
    truss.unstrained[n : n + len(mesh.droppers)] += dropper_length_errors(line.irregularity, mesh)
    raised = support_height_errors(line.irregularity, mesh)
    points = before.copy()
    points[mesh.sprung, 2] += raised
    arm_of = {node: end for end, node in mesh.arms}
    for node, rise in zip(mesh.support_nodes, raised, strict=True):
        if node in arm_of:
            points[arm_of[node], 2] += rise
    truth = truss._settled(points, truss.weight) - before
    found = condition.positions - design.positions
    held = np.concatenate([mesh.droppers[:, 0], mesh.support_nodes])
    assert np.abs(truth[held, 2]).max() > 0.015
    assert np.abs(truth[mesh.support_nodes, 1]).max() > 5e-4
    assert np.abs(found - truth)[held, 2].max() < 2e-4
    assert np.abs(found - truth)[held, 1].max() < 4e-5
    axis = condition.positions[mesh.droppers[:, 1]] - condition.positions[mesh.droppers[:, 0]]
    assert np.array_equal(condition.is_slack, np.linalg.norm(axis, axis=1) < condition.unstrained_length)


@pytest.mark.parametrize(("kind", "share"), [("dropper_length", 0.006), ("support_height", 0.001)])
def test_small_errors_act_as_the_linear_line_says(short, kind, share):
    """Against the stiffness of the motion about the design, where dropper lengths are pairs of forces k e.

    A wire that is fixed at its ends, as in the motion, resists a little more than one that keeps its tension.
    """
    line, design = short
    line, mesh = line.with_values({f"irregularity.{kind}_sigma": 1e-4}), design.shape.mesh
    e, B, k = dropper_length_errors(line.irregularity, mesh), design.droppers.rows, design.droppers.stiffness
    K = (design.shape.matrices.K + B.T @ (B.multiply(k[:, None])) + design.pendulum_stiffness()).tocsc()
    raised = dict(zip(mesh.support_nodes, support_height_errors(line.irregularity, mesh), strict=True))
    d = np.zeros(mesh.fixed.shape)
    d[mesh.sprung, 2] = list(raised.values())
    d[mesh.arms[:, 0], 2] = [raised[node] for node in mesh.arms[:, 1]]
    d, free = d.ravel(), np.flatnonzero(~mesh.fixed.ravel())
    d[free] = spsolve(K[free][:, free], (B.T @ (k * e) - K @ d)[free])
    truth = d.reshape(-1, NODE_DOFS)[:, :3]
    found = changed(design, line)
    held = np.concatenate([mesh.droppers[:, 0], mesh.support_nodes])
    off, size = (np.abs(moves[held, 1:]).max(axis=0) for moves in (found.positions - design.positions - truth, truth))
    assert size[1] > 1e-4
    assert (off < share * size[1]).all()
    expected = k * (B @ d - e)
    assert found.dropper_force - design.dropper_force == pytest.approx(expected, abs=1e-3 * np.abs(expected).max())


def test_two_errors_add_up(short):
    line, design = short
    one, other = slipped(3, 0.001, span=3), slipped(4, 0.001, span=3)
    moves = [
        changed(design, with_faults(line, *faults)).positions - design.positions
        for faults in ((one,), (other,), (one, other))
    ]
    assert np.abs(moves[0] + moves[1] - moves[2]).max() < 1e-6
    assert np.abs(moves[2]).max() > 5e-4


def test_a_longer_dropper_lowers_the_wire_by_its_share_of_tension(printed):
    """1 mm lowers the contact wire by T_m/(T_c + T_m) = 0.41 mm, and at the next droppers by under 0.01 mm."""
    line, design = printed
    moved = rises(changed(design, with_faults(line, slipped(4, 0.001))), design)[of_span(design, line)]
    assert moved[3] == pytest.approx(-14.0 / 34.0, rel=0.01)
    assert np.abs(np.delete(moved, 3)).max() < 0.01


def test_a_dropper_ten_millimetres_too_long_has_the_figures_of_the_specification(printed):
    line, design = printed
    at = of_span(design, line)
    condition = changed(design, with_faults(line, slipped(4, 0.01)))
    assert rises(condition, design)[at][3] == pytest.approx(-4.09, rel=0.02)
    assert design.dropper_force[at[3]] == pytest.approx(68.7, rel=0.02)
    assert condition.dropper_force[at[2:5]] == pytest.approx([81.2, 43.9, 81.2], rel=0.02)


def test_a_missing_dropper_has_the_figures_of_the_specification(printed):
    line, design = printed
    at = of_span(design, line)
    condition = changed(design, with_faults(line, broken(4)))
    assert rises(condition, design)[at][3] == pytest.approx(-11.3, abs=0.3)
    assert condition.dropper_force[at[[2, 4]]] == pytest.approx(103.0, abs=1.0)
    assert condition.dropper_force[at[3]] == 0.0


def test_a_dropper_that_has_slipped_by_a_metre_is_as_good_as_broken(short):
    line, design = short
    slack, gone = (changed(design, with_faults(line, f)) for f in (slipped(4, 1.0, span=3), broken(4, span=3)))
    assert slack.dropper_force == pytest.approx(gone.dropper_force, rel=1e-6, abs=1e-6)
    assert np.abs(slack.positions - gone.positions).max() < 1e-8
    assert np.count_nonzero(slack.is_slack) == 1
    assert not gone.is_slack.any()


def without(design, dropper, lost):
    """Return a mesh and its lengths without a dropper, half of the mass that is lost as a clamp on each wire."""
    mesh = design.shape.mesh
    kept = np.delete(np.arange(len(mesh.droppers)), dropper)
    mass = mesh.clamp_mass.copy()
    mass[mesh.droppers[dropper]] += 0.5 * lost
    return dataclasses.replace(
        mesh,
        **{name: getattr(mesh, name)[kept] for name in ("droppers", "is_hanger", "target", "broken")},
        given_length=design.unstrained_length[kept],
        clamp_mass=mass,
    )


def test_a_broken_dropper_is_a_line_without_it_at_rest_and_in_motion(short, monkeypatch):
    line, design = short
    dropper = int(of_span(design, line, 3)[3])
    faulty = with_faults(line, broken(4, span=3))
    model = CatenaryModel(faulty)
    fewer = dataclasses.replace(design, dropper_force=np.delete(design.dropper_force, dropper))
    rest = find_rest(fewer, without(design, dropper, model.static.droppers.mass[dropper]), design.shape.points)
    assert np.abs(rest.positions - model.static.positions).max() < 1e-6
    assert np.delete(model.static.dropper_force, dropper) == pytest.approx(rest.dropper_force, abs=1e-3)
    monkeypatch.setattr("models.catenary.line_model.find_condition", lambda design: rest)
    other = CatenaryModel(line)
    states = [m.initial_state() for m in (model, other)]
    x = float(design.positions[design.shape.mesh.droppers[dropper, 0], 0])
    for n in range(200):
        for m, state in zip((model, other), states, strict=True):
            m.push(state, 1e-3, [(0, x + 0.05 * n, 150.0)])
    assert np.abs(model.displacement(states[0]) - other.displacement(states[1])).max() < 1e-6
    assert np.abs(model.displacement(states[0])[:, 2]).max() > 0.01
    force = model.dropper_force(states[0])
    assert force[dropper] == 0.0
    assert not model.dropper_slack(states[0])[dropper]
    assert np.delete(force, dropper) == pytest.approx(other.dropper_force(states[1]), abs=1e-2)


def test_a_broken_dropper_has_no_damper_and_no_pendulum(short):
    line, design = short
    dropper = int(of_span(design, line, 3)[3])
    condition = changed(design, with_faults(line, broken(4, span=3)))
    lower, upper = design.shape.mesh.droppers[dropper]
    assert condition.droppers.stiffness[dropper] == 0.0
    K = condition.pendulum_stiffness()
    assert abs(K[NODE_DOFS * lower + 1, NODE_DOFS * upper + 1]) == 0.0
    assert abs(condition.shape.matrices.M[NODE_DOFS * lower + 2, NODE_DOFS * upper + 2]) == 0.0
    assert condition.shape.matrices.M.sum() == pytest.approx(design.shape.matrices.M.sum(), rel=1e-5)


@pytest.mark.parametrize("name", ["LN2_ring", *rest("LN2", "Re330", "EN50318_2018_AC_simple")])
def test_supports_and_anchors_carry_the_weight(name):
    """Vertical equilibrium of the whole line: what is held, or sprung, takes its weight and nothing else."""
    values = {f"irregularity.{kind}_sigma": 0.01 for kind in ("dropper_length", "support_height")}
    line = shortened(name, None if IS_LONG else 10)
    design = design_of(line.with_values(values | {"irregularity.seed": 2}))
    condition = changed(design, with_faults(design.shape.definition, broken(2, span=5)))
    shape = condition.shape
    force = shape.matrices.K @ condition.displacement + shape.droppers.rows.T @ condition.dropper_force
    unbalanced = (force - shape.matrices.load).reshape(-1, NODE_DOFS)[:, 2]
    total = weight(shape.matrices)
    assert np.abs(unbalanced[~shape.mesh.fixed[:, 2]]).max() < 1e-6 * total
    assert condition.residual < 1e-6
    lower = sum_of_reactions(condition)
    assert lower == pytest.approx(total, rel=1e-3)


def sum_of_reactions(condition):
    """Return the vertical force of supports and anchors on the line [N], from the wires' own pulls on what is held."""
    shape, mesh = condition.shape, condition.shape.mesh
    held = mesh.fixed[:, 2] & (mesh.owner == np.arange(len(mesh.owner)))
    force = shape.matrices.K @ condition.displacement + shape.droppers.rows.T @ condition.dropper_force
    reaction = (force - shape.matrices.load).reshape(-1, NODE_DOFS)[held, 2].sum()
    support = shape.definition.messenger_support
    if support is not None:
        reaction += support.stiffness * (mesh.seat - condition.positions[mesh.sprung, 2]).sum()
    return float(reaction)


def test_supports_that_are_all_too_high_lift_the_line_as_it_is(monkeypatch):
    """10 mm at every support and arm: far from the anchors, which stay, the line is the same 10 mm higher."""
    for line in (make_line(16), load_line("EN50318_2018_AC_simple"))[: count(1, 2)]:
        design = design_of(line)
        monkeypatch.setattr(line_condition, "support_height_errors", lambda _, mesh: np.full(len(mesh.sprung), 0.01))
        condition = changed(design, line.with_values({"irregularity.support_height_sigma": 0.01}))
        x = design.positions[:, 0]
        middle = np.abs(x - 0.5 * (x.min() + x.max())) < 110.0
        assert condition.positions[middle, 2] - design.positions[middle, 2] == pytest.approx(0.01, abs=1e-5)
        assert np.abs(condition.positions - design.positions)[middle, 1].max() < 1e-5


def test_a_support_at_the_seam_of_a_ring_is_one_like_any_other(monkeypatch):
    line = make_ring(10)
    design = design_of(line)
    rises_at = []
    for place in (0, 2):
        errors = np.zeros(len(design.shape.mesh.sprung))
        x = design.positions[design.shape.mesh.support_nodes, 0]
        errors[np.argsort(x)[place]] = 0.02
        monkeypatch.setattr(line_condition, "support_height_errors", lambda _, mesh, errors=errors: errors)
        condition = changed(design, line.with_values({"irregularity.support_height_sigma": 0.01}))
        moved = (condition.positions - design.positions)[design.shape.mesh.support_nodes, 2][np.argsort(x)]
        rises_at.append(np.roll(moved, -place))
        (chain,) = (c for c in design.shape.mesh.chains if c.component == "messenger_wire")
        ends = (condition.positions - design.positions)[chain.nodes[[0, -1]], 2]
        assert ends[0] == ends[1]
    assert rises_at[0] == pytest.approx(rises_at[1], abs=1e-7)
    assert rises_at[0][0] > 0.005


def test_an_arm_keeps_its_length_and_swings_about_its_registration_end(short):
    line, design = short
    condition = changed(design, line.with_values({"irregularity.support_height_sigma": 0.03, "irregularity.seed": 1}))
    end, node = design.shape.mesh.arms.T
    for state in (design, condition):
        along = state.positions[node] - state.positions[end]
        stretch = np.linalg.norm(along, axis=1) - 1.22
        arm = line.steady_arm
        assert stretch == pytest.approx(state.arm_force * 1.22 / (arm.youngs_modulus * arm.area), abs=2e-6)
        # What holds a registration end sideways is the arm's pull there, the arm being as good as straight.
        matrices = state.shape.matrices
        held = (matrices.K @ state.displacement - matrices.load).reshape(-1, NODE_DOFS)[end, 1]
        assert held == pytest.approx(-state.arm_force * along[:, 1] / np.linalg.norm(along, axis=1), abs=0.05)
    assert np.abs(condition.arm_force - design.arm_force).max() > 0.5
    raised = support_height_errors(condition.shape.definition.irregularity, design.shape.mesh)
    at = np.isin(design.shape.mesh.support_nodes, node)
    assert (condition.positions - design.positions)[end, 2] == pytest.approx(raised[at], abs=1e-12)


def test_the_line_moves_about_its_condition(short):
    """Elasticity, dropper forces and geometry are those of the line as found."""
    line, design = short
    faulty = CatenaryModel(with_faults(line, slipped(4, 0.02, span=3)))
    dropper = int(of_span(design, line, 3)[3])
    state = faulty.initial_state()
    assert faulty.dropper_force(state)[dropper] == pytest.approx(faulty.static.dropper_force[dropper], abs=1e-9)
    assert faulty.static.dropper_force[dropper] < 0.5 * design.dropper_force[dropper]
    assert faulty.static.unstrained_length[dropper] == pytest.approx(design.unstrained_length[dropper] + 0.02)
    for _ in range(50):
        faulty.push(state, 1e-3, [])
    assert np.abs(faulty.displacement(state)).max() < 1e-9, "a line at rest stays at rest"


def test_a_dropper_without_length_is_refused(short):
    line, design = short
    with pytest.raises(EquilibriumError, match=r"leave the dropper at 1\d\d\.\d\d m a length of -"):
        changed(design, with_faults(line, slipped(4, -1.2, span=3)))


@pytest.mark.parametrize("name", ["LN2", *rest("Re330")])
def test_large_errors_settle_with_many_droppers_slack(name):
    line = load_line(name)
    design = design_of(line)
    for seed in range(count(1, 3)):
        condition = changed(
            design,
            line.with_values(
                {
                    "irregularity.dropper_length_sigma": 0.1,
                    "irregularity.support_height_sigma": 0.05,
                    "irregularity.seed": seed,
                }
            ),
        )
        assert 20 < np.count_nonzero(condition.is_slack) < len(condition.dropper_force) / 2 + 20
        assert (condition.dropper_force >= 0.0).all()
        assert condition.residual < 1e-6


def test_faults_are_of_the_droppers_that_they_name():
    """Section, span and dropper count along the track; hangers are not droppers."""
    line = make_overlap()
    design = design_of(line)
    faults = (slipped(2, 0.05, span=4, section=1), slipped(3, 0.08, span=5, section=2))
    condition = changed(design, with_faults(line, *faults))
    longer = condition.unstrained_length - design.unstrained_length
    for section, fault in enumerate(faults):
        (dropper,) = np.flatnonzero(np.abs(longer - fault["value"]) < 0.01)
        node = design.shape.mesh.droppers[dropper, 0]
        assert design.shape.mesh.section[node] == section
        wanted = line.sections[section].spans[fault["span"] - 1].droppers[fault["dropper"] - 1]
        assert math.isclose(design.shape.mesh.points[node, 0], wanted, abs_tol=1e-9)


@pytest.mark.long
def test_a_fault_is_of_a_dropper_and_never_of_a_hanger():
    line = load_line("Shinkansen")
    (section,) = line.sections
    spans = tuple(dataclasses.replace(span, hangers=span.droppers[::2]) for span in section.spans)
    line = dataclasses.replace(line, sections=(dataclasses.replace(section, spans=spans),))
    design = design_of(line)
    (longer,) = np.flatnonzero(
        changed(design, with_faults(line, slipped(1, 0.01, span=4))).unstrained_length > design.unstrained_length
    )
    assert not design.shape.mesh.is_hanger[longer]
