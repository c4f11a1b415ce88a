"""The fast step against the plain one in nodal coordinates, and the solvers below it."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from models.catenary.band import Banded, Sparse, factorised
from models.catenary.compliance import Compliance, joined
from models.catenary.model import CatenaryModel, StripMotion
from models.catenary.product import Product
from models.library import load_line
from models.time_integration import Newmark
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


def test_columns_joined_answer_like_one_solution(model):
    now = model._step(1e-3)
    interval = model.wires[0].intervals[40]
    one = now.compliance.columns(interval.ends, np.eye(len(interval.ends)))
    two = joined([now.compliance.attachment(ends) for ends in interval.sides])
    everywhere = np.arange(len(model.modes.attached))
    assert two.at(everywhere) == pytest.approx(one.at(everywhere), abs=1e-14 * np.abs(one.values).max())
    stretch = np.zeros((2, len(model.dropper_stiffness), len(interval.ends)))
    for k, columns in enumerate((one, two)):
        stretch[k, columns.dropper_index] = columns.dropper_stretch
    assert stretch[1] == pytest.approx(stretch[0], abs=1e-14 * np.abs(stretch).max())


def test_compliance_of_droppers_is_symmetric(model):
    columns = Compliance(model._step(1e-3).stepper.factor, model.B).dropper_columns
    i, j = 20, 22
    response = {k: dict(zip(columns[k].dropper_index.tolist(), columns[k].dropper_stretch[:, 0], strict=True))
                for k in (i, j)}  # fmt: skip
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
