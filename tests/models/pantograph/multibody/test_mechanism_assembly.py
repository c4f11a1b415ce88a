"""Mechanisms that cannot be: which joint, by how many mm."""

import numpy as np
import pytest

from models.definition_files.toml_reader import DefinitionError
from models.pantograph.multibody.mechanism import Mechanism, MechanismError
from models.pantograph.multibody.mechanism_assembly import assemble
from tests.models.pantograph.multibody.mechanisms import library, library_data, mechanism_from, q
from tests.models.pantograph.multibody.test_mechanisms import four_bar


def test_misprinted_joint_is_named_with_its_gap():
    data = library_data("generic_multibody")
    data["joint"]["joint_1"]["point_i"][0] = [0.020, 0.0, 0.132]
    with pytest.raises(MechanismError, match=r"joint 'joint_1' gapes by 182 mm"):
        assemble(Mechanism(mechanism_from(data)))


def test_mechanism_that_cannot_close_names_the_joint_and_what_stays_open():
    with pytest.raises(MechanismError, match=r"joint 'third' stays open by .* mm"):
        assemble(four_bar(coupler=2.0, largest_gap=5.0))


def test_gap_that_stays_open_is_the_true_one():
    """Crank and rocker stretched towards both ends of the coupler still leave it too long."""
    with pytest.raises(MechanismError) as error:
        assemble(four_bar(coupler=2.0, largest_gap=5.0))
    millimetres = float(str(error.value).split("open by ")[1].split(" mm")[0])
    assert millimetres == pytest.approx(1e3 * (2.0 - 0.8 - 0.3 - 0.6), rel=0.02)


def test_over_constrained_mechanism_names_the_joint_that_repeats():
    with pytest.raises(MechanismError, match=r"over-constrained(.|\n)*joint 'lock'") as error:
        assemble(four_bar(third="revolute"))
    assert "mm" in str(error.value)


def test_kept_coordinate_is_kept(generic):
    mechanism, y = generic
    assert mechanism.split(y).p[mechanism.numbers["lower_arm"], 2] == pytest.approx(0.17, abs=1e-12)


def test_all_mistakes_of_a_file_come_at_once_with_names():
    data = library_data("generic_multibody")
    data["joint"]["joint_2"]["body_j"] = "uper_arm"
    data["joint"]["joint_3"]["kind"] = "hinge"
    data["body"]["pan_head"]["mass"] = q(-1.0, "kg")
    data["force"]["raising_spring"]["stiffness"] = q(2.0, "N")
    data["force"]["lift"]["colour"] = 1
    with pytest.raises(DefinitionError) as error:
        mechanism_from(data)
    text = str(error.value)
    for part in (
        "joint.joint_2.body_j", "'uper_arm'", "joint.joint_3.kind", "'hinge'", "body.pan_head.mass",
        "force.raising_spring.stiffness", "colour",
    ):  # fmt: skip
        assert part in text


def test_roll_and_slide_axes_must_be_perpendicular():
    data = library_data("generic_multibody")
    data["joint"]["joint_8"]["axis_j"] = q([1, 0, 0], "1")
    with pytest.raises(MechanismError, match=r"joint_8.*perpendicular"):
        Mechanism(mechanism_from(data))


def test_every_number_is_a_parameter_that_can_be_set():
    d = library("generic_multibody")
    parameters = {p.name: p for p in d.parameters()}
    assert parameters["body.lower_arm.mass"].value == 32.18
    assert parameters["joint.joint_1.point_i.x"].source.startswith("Table 3.2")
    assert parameters["raise_duration"].unit == "s"
    assert len(parameters) == len(d.parameters())
    for p in d.parameters():
        if p.is_integer:
            continue
        new = d.with_values({p.name: p.value * 1.25 + 0.01})
        got = {x.name: x.value for x in new.parameters()}
        assert got[p.name] == pytest.approx(p.value * 1.25 + 0.01)
        assert sum(got[x.name] != pytest.approx(x.value) for x in d.parameters()) == 1


def test_bad_values_are_refused_with_their_name():
    from models.definition_files.parameter import ParameterError

    d = library("CX_multibody")
    with pytest.raises(ParameterError, match=r"body\.m1\.mass"):
        d.with_values({"body.m1.mass": -1.0})
    with pytest.raises(ParameterError, match=r"body\.m9\.mass"):
        d.with_values({"body.m9.mass": 1.0})
    with pytest.raises(ParameterError):
        d.with_values({"speed": np.nan})
