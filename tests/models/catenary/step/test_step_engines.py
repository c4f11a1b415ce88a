"""The fast step against the plain one in nodal coordinates, and the solvers below it."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from models.catenary.line_model import CatenaryModel, StripMotion
from models.catenary.linear_motion.attachment_solver import CUT, Banded, Sparse, factorised
from models.catenary.linear_motion.compliance import Compliance
from models.catenary.linear_motion.interval_modes import slower_than
from models.catenary.linear_motion.sparse_products import BlockProduct, Product, TransposedProduct
from models.catenary.linear_motion.step_matrices import StepMatrices
from models.catenary.step.engine_choice import kernels, make_engine
from models.catenary.step.numba_engine import NumbaEngine
from models.catenary.step.numpy_engine import NumpyEngine, _by_blocks
from models.catenary.step.step_engine import AppliedForce
from models.coupled.monolithic import CoupledModel
from models.library.catalogue import load_line
from models.numerics.kernel_cache import KernelError
from models.numerics.newmark import Newmark
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


@pytest.mark.parametrize("dt", [1e-3, 4e-3])
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
    """It is carried on from step to step, not computed anew."""
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


def _band(n=900, width=7, seed=1):
    rng = np.random.default_rng(seed)
    diagonals = [rng.uniform(-1.0, 0.0, n) for _ in range(width)]
    lower = sp.diags(diagonals, [-k - 1 for k in range(width)], shape=(n, n))
    return (lower + lower.T + 14.5 * sp.eye(n)).tocsr()


def test_both_factorisations_solve():
    matrix = _band()
    load = np.random.default_rng(3).standard_normal(matrix.shape[0])
    expected = splu(matrix.tocsc()).solve(load)
    assert isinstance(factorised(matrix), Banded)
    for factor in (factorised(matrix), Sparse(matrix.tocsc())):
        assert factor.solve(load) == pytest.approx(expected, rel=1e-12)


def test_wide_bands_are_solved_as_well():
    rng = np.random.default_rng(3)
    root = sp.random(200, 200, density=0.2, random_state=rng)
    matrix = (root @ root.T + 50.0 * sp.eye(200)).tocsc()
    load = rng.standard_normal(200)
    factor = factorised(matrix)
    assert isinstance(factor, Sparse)
    assert factor.solve(load) == pytest.approx(np.linalg.solve(matrix.toarray(), load), rel=1e-10)


def test_a_matrix_that_is_not_positive_definite_is_refused():
    with pytest.raises(np.linalg.LinAlgError, match="row 3"):
        factorised(sp.diags([1.0, 1.0, -1.0, 1.0]))


@pytest.mark.parametrize("first", [0, 3, 440, 890, 898])
def test_a_solution_near_its_load_is_the_whole_one(first):
    matrix = _band()
    local = np.random.default_rng(first).standard_normal((min(12, 900 - first), 3))
    load = np.zeros((900, 3))
    load[first : first + len(local)] = local
    whole = splu(matrix.tocsc()).solve(load)
    begin, values = factorised(matrix).near(first, local)
    near = np.zeros_like(whole)
    near[begin : begin + len(values)] = values
    assert np.abs(near - whole).max() < 1e-13 * np.abs(whole).max()


def test_a_solution_that_does_not_die_out_is_whole():
    n = 700
    matrix = sp.diags([-1.0, 2.0 + 1e-6, -1.0], [-1, 0, 1], shape=(n, n))
    load = np.zeros(n)
    load[300] = 1.0
    begin, values = factorised(matrix).near(300, np.ones((1, 1)))
    assert (begin, len(values)) == (0, n)
    assert values[:, 0] == pytest.approx(splu(matrix.tocsc()).solve(load), rel=1e-9)


def _matrices(model, step=1e-3):
    return StepMatrices(model.modes, Newmark(step))


def _compliance(model, matrices):
    return Compliance(matrices.factor, model.dropper_law.B, model.dropper_law.stiffness)


def test_responses_to_unit_loads_are_columns_of_the_inverse(model):
    matrices = _matrices(model)
    interval = model.wires[0].intervals[40]
    columns = _compliance(model, matrices).units(interval.ends)
    everywhere = np.arange(len(model.modes.attached))
    unit = np.eye(len(everywhere))[interval.ends]
    whole = np.stack([matrices.factor.solve(load) for load in unit], axis=1)
    assert columns.at(everywhere) == pytest.approx(whole, abs=1e-14 * np.abs(whole).max())
    stretch = np.zeros((len(model.dropper_law.stiffness), len(interval.ends)))
    near = columns.dropper_index
    stretch[near] = columns.dropper_force / model.dropper_law.stiffness[near, None]
    # Both ends of a dropper may lie where a column is cut.
    assert stretch == pytest.approx(model.dropper_law.B @ whole, abs=4.0 * CUT * np.abs(whole).max())


def test_what_a_strip_comes_to_is_prepared_one_response_at_a_time(model):
    compliance = _compliance(model, _matrices(model))
    places = model.wires[0].intervals[30].sides[1]
    for count in range(1, len(places) + 1):
        compliance.prepare(places)
        assert sum(place in compliance._kept for place in places.tolist()) == count


def test_compliance_of_droppers_is_symmetric(model):
    columns = _compliance(model, _matrices(model)).dropper_columns
    i, j = 20, 22
    response = {}
    for k in (i, j):
        stretch = columns[k].dropper_force[:, 0] / model.dropper_law.stiffness[columns[k].dropper_index]
        response[k] = dict(zip(columns[k].dropper_index.tolist(), stretch, strict=True))
    assert response[i][j] == pytest.approx(response[j][i], rel=1e-9)
    assert response[i][i] > abs(response[i][j])


@pytest.mark.parametrize("routine", [None, "scipy's"])
def test_products_with_and_without_scipy_s_routine(routine):
    rng = np.random.default_rng(1)
    matrix = sp.random(30, 20, density=0.3, random_state=rng, format="csr")
    product = Product(matrix, None) if routine is None else Product(matrix)
    vector, result = rng.standard_normal(20), rng.standard_normal(30)
    expected = result + matrix @ vector
    product.add(vector, result)
    assert result == pytest.approx(expected, rel=1e-14)
    transposed = TransposedProduct(product, None) if routine is None else TransposedProduct(product)
    expected = vector + matrix.T @ result
    transposed.add(result, vector)
    assert vector == pytest.approx(expected, rel=1e-14)
    blocks = matrix.tobsr((5, 4))
    by_blocks = BlockProduct(blocks, None) if routine is None else BlockProduct(blocks)
    expected = result + matrix @ vector
    by_blocks.add(vector, result)
    assert result == pytest.approx(expected, rel=1e-14)


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


def _engines(model, compiled_kernels, step=1e-3):
    matrices = _matrices(model, step)
    return NumpyEngine(matrices), NumbaEngine(matrices, compiled_kernels)


def test_compiled_steps_are_the_plain_ones(model, compiled_kernels):
    """Two engines over one motion each, with forces on a point of an interval and on attachments in every step."""
    engines = _engines(model, compiled_kernels)
    rng = np.random.default_rng(2)
    motions = []
    for _ in engines:
        state, _ = _moving(model, 6)
        motions.append(state.motion)
    interval = model.wires[0].intervals[12]
    columns = _compliance(model, _matrices(model)).units(interval.ends)
    responses = [engine.response(interval, columns) for engine in engines]
    for _ in range(30):
        pressed = 10.0 * rng.standard_normal(len(model.modes.attached))
        force, known = 100.0 * rng.standard_normal(2)
        for engine, response, motion in zip(engines, responses, motions, strict=True):
            engine.begin(motion, pressed.copy(), [AppliedForce(response, interval.first + 1, 0.7, known)])
            engine.apply(response.point(interval.first, 0.3), force)
            engine.finish(motion)
    for name in ("modal", "momentum", "attached"):
        plain, compiled = (getattr(motion, name) for motion in motions)
        for one, other in zip(np.atleast_2d(plain), np.atleast_2d(compiled), strict=True):
            assert np.abs(other - one).max() < 1e-11 * np.abs(one).max(), name


def test_a_step_that_was_prepared_is_forgotten_when_the_step_size_changes(model, compiled_kernels):
    """Back and forth between step sizes, against the plain engine."""
    plain, compiled = zip(*(_engines(model, compiled_kernels, h) for h in (1e-3, 0.5e-3)), strict=True)
    motions = [_moving(model, 7)[0].motion for _ in range(2)]
    still = np.zeros(len(model.modes.attached))
    for n in range(20):
        for engines, motion in zip((plain, compiled), motions, strict=True):
            engines[n % 3 // 2].begin(motion, still)
            engines[n % 3 // 2].finish(motion)
    assert motions[1].modal[0] == pytest.approx(motions[0].modal[0], abs=1e-11 * np.abs(motions[0].modal[0]).max())


def test_a_compiled_step_goes_on_from_a_snapshot_bit_for_bit(model, compiled_kernels, monkeypatch):
    monkeypatch.setenv("OPENPANTO_KERNEL", "numba")
    fresh = CatenaryModel(model.definition)
    assert isinstance(fresh._step(1e-3).engine, NumbaEngine)
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
    matrices = _matrices(model)
    monkeypatch.setenv("OPENPANTO_KERNEL", "numpy")
    assert type(make_engine(matrices)) is NumpyEngine
    monkeypatch.setenv("OPENPANTO_KERNEL", "cuda")
    with pytest.raises(KernelError, match="'cuda'; use auto, numpy or numba"):
        make_engine(matrices)
    monkeypatch.setattr("models.numerics.kernel_cache.importlib.util.find_spec", lambda _: None)
    monkeypatch.setenv("OPENPANTO_KERNEL", "numba")
    with pytest.raises(KernelError, match="numba is not installed"):
        make_engine(matrices)
    monkeypatch.setenv("OPENPANTO_KERNEL", "auto")
    assert type(make_engine(matrices)) is NumpyEngine


def test_a_whole_run_is_the_same_with_and_without_kernels(short_line, cx, compiled_kernels, monkeypatch):
    """Contact found, contact force, droppers, points of contact: a strip over many intervals."""
    records = []
    for kernel in ("numpy", "numba"):
        monkeypatch.setenv("OPENPANTO_KERNEL", kernel)
        pantograph = cx.with_values({"start_position": 60.0, "raise_duration": 0.05})
        records.append(CoupledModel(CatenaryModel(short_line), [pantograph]).run(1.0, 1e-3))
    plain, compiled = records
    assert plain.contact_force.max() > 100.0
    for name in ("contact_force", "uplift", "dropper_force", "contact_point", "strip_height"):
        one, other = getattr(plain, name)[1:], getattr(compiled, name)[1:]
        assert np.nanmax(np.abs(other - one)) < 1e-10 * np.nanmax(np.abs(one)), name


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
