"""Ports of FMUs that are not ours: found by their names, or as the user says."""

import pytest

from master.errors import RequestError
from master.fmu.fmu_description import read_fmu
from master.scenario.project.port_finding import ENDS, REPLY, check_given, find_ports, own_port


def names(port):
    return {key: variable.name for key, variable in port.items()}


def ends(form):
    return [form.format(end, axis) for end in "AB" for axis in ("x", "y", "z", "vx", "vy", "vz")]


def test_ports_of_ours_are_known_without_an_fmu():
    port = own_port("pantograph[2].")
    assert list(port) == [*ENDS, *REPLY]
    assert port["A.vz"] == ("pantograph[2].A.vz", "m/s")
    assert port["contact.force"].unit == "N"


@pytest.mark.parametrize("form", ["{}.{}", "{}_{}", "{}{}", "strip.{}.{}", "head_{}_{}"])
def test_a_pantographs_ends_and_force_are_found_by_name(make_fmu, form):
    fmu = read_fmu(make_fmu("X.fmu", ["other", "contact_force"], [*ends(form), "extra.x", "alpha_x"]))
    (port,) = find_ports(fmu, "pantograph")
    assert names(port) == dict(zip(ENDS, ends(form), strict=True)) | {"contact.force": "contact_force"}


def test_left_is_a_and_the_only_input_is_the_force(make_fmu):
    outputs = [f"{side}_{axis}" for side in ("left", "right") for axis in ("x", "y", "z", "vx", "vy", "vz")]
    (port,) = find_ports(read_fmu(make_fmu("X.fmu", {"push": "daN"}, outputs)), "pantograph")
    assert names(port)["A.x"] == "left_x"
    assert names(port)["B.vz"] == "right_vz"
    assert port["contact.force"] == ("push", "daN")


def test_ports_of_a_line_are_taken_in_the_order_of_their_numbers(make_fmu):
    prefixes = [f"pantograph[{n}]." for n in (2, 10, 1)]
    inputs = [p + e for p in prefixes for e in ends("{}.{}")]
    fmu = read_fmu(make_fmu("X.fmu", inputs, [f"{p}contact.force" for p in prefixes]))
    found = find_ports(fmu, "line", 3, {})
    assert [port["contact.force"].name for port in found] == [f"pantograph[{n}].contact.force" for n in (1, 2, 10)]


def test_what_the_names_do_not_say_the_user_says(make_fmu):
    fmu = read_fmu(make_fmu("X.fmu", ["F", "T"], [*ends("{}.{}")[:-1], "roll"]))
    (port,) = find_ports(fmu, "pantograph", given={(0, "contact.force"): "F", (0, "B.vz"): "roll"})
    assert (port["contact.force"].name, port["B.vz"].name) == ("F", "roll")


@pytest.mark.parametrize(
    ("inputs", "outputs", "given", "said"),
    [
        (
            ["F"],
            ["z"],
            {},
            "no variable is named as a pantograph's A.x, A.y, A.z, A.vx ...: say which it is by --map A.x",
        ),
        (
            ["F", "G"],
            ends("{}.{}"),
            {},
            "no variable is named as a pantograph's contact.force: say which it is by --map",
        ),
        (["F"], [*ends("a.{}.{}"), *ends("b.{}.{}")], {}, "several variables that could be A.x (a.A.x, b.A.x)"),
        (["Force"], ends("{}.{}"), {"contact.force": "Forse"}, "has no real input 'Forse'; did you mean 'Force'?"),
        (["q"], ends("{}.{}"), {"contact.force": "zzz"}, "has no real input 'zzz'; it has q"),
    ],
)
def test_what_is_not_found_is_one_sentence(make_fmu, inputs, outputs, given, said):
    fmu = read_fmu(make_fmu("X.fmu", inputs, outputs))
    with pytest.raises(RequestError) as error:
        find_ports(fmu, "pantograph", given={(0, name): variable for name, variable in given.items()})
    assert said in str(error.value)


def test_a_line_with_too_few_ports_says_which_is_lacking(make_fmu):
    fmu = read_fmu(make_fmu("X.fmu", ends("{}.{}"), ["contact.force"]))
    with pytest.raises(RequestError, match=r"at port 2 of 2: say which it is by --map pantograph\[2\]\.A\.z=NAME"):
        find_ports(fmu, "line", 2)


def test_only_names_of_ports_can_be_mapped():
    with pytest.raises(RequestError, match=r"'A\.w' is no part of a port; known: A\.x, A\.y"):
        check_given(["A.w"])
