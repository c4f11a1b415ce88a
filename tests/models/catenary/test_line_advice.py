"""Warnings of physical limits: when they come, and what their numbers are."""

import dataclasses
import math

import numpy as np
import pytest

from models.catenary import line_advice
from models.catenary.definition.line_definition import Contact, Rayleigh
from models.catenary.definition.surface_definition import RunningSurface
from models.catenary.line_advice import (
    longest_step,
    slack_law_warning,
    slack_warning,
    speed_warning,
    step_warning,
    surface_warning,
    tangent_stiffness,
)
from models.catenary.line_part import CatenaryPart
from models.catenary.statics.wire_waves import contact_wire_wave_speed, wave_speed
from models.commands.physics_main import main
from tests.models.conftest import make_fault


def test_the_speed_is_compared_with_the_waves_of_the_longest_span(ln2):
    C = wave_speed(ln2.contact_wire, 50.0)
    assert speed_warning(ln2, 0.699 * C) == ""
    assert "0.71 of the contact wire's wave speed" in speed_warning(ln2, 0.71 * C)
    assert "operated at up to 0.7" in speed_warning(ln2, -0.99 * C)
    assert "no wave runs ahead" in speed_warning(ln2, 1.01 * C)


def test_waves_are_taken_where_they_are_slowest(ln2):
    """Bending speeds up waves of short spans: the speed that a train is compared with is that of the longest."""
    speeds = [wave_speed(ln2.contact_wire, span.length) for span in ln2.sections[0].spans]
    assert len(set(speeds)) > 1
    assert contact_wire_wave_speed(ln2) == min(speeds)


def test_usual_steps_are_short_enough(ln2):
    assert step_warning(ln2, 1e-3, head_mass=7.75) == ""
    assert "take" in step_warning(ln2, 5e-3)


def test_a_light_head_needs_shorter_steps(ln2):
    """A mass on the contact spring is resolved by twenty steps per period."""
    K = ln2.contact.stiffness
    assert longest_step(ln2, head_mass=0.1) == pytest.approx(2.0 * math.pi * math.sqrt(0.1 / K) / 20.0)
    assert longest_step(ln2, head_mass=100.0) == longest_step(ln2)


def test_the_longest_step_falls_with_the_contact_stiffness(ln2):
    stiff = ln2.with_values({"contact.stiffness": 10.0 * ln2.contact.stiffness})
    assert longest_step(stiff) == pytest.approx(0.1 * longest_step(ln2))


def test_a_wire_takes_up_waves_like_the_damper_of_the_criterion(ln2):
    """The relaxation time is that of the wave equation: energy per time fed into both sides of a string is F v."""
    wire = ln2.contact_wire
    C, v = math.sqrt(wire.tension / wire.mass), 0.3
    # Behind the front the string moves with v and is inclined by v / C: kinetic and elastic energy per length.
    power = 2.0 * C * (0.5 * wire.mass * v**2 + 0.5 * wire.tension * (v / C) ** 2)
    assert power == pytest.approx(2.0 * math.sqrt(wire.tension * wire.mass) * v**2)


@pytest.mark.parametrize("stiffness", [2e4, 5e4])
def test_the_longest_step_is_a_quarter_of_the_time_in_which_a_pressed_string_gives_way(ln2, stiffness):
    """A strip pressed into a long string, which runs away to both sides in d'Alembert's exact differences."""
    wire, dt, n = ln2.contact_wire, 2.5e-5, 2001
    cell = math.sqrt(wire.tension / wire.mass) * dt
    before, now = np.zeros(n), np.zeros(n)
    depth, time, force = 1e-3, 0.0, stiffness * 1e-3
    while force > stiffness * depth / math.e:
        new = np.zeros(n)
        new[1:-1] = now[2:] + now[:-2] - before[1:-1]
        new[n // 2] += force * dt**2 / (wire.mass * cell)
        before, now, time = now, new, time + dt
        force = stiffness * (depth - now[n // 2])
    line = ln2.with_values({"contact.stiffness": stiffness})
    assert longest_step(line) == pytest.approx(0.25 * time, rel=0.02)
    assert step_warning(line, 0.24 * time) == ""
    assert step_warning(line, 0.26 * time)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
def test_the_stiffness_is_the_slope_of_the_law(exponent):
    contact = Contact(stiffness=30000.0, exponent=exponent)
    depth = (200.0 / contact.stiffness) ** (1.0 / exponent)
    above, below = (contact.stiffness * (share * depth) ** exponent for share in (1.0001, 0.9999))
    slope = (above - below) / (0.0002 * depth)
    assert tangent_stiffness(contact) == pytest.approx(slope, rel=1e-6)


def test_slack_droppers_are_named(line_maker):
    part = CatenaryPart(line_maker())
    is_slack = part.model.static.is_slack
    assert slack_warning(part.droppers, is_slack) == ""
    loose = is_slack.copy()
    loose[[3, 11]] = True
    reported = slack_warning(part.droppers, loose)
    assert reported == (
        f"droppers {part.droppers[3].name} at {part.droppers[3].x:.2f} m, "
        f"{part.droppers[11].name} at {part.droppers[11].x:.2f} m are slack at rest"
    )
    assert slack_warning(part.droppers, ~is_slack).endswith(f"and {len(is_slack) - 8} more are slack at rest")


def test_droppers_that_pull_before_they_are_taut_are_told_with_figure_and_cure(ln2):
    assert slack_law_warning(ln2) == ""
    dropper = dataclasses.replace(ln2.dropper, slack_law="tension")
    reported = slack_law_warning(dataclasses.replace(ln2, dropper=dropper))
    assert "alpha = 0.0272 s" in reported
    assert "at 0.5 m/s pulls 14 mm before it is taut" in reported
    assert "[damping.dropper]" in reported
    assert 'slack_law = "elastic_only" in [dropper]' in reported
    own = dataclasses.replace(ln2.damping, dropper=Rayleigh(1e-3, 0.0))
    assert slack_law_warning(dataclasses.replace(ln2, dropper=dropper, damping=own)) == ""


@pytest.mark.parametrize(("speed", "expected"), [("200", False), ("350", True)])
def test_statics_warns_of_the_speed(speed, expected, capsys):
    assert main(["statics", "EN50318_2018_AC_simple", "--speed", speed]) == 0
    assert ("warning: the train's 350 km/h" in capsys.readouterr().err) == expected


def test_waves_that_steps_pass_over_are_warned_of(ln2):
    """8 steps of 1 ms at 300 km/h are 0.67 m."""
    generated = RunningSurface(sigma=1e-4, exponent=2.0, from_=0.1, to=2.0, seed=0)
    line = dataclasses.replace(ln2, running_surface=generated)
    said = surface_warning(line, -300.0 / 3.6, 1e-3)
    assert said == (
        "the running surface has waves down to 0.5 m, and steps of 1 ms at 300 km/h follow none below 0.67 m: take a "
        "smaller time_step"
    )
    assert surface_warning(line, 300.0 / 3.6, 5e-4) == ""
    assert surface_warning(line.with_values({"running_surface.to": 1.4}), 300.0 / 3.6, 1e-3) == ""
    assert surface_warning(line.with_values({"running_surface.sigma": 0.0}), 300.0 / 3.6, 1e-3) == ""
    assert surface_warning(ln2, 300.0 / 3.6, 1e-3) == ""


def test_a_bump_that_steps_pass_over_is_told_if_it_acts(ln2):
    bump = make_fault("hard_point", position=500.0, value=0.0, height=-1e-3, length=0.6)
    said = [surface_warning(dataclasses.replace(ln2, fault=(f,)), 300.0 / 3.6, 1e-3) for f in (bump, replaced(bump))]
    assert said[0].startswith(
        "a hard point has a bump of 0.6 m, and steps of 1 ms at 300 km/h follow none below 0.67 m"
    )
    assert said[1] == ""


def replaced(fault):
    return dataclasses.replace(fault, active=0)


@pytest.mark.parametrize(("length", "is_short"), [(0.4, True), (1.0, False)])
def test_of_a_measured_surface_the_waves_count_not_the_points(ln2, length, is_short):
    x = np.arange(300.0, 340.0, 0.05)
    points = np.stack([x, 1e-4 * np.cos(2.0 * np.pi * x / length) + 1e-5 * (x - 300.0)], axis=1)
    surface = RunningSurface(profile="wear.csv", points=tuple(map(tuple, points.tolist())))
    said = surface_warning(dataclasses.replace(ln2, running_surface=surface), 300.0 / 3.6, 1e-3)
    assert said.startswith("the running surface of wear.csv has waves, and steps of 1 ms") is is_short


@pytest.mark.parametrize("count", [2, 16, 1024])
def test_the_transform_is_that_of_numpy(count):
    values = np.random.default_rng(1).standard_normal(count)
    assert line_advice._transform(values) == pytest.approx(np.fft.fft(values), abs=1e-11)
