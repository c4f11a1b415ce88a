"""A line that closes on itself has no beginning: what it does must not depend on where its file begins."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from models.catenary.definition.line_reading import read
from models.catenary.line_energy import LineBalance
from models.catenary.line_model import CatenaryModel
from models.catenary.line_part import CatenaryPart
from models.catenary.line_state import StripMotion
from models.catenary.linear_motion.attachment_solver import Banded, Cyclic, factorised
from models.catenary.linear_motion.compliance import Compliance
from models.catenary.shape.beam_elements import NODE_DOFS
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.catenary.shape.line_shape import line_shape
from models.catenary.statics.elasticity import elasticity
from models.coupled.monolithic import CoupledModel
from models.definition_files.toml_reader import DefinitionError, Table
from models.library.catalogue import line_names, line_path, load_line

STEP, SPAN = 1e-3, 50.0
#: Contact forces that differ by less are the same but for rounding [N].
ROUNDING = 2e-9


@pytest.fixture(scope="module")
def ring(ring_maker):
    return CatenaryModel(ring_maker(10))


@pytest.fixture(scope="module")
def run(ring, cx):
    """Run pantographs from given places: forces per step [N], places of contact [m], both of shape (n, P)."""

    def result(places, steps=500, line=ring):
        system = CoupledModel(line, [cx.with_values({"start_position": x}) for x in places])
        rows = [system.step(STEP, n * STEP) for n in range(1, steps + 1)]
        return np.array([f.sum(axis=1) for f, _ in rows]), np.array([p for _, p in rows])

    return result


def _still(place, height=-100.0):
    """Return a strip that rests across the track."""
    strip = np.zeros((1, 2, 2, 3))
    strip[0, :, 0] = [[place, 0.7, height], [place, -0.7, height]]
    return strip


# The line


def test_every_support_is_there_once(ring):
    mesh = ring.mesh
    assert len(mesh.support_nodes) == len(mesh.sprung) == len(mesh.arms) == 10
    assert mesh.points[mesh.support_nodes, 0].tolist() == [SPAN * i for i in range(10)]
    images = np.flatnonzero(mesh.owner != np.arange(len(mesh.owner)))
    assert len(images) == 2
    assert mesh.points[images] - mesh.points[mesh.owner[images]] == pytest.approx(np.array([[500.0, 0.0, 0.0]] * 2))
    assert not mesh.clamp_mass[images].any()


def test_matrices_are_those_of_the_open_chain_with_its_ends_tied_together(ring):
    """T' A T, with T from the degrees of freedom of the owners to those of all nodes."""
    mesh, points = ring.mesh, ring.static.shape.points
    alone = replace(mesh, owner=np.arange(len(mesh.owner)))
    columns = (mesh.owner[:, None] * NODE_DOFS + np.arange(NODE_DOFS)).ravel()
    T = sp.csr_matrix((np.ones(len(columns)), (np.arange(len(columns)), columns)), shape=(len(columns),) * 2)
    tied, opened = (
        line_shape(ring.definition, mesh, points).matrices,
        line_shape(ring.definition, alone, points).matrices,
    )
    for name in ("K", "M", "C"):
        expected = T.T @ getattr(opened, name) @ T
        difference = abs(getattr(tied, name) - expected).max()
        assert difference <= 1e-12 * abs(expected).max(), name
    assert tied.load == pytest.approx(T.T @ opened.load, abs=1e-9)


@pytest.mark.parametrize("line", ["simple", "elastic supports", "Shinkansen"])
def test_all_spans_hang_alike(ring, ring_maker, line):
    if line == "elastic supports":
        support = {"stiffness": [1e5, "N/m", "test"], "damping": [100.0, "N.s/m", "test"]}
        ring = CatenaryModel(ring_maker(4, messenger_support=support))
    if line == "Shinkansen":
        ring = CatenaryModel(_closed("Shinkansen", 4))
    static, mesh, spans = ring.static, ring.mesh, len(ring.definition.sections[0].spans)
    assert static.residual < 1e-12
    for kind in (mesh.is_hanger, ~mesh.is_hanger):
        force, length = (v[kind].reshape(spans, -1) for v in (static.dropper_force, static.unstrained_length))
        assert np.ptp(force, axis=0) == pytest.approx(0.0, abs=1e-8)
        assert np.ptp(length, axis=0) == pytest.approx(0.0, abs=1e-9)
    for chain in mesh.chains:
        shape = static.positions[chain.nodes]
        assert shape[-1] - shape[0] == pytest.approx([SPAN * spans, 0.0, 0.0], abs=1e-12)
        height = shape[:-1, 2].reshape(spans, -1)
        assert np.ptp(height, axis=0) == pytest.approx(0.0, abs=1e-9)
        lateral = shape[:-1, 1].reshape(spans, -1) * ((-1.0) ** np.arange(spans))[:, None]
        assert np.ptp(lateral, axis=0) == pytest.approx(0.0, abs=1e-9)


def _closed(name, spans):
    """Return a line of the library that closes on itself after a number of its spans."""
    data = tomllib.loads(line_path(name).read_text(encoding="utf-8"))
    del data["ends"]
    data["spans"] |= {"count": spans, "periodic": True}
    return read(Table.from_dict(data))


def test_it_hangs_as_the_middle_of_a_long_line_does(ring, line_maker):
    """The wires of a line that ends keep their length between its anchors; what the end spans add fades as 1 / N."""
    inside = ring.static.dropper_force.reshape(10, -1)[0]
    off = []
    for spans in (20, 40):
        line = line_maker(spans)
        static = kept_form(line, build_mesh(line))
        off.append(np.abs(static.dropper_force.reshape(spans, -1)[spans // 2] - inside).max())
    assert off[0] < 2e-4
    assert off[1] == pytest.approx(0.5 * off[0], rel=0.05)


def test_its_elasticity_is_the_same_on_both_sides_of_the_seam(ring):
    inside = np.linspace(-20.0, 20.0, 9)
    there, here = (elasticity(ring, middle + inside, 100.0).value for middle in (250.0, 0.0))
    beyond = elasticity(ring, 1500.0 + inside, 100.0).value
    assert here == pytest.approx(there, rel=1e-9)
    assert beyond == pytest.approx(here, rel=1e-12)


@pytest.mark.parametrize("name", [n for n in line_names() if load_line(n).sections[0].periodic])
def test_rings_of_the_library_stand(name):
    part = CatenaryPart(load_line(name))
    assert part.model.static.residual < 1e-9
    assert part.period[0] == part.definition.sections[0].period > 0.0


def test_a_line_that_ends_has_no_period(short_line):
    assert CatenaryPart(short_line).period.tolist() == [0.0]


# Motion


def test_force_and_place_do_not_depend_on_the_span(run):
    """The same run one pair of spans further, over the seam, and several laps further."""
    force, point = run([112.0])
    for place in (212.0, 462.0 + 50.0 - 100.0, 480.0 + 32.0 + 500.0, 112.0 + 7 * 500.0):
        moved, there = run([place])
        assert np.abs(moved - force).max() < ROUNDING, place
        off = there - point
        assert off[:, 0, 0] == pytest.approx(place - 112.0, abs=1e-9)
        assert np.abs(off[:, 0, 1:]).max() < 1e-10


def test_force_does_not_see_the_seam(run):
    """From 490 m over the seam at 500 m, and from 190 m over the support at 200 m."""
    over, there = run([490.0])
    inside, _ = run([190.0])
    assert there[0, 0, 0] < 500.0 < there[-1, 0, 0]
    assert np.diff(there[200:, 0, 0]) == pytest.approx(300.0 / 3.6 * STEP, abs=1e-4)
    assert np.abs(over - inside).max() < ROUNDING


def test_two_pantographs_with_the_seam_between_them(run):
    """85 m apart: both before the seam, one on either side, both behind it, in whatever order they are given."""
    before, _ = run([290.0, 205.0])
    for places in ([540.0, 455.0], [590.0, 505.0], [40.0, -45.0], [540.0, 455.0 + 500.0]):
        shift = (places[0] - 290.0) % 100.0
        force, _ = run(places)
        reference = before if shift == 0.0 else run([340.0, 255.0])[0]
        assert np.abs(force - reference).max() < ROUNDING, places
    assert np.abs(before[:, 1] - before[:, 0])[200:].max() > 1.0  # the second one feels the first


def test_until_waves_come_round_it_is_a_long_line(ring_maker, line_maker, run):
    """Axial waves are the fastest, 3.7 km/s: 0.25 s from the middle of 1 km to its far side and back."""
    ring, line = CatenaryModel(ring_maker(20)), CatenaryModel(line_maker(40))
    stagger = {s.x: s.stagger for s in line.definition.sections[0].supports}
    start = 1000.0 if stagger[1000.0] > 0.0 else 1050.0
    on_ring, _ = run([412.0], 250, ring)
    on_line, _ = run([start + 12.0], 250, line)
    assert on_line.max() > 100.0
    assert np.abs(on_ring - on_line).max() < 5e-4  # of which the static shape has 1e-4


def test_without_damping_its_energy_stays(ring_maker):
    line = CatenaryModel(ring_maker(4, alpha=0.0))
    state = line.initial_state()
    velocity = np.zeros((len(line.mesh.points), NODE_DOFS))
    x = line.mesh.points[:, 0]
    velocity[:, 2] = 0.02 * np.sin(2.0 * np.pi * x / 200.0)
    line.set_velocity(state, velocity)
    before = line.energy(state)
    for _ in range(400):
        line.push(state, STEP, ())
    assert not state.slack.size
    assert line.energy(state) == pytest.approx(before, rel=1e-11)
    moved = line.displacement(state)
    assert np.abs(moved[:, 2]).max() > 1e-4
    assert (moved == moved[line.mesh.owner]).all()


def test_its_energy_balances_under_a_strip_that_passes_the_seam(ring):
    state, strips = ring.initial_state(), _still(495.0, 5.11)
    balance = LineBalance(ring, strips, ring.contact_at_rest(state, strips))
    worst = 0.0
    for n in range(1, 301):
        strips = _still(495.0 + 0.05 * n, 5.11)
        strips[:, :, 1, 0] = 50.0
        balance.step(state, STEP, StripMotion(strips, np.zeros(1)))
        stored, dissipated, work, drift = balance.balance(state)
        worst = max(worst, abs(drift))
    assert stored > 1.0
    assert dissipated > 1.0
    assert worst < 1e-12 * work


def test_a_force_acts_at_its_place_in_every_lap(ring):
    """Pushing at 10 m, at 510 m and at -490 m is one; at 110 m it is the same one pair of spans further."""
    rises = []
    for x in (10.0, 510.0, -490.0, 110.0):
        state = ring.initial_state()
        for _ in range(60):
            ring.push(state, STEP, [(0, x, 100.0)])
        rises.append(ring.uplift(state))
    assert rises[0][0] > 5e-4
    assert (rises[1] == rises[0]).all()
    assert (rises[2] == rises[0]).all()
    assert np.roll(rises[0], 2) == pytest.approx(rises[3], abs=1e-12)
    assert np.ptp(rises[0]) > 5e-4


def test_a_contact_at_the_seam_does_not_fade(ring):
    """Where a wire ends its contact sets in over a metre; this one does not end."""
    state = ring.initial_state()
    at = [ring.contact_at_rest(state, _still(x, 5.10)).force[0, 0] for x in (499.999, 500.0, 500.001, 300.0)]
    assert at[3] > 100.0
    assert at == pytest.approx([at[3]] * 4, rel=1e-3)


@pytest.mark.parametrize(("middle", "skew"), [(-0.05, 0.35), (0.05, -0.35), (0.05, 0.35), (-0.05, -0.35)])
def test_a_skew_strip_finds_the_wire_on_the_other_side_of_the_seam(ring, middle, skew):
    """Its middle is on one side, its crossing with the wire, 0.2 m beside it, 0.1 m further on or back."""
    found = []
    for support in (0.0, 200.0, 500.0, 1500.0):
        strips = _still(support + middle, 5.10)
        strips[0, :, 0, 0] += [skew, -skew]
        state = ring.initial_state()
        result = ring.contact_at_rest(state, strips)
        assert result.point[0, 0, 0] == pytest.approx(support + middle + 0.2 / 0.7 * skew, abs=1e-3)
        element = int(state.element[0, 0])
        moving = ring.step(state, STEP, StripMotion(strips, np.zeros(1)))
        assert int(state.element[0, 0]) == element
        found.append([*result.force[0, 0:1], *moving.force[0, 0:1], *(moving.point[0, 0] - [support, 0.0, 0.0])])
    assert found[1][0] > 100.0
    for there in found:
        assert there == pytest.approx(found[1], abs=1e-9)


def test_a_strip_along_the_track_is_not_looked_for_for_ever(ring):
    """It would cross a wire without any kink millions of laps further on."""
    strip = _still(250.0)[0]
    strip[:, 0, :2] = [[250.0 + 1e9, 0.7], [250.0 - 1e9, 0.6]]

    def straight(interval):
        return (interval.plan_static * np.resize([1.0, 0.0], len(interval.plan_static))).tolist()

    assert ring.wires[0].find(strip, straight, -1) is None
    strip[:, 0, :2] = [[250.0, 0.7], [250.0, -0.7]]
    assert ring.wires[0].find(strip, straight, -1).share == pytest.approx(0.5)


def test_a_snapshot_beyond_the_seam_comes_back(ring_maker):
    part = CatenaryPart(ring_maker(4))
    place = {"x": 199.0 + 5 * 200.0}

    def step():
        place["x"] += 0.08
        part.step(_still(place["x"], 5.11), STEP)
        return part.contact_force.tobytes() + part.contact_point.tobytes() + part.support_uplift.tobytes()

    part.initialise(0.0, _still(place["x"], 5.11))
    for _ in range(20):
        step()
    kept, x = part.snapshot(), place["x"]
    once = [step() for _ in range(20)]
    part.restore(kept)
    place["x"] = x
    assert [step() for _ in range(20)] == once
    assert part.contact_point[0, 0] == pytest.approx(place["x"], abs=1e-2)
    assert part.contact_force[0] > 0.0


# The cyclic band


def _cyclic(n, width, seed=1, diagonal=4.0):
    """Return a symmetric positive definite cyclic band."""
    random = np.random.default_rng(seed)
    matrix = np.zeros((n, n))
    for k in range(1, width + 1):
        values = random.uniform(-1.0, 1.0, n)
        for i, value in enumerate(values):
            matrix[i, (i + k) % n] = matrix[(i + k) % n, i] = value
    return matrix + diagonal * width * np.eye(n)


@pytest.mark.parametrize(("n", "width"), [(60, 5), (400, 5), (401, 8)])
def test_a_cyclic_band_solves_as_the_full_matrix_does(n, width):
    matrix = _cyclic(n, width)
    factor = Cyclic(sp.csr_matrix(matrix), width)
    load = np.random.default_rng(2).standard_normal(n)
    assert factor.solve(load) == pytest.approx(np.linalg.solve(matrix, load), abs=1e-14)
    inverse = np.linalg.inv(matrix)
    reached = []
    for first in range(n):
        begin, values = factor.near(first, np.array([[1.0, 0.0], [0.0, 1.0]]))
        found = np.zeros((n, 2))
        found[(begin + np.arange(len(values))) % n] = values
        assert np.abs(found - inverse[:, [first, (first + 1) % n]]).max() < 1e-14
        reached.append(len(values))
    if n > 100:
        assert max(reached) < n // 2  # near the load only, at the seam as well


def test_a_slowly_fading_response_is_found_whole():
    """On so short a ring nothing dies out before it meets itself."""
    matrix = _cyclic(40, 3, diagonal=1.3)
    factor = Cyclic(sp.csr_matrix(matrix), 3)
    begin, values = factor.near(39, np.ones((1, 1)))
    assert (begin, len(values)) == (0, 40)
    assert values[:, 0] == pytest.approx(np.linalg.inv(matrix)[:, 39], abs=1e-13)


def test_the_factor_follows_from_the_pattern(ring, short_line):
    assert isinstance(factorised(ring.modes.K + 1e6 * ring.modes.M), Cyclic)
    assert isinstance(factorised(CatenaryModel(short_line).modes.K), Banded)


def test_what_is_not_positive_definite_is_refused():
    for corner in (0, 30, 59):
        matrix = _cyclic(60, 5)
        matrix[corner, corner] = -1.0
        with pytest.raises(np.linalg.LinAlgError):
            Cyclic(sp.csr_matrix(matrix), 5)


def test_responses_reach_round_the_seam(ring_maker):
    """Single ones and those of an interval side by side, against whole solutions."""
    ring = CatenaryModel(ring_maker(20))
    factor = factorised(ring.modes.K + 4e6 * ring.modes.M + 2e3 * ring.modes.C)
    compliance = Compliance(factor, ring.dropper_law.B, ring.dropper_law.stiffness)
    n, wraps = factor.matrix.shape[0], 0
    wire = ring.wires[0]
    for x in (1.0, 300.0, 640.0, 998.0):
        places = wire.interval(wire.locate(x)[0]).ends
        columns = compliance.units(places)
        wraps += not isinstance(columns.rows, slice)
        found = np.zeros((n, len(places)))
        found[columns.rows] = columns.values
        whole = np.column_stack([factor.solve(np.eye(1, n, place)[0]) for place in places])
        assert np.abs(found - whole).max() < 1e-13 * np.abs(whole).max()
        every = np.arange(n)
        assert (columns.at(every) == found).all()
        stretch = np.zeros((ring.dropper_law.B.shape[0], len(places)))
        near = columns.dropper_index
        stretch[near] = columns.dropper_force / ring.dropper_law.stiffness[near, None]
        assert np.abs(stretch - ring.dropper_law.B @ whole).max() < 1e-13 * np.abs(whole).max()
    assert wraps


# The file


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"spans": 5}, "section[1].stagger.amplitude: changes sides at every support, and after 5 spans the line would "
         "close on the other side: take an even number of spans, or list the stagger of every support"),
        ({"steady_arm": None}, "steady_arm: a periodic line needs a table [steady_arm]: it has no anchors, and nothing "
         "else holds the contact wire"),
        ({"stagger": {"amplitude": [0.2, "m", "test"], "anchor": [0.1, "m", "test"]}},
         "section[1].stagger.anchor: a periodic line has no anchors: remove this value"),
        ({"stagger": {"listed": [[0.2, -0.2, 0.1], "m", "test"]}, "spans": 4},
         "section[1].stagger.listed: has 3 values where 4 are needed"),
        ({"type": "stitched", "stitch_wire": {
            "length": [18.0, "m", "test"], "area": [35.0, "mm2", "test"], "mass": [0.31, "kg/m", "test"],
            "youngs_modulus": [1e5, "MPa", "test"], "tension": [2.8, "kN", "test"]}},
         "stitch_wire: a periodic line cannot have stitch wires: the one at its first support would lie across the "
         "seam; take type 'simple' or 'compound'"),
    ],
)  # fmt: skip
def test_what_does_not_close_is_told(ring_maker, changes, sentence):
    with pytest.raises(DefinitionError) as error:
        ring_maker(**changes)
    assert str(error.value) == f"short.toml: {sentence}"


def _of_sections(section_maker, *extra):
    section = section_maker(0.0, 4, [])
    section["spans"]["periodic"] = True
    section["stagger"] = {"amplitude": [0.2, "m", "test"]}
    del section["ends"]
    return [section | e for e in extra]


@pytest.mark.parametrize(
    ("extra", "sentence"),
    [
        ([{}, {}], "section: 2 sections: a periodic line has one; write one section, or no 'periodic'"),
        ([{"ends": {"spans": 1, "rise": [0.1, "m", "test"]}}],
         "section[1].ends: a periodic line has no ends: remove this table"),
        ([{"measured": {"positions": [[0.0, 200.0], "m", "test"], "heights": [[5.1, 5.0], "m", "test"]}}],
         "section[1].measured.heights: a periodic line ends as it begins: the last height must be the first, 5.1 m, "
         "not 5 m"),
    ],
)  # fmt: skip
def test_what_contradicts_a_ring_is_told(section_maker, sections_maker, extra, sentence):
    with pytest.raises(DefinitionError) as error:
        sections_maker(*_of_sections(section_maker, *extra))
    assert str(error.value) == f"short.toml: {sentence}"


def test_uneven_spans_with_listed_stagger_close_as_well(ring_maker, sections_maker):
    """An odd number of spans of different lengths: equilibrium at every support, the seam's among them."""
    section = {
        "spans": {
            "start": [-10.0, "m", "test"],
            "lengths": [[45.0, 54.0, 49.5], "m", "test"],
            "droppers": {"first": [4.5, "m", "test"], "count": 7},
            "periodic": True,
        },
        "stagger": {"listed": [[0.2, -0.2, 0.1], "m", "test"]},
    }
    line = sections_maker(section)
    assert line.sections[0].period == pytest.approx(148.5)
    model = CatenaryModel(line)
    static, mesh = model.static, model.mesh
    assert static.residual < 1e-12
    unbalanced = static.shape.matrices.K @ static.displacement - static.shape.matrices.load
    unbalanced += static.shape.droppers.rows.T @ static.dropper_force
    assert np.abs(unbalanced.reshape(-1, NODE_DOFS)[:, 1][~mesh.fixed[:, 1]]).max() < 1e-6
    assert build_mesh(line).points[mesh.support_nodes, 0].tolist() == [-10.0, 35.0, 89.0]


def test_kernels_go_round_as_numpy_does(ring_maker, cx, monkeypatch):
    """Across the place where the line closes, two laps away; the compiled steps solve the cyclic band as well."""
    pytest.importorskip("numba")
    records = []
    for kernel in ("numpy", "numba"):
        monkeypatch.setenv("OPENPANTO_KERNEL", kernel)
        line = CatenaryModel(ring_maker(10))
        record = CoupledModel(line, [cx.with_values({"start_position": 1485.0, "raise_duration": 0.05})]).run(0.4, STEP)
        assert type(line._engine(STEP)).__name__ == {"numpy": "PlainStep", "numba": "CompiledLineStep"}[kernel]
        records.append(record)
    plain, compiled = records
    assert plain.contact_point[-1, 0, 0] > 1500.0
    assert plain.contact_force[-1].sum() > 50.0
    for name in ("contact_force", "uplift", "dropper_force", "contact_point"):
        one, other = getattr(plain, name), getattr(compiled, name)
        assert np.nanmax(np.abs(other - one)) < 1e-9 * np.nanmax(np.abs(one)), name
