"""What the tension of droppers and steady arms holds them back by, N/L across them, against bars under tension."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.linalg import eigh

from models.catenary.line_model import CatenaryModel
from models.catenary.shape.beam_elements import NODE_DOFS, bar_geometric_stiffness
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_matrices import pendulum_stiffness
from models.catenary.shape.line_mesh import build_mesh
from models.catenary.statics import elasticity
from models.definition_files.parameter import ParameterError
from models.library.catalogue import line_names, load_line
from tests.effort import rest, some
from tests.models import nodal_line

GRAVITY = 9.81


@pytest.fixture(scope="module", params=some(line_names(), "LN2", "LN2_ring", "Re330", "Shinkansen"))
def line_and_form(request):
    line = load_line(request.param)
    static = kept_form(line, build_mesh(line))
    return line, static.shape.mesh, static


def bar_force(ends, unstrained, stiffness):
    """Return the forces on the ends of an elastic bar in space, wherever they are: nothing linearised."""
    along = ends[1] - ends[0]
    length = np.linalg.norm(along)
    pull = stiffness * (length - unstrained) * along / length
    return np.concatenate([-pull, pull])


def differences(ends, unstrained, stiffness, move=1e-5):
    """Return d(force)/d(displacement) of a bar by central differences."""
    columns = []
    for k in range(6):
        step = np.zeros(6)
        step[k] = move
        ahead, behind = (bar_force(ends + sign * step.reshape(2, 3), unstrained, stiffness) for sign in (1.0, -1.0))
        columns.append((ahead - behind) / (2.0 * move))
    return np.array(columns).T


def test_every_bar_of_every_line_has_the_stiffness_of_its_nonlinear_force(line_and_form):
    """Droppers and arms, axial and across, at their static places; K is what the motion is about the static shape."""
    line, mesh, static = line_and_form
    droppers = [*zip(mesh.droppers, static.dropper_force, static.unstrained_length, strict=True)]
    stiffness = [*(static.dropper_force / (static.droppers.length - static.unstrained_length))]
    arm_EA = line.steady_arm.youngs_modulus * line.steady_arm.area if line.steady_arm else 0.0
    bars = [(pair, force, k) for (pair, force, _), k in zip(droppers, stiffness, strict=True)]
    for pair, force in zip(mesh.arms, static.arm_force, strict=True):
        length = np.linalg.norm(np.diff(static.shape.points[pair], axis=0))
        bars.append((pair, force, arm_EA / length))
    for pair, force, k in bars[:: max(1, len(bars) // 60)] + bars[len(droppers) :]:
        ends = static.positions[pair]
        length = np.linalg.norm(ends[1] - ends[0])
        axis = (ends[1] - ends[0]) / length
        expected = differences(ends, length - force / k, k)
        row = np.concatenate([-axis, axis])
        found = k * np.outer(row, row)
        found += bar_geometric_stiffness(axis[None], np.array([force]), np.array([length]))[0]
        # Second order: the differences are of a bar that is stretched by the move itself.
        assert found == pytest.approx(expected, abs=1e-6 * k + 1e-5 * force / length)


def test_it_stands_where_droppers_and_arms_stand_and_nowhere_else(line_and_form):
    _, mesh, static = line_and_form
    found = static.pendulum_stiffness()
    expected = nodal_line.pendulum_stiffness(mesh, static)
    assert abs(found - expected).max() < 1e-9 * abs(expected).max()
    rigid = np.zeros((len(mesh.points), NODE_DOFS))
    rigid[:, :3] = 1.0
    assert np.abs(found @ rigid.ravel()).max() < 1e-9 * abs(found).max()  # moved as a whole, a bar resists nothing
    assert static.dropper_force.min() > 0.0


def test_the_motion_of_a_line_feels_it_in_stiffness_and_not_in_damping(line_maker):
    """The whole K and C of the motion, with and without: what differs is K at the attachments, by N/L."""
    line = line_maker(spans=4)
    with_it, without = (CatenaryModel(line.with_values({"dynamics.geometric_stiffness": k})) for k in (1, 0))
    assert abs(with_it.modes.C - without.modes.C).max() == 0.0
    assert abs(with_it.modes.M - without.modes.M).max() == 0.0
    assert np.array_equal(with_it.modes.eigenvalue, without.modes.eigenvalue)
    assert np.array_equal(with_it.static.shape.points, without.static.shape.points)
    free = with_it.modes.attached
    added = nodal_line.pendulum_stiffness(with_it.mesh, with_it.static)[free][:, free]
    difference = with_it.modes.K - without.modes.K
    assert abs(difference - added).max() < 1e-11 * abs(with_it.modes.K).max()
    assert abs(added).max() > 50.0


def test_a_bar_on_two_droppers_swings_as_a_pendulum():
    """A rigid bar on two equal droppers of 1.000 m: sqrt(g / L) / 2 pi = 0.4985 Hz, whatever it weighs."""
    mass, length, k = 20.0, 1.0, 1e6
    points = np.array([[x, 0.0, z] for x in (0.0, 3.0) for z in (4.0, 5.0)])
    droppers = np.array([[0, 1], [2, 3]])
    K = pendulum_stiffness(droppers, np.full(2, mass * GRAVITY / 2.0), points).toarray()
    for pair in droppers:
        row = np.zeros(K.shape[0])
        row[pair * NODE_DOFS + 2] = [-1.0, 1.0]
        K += k * np.outer(row, row)
    # The bar's motion: x, y, z, and its turns about z and y.
    rigid = np.zeros((K.shape[0], 5))
    for node, arm in ((0, -1.5), (2, 1.5)):
        for axis in range(3):
            rigid[node * NODE_DOFS + axis, axis] = 1.0
        rigid[node * NODE_DOFS + 1, 3], rigid[node * NODE_DOFS + 2, 4] = arm, -arm
    inertia = mass * 3.0**2 / 12.0
    squares = eigh(rigid.T @ K @ rigid, np.diag([mass, mass, mass, inertia, inertia]), eigvals_only=True)
    frequencies = np.sqrt(squares) / (2.0 * math.pi)
    assert frequencies[:2] == pytest.approx([math.sqrt(GRAVITY / length) / (2.0 * math.pi)] * 2, rel=1e-9)
    assert frequencies[0] == pytest.approx(0.4985, abs=1e-4)
    # As a bifilar pendulum it turns faster, by sqrt(3).
    assert frequencies[2] == pytest.approx(0.4985 * math.sqrt(3.0), abs=2e-4)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [("LN2", 262.0, 270.0), *rest(("EN50318_2018_AC_simple", 263.0, 270.0), ("Re330", 788.0, 788.0))],
)
def test_arms_have_the_stiffness_of_the_specification(name, low, high):
    """N/l in the spans of which a line has most, those beside an anchor left out, within 2 %."""
    line = load_line(name)
    model = CatenaryModel(line)
    mesh, static = model.mesh, model.static
    usual = np.median([span.length for span in line.sections[0].spans])
    around = {s.start: s.length for s in line.sections[0].spans}, {s.end: s.length for s in line.sections[0].spans}
    seen = 0
    for (end, node), force in zip(mesh.arms[1:-1], static.arm_force[1:-1], strict=True):
        x = round(float(mesh.points[node, 0]), 6)
        if any(abs(lengths.get(x, 0.0) - usual) > 1.0 for lengths in around):
            continue
        seen += 1
        length = np.linalg.norm(static.positions[end] - static.positions[node])
        assert 0.98 * low < force / length < 1.02 * high
    assert seen >= 3


def without_bending(line, elements):
    """Return a line of wires that do not bend, in a fine mesh."""
    line = line.with_values({"mesh.elements_between_droppers": elements})
    limp = {w: dataclasses.replace(getattr(line, w), bending_stiffness=0.0) for w in ("contact_wire", "messenger_wire")}
    return dataclasses.replace(line, **limp)


@pytest.mark.slow
@pytest.mark.long
def test_the_support_of_LN2_gives_way_as_a_nonlinear_truss_does(ln2):
    """100 N lift it by 22.63 mm in a truss without bending, 16 elements between droppers; 23.9 mm without N/L."""
    at = np.array([600.7])
    line = without_bending(ln2, 16)
    lifted = 1e5 * elasticity.elasticity(CatenaryModel(line), at, 100.0).value[0]
    assert lifted == pytest.approx(22.63, rel=0.015)
    plain = CatenaryModel(line.with_values({"dynamics.geometric_stiffness": 0}))
    assert 1e5 * elasticity.elasticity(plain, at, 100.0).value[0] == pytest.approx(23.9, abs=0.1)


def test_the_switch_is_a_number_that_an_FMU_offers(ln2):
    names = {p.name: p for p in ln2.parameters()}
    assert names["dynamics.geometric_stiffness"].value == 1.0
    assert names["dynamics.geometric_stiffness"].is_integer
    with pytest.raises(ParameterError, match=r"dynamics\.geometric_stiffness"):
        ln2.with_values({"dynamics.geometric_stiffness": 2})


def test_arms_of_a_straight_wire_neither_pull_nor_push(line_maker):
    """Their own weight presses or pulls them by less than it is, which says nothing of the wire."""
    stagger = {"amplitude": [0.0, "m", "test"]}
    model = CatenaryModel(line_maker(spans=4, stagger=stagger))
    assert np.abs(model.static.arm_force).max() < 1.07 * 1.22 * GRAVITY


def test_a_dropper_that_is_slack_at_rest_holds_nothing(line_maker):
    """Given lengths: that in the middle of every span is far too long."""
    line = line_maker(spans=4)
    section = line.sections[0]
    lengths = (1.25, 1.16, 1.09, 1.30, 1.09, 1.16, 1.25)
    spans = tuple(dataclasses.replace(span, dropper_lengths=lengths) for span in section.spans)
    model = CatenaryModel(dataclasses.replace(line, sections=(dataclasses.replace(section, spans=spans),)))
    slack = np.flatnonzero(model.static.elastic_force < 0.0)
    K = model.static.pendulum_stiffness().toarray()
    assert len(slack) >= 4
    for j in slack:
        lower = int(model.mesh.droppers[j, 0]) * NODE_DOFS
        assert not K[lower : lower + 3].any()
