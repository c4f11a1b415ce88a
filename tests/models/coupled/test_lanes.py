"""Lanes against the parts that FMUs are made of, stepped one by one as the scheme jacobi does."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from models.catenary.line_model import CatenaryModel
from models.catenary.line_part import CatenaryPart
from models.commands.physics_main import main
from models.coupled.lane_block import _common_surface
from models.coupled.lanes import Lane, LanePlan, run_lanes, run_singly
from models.definition_files.parameter import ParameterError
from models.library.catalogue import load_lumped
from models.pantograph.lumped.lumped_part import LumpedPantographPart

PLAN = LanePlan(every=10, with_forces=True)
#: What sums in another order leave of a difference over a short run [N].
ROUNDING = 1e-7


@pytest.fixture(scope="module")
def overlap(section_maker, sections_maker):
    first = section_maker(0.0, 4, [0.2, -0.2, 0.2])
    second = section_maker(100.0, 4, [0.2, -0.2, 0.2])
    return sections_maker(first, second)


def lane(*pantographs, steps=400, **values):
    own = {"raise_duration": 0.05, "reference_height": 5.075, **values}
    return Lane(tuple(p.with_values(own | more) for p, more in pantographs), steps)


def compared(definition, lanes, plan=PLAN):
    """Return the runs of the kernels after comparing them with those of the parts."""
    pytest.importorskip("numba")
    model = CatenaryModel(definition)
    found = sorted(run_lanes(model, lanes, plan), key=lambda r: r.number)
    for one, other in zip(found, run_singly(model, lanes, plan), strict=True):
        assert (one.number, one.failure) == (other.number, other.failure)
        assert one.contact.shape == other.contact.shape
        np.testing.assert_allclose(one.contact, other.contact, rtol=0.0, atol=ROUNDING)
        np.testing.assert_allclose(one.strip, other.strip, rtol=0.0, atol=1e-10)
        np.testing.assert_allclose(one.uplift, other.uplift, rtol=0.0, atol=1e-10)
        np.testing.assert_array_equal(one.slack, other.slack)
        np.testing.assert_allclose(one.dropper_force, other.dropper_force, rtol=0.0, atol=ROUNDING)
    return found


def test_trains_of_several_speeds_forces_and_kinds_beside_one_another(short_line, cx):
    blown = replace(cx, aerodynamic_uplift=(0.006, 0.0), aerodynamic_share=(0.7, 0.0, 0.3))
    dsa, one_mass = load_lumped("DSA380"), load_lumped("EN50318_2018")
    lanes = [
        lane((cx, {"speed": 60.0, "start_position": 70.0, "static_force": 150.0})),
        lane((dsa, {"speed": 85.0, "start_position": 80.0, "static_force": 60.0}), steps=300),
        lane((one_mass, {"speed": 40.0, "start_position": 60.0, "strip_offset": 0.1}), strip_length=1.2),
        lane((blown, {"speed": 75.0, "start_position": 60.0, "extrapolation_order": 1})),
    ]
    found = compared(short_line, lanes)
    assert [len(r.contact) for r in found] == [401, 301, 401, 401]
    assert all(r.contact[200:, 0, 0].max() > 50.0 for r in found)


def test_slack_droppers_and_contacts_that_are_lost(line_maker, cx):
    lanes = [
        lane((cx, {"speed": 60.0, "start_position": 70.0, "static_force": 450.0})),
        lane((cx, {"speed": 95.0, "start_position": 60.0, "static_force": 60.0, "reference_height": 5.085})),
    ]
    found = compared(line_maker(alpha=0.001), lanes)
    assert found[0].slack.sum() > 20
    lost = found[1].contact[:, 0, 0] == 0.0
    assert np.count_nonzero(np.diff(lost.astype(int)) == 1) > 1


def test_two_pantographs_a_train_press_on_one_line(short_line, cx):
    lanes = [
        lane((cx, {"start_position": 90.0 + x}), (cx, {"start_position": 90.0 - x}), static_force=250.0, steps=300)
        for x in (3.0, 20.0)
    ]
    found = compared(short_line, lanes)
    assert all((r.contact[200:, :, 0] > 0.0).all() for r in found)


def test_a_train_passes_from_one_wire_to_the_next(overlap, cx):
    (found,) = compared(overlap, [lane((cx, {"speed": 80.0, "start_position": 105.0}), steps=900, static_force=170.0)])
    shared = (found.contact[:, 0, 4:] > 0.0).all(axis=1)
    assert shared.any()
    assert (found.contact[-100:, 0, 5] > 0.0).any()


def test_trains_go_round_a_line_that_closes_on_itself(ring_maker, cx):
    (found,) = compared(ring_maker(), [lane((cx, {"speed": 80.0, "start_position": 470.0}), steps=600)])
    assert found.contact[-1, 0, 1] > 505.0


SURFACE = {
    "sigma": [0.1, "mm", "test"], "exponent": [2, "1", "test"], "from": [0.1, "1/m", "test"], "to": [1, "1/m", "test"],
}  # fmt: skip


def test_trains_run_on_a_surface_that_is_not_smooth(line_maker, cx):
    lanes = [
        lane((cx, {"speed": v, "start_position": 75.0, "reference_height": 5.034}), steps=110) for v in (60.0, 80.0)
    ]
    found = compared(line_maker(running_surface=SURFACE).with_values({"contact.restitution": 0.95}), lanes)
    assert all(run.contact[60:, 0, 0].max() > 10.0 for run in found)


def test_wires_with_surfaces_of_their_own_are_refused(short_line):
    wires, line = (SimpleNamespace(surface=object()), SimpleNamespace(surface=None)), short_line
    with pytest.raises(ParameterError, match="several contact wires with running surfaces"):
        _common_surface(SimpleNamespace(wires=wires, definition=line))


def test_inner_steps_and_coarser_orders_are_those_of_the_parts(short_line, cx):
    line = short_line.with_values({"time_step": 5e-4, "extrapolation_order": 1})
    plan = LanePlan(start=3.0, step=1e-3, every=7)
    lanes = [lane((cx, {"start_position": 70.0, "time_step": 2.5e-4}), steps=200), lane((cx, {}), start_position=60.0)]
    compared(line, lanes, plan)
    held = line.with_values({"extrapolation_order": 0})
    compared(held, [lane((cx, {"start_position": 70.0, "extrapolation_order": 0}), steps=150)])


def test_the_parts_themselves_step_the_same_way(short_line, cx):
    """`run_singly` is the judge of the kernels; here a loop over the parts as FMUs have them judges it."""
    chosen = lane((cx, {"speed": 70.0, "start_position": 70.0}), steps=250)
    line, train = CatenaryPart(short_line), LumpedPantographPart(chosen.pantographs[0])
    base = np.zeros(2)
    train.initialise(0.0, 0.0, np.zeros(3), base)
    line.initialise(0.0, train.strip[None])
    train.initialise(0.0, float(line.contact_force[0]), line.contact_point[0], base)
    forces = [line.contact_force.copy()]
    for _ in range(chosen.steps):
        force, point, strip = float(line.contact_force[0]), line.contact_point[0].copy(), train.strip[None].copy()
        line.step(strip, 1e-3)
        train.step(force, point, base, 1e-3)
        forces.append(line.contact_force.copy())
    (found,) = run_singly(CatenaryModel(short_line), [chosen], PLAN)
    assert np.array_equal(found.contact[:, :, 0], np.array(forces))
    assert found.contact[-1, 0, 0] > 50.0


def test_a_free_lane_takes_the_next_run_and_nobody_notices(short_line, cx):
    pytest.importorskip("numba")
    model = CatenaryModel(short_line)
    lanes = [
        lane((cx, {"start_position": 60.0 + i, "static_force": 120.0 + 5.0 * i}), steps=60 + 3 * (i % 5))
        for i in range(24)
    ]
    found = sorted(run_lanes(model, lanes, PLAN), key=lambda r: r.number)
    assert [len(r.contact) for r in found] == [ln.steps + 1 for ln in lanes]
    for number in (0, 5, 23):
        (alone,) = run_lanes(model, [lanes[number]], PLAN)
        np.testing.assert_allclose(found[number].contact, alone.contact, rtol=0.0, atol=1e-9)


def test_a_strip_inside_the_wire_is_told_and_the_others_go_on(short_line, cx):
    lanes = [lane((cx, {"reference_height": 5.4}), start_position=70.0, steps=20), lane((cx, {}), steps=20)]
    found = compared(short_line, [lanes[0], lane((cx, {"start_position": 70.0}), steps=20)])
    assert "above the contact wire" in found[0].failure
    assert found[1].failure == ""


@pytest.fixture
def job(tmp_path, monkeypatch):
    """Function that writes a job and runs it; returns the exit code."""
    data = {
        "format": 1,
        "line": "line.toml",
        "line_values": {"contact_wire.tension": 19e3},
        "pantographs": ["train.toml"],
        "start": 0.0,
        "step": 1e-3,
        "every": 5,
        "dropper_forces": False,
        "lanes": [{"steps": 12, "pantographs": [{"start_position": 100.0, "reference_height": 5.075}]}],
    }
    from tests.models.conftest import LIBRARY

    (tmp_path / "line.toml").write_bytes((LIBRARY / "lines" / "generic_simple.toml").read_bytes())
    (tmp_path / "train.toml").write_bytes((LIBRARY / "pantographs" / "generic.toml").read_bytes())
    monkeypatch.setenv("OPENPANTO_KERNEL", "numpy")  # kernels are tested above; here they would only be compiled

    def made(**changes):
        (tmp_path / "job.json").write_text(json.dumps(data | changes))
        return main(["lanes", str(tmp_path / "job.json"), "--out", str(tmp_path / "out")])

    return made


def test_the_command_leaves_a_file_for_every_run(job, tmp_path, capsys):
    from master.safety.array_container import unpack

    assert job() == 0
    assert capsys.readouterr().out.splitlines() == ["line 1", "lane 0 complete"]
    header, arrays = unpack((tmp_path / "out" / "lane_0.arrays").read_bytes())
    assert arrays["contact"].shape == (13, 1, 5)
    assert arrays["slack"].shape[0] == 3
    assert header["failure"] == ""
    geometry = unpack((tmp_path / "out" / "line.arrays").read_bytes())[0]["geometry"]
    assert geometry["support[2].x"] > geometry["support[1].x"]
    assert geometry["contact_wire.end"] > 500.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"format": 9}, "format 1"),
        ({"more": 1}, "no more and no less"),
        ({"step": 0.0}, "step must be above 0"),
        ({"lanes": []}, "there is no lane"),
        ({"lanes": [{"steps": 0, "pantographs": [{}]}]}, "steps above 0"),
        ({"lanes": [{"steps": 3, "pantographs": []}]}, "the values of 1 pantograph"),
        ({"lanes": [{"steps": 3, "pantographs": [{"speeed": 1.0}]}]}, "speeed"),
        ({"lanes": [{"steps": 3, "pantographs": [{"monitor_energy": 1}]}]}, "no balance of energy"),
        ({"lanes": [{"steps": 3, "pantographs": [{"follow_height": 1}]}]}, "no pantograph follows the height"),
        ({"lanes": [{"steps": 3, "pantographs": [{"use_train": 1}]}]}, "use_train = 1: a run in lanes"),
        ({"line_values": {"monitor_energy": 1}}, "no balance of energy"),
        ({"start": "soon"}, "not a job for lanes"),
        ({"line": "train.toml"}, "train.toml"),
    ],
)
def test_a_wrong_job_is_told_in_a_sentence(job, changes, words, capsys):
    assert job(**changes) == 1
    said = capsys.readouterr().err
    assert said.startswith("error: ")
    assert words in said
