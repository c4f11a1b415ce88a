"""Mechanisms with something left out or named empty: one sentence each; friction is not passed over in silence."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from models.commands.pantograph_command import friction_warning
from models.commands.physics_main import main
from models.definition_files.toml_reader import DefinitionError
from models.library.catalogue import load_pantograph, pantograph_path
from models.pantograph.multibody.analysis.mechanism_rig import Rig
from models.pantograph.multibody.mechanism import MechanismError
from models.pantograph.multibody.mechanism_definition import JointFriction
from tests.models.pantograph.multibody.mechanisms import library_data, mechanism_from, q

NAMES = ("CX_multibody", "generic_multibody")
PLACES = [
    (name, section, part, key)
    for name in NAMES
    for section in ("joint", "force")
    for part, table in library_data(name)[section].items()
    for key in table
    if key in ("body_i", "body_j")
]


@pytest.mark.parametrize(("name", "section", "part", "key"), PLACES)
def test_an_empty_name_of_a_body_is_told_where_it_stands(name, section, part, key):
    data = library_data(name)
    data[section][part][key] = ""
    with pytest.raises(DefinitionError, match=rf"{section}\.{part}\.{key}: is empty"):
        mechanism_from(data)


@pytest.mark.parametrize("section", ["strip", "assembly"])
def test_so_it_is_of_strip_and_assembly(section):
    data = library_data("generic_multibody")
    data[section]["body"] = ""
    with pytest.raises(DefinitionError, match=rf"{section}\.body: is empty"):
        mechanism_from(data)


@pytest.mark.parametrize("name", NAMES)
def test_a_strip_that_nothing_can_move_is_told(name):
    """Its apparent mass would be no number."""
    data = library_data(name)
    data["strip"]["body"] = "base"
    with pytest.raises(DefinitionError, match=r"strip\.body: body 'base' has a prescribed motion; put the strip"):
        mechanism_from(data)


def test_a_spring_that_carries_the_weights_needs_a_stiffness(capsys, tmp_path):
    text = pantograph_path("CX_multibody").read_text(encoding="utf-8")
    head, tail = text.split("carries_weights = true", 1)
    begin = head.rindex("[force.")
    block = re.sub(r"(?m)^stiffness = .*\n", "", head[begin:])
    broken = head[:begin] + block + "carries_weights = true" + re.sub(r"(?m)^stiffness = .*\n", "", tail, count=1)
    (tmp_path / "broken.toml").write_text(broken, encoding="utf-8")
    assert main(["pantograph", str(tmp_path / "broken.toml")]) == 1
    said = capsys.readouterr().err
    assert "force.stage_1.stiffness: is missing" in said


def test_a_spring_damper_of_neither_is_told():
    data = library_data("generic_multibody")
    for key in ("stiffness", "damping"):
        del data["force"]["suspension_left"][key]
    with pytest.raises(DefinitionError, match=r"force\.suspension_left: needs a stiffness or a damping"):
        mechanism_from(data)


def test_motions_without_a_solution_are_worded(monkeypatch):
    from models.pantograph.multibody.analysis import mechanism_rig

    def singular(*_):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(mechanism_rig, "receptance", singular)
    rig = Rig(mechanism_from(library_data("generic_multibody")))
    with pytest.raises(MechanismError, match=r"its small motions about a strip height of 5\.02 m have no solution"):
        rig.dynamics(5.02, np.array([1.0]))


@pytest.fixture(scope="module")
def rubbing():
    data = library_data("generic_multibody")
    data["force"]["rub"] = {
        "kind": "joint_friction", "joint": "joint_1", "moment": q(20.0, "N.m"), "transition": q(0.001, "rad/s"),
    }  # fmt: skip
    return mechanism_from(data)


def analysed(d):
    return Rig(d).dynamics(5.02, np.array([1.0]))


def test_modes_that_dry_friction_takes_are_told(rubbing):
    found, free = analysed(rubbing), analysed(mechanism_from(library_data("generic_multibody")))
    oscillating = [m for m in found.modes if m.frequency > 0.0]
    assert len(oscillating) < sum(m.frequency > 0.0 for m in free.modes)
    said = friction_warning(rubbing, found, analysed)
    assert said.startswith("dry friction in rub: the modes are those of small motions about rest")
    without = sum(m.frequency > 0.0 for m in free.modes)
    assert f"{len(oscillating)} of them oscillate, and without the friction {without} (" in said
    assert said.endswith(", ".join(f"{m.frequency:.3f}" for m in free.modes if m.frequency > 0.0) + " Hz)")


def test_without_friction_there_is_nothing_to_tell(rubbing):
    frictionless = replace(rubbing, forces=tuple(f for f in rubbing.forces if not isinstance(f, JointFriction)))
    assert friction_warning(frictionless, None, analysed) == ""


def test_a_lift_that_is_an_input_needs_an_element_to_lift():
    data = library_data("generic_multibody")
    del data["force"][mechanism_from(data).lifting.name]["lift"], data["static_moment"]
    data["force"][mechanism_from(library_data("generic_multibody")).lifting.name]["moment"] = q(900.0, "N.m")
    with pytest.raises(DefinitionError, match="lift_input: does nothing: no force element has lift = true"):
        mechanism_from(data | {"lift_input": q(1, "1")})


def test_the_uplift_that_a_given_lift_replaces_is_told():
    data = library_data("generic_multibody") | {"aerodynamic_uplift": q([0.01, 0.02], "N.s2/m2")}
    with pytest.raises(DefinitionError, match=r"aerodynamic_uplift: does nothing with lift_input = 1"):
        mechanism_from(data | {"lift_input": q(1, "1")})


def test_the_air_pushes_a_body_that_there_is():
    data = library_data("generic_multibody")
    data["force"]["wind"] = {"kind": "aerodynamic", "body": "hed", "coefficient": q(0.01, "N.s2/m2")}
    with pytest.raises(DefinitionError, match=r"force\.wind\.body: there is no body 'hed'"):
        mechanism_from(data)


@pytest.mark.parametrize("element", ["joint.roof", "joint.joint_1", "joint.joint_8", "force.lift", "force.arm_stops"])
def test_a_wrong_kind_is_one_mistake_and_not_what_follows_from_it(element):
    data = library_data("generic_multibody_cam")
    data["force"]["rub"] = {
        "kind": "joint_friction", "joint": "joint_1", "moment": q(20.0, "N.m"), "transition": q(0.001, "rad/s"),
    }  # fmt: skip
    section, name = element.split(".")
    data[section][name]["kind"] = "revolut"
    with pytest.raises(DefinitionError) as error:
        mechanism_from(data)
    (problem,) = error.value.problems
    assert str(problem).startswith(f"definition: {element}.kind: 'revolut' is none of")


@pytest.mark.parametrize(
    ("joint", "rub", "told"),
    [
        ("revolute", {"force": q(20.0, "N"), "transition": q(0.01, "m/s")}, "force: a revolute joint does not slide"),
        ("spherical", {"force": q(20.0, "N"), "transition": q(0.01, "m/s")}, "force: a spherical joint does not slide"),
        ("prismatic", {"moment": q(2.0, "N.m"), "transition": q(1.0, "rad/s")}, "moment: a prismatic joint does not"),
    ],
)
def test_friction_of_a_motion_that_the_joint_does_not_have_is_told(joint, rub, told):
    """A force [N] was taken for a moment [N.m]."""
    data = library_data("generic_multibody")
    places = {"body_i": "base", "body_j": "lower_link", "point_i": q([0, 0, 0], "m"), "point_j": q([0, 0, 0], "m")}
    axes = {"axis_i": q([0, 1, 0], "1")} | ({"axis_j": q([0, 1, 0], "1")} if joint == "revolute" else {})
    data["joint"]["rubbed"] = {"kind": joint, **places, **({} if joint == "spherical" else axes)}
    data["force"]["rub"] = {"kind": "joint_friction", "joint": "rubbed", **rub}
    with pytest.raises(DefinitionError, match=rf"force\.rub\.{told}"):
        mechanism_from(data)


def told_of(data):
    with pytest.raises(DefinitionError) as error:
        mechanism_from(data)
    return str(error.value).splitlines()


def test_a_cam_that_is_none_is_one_mistake():
    data = library_data("generic_multibody_cam")
    lift = mechanism_from(library_data("generic_multibody_cam")).lifting.name
    data["force"][lift]["cam"] = "constant"
    assert len(told_of(data)) == 1
    data["force"][lift]["cam"] = {"angle": q([0.0, math.nan, 2.0], "deg"), "moment": q([1.0, 2.0, 3.0], "N.m")}
    del data["static_force"]
    assert len(told_of(data)) == 1


def test_a_cam_on_what_does_not_lift_says_what_to_do():
    data = library_data("generic_multibody_cam")
    lift = mechanism_from(library_data("generic_multibody_cam")).lifting.name
    data["force"][lift] = data["force"][lift] | {"moment": q(900.0, "N.m"), "lift": False}
    del data["static_force"]
    (told,) = told_of(data)
    assert "cam: does nothing: only what raises the pantograph has a cam; write lift = true beside it" in told


def test_the_keys_that_messages_list_have_those_without_a_default():
    (told,) = told_of(library_data("generic_multibody") | {"start_hight": q(5.0, "m")})
    assert "did you mean 'start_height'?" in told


def test_a_type_that_is_none_is_one_mistake(tmp_path):
    text = pantograph_path("generic_multibody_cam").read_text(encoding="utf-8")
    path = tmp_path / "generic_multibody_cam.toml"
    path.write_text(text.replace('type = "multibody"', 'type = "multi_body"'), encoding="utf-8")
    with pytest.raises(DefinitionError) as error:
        load_pantograph(str(path))
    (told,) = str(error.value).splitlines()
    assert "type: 'multi_body' is none of lumped, multibody; did you mean 'multibody'?" in told
