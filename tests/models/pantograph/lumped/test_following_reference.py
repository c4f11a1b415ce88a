"""The lowest spring on a reference that follows the height: statics, ramps, response, order, energy; and the air."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from models.definition_files.parameter import ParameterError
from models.definition_files.toml_reader import DefinitionError, Table
from models.library.catalogue import load_pantograph
from models.pantograph.lumped import lumped_rig
from models.pantograph.lumped.following_reference import FollowingReference
from models.pantograph.lumped.lumped_definition import read_lumped
from models.pantograph.lumped.lumped_model import LumpedModel
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from models.pantograph.operation import Drive
from tests.models.pantograph.multibody.mechanisms import LIBRARY

REST = np.zeros(2)
FREQUENCY = np.array([0.5, 1.0, 1.67, 3.0])


def following(**values):
    return load_pantograph("CX").with_values({"follow_height": 1} | values)


@pytest.fixture(params=["numpy", "numba"], autouse=True)
def kernels(request, monkeypatch):
    if request.param == "numba":
        pytest.importorskip("numba")
    monkeypatch.setenv("OPENPANTO_KERNEL", request.param)


def pressed(definition, rise, rate=0.0, drive=Drive(), stop=8.0, step=2e-3):  # noqa: B008 - a tuple
    """Return the settled force on a stiff wire that lies ``rise`` above the strip's start and climbs."""
    part = LumpedPantographPart(definition.with_values({"extrapolation_order": 1, "time_step": step}))
    part.initialise(0.0, 0.0, np.zeros(3), REST, drive)
    forces = []
    for n in range(round(stop / step)):
        t = n * step
        force = max(0.0, 2e4 * (part.strip[0, 0, 2] - definition.reference_height - rise - rate * t))
        part.step(force, np.array([definition.speed * t, 0.0, 5.0]), REST, step, drive)
        forces.append(force)
    return forces[-1]


@pytest.mark.parametrize("rise", [0.05, 0.6])
def test_at_rest_the_force_is_the_static_force_at_every_height(rise):
    assert pressed(following(), rise) == pytest.approx(168.0, abs=1e-4)
    fixed = pressed(load_pantograph("CX"), rise)
    height = np.array([5.02 + rise + fixed / 2e4])
    assert fixed == pytest.approx(lumped_rig.contact_force_over_height(load_pantograph("CX"), height)[0], abs=1e-3)


@pytest.mark.parametrize(("given", "less"), [(0.0, 178.45 * 0.5 + 108.39), (0.1, 108.39)])
def test_on_a_ramp_the_reference_lags_unless_it_is_told(given, less):
    """By hand: F = F_static - (k1 T + c1) dz/dt, and without the first part if the rate is known."""
    found = pressed(following(), 0.1, rate=0.1, drive=Drive(reference_rate=given))
    assert found == pytest.approx(168.0 - less * 0.1, abs=1e-3)


def test_apparent_mass_is_the_published_one():
    """Of an independent model, rounded to three digits: fixed and following, T 0.5 s."""
    fixed = [1.835 - 33.422j, 15.298 - 18.955j, 18.874 - 15.683j, 13.152 - 25.811j]
    held = [5.625 - 42.112j, 15.298 - 20.456j, 18.696 - 16.095j, 12.968 - 25.739j]
    assert lumped_rig.apparent_mass(load_pantograph("CX"), FREQUENCY) == pytest.approx(np.array(fixed), abs=6e-4)
    assert lumped_rig.apparent_mass(following(), FREQUENCY) == pytest.approx(np.array(held), abs=6e-4)


def test_modes_gain_one_at_rest_at_any_height():
    found = lumped_rig.modes(following())
    assert (found[0].frequency, found[0].damping) == (0.0, 0.0)
    assert found[-1].frequency == pytest.approx(lumped_rig.modes(load_pantograph("CX"))[-1].frequency, rel=1e-3)


def test_the_models_are_alike_above_the_frequency_that_is_told():
    limit = lumped_rig.alike_from(following())
    frequency = np.array([limit * 1.01, limit * 0.97])
    ratio = np.abs(lumped_rig.apparent_mass(following(), frequency))
    ratio /= np.abs(lumped_rig.apparent_mass(load_pantograph("CX"), frequency))
    assert abs(ratio[0] - 1.0) < 0.02 < abs(ratio[1] - 1.0)
    assert 1.0 < limit < 2.0  # from the printed figures: 5 % at 1 Hz, 1 % at 1.67 Hz


def exact(definition, stop, force, roof):
    """Return displacements and reference of the continuous equations, integrated by another method."""
    model, d = LumpedModel(definition), definition
    k, c = d.stage[0].stiffness, d.stage[0].damping
    K = model.K.copy()
    K[0, 0] -= k

    def slope(t, u):
        z, vz = roof(t)
        y, v, r = u[:3], u[3:6], u[6]
        load = np.array([d.static_force * d.raised(t) - k * (y[0] - z - r) + c * vz, 0.0, -force(t)])
        a = np.linalg.solve(model.M, load - K @ y - model.C @ v)
        return np.concatenate([v, a, [0.02 + (y[0] - z - r) / d.reference_time]])

    tight = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13, "max_step": 0.01}
    return solve_ivp(slope, (0.0, stop), np.zeros(7), **tight).y[:, -1]


def test_the_step_is_of_second_order_and_the_reference_with_it():
    definition = following(raise_duration=0.0, static_force=168.0, extrapolation_order=2)
    force, roof = (lambda t: 150.0 + 40.0 * np.sin(7.0 * t)), (lambda t: (0.0, 0.0))
    wanted = exact(definition, 1.0, force, roof)
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        part = LumpedPantographPart(definition.with_values({"time_step": step}))
        part.initialise(0.0, force(0.0), np.zeros(3), REST, Drive(reference_rate=0.02))
        for n in range(round(1.0 / step)):
            t = n * step
            point = np.array([definition.speed * (t + step), 0.0, 5.0])  # the force of the step's end
            part.step(force(t + step), point, REST, step, Drive(reference_rate=0.02))
        errors.append(np.abs([*(part.state.displacement - wanted[:3]), part.state.reference - wanted[6]]).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.15)


def test_a_roof_that_moves_takes_the_reference_along():
    """The whole pantograph rises with a roof that rises slowly: the force on a rigid bar that rises with it stays."""
    part = LumpedPantographPart(following(raise_duration=0.0))
    part.initialise(0.0, 168.0, np.zeros(3), np.array([0.3, 0.0]))
    for n in range(200):
        part.step(168.0, np.array([part.definition.speed * n * 1e-3, 0.0, 5.0]), np.array([0.3, 0.0]), 1e-3)
    still = LumpedPantographPart(following(raise_duration=0.0))
    still.initialise(0.0, 168.0, np.zeros(3), REST)
    for n in range(200):
        still.step(168.0, np.array([part.definition.speed * n * 1e-3, 0.0, 5.0]), REST, 1e-3)
    assert part.strip[0, 0, 2] == pytest.approx(still.strip[0, 0, 2], abs=1e-12)


def run(step, stop=0.6, **values):
    definition = following(monitor_energy=1, time_step=step, **values)
    part = LumpedPantographPart(definition)
    part.initialise(0.0, 150.0, np.zeros(3), REST)
    for n in range(round(stop / step)):
        t = n * step
        base = 0.01 * np.array([1.0 - np.cos(6.0 * t), 6.0 * np.sin(6.0 * t)])
        drive = Drive(reference_rate=0.05 * np.sin(3.0 * t), uplift=10.0 * np.sin(20.0 * t))
        part.step(150.0 + 40.0 * np.sin(8.0 * t), np.array([definition.speed * t, 0.0, 5.0]), base, step, drive)
    return part.energy


def test_energy_balances_with_what_the_reference_stores_and_takes():
    coarse, fine = (run(step)[3] for step in (1e-3, 5e-4))
    scale = np.abs(run(1e-3)).max()
    assert scale > 1.0
    assert abs(coarse) < 2e-5 * scale
    assert abs(fine) < abs(coarse) / 1.8


def test_a_state_goes_on_to_the_bit():
    first, second = (LumpedPantographPart(following()) for _ in range(2))
    for part, count in ((first, 50), (second, 7)):
        part.initialise(0.0, 0.0, np.zeros(3), REST)
        for n in range(count):
            part.step(100.0, np.array([part.definition.speed * n * 1e-3, 0.0, 5.0]), REST, 1e-3)
    second.restore(first.snapshot())
    for part in (first, second):
        for n in range(50, 80):
            part.step(120.0, np.array([part.definition.speed * n * 1e-3, 0.0, 5.0]), REST, 1e-3)
    assert np.array_equal(first.outputs, second.outputs)


@pytest.mark.parametrize("x", [2e-3, 9.9e-4, 1.01e-3, 2.0])
def test_coefficients_integrate_a_linear_motion(x):
    f = FollowingReference.within(x * 0.5, 0.5)
    w0, slope, r0, u = 0.2, -0.3, 0.15, 0.04
    found = solve_ivp(lambda t, r: u + (w0 + slope * t - r) / 0.5, (0.0, x * 0.5), [r0], rtol=1e-12, atol=1e-14)
    assert f.moved(r0, w0, w0 + slope * x * 0.5, u) == pytest.approx(found.y[0, -1], abs=1e-11)
    grid = np.linspace(0.0, x * 0.5, 20001)
    settled = 0.5 * (slope - u)
    stretch = settled + (w0 - r0 - settled) * np.exp(-grid / 0.5)
    first, second = f.integrals(w0 - r0, slope, u, x * 0.5)
    assert first == pytest.approx(np.trapezoid(stretch, grid), rel=1e-7)
    assert second == pytest.approx(np.trapezoid(stretch**2, grid), rel=1e-7)


@pytest.mark.parametrize("share", [(1.0, 0.0, 0.0), (0.2, 0.3, 0.5)])
def test_air_lifts_by_the_square_of_the_speed_wherever_it_acts(share):
    data = Table.load(LIBRARY / "CX.toml").data
    data = data | {
        "aerodynamic_uplift": [[0.012, 0.02], "N.s2/m2", "test"],
        "aerodynamic_share": [list(share), "1", "test"],
    }
    definition = read_lumped(Table.from_dict(data)).with_values({"follow_height": 1, "speed": 60.0})
    assert pressed(definition, 0.1, stop=6.0) == pytest.approx(168.0 + 0.012 * 60.0**2, abs=1e-3)
    gust = Drive(air=10.0)
    assert pressed(definition, 0.1, drive=gust, stop=6.0) == pytest.approx(168.0 + 0.012 * 50.0**2, abs=1e-3)
    back = definition.with_values({"direction": -1})
    assert back.aerodynamic_force(0.0) == pytest.approx(0.02 * 3600.0)
    assert back.aerodynamic_force(80.0) == pytest.approx(-0.02 * 400.0)


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("aerodynamic_share", [[0.5, 0.5], "1", "test"], "aerodynamic_share: has 2 values for 3 stages"),
        ("aerodynamic_share", [[0.5, 0.5, 0.5], "1", "test"], "aerodynamic_share: sums to 1.5, not to 1"),
        ("reference_time", [0.01, "s", "test"], r"reference_time: 0\.01 s is outside 0\.05 \.\.\. 100 s"),
        ("knuckle", "behind", "'behind' is none of leading, trailing"),
        ("follow_height", 2, r"follow_height: 2 is outside 0 \.\.\. 1"),
    ],
)
def test_what_cannot_be_meant(key, value, told):
    with pytest.raises(DefinitionError, match=told):
        read_lumped(Table.from_dict(Table.load(LIBRARY / "CX.toml").data | {key: value}))


def test_a_direction_is_one_of_two():
    with pytest.raises(ParameterError, match="direction: 0 is neither 1"):
        load_pantograph("CX").with_values({"direction": 0})
