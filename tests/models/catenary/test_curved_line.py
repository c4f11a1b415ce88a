"""Motion of a line in a curve: energy, both kinds of kernels, where a strip meets the wire, several kinds of lines."""

import dataclasses
import importlib.util

import numpy as np
import pytest

from models.catenary.definition.track_definition import Track
from models.catenary.line_energy import LineBalance
from models.catenary.line_model import CatenaryModel
from models.catenary.line_state import StripMotion
from models.catenary.step.compiled_line_step import CompiledLineStep
from models.catenary.step.plain_step import PlainStep
from models.library.catalogue import load_line
from tests.effort import rest

STEP = 1e-3
TRANSITION = Track(positions=(40.0, 110.0, 180.0, 260.0), curvature=(0.0, 1e-3, 1e-3, 0.0), cant=(0.0, 0.08, 0.08, 0.0))


@pytest.fixture(scope="module")
def curved(short_line):
    return dataclasses.replace(short_line, track=TRANSITION)


def has_numba():
    return importlib.util.find_spec("numba") is not None


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


@pytest.fixture(scope="module")
def overlap(sections_maker, section_maker):
    """Two sections that overlap in the full curve, warmer than they were strung."""
    line = sections_maker(
        section_maker(0.0, 4, [-0.2, -0.2, -0.2], rise=[0.3, "m", "x"]),
        section_maker(100.0, 4, [0.1, -0.2, -0.2], rise=[0.3, "m", "x"]),
        tensioning={
            "temperature": [35, "degC", "x"], "reference_temperature": [10, "degC", "x"], "direction": 1,
            "contact_wire": {"efficiency": [0.97, "1", "x"]}, "messenger_wire": {"kind": "fixed"},
        },
    )  # fmt: skip
    arm = dataclasses.replace(line.steady_arm, angle=-0.03)
    return dataclasses.replace(line, track=TRANSITION, steady_arm=arm)


def two_pass(model, steps):
    """Two strips, 31 m apart, the first through the overlap: forces on both wires, points, balance of energy, work."""

    def strips(n):
        return np.concatenate([strip(140.0 + 0.05 * n), strip(109.0 + 0.05 * n)])

    state = model.initial_state(2)
    balance = LineBalance(model, strips(0), model.contact_at_rest(state, strips(0)))
    forces, points = [], []
    for n in range(1, steps + 1):
        result = balance.step(state, STEP, StripMotion(strips(n), np.zeros(2)))
        forces.append(result.force)
        points.append(np.where(result.force[:, :, None] > 0.0, result.point, 0.0))
    return np.array(forces), np.array(points), balance.balance(state)[3], balance.balance(state)[2]


def test_two_strips_in_an_overlap_in_a_curve_at_another_temperature(overlap, monkeypatch):
    """Both kinds of kernels alike, energy balanced, and both wires touched where they lie."""
    found = []
    kinds = (("numpy", PlainStep), ("numba", CompiledLineStep))[: 2 if has_numba() else 1]
    for kind, cls in kinds:
        monkeypatch.setenv("OPENPANTO_KERNEL", kind)
        model = CatenaryModel(overlap)
        assert isinstance(model._engine(STEP), cls)
        found.append(two_pass(model, 250))
        forces, points, drift, work = found[-1]
        assert abs(drift) < 1e-12 * work
    for one, other in zip(found[0][:2], found[-1][:2], strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-9)
    both = (forces > 0.0).all(axis=2)
    assert both[:, 0].sum() > 20
    assert (forces[:, 1, 0] > 0.0).sum() > 50
    for section, chain in enumerate(model.mesh.contact_chains()):
        x, y, _ = model.static.positions[chain.nodes].T
        met = points[:, :, section][forces[:, :, section] > 0.0]
        np.testing.assert_allclose(met[:, 1], np.interp(met[:, 0], x, y), atol=0.01)


@pytest.mark.parametrize("name", ["Re330", *rest("Shinkansen")])
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
    """After two spans of alternating stagger the line is the same again, also for a strip where it closes."""
    ring = ring_maker(track={"positions": [[0.0], "m", "x"], "radius": [[1500], "m", "x"], "cant": [[50], "mm", "x"]})
    model = CatenaryModel(ring)
    force = model.static.arm_force
    assert force[::2] == pytest.approx([force[0]] * 5, rel=1e-6)
    assert force[0] != pytest.approx(force[1], rel=0.1)
    (points, pressed, drift, work), (before, pressed_before, _, _) = (passed(model, x, 300) for x in (492.5, 92.5))
    assert drift < 1e-12 * work
    np.testing.assert_allclose(pressed, pressed_before, rtol=1e-6)
    np.testing.assert_allclose(points, before + np.array([400.0, 0.0, 0.0]), atol=1e-8)
