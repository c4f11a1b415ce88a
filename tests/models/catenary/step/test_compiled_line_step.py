"""The compiled step against the plain one: the same figures to rounding, whatever touches, hangs slack or closes."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from models.catenary.contact_and_slack.local_problem import LocalSolutionError
from models.catenary.line_model import CatenaryModel
from models.catenary.line_state import StripMotion
from models.catenary.linear_motion.step_matrices import StepMatrices
from models.catenary.step import step_records
from models.catenary.step.compiled_line_step import CompiledLineStep, UnsuitedError
from models.catenary.step.engine_choice import KERNEL_FILES, kernels
from models.catenary.step.plain_step import PlainStep
from models.numerics.newmark import Newmark

STEP = 1e-3
#: What may differ, of the largest value: rounding, over some dozen steps.
ROUNDING = 1e-10


@pytest.fixture(scope="module")
def compiled_kernels():
    pytest.importorskip("numba")
    return kernels()


@pytest.fixture(scope="module")
def both(compiled_kernels):
    """Return a function: a definition -> its model, the plain and the compiled step of it."""
    known = {}

    def of(line):
        if id(line) not in known:
            model = CatenaryModel(line)
            matrices = StepMatrices(model.modes, Newmark(STEP))
            engines = PlainStep(model._line, matrices), CompiledLineStep(model._line, matrices, compiled_kernels)
            known[id(line)] = line, model, engines
        return known[id(line)][1:]

    return of


def strips(model, places, n, lift=0.03, speed=80.0, beat=0.0, yielding=0.0):
    """Return strips that run along the track at the height of the first wire, which beat the wire by turns."""
    wire = model.static.positions[model.mesh.contact_chains()[0].nodes]
    result = []
    for k, place in enumerate(places):
        x = place + speed * STEP * n
        first = wire[0, 0]
        at = first + (x - first) % model.wires[0].period if model.wires[0].period else x
        z = np.interp(at, wire[:, 0], wire[:, 2]) + lift + beat * np.sin(2.0 * np.pi * (n / 20.0 + k / 3.0))
        tilt = 0.002 * k
        result.append([[[x, y, z + y * tilt], [speed, 0.0, 0.1 * (k + 1)]] for y in (0.7, -0.7)])
    return StripMotion(np.array(result), np.linspace(yielding, 2e-5, len(places)))


def run(both, line, places, steps=40, before=(), **how):
    """Step a line with both engines; compare forces, points and all of the state in every step."""
    model, engines = both(line)
    states = [model.initial_state(len(places)) for _ in engines]
    for change in before:
        for state in states:
            change(model, state)
    forces, slack = [], []
    for n in range(steps):
        motion = strips(model, places, n, **how)
        one, other = (engine.step(state, motion) for engine, state in zip(engines, states, strict=True))
        assert np.array_equal(np.isnan(one.point), np.isnan(other.point))
        near(one.force, other.force, 1.0)
        near(np.nan_to_num(one.point), np.nan_to_num(other.point), 1.0)
        forces.append(one.force)
        slack.append(len(states[0].slack))
        same(*states)
    return np.array(forces), np.array(slack)


def near(one, other, least=0.0):
    assert np.shape(one) == np.shape(other)
    assert np.abs(one - other).max(initial=0.0) <= ROUNDING * max(np.abs(one).max(initial=0.0), least)


def same(one, other):
    """Compare two states."""
    for name in ("slack", "element", "loaded"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    near(one.compensation, other.compensation, 1.0)
    near(one.load, other.load, 1.0)
    near(one.impact_velocity, other.impact_velocity, 1e-2)
    for name in ("modal", "momentum", "attached"):
        near(getattr(one.motion, name), getattr(other.motion, name), 1e-6)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_contacts_near_each_other_and_apart(both, short_line, count):
    """Two of four are on one interval."""
    forces, _ = run(both, short_line, (70.0, 71.0, 95.0, 130.0)[:count])
    assert (forces[10:] > 10.0).any(axis=0).all()


def test_contacts_lost_and_regained(both, short_line):
    forces, _ = run(both, short_line, (70.0, 95.0), steps=80, lift=0.0, beat=0.02)
    closed = forces[:, 0, 0] > 0.0
    assert np.abs(np.diff(closed.astype(int))).sum() >= 3


def test_a_law_that_is_not_linear(both, short_line):
    """And that takes energy while the contact lasts."""
    law = {"contact.exponent": 1.5, "contact.stiffness": 2e5, "contact.restitution": 0.9}
    forces, _ = run(both, short_line.with_values(law), (70.0,), lift=0.01)
    assert forces.max() > 50.0


@pytest.mark.parametrize("kind", ["ends", "ring"])
def test_running_surfaces_of_several_pieces(both, line_maker, ring_maker, kind):
    """The law takes energy, so that the surface's slope counts too; in a ring the second strip crosses the seam."""
    waves = {"sigma": [0.1, "mm", "test"], "exponent": [2, "1", "test"], "from": [0.1, "1/m", "test"]}
    waves |= {"to": [1, "1/m", "test"], "seed": 2}
    make, places = (line_maker, (70.0, 95.0)) if kind == "ends" else (ring_maker, (70.0, 498.0))
    line = make(running_surface=waves).with_values({"contact.restitution": 0.7})
    kink = replace(line.running_surface, points=((70.5, 0.0), (71.0, 1e-3), (71.5, 0.0)))
    line, closed = replace(line, running_surface=kink), [lambda _, state: state.impact_velocity.fill(0.5)]
    forces, _ = run(both, line, places, before=closed, lift=0.01)
    smooth, _ = run(both, replace(line, running_surface=None), places, before=closed, lift=0.01)
    assert (np.abs(forces - smooth)[10:].max(axis=0) > 0.3).all()


@pytest.mark.parametrize("ratio", [0.0, 0.01])
@pytest.mark.parametrize("law", ["elastic_only", "tension"])
def test_slack_droppers(both, line_maker, law, ratio):
    source = "test"
    dropper = {"area": [12, "mm2", source], "mass": [0.11, "kg/m", source], "youngs_modulus": [84.7, "GPa", source]}
    dropper |= {"slack_law": law, "compression_ratio": [ratio, "1", source]}
    line = line_maker(dropper=dropper, damping={"alpha": [1e-3, "s", source], "beta": [0.0, "1/s", source]})
    _, slack = run(both, line, (70.0, 95.0), steps=60, lift=0.06)
    assert slack.max() >= 2


def test_slack_droppers_under_a_law_that_is_not_linear(both, short_line):
    line = short_line.with_values({"contact.exponent": 1.5, "contact.stiffness": 5e5})
    forces, slack = run(both, line, (70.0,), steps=60, lift=0.06)
    assert slack.max() >= 1
    assert forces[slack > 0].max() > 50.0


def _thrown_up(model, state):
    """Give the contact wire a velocity that lets all droppers go slack."""
    velocity = np.zeros(model.mesh.fixed.shape)
    for chain in model.mesh.contact_chains():
        velocity[chain.nodes, 2] = np.where(model.mesh.fixed[chain.nodes, 2], 0.0, 2.0)
    model.set_velocity(state, velocity)


def test_all_droppers_slack_at_once(both, short_line):
    model, _ = both(short_line)
    _, slack = run(both, short_line, (70.0,), steps=30, before=[_thrown_up])
    assert slack.max() > 0.9 * len(model.dropper_law.stiffness)


def test_two_wires_in_an_overlap(both, section_maker, sections_maker):
    far = {"length": [75.0, "m", "test"], "rise": [0.2, "m", "test"]}
    left = section_maker(-75.0, 5, [0.2, -0.2, 0.2, -0.2], **far)
    right = section_maker(25.0, 5, [0.2, -0.2, 0.2, -0.2], **far)
    forces, _ = run(both, sections_maker(left, right), (96.0, 40.0), steps=80, yielding=1e-5)
    assert (forces[:, 0] > 1.0).all(axis=1).any()


@pytest.mark.parametrize("place", [499.0, 1498.0])
def test_a_ring(both, ring_maker, place):
    """Across the place where it closes, in the first lap and in the third."""
    forces, _ = run(both, ring_maker(10), (place, place - 60.0), steps=40)
    assert (forces[10:] > 10.0).any(axis=0).all()


@pytest.mark.parametrize("highest", [200.0, 60.0, 15.0])
def test_reduced_modes(both, short_line, highest):
    forces, _ = run(both, short_line.with_values({"dynamics.highest_frequency": highest}), (70.0, 95.0))
    assert forces.max() > 50.0


def test_no_contact_and_strips_beside_the_line(both, short_line):
    forces, _ = run(both, short_line, (70.0, -400.0), lift=-0.5)
    assert not forces.any()


@pytest.mark.parametrize(("kind", "middle"), [("ends", 70.0), ("ring", 1499.0)])
def test_given_forces(both, short_line, ring_maker, kind, middle):
    """On a ring in the third lap, across the place where it closes."""
    model, engines = both(short_line if kind == "ends" else ring_maker(10))
    states, slack = [model.initial_state() for _ in engines], 0
    for n in range(30):
        for engine, state in zip(engines, states, strict=True):
            forces = [(0, middle + 0.1 * n, 2500.0), (0, middle + 2.0, 600.0), (0, middle + 50.0, -50.0)]
            engine.push(state, forces[: n % 4])
        same(*states)
        slack = max(slack, states[0].slack.size)
    assert slack > 0


def test_given_forces_leave_no_strip_closed(both, short_line):
    """A strip that was closed before them touches anew after them, which a law with restitution minds."""
    model, engines = both(short_line)
    states, touched = [model.initial_state() for _ in engines], 0
    for n in range(12):
        motion = strips(model, (70.0,), n, lift=0.003)
        for engine, state in zip(engines, states, strict=True):
            if n % 4 == 3:
                touched += state.impact_velocity.max() > 0.0
                engine.push(state, [(0, 70.0, 900.0)])
                assert not state.impact_velocity.any()
            else:
                engine.step(state, motion)
        same(*states)
    assert touched == 6


def test_a_force_on_a_wire_that_is_none(both, short_line):
    model, engines = both(short_line)
    for engine in engines:
        for wire in (1, -1, 0.5):
            with pytest.raises(IndexError, match="contact wire other than 0 to 0"):
                engine.push(model.initial_state(), [(0, 70.0, 50.0), (wire, 70.0, 50.0)])


def test_what_is_no_number_makes_no_contact_and_leaves_no_trace(both, short_line, ring_maker):
    for line in (short_line, ring_maker(4)):
        model, engines = both(line)
        for engine in engines:
            state = model.initial_state()
            motion = strips(model, (70.0,), 0)
            saved, first = state.snapshot(), engine.step(state, motion)
            for nothing in (np.inf, np.nan):
                motion.strip[:] = nothing
                assert not engine.step(state, motion).force.any()
            state.motion.attached[:] = np.nan
            engine.push(state, ())
            state.restore(saved)
            again = engine.step(state, strips(model, (70.0,), 0))
            assert np.array_equal(first.force, again.force)
            assert first.force.sum() > 0.0


def test_records_that_are_forgotten_are_made_again(both, short_line, monkeypatch):
    """With room for hardly any, the same figures to the last bit."""
    model, (_, engine) = both(short_line)
    results = []
    for room in (2**19, 2**10):
        monkeypatch.setattr(step_records, "_KEPT", room)
        monkeypatch.setattr(step_records, "_SELDOM", 0)
        fresh = CompiledLineStep(model._line, engine.matrices, engine.kernels)
        state = model.initial_state(2)
        results.append([fresh.step(state, strips(model, (70.0, 95.0), n, lift=0.06)).force for n in range(40)])
    assert np.array_equal(*results)


def test_a_step_that_does_not_settle_says_so(both, short_line):
    """An impact that takes most of its energy, in steps far too long for it."""
    line = short_line.with_values({"contact.exponent": 1.5, "contact.stiffness": 5e5, "contact.restitution": 0.6})
    model, engines = both(line)
    answers = []
    for engine in engines:
        state = model.initial_state(2)
        try:
            for n in range(60):
                engine.step(state, strips(model, (70.0, 95.0), n, lift=0.0, beat=0.02))
        except LocalSolutionError as error:
            answers.append(str(error))
        else:
            answers.append("settled")
    assert answers[0] == answers[1]
    assert "not settled after 60 iterations (0 slack droppers, 2 contacts)" in answers[0]


def test_a_law_that_the_kernels_do_not_know_is_left_to_the_plain_step(short_line, compiled_kernels):
    model = CatenaryModel(short_line)
    line = type(model._line)(**vars(model._line) | {"law": lambda *_: None})
    with pytest.raises(UnsuitedError, match="contact law"):
        CompiledLineStep(line, StepMatrices(model.modes, Newmark(STEP)), compiled_kernels)


def test_kernels_in_several_files_do_not_share_names():
    """They become one module: a name that two files define would silently be the later one in both."""
    defined = {}
    for path in map(Path, KERNEL_FILES):
        for name in re.findall(r"^(?:def|class) (\w+)|^([A-Z]\w*) =", path.read_text(encoding="utf-8"), re.MULTILINE):
            found = defined.setdefault("".join(name), path.name)
            assert found == path.name, f"{''.join(name)} is in {found} and in {path.name}"
