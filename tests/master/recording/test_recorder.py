"""Recording: time labels, file and memory alike, reading back."""

import numpy as np
import pytest

from master.coupling.coupling_schemes import Jacobi
from master.coupling.macro_steps import TimeGrid, simulate
from master.coupling.network import Network
from master.errors import MasterError
from master.recording.recorder import RecordedValues, Recorder
from master.recording.recording import header, load
from master.system.connections import Connection
from master.system.variable_names import matcher

NAME = "clock.pantograph[1].contact.force"


def record(fake_slave, path, count, every=1, flow=lambda s, u, t, h: np.array([t + h])):
    """The slave's output is the time at the end of its last step."""
    slave = fake_slave("clock", ("u",), ("pantograph[1].contact.force",), np.array([2.0]), flow)
    network = Network([slave], [Connection("clock", "pantograph[1].contact.force", "clock", "u")])
    recorder = Recorder(path, [RecordedValues(network.output_names, network.outputs)], {NAME: "N"}, every)
    simulate(network, Jacobi(), TimeGrid(2.0, 1e-3, count), [recorder])
    return recorder


def test_header(tmp_path, fake_slave):
    record(fake_slave, tmp_path / "a.csv", 3)
    assert (tmp_path / "a.csv").read_text().splitlines()[0] == f"time [s],{NAME} [N]"


@pytest.mark.parametrize("every", [1, 5])
def test_labels_are_the_times_at_which_values_hold(tmp_path, fake_slave, every):
    recorder = record(fake_slave, tmp_path / "a.csv", 1000, every)
    recording = recorder.read_back()
    assert len(recording.time) == 1000 // every + 1
    assert recording[NAME] == pytest.approx(recording.time, abs=1e-12)
    assert recording.time == pytest.approx([2.0 + n * 1e-3 for n in range(0, 1001, every)], rel=1e-12)


def test_file_and_memory_agree(tmp_path, fake_slave):
    recorder = record(fake_slave, tmp_path / "a.csv", 700)
    again = load(tmp_path / "a.csv")
    assert again.names == (NAME,)
    assert again.units == ("N",)
    assert again.time == pytest.approx(recorder.read_back().time, rel=1e-9)
    assert again[NAME] == pytest.approx(recorder.read_back()[NAME], rel=1e-9)


def test_rows_reach_the_disk_while_the_run_goes_on(tmp_path, fake_slave):
    path, seen = tmp_path / "a.csv", []

    def flow(s, u, t, h):
        seen.append(len(path.read_text().splitlines()) - 1)
        return np.array([t + h])

    record(fake_slave, path, 600, flow=flow)
    assert seen[300] >= 250
    assert seen[-1] >= 500


def test_a_line_cut_short_is_left_out(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time [s],a.b [N],a.c\n0,1,2\n0.5,3,4\n1.0,5,6")
    recording = load(path)
    assert recording.time.tolist() == [0.0, 0.5]
    assert recording.units == ("N", "")


@pytest.mark.parametrize("text", ["", "t,a\n0,1\n", "time [s],a\n0,x\n", "time [s],a\n0,1,2\n0,1\n",
    "time [s],a\n0,1\nnan,2\n", "time [s],a\n0,1\ninf,2\n", "time [s],a\n0,1\n0,2\n",
    "time [s],a\n1,1\n0,2\n"])  # fmt: skip
def test_what_is_no_recording_is_refused(tmp_path, text):
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(MasterError, match=r"a\.csv is not a recording"):
        load(path)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(MasterError, match="cannot be read"):
        load(tmp_path / "none.csv")


def test_header_without_unit():
    assert header(["a.b[1]"], [""]) == ["time [s]", "a.b[1]"]


@pytest.mark.parametrize(
    ("pattern", "name", "fits"),
    [
        ("*.dropper[*].force", "catenary.dropper[12].force", True),
        ("*.dropper[*].force", "catenary.dropper[12].forces", False),
        ("catenary.support[1].uplift", "catenary.support[1].uplift", True),
        ("catenary.support[1].uplift", "catenary.support1.uplift", False),
        ("a.b", "a_b", False),
    ],
)
def test_patterns_take_only_the_star_as_special(pattern, name, fits):
    assert matcher(pattern)(name) is fits
