"""Dynamics of wires against theory, conservation of energy, and exact dropper slack against the plain iteration."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu, spsolve

from models.catenary.line_model import CatenaryModel
from models.catenary.line_state import StripMotion
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.form_finding import weight
from models.catenary.shape.line_mesh import CatenaryMesh, Chain
from models.catenary.shape.line_shape import line_shape
from models.numerics.newmark import Newmark, steps_within
from tests.effort import rest
from tests.models.nodal_line import NodalLine, pulls

GRAVITY = 9.81
#: In a straight wire these, w and ry, move by themselves.
_UP_AND_DOWN = (2, 4)


def _single_wire(length, elements):
    """A contact wire alone, pinned at both ends."""
    n = elements + 1
    points = np.zeros((n, 3))
    points[:, 0] = np.linspace(0.0, length, n)
    points[:, 2] = 5.0
    fixed = np.zeros((n, NODE_DOFS), dtype=bool)
    fixed[[0, -1], :4] = True
    nodes = np.arange(n)
    return CatenaryMesh(
        points=points,
        section=np.zeros(n, dtype=np.int64),
        beams=np.stack([nodes[:-1], nodes[1:]], axis=1),
        component=np.zeros(elements, dtype=np.int64),
        chains=(Chain("contact_wire", 0, nodes),),
        droppers=np.zeros((0, 2), dtype=np.int64),
        is_hanger=np.zeros(0, dtype=bool),
        beside_stitch=np.zeros(elements, dtype=bool),
        tension_factor=np.ones(elements),
        area_factor=np.ones(elements),
        target=np.zeros(0),
        given_length=np.zeros(0),
        broken=np.zeros(0, dtype=bool),
        fixed=fixed,
        sprung=np.zeros(0, dtype=np.int64),
        seat=np.zeros(0),
        clamp_mass=np.zeros(n),
        support_nodes=np.zeros(0, dtype=np.int64),
        arms=np.zeros((0, 2), dtype=np.int64),
        owner=nodes,
        adrift=np.zeros(0, dtype=np.int64),
    )


def _wire_matrices(definition, mesh, moves=range(NODE_DOFS)):
    """Return K, M and load of what is free, and which that is: of every node all its motion, or some."""
    matrices = line_shape(definition, mesh, mesh.points).matrices
    free = np.flatnonzero(~mesh.fixed.ravel() & np.isin(np.arange(mesh.fixed.size) % NODE_DOFS, list(moves)))
    K, M = (m[free][:, free].tocsc() for m in (matrices.K, matrices.M))
    return K, M, matrices.load[free], free


def test_sag_of_a_single_tensioned_span(short_line):
    """Stiff string under its weight: parabola q x (L - x) / 2T less the ends' bending layers."""
    length = 50.0
    mesh = _single_wire(length, 100)
    K, _, load, free = _wire_matrices(short_line, mesh)
    d = np.zeros(mesh.fixed.size)
    d[free] = spsolve(K, load)
    wire = short_line.contact_wire
    q, lam = wire.mass * GRAVITY, np.sqrt(wire.tension / wire.EI)
    x = mesh.points[:, 0]
    layer = 1.0 - np.cosh(lam * (x - length / 2.0)) / np.cosh(lam * length / 2.0)
    exact = -q * x * (length - x) / (2.0 * wire.tension) + q / (wire.tension * lam**2) * layer
    assert d.reshape(-1, NODE_DOFS)[:, 2] == pytest.approx(exact, abs=2e-6)


def test_reactions_carry_the_weight(short_line):
    model = CatenaryModel(short_line)
    static, mesh = model.static, model.mesh
    matrices, rows = static.shape.matrices, static.shape.droppers.rows
    internal = matrices.K @ static.displacement + rows.T @ static.dropper_force - matrices.load
    reactions = internal.reshape(-1, NODE_DOFS)[:, 2][mesh.fixed[:, 2]]
    assert reactions.sum() == pytest.approx(weight(matrices), rel=1e-9)
    # The weight itself, from the definition: wires over their length, droppers, arms, clamps.
    d = short_line
    wires = (d.contact_wire.mass + d.messenger_wire.mass) * 300.0
    droppers = d.dropper.mass * static.droppers.length.sum()
    arms = 5 * (d.steady_arm.mass * d.steady_arm.length + d.clamps.steady_arm)
    clamps = 42 * (d.clamps.dropper_lower + d.clamps.dropper_upper)
    assert weight(matrices) == pytest.approx(GRAVITY * (wires + droppers + arms + clamps), rel=2e-3)


def test_wave_speed_on_a_long_wire(short_line):
    """A pulse runs along an untroubled wire with sqrt(T/m)."""
    mesh = _single_wire(400.0, 800)
    K, M, _, free = _wire_matrices(short_line, mesh, _UP_AND_DOWN)
    newmark = Newmark(5e-4)
    factor = splu((K + newmark.a0 * M).tocsc())
    vertical = {node: i for i, node in enumerate(free.tolist())}
    at = [vertical[int(round(x / 0.5)) * NODE_DOFS + 2] for x in (200.0, 250.0, 330.0)]
    d, v, a = (np.zeros(len(free)) for _ in range(3))
    history = []
    for n in range(2600):
        load = np.zeros(len(free))
        t = n * newmark.step
        load[at[0]] = 100.0 * np.sin(np.pi * t / 0.1) ** 2 if t < 0.1 else 0.0
        new = factor.solve(load + M @ (newmark.a0 * d + newmark.a2 * v + newmark.a3 * a))
        acceleration = newmark.a0 * (new - d) - newmark.a2 * v - newmark.a3 * a
        v = v + 0.5 * newmark.step * (a + acceleration)
        d, a = new, acceleration
        history.append(v[at[1:]])
    arrival = np.argmax(np.array(history), axis=0) * newmark.step
    speed = 80.0 / (arrival[1] - arrival[0])
    wire = short_line.contact_wire
    assert speed == pytest.approx(np.sqrt(wire.tension / wire.mass), rel=0.01)


@pytest.mark.parametrize("ratio", [0.8, *rest(0.3, 0.6)])
def test_uplift_under_a_moving_force_on_a_string_on_springs(short_line, ratio):
    """w(x) = P / (2 sqrt(k T')) exp(-|x| sqrt(k / T')), T' = T (1 - V^2/c^2): Mathews (1958), without bending."""
    definition = dataclasses.replace(
        short_line, contact_wire=dataclasses.replace(short_line.contact_wire, bending_stiffness=1e-3)
    )
    length, elements, k, P = 200.0, 800, 2000.0, 100.0
    mesh = _single_wire(length, elements)
    K, M, _, free = _wire_matrices(definition, mesh, _UP_AND_DOWN)
    cell = length / elements
    springs = np.zeros(mesh.fixed.size)
    springs[2::NODE_DOFS] = k * cell
    K = K + sp.diags(springs[free])
    wire = definition.contact_wire
    speed = ratio * np.sqrt(wire.tension / wire.mass)
    newmark = Newmark(5e-4)
    factor = splu((K + newmark.a0 * M).tocsc())
    index = np.full(mesh.fixed.size, -1)
    index[free] = np.arange(len(free))
    d, v, a = (np.zeros(len(free)) for _ in range(3))
    steps = int(120.0 / speed / newmark.step)
    for n in range(1, steps + 1):
        x = 50.0 + speed * n * newmark.step
        element, xi = int(x / cell), x / cell - int(x / cell)
        load = np.zeros(len(free))
        ramp = np.sin(0.5 * np.pi * min(1.0, n * newmark.step / 1.2)) ** 2
        shape = np.array([1 - 3 * xi**2 + 2 * xi**3, 3 * xi**2 - 2 * xi**3])
        slope = cell * np.array([xi * (1 - xi) ** 2, xi**2 * (xi - 1)])
        dofs = element * NODE_DOFS + np.array([2, 8, 4, 10])
        at_force = np.concatenate([shape, -slope])
        load[index[dofs]] = ramp * P * at_force
        new = factor.solve(load + M @ (newmark.a0 * d + newmark.a2 * v + newmark.a3 * a))
        acceleration = newmark.a0 * (new - d) - newmark.a2 * v - newmark.a3 * a
        v = v + 0.5 * newmark.step * (a + acceleration)
        d, a = new, acceleration
    reduced = wire.tension * (1.0 - ratio**2)
    exact = P / (2.0 * np.sqrt(k * reduced))
    assert at_force @ d[index[dofs]] == pytest.approx(exact, rel=0.01)


def test_undamped_line_keeps_its_energy(line_maker):
    """Without damping, contact or slack the trapezoidal rule conserves energy to rounding."""
    definition = line_maker(spans=4, alpha=0.0, dropper={
        "stiffness": [1000.0, "kN/m", "test"], "mass": [0.11, "kg/m", "test"],
        "compression_ratio": [1.0, "1", "test"],
    })  # fmt: skip
    model = CatenaryModel(definition)
    state = model.initial_state()
    rng = np.random.default_rng(1)
    model.set_velocity(state, 1e-2 * rng.standard_normal(model.mesh.fixed.shape))
    before = model.energy(state)
    motion = StripMotion(_below(100.0), np.zeros(1))
    for _ in range(300):
        model.step(state, 1e-3, motion)
    assert model.energy(state) == pytest.approx(before, rel=1e-9)


def test_damping_takes_energy_away(short_line):
    model = CatenaryModel(short_line)
    state = model.initial_state()
    model.set_velocity(state, np.full(model.mesh.fixed.shape, 1e-3))
    motion = StripMotion(_below(100.0), np.zeros(1))
    energy = []
    for _ in range(50):
        model.step(state, 1e-3, motion)
        energy.append(model.energy(state))
    assert np.all(np.diff(energy) < 0.0)


def test_line_at_rest_stays_at_rest(short_line):
    model = CatenaryModel(short_line)
    state = model.initial_state()
    for _ in range(20):
        model.step(state, 1e-3, StripMotion(_below(100.0), np.zeros(1)))
    assert np.abs(model.displacement(state)).max() == 0.0


def _below(x):
    return np.array([[[[x, 0.7, -50.0], [0.0, 0.0, 0.0]], [[x, -0.7, -50.0], [0.0, 0.0, 0.0]]]])


def _moving_strip(n, dt, speed=83.0, start=95.0):
    x = start + speed * n * dt
    z = 5.09 + 0.05 * np.sin(2.0 * np.pi * n * dt / 0.25)
    return np.array([[[[x, 0.7, z], [speed, 0.0, 0.0]], [[x, -0.7, z], [speed, 0.0, 0.0]]]])


def _plain_iteration(model, dt, steps):
    """The source's fixed-point iteration, run to convergence: every slack dropper's force compensated [2.11].

    The compensations and the contact force act through responses solved once, so an iteration is a small product.
    """
    newmark, line = Newmark(dt), NodalLine(model)
    lu = splu((line.K + newmark.a0 * line.M + newmark.a1 * line.C).tocsc())
    d, v, a = (np.zeros(line.size) for _ in range(3))
    contact = model.definition.contact
    given_way = lu.solve(line.B.T.toarray())
    between = line.B @ given_way
    element, forces, slack, contacts = -1, [], [], []
    for n in range(1, steps + 1):
        strip = _moving_strip(n, dt)[0]
        right = line.M @ (newmark.a0 * d + newmark.a2 * v + newmark.a3 * a)
        right += line.C @ (newmark.a1 * d + newmark.a4 * v)
        free = lu.solve(right)
        found = line.find(0, strip, free, element)
        element = found.element
        shape, height = line.row(0, found.element, found.xi)
        z = strip[0, 0, 2] + found.share * (strip[1, 0, 2] - strip[0, 0, 2])
        pushed = lu.solve(shape)
        longer_free, longer_before, rate_before = line.B @ free, line.B @ d, line.B @ v
        to_droppers, to_contact, own = line.B @ pushed, shape @ given_way, shape @ pushed
        longer, rise = longer_free, shape @ free
        for _ in range(20000):
            cut = np.minimum(pulls(model, longer, newmark.a1 * (longer - longer_before) - rate_before), 0.0)
            force = contact.stiffness * max(z - (height + rise), 0.0)
            before, longer = longer, longer_free + between @ cut + force * to_droppers
            rise_before, rise = rise, shape @ free + to_contact @ cut + force * own
            if max(np.abs(longer - before).max(), abs(rise - rise_before)) < 1e-16:
                break
        new = free + given_way @ cut + force * pushed
        acceleration = newmark.a0 * (new - d) - newmark.a2 * v - newmark.a3 * a
        v = v + 0.5 * dt * (a + acceleration)
        d, a = new, acceleration
        pull, damper = pulls(model, line.B @ d, line.B @ v), _damper(model, line.B @ v)
        forces.append(np.maximum(pull, 0.0) + (damper if _keeps_damper(model) else 0.0))
        slack.append(pull < 0.0)
        contacts.append(force)
    return np.array(forces), np.array(slack), np.array(contacts)


def _keeps_damper(model):
    """By this law a slack dropper's damper goes on acting."""
    return model.definition.dropper.slack_law == "elastic_only"


def _damper(model, rate):
    """Return c e' of every dropper [N]."""
    return model.definition.damping.alpha * model.dropper_law.stiffness * rate


@pytest.fixture(scope="module", params=["tension", "elastic_only"])
def slackening(request, line_maker):
    """A case that slackens many droppers, low damping (alpha 0.00275 s) and a strip that heaves, by plain iteration."""
    law, line = request.param, line_maker(spans=4, alpha=0.00275)
    line = dataclasses.replace(line, dropper=dataclasses.replace(line.dropper, slack_law=law))
    return law, line, _plain_iteration(CatenaryModel(line), 1e-3, 500)


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
def test_exact_slack_equals_the_plain_iteration_run_to_convergence(slackening, kernel, monkeypatch):
    if kernel == "numba":
        pytest.importorskip("numba")
    monkeypatch.setenv("OPENPANTO_KERNEL", kernel)
    law, line, (plain, plain_slack, plain_contact) = slackening
    dt, model = 1e-3, CatenaryModel(line)
    state, steps = model.initial_state(), len(plain)
    exact, contact, slack = [], [], []
    for n in range(1, steps + 1):
        result = model.step(state, dt, StripMotion(_moving_strip(n, dt), np.zeros(1)))
        contact.append(result.force[0, 0])
        exact.append(model.dropper_force(state))
        slack.append(model.dropper_slack(state))
    exact, slack = np.array(exact), np.array(slack)
    assert slack.any(axis=1).sum() > 50
    assert slack.sum(axis=1).max() >= 3
    assert np.array_equal(slack, plain_slack)
    if law == "tension":
        assert exact.min() == 0.0
        assert np.array_equal(exact == 0.0, slack)
    else:
        assert exact[slack].min() < -10.0
        assert exact[slack].max() > 10.0
    assert np.abs(exact - plain).max() < 1e-6
    assert np.abs(np.array(contact) - plain_contact).max() < 1e-6


@pytest.mark.parametrize("kernel", ["numpy", *rest("auto")])
def test_droppers_slacken_far_from_the_contact_as_well(line_maker, kernel, monkeypatch):
    """A wave lifts the wire 600 m from a strip that only touches it: droppers slacken there as without the strip.

    So far away that a force under the strip does not reach them within a step.
    """
    monkeypatch.setenv("OPENPANTO_KERNEL", kernel)
    model = CatenaryModel(line_maker(spans=14))
    x = model.mesh.points[:, 0]
    (chain,) = model.mesh.contact_chains()
    field = np.zeros((len(x), NODE_DOFS))
    field[chain.nodes, 2] = 3.0 * np.exp(-(((x[chain.nodes] - 660.0) / 8.0) ** 2))
    field[model.mesh.fixed] = 0.0
    touching = _below(60.0)
    touching[..., 0, 2] = model.contact_at_rest(model.initial_state(), touching).point[0, 0, 2] + 1e-3
    far = model.static.positions[model.mesh.droppers[:, 0], 0] > 620.0
    records = []
    for strip in (_below(60.0), touching):
        state, forces, pressed = model.initial_state(), [], []
        model.set_velocity(state, field)
        for _ in range(40):
            pressed.append(model.step(state, 1e-3, StripMotion(strip, np.zeros(1))).force[0, 0])
            forces.append(model.dropper_force(state) - _damper(model, model.dropper_law.B @ state.motion.attached[1]))
        records.append((np.array(forces), np.array(pressed)))
    (alone, none), (beside, force) = records
    assert not none.any()
    assert force.min() > 1.0
    assert (alone[:, far] < 1e-9).any(axis=1).sum() > 10
    assert alone.min() > -1e-9
    assert beside.min() > -1e-9
    assert np.abs(beside[:, far] - alone[:, far]).max() < 1e-2


@pytest.mark.parametrize("law", ["tension", "elastic_only"])
def test_stiffness_in_compression_is_the_given_share(line_maker, law):
    """With a ratio r the force of a compressed dropper is r times that of a bilateral one."""
    line = line_maker(spans=4, alpha=0.00275, dropper={
        "stiffness": [900.0, "kN/m", "test"], "mass": [0.11, "kg/m", "test"], "compression_ratio": [0.01, "1", "test"],
        "slack_law": law,
    })  # fmt: skip
    model = CatenaryModel(line)
    state = model.initial_state()
    seen = 0
    for n in range(1, 400):
        model.step(state, 1e-3, StripMotion(_moving_strip(n, 1e-3), np.zeros(1)))
        elastic = model.static.dropper_force + model.dropper_law.stiffness * (
            model.dropper_law.B @ state.motion.attached[0]
        )
        damper = 0.00275 * model.dropper_law.stiffness * (model.dropper_law.B @ state.motion.attached[1])
        pull = elastic + damper if law == "tension" else elastic
        compressed = pull < 0.0
        seen += int(compressed.sum())
        carried = 0.01 * pull if law == "tension" else 0.01 * pull + damper
        assert model.dropper_force(state)[compressed] == pytest.approx(carried[compressed], abs=1e-8)
        assert np.array_equal(model.dropper_slack(state), compressed)
    assert seen > 50


def test_free_vibration_converges_with_the_second_order_of_the_step(short_line):
    """A smooth initial velocity of the whole line, no contact, no slack."""
    results = []
    for dt in (2e-3, 1e-3, 5e-4, 2.5e-4):
        model = CatenaryModel(short_line)
        state = model.initial_state()
        x = model.mesh.points[:, 0]
        field = np.zeros((len(x), NODE_DOFS))
        field[:, 2] = 0.05 * np.sin(np.pi * x / 300.0) ** 4
        model.set_velocity(state, field)
        for _ in range(round(0.2 / dt)):
            model.step(state, dt, StripMotion(_below(100.0), np.zeros(1)))
        results.append(model.displacement(state)[:, 2])
    changes = [np.abs(b - a).max() for a, b in pairwise(results)]
    assert np.log2(changes[1] / changes[2]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(("duration", "longest", "count"), [(1e-3, 1e-3, 1), (5e-4, 1e-3, 1), (1e-2, 1e-3, 10)])
def test_macro_steps_are_divided_evenly(duration, longest, count):
    assert steps_within(duration, longest) == count
