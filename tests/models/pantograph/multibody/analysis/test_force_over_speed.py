"""What the air adds to the static force, by the lifting element or on a body of its own."""

import numpy as np
import pytest

from models.commands.physics_main import main
from models.library.catalogue import load_pantograph
from models.library.force_laws import force_laws
from models.pantograph.lumped.lumped_part import LumpedPantographPart
from models.pantograph.lumped.lumped_rig import contact_force_over_height, contact_force_over_speed
from models.pantograph.multibody.analysis.mechanism_rig import Rig
from models.pantograph.multibody.analysis.mechanism_statics import contact_force_at
from models.pantograph.multibody.multibody_part import MultibodyPantographPart
from tests.models.pantograph.multibody.mechanisms import library, library_data, mechanism_from, q

SPEEDS = np.array([0.0, 30.0, 60.0])
SQUARES = SPEEDS**2
#: On an arm, off its centre of mass [m].
POINT = [0.3, 0.0, 0.1]


def with_wind(name, body, coefficient=0.01, **more):
    data = library_data(name)
    wind = {"kind": "aerodynamic", "body": body, "coefficient": q(coefficient, "N.s2/m2"), **more}
    data["force"]["wind"] = wind
    return mechanism_from(data)


def test_the_norm_and_the_published_uplift_are_those_printed_in_km_per_hour():
    target, uplift = force_laws()
    v = np.array([80.0, 200.0, 350.0])
    np.testing.assert_allclose(target.at(v / 3.6), 0.00097 * v**2 + 70.0, rtol=1e-12)
    np.testing.assert_allclose(uplift.at(v / 3.6), 0.00095 * v**2 + 0.0017 * v - 0.2, rtol=1e-12)


def test_a_following_reference_brings_all_of_it_to_the_strip_whatever_the_shares():
    given = load_pantograph("CX").with_values(
        {"follow_height": 1, "aerodynamic_uplift.leading": 0.02, "aerodynamic_uplift.trailing": 0.01}
    )
    found = contact_force_over_speed(given, SPEEDS)
    np.testing.assert_allclose(found, given.static_force + np.outer(SQUARES, [0.02, 0.01]), rtol=1e-12)


def test_on_the_roof_springs_take_their_share_of_it():
    """On a stiff wire, when all has settled: as the statics over height say, with the air's share added."""
    given = load_pantograph("CX").with_values({"aerodynamic_uplift.leading": 0.02, "raise_duration": 0.0})
    given = given.with_values({"speed": 50.0})
    found = contact_force_over_speed(given, np.array([0.0, 50.0]))[:, 0]
    part, force = LumpedPantographPart(given), 0.0
    part.initialise(0.0, 0.0, np.zeros(3), np.zeros(2))
    for _ in range(12000):
        strip = part.strip[0]
        force = max(0.0, 5e4 * (strip[0, 2] - given.reference_height) + 200.0 * strip[1, 2])
        part.step(force, np.zeros(3), np.zeros(2), 1e-3)
    at_rest, there = contact_force_over_height(given, np.array([given.reference_height, part.strip[0, 0, 2]]))
    assert found[0] == pytest.approx(at_rest)
    assert force == pytest.approx(there + found[1] - found[0], abs=1e-3)


def test_a_force_on_the_strip_is_all_felt_by_the_wire():
    strip = library("generic_multibody_cam").strip
    over = {"body": strip.body, "point": q([0.0, 0.0, strip.height], "m")}
    found = Rig(with_wind("generic_multibody_cam", over.pop("body"), **over)).over_speed(SPEEDS)
    np.testing.assert_allclose(found[:, 0] - found[0, 0], 0.01 * SQUARES, atol=1e-6)
    assert np.array_equal(found[:, 0], found[:, 1])


def test_a_force_on_an_arm_is_felt_as_its_point_rises_with_the_strip():
    """Virtual work: the rise of the point per rise of the strip, by differences of equilibria."""
    definition = library("generic_multibody_cam")
    lower = definition.lifting.body_j
    rig = Rig(
        with_wind("generic_multibody_cam", lower, 1e-3, point=q(POINT, "m"))
    )  # little: the suspension gives way under more
    felt = rig.over_speed(SPEEDS)[:, 0]
    mechanism, y, h = rig.mechanism, rig.reference, 1e-4
    above, body = mechanism.strip_height(y), mechanism.numbers[lower]
    moved = [contact_force_at(mechanism, above + d, definition.lift, start=y).y for d in (-h, h)]
    frames = [mechanism.kinematics(state).frames[body, :3] for state in moved]
    places = [mechanism.split(s).r[body] + frame @ np.array(POINT) for s, frame in zip(moved, frames, strict=True)]
    before, after = float(places[0][2]), float(places[1][2])
    share = (after - before) / (2.0 * h)
    assert 0.05 < share < 0.9
    np.testing.assert_allclose(felt - felt[0], 1e-3 * SQUARES * share, rtol=1e-3, atol=1e-9)


def test_the_air_pushes_while_the_train_runs():
    accelerations = []
    for speed in (0.0, 50.0):
        part = MultibodyPantographPart(with_wind("CX_multibody", "m3").with_values({"speed": speed}))
        part.initialise(0.0, 0.0, np.zeros(3), np.zeros(2))
        names = [name for name, _, _ in part.observed]
        accelerations.append(part.observation_values()[names.index("m3.az")])
    mass = next(b.mass for b in part.definition.bodies if b.name == "m3")
    assert accelerations[1] - accelerations[0] == pytest.approx(0.01 * 50.0**2 / mass, rel=1e-9)


def test_the_command_prints_and_draws_both_directions(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["pantograph", "CX", "--set", "pantograph.aerodynamic_uplift.trailing=0.01", "--out", str(out)]) == 0
    assert "Static contact force over the speed" in capsys.readouterr().out
    rows = np.loadtxt(out / "force_over_speed.csv", delimiter=",", skiprows=1)
    assert np.ptp(rows[:, 1]) == 0.0
    assert (np.diff(rows[:, 2]) > 0.0).all()
    np.testing.assert_allclose(rows[:, 3], 70.0 + 0.00097 * rows[:, 0] ** 2, rtol=1e-12)
    assert (out / "force_over_speed.png").stat().st_size > 1000
