"""The step engines against a plain step in nodal coordinates, and against each other."""

import numpy as np
import pytest
from scipy.sparse.linalg import splu

from models.catenary.line_model import CatenaryModel
from models.catenary.line_state import StripMotion
from models.catenary.linear_motion.interval_modes import slower_than
from models.catenary.linear_motion.step_matrices import StepMatrices
from models.catenary.step.compiled_line_step import CompiledLineStep
from models.catenary.step.engine_choice import kernels, make_engine
from models.catenary.step.linear_step import _by_blocks
from models.catenary.step.plain_step import PlainStep
from models.library.catalogue import load_line
from models.numerics.kernel_cache import KernelError
from models.numerics.newmark import Newmark
from tests.effort import rest
from tests.models.nodal_line import NodalLine


@pytest.fixture(scope="module", params=["short", "Re330", "LN2_overlap"])
def model(request, short_line):
    return CatenaryModel(short_line if request.param == "short" else load_line(request.param))


def _moving(model, seed):
    rng = np.random.default_rng(seed)
    state = model.initial_state()
    field = np.where(model.mesh.fixed, 0.0, 1e-3 * rng.standard_normal(model.mesh.fixed.shape))
    model.set_velocity(state, field)
    return state, field.ravel()[np.flatnonzero(~model.mesh.fixed.ravel())]


def _far():
    return StripMotion(np.array([[[[50.0, y, -50.0], [0.0, 0.0, 0.0]] for y in (0.7, -0.7)]]), np.zeros(1))


@pytest.mark.parametrize("dt", [4e-3, *rest(1e-3)])
def test_steps_are_those_of_newmark_s_method_in_nodal_coordinates(model, dt):
    """Accelerations and the damping matrix do not appear in the fast step; here they do."""
    line, newmark = NodalLine(model), Newmark(dt)
    state, v = _moving(model, 3)
    lu = splu((line.K + newmark.a0 * line.M + newmark.a1 * line.C).tocsc())
    d = np.zeros(line.size)
    a = splu(line.M.tocsc()).solve(-(line.C @ v))
    for _ in range(5):
        right = line.M @ (newmark.a0 * d + newmark.a2 * v + newmark.a3 * a)
        right += line.C @ (newmark.a1 * d + newmark.a4 * v + newmark.a5 * a)
        new = lu.solve(right)
        acceleration = newmark.a0 * (new - d) - newmark.a2 * v - newmark.a3 * a
        v = v + 0.5 * dt * (a + acceleration)
        d, a = new, acceleration
        model.step(state, dt, _far())
    assert line.free.size == np.count_nonzero(~model.mesh.fixed)
    assert model.displacement(state).ravel()[line.free] == pytest.approx(d, abs=2e-9 * np.abs(d).max())
    assert not state.slack.size


def test_momentum_stays_that_of_the_velocities(model):
    """It is carried on from step to step, not recomputed."""
    state, _ = _moving(model, 4)
    modes = model.modes
    for _ in range(200):
        model.step(state, 1e-3, _far())
    expected = state.motion.modal[1] + modes.coupling @ (modes.turn @ state.motion.attached[1])
    assert state.motion.momentum == pytest.approx(expected, abs=1e-11 * np.abs(expected).max())


def test_a_change_of_the_step_size_keeps_the_energy_law(model):
    """State does not depend on the step that made it: alternating steps dissipate as well."""
    state, _ = _moving(model, 5)
    energy = []
    for n in range(60):
        energy.append(model.energy(state))
        model.step(state, 1e-3 if n % 3 else 0.4e-3, _far())
    assert np.all(np.diff(energy) < 0.0)


def test_the_coupling_by_blocks_is_the_coupling(model):
    """Some intervals move with more than six ends; with intervals of two sizes there are no blocks of one size."""
    modes = model.modes
    blocks, turn = _by_blocks(modes, modes.coupling)
    difference = blocks.tocsr() @ turn - modes.coupling @ modes.turn
    assert abs(difference).max() <= 1e-15 * abs(modes.coupling).max()
    assert blocks.nnz < 1.2 * modes.coupling.nnz
    slow = slower_than(modes, 200.0)
    assert len({block.modes.shape[1] for block in slow.blocks}) > 1
    assert _by_blocks(slow, slow.coupling) is None


@pytest.fixture
def compiled_kernels():
    pytest.importorskip("numba")
    return kernels()


def test_a_step_that_was_prepared_is_forgotten_when_the_step_size_changes(model, compiled_kernels):
    """Back and forth between step sizes, against the plain engine."""
    engines = [
        [kind(model._line, StepMatrices(model.modes, Newmark(h)), *more) for h in (1e-3, 0.5e-3)]
        for kind, more in ((PlainStep, ()), (CompiledLineStep, (compiled_kernels,)))
    ]
    states = [_moving(model, 7)[0] for _ in engines]
    for n in range(20):
        for of_kind, state in zip(engines, states, strict=True):
            of_kind[n % 3 // 2].push(state, ())
    plain, compiled = (state.motion.modal[0] for state in states)
    assert compiled == pytest.approx(plain, abs=1e-11 * np.abs(plain).max())


def test_a_compiled_step_goes_on_from_a_snapshot_bit_for_bit(model, compiled_kernels, monkeypatch):
    monkeypatch.setenv("OPENPANTO_KERNEL", "numba")
    fresh = CatenaryModel(model.definition)
    assert isinstance(fresh._engine(1e-3), CompiledLineStep)
    state, _ = _moving(fresh, 8)
    for _ in range(5):
        fresh.step(state, 1e-3, _far())
    saved, other = state.snapshot(), fresh.initial_state()
    other.restore(saved)
    for each in (state, other):
        for _ in range(5):
            fresh.step(each, 1e-3, _far())
    assert all(np.array_equal(a, other.snapshot()[name]) for name, a in state.snapshot().items())


def test_kernels_can_be_left_out_or_insisted_on(model, monkeypatch):
    line, newmark = model._line, Newmark(1e-3)
    monkeypatch.setenv("OPENPANTO_KERNEL", "numpy")
    assert type(make_engine(line, newmark)) is PlainStep
    monkeypatch.setenv("OPENPANTO_KERNEL", "cuda")
    with pytest.raises(KernelError, match="'cuda'; use auto, numpy or numba"):
        make_engine(line, newmark)
    monkeypatch.setattr("models.numerics.kernel_cache.importlib.util.find_spec", lambda _: None)
    monkeypatch.setenv("OPENPANTO_KERNEL", "numba")
    with pytest.raises(KernelError, match="numba is not installed"):
        make_engine(line, newmark)
    monkeypatch.setenv("OPENPANTO_KERNEL", "auto")
    assert type(make_engine(line, newmark)) is PlainStep


def test_a_constant_force_pushes_like_a_load_in_nodal_coordinates(model):
    """Forces on two places of the first wire, which move on by an element and stand still."""
    line, newmark = NodalLine(model), Newmark(1e-3)
    state = model.initial_state()
    lu = splu((line.K + newmark.a0 * line.M + newmark.a1 * line.C).tocsc())
    d, v, a = (np.zeros(line.size) for _ in range(3))
    first = model.wires[0].ends[0]
    for n in range(6):
        forces = [(0, first + 61.0 + 0.3 * n, 20.0), (0, first + 75.5, -10.0)]
        model.push(state, newmark.step, forces)
        right = line.M @ (newmark.a0 * d + newmark.a2 * v + newmark.a3 * a)
        right += line.C @ (newmark.a1 * d + newmark.a4 * v + newmark.a5 * a)
        for section, x, force in forces:
            right += force * line.row(section, *model.wires[section].locate(x))[0]
        new = lu.solve(right)
        acceleration = newmark.a0 * (new - d) - newmark.a2 * v - newmark.a3 * a
        v = v + 0.5 * newmark.step * (a + acceleration)
        d, a = new, acceleration
    assert not state.slack.size
    assert model.displacement(state).ravel()[line.free] == pytest.approx(d, abs=1e-9 * np.abs(d).max())
