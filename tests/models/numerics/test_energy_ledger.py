"""Energy balances: exact for each part, of the order of the extrapolation for their coupling, and hard to deceive."""

import dataclasses

import numpy as np
import pytest

from models.catenary.line_part import CatenaryPart
from models.library.catalogue import load_line
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from tests.effort import rest

BASE, NOWHERE = np.zeros(2), np.array([[[[50.0, y, -50.0], [0.0, 0.0, 0.0]] for y in (0.7, -0.7)]])
WATCHED = {"monitor_energy": 1}


@pytest.fixture(params=["numpy", "numba"])
def kernel(request, monkeypatch):
    if request.param == "numba":
        pytest.importorskip("numba")
    monkeypatch.setenv("OPENPANTO_KERNEL", request.param)


def shaken(definition, size):
    """Return a line that moves at random, without contact."""
    part = CatenaryPart(definition.with_values(WATCHED))
    part.initialise(0.0, NOWHERE)
    rng = np.random.default_rng(1)
    part.model.set_velocity(part.state, size * rng.standard_normal(part.model.mesh.fixed.shape))
    return part, part.model.energy(part.state)


def coupled(line, cx, **values):
    """Return a line and a pantograph under it, both watched."""
    settings = WATCHED | values
    own = ("static_force", "start_position")
    catenary = CatenaryPart(line.with_values({k: v for k, v in settings.items() if k not in own}))
    return catenary, raised_under(catenary, cx.with_values({"start_position": 60.0} | settings))


def raised_under(catenary, definition):
    """Return a pantograph that begins with a line."""
    pantograph = LumpedPantographPart(definition.with_values({"raise_duration": 0.05}))
    pantograph.initialise(0.0, 0.0, np.zeros(3), BASE)
    catenary.initialise(0.0, pantograph.strip[None])
    return pantograph


def go(catenary, pantograph, stop, step=1e-3):
    """Step both side by side; returns the work exchanged and the most slack droppers."""
    exchanged, slack = 0.0, 0
    for _ in range(round(stop / step)):
        force, point, strip = catenary.contact_force[0], catenary.contact_point[0].copy(), pantograph.strip.copy()
        catenary.step(strip[None], step)
        pantograph.step(force, point, BASE, step)
        exchanged += abs(force * strip[0, 1, 2]) * step
        slack = max(slack, catenary.state.slack.size)
    return exchanged, slack


@pytest.mark.parametrize("law", ["tension", "elastic_only"])
@pytest.mark.parametrize("alpha", [0.0, 1e-3])
def test_a_line_left_to_itself_loses_what_its_dampers_take(line_maker, kernel, alpha, law):
    """Droppers slacken; what they then do not carry belongs to the line."""
    part, given = shaken(with_law(line_maker(spans=4, alpha=alpha), law), 0.2 if law == "tension" else 0.05)
    slack = 0
    for _ in range(300):
        part.step(NOWHERE, 1e-3)
        slack = max(slack, part.state.slack.size)
    stored, dissipated, work, drift = part.energy
    assert slack > 0
    assert work == 0.0
    assert dissipated > 0.01 * given if alpha else dissipated == 0.0
    assert drift - given == pytest.approx(0.0, abs=1e-10 * given)  # it was given before the first step
    assert stored > 0.0


def with_law(line, law):
    """Return a line whose droppers slacken by a law."""
    return dataclasses.replace(line, dropper=dataclasses.replace(line.dropper, slack_law=law))


@pytest.mark.parametrize(
    ("law", "damping"),
    [
        ("tension", (0.0272, 0.0)),
        ("elastic_only", (0.003, 0.4)),
        *rest(("tension", (0.003, 0.4)), ("elastic_only", (0.0272, 0.0))),
    ],
)
def test_a_line_under_a_strip_keeps_its_balance(line_maker, cx, kernel, damping, law):
    alpha, beta = damping
    table = {"alpha": [alpha, "s", "test"], "beta": [beta, "1/s", "test"]}
    line = with_law(line_maker(spans=5, damping=table), law)
    catenary, pantograph = coupled(line, cx, static_force=250.0)
    _, slack = go(catenary, pantograph, 1.2)
    _, dissipated, work, drift = catenary.energy
    assert slack > 0
    assert work > 10.0
    assert dissipated > 5.0
    assert abs(drift) < 1e-11 * work


def test_slack_droppers_take_energy_as_their_law_has_it(line_maker):
    """Only droppers are damped, and all that is lost is what they absorb beyond what their springs hold."""
    damping = {
        "alpha": [0.0, "s", "test"], "beta": [0.0, "1/s", "test"],
        "dropper": {"alpha": [2e-3, "s", "test"], "beta": [0.0, "1/s", "test"]},
    }  # fmt: skip
    lost = {}
    for law in ("tension", "elastic_only"):
        part, _ = shaken(with_law(line_maker(spans=4, damping=damping), law), 0.2)
        part.step(NOWHERE, 2.5e-4)  # the velocities came out of nothing, and with them what dampers carry
        model, state = part.model, part.state
        lost[law], absorbed, slack = [part.energy[1]], 0.0, 0
        before = _absorbed(model, state)
        for _ in range(200):
            part.step(NOWHERE, 2.5e-4)
            now = _absorbed(model, state)
            absorbed += 0.5 * float((before[0] + now[0]) @ (now[1] - before[1]))
            before = now
            lost[law].append(part.energy[1])
            slack = max(slack, state.slack.size)
        assert slack >= 3
        assert lost[law][-1] - lost[law][0] == pytest.approx(absorbed, rel=1e-9)
        assert np.diff(lost[law]).min() > -1e-9 * lost[law][-1]
    assert lost["tension"][-1] != pytest.approx(lost["elastic_only"][-1], rel=1e-3)


def _absorbed(model, state):
    """Return what droppers carry beyond max(0, k e), and their elongation."""
    elongation, rate = (model.dropper_law.B @ motion for motion in state.motion.attached)
    spring = model.static.elastic_force + model.dropper_law.stiffness * elongation
    damper = model.definition.damping.dropper.alpha * model.dropper_law.stiffness * rate
    together = model.definition.dropper.slack_law == "tension"
    carried = np.maximum(spring + damper, 0.0) if together else np.maximum(spring, 0.0) + damper
    return carried - np.maximum(spring, 0.0), elongation


def test_forces_on_two_wires_are_each_counted(cx):
    catenary = CatenaryPart(load_line("LN2_overlap").with_values(WATCHED))
    first, second = catenary.model.wires
    middle = 0.5 * (first.ends[1] + second.ends[0])
    pantograph = raised_under(catenary, cx.with_values(WATCHED | {"start_position": middle - 50.0}))
    shared, exchanged = 0, 0.0
    for _ in range(100):
        exchanged += go(catenary, pantograph, 0.01)[0]
        shared += np.all(catenary.section_force > 0.0)
    assert shared > 0
    assert abs(catenary.energy[3]) < 1e-11 * catenary.energy[2]
    assert catenary.contact_work == pytest.approx(pantograph.contact_work, abs=1e-3 * exchanged)


def test_a_pantograph_keeps_its_balance(cx):
    """Under a force that jumps, on a roof that moves, in steps of changing length."""
    part = LumpedPantographPart(cx.with_values(WATCHED))
    part.initialise(0.0, 0.0, np.zeros(3), BASE)
    rng = np.random.default_rng(2)
    for n in range(3000):
        force = 150.0 + 40.0 * rng.standard_normal()
        part.step(force, np.zeros(3), np.array([0.01 * np.sin(0.02 * n), 0.0]), 1e-3 if n % 3 else 2.5e-3)
    _, dissipated, work, drift = part.energy
    assert work > 10.0
    assert dissipated > 10.0
    assert abs(drift) < 1e-10 * work


@pytest.mark.parametrize(("order", "expected"), [(2, 2.6), *rest((0, 0.8), (1, 1.7))])
def test_what_the_coupling_makes_up_falls_with_the_order_of_the_extrapolation(line_maker, cx, order, expected):
    """Held inputs: first order in the step; the parts themselves are exact all the same."""
    made_up = []
    for step in (1e-3, 5e-4):
        catenary, pantograph = coupled(line_maker(spans=5), cx, extrapolation_order=order, time_step=step)
        go(catenary, pantograph, 1.2, step)
        made_up.append(abs(float(catenary.contact_work[0] - pantograph.contact_work[0])))
        assert abs(catenary.energy[3]) < 1e-11 * catenary.energy[2]
    assert np.log2(made_up[0] / made_up[1]) > expected


def test_velocities_that_no_force_has_changed_are_found_out(line_maker, cx):
    catenary, pantograph = coupled(line_maker(spans=5), cx)
    go(catenary, pantograph, 0.6)
    motion = catenary.state.motion
    before = catenary.energy[0]
    modal, momentum = motion.plain()
    for array in (modal[1], motion.attached[1], momentum):
        array *= 1.001
    added = catenary.energy[0] - before
    go(catenary, pantograph, 0.4)
    assert added > 1e-6 * catenary.energy[2]
    assert catenary.energy[3] == pytest.approx(added, rel=1e-6)
    pantograph.state.velocity = 1.001 * pantograph.state.velocity
    go(catenary, pantograph, 0.2)
    assert abs(pantograph.energy[3]) > 1e-6 * pantograph.energy[2]


def test_a_balance_goes_on_from_a_snapshot(line_maker, cx):
    line = line_maker(spans=5)
    first = coupled(line, cx)
    go(*first, 0.5)
    second = coupled(line, cx)
    for old, new in zip(first, second, strict=True):
        new.restore(old.snapshot())
    for pair in (first, second):
        go(*pair, 0.2)
    for old, new in zip(first, second, strict=True):
        assert np.array_equal(old.energy, new.energy)
        assert np.array_equal(old.contact_work, new.contact_work)


def test_watching_changes_nothing(line_maker, cx):
    """And where nobody watches, there is nothing to see."""
    pairs = [coupled(line_maker(spans=5), cx, monitor_energy=k) for k in (0, 1)]
    for pair in pairs:
        go(*pair, 0.4)
    for plain, watched in zip(*pairs, strict=True):
        kept = watched.snapshot()
        assert all(np.array_equal(value, kept[name]) for name, value in plain.snapshot().items())
        assert not plain.energy.any()
        assert not plain.contact_work.any()
