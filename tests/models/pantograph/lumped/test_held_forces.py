"""Stops and dry friction of a lumped pantograph: laws, energy, rest, and what a run says of them."""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from models.definition_files.parameter import ParameterError
from models.definition_files.toml_reader import DefinitionError, Table
from models.library.catalogue import load_pantograph
from models.pantograph.lumped.lumped_definition import read_lumped
from models.pantograph.lumped.lumped_model import LumpedModel
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from tests.effort import rest
from tests.models.pantograph.multibody.mechanisms import LIBRARY

REST = np.zeros(2)
POINT = np.array([0.0, 0.0, 5.0])


@pytest.fixture(params=["numpy", "numba"])
def kernels(request, monkeypatch):
    if request.param == "numba":
        pytest.importorskip("numba")
    monkeypatch.setenv("OPENPANTO_KERNEL", request.param)


def made(friction=(0.0, 0.0, 0.0), **values):
    """Return CX with friction in its stages and other values; heights are written into the file."""
    table = Table.load(LIBRARY / "CX.toml")
    for key in ("lowest_height", "highest_height", "start_height"):
        if key in values:
            table.data[key] = [values.pop(key), "m", "test"]
    for stage, value in zip(table.data["stage"], friction, strict=True):
        stage["friction"] = [value, "N", "test"]
    return read_lumped(Table.from_dict(table.data, "CX.toml")).with_values({"speed": 50.0} | values)


def driven(definition, force, stop, step=1e-3, base=lambda _: REST):
    """Return the part after steps with the force of every step's end, and its motion and told sentences."""
    part = LumpedPantographPart(definition.with_values({"time_step": step}))
    part.initialise(0.0, force(0.0), POINT, base(0.0))
    rows, told = [], []
    for n in range(round(stop / step)):
        t = n * step
        point = np.array([definition.speed * (t + step), 0.0, 5.0])
        part.step(force(t + step), point, base(t), step)
        rows.append(part.state.displacement.copy())
        told += part.told
        part.told.clear()
    return part, np.array(rows), told


def swinging(t):
    return 168.0 + 150.0 * np.sin(9.0 * t)


@cache
def exact(definition, force, stop):
    """Return the displacements that another integration of the same laws gives, once for both kernels."""
    model, n = LumpedModel(definition), len(definition.stage)
    limit = np.array([s.friction for s in definition.stage])
    slip = np.array([s.friction / s.friction_slip for s in definition.stage])
    low, high = (h - definition.reference_height for h in definition.range)

    def stopped(x, v):
        k, c = definition.stop_stiffness, definition.stop_damping
        if x > high:
            return -max(0.0, k * (x - high) + c * v)
        return max(0.0, k * (low - x) - c * v) if x < low else 0.0

    def slope(t, u):
        y, v, q = u[:n], u[n : 2 * n], u[2 * n :]
        rate = np.diff(v, prepend=0.0)
        pull = np.clip(q, -limit, limit)
        load = -pull + np.append(pull[1:], 0.0)
        load[0] += definition.static_force * definition.raised(t) + stopped(y[0], v[0])
        load[-1] -= force(t)
        held = (np.abs(q) >= limit) & (q * rate > 0.0)
        return np.concatenate(
            [v, (load - model.K @ y - model.C @ v) / np.diag(model.M), np.where(held, 0.0, slip * rate)]
        )

    tight = {"method": "RK45", "rtol": 1e-8, "atol": 1e-10, "max_step": 2e-4}
    return solve_ivp(slope, (0.0, stop), np.zeros(3 * n), **tight).y[:n, -1]


@pytest.mark.usefixtures("kernels")
@pytest.mark.parametrize(
    ("definition", "share"),
    [
        (made(highest_height=5.03, raise_duration=0.0), 3e-3),
        (made(friction=(20.0, 8.0, 0.0), raise_duration=0.0, **{"stage[1].friction_slip": 1e-3}), 3e-3),
        *rest((made(lowest_height=4.99, raise_duration=0.0), 3e-3)),
    ],
)
def test_the_motion_is_that_of_the_laws(definition, share):
    wanted = exact(definition, swinging, 0.7)
    errors = [
        np.abs(driven(definition, swinging, 0.7, step)[0].state.displacement - wanted).max() for step in (2e-3, 5e-4)
    ]
    free = np.abs(driven(load_pantograph("CX").with_values({"raise_duration": 0.0}), swinging, 0.7)[1]).max()
    assert free > 0.02  # without stops and friction it goes elsewhere
    assert errors[1] < share * free
    assert errors[1] < 0.6 * errors[0]


def test_kernels_and_arrays_agree(monkeypatch):
    pytest.importorskip("numba")
    definition = made(friction=(15.0, 5.0, 2.0), highest_height=5.04, lowest_height=4.98)
    found = []
    for name in ("numpy", "numba"):
        monkeypatch.setenv("OPENPANTO_KERNEL", name)
        found.append(driven(definition, lambda t: 168.0 + 200.0 * np.sin(11.0 * t), 0.8)[1])
    assert found[0] == pytest.approx(found[1], abs=1e-12)
    assert np.ptp(found[0]) > 0.04


@pytest.mark.usefixtures("kernels")
def test_friction_holds_at_rest_and_gives_way_beyond_its_limit():
    """50 N less than the uplift move the strip, 10 N less do not: they bend the friction's spring, 20 N at 0.1 mm."""
    definition = made(friction=(20.0, 0.0, 0.0), raise_duration=1.0, **{"stage[2].damping": 200.0})
    _, held, _ = driven(definition, lambda t: 158.0 * min(1.0, t), 8.0, 2e-3)
    assert np.ptp(held[-100:, 0]) < 1e-10
    assert held[-1, 0] == pytest.approx(10.0 / (20.0 / 1e-4 + 178.45), rel=1e-4)
    _, moved, _ = driven(definition, lambda t: 118.0 * min(1.0, t), 4.0, 2e-3)
    assert moved[-1, 0] == pytest.approx((50.0 - 20.0) / 178.45, rel=0.05)


@pytest.mark.usefixtures("kernels")
def test_energy_balances_with_stops_and_friction():
    drifts = []
    for step in (1e-3, 5e-4):
        definition = made(friction=(15.0, 5.0, 0.0), highest_height=5.04, lowest_height=5.0, monitor_energy=1)
        part, _, _ = driven(definition, lambda t: 168.0 + 150.0 * np.sin(9.0 * t), 1.0, step)
        work, stored, dissipated, drift = part.energy
        assert dissipated > 1.0
        drifts.append(abs(drift) / max(work, stored, dissipated))
    assert drifts[0] < 1e-9


def swinging_roof(t):
    return np.array([0.02 * (1.0 - np.cos(5.0 * t)), 0.1 * np.sin(5.0 * t)])


@pytest.mark.parametrize("start_height", [5.02, 4.97])
@pytest.mark.parametrize("follow_height", [0, 1])
def test_a_moving_roof_works_against_stops_and_friction_and_a_start_elsewhere_stores_nothing(
    start_height, follow_height
):
    values = {"highest_height": 5.04, "lowest_height": 4.96, "start_height": start_height, "monitor_energy": 1}
    definition = made(friction=(15.0, 5.0, 0.0), follow_height=follow_height, **values)
    force = lambda t: 168.0 + 150.0 * np.sin(9.0 * t)  # noqa: E731
    part, _, told = driven(definition, force, 0.0, 1e-3, swinging_roof)
    assert np.all(np.abs(part.energy) < 1e-9)
    part, _, told = driven(definition, force, 1.0, 1e-3, swinging_roof)
    assert any("stop" in text for text in told)
    assert abs(part.energy[3]) < 1e-6 * part.energy[1]


@pytest.mark.usefixtures("kernels")
def test_a_state_goes_on_to_the_bit():
    definition = made(friction=(15.0, 5.0, 0.0), highest_height=5.03)

    def force(t):
        return 100.0 + 60.0 * np.sin(20.0 * t)

    part, rows, _ = driven(definition, force, 0.3)
    other = LumpedPantographPart(definition)
    other.initialise(0.0, 0.0, POINT, REST)
    other.restore(part.snapshot())
    for each in (part, other):
        each.step(50.0, POINT, REST, 1e-3)
    assert part.state.displacement.tolist() == other.state.displacement.tolist() != rows[-1].tolist()


def test_a_stop_stands_above_the_roof_and_goes_with_it():
    """The uplift rests on the stop's spring; with the roof 20 mm up, 20 mm higher."""
    definition = made(highest_height=5.03, raise_duration=0.0, follow_height=1)
    still, _, _ = driven(definition, lambda t: 0.0, 8.0, 2e-3)
    raised, _, _ = driven(definition, lambda t: 0.0, 8.0, 2e-3, base=lambda t: np.array([0.02, 0.0]))
    assert still.state.displacement[0] == pytest.approx(0.01 + 168.0 / 1e5, abs=3e-6)
    assert raised.state.displacement[0] == pytest.approx(0.03 + 168.0 / 1e5, abs=3e-6)


@pytest.mark.usefixtures("kernels")
def test_what_passes_its_limits_is_told_once_with_time_and_place():
    definition = made(lowest_height=4.7, highest_height=5.1, follow_height=1)
    _, _, told = driven(definition, lambda t: 0.0, 3.0)
    assert len(told) == 1
    assert told[0].startswith("t = ")
    assert "at its stop, highest_height, the strip at 5.09" in told[0]
    assert told[0].endswith("met no wire on the way")
    _, _, told = driven(definition, lambda t: 5000.0 * (0.05 < t < 0.15), 2.0)
    assert [("lowest_height" in text, "highest_height" in text) for text in told] == [(True, False), (False, True)]
    assert "drift" in told[1]


@pytest.mark.usefixtures("kernels")
def test_a_contact_outside_the_range_is_told():
    part = LumpedPantographPart(made(highest_height=5.1))
    part.initialise(0.0, 10.0, POINT, REST)
    for n in range(20):
        part.step(10.0, np.array([n * 0.05, 0.0, 5.2]), REST, 1e-3)
    (text,) = part.told
    assert "contact at a height of 5.200 m, outside the range of the pantograph, -inf to 5.100 m" in text


@pytest.mark.usefixtures("kernels")
@pytest.mark.parametrize("follow", [0, 1])
def test_it_is_raised_from_where_it_starts_and_rests_there_before(follow):
    definition = made(start_height=4.6, raise_start=0.5, follow_height=follow, raise_duration=2.0)
    part, rows, _ = driven(definition, lambda t: 0.0, 0.5)
    assert np.ptp(rows) < 1e-12
    assert part.strip[0, 0, 2] == pytest.approx(4.6, abs=1e-12)
    part, rows, _ = driven(definition, lambda t: 0.0, 3.0)
    assert np.all(np.diff(rows[500:, 0]) > 0.0)


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (
            {"lowest_height": 5.5, "highest_height": 5.2},
            "highest_height: 5.2 m is not above the lowest_height of 5.5 m",
        ),
        ({"lowest_height": 5.1}, "reference_height: 5.02 m is below the lowest_height of 5.1 m"),
        ({"lowest_height": 4.8, "start_height": 4.5}, "start_height: 4.5 m is below the lowest_height of 4.8 m"),
    ],
)
def test_heights_that_do_not_fit_are_refused(values, told):
    with pytest.raises((DefinitionError, ParameterError), match=told):
        made(**values)
