"""A line without its fast modes: what that changes, and what it must not."""

import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve

from models.catenary.line_model import CatenaryModel
from models.catenary.line_part import CatenaryPart
from models.catenary.line_state import StripMotion
from models.catenary.statics.elasticity import elasticity
from models.coupled.monolithic import CoupledModel
from models.definition_files.parameter import ParameterError
from models.library.catalogue import line_names, load_line
from models.numerics.newmark import Newmark
from tests.effort import some
from tests.models.nodal_line import NodalLine

HIGHEST = "dynamics.highest_frequency"
#: Leaves some intervals of both wires without any mode.
FEW = 12.0


def reduced(definition, highest, **changes):
    return CatenaryModel(definition.with_values({HIGHEST: highest} | changes))


@pytest.fixture(params=["numpy", "numba"])
def kernel(request, monkeypatch):
    if request.param == "numba":
        pytest.importorskip("numba")
    monkeypatch.setenv("OPENPANTO_KERNEL", request.param)


@pytest.fixture(scope="module")
def full(short_line):
    return CatenaryModel(short_line)


@pytest.fixture(scope="module", params=[FEW, 50.0])
def few(request, line_maker):
    """Few modes, damping in proportion to mass as well."""
    damping = {"alpha": [0.003, "s", "test"], "beta": [0.4, "1/s", "test"]}
    return reduced(line_maker(spans=4, damping=damping), request.param)


def run(model, cx, stop=0.6):
    pantograph = cx.with_values({"start_position": 60.0, "raise_duration": 0.05})
    return CoupledModel(model, [pantograph]).run(stop, 1e-3)


def strip(n, height=5.09):
    """Return a strip on its way, which leaves the wire and comes back."""
    x, z = 60.0 + 0.083 * n, height + 0.05 * np.sin(2.0 * np.pi * n / 250.0)
    return np.array([[[[x, y, z], [83.0, 0.0, 0.0]] for y in (0.7, -0.7)]])


def test_no_mode_is_left_out_unless_asked_for(full, short_line):
    assert short_line.dynamics.highest_frequency == 0.0
    assert len(full.modes.eigenvalue) + len(full.modes.attached) == (~full.mesh.fixed).sum()
    assert not full.modes.followers


def test_above_all_modes_nothing_changes(full, cx, kernel):
    fastest = np.sqrt(full.modes.eigenvalue.max()) / (2.0 * np.pi)
    lines = CatenaryModel(full.definition), reduced(full.definition, 1.01 * fastest)
    records = [run(line, cx, 0.3) for line in lines]
    for name in ("contact_force", "uplift", "dropper_force", "strip_height"):
        assert np.array_equal(*(getattr(record, name) for record in records)), name


def test_just_below_the_fastest_some_are_missing(full):
    fastest = np.sqrt(full.modes.eigenvalue.max()) / (2.0 * np.pi)
    assert len(reduced(full.definition, 0.99 * fastest).modes.eigenvalue) < len(full.modes.eigenvalue)


def test_modes_that_are_left_are_the_slow_ones(full):
    found = reduced(full.definition, 50.0).modes.eigenvalue
    expected = full.modes.eigenvalue[full.modes.eigenvalue <= (100.0 * np.pi) ** 2]
    assert np.array_equal(found, expected)


@pytest.mark.parametrize(("highest", "expected"), [(FEW, {0, 2}), (50.0, {4, 6, 8, 10})])
def test_intervals_keep_different_numbers_of_modes(full, highest, expected):
    """Else the tests below would prove less than they say."""
    line = reduced(full.definition, highest)
    assert {span.stop - span.start for span in line.modes.spans} == expected
    assert {interval.count for interval in line.wires[0].intervals} <= expected
    assert (0 in {interval.count for interval in line.wires[0].intervals}) == (0 in expected)
    assert bool(line.modes.followers) == (0 in expected)


@pytest.fixture(scope="module")
def confined(few):
    """A line of nodes, what its few coordinates move these by, and K, M, C of the coordinates."""
    line = NodalLine(few)
    T = _motions(few, line)
    return line, T, [T.T @ (matrix @ T) for matrix in (line.K, line.M, line.C)]


def test_steps_are_those_of_the_line_confined_to_its_coordinates(few, confined, kernel):
    """Galerkin's projection of the nodes' matrices, stepped by Newmark's method with accelerations."""
    model, newmark = CatenaryModel(few.definition), Newmark(1e-3)
    line, T, (K, M, C) = confined
    state = model.initial_state()
    model.set_velocity(state, 1e-3 * np.random.default_rng(1).standard_normal(model.mesh.fixed.shape))
    v = np.concatenate([state.motion.modal[1], state.motion.attached[1]])
    d, a = np.zeros(len(v)), np.linalg.solve(M, -C @ v)
    factor = cho_factor(K + newmark.a0 * M + newmark.a1 * C)
    forces = [(0, 65.0, 20.0), (0, 81.3, -10.0)]
    load = T.T @ sum(force * line.row(0, *model.wires[0].locate(x))[0] for _, x, force in forces)
    for _ in range(20):
        model.push(state, newmark.step, forces)
        right = load + M @ (newmark.a0 * d + newmark.a2 * v + newmark.a3 * a)
        right += C @ (newmark.a1 * d + newmark.a4 * v + newmark.a5 * a)
        new = cho_solve(factor, right)
        acceleration = newmark.a0 * (new - d) - newmark.a2 * v - newmark.a3 * a
        v = v + 0.5 * newmark.step * (a + acceleration)
        d, a = new, acceleration
    assert not state.slack.size
    found = model.displacement(state).ravel()[line.free]
    assert found == pytest.approx(T @ d, abs=1e-9 * np.abs(found).max())


def _motions(model, line):
    """Return what unit coordinates move the nodes by, a column each."""
    state, columns = model.initial_state(), []
    for part in (state.motion.modal[0], state.motion.attached[0]):
        for i in range(len(part)):
            part[i] = 1.0
            columns.append(model.displacement(state).ravel()[line.free])
            part[i] = 0.0
    return np.stack(columns, axis=1)


def test_what_a_motion_loses_is_orthogonal_in_the_mass_to_what_is_left(few, confined):
    line, state = confined[0], few.initial_state()
    nodal = np.where(few.mesh.fixed, 0.0, np.random.default_rng(2).standard_normal(few.mesh.fixed.shape))
    few.set_velocity(state, nodal)
    state.motion.modal[0], state.motion.attached[0] = state.motion.modal[1], state.motion.attached[1]
    lost = (nodal - few.displacement(state)).ravel()[line.free]
    assert np.abs(lost).max() > 0.1
    kept = few.initial_state()
    kept.motion.modal[0] = np.random.default_rng(3).standard_normal(len(few.modes.eigenvalue))
    motion = few.displacement(kept).ravel()[line.free]
    size = np.sqrt((lost @ (line.M @ lost)) * (motion @ (line.M @ motion)))
    assert motion @ (line.M @ lost) == pytest.approx(0.0, abs=1e-11 * size)


def test_contact_force_converges_as_the_cut_off_rises(full, cx):
    whole = run(full, cx).contact_force
    cuts = (20.0, 40.0, 80.0, 160.0, 320.0)
    error = [np.std(run(reduced(full.definition, cut), cx).contact_force - whole) for cut in cuts]
    assert np.all(np.diff(error) < 0.0)
    order = np.log2(error[0] / error[3]) / 3.0
    assert order > 2.0
    assert error[-1] < 1e-3


def test_statics_are_exact_at_attachments_and_stiffer_between(full):
    """A force at a dropper bends no interval beyond what its ends do; between, every mode gives way a little."""
    span = full.definition.sections[0].spans[2]
    droppers = np.array(span.droppers)
    between = 0.5 * (droppers[1:] + droppers[:-1])
    whole = [elasticity(full, x, 100.0).value for x in (droppers, between)]
    missing = []
    for cut in (FEW, 50.0, 100.0):
        at, inside = (elasticity(reduced(full.definition, cut), x, 100.0).value for x in (droppers, between))
        assert at == pytest.approx(whole[0], rel=1e-12)
        missing.append((whole[1] - inside) / whole[1])
    assert np.all(np.diff(missing, axis=0) < 0.0)
    assert np.all(missing[-1] > 0.0)
    assert np.all(missing[-1] < 0.01)


def test_a_constant_force_at_a_dropper_lifts_the_line_as_far(line_maker, kernel):
    """When all motion has died down."""
    line = line_maker(spans=4, alpha=0.1)
    at = line.sections[0].spans[1].droppers[3]
    rise = []
    for model in (CatenaryModel(line), reduced(line, FEW)):
        state = model.initial_state()
        for _ in range(1500):
            model.push(state, 0.01, [(0, at, 60.0)])
        node = np.abs(model.mesh.points[:, 0] - at).argmin()
        rise.append((model.spring_force(state), model.displacement(state)[node, 2]))
    (forces, whole), (found, lifted) = rise
    assert whole > 5e-3
    assert lifted == pytest.approx(whole, rel=1e-9)
    assert found == pytest.approx(forces, abs=1e-7 * forces.max())


def test_energy_balances_as_that_of_the_whole_line(few, kernel):
    """Under a strip that leaves the wire; droppers slacken."""
    part = CatenaryPart(few.definition.with_values({"monitor_energy": 1}))
    part.initialise(0.0, strip(0, 5.15))
    force, slack = [], 0
    for n in range(1200):
        part.step(strip(n, 5.15), 1e-3)
        force.append(part.contact_force[0])
        slack = max(slack, part.state.slack.size)
    _, dissipated, work, drift = part.energy
    assert slack > 0
    assert max(force) > 0.0 == min(force)
    assert work > 10.0
    assert dissipated > 1.0
    assert abs(drift) < 1e-11 * work


def test_goes_on_from_a_snapshot_bit_for_bit(few, kernel):
    part, other = CatenaryPart(few.definition), CatenaryPart(few.definition)
    for each in (part, other):
        each.initialise(0.0, strip(0))
    for n in range(150):
        part.step(strip(n), 1e-3)
    other.restore(part.snapshot())
    for each in (part, other):
        for n in range(150, 300):
            each.step(strip(n), 1e-3)
    assert part.contact_force[0] > 0.0
    assert all(np.array_equal(value, other.snapshot()[name]) for name, value in part.snapshot().items())


@pytest.mark.parametrize("highest", [FEW, 60.0])
def test_is_the_same_with_and_without_kernels(short_line, cx, highest, monkeypatch):
    pytest.importorskip("numba")
    records = []
    for kernel in ("numpy", "numba"):
        monkeypatch.setenv("OPENPANTO_KERNEL", kernel)
        records.append(run(reduced(short_line, highest), cx))
    plain, compiled = records
    assert plain.contact_force.max() > 100.0
    for name in ("contact_force", "uplift", "dropper_force", "contact_point", "strip_height"):
        one, other = getattr(plain, name)[1:], getattr(compiled, name)[1:]
        assert np.nanmax(np.abs(other - one)) < 1e-10 * np.nanmax(np.abs(one)), name


@pytest.mark.parametrize("name", some(line_names(), "EN50318_2002", "LN2_overlap", "LN2_ring", "Re330", "Shinkansen"))
def test_every_line_of_the_library_steps_with_few_modes(name):
    model = reduced(load_line(name), 15.0, **{"mesh.elements_between_droppers": 2})
    long_or_slow = ("EN50318_2002", "CA160", "CA220")  # every interval has a mode below 15 Hz
    assert model.modes.followers or name in long_or_slow
    x = 0.5 * sum(model.wires[0].ends)
    wire = model.static.positions[model.mesh.contact_chains()[0].nodes]
    z = np.interp(x, wire[:, 0], wire[:, 2]) + 0.03
    state, force = model.initial_state(), 0.0
    for n in range(60):
        at = [[[x + 0.08 * n, y, z], [80.0, 0.0, 0.0]] for y in (0.7, -0.7)]
        result = model.step(state, 1e-3, StripMotion(np.array([at]), np.zeros(1)))
        force = max(force, float(result.force.sum()))
    assert 50.0 < force < 2000.0
    assert np.abs(model.displacement(state)).max() < 0.2


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (-1.0, "-1 Hz is outside 0 ... 1e+09 Hz: check its size and its unit"),
        (1e10, "1e+10 Hz is outside 0 ... 1e+09 Hz: check its size and its unit"),
        (float("nan"), "nan is not finite, or larger than anything here can be (1e+15)"),
    ],
)
def test_values_out_of_range_are_refused(short_line, value, text):
    with pytest.raises(ParameterError) as caught:
        short_line.with_values({HIGHEST: value})
    assert str(caught.value) == f"parameter '{HIGHEST}': {text}"


def test_a_cut_off_below_all_modes_is_refused(short_line):
    with pytest.raises(ParameterError) as caught:
        reduced(short_line, 2.0)
    assert str(caught.value) == f"parameter '{HIGHEST}': 2 Hz leaves no mode; the slowest has 9.42 Hz"


def test_is_read_from_a_definition_file(line_maker):
    line = line_maker(dynamics={"highest_frequency": [0.3, "Hz", "test"]})
    assert line.dynamics.highest_frequency == 0.3
    (parameter,) = (p for p in line.parameters() if p.name == HIGHEST)
    assert (parameter.value, parameter.unit, parameter.source) == (0.3, "Hz", "test")
