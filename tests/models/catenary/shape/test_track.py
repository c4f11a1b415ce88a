"""Lines on curved and canted track: published figures, points held in space, symmetry."""

import dataclasses

import numpy as np
import pytest

from models.catenary.definition.line_definition import COMPONENTS, GRAVITY
from models.catenary.definition.track_definition import Track
from models.catenary.shape.form_finding import EquilibriumError, find_form
from models.catenary.shape.line_mesh import CatenaryMesh, Chain, build_mesh
from models.catenary.shape.support_places import SupportPlaces
from models.catenary.shape.track import mean_curvature
from tests.effort import count
from tests.models.curved_space import CurvedSpace

NO_NODES = np.zeros(0, dtype=np.int64)
#: Transition of the printed case: radius 1000 m and 100 mm of cant between 50 and 150 m.
TRANSITION = Track(positions=(50.0, 150.0), curvature=(0.0, 1e-3), cant=(0.0, 0.1))


def string(line, track, *, spans=6, length=50.0, y=-0.2, z=5.08, elements=100):
    """A contact wire alone, held at one place in the rail plane at every support: its state, and which nodes."""
    count = spans * elements + 1
    # Finer towards the supports, at which the wire has a kink that its elements' slopes have to follow.
    share = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, elements, endpoint=False)))
    x = np.append((np.arange(spans)[:, None] + share).ravel(), spans) * length
    held = np.arange(0, count, elements)
    fixed = np.zeros((count, 6), dtype=bool)
    fixed[held, 1:3] = True
    fixed[[0, -1], :4] = True
    mesh = CatenaryMesh(
        points=np.column_stack([x, np.full(count, y), np.full(count, z)]),
        beams=np.column_stack([np.arange(count - 1), np.arange(1, count)]),
        component=np.full(count - 1, COMPONENTS.index("contact_wire")),
        beside_stitch=np.zeros(count - 1, dtype=bool),
        chains=(Chain("contact_wire", 0, np.arange(count)),),
        droppers=np.zeros((0, 2), dtype=np.int64),
        is_hanger=np.zeros(0, dtype=bool),
        target=np.zeros(0),
        given_length=np.zeros(0),
        broken=np.zeros(0, dtype=bool),
        fixed=fixed,
        sprung=NO_NODES,
        seat=np.zeros(0),
        tension_factor=np.ones(count - 1),
        area_factor=np.ones(count - 1),
        clamp_mass=np.zeros(count),
        support_nodes=np.arange(1, count - 1),  # every node, so that the reference follows the wire in plan
        arms=np.zeros((0, 2), dtype=np.int64),
        section=np.zeros(count, dtype=np.int64),
        owner=np.arange(count),
        adrift=NO_NODES,
    )
    wire = dataclasses.replace(line.contact_wire, bending_stiffness=0.1)
    definition = dataclasses.replace(line, track=track, contact_wire=wire, steady_arm=None, clamps=type(line.clamps)())
    return find_form(definition, mesh), held


def at(state, x):
    """Place in the rail plane of the string at some x."""
    return tuple(float(np.interp(x, state.positions[:, 0], state.positions[:, k])) for k in (1, 2))


def reactions(state, nodes):
    """Force in y and z that the supports give, shape (n, 2)."""
    matrices = state.shape.matrices
    return (matrices.K @ state.displacement - matrices.load).reshape(-1, 6)[nodes, 1:3]


def test_the_printed_string_in_a_transition(short_line):
    state, _ = string(short_line, TRANSITION)
    for x, y, z in ((75.0, -0.118, 4.876), (125.0, 0.044, 4.887), (175.0, 0.125, 4.897)):
        assert at(state, x) == pytest.approx((y, z), abs=2e-3)


def test_the_printed_lateral_forces_in_a_transition(line_maker):
    """Of a level wire; the sag of the string beside adds 2 T d' z', 3.6 N at both ends of the ramp."""
    line = line_maker(spans=6, stagger={"listed": [[-0.2] * 5, "m", "x"], "anchor": [-0.2, "m", "x"]})
    line = dataclasses.replace(line, track=TRANSITION)
    places = SupportPlaces(line, line.sections[0])
    lateral = [places.lateral_force(support) for support in line.sections[0].supports[1:5]]
    np.testing.assert_allclose(lateral, [-155.0, -522.0, -887.0, -1041.0], atol=3.0)


def sagging(space, wire, before, after):
    """A parabola in space under its weight between two points, share -> point."""
    chord = after - before
    depth = GRAVITY * wire.mass * float(chord @ chord) / (2.0 * wire.tension)
    return lambda share: before + share * chord - np.array([0.0, 0.0, depth * share * (1.0 - share)])


TRACKS = [
    TRANSITION,
    Track(positions=(50.0, 150.0), curvature=(0.0, -1e-3), cant=(0.0, -0.1)),
    Track(positions=(0.0,), curvature=(1 / 600,), cant=(0.15,)),
    Track(positions=(0.0,), curvature=(0.0,), cant=(0.15,)),
    Track(positions=(90.0, 90.0, 180.0, 180.0), vertical_curvature=(0.0, 1 / 3000, 1 / 3000, 0.0), cant=(0.1,) * 4),
    Track(positions=(20.0, 130.0, 130.0, 260.0), curvature=(0.0, 1e-3, -5e-4, 0.0), cant=(0.0, 0.03, 0.03, 0.0)),
    Track(positions=(40.0, 110.0, 170.0), cant=(0.0, 0.1, -0.05), vertical_curvature=(0.0, -3e-4, 0.0)),
]


@pytest.mark.parametrize("track", TRACKS)
def test_a_string_is_where_a_chord_in_space_is(short_line, track):
    """Held in space, hung under its weight, and turned back into the rail plane."""
    state, held = string(short_line, track)
    wire, space = short_line.contact_wire, CurvedSpace(track, 0.0, 300.0)
    xs = np.arange(0.0, 301.0, 50.0)
    points = space.points(xs, np.full(7, -0.2), np.full(7, 5.08))
    for i in range(6):
        curve = sagging(space, wire, points[i], points[i + 1])
        for x in xs[i] + np.array([12.5, 25.0, 37.5]):
            assert at(state, x) == pytest.approx(space.crossed(x, curve), abs=6e-4), x
    for i in range(1, 6):
        _, _, left, up = space.frame(xs[i])
        pulls = [(p - points[i]) / np.linalg.norm(p - points[i]) for p in (points[i - 1], points[i + 1])]
        weight = -GRAVITY * wire.mass * 50.0 * np.array([0.0, 0.0, 1.0])
        needed = -wire.tension * sum(pulls) - weight
        expected = np.array([needed @ left, needed @ up])
        np.testing.assert_allclose(reactions(state, held[i : i + 1])[0], expected, atol=0.6)


def with_track(line, **lists):
    return dataclasses.replace(line, track=Track(**lists))


def found(line):
    return find_form(line, build_mesh(line))


def contact_wire(state):
    return state.positions[state.shape.mesh.contact_chains()[0].nodes]


def test_ln2_in_a_curve_is_bowed_by_the_sagitta_of_its_spans(ln2):
    x, y, _ = contact_wire(found(with_track(ln2, positions=(0.0,), curvature=(1e-3,)))).T
    span = ln2.sections[0].spans[12]
    assert span.length == 49.5
    middle, start, end = np.interp([0.5 * (span.start + span.end), span.start, span.end], x, y)
    assert middle - 0.5 * (start + end) == pytest.approx(0.3063, rel=0.02)


def lateral_arm_forces(state):
    """Lateral force of every arm on the contact wire, left > 0 [N]."""
    end, node = state.shape.mesh.arms.T
    along = state.shape.points[end] - state.shape.points[node]
    return state.arm_force * along[:, 1] / np.linalg.norm(along, axis=1)


def test_the_lateral_force_of_a_constant_curve(line_maker):
    """T L / R."""
    line = line_maker(spans=8, stagger={"listed": [[0.2] * 7, "m", "x"], "anchor": [0.2, "m", "x"]})
    line = with_track(line, positions=(0.0,), curvature=(1e-3,))
    places = SupportPlaces(line, line.sections[0])
    assert places.lateral_force(line.sections[0].supports[4]) == pytest.approx(-1000.0, rel=5e-3)
    assert lateral_arm_forces(found(line))[3] == pytest.approx(-1000.0, rel=5e-3)


def mirrored(line):
    """The same line seen from the other end of the sleepers: left is right."""
    turned = {k: tuple(-v for v in getattr(line.track, k)) for k in ("curvature", "cant")}
    section = line.sections[0]
    supports = tuple(dataclasses.replace(s, stagger=-s.stagger) for s in section.supports)
    return dataclasses.replace(
        line,
        track=dataclasses.replace(line.track, **turned),
        sections=(dataclasses.replace(section, supports=supports),),
    )


def test_a_mirrored_line_is_the_mirror_image(line_maker):
    random = np.random.default_rng(5)
    line = line_maker(spans=4, mesh={"elements_between_droppers": 1})
    for _ in range(count(3, 20)):
        knots = tuple(np.sort(random.uniform(0.0, 200.0, 4)))
        curved = with_track(
            line,
            positions=knots,
            curvature=tuple(random.uniform(-6e-4, 6e-4, 4)),
            cant=tuple(random.uniform(-0.06, 0.06, 4)),
            vertical_curvature=tuple(random.uniform(-1e-4, 1e-4, 4)),
        )
        one, other = found(curved), found(mirrored(curved))
        np.testing.assert_allclose(other.positions, one.positions * [1.0, -1.0, 1.0], atol=1e-9)
        np.testing.assert_allclose(other.dropper_force, one.dropper_force, rtol=1e-9)
        np.testing.assert_allclose(other.arm_force, one.arm_force, rtol=1e-9)


@pytest.fixture(scope="module")
def canted(line_maker):
    """A line in a transition with cant, at rest; where its nodes are in space."""
    track = Track(positions=(60.0, 160.0, 240.0), curvature=(0.0, 8e-4, 2e-4), cant=(0.0, 0.1, 0.03))
    state = found(dataclasses.replace(line_maker(spans=6), track=track))
    space = CurvedSpace(track, -1.0, 301.0)
    return state, space, space.points(*state.positions.T)


def pulled(wire, chain, points, node):
    """Pull and weight in space of the six elements of a wire around a node [N]."""
    along = np.diff(points[chain], axis=0)
    length = np.linalg.norm(along, axis=1)
    pull = wire.tension * along / length[:, None]
    place = int(np.flatnonzero(chain == node)[0])
    a, b = place - 3, place + 3
    force = 0.5 * (pull[b] + pull[b - 1] - pull[a] - pull[a - 1])
    force[2] -= GRAVITY * wire.mass * length[a:b].sum()
    return force


def test_a_whole_line_is_in_equilibrium_in_space(canted):
    """Pieces of its wires around their droppers, mapped into space: pulls and weights.

    0.7 N are left beside the end of a ramp, which bends each wire with 100 to 130 N within one of its elements."""
    state, space, points = canted
    mesh, line = state.shape.mesh, state.shape.definition
    half = np.zeros(len(points))
    np.add.at(half, mesh.droppers.ravel(), 0.5 * line.dropper.mass * np.repeat(state.droppers.length, 2))
    for name in ("contact_wire", "messenger_wire"):
        chain = next(c.nodes for c in mesh.chains if c.component == name)
        for j, pair in enumerate(mesh.droppers):
            lower, upper = pair if name == "contact_wire" else pair[::-1]
            if not 60.0 < points[lower, 0] < 240.0 or abs(mesh.points[lower, 0] % 50.0 - 25.0) > 20.0:
                continue
            direction = points[upper] - points[lower]
            force = pulled(getattr(line, name), chain, points, lower)
            force += state.dropper_force[j] * direction / np.linalg.norm(direction)
            force[2] -= GRAVITY * (mesh.clamp_mass[lower] + half[lower])
            _, _, left, up = space.frame(mesh.points[lower, 0])
            assert abs(force @ left) < 0.7, (name, mesh.points[lower, 0], force @ left)
            assert abs(force @ up) < 0.7, (name, mesh.points[lower, 0], force @ up)


def test_an_arm_in_canted_track_lifts_by_its_angle_to_the_rail_plane(canted):
    """In space: what the contact wire around an arm pulls and weighs, and the arm with half of its weight."""
    state, space, points = canted
    mesh, line = state.shape.mesh, state.shape.definition
    chain = mesh.contact_chains()[0].nodes
    for (end, node), tension in zip(mesh.arms, state.arm_force, strict=True):
        if not 60.0 < mesh.points[node, 0] < 240.0:
            continue
        arm = points[end] - points[node]
        length = np.linalg.norm(arm)
        force = pulled(line.contact_wire, chain, points, node) + tension * arm / length
        force[2] -= GRAVITY * (0.5 * line.steady_arm.mass * length + mesh.clamp_mass[node])
        _, _, left, up = space.frame(mesh.points[node, 0])
        assert abs(arm @ up) / length == pytest.approx(np.sin(np.radians(10.0)), rel=2e-3)
        assert abs(force @ left) < 1.0
        assert abs(force @ up) < 1.0


def test_the_mean_curvature_between_two_places():
    """A ramp with a knot inside, and a jump that is inside, at one end, at the other."""
    track = Track(positions=(0.0, 100.0, 150.0, 150.0), curvature=(0.0, 0.002, 0.002, -0.001))
    assert mean_curvature(track, 50.0, 150.0) == pytest.approx((0.0015 * 50.0 + 0.002 * 50.0) / 100.0)
    assert mean_curvature(track, 140.0, 170.0) == pytest.approx(0.0)
    assert mean_curvature(track, 150.0, 200.0) == pytest.approx(-0.001)


def test_arms_that_lift_the_wire_off_its_droppers_are_told(line_maker):
    line = line_maker(stagger={"listed": [[-0.2] * 5, "m", "x"], "anchor": [-0.2, "m", "x"]})
    line = dataclasses.replace(line, track=Track(positions=(0.0,), curvature=(1 / 400,)))
    with pytest.raises(EquilibriumError, match="in a curve the steady arms pull harder and lift the wire"):
        find_form(line, build_mesh(line))
    flatter = dataclasses.replace(line, steady_arm=dataclasses.replace(line.steady_arm, angle=-0.02))
    assert find_form(flatter, build_mesh(flatter)).dropper_force.min() > 0.0
