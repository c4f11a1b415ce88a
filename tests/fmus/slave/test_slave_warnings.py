"""What a line's FMU warns of in the FMI log: once, at the right time, and nothing where all is well."""

from __future__ import annotations

import pytest

from fmus.builder.fmu_build import build
from fmus.builder.recipe import recipe
from models.catenary.condition.line_condition import find_condition
from models.catenary.line_advice import slack_warning
from models.catenary.line_part import CatenaryPart
from models.catenary.shape.kept_form import kept_form
from models.catenary.shape.line_mesh import build_mesh
from models.library.catalogue import line_names, load_line
from tests.effort import some
from tests.fmus.support import Instance, refused, short_line_recipe

SPEEDS = [f"pantograph[1].{end}.vx" for end in "AB"]


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sound")
    return build(short_line_recipe(folder), folder)


@pytest.fixture(scope="module")
def slack(tmp_path_factory):
    """A line whose fourth dropper of every span is far too long."""
    folder = tmp_path_factory.mktemp("slack")
    return build(short_line_recipe(folder, "[1.25, 1.15, 1.1, 2.5, 1.1, 1.15, 1.25]"), folder)


@pytest.fixture(scope="module")
def pantographs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pantographs")
    return {name: build(recipe(f"Pantograph_{name}"), folder) for name in ("CX", "CX_multibody")}


@pytest.fixture
def instantiate():
    made = []

    def make(path):
        made.append(Instance(path))
        return made[-1]

    yield make
    for instance in made:
        instance.free()


def wave_speed(instance):
    instance.slave.setupExperiment(startTime=0.0)
    instance.slave.enterInitializationMode()
    return instance["contact_wire.wave_speed"]


def test_slack_droppers_are_named_once_whatever_is_asked_before(instantiate, slack):
    line = instantiate(slack)
    line.slave.setupExperiment(startTime=0.0)
    line.slave.enterInitializationMode()
    for force in (1.0, 2.0):  # builds and initialises more than once
        line["pantograph[1].A.vx"] = force
        assert line["dropper[4].force"] == 0.0
    assert line.warnings == []
    line.slave.exitInitializationMode()
    places = ", ".join(f"{4 + 7 * i} at {50 * i + 25:.2f} m" for i in range(5))
    assert line.warnings == [f"droppers {places} are slack at rest"]
    for n in range(3):
        line.step(n * 1e-3)
    assert len(line.messages) == 1


@pytest.mark.parametrize(("share", "expected"), [(0.69, 0), (0.71, 1), (-0.71, 1), (1.2, 1)])
def test_a_train_too_fast_for_the_waves(instantiate, sound, share, expected):
    line = instantiate(sound)
    C = wave_speed(line)
    for name in SPEEDS:
        line[name] = share * C
    line.slave.exitInitializationMode()
    line.step(0.0)
    assert len(line.warnings) == len(line.messages) == expected
    assert all(f"are {abs(share):.2f} of the contact wire's wave speed" in text for text in line.warnings)


def test_steps_too_long_are_reported_once(instantiate, sound):
    line = instantiate(sound)
    line.initialise()
    time = 0.0
    for step in (1e-3, 2e-3, 8e-3, 1e-3, 9e-3):
        line.step(time, step)
        time += step
    assert len(line.messages) == 1
    assert line.warnings[0].startswith("a step of 8 ms is long for a contact stiffness of")


def test_the_first_step_can_be_too_long(instantiate, sound):
    line = instantiate(sound)
    line.initialise()
    line.step(0.0, 8e-3)
    assert len(line.warnings) == 1


def test_a_line_that_cannot_be_built_tells_errors_alone(instantiate, sound):
    line = instantiate(sound)
    with refused():
        line.initialise(**{"contact_wire.tension": 500.0, "contact_wire.mass": 20.0})
    assert line.warnings == []
    assert "no static equilibrium of the wanted shape" in line.errors[0]


@pytest.mark.parametrize(("z", "expected"), [(5.08, 0), (5.30, 1)])
@pytest.mark.parametrize("name", ["CX", "CX_multibody"])
def test_a_wire_at_another_working_height(instantiate, pantographs, name, z, expected):
    """What the line gives as the point of contact is where the wire is above the strip."""
    pantograph = instantiate(pantographs[name])
    pantograph.initialise(**{"contact.x": 0.0, "contact.z": z})
    assert len(pantograph.warnings) == expected
    assert all("at the wire's, 5.30 m, " in text for text in pantograph.warnings)


@pytest.mark.parametrize("name", some(line_names(), "EN50318_2002", "LN2_overlap", "Re330", "Shinkansen"))
def test_no_dropper_of_the_library_is_slack_at_rest(name):
    part = CatenaryPart(load_line(name))
    at_rest = find_condition(kept_form(part.definition, build_mesh(part.definition)))
    assert slack_warning(part.droppers, at_rest.is_slack) == ""
