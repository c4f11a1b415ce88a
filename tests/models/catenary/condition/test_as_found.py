"""Lines whose places have changed (droppers moved, arms gone, wire worn or loaded) against an exact truss."""

import dataclasses

import numpy as np
import pytest

from models.catenary.condition import as_found as as_found_room
from models.catenary.condition import line_condition
from models.catenary.condition.irregularities import dropper_position_errors, stagger_errors
from models.catenary.condition.line_condition import find_condition
from models.catenary.line_energy import LineBalance
from models.catenary.line_model import CatenaryModel
from models.catenary.line_state import StripMotion
from models.catenary.shape import form_finding
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.form_finding import EquilibriumError, weight
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_matrices import beam_properties
from models.catenary.shape.line_mesh import build_mesh
from models.catenary.shape.wire_intervals import attachments
from models.catenary.statics.elasticity import elasticity
from models.library.catalogue import load_line
from tests.effort import some
from tests.models.conftest import make_fault, make_line
from tests.models.nonlinear_truss import GRAVITY, Truss

#: Support in the middle of the short line, from 1 between the anchors, and where it stands [m].
SUPPORT, X = 3, 150.0


def condition_of(design, line):
    """Return the condition of a line that has the design already."""
    return find_condition(dataclasses.replace(design, shape=dataclasses.replace(design.shape, definition=line)))


def with_fault(line, kind, **values):
    return dataclasses.replace(line, fault=(make_fault(kind, **values),))


@pytest.fixture(scope="module")
def short():
    line = make_line()
    return line, kept_form(line, build_mesh(line))


class Weighted:
    """A truss of a line whose wires do not bend, kept at their tensions as weights keep them."""

    def __init__(self):
        line = make_line().with_values({"mesh.elements_between_droppers": 12})
        wires = ("contact_wire", "messenger_wire")
        limp = {w: dataclasses.replace(getattr(line, w), bending_stiffness=0.0) for w in wires}
        self.line = dataclasses.replace(line, **limp)
        self.design = kept_form(self.line, build_mesh(self.line))
        self.mesh, self.truss = self.design.shape.mesh, Truss(self.line)
        self.count = len(self.truss.wires)
        self.kept = {n: getattr(self.truss, n).copy() for n in ("unstrained", "stiffness", "weight", "bars")}
        self.rest = self.settle(self.truss.rest, self.truss.tension)

    def anew(self):
        for name, value in self.kept.items():
            setattr(self.truss, name, value.copy())
        return self.truss, self.rest.copy()

    def settle(self, points, tension):
        truss, n = self.truss, self.count
        for _ in range(3):
            points = truss._settled(points, truss.weight)
            length = np.linalg.norm(np.diff(points[truss.wires], axis=1)[:, 0], axis=1)
            truss.unstrained[:n] = length - tension / truss.stiffness[:n]
        return truss._settled(points, truss.weight)

    def moves(self, condition, points):
        """Return how droppers' lower ends and supports move, as found and in truth, shape (2, n, 3) [m]."""
        before, mesh = self.mesh, condition.shape.mesh
        at = [np.concatenate([m.droppers[:, 0], m.support_nodes]) for m in (before, mesh)]
        found = condition.positions[at[1]] - self.design.positions[at[0]]
        return np.array([found, points[at[0]] - self.rest[at[0]]])

    def wire(self, name):
        return next(c.nodes for c in self.mesh.chains if c.component == name)

    def node(self, name, x):
        nodes = self.wire(name)
        return nodes[np.abs(self.mesh.points[nodes, 0] - x).argmin()]


@pytest.fixture(scope="module")
def weighted():
    return Weighted()


def assert_near(moves, vertical, lateral, least):
    """Compare to within shares of the largest vertical and lateral motion, the former of which is at least so large."""
    found, truth = moves
    size, off = np.abs(truth).max(axis=0), np.abs(found - truth).max(axis=0)
    assert size[2] > least
    assert off[2] < vertical * size[2]
    assert off[1] < lateral * max(size[1], 1e-3)


def arm_of(weighted, node):
    return int(np.flatnonzero(weighted.mesh.arms[:, 1] == node)[0])


def test_a_line_without_an_arm_hangs_as_a_truss_without_it(weighted):
    """The arm pulls no more and weighs nothing; its clamp stays on the wire, which goes aside by more than 0.25 m."""
    condition = condition_of(weighted.design, with_fault(weighted.line, "arm_loose", support=SUPPORT))
    truss, points = weighted.anew()
    node = weighted.node("contact_wire", X)
    arm, bars = arm_of(weighted, node), weighted.count + len(weighted.mesh.droppers)
    truss.stiffness[bars + arm] = 0.0
    length = np.linalg.norm(np.diff(points[weighted.mesh.arms[arm]], axis=0))
    truss.weight[node, 2] += 0.5 * weighted.line.steady_arm.mass * length * GRAVITY
    moves = weighted.moves(condition, weighted.settle(points, truss.tension))
    assert_near(moves, 0.03, 0.002, 0.01)
    assert np.abs(moves[1, :, 1]).max() > 0.25
    assert len(condition.arm_force) == len(weighted.design.arm_force) - 1


def test_a_sunk_support_lowers_a_truss_alike(weighted):
    condition = condition_of(weighted.design, with_fault(weighted.line, "support_sunk", support=SUPPORT, value=0.05))
    truss, points = weighted.anew()
    points[weighted.node("messenger_wire", X), 2] -= 0.05
    points[weighted.mesh.arms[arm_of(weighted, weighted.node("contact_wire", X)), 0], 2] -= 0.05
    assert_near(weighted.moves(condition, weighted.settle(points, truss.tension)), 0.005, 0.02, 0.03)


@pytest.mark.parametrize("name", ["contact_wire", "messenger_wire"])
def test_a_wire_that_has_lost_tension_hangs_as_a_truss_does(weighted, name):
    condition = condition_of(weighted.design, with_fault(weighted.line, "tension_loss", wire=name, value=0.1))
    truss, points = weighted.anew()
    left = np.where(np.isin(truss.wires[:, 0], weighted.wire(name)), 0.9, 1.0)
    assert_near(weighted.moves(condition, weighted.settle(points, left * truss.tension)), 0.01, 0.02, 0.004)


def test_a_worn_wire_hangs_as_a_truss_of_lighter_bars(weighted):
    """Worn from one node to another, neither of which is a support or a dropper."""
    ends = [float(weighted.mesh.points[weighted.node("contact_wire", x), 0]) for x in (X - 31.2, X + 33.3)]
    condition = condition_of(weighted.design, with_fault(weighted.line, "wear", from_=ends[0], to=ends[1], value=0.2))
    truss, points = weighted.anew()
    middle = weighted.mesh.points[truss.wires, 0].mean(axis=1)
    worn = np.isin(truss.wires[:, 0], weighted.wire("contact_wire")) & (middle > ends[0]) & (middle < ends[1])
    length = np.linalg.norm(np.diff(points[truss.wires[worn]], axis=1)[:, 0], axis=1)
    lighter = 0.2 * 0.5 * weighted.line.contact_wire.mass * length * GRAVITY
    for side in (0, 1):
        np.add.at(truss.weight[:, 2], truss.wires[worn, side], lighter)
    truss.stiffness[: weighted.count][worn] *= 0.8  # but for a 1/500 of it that is tension
    assert_near(weighted.moves(condition, weighted.settle(points, truss.tension)), 0.01, 0.02, 0.01)


def test_a_hard_point_lowers_a_truss_alike(weighted):
    node = weighted.node("contact_wire", X + 23.3)
    at = float(weighted.mesh.points[node, 0])
    condition = condition_of(weighted.design, with_fault(weighted.line, "hard_point", position=at, value=5.0))
    truss, points = weighted.anew()
    truss.weight[node, 2] -= 5.0 * GRAVITY
    assert_near(weighted.moves(condition, weighted.settle(points, truss.tension)), 0.01, 0.02, 0.01)
    assert condition.shape.mesh.clamp_mass.sum() == pytest.approx(weighted.mesh.clamp_mass.sum() + 5.0)


def test_droppers_that_hang_elsewhere_hold_a_truss_alike(weighted, monkeypatch):
    """Some by half a metre to either side, to other nodes of the truss, their lengths as cut."""
    mesh, (truss, points) = weighted.mesh, weighted.anew()
    moved = mesh.droppers.copy()
    contact, messenger = weighted.wire("contact_wire").tolist(), weighted.wire("messenger_wire").tolist()
    for j, step in enumerate(np.resize([1, 0, -1, -1], len(moved))):
        moved[j] = contact[contact.index(moved[j, 0]) + step], messenger[messenger.index(moved[j, 1]) + step]
    errors = mesh.points[moved[:, 0], 0] - mesh.points[mesh.droppers[:, 0], 0]
    assert 0.4 < np.abs(errors).max() < 0.6
    monkeypatch.setattr(as_found_room, "dropper_position_errors", lambda *_: errors)
    condition = condition_of(weighted.design, weighted.line.with_values({"irregularity.dropper_position_sigma": 0.2}))
    assert condition.unstrained_length.tolist() == weighted.design.unstrained_length.tolist()
    half = 0.5 * weighted.design.droppers.mass
    clamps = weighted.line.clamps
    for side, clamp in ((0, clamps.dropper_lower), (1, clamps.dropper_upper)):
        np.add.at(truss.weight[:, 2], mesh.droppers[:, side], GRAVITY * (half + clamp))
        np.add.at(truss.weight[:, 2], moved[:, side], -GRAVITY * (half + clamp))
    truss.bars[weighted.count : weighted.count + len(moved)] = moved
    truth = weighted.settle(points, truss.tension)
    lower = condition.shape.mesh.droppers[:, 0]
    assert condition.shape.mesh.points[lower, 0] == pytest.approx(mesh.points[moved[:, 0], 0], abs=1e-9)
    found = condition.positions[lower] - weighted.design.positions[mesh.droppers[:, 0]]
    assert_near(np.array([found, truth[moved[:, 0]] - weighted.rest[mesh.droppers[:, 0]]]), 0.01, 0.01, 0.005)


def test_registration_ends_that_stand_aside_move_a_truss_alike(weighted):
    line = weighted.line.with_values({"irregularity.stagger_sigma": 0.02, "irregularity.seed": 2})
    condition = condition_of(weighted.design, line)
    truss, points = weighted.anew()
    before, after = (s.shape.points[weighted.mesh.arms[:, 0]] for s in (weighted.design, condition))
    assert np.abs((after - before)[:, 1]).max() > 0.018
    assert not (after - before)[:, [0, 2]].any()
    points[weighted.mesh.arms[:, 0]] += after - before
    assert_near(weighted.moves(condition, weighted.settle(points, truss.tension)), 0.05, 0.002, 5e-4)


def test_registration_ends_are_aside_by_their_errors(short):
    line, design = short
    line = line.with_values({"irregularity.stagger_sigma": 0.02, "irregularity.seed": 2})
    condition, mesh = condition_of(design, line), design.shape.mesh
    aside = (condition.shape.points - design.shape.points)[mesh.arms[:, 0], 1]
    errors = dict(zip(mesh.support_nodes, stagger_errors(line.irregularity, mesh), strict=True))
    assert aside == pytest.approx([errors[node] for node in mesh.arms[:, 1]], abs=1e-12)
    moved = (condition.positions - design.positions)[mesh.arms[:, 1], 1]
    assert moved == pytest.approx(aside, abs=1e-3), "the wire goes with them"


def test_a_worn_wire_bends_as_the_square_of_its_cross_section(short):
    """As does its stiffness in torsion; a fifth less area, mass and axial stiffness."""
    line, design = short
    worn = condition_of(design, with_fault(line, "wear", from_=103.3, to=197.7, value=0.2)).shape
    mesh = worn.mesh
    middle = mesh.points[mesh.beams, 0].mean(axis=1)
    inside = (mesh.component == 0) & (middle > 103.3) & (middle < 197.7)
    found, new = beam_properties(line, mesh), beam_properties(line, design.shape.mesh)
    assert np.diff(mesh.points[mesh.beams[inside], 0]).sum() == pytest.approx(94.4, abs=1e-9)
    for name, power in {"EA": 1, "mass": 1, "gyration": 1, "EI": 2, "GJ": 2, "tension": 0}.items():
        value, whole = getattr(found, name), getattr(new, name)[0]
        assert value[inside] == pytest.approx(0.8**power * whole)
        assert value[(mesh.component == 0) & ~inside] == pytest.approx(whole)


FAULTS = {
    "arm": {"kind": "arm_loose", "support": SUPPORT},
    "sunk": {"kind": "support_sunk", "support": SUPPORT, "value": 0.02},
    "tension": {"kind": "tension_loss", "wire": "messenger_wire", "value": 0.05},
    "wear": {"kind": "wear", "from_": 131.3, "to": 180.1, "value": 0.15, "lost_thickness": 1e-3},
    "hard point": {"kind": "hard_point", "position": 127.77, "value": 4.0, "height": -5e-4, "length": 2.0},
}
ERRORS = {"irregularity.dropper_position_sigma": 0.05, "irregularity.stagger_sigma": 0.01, "irregularity.seed": 3}


@pytest.mark.parametrize("name", some(["LN2_ring", "Re330", "Shinkansen"], "LN2_ring"))
def test_every_error_and_fault_at_once_leaves_a_line_in_equilibrium(name):
    """Vertical equilibrium of all that is not held, to 1e-6 of the line's weight; on rings, stitches, hangers."""
    line = load_line(name).with_values(ERRORS | {"irregularity.dropper_length_sigma": 0.005})
    start = line.sections[0].inner_supports[SUPPORT - 1].x - X
    moved = {"position": FAULTS["hard point"]["position"] + start, "from_": 131.3 + start, "to": 180.1 + start}
    faults = [f | {k: v for k, v in moved.items() if k in f} for f in FAULTS.values()]
    line = dataclasses.replace(line, fault=tuple(make_fault(**f) for f in faults))
    design = kept_form(line, build_mesh(line))
    condition = find_condition(design)
    shape = condition.shape
    force = shape.matrices.K @ condition.displacement + shape.droppers.rows.T @ condition.dropper_force
    free = ~shape.mesh.fixed[:, 2]
    unbalanced = (force - shape.matrices.load).reshape(-1, NODE_DOFS)[free, 2]
    assert np.abs(unbalanced).max() < 1e-6 * weight(shape.matrices)
    lost = weight(design.shape.matrices) - weight(shape.matrices)
    arm = line.steady_arm.mass * line.steady_arm.length
    worn = 0.15 * 48.8 * line.contact_wire.mass
    assert lost / GRAVITY == pytest.approx(arm + worn - 4.0, abs=0.1)  # and droppers that are longer or shorter


def test_the_wire_gives_way_more_with_less_tension(short):
    """A tenth less in the contact wire: more elastic at mid-span, by less than the tenth, as it is not alone."""
    line, _ = short
    found = [
        elasticity(CatenaryModel(case), np.array([X + 25.0]), 100.0).value[0]
        for case in (line, with_fault(line, "tension_loss", wire="contact_wire", value=0.1))
    ]
    assert 1.03 < found[1] / found[0] < 1.1


def test_places_without_errors_leave_the_design(short):
    line, design = short
    dormant = dataclasses.replace(line, fault=tuple(make_fault(**f, active=0) for f in FAULTS.values()))
    given = dataclasses.replace(design, shape=dataclasses.replace(design.shape, definition=dormant))
    assert find_condition(given) is given
    nothing = [f | ({"value": 0.0} if "value" in f else {"active": 0}) for f in FAULTS.values()]
    for same in (
        line.with_values({"irregularity.dropper_position_sigma": 1e-13, "irregularity.stagger_sigma": 1e-13}),
        dataclasses.replace(line, fault=tuple(make_fault(**f) for f in nothing)),
    ):
        condition = condition_of(design, same)
        moved = condition.positions[condition.shape.mesh.droppers] - design.positions[design.shape.mesh.droppers]
        assert np.abs(moved).max() < 1e-4, "of the bends of a mesh that is divided elsewhere"
        assert condition.dropper_force == pytest.approx(design.dropper_force, abs=0.2)


def test_faults_of_different_places_add_up(short):
    line, design = short
    of = {"sunk": 0.001, "hard point": 0.05}
    small = {name: FAULTS[name] | {"value": value} for name, value in of.items()}
    at = {"kind": "hard_point", "position": FAULTS["hard point"]["position"], "value": 0.0}  # the same mesh
    cases = ((small["sunk"], at), (small["hard point"],), (small["sunk"], small["hard point"]), (at,))
    first, second, both, none = (
        condition_of(design, dataclasses.replace(line, fault=tuple(make_fault(**f) for f in case))).positions
        for case in cases
    )
    assert np.abs(both - none).max() > 5e-4
    assert np.abs((first - none) + (second - none) - (both - none)).max() < 1e-6


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
def test_a_faulty_line_keeps_its_energy(short, kernel, monkeypatch):
    """Under a strip that runs through all of its faults: what goes in is stored or dissipated."""
    if kernel == "numba":
        pytest.importorskip("numba")
    monkeypatch.setenv("OPENPANTO_KERNEL", kernel)
    line, _ = short
    line = dataclasses.replace(line.with_values(ERRORS), fault=tuple(make_fault(**f) for f in FAULTS.values()))
    model = CatenaryModel(line)
    strips = np.array([[[[127.0, 0.8, 5.085], [60.0, 0.0, 0.0]], [[127.0, -0.8, 5.085], [60.0, 0.0, 0.0]]]])
    state = model.initial_state()
    balance = LineBalance(model, strips, model.contact_at_rest(state, strips))
    largest = 0.0
    for _ in range(150):
        strips[:, :, 0, 0] += 60.0 * 1e-3
        result = balance.step(state, 1e-3, StripMotion(strips, np.zeros(1)))
        largest = max(largest, float(result.force.max()))
    stored, dissipated, work, drift = balance.balance(state)
    assert largest > 50.0
    assert min(stored, dissipated, work) > 1.0
    assert abs(drift) < 1e-9 * work


@pytest.mark.parametrize(
    ("name", "dropper", "error", "said"),
    [
        (
            "LN2",
            0,
            -4.5,
            r"sigma of 0\.1 m and seed 0 the dropper at .* would hang at .*, outside its span; take a",
        ),
        ("LN2", 0, 6.7495, "past its neighbour, which hangs at"),
        ("Re330", 0, 7.0, "past the stitch wire's clamp at"),
    ],
)
def test_a_dropper_stays_in_its_place(name, dropper, error, said, monkeypatch):
    line = load_line(name).with_values({"irregularity.dropper_position_sigma": 0.1})
    mesh = build_mesh(line)
    errors = np.zeros(len(mesh.droppers))
    span = line.sections[0].spans[4]
    place = int(np.abs(mesh.points[mesh.droppers[:, 0], 0] - span.droppers[dropper]).argmin())
    errors[place] = error
    monkeypatch.setattr(as_found_room, "dropper_position_errors", lambda *_: errors)
    with pytest.raises(EquilibriumError, match=said):
        list(as_found_room._moved(line, mesh))


def test_a_messenger_wire_that_a_stitch_wire_relieves_altogether_is_refused():
    line = load_line("Re330")
    stitch = dataclasses.replace(line.stitch_wire, tension=0.6 * line.messenger_wire.tension)
    line = with_fault(dataclasses.replace(line, stitch_wire=stitch), "tension_loss", wire="messenger_wire", value=0.5)
    mesh = build_mesh(line)
    left = line_condition.tension_left(line, mesh)
    with pytest.raises(EquilibriumError, match=r"under a stitch wire.* a wire must pull; .* messenger wire lose less"):
        form_finding._check_wires(line, dataclasses.replace(mesh, tension_factor=left))


def test_places_are_drawn_from_a_stream_of_their_own(short):
    """A dropper's place does not depend on the other errors' size, nor on faults."""
    line, design = short
    errors = dropper_position_errors(
        dataclasses.replace(line.irregularity, dropper_position_sigma=0.05), design.shape.mesh
    )
    wild = line.with_values({"irregularity.dropper_position_sigma": 0.05, "irregularity.stagger_sigma": 0.02})
    condition = condition_of(design, with_fault(wild, "arm_loose", support=SUPPORT))
    lower = condition.shape.mesh.droppers[:, 0], design.shape.mesh.droppers[:, 0]
    found = condition.shape.mesh.points[lower[0], 0] - design.shape.mesh.points[lower[1], 0]
    assert found == pytest.approx(errors, abs=1e-9)
    held = attachments(condition.shape.mesh)
    (wire,) = condition.shape.mesh.contact_chains()
    x, y = condition.shape.points[wire.nodes, :2].T
    at = held[wire.nodes]
    assert np.abs(y - np.interp(x, x[at], y[at])).max() < 1e-12, "straight in plan between its clamps"


def test_a_hard_point_has_a_node_of_its_own_or_that_of_a_clamp_beside_it(short):
    line, design = short
    clamp = float(line.sections[0].spans[2].droppers[2])
    for place, expected in ((127.77, 127.77), (clamp + 0.009, clamp)):
        found = condition_of(design, with_fault(line, "hard_point", position=place, value=40.0)).shape.mesh
        (heaviest,) = np.flatnonzero(found.clamp_mass > 30.0)
        assert found.points[heaviest, 0] == pytest.approx(expected, abs=1e-9)


def test_an_arm_that_an_error_makes_push_is_told_with_it(short):
    line, design = short
    wild = line.with_values({"irregularity.stagger_sigma": 0.5, "irregularity.seed": 6})
    with pytest.raises(EquilibriumError, match=r"pull; .* stagger, or take a smaller irregularity\.stagger_sigma"):
        condition_of(design, wild)
