"""Modes of intervals and displacements of attachments: a change of coordinates that leaves nothing out."""

import math
from itertools import pairwise

import numpy as np
import pytest
import scipy.sparse as sp

from models.catenary.line_model import CatenaryModel
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.wire_intervals import attachments, intervals, plan_angles, plan_rotation, without_rounding
from tests.models.conftest import make_overlap, shortened
from tests.models.nodal_line import NodalLine


@pytest.fixture(scope="module")
def model(short_line):
    return CatenaryModel(short_line)


@pytest.fixture(scope="module", params=["short", "Re330", "overlap"])
def any_model(request, model):
    """Staggered; with stitch wires; with two sections."""
    if request.param == "short":
        return model
    return CatenaryModel(shortened("Re330", 8) if request.param == "Re330" else make_overlap())


def _moved(model, seed):
    """Return random displacements of the free degrees of freedom, and the same in the line's coordinates."""
    nodal = np.where(model.mesh.fixed, 0.0, np.random.default_rng(seed).standard_normal(model.mesh.fixed.shape))
    state = model.initial_state()
    model.set_velocity(state, nodal)
    q, x = state.motion.modal[1], state.motion.attached[1]
    return nodal.ravel()[np.flatnonzero(~model.mesh.fixed.ravel())], q, x


def test_every_motion_of_the_nodes_has_its_coordinates(any_model):
    model = any_model
    state = model.initial_state()
    nodal = np.where(model.mesh.fixed, 0.0, np.random.default_rng(1).standard_normal(model.mesh.fixed.shape))
    model.set_velocity(state, nodal)
    state.motion.modal[0], state.motion.attached[0] = state.motion.modal[1], state.motion.attached[1]
    assert model.displacement(state) == pytest.approx(nodal, abs=1e-12)
    assert len(state.motion.modal[0]) + len(state.motion.attached[0]) == (~model.mesh.fixed).sum()


def test_forms_of_stiffness_mass_and_damping_are_those_of_the_nodes(any_model):
    """In the coordinates (q, x): stiffness and damping of intervals diagonal, coupling through the mass alone."""
    model, nodal, modes = any_model, NodalLine(any_model), any_model.modes
    G = modes.coupling @ modes.turn
    for seed in (1, 2):
        (a, q, x), (b, r, y) = _moved(model, seed), _moved(model, seed + 10)
        K = (modes.eigenvalue * q) @ r + x @ (modes.K @ y)
        M = q @ r + q @ (G @ y) + r @ (G @ x) + x @ (modes.M @ y)
        C = ((modes.alpha * modes.eigenvalue + modes.beta) * q) @ r + x @ (modes.C @ y)
        C += (modes.beta * q) @ (G @ y) + (modes.beta * r) @ (G @ x)
        for value, matrix in ((K, nodal.K), (M, nodal.M), (C, nodal.C)):
            scale = math.sqrt(float(a @ (matrix @ a)) * float(b @ (matrix @ b)))
            assert value == pytest.approx(float(a @ (matrix @ b)), abs=1e-11 * scale)


def test_an_interval_moves_in_plane_and_out_of_plane(model):
    """Six elements between droppers leave five nodes of three degrees of freedom in each block."""
    count = 2 * 6 * 8  # two wires, six spans, eight intervals
    assert [block.inner.shape for block in model.modes.blocks] == [(2 * count, 15)]


def test_a_mode_is_moved_by_its_ends_in_its_own_plane_only(model):
    """But where an end is held, whose axes are not the interval's."""
    per_mode = np.diff(model.modes.coupling.indptr)
    assert np.mean(per_mode <= NODE_DOFS) > 0.9
    assert per_mode.max() <= 2 * NODE_DOFS


def test_the_first_frequency_is_that_of_a_tensioned_beam(model):
    """First mode between droppers: a string whose ends bending clamps; elements longer than the layer are stiffer."""
    wire = model.definition.contact_wire
    span = model.definition.sections[0].spans[2]
    length = span.droppers[3] - span.droppers[2]
    longest = np.sqrt(wire.tension / wire.mass) / (2.0 * length)
    found = np.sqrt(model.modes.eigenvalue) / (2.0 * math.pi)
    layer = math.sqrt(wire.EI / wire.tension) / length  # clamped ends shorten a string by the bending layer
    expected = longest * (1.0 + 2.0 * layer)
    nearest = found[np.abs(found - expected).argmin()]
    assert expected < nearest < 1.03 * expected


def test_modes_are_slower_than_the_step_needs_and_faster_than_the_line(model):
    frequency = np.sqrt(model.modes.eigenvalue) / (2.0 * math.pi)
    assert frequency.min() > 2.0
    assert np.isfinite(frequency).all()


def test_intervals_cover_a_wire(model):
    attached = attachments(model.mesh)
    for chain in model.mesh.chains:
        parts = intervals(chain, attached)
        assert parts[0].nodes[0] == chain.nodes[0]
        assert parts[-1].nodes[-1] == chain.nodes[-1]
        assert all(a.nodes[-1] == b.nodes[0] for a, b in pairwise(parts))
        assert sum(len(part.nodes) - 1 for part in parts) == len(chain.nodes) - 1


def test_rotation_to_nodal_axes_changes_no_energy(model):
    """The rotated stiffness, without what rounding leaves of zeros, is the same quadratic form."""
    matrices, attached = model.static.shape.matrices, attachments(model.mesh)
    parts = [part for chain in model.mesh.chains for part in intervals(chain, attached)]
    Q = plan_rotation(plan_angles(parts, model.static.shape.points))
    rotated = (Q.T @ matrices.K @ Q).tocsr()
    cleaned = without_rounding(rotated, np.sqrt(rotated.diagonal()))
    assert cleaned.nnz < 0.7 * matrices.K.nnz
    rng = np.random.default_rng(2)
    for _ in range(3):
        d = rng.standard_normal(matrices.load.size)
        assert (Q.T @ d) @ cleaned @ (Q.T @ d) == pytest.approx(d @ matrices.K @ d, rel=1e-10)


def test_rotation_is_orthogonal():
    Q = plan_rotation(np.array([0.0, 0.3, -1.2]))
    assert (Q @ Q.T).toarray() == pytest.approx(np.eye(18), abs=1e-15)
    assert isinstance(Q, sp.csr_matrix)
