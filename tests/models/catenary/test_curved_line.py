"""Motion of a line in a curve: energy, both kinds of kernels, where a strip meets the wire, several kinds of lines."""

import dataclasses

import numpy as np
import pytest

from models.catenary.definition.track_definition import Track
from models.catenary.line_energy import LineBalance
from models.catenary.line_model import CatenaryModel
from models.catenary.line_state import StripMotion
from models.catenary.step.compiled_line_step import CompiledLineStep
from models.catenary.step.engine_choice import kernels
from models.catenary.step.plain_step import PlainStep
from models.library.catalogue import load_line

STEP = 1e-3
TRANSITION = Track(positions=(40.0, 110.0, 180.0, 260.0), curvature=(0.0, 1e-3, 1e-3, 0.0), cant=(0.0, 0.08, 0.08, 0.0))


@pytest.fixture(scope="module")
def curved(short_line):
    return dataclasses.replace(short_line, track=TRANSITION)


def strip(x, z=5.11, half=0.725):
    return np.array([[[[x, y, z], [50.0, 0.0, 0.0]] for y in (half, -half)]])


def passed(model, start, steps):
    """Let a strip pass at one height; return contact points and the balance of energy."""
    state = model.initial_state()
    balance = LineBalance(model, strip(start), model.contact_at_rest(state, strip(start)))
    points, forces, drift = [], [], 0.0
    for n in range(1, steps + 1):
        result = balance.step(state, STEP, StripMotion(strip(start + 0.05 * n), np.zeros(1)))
        points.append(result.point[0, 0])
        forces.append(result.force[0, 0])
        drift = max(drift, abs(balance.balance(state)[3]))
    return np.array(points), np.array(forces), drift, balance.balance(state)[2]


def test_a_strip_meets_the_wire_where_it_lies_in_the_curve_and_energy_balances(curved):
    model = CatenaryModel(curved)
    points, forces, drift, work = passed(model, 110.0, 300)
    touching = forces > 0.0
    assert np.count_nonzero(touching) > 200
    assert drift < 1e-12 * work
    nodes = model.mesh.contact_chains()[0].nodes
    x, y, _ = model.static.positions[nodes].T
    met = points[touching]
    np.testing.assert_allclose(met[:, 1], np.interp(met[:, 0], x, y), atol=0.01)
    assert np.ptp(met[:, 1]) > 0.1  # it sweeps along the strip though the track does not


def test_compiled_steps_in_a_curve_are_the_plain_ones(curved, monkeypatch):
    pytest.importorskip("numba")
    found = []
    for kind, cls in (("numpy", PlainStep), ("numba", CompiledLineStep)):
        monkeypatch.setenv("OPENPANTO_KERNEL", kind)
        if kind == "numba":
            kernels()
        model = CatenaryModel(curved)
        assert isinstance(model._engine(STEP), cls)
        found.append(passed(model, 110.0, 100)[:2])
    for plain, compiled in zip(*found, strict=True):
        np.testing.assert_allclose(compiled, plain, rtol=1e-9)


@pytest.mark.parametrize("name", ["Re330", "Shinkansen", "LN2_overlap"])
def test_lines_of_every_kind_lie_in_curves(name):
    """Lateral loads of all their wires are those of the supports: sum T kappa over the whole line."""
    line = load_line(name)
    curved = dataclasses.replace(line, track=Track(positions=(0.0,), curvature=(1 / 4000,)))
    model = CatenaryModel(curved)
    static, mesh = model.static, model.mesh
    assert static.residual < 1e-12
    held = static.shape.matrices.K @ static.displacement - static.shape.matrices.load
    held += static.shape.droppers.rows.T @ static.dropper_force
    lateral = held.reshape(-1, 6)[:, 1][mesh.fixed[:, 1]].sum()
    straight = sum(
        getattr(line, chain.component).tension * (np.ptp(mesh.points[chain.nodes, 0]) / 4000)
        for chain in mesh.chains
        if chain.component != "stitch_wire"  # what it pulls, the messenger wire beside it lacks
    )
    assert lateral == pytest.approx(-straight, rel=1e-3)


def test_a_ring_in_a_curve_repeats_itself(ring_maker):
    """Constant radius and cant: after two spans of alternating stagger the line is the same again."""
    ring = ring_maker(track={"positions": [[0.0], "m", "x"], "radius": [[1500], "m", "x"], "cant": [[50], "mm", "x"]})
    model = CatenaryModel(ring)
    force = model.static.arm_force
    assert force[::2] == pytest.approx([force[0]] * 5, rel=1e-6)
    assert force[0] != pytest.approx(force[1], rel=0.1)
