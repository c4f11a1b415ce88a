"""The monolithic coupling against one assembled system, and the co-simulation of the parts against it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu, spsolve

from models.catenary.line_model import CatenaryModel
from models.catenary.line_part import CatenaryPart
from models.commands.physics_main import main
from models.coupled.held_coupling import HeldCoupling
from models.coupled.monolithic import CoupledModel
from models.numerics.newmark import Newmark
from models.pantograph.lumped.lumped_model import LumpedModel
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from tests.effort import rest
from tests.models.nodal_line import NodalLine

START, STOP = 60.0, 1.2


@pytest.fixture(scope="module")
def line(line_maker):
    return line_maker(spans=5)


@pytest.fixture(scope="module")
def pantograph(cx):
    return cx.with_values({"start_position": START, "raise_duration": 0.05})


def _assembled(line, pantograph, dt, steps):
    """One matrix for line, pantograph and contact spring, assembled and solved again in every step."""
    model, lumped = CatenaryModel(line), LumpedModel(pantograph)
    catenary = NodalLine(model)
    newmark, n, m = Newmark(dt), catenary.size, lumped.size
    M = sp.block_diag([catenary.M, lumped.M], format="csr")
    C = sp.block_diag([catenary.C, lumped.C], format="csr")
    K = sp.block_diag([catenary.K, lumped.K], format="csr")
    base = (K + newmark.a0 * M + newmark.a1 * C).tocsc()
    untouched = splu(base)
    k = line.contact.stiffness
    d, v, a = (np.zeros(n + m) for _ in range(3))
    forces, element = [], -1
    for step in range(1, steps + 1):
        t = step * dt
        right = M @ (newmark.a0 * d + newmark.a2 * v + newmark.a3 * a) + C @ (newmark.a1 * d + newmark.a4 * v)
        right[n:] += lumped.load(t, np.zeros(2))
        x = pantograph.start_position + pantograph.speed * t
        strip = np.array([[[x, y, 0.0], [pantograph.speed, 0, 0]] for y in (0.7, -0.7)])
        found = catenary.find(0, strip, untouched.solve(right)[:n], element)
        element = found.element
        row, height = catenary.row(0, found.element, found.xi)
        row = sp.csc_matrix(np.concatenate([-row, np.zeros(m - 1), [1.0]])[:, None])
        gap0 = pantograph.reference_height - height
        slack: set[int] = set()
        closed = False
        for _ in range(50):
            system, load = base, right.copy()
            if closed:
                system = system + k * (row @ row.T)
                load -= k * gap0 * row.toarray()[:, 0]
            if slack:
                rows = sp.block_diag([catenary.B, sp.csr_matrix((0, m))], format="csr")[sorted(slack)]
                stiff = sp.diags(model.dropper_law.stiffness[sorted(slack)])
                system = system - rows.T @ stiff @ rows
                load += rows.T @ model.static.dropper_force[sorted(slack)]
            new = untouched.solve(load) if system is base else spsolve(system.tocsc(), load)
            gap = gap0 + (row.T @ new)[0]
            elastic = model.static.dropper_force + model.dropper_law.stiffness * (catenary.B @ new[:n])
            now = set(np.flatnonzero(elastic < 0.0).tolist())
            if (gap > 0.0) == closed and now == slack:
                break
            closed, slack = bool(gap > 0.0), now
        acceleration = newmark.a0 * (new - d) - newmark.a2 * v - newmark.a3 * a
        v = v + 0.5 * dt * (a + acceleration)
        d, a = new, acceleration
        forces.append(k * max(gap, 0.0))
    return np.array(forces)


def test_coupling_by_local_response_equals_one_assembled_system(line, pantograph):
    """Independent of the step's split into free response and local corrections, slack included."""
    steps, dt = 240, 1e-3
    low = line.with_values({"damping.alpha": 0.00275})
    expected = _assembled(low, pantograph, dt, steps)
    coupled = CoupledModel(CatenaryModel(low), [pantograph])
    record = coupled.run(steps * dt, dt)
    assert expected.max() > 100.0
    assert (record.dropper_force <= 1e-9).any()
    assert np.abs(record.contact_force[1:, 0] - expected).max() < 1e-5


def _cosimulate(line, pantograph, H, scheme, order, stop=STOP):
    settings = {"extrapolation_order": order, "time_step": H}
    catenary = CatenaryPart(line.with_values(settings))
    lumped = LumpedPantographPart(pantograph.with_values(settings))
    base = np.zeros(2)
    lumped.initialise(0.0, 0.0, np.zeros(3), base)
    catenary.initialise(0.0, lumped.strip[None])
    forces = []
    for _ in range(round(stop / H)):
        force, point, strip = catenary.contact_force[0], catenary.contact_point[0].copy(), lumped.strip.copy()
        if scheme == "pantograph first":
            lumped.step(force, point, base, H)
            strip = lumped.strip.copy()
        catenary.step(strip[None], H)
        if scheme == "catenary first":
            force, point = catenary.contact_force[0], catenary.contact_point[0]
        if scheme != "pantograph first":
            lumped.step(force, point, base, H)
        forces.append(catenary.contact_force[0])
    return np.array(forces)


@pytest.fixture(scope="module")
def difference(line, pantograph):
    """Function: largest difference of the contact force from the monolithic run, once the impact of raising is over."""
    whole = cache(lambda H: CoupledModel(CatenaryModel(line), [pantograph]).run(STOP, H))

    @cache
    def found(H, scheme, order):
        record, force = whole(H), _cosimulate(line, pantograph, H, scheme, order)
        settled = record.time[1:] > 0.6
        return np.abs(force - record.contact_force[1:, 0])[settled].max()

    return found


@pytest.mark.parametrize("scheme", ["jacobi", "catenary first", *rest("pantograph first")])
def test_difference_from_the_monolithic_run_shrinks_with_the_step(difference, scheme):
    """Held inputs between the tools, continued inside: second order with linear, third with quadratic inputs."""
    for order, expected in ((1, 1.7), (2, 2.5)):
        coarse, fine = (difference(H, scheme, order) for H in (2e-3, 1e-3))
        assert np.log2(coarse / fine) > expected


def test_stops_and_friction_are_those_of_the_parts(line, pantograph, monkeypatch):
    """Their laws hold in the step of the whole, too: the same force in the limit of short steps, by the same order."""
    stages = tuple(replace(s, friction=f) for s, f in zip(pantograph.stage, (10.0, 5.0, 5.0), strict=True))
    reference = pantograph.reference_height
    held = replace(pantograph, stage=stages, highest_height=reference + 0.02, lowest_height=reference - 0.03)
    fixed, fix = [], HeldCoupling.fix
    monkeypatch.setattr(HeldCoupling, "fix", lambda own: (fixed.append(own), fix(own)))
    differences = []
    for step in (2e-3, 1e-3):
        record = CoupledModel(CatenaryModel(line), [held]).run(0.7, step)
        force = _cosimulate(line, held, step, "jacobi", 2, 0.7)
        differences.append(np.abs(force - record.contact_force[1:, 0])[record.time[1:] > 0.4].max())
    assert not fixed
    assert record.strip_height.max() > reference + 0.01
    assert differences[1] < 0.2
    assert np.log2(differences[0] / differences[1]) > 2.0


def test_quadratic_inputs_beat_linear_and_held_ones(difference):
    held, linear, quadratic = (difference(1e-3, "jacobi", order) for order in (0, 1, 2))
    assert quadratic < 0.5 * linear < 0.25 * held


def test_gauss_seidel_is_at_least_as_close_as_jacobi(difference):
    jacobi = difference(1e-3, "jacobi", 2)
    for scheme in ("catenary first", "pantograph first"):
        assert difference(1e-3, scheme, 2) <= jacobi


def test_parts_continue_identically_from_a_snapshot(line, pantograph):
    parts = [(CatenaryPart(line), LumpedPantographPart(pantograph)) for _ in range(2)]
    base = np.zeros(2)
    for catenary, lumped in parts:
        lumped.initialise(0.0, 0.0, np.zeros(3), base)
        catenary.initialise(0.0, lumped.strip[None])

    def run(catenary, lumped, steps):
        for _ in range(steps):
            force, point = catenary.contact_force[0], catenary.contact_point[0].copy()
            catenary.step(lumped.strip[None].copy(), 1e-3)
            lumped.step(force, point, base, 1e-3)

    run(*parts[0], 300)
    for source, target in zip(*parts, strict=True):
        target.restore(source.snapshot())
    for catenary, lumped in parts:
        run(catenary, lumped, 100)
    assert parts[0][0].contact_force[0] > 0.0
    for first, second in zip(parts[0][0].snapshot().items(), parts[1][0].snapshot().items(), strict=True):
        assert np.array_equal(first[1], second[1], equal_nan=True), first[0]


def test_a_kernel_that_does_not_exist_is_told_on_one_line(monkeypatch, capsys):
    monkeypatch.setenv("OPENPANTO_KERNEL", "cuda")
    assert main(["couple", "generic_simple", "CX", "--speed", "200"]) != 0
    assert "OPENPANTO_KERNEL is 'cuda'" in capsys.readouterr().err


def test_a_run_may_go_on_where_a_line_closes_on_itself(tmp_path, capsys):
    """LN2's last support is at 1136.9 m; on a ring of 990 m a run may end anywhere behind its start."""
    run = ["CX", "--start", "950", "--end", "1150", "--interval", "1050", "1150", "--quiet", "--out", str(tmp_path)]
    assert main(["couple", "LN2", *run]) != 0
    assert "does not lie on the line" in capsys.readouterr().err
    assert main(["couple", "LN2_ring", *run]) == 0
    table = np.genfromtxt(tmp_path / "timeseries.csv", delimiter=",", names=True)
    force = table["catenarypantograph1contactforce_N"]
    assert table["catenarypantograph1contactx_m"][-1] == pytest.approx(1150.0, abs=0.1)
    assert force[len(force) // 2 :].min() > 50.0  # never lost over the place where the line closes
