"""The contact law, and a strip on a line that feels it."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from models.catenary.definition.line_definition import Contact
from models.catenary.line_model import CatenaryModel
from models.catenary.line_state import StripMotion
from models.contact_law import continuous_contact


def _strip(x, z, y=0.0, half=0.7, vz=0.0, skew=0.0):
    return np.array([[[x + skew, y + half, z], [80.0, 0.0, vz]], [[x - skew, y - half, z], [80.0, 0.0, vz]]])


def test_force_is_elastic_and_never_pulls():
    law = Contact(stiffness=20000.0)
    assert continuous_contact(0.01, -3.0, 0.5, law).force == pytest.approx(200.0)
    assert continuous_contact(-1e-9, 1.0, 0.5, law).force == 0.0
    inelastic = Contact(stiffness=20000.0, restitution=0.1)
    assert continuous_contact(0.001, -50.0, 0.1, inelastic).force == 0.0


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_slopes_are_derivatives(exponent):
    law = Contact(stiffness=5e4, exponent=exponent, restitution=0.6)
    at, h = (0.004, 0.2, 0.3), 1e-7
    value = continuous_contact(*at, law)
    ahead = continuous_contact(at[0] + h, at[1], at[2], law).force
    faster = continuous_contact(at[0], at[1] + h, at[2], law).force
    assert value.by_penetration == pytest.approx((ahead - value.force) / h, rel=1e-4)
    assert value.by_velocity == pytest.approx((faster - value.force) / h, rel=1e-4)


@pytest.mark.parametrize("restitution", [0.95, 0.9, 0.8])
def test_rebound_velocity_is_that_of_the_coefficient_of_restitution(restitution):
    """A mass thrown at a rigid wall; the law is derived for e near 1, where it must hold best."""
    law, mass, dt = Contact(stiffness=1e5, restitution=restitution), 5.0, 1e-6
    x, v, impact = 0.0, 0.4, 0.4
    for _ in range(10**6):
        force = continuous_contact(x, v, impact, law).force
        v -= force / mass * dt
        x += v * dt
        if x < 0.0:
            break
    assert v < 0.0
    assert -v / impact == pytest.approx(restitution, abs=0.4 * (1.0 - restitution))


@pytest.mark.parametrize("restitution", [0.999, 0.99])
def test_what_a_rebound_lacks_is_what_the_coefficient_says_the_nearer_to_1_the_better(restitution):
    """(1 - v'/v) / (1 - e) tends to 1: that is what 3/4 (1 - e^2) is chosen for."""
    law, mass, impact = Contact(stiffness=1e5, restitution=restitution), 5.0, 0.4

    def rate(_, state):
        return [state[1], -continuous_contact(max(state[0], 1e-300), state[1], impact, law).force / mass]

    def apart(_, state):
        return state[0]

    apart.terminal, apart.direction = True, -1.0
    found = solve_ivp(rate, (0.0, 0.1), [1e-12, impact], events=apart, rtol=1e-10, atol=1e-14)
    assert (1.0 + found.y[1, -1] / impact) / (1.0 - restitution) == pytest.approx(1.0, abs=2.0 * (1.0 - restitution))


@pytest.fixture(scope="module")
def model(short_line):
    return CatenaryModel(short_line)


def test_contact_point_follows_the_stagger(model):
    """At a support the wire is at its stagger, in the middle of a span near the track's centre."""
    state = model.initial_state()
    at_support = model.contact_at_rest(state, _strip(100.0, 6.0)[None]).point[0, 0]
    at_middle = model.contact_at_rest(state, _strip(125.0, 6.0)[None]).point[0, 0]
    assert abs(at_support[1]) == pytest.approx(0.2, abs=2e-3)
    assert at_middle[1] == pytest.approx(0.0, abs=2e-3)
    assert (at_support[0], at_middle[0]) == pytest.approx((100.0, 125.0), abs=1e-9)


def test_static_height_between_droppers_is_continuous_and_at_the_droppers_exact(model):
    state = model.initial_state()
    wanted = dict(zip(model.static.positions[model.mesh.droppers[:, 0], 0], model.mesh.target, strict=True))
    x = np.array(sorted(wanted))
    heights = [model.contact_at_rest(state, _strip(a, 6.0)[None]).point[0, 0, 2] for a in x]
    assert heights == pytest.approx([wanted[a] for a in x], abs=1e-7)
    fine = np.arange(100.0, 110.0, 0.01)
    z = np.array([model.contact_at_rest(state, _strip(a, 6.0)[None]).point[0, 0, 2] for a in fine])
    assert np.abs(np.diff(z)).max() < 2e-4


@pytest.mark.parametrize(("offset", "touches"), [(0.0, True), (0.49, True), (0.51, False), (-0.91, False)])
def test_no_contact_beyond_the_strips_ends(model, offset, touches):
    """The wire stands at 0.2 m at this support; a strip of +-0.7 m reaches it up to an offset of 0.9 / -0.5 m."""
    state = model.initial_state()
    side = np.sign(model.contact_at_rest(state, _strip(100.0, 6.0)[None]).point[0, 0, 1])
    result = model.contact_at_rest(state, _strip(100.0, 5.2, y=-side * offset)[None])
    assert (result.force[0, 0] > 0.0) == touches


def test_no_contact_beyond_the_ends_of_the_line(model):
    state = model.initial_state()
    for x in (-5.0, 305.0):
        result = model.contact_at_rest(state, _strip(x, 9.0)[None])
        assert result.force[0, 0] == 0.0
        assert np.isnan(result.point[0, 0]).all()


def test_contact_is_lost_and_found_again(model):
    """A strip that dips below the wire for 20 ms: no force then, force before and after."""
    state = model.initial_state()
    z0 = float(model.contact_at_rest(state, _strip(120.0, 6.0)[None]).point[0, 0, 2])
    forces = []
    for n in range(60):
        height = z0 + (0.006 if n < 20 or n >= 40 else -0.05)
        motion = StripMotion(_strip(120.0 + 0.08 * n, height)[None], np.zeros(1))
        forces.append(model.step(state, 1e-3, motion).force[0, 0])
    assert min(forces[5:20]) > 10.0
    assert max(forces[21:40]) == 0.0
    assert min(forces[45:]) > 1.0


def _rolling(x, z, vz, axis, roll_rate):
    """A level strip that rises with ``vz`` where y is ``axis`` and rolls about that point."""
    return np.array([[[x, y, z], [80.0, 0.0, vz + roll_rate * (y - axis)]] for y in (0.7, -0.7)])


@pytest.mark.parametrize("roll_rate", [-2.0, 1.5])
def test_a_strip_that_rolls_about_the_contact_presses_like_one_that_does_not(short_line, roll_rate):
    """The law's velocity is that of the strip where the wire lies on it, 0.2 m beside its middle, not of its ends."""
    lossy = CatenaryModel(short_line.with_values({"contact.restitution": 0.6}))
    forces = []
    for rate in (0.0, roll_rate):
        state, record = lossy.initial_state(), []
        axis = float(lossy.contact_at_rest(state, _strip(100.0, 6.0)[None]).point[0, 0, 1])
        assert abs(axis) > 0.19
        z0 = float(lossy.contact_at_rest(state, _strip(100.0, 6.0)[None]).point[0, 0, 2])
        for n in range(1, 16):
            strip = _rolling(100.0, z0 + 0.1 * n * 1e-3, 0.1, axis, rate)
            result = lossy.step(state, 1e-3, StripMotion(strip[None], np.zeros(1)))
            record.append(float(result.force[0, 0]))
            axis = float(result.point[0, 0, 1])
        forces.append(np.array(record))
    still, rolling = forces
    assert still.min() > 0.0
    assert np.abs(rolling - still).max() < 2e-3 * still.max()


def test_contact_at_rest_knows_how_a_strip_rolls(short_line):
    """A strip that leaves the wire at the contact, though one end rises, does not press against a lossy law."""
    lossy = CatenaryModel(short_line.with_values({"contact.restitution": 0.6}))
    state = lossy.initial_state()
    at = lossy.contact_at_rest(state, _strip(100.0, 6.0)[None]).point[0, 0]
    pressed = float(at[2]) + 2e-3
    law = lossy.definition.contact
    for roll_rate in (-3.0, 3.0):
        approaching = lossy.contact_at_rest(state, _rolling(100.0, pressed, 0.05, at[1], roll_rate)[None])
        leaving = lossy.contact_at_rest(state, _rolling(100.0, pressed, -0.05, at[1], roll_rate)[None])
        # At its first instant the velocity is that of the impact: 1 + 3/4 (1 - e^2) times the elastic force.
        assert approaching.force[0, 0] == pytest.approx(law.stiffness * 2e-3 * (1.0 + 0.75 * 0.64), rel=1e-6)
        assert leaving.force[0, 0] == 0.0


def test_a_tilted_strip_presses_with_its_height_at_the_contact(model):
    """Ends 2 cm apart in height: the penetration is that of the point on the strip where the wire crosses it."""
    state = model.initial_state()
    level = _strip(100.0, 6.0)
    x, y, z = model.contact_at_rest(state, level[None]).point[0, 0]
    tilted = level.copy()
    tilted[:, 0, 2] = [z + 3e-3 + 0.01 / 0.7 * (end - y) for end in (0.7, -0.7)]
    found = model.contact_at_rest(state, tilted[None])
    assert found.force[0, 0] == pytest.approx(model.definition.contact.stiffness * 3e-3, rel=1e-6)
    assert x == pytest.approx(100.0)


def test_radii_of_wire_and_strip_keep_their_axes_apart(short_line):
    """A round wire on a round strip: as much penetration as the plain one where the strip is lower by both radii."""
    plain = CatenaryModel(short_line)
    thick = CatenaryModel(short_line.with_values({"contact.wire_radius": 6e-3, "contact.strip_radius": 0.1}))
    z = float(plain.contact_at_rest(plain.initial_state(), _strip(100.0, 6.0)[None]).point[0, 0, 2])
    bare = plain.contact_at_rest(plain.initial_state(), _strip(100.0, z + 4e-3)[None]).force[0, 0]
    round_one = thick.contact_at_rest(thick.initial_state(), _strip(100.0, z + 4e-3 - 0.106)[None]).force[0, 0]
    assert bare > 50.0
    assert round_one == pytest.approx(bare, rel=1e-6)


@pytest.mark.parametrize("kernel", ["numpy", "auto"])
def test_a_contact_keeps_the_velocity_of_its_impact_until_it_opens(short_line, kernel, monkeypatch):
    """Two strokes against the wire, the second twice as fast; each is lossy by its own first velocity [2.47]."""
    monkeypatch.setenv("OPENPANTO_KERNEL", kernel)
    lossy = CatenaryModel(short_line.with_values({"contact.restitution": 0.6}))
    law, state, dt = lossy.definition.contact, lossy.initial_state(), 1e-3
    z0 = float(lossy.contact_at_rest(state, _strip(120.0, 6.0)[None]).point[0, 0, 2])
    z, impact, impacts, closed = z0 - 2e-4, None, [], 0
    for n in range(60):
        speed = 0.2 * np.cos(2.0 * np.pi * n / 30.0) * (1.0 if n < 30 else 2.0)
        z += speed * dt
        result = lossy.step(state, dt, StripMotion(_strip(120.0, z, vz=speed)[None], np.zeros(1)))
        force = float(result.force[0, 0])
        if not state.impact_velocity[0, 0]:
            impact = None
            continue
        depth, rate = _penetration(lossy, state, z, speed)
        if impact is None:
            impact = rate
            impacts.append(rate)
        closed += 1
        factor = 1.0 + 0.75 * (1.0 - 0.36) * rate / impact
        assert force == pytest.approx(law.stiffness * depth * max(factor, 0.0), rel=1e-4, abs=1e-6)
    assert closed > 15
    assert len(impacts) == 2
    assert impacts[1] > 1.3 * impacts[0]


def _penetration(model, state, z, speed):
    """Depth and velocity of the only contact, from where the wire is and how it moves."""
    ((_, element),), ((xi, _),) = state.loaded.tolist(), state.load.tolist()
    interval = model.wires[0].interval(element)
    row, height = interval.lift(element, xi)
    rise, rate = (float(moved @ row) for moved in interval.local(state.motion))
    return z - (height + rise), speed - rate


def test_uplift_and_point_of_contact_move_with_the_wire(model):
    """A force at a support for a while: the rise there by the nodes' own displacement, and a strip that finds it."""
    state = model.initial_state()
    for _ in range(40):
        model.push(state, 1e-3, [(0, 100.0, 200.0)])
    nodal = model.displacement(state)[model.mesh.support_nodes]
    lifted = model.uplift(state)
    assert lifted == pytest.approx(nodal[:, 2])
    assert int(np.argmax(lifted)) == int(np.argmin(np.abs(model.mesh.points[model.mesh.support_nodes, 0] - 100.0)))
    assert lifted.max() > 0.01
    assert abs(nodal[:, 1]).max() > 1e-6
    rest = model.contact_at_rest(model.initial_state(), _strip(100.0, 6.0)[None]).point[0, 0]
    moved = model.contact_at_rest(state, _strip(100.0, 6.0)[None]).point[0, 0]
    assert moved[2] - rest[2] == pytest.approx(lifted.max(), abs=1e-5)


def test_a_strip_at_rest_presses_with_a_share_where_the_wire_lies_near_its_end(model):
    """2 cm from the end of the strip: two fifths of the law, whose edge is 5 cm wide."""
    state = model.initial_state()
    at = model.contact_at_rest(state, _strip(100.0, 6.0)[None]).point[0, 0]
    found = model.contact_at_rest(state, _strip(100.0, at[2] + 4e-3, y=at[1] - 0.7 + 0.02)[None])
    assert found.force[0, 0] == pytest.approx(0.4 * model.definition.contact.stiffness * 4e-3, rel=1e-6)
