"""Cams: the constant-force one against its published moments, tables, stops, where the arms stand."""

from dataclasses import replace

import numpy as np
import pytest

from models.definition_files.toml_reader import DefinitionError
from models.numerics.cubic_curve import CubicCurve
from models.pantograph.multibody.analysis import cam_design
from models.pantograph.multibody.analysis.cam_design import stand
from models.pantograph.multibody.analysis.mechanism_rig import Rig
from models.pantograph.multibody.analysis.mechanism_statics import contact_force_at, equilibrium_where
from models.pantograph.multibody.analysis.posture import take_posture
from models.pantograph.multibody.last_found import OF_A_RUN, LastFound
from models.pantograph.multibody.mechanism import Inputs, Mechanism, MechanismError
from models.pantograph.multibody.multibody_part import MultibodyPantographPart
from models.pantograph.operation import Drive
from models.pantograph.train_motion import SpeedProfile
from tests.effort import rest
from tests.models.pantograph.multibody.mechanisms import library, library_data, mechanism_from, q

#: The lower arm's angle above the horizontal as written.
WRITTEN = 2.0 * np.arcsin(0.17)


@pytest.fixture(scope="module")
def cam():
    mechanism = Mechanism(library("generic_multibody_cam").with_values({"static_force": 100.0}))
    return mechanism, take_posture(mechanism)


@pytest.mark.parametrize(
    ("angle", "own", "loaded"),
    [
        (10.0, 841.6230, 1023.7937),
        (20.0, 939.3427, 1175.0321),
        (30.0, 1008.2067, 1290.0284),
        (40.0, 1113.4161, 1462.9234),
    ],
)
def test_moments_are_those_of_an_independent_lagrange_form(cam, angle, own, loaded):
    curve, place = cam[0].forces.cam, np.radians(angle) - WRITTEN
    assert curve.value(place, 0.0) == pytest.approx(own, rel=1e-4)
    assert curve.value(place, 100.0) == pytest.approx(loaded, rel=1e-4)


@pytest.mark.parametrize(("share", "largest"), [(0.5, 0.03), *rest((1.0, 0.01), (1.5, 0.03))])
def test_the_strip_presses_alike_at_every_height(cam, share, largest):
    mechanism, posture = cam
    for height in np.linspace(4.6, 6.0, 8):
        found = contact_force_at(mechanism, height - posture.base_height, 100.0 * share, start=posture.reference)
        assert found.inputs.force == pytest.approx(100.0 * share, abs=largest)


def test_raise_becomes_neutral_and_the_head_swings_as_before():
    free, held = (Rig(library(n)) for n in ("generic_multibody", "generic_multibody_cam"))
    without, with_cam = (
        {m.name: m for m in r.dynamics(5.02, np.array([1.0])).motions if m.eigenvalue.imag >= 0.0} for r in (free, held)
    )
    assert with_cam["head heave"].frequency == pytest.approx(without["head heave"].frequency, rel=1e-3)
    assert with_cam["head roll"].frequency == pytest.approx(without["head roll"].frequency, rel=1e-3)
    raised = [m for m in held.dynamics(5.02, np.array([1.0])).motions if m.name == "raise"]
    assert min(abs(m.eigenvalue) for m in raised) < 1e-3
    assert max(m.growth for m in raised) < 1e-3
    assert "neutral: rests at any height" in {m.remark for m in raised}
    assert held.warning(157.5) == ""


def test_a_cam_is_found_once_for_all_runs_of_a_pantograph(monkeypatch):
    """What a run may set leaves no bit of it changed; what the mechanism is changes it."""
    monkeypatch.setattr(cam_design, "_POINTS", 3)
    monkeypatch.setattr(cam_design, "_found", LastFound(most=1))
    plain = library("generic_multibody_cam")
    run = {
        "speed": 60.0, "start_position": 30.0, "reference_height": 5.3, "start_height": 4.9, "raise_start": 1.0,
        "raise_duration": 0.3, "aerodynamic_uplift": (0.02, 0.01), "knuckle": "trailing", "direction": -1,
        "extrapolation_order": 1, "monitor_energy": 1, "time_step": 5e-4, "tolerance": 1e-7, "use_train": 1,
        "speed_profile": SpeedProfile(time=(0.0, 1.0), speed=(10.0, 20.0)),
    }  # fmt: skip
    assert set(run) == set(OF_A_RUN)

    def fitted(definition):
        mechanism = Mechanism(definition)
        stand(mechanism)
        cam = mechanism.forces.cam
        return cam, [curve.rows.tobytes() for curve in cam]

    cam, numbers = fitted(plain)
    assert fitted(replace(plain, **run))[0] is cam
    assert fitted(plain.with_values({"static_force": 120.0}))[1] != numbers
    other, same = fitted(replace(plain, **run))
    assert other is not cam  # that of the last one alone is kept
    assert same == numbers


def with_table(moment=(900.0, 1000.0, 1100.0, 1150.0), angle=(-10.0, 0.0, 10.0, 20.0), **values):
    data = library_data("generic_multibody")
    data["force"]["lift"]["cam"] = {"angle": q(list(angle), "deg"), "moment": q(list(moment), "N.m")}
    del data["static_moment"]
    return data | values


def test_a_table_gives_its_moments_and_is_scaled_by_the_one_set():
    mechanism = Mechanism(mechanism_from(with_table()))
    take_posture(mechanism)
    assert mechanism.forces.cam.value(np.radians(10.0), 1.0) == pytest.approx(1100.0)
    mechanism = Mechanism(mechanism_from(with_table(static_moment=q(1313.7, "N.m"))))
    take_posture(mechanism)
    assert mechanism.forces.cam.value(0.0, 1313.7) == pytest.approx(1313.7)
    assert mechanism.forces.cam.value(np.radians(10.0), 1313.7) == pytest.approx(1313.7 * 1.1)
    assert mechanism.forces.cam.value(1.0, 1313.7) == pytest.approx(1313.7 * 1.15)  # held outside


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"angle": (0.0, 10.0)}, r"force\.lift\.cam\.moment: has 4 values for 2 of 'angle'"),
        ({"angle": (0.0, 10.0), "moment": (1.0, 2.0)}, r"cam\.angle: has 2 values where a cam takes at least 3"),
        ({"angle": (0.0, 10.0, 10.0, 20.0)}, r"cam\.angle: must rise from value to value; 0\.174533 does not"),
    ],
)
def test_tables_that_are_none(change, told):
    with pytest.raises(DefinitionError, match=told):
        mechanism_from(with_table(**change))


def test_what_is_set_must_suit_the_cam():
    data = library_data("generic_multibody")
    data["force"]["lift"]["cam"] = "constant_force"
    with pytest.raises(DefinitionError, match="static_moment: does nothing: with the cam 'constant_force' of 'lift'"):
        mechanism_from(data)
    data["force"]["lift"]["cam"] = "constant"
    with pytest.raises(DefinitionError, match=r"force\.lift\.cam: 'constant' is none of constant_force"):
        mechanism_from(data)


@pytest.mark.parametrize(
    "stops", [{"arm_stops": library_data("generic_multibody_cam")["force"]["arm_stops"]}, *rest({})]
)
def test_a_cam_on_a_force_that_pushes_the_arm(stops):
    """A bellows between base and lower arm holds the force as well, by its length, up to the stops if there are any."""
    data = library_data("generic_multibody")
    del data["static_moment"]
    data["static_force"] = q(120.0, "N")
    data["force"] |= stops
    data["force"]["lift"] = {
        "kind": "actuator_force",
        "body_i": "base",
        "body_j": "lower_arm",
        "point_i": q([-0.2, 0.0, -0.1], "m"),
        "point_j": q([0.5, 0.0, 0.0], "m"),
        "lift": True,
        "cam": "constant_force",
    }
    mechanism = Mechanism(mechanism_from(data))
    posture = take_posture(mechanism)
    for above in (1.3, 1.7):
        found = contact_force_at(mechanism, above, 120.0, start=posture.reference)
        assert found.inputs.force == pytest.approx(120.0, abs=0.05)
    if stops:
        stop = mechanism.forces.stops.stops[0]
        ends = [strip_height_where_arm_is(mechanism, posture.reference, a) for a in (stop.lowest, stop.highest)]
        for above in (ends[0] + 0.02, ends[1] - 0.05):  # the head gives way by 20 mm
            found = contact_force_at(mechanism, above, 120.0, start=posture.reference)
            assert found.inputs.force == pytest.approx(120.0, abs=0.05)


@pytest.mark.long
@pytest.mark.parametrize("lift", ["force", "moment"])
def test_between_its_points_a_cam_is_right_up_to_the_dead_centres(lift):
    """Without stops, what lifts grows without limit at one end, and the rise by it vanishes at the other."""
    data = library_data("generic_multibody_cam")
    del data["force"]["arm_stops"], data["base_height"]
    if lift == "force":
        ends = {"point_i": q([-0.2, 0.0, -0.1], "m"), "point_j": q([0.5, 0.0, 0.0], "m")}
        bodies = {"kind": "actuator_force", "body_i": "base", "body_j": "lower_arm", "lift": True}
        data["force"]["lift"] = bodies | ends | {"cam": "constant_force"}
    mechanism = Mechanism(mechanism_from(data))
    y = stand(mechanism)
    cam, where, force = mechanism.forces.cam, mechanism.forces.lift_place, mechanism.definition.static_force
    first, last = cam.per_lift.range
    mechanism.forces.cam = None
    now = where.at(mechanism.kinematics(y))
    assert (last - first) / (now - first) > 1.5
    for end in (first, last):
        start = y
        for share in (0.5, 0.8, 0.93, 0.987):
            place = now + share * (end - now)

            def beyond(z, p=place):
                return where.at(mechanism.kinematics(z)) - p

            found, own = (equilibrium_where(mechanism, beyond, start, contact_force=f) for f in (force, 0.0))
            assert abs(cam.value(place, force) - found.lift) * force < 0.03 * abs(found.lift - own.lift)
            start = found.y


def strip_height_where_arm_is(mechanism, start, angle):
    (where,) = mechanism.forces.stops.angles
    for share in np.linspace(0.25, 1.0, 4):
        found = equilibrium_where(mechanism, lambda y, a=share * angle: where.at(mechanism.kinematics(y)) - a, start)
        start = found.y
    return found.strip_height


def test_heights_out_of_reach_name_those_within():
    """By hand: arms in line with the horizontal let the strip go no lower than 0.80 m above the base."""
    definition = library("generic_multibody").with_values({"reference_height": 5.0})
    posture = take_posture(Mechanism(definition))
    low = library_data("generic_multibody") | {"base_height": q(4.5, "m")}
    with pytest.raises(
        MechanismError, match=r"reference_height = 5\.02 m is out of reach: .* from 5\.30\d to \d\.\d+ m"
    ):
        take_posture(Mechanism(mechanism_from(low)))
    assert posture.base_height == pytest.approx(5.0 - 1.487, abs=1e-3)


def test_the_arms_take_the_angle_that_the_reference_height_needs():
    data = library_data("generic_multibody") | {"base_height": q(3.3, "m"), "start_height": q(4.3, "m")}
    mechanism = Mechanism(mechanism_from(data))
    posture = take_posture(mechanism)
    assert posture.base_height == 3.3
    assert mechanism.strip_height(posture.reference) == pytest.approx(5.02 - 3.3, abs=1e-9)
    part = MultibodyPantographPart(mechanism.definition)
    part.initialise(0.0, 0.0, np.zeros(3), np.zeros(2))
    assert part.strip[:, 0, 2] == pytest.approx([4.3, 4.3], abs=1e-9)


def swung(step, stop=0.4, force=40.0):
    part = MultibodyPantographPart(library("generic_multibody_cam").with_values({"monitor_energy": 1}))
    part.initialise(0.0, 150.0, np.zeros(3), np.zeros(2))
    for n in range(round(stop / step)):
        t = n * step
        part.step(150.0 + force * np.sin(8.0 * t), np.array([part.definition.speed * t, 0.1, 5.0]), np.zeros(2), step)
    return part


def test_energy_balances_with_the_cam():
    coarse, fine = (swung(step).energy for step in (1e-3, 5e-4))
    assert coarse[1] > 0.1
    assert abs(coarse[3]) < 1e-6 * np.abs(coarse).max()
    assert abs(fine[3]) < abs(coarse[3]) / 4.0


def test_ten_kilonewtons_leave_every_body_above_the_base():
    """At rest; put on at once, they swing the lowest centre of mass 34 mm below the base's origin and back."""
    part = MultibodyPantographPart(library("generic_multibody_cam"))
    part.initialise(0.0, 150.0, np.zeros(3), np.zeros(2))
    mechanism = part._built.mechanism
    lowest = []
    for n in range(350):
        part.step(10e3, np.array([part.definition.speed * n * 1e-3, 0.0, 5.0]), np.zeros(2), 1e-3)
        lowest.append(mechanism.split(part.state).r[mechanism.driven :, 2].min())
    assert min(lowest) > -0.05
    assert lowest[-1] > 0.0
    assert part.strip[:, 0, 2].min() > part._built.base_height + 0.7


def test_a_blow_does_not_drive_the_head_through_what_carries_it():
    part = MultibodyPantographPart(library("generic_multibody_cam"))
    part.initialise(0.0, 150.0, np.zeros(3), np.zeros(2))
    mechanism = part._built.mechanism
    gaps = []
    for n in range(150):
        force = 5e3 if 20 <= n < 40 else 150.0
        part.step(force, np.array([part.definition.speed * n * 1e-3, 0.0, 5.0]), np.zeros(2), 1e-3)
        z = mechanism.split(part.state).r[:, 2]
        gaps.append(z[mechanism.numbers["pan_head"]] - z[mechanism.numbers["stabilisation_arm"]])
    assert 0.0 < min(gaps) < 0.02


def test_a_curve_holds_its_ends_and_goes_through_its_points():
    x = np.array([0.0, 0.5, 0.7, 2.0])
    curve = CubicCurve(x, x**3 - x)
    assert [curve.at(v) for v in x.tolist()] == pytest.approx((x**3 - x).tolist(), abs=1e-12)
    assert curve.at(1.3) == pytest.approx(1.3**3 - 1.3)
    assert (curve.at(-1.0), curve.at(9.0)) == (0.0, 6.0)


def test_a_force_from_outside_becomes_the_moment_that_carries_it():
    """With the arm at the same angle, a moment more by what 30 N on the strip need: it rises by 2.34 m per rad."""
    data = library_data("generic_multibody")
    data["force"]["arm_stops"] = library_data("generic_multibody_cam")["force"]["arm_stops"]
    part = MultibodyPantographPart(mechanism_from(data))
    part.initialise(0.0, 157.5, np.zeros(3), np.zeros(2), Drive(uplift=30.0))
    mechanism, reference = part._built.mechanism, part._built.reference
    place = mechanism.forces.lift_place
    here = place.at(mechanism.kinematics(reference))

    def angle(y):
        return place.at(mechanism.kinematics(y)) - here

    few, many = (equilibrium_where(mechanism, angle, reference, contact_force=force) for force in (157.5, 187.5))
    besides = mechanism.lift_value(few.y, Inputs(uplift=30.0))
    assert besides == pytest.approx(many.lift - few.lift, rel=1e-4)
    assert besides == pytest.approx(30.0 * 2.337, rel=2e-3)
    assert part._inputs(0.0).uplift == 30.0


def test_a_cam_that_holds_the_force_takes_it_with_the_one_set():
    part = MultibodyPantographPart(library("generic_multibody_cam").with_values({"raise_duration": 0.0}))
    part.initialise(0.0, 157.5, np.zeros(3), np.zeros(2), Drive(uplift=30.0))
    assert part._inputs(0.0).lift == pytest.approx(187.5)
    assert part._inputs(0.0).uplift == 0.0


def test_uplift_of_the_air_is_the_square_of_the_speed_on_the_strip():
    values = {"aerodynamic_uplift.leading": 0.01, "speed": 50.0}
    part = MultibodyPantographPart(library("generic_multibody_cam").with_values(values))
    part.initialise(0.0, 150.0, np.zeros(3), np.zeros(2), Drive(air=-10.0))
    inputs = part._inputs(0.0)
    assert inputs.lift == pytest.approx(0.01 * 60.0**2, abs=1e-3)
