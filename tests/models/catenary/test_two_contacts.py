"""A strip under two wires: one assembled system, resultant, and the ends of wires and strips."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from master.evaluation.contact_quality import assess
from master.evaluation.filters import ForceFilter
from models.catenary.contact_and_slack.crossing import engagement
from models.catenary.line_model import CatenaryModel
from models.catenary.line_part import CatenaryPart
from models.catenary.line_state import StripMotion
from models.contact_law import application_point
from models.coupled.monolithic import CoupledModel
from models.library.catalogue import load_pantograph
from models.numerics.newmark import Newmark
from models.pantograph.lumped.lumped_model import LumpedModel
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from tests.effort import IS_LONG, rest
from tests.models.nodal_line import NodalLine

START = 70.0


@pytest.fixture(scope="module")
def line(section_maker, sections_maker):
    """Two sections that share the spans from 50 m to 150 m and change over in the middle of them, at 100 m."""
    far = {"length": [75.0, "m", "test"], "rise": [0.2, "m", "test"]}
    left = section_maker(-75.0, 5, [0.2, -0.2, 0.2, -0.2], **far)
    right = section_maker(25.0, 5, [0.2, -0.2, 0.2, -0.2], **far)
    return sections_maker(left, right)


@pytest.fixture(scope="module")
def pantograph(cx):
    return cx.with_values({"start_position": START, "raise_duration": 0.05})


def _assembled(line, pantograph, dt, steps):
    """One matrix for both wires, pantograph and the springs of the closed contacts, solved in every step."""
    model, lumped = CatenaryModel(line), LumpedModel(pantograph)
    catenary = NodalLine(model)
    newmark, n, m = Newmark(dt), catenary.size, lumped.size
    M, C, K = (
        sp.block_diag([getattr(catenary, name), getattr(lumped, name)], format="csr") for name in ("M", "C", "K")
    )
    base = splu((K + newmark.a0 * M + newmark.a1 * C).tocsc())
    B = sp.hstack([catenary.B, sp.csr_matrix((catenary.B.shape[0], m))], format="csr")
    d, v, a = (np.zeros(n + m) for _ in range(3))
    forces, elements = [], [-1] * len(model.wires)
    for step in range(1, steps + 1):
        t = step * dt
        right = M @ (newmark.a0 * d + newmark.a2 * v + newmark.a3 * a) + C @ (newmark.a1 * d + newmark.a4 * v)
        right[n:] += lumped.load(t, np.zeros(2))
        rows, gaps, elements = _contact_rows(catenary, pantograph, t, base.solve(right)[:n], elements, n + m)
        new, penetration = _settled(line, model, base, B, right, rows, gaps)
        acceleration = newmark.a0 * (new - d) - newmark.a2 * v - newmark.a3 * a
        v = v + 0.5 * dt * (a + acceleration)
        d, a = new, acceleration
        forces.append(line.contact.stiffness * np.maximum(penetration, 0.0))
    return np.array(forces)


def _contact_rows(catenary, pantograph, t, free, elements, size):
    """Return rows with penetration = gap + row . d, one for each wire."""
    x = pantograph.start_position + pantograph.speed * t
    strip = np.array([[[x, y, 0.0], [pantograph.speed, 0, 0]] for y in (0.725, -0.725)])
    rows, gaps, met = [], [], []
    for section, guess in enumerate(elements):
        found = catenary.find(section, strip, free, guess)
        row, height = catenary.row(section, found.element, found.xi)
        rows.append(np.concatenate([-row, np.zeros(size - len(row) - 1), [1.0]]))
        gaps.append(pantograph.reference_height - height)
        met.append(found.element)
    return np.array(rows), np.array(gaps), met


def _solved(base, rows, springs, load):
    """Solve (base + sum of s r r') d = load; the few springs through what they do to one another (Woodbury)."""
    free = base.solve(load)
    if not len(rows):
        return free
    response = base.solve(rows.T)
    return free - response @ np.linalg.solve(np.diag(1.0 / springs) + rows @ response, rows @ free)


def _settled(line, model, base, B, right, rows, gaps):
    k, closed, slack = line.contact.stiffness, np.zeros(len(rows), dtype=bool), np.zeros(B.shape[0], dtype=bool)
    for _ in range(50):
        R = sp.csr_matrix(rows[closed])
        load = right - k * (R.T @ gaps[closed]) + B[slack].T @ model.static.dropper_force[slack]
        springs = np.concatenate([np.full(closed.sum(), k), -model.dropper_law.stiffness[slack]])
        new = _solved(base, np.vstack([rows[closed], B[slack].toarray()]), springs, load)
        penetration = gaps + rows @ new
        elastic = model.static.dropper_force + model.dropper_law.stiffness * (B @ new)
        if np.array_equal(penetration > 0.0, closed) and np.array_equal(elastic < 0.0, slack):
            return new, penetration
        closed, slack = penetration > 0.0, elastic < 0.0
    raise AssertionError("the assembled system has not settled")


def test_two_contacts_of_a_strip_equal_one_assembled_system(line, pantograph):
    steps, dt = 520, 1e-3
    expected = _assembled(line, pantograph, dt, steps)
    record = CoupledModel(CatenaryModel(line), [pantograph]).run(steps * dt, dt)
    both = (expected > 0.0).all(axis=1)
    assert both.sum() > 50
    assert expected[:, 0].max() > 100.0
    assert expected[:, 1].max() > 100.0
    assert np.abs(record.section_force[1:, 0] - expected).max() < 1e-5


def test_the_resultant_has_the_moment_of_the_forces(line, pantograph):
    catenary, lumped = CatenaryPart(line), LumpedPantographPart(pantograph)
    lumped.initialise(0.0, 0.0, np.zeros(3), np.zeros(2))
    catenary.initialise(0.0, lumped.strip[None])
    shared = 0
    for _ in range(520):
        force, point = float(catenary.contact_force[0]), catenary.contact_point[0].copy()
        catenary.step(lumped.strip[None].copy(), 1e-3)
        lumped.step(force, point, np.zeros(2), 1e-3)
        forces = catenary.section_force[0]
        assert catenary.contact_force[0] == pytest.approx(forces.sum())
        if (forces > 0.0).all():
            shared += 1
            lateral = [_lateral_of(catenary.model, s, catenary.contact_point[0, 0]) for s in (0, 1)]
            moment = catenary.contact_force[0] * catenary.contact_point[0, 1]
            sway = 0.01  # m, of the wires about their static position
            assert moment == pytest.approx(forces @ lateral, abs=sway * forces.sum())
    assert shared > 50


def _lateral_of(model, section, x):
    nodes = model.mesh.contact_chains()[section].nodes
    return np.interp(x, *model.static.positions[nodes, :2].T)


def test_point_of_application():
    point = np.array([[10.0, 0.2, 5.1], [10.0, -0.2, 5.1]])
    strip = np.array([[[10.0, 0.7, 5.0], [0, 0, 0]], [[10.0, -0.7, 5.0], [0, 0, 0]]])
    assert application_point(np.array([30.0, 10.0]), point, strip)[1] == pytest.approx(0.1)
    assert application_point(np.array([0.0, 10.0]), point, strip) == pytest.approx(point[1])
    assert application_point(np.zeros(2), point, strip) == pytest.approx(point[0])
    assert application_point(np.zeros(2), np.full((2, 3), np.nan), strip) == pytest.approx([10.0, 0.0, 5.0])


def test_contact_sets_in_from_nothing_at_the_ends_of_strip_and_wire():
    assert engagement(0.0, 10.0) == engagement(1.0, 0.0) == 0.0
    assert engagement(1.0, 10.0) == 1.0
    assert 0.0 < engagement(0.01, 10.0) < engagement(0.02, 10.0) < 1.0


def _prescribed(model, path, dt, steps):
    """Return the forces on a strip that is led along a path: time -> x, y, z of its middle."""
    state, forces = model.initial_state(), []
    for k in range(1, steps + 1):
        now, before = np.array(path(k * dt)), np.array(path((k - 1) * dt))
        ends = [[now + np.array([0.0, side, 0.0]), (now - before) / dt] for side in (0.725, -0.725)]
        forces.append(model.step(state, dt, StripMotion(np.array([ends]), np.zeros(1))).force[0])
    return np.array(forces)


def _largest_change(model, path, dt, duration):
    forces = _prescribed(model, path, dt, round(duration / dt))
    assert forces.max() > 40.0
    return forces, np.abs(np.diff(forces.sum(axis=1))).max()


def _is_continuous(model, path, duration):
    """Whether the largest change within a step shrinks with the step, which a jump does not."""
    forces, coarse = _largest_change(model, path, 1e-3, duration)
    _, fine = _largest_change(model, path, 2.5e-4, duration)
    return forces, fine < 0.4 * coarse


@pytest.fixture(scope="module")
def level(section_maker, sections_maker):
    """One section that ends without rising."""
    section = section_maker(0.0, 3, [0.2, -0.2], rise=[0.0, "m", "test"])
    return CatenaryModel(sections_maker(section))


def test_a_strip_leaves_the_end_of_a_wire_without_a_jump(level):
    forces, continuous = _is_continuous(level, lambda t: (130.0 + 80.0 * t, 0.0, 5.03 + min(t, 0.1) * 0.53), 0.3)
    assert continuous
    assert not forces[-40:].any()


def test_a_strip_enters_under_the_beginning_of_a_wire_without_a_jump(level):
    forces, continuous = _is_continuous(level, lambda t: (-4.0 + 80.0 * t, 0.0, 5.083), 0.3)
    assert continuous
    assert not forces[:40].any()


def test_a_wire_slides_off_the_side_of_a_strip_without_a_jump(level):
    def path(t):
        return 60.0 + 60.0 * t, 8.0 * max(0.0, t - 0.05), 5.03 + min(t, 0.1) * 0.4

    forces, continuous = _is_continuous(level, path, 0.3)
    assert continuous
    assert not forces[-20:].any()


def test_a_strip_between_two_wires_touches_neither(section_maker, sections_maker):
    wide = [section_maker(0.0, 3, [y, y], anchor=y) for y in (0.9, -0.9)]
    part = CatenaryPart(sections_maker(*wide))
    strip = np.array([[[[70.0, side, 5.2], [80.0, 0.0, 0.0]] for side in (0.725, -0.725)]])
    part.initialise(0.0, strip)
    for _ in range(20):
        part.step(strip, 1e-3)
        strip[:, :, 0, 0] += 0.08
    assert not part.section_force.any()
    assert part.contact_point[0] == pytest.approx([strip[0, 0, 0, 0], 0.0, 5.2])


@pytest.mark.parametrize("kinds", [("CX", "DSA380", "generic"), *rest((("CX", "CX", "DSA380", "generic"),))])
def test_up_to_four_pantographs_of_any_kind_on_one_line(line_maker, kinds):
    """Far apart on a damped line each feels only itself."""
    line = line_maker(spans=len(kinds) * 3 + 2, alpha=0.05)
    settings = {"raise_duration": 0.05, "reference_height": 5.02}
    spaced = [
        load_pantograph(kind).with_values({"start_position": 60.0 + 150.0 * i, **settings})
        for i, kind in enumerate(kinds)
    ]
    together = CoupledModel(CatenaryModel(line), spaced).run(0.25, 1e-3)
    for i, pantograph in enumerate(spaced):
        if i == 0 and not IS_LONG:
            continue  # it is the trailing one that runs through the other's waves
        alone = CoupledModel(CatenaryModel(line), [pantograph]).run(0.25, 1e-3)
        assert alone.contact_force.max() > 50.0
        assert together.contact_force[:, i] == pytest.approx(alone.contact_force[:, 0], abs=0.5)


@pytest.mark.slow
@pytest.mark.long
def test_a_kilometre_apart_each_runs_as_if_it_were_alone(line_maker, cx):
    """The leading one's waves reach the trailing one within the run; on a damped line they have died out."""
    line, stop = CatenaryModel(line_maker(spans=38)), 7.5
    starts = (1150.0, 150.0)
    spaced = [cx.with_values({"start_position": x, "static_force": 178.0}) for x in starts]
    together = CoupledModel(line, spaced).run(stop, 1e-3)
    for i, pantograph in enumerate(spaced):
        alone = CoupledModel(line, [pantograph]).run(stop, 1e-3)
        interval = (starts[i] + 350.0, starts[i] + 600.0)
        figures = [
            assess(r.contact_force[:, p], r.position[:, p], 1e-3, ForceFilter("fft"), interval)
            for r, p in ((together, i), (alone, 0))
        ]
        for name in ("mean", "sigma", "maximum", "minimum"):
            one, other = (getattr(f, name) for f in figures)
            assert one == pytest.approx(other, rel=0.005), name
