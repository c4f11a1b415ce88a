"""Ports of a line."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from fmus.builder.fmu_build import build
from fmus.builder.recipe import recipe
from models.catenary.definition.line_reading import load
from models.catenary.line_part import CatenaryPart
from tests.fmus.support import Instance, names_of, refused, run, short_line_recipe

pytest.importorskip("models.catenary.line_part")


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(recipe("Catenary_LN2_P2"), tmp_path_factory.mktemp("fmu"))


@pytest.fixture
def instance(fmu: Path) -> Iterator[Instance]:
    made = Instance(fmu)
    yield made
    made.free()


def test_has_the_ports_of_two_pantographs(fmu, instance):
    assert fmu.name == "Catenary_LN2_P2.fmu"
    assert names_of(instance, "input") == [
        f"pantograph[{p}].{end}.{axis}" for p in (1, 2) for end in "AB" for axis in ("x", "y", "z", "vx", "vy", "vz")
    ]
    outputs = names_of(instance, "output")
    assert outputs[:2] == ["pantograph[1].contact.force", "pantograph[2].contact.force"]
    assert {f"pantograph[2].contact.{axis}" for axis in "xyz"} <= set(outputs)
    assert not any("section" in name for name in outputs)
    uplifts = [n for n in outputs if n.startswith("support")]
    assert uplifts[0] == "support[1].uplift"
    assert len(outputs) == 12 + len(uplifts)


def test_the_nominal_height_is_computed_for_whoever_asks(instance):
    names = [f"pantograph[1].nominal.{axis}" for axis in ("z", "vz")]
    instance.initialise(**{f"pantograph[1].{end}.x": 300.0 for end in "AB"})
    assert instance.get(names) == [5.08, 0.0]
    for end in "AB":
        instance[f"pantograph[1].{end}.x"] = 86.9 + 960.0 + 30.0  # the span in which the wire rises to its anchor
        instance[f"pantograph[1].{end}.vx"] = 50.0
    instance.step(0.0)
    z, rate = instance.get(names)
    assert z > 5.08
    assert rate == pytest.approx(50.0 * (z - 5.08) / 30.0, rel=0.01)
    assert instance["dropper[9].force"] > 0.0  # what is asked for later is up to date, too


def test_a_strip_that_is_not_connected_touches_nothing(instance):
    instance.initialise()
    for n in range(5):
        instance.step(n * 1e-3)
    assert instance.get(["pantograph[1].contact.force", "pantograph[2].contact.force"]) == [0.0, 0.0]


def test_geometry_is_that_of_a_line(instance):
    instance.initialise()
    assert 4.0 < instance["support[3].z"] < 7.0
    assert instance["support[3].messenger_wire.z"] > instance["support[3].z"]
    assert instance["dropper[9].upper.z"] > instance["dropper[9].lower.z"]
    assert instance["dropper[9].length"] > 0.0
    assert instance["dropper[9].force"] > 0.0


def test_only_the_touched_port_feels_the_wire(instance):
    instance.initialise()
    rows = run(instance, range(40), ["pantograph[1].contact.force", "pantograph[2].contact.force"])
    assert rows[-1][0] > 0.0
    assert rows[-1][1] == 0.0


@pytest.fixture(scope="module")
def four(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(recipe("Catenary_LN2_overlap_P4"), tmp_path_factory.mktemp("fmu"))


def test_four_pantographs_on_two_sections(four):
    made = Instance(four)
    outputs = names_of(made, "output")
    assert [n for n in outputs if ".section[" in n] == [
        f"pantograph[{p}].section[{s}].force" for p in (1, 2, 3, 4) for s in (1, 2)
    ]
    made.free()


def test_supports_and_droppers_say_their_section(four):
    with zipfile.ZipFile(four) as archive:
        text = archive.read("modelDescription.xml").decode()
    assert "uplift of the contact wire at support 23 of section 1, x = 1046.9 m" in text
    assert "uplift of the contact wire at support 1 of section 2, x = 1046.9 m" in text
    made = Instance(four)
    supports = [n for n in names_of(made, "calculatedParameter") if n.startswith("support[") and n.endswith(".section")]
    assert len(supports) == 23 + 25
    made.free()


def test_a_strip_between_the_sections_feels_both_wires(four):
    made = Instance(four)
    height = {f"pantograph[3].{end}.z": 5.11 for end in "AB"}
    place = {f"pantograph[3].{end}.x": 1046.9 for end in "AB"}
    made.initialise(**height, **place)
    for n in range(10):
        made.step(n * 1e-3)
    names = [f"pantograph[3].section[{s}].force" for s in (1, 2)]
    one, two, total = made.get([*names, "pantograph[3].contact.force"])
    assert one > 0.0
    assert two > 0.0
    assert total == pytest.approx(one + two)
    assert made.get(["pantograph[1].contact.force"]) == [0.0]
    made.free()


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(short_line_recipe(tmp_path_factory.mktemp("short")), tmp_path_factory.mktemp("fmu"))


def test_fast_modes_can_be_left_out(short, tmp_path):
    """The same forces as of a definition with that value; others than with all modes."""
    name, made, full = "dynamics.highest_frequency", Instance(short), Instance(short)
    (declared,) = (v for v in made.description.modelVariables if v.name == name)
    assert (declared.causality, declared.unit, float(declared.start)) == ("parameter", "Hz", 0.0)
    part = CatenaryPart(load(short_line_recipe(tmp_path).definition).with_values({name: 30.0}))
    part.initialise(0.0, _strip(0))
    made.initialise(**{name: 30.0})
    full.initialise()
    forces = []
    for n in range(60):
        for instance in (made, full):
            for port, value in zip(names_of(instance, "input"), _strip(n).ravel(), strict=True):
                instance[port] = float(value)
            instance.step(n * 1e-3)
        part.step(_strip(n), 1e-3)
        forces.append([*(instance["pantograph[1].contact.force"] for instance in (made, full)), part.contact_force[0]])
    reduced, whole, expected = np.array(forces).T
    assert whole.max() > 100.0
    assert reduced == pytest.approx(expected, rel=1e-12)
    assert np.abs(reduced - whole).max() > 0.1
    for instance in (made, full):
        instance.free()


FAULTS = "".join(
    f'\n[[fault]]\nkind = "{kind}"\nspan = 3\ndropper = {dropper}\nactive = 0\n{value}'
    for kind, dropper, value in (("dropper_broken", 3, ""), ("dropper_slipped", 5, 'value = [20, "mm", "test"]\n'))
) + (
    '\n[[fault]]\nkind = "arm_loose"\nsupport = 2\nactive = 0\n'
    '\n[[fault]]\nkind = "hard_point"\nposition = [120.3, "m", "test"]\nvalue = [5, "kg", "test"]\nactive = 0\n'
)  # fmt: skip


def test_one_fmu_serves_all_samples_of_errors_and_faults(tmp_path, tmp_path_factory):
    """Every sample has the bits of a line made with these values, in a host that knows nothing of it."""
    made_for = short_line_recipe(tmp_path, more=FAULTS)
    fmu = build(made_for, tmp_path_factory.mktemp("fmu"))
    errors = {"irregularity.dropper_length_sigma": 0.01, "irregularity.support_height_sigma": 0.005}
    errors |= {"irregularity.dropper_position_sigma": 0.05, "irregularity.stagger_sigma": 0.01}
    samples: list[dict[str, float]] = [
        {},
        errors | {"irregularity.seed": 1},
        errors | {"irregularity.seed": 2},
        {"fault[1].active": 1},
        {"fault[2].active": 1, "fault[2].value": 0.03},
        {"fault[3].active": 1, "fault[4].active": 1, "fault[4].value": 8.0},
    ]
    found = []
    for values in samples:
        instance, part = Instance(fmu), CatenaryPart(load(made_for.definition).with_values(values))
        instance.initialise(**values)
        numbers = range(1, len(part.droppers) + 1)
        lengths, heights, forces = (
            instance.get([f"dropper[{j}].{name}" for j in numbers]) for name in ("length", "lower.z", "force")
        )
        assert lengths == part.geometry.dropper_length.tolist()
        assert instance.get([f"dropper[{j}].x" for j in numbers]) == part.geometry.dropper_x.tolist()
        assert heights == part.geometry.dropper_lower_z.tolist()
        assert forces == pytest.approx(part.model.static.dropper_force.tolist(), abs=1e-9)
        found.append((lengths, heights, forces))
        instance.free()
    healthy, one, other, broken, slipped, loaded = found
    plain = CatenaryPart(load(short_line_recipe(tmp_path).definition))
    assert healthy[1] == plain.geometry.dropper_lower_z.tolist(), "inactive faults change no digit"
    assert one[0] != other[0]
    third, fifth = 14 + 2, 14 + 4
    assert broken[0] == healthy[0]
    assert broken[2][third] == 0.0
    assert broken[1][third] < healthy[1][third] - 0.005
    assert slipped[0][fifth] == pytest.approx(healthy[0][fifth] + 0.03, abs=1e-12)
    assert loaded[0] == healthy[0], "no fault changes the lengths of the design"
    assert min(np.array(loaded[1]) - healthy[1]) < -0.01


def _strip(n):
    """Return a strip that lifts the middle of LN2 with five spans."""
    return np.array([[[[121.0 + 0.08 * n, y, 5.08], [80.0, 0.0, 0.0]] for y in (0.7, -0.7)]])


def test_names_of_supports_and_droppers_say_what_the_form_finding_says(short, tmp_path):
    """Every static length by its name: contact wire below messenger wire, lower ends below upper ones, on its side."""
    part = CatenaryPart(load(short_line_recipe(tmp_path).definition))
    mesh, positions = part.model.mesh, part.model.static.positions
    made = Instance(short)
    made.initialise()
    for i, node in enumerate(mesh.support_nodes.tolist(), 1):
        found = made.get([f"support[{i}].{axis}" for axis in "xyz"])
        assert found == pytest.approx(positions[node].tolist())
        assert made[f"support[{i}].messenger_wire.z"] == pytest.approx(positions[mesh.sprung[i - 1], 2])
    for j, (lower, upper) in enumerate(mesh.droppers.tolist(), 1):
        names = [f"dropper[{j}].{name}" for name in ("x", "lower.y", "lower.z", "upper.z")]
        below, above = positions[lower], positions[upper]
        assert made.get(names) == pytest.approx([*below, above[2]])
        assert made[f"dropper[{j}].length"] == pytest.approx(float(np.linalg.norm(above - below)), rel=1e-3)
    made.free()


def test_a_strip_s_ends_and_velocities_have_their_own_names(short, tmp_path):
    """A tilted strip that rolls and runs ahead, named value by named value, presses as the part's own array does."""
    part = CatenaryPart(load(short_line_recipe(tmp_path).definition))
    made = Instance(short)

    def strip(n):
        ends = []
        for y, tilt, roll in ((0.7, 0.004, 0.3), (-0.7, -0.004, -0.3)):
            ends.append([[121.0 + 0.08 * n, y, 5.085 + tilt], [80.0, 0.0, roll]])
        return np.array([ends])

    def tell(n):
        for k, end in enumerate("AB"):
            for m, prefix in enumerate(("", "v")):
                for axis, value in zip("xyz", strip(n)[0, k, m].tolist(), strict=True):
                    made[f"pantograph[1].{end}.{prefix}{axis}"] = value

    part.initialise(0.0, strip(0))
    made.slave.setupExperiment(startTime=0.0)
    made.slave.enterInitializationMode()
    tell(0)
    made.slave.exitInitializationMode()
    for n in range(25):
        tell(n)
        made.step(n * 1e-3)
        part.step(strip(n), 1e-3)
    names = [f"pantograph[1].contact.{name}" for name in ("force", "x", "y", "z")]
    assert part.contact_force[0] > 50.0
    assert made.get(names) == pytest.approx([part.contact_force[0], *part.contact_point[0]])
    uplifts = made.get([f"support[{i}].uplift" for i in range(1, len(part.supports) + 1)])
    assert uplifts == pytest.approx(part.support_uplift.tolist())
    forces = made.get([f"dropper[{j}].force" for j in range(1, len(part.droppers) + 1)])
    assert forces == pytest.approx(part.dropper_force.tolist())
    slack = made.get([f"dropper[{j}].slack" for j in range(1, len(part.droppers) + 1)])
    assert slack == part.dropper_slack.tolist()
    made.free()


def test_the_speed_along_the_track_is_what_is_warned_of(short):
    for speeds, expected in (({"vx": 150.0, "vy": 0.0}, 1), ({"vx": 50.0, "vy": 150.0}, 0)):
        made = Instance(short)
        made.initialise(**{f"pantograph[1].A.{name}": value for name, value in speeds.items()})
        made.step(0.0)
        assert sum("wave speed" in text for text in made.warnings) == expected
        made.free()


@pytest.mark.parametrize(("value", "text"), [(-1.0, "is outside 0 ... 1e+09 Hz"), (1.0, "leaves no mode")])
def test_modes_cannot_be_left_out_at_such_frequencies(short, value, text):
    made = Instance(short)
    with refused():
        made.initialise(**{"dynamics.highest_frequency": value})
    with pytest.raises(FMICallException):
        made.step(0.0)
    assert f"parameter 'dynamics.highest_frequency': {value:g} Hz {text}" in made.errors[0]
    made.free()


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(recipe("Catenary_LN2_ring"), tmp_path_factory.mktemp("fmu"))


def _on_ring(instance: Instance, steps: range, place: float) -> list[list[float]]:
    """Step under a strip that runs at 80 m/s from ``place`` and return force, place and an uplift after every step."""
    rows = []
    for n in steps:
        for end in "AB":
            instance[f"pantograph[1].{end}.x"] = place + 0.08 * n
        instance.step(n * 1e-3)
        rows.append(instance.get([*(f"pantograph[1].contact.{v}" for v in ("force", "x", "y")), "support[1].uplift"]))
    return rows


def _raised(path: Path, place: float) -> Instance:
    made = Instance(path)
    ends = {f"pantograph[1].{end}.{name}": v for end in "AB" for name, v in (("x", place), ("z", 5.11), ("vx", 80.0))}
    made.initialise(**ends)
    return made


def test_a_line_that_closes_on_itself_says_so_and_one_that_ends_does_not(ring, fmu):
    made = Instance(ring)
    assert "period" in names_of(made, "calculatedParameter")
    made.initialise()
    assert made["period"] == 990.0
    made.free()
    with zipfile.ZipFile(fmu) as archive:
        assert b'name="period"' not in archive.read("modelDescription.xml")


def test_a_strip_meets_the_same_wire_after_many_laps(ring):
    """Over the place where the line closes, in the first lap and in the fifth."""
    once, later = _raised(ring, 985.0), _raised(ring, 985.0 + 4 * 990.0)
    first = _on_ring(once, range(120), 985.0)
    fifth = _on_ring(later, range(120), 985.0 + 4 * 990.0)
    assert min(row[0] for row in first[60:]) > 10.0
    assert first[-1][1] > 990.0
    assert first[-1][3] > 1e-3  # the support where it closes is lifted
    for one, five in zip(first, fifth, strict=True):
        assert five[0] == pytest.approx(one[0], abs=1e-8)
        assert five[1] - one[1] == pytest.approx(4 * 990.0, abs=1e-9)
        assert five[2:] == pytest.approx(one[2:], abs=1e-12)
    once.free()
    later.free()


def test_a_state_beyond_the_seam_goes_on_bit_for_bit(ring):
    place = 985.0 + 3 * 990.0
    made, other = _raised(ring, place), _raised(ring, 12.0)
    _on_ring(made, range(80), place)
    data = made.slave.serializeFMUstate(made.slave.getFMUstate())
    expected = _on_ring(made, range(80, 120), place)
    other.slave.setFMUstate(other.slave.deSerializeFMUstate(data))
    assert _on_ring(other, range(80, 120), place) == expected
    assert expected[-1][0] > 10.0
    made.free()
    other.free()
