"""Recording: time labels, file and memory alike, reading back."""

import numpy as np
import pytest

from master.coupling.coupling_schemes import Jacobi
from master.coupling.macro_steps import TimeGrid, simulate
from master.coupling.network import Network
from master.recording.recorder import RecordedValues, Recorder
from master.recording.recording import load
from master.system.connections import Connection

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


def test_every_source_has_its_columns(tmp_path, fake_slave):
    """In a block of rows as in one."""
    network = Network([fake_slave("s", (), ("y",), np.zeros(1), lambda s, u, t, h: np.zeros(1))], [])
    first, second, read = np.zeros(2), np.zeros(1), []
    sources = [RecordedValues(["a", "b"], first), RecordedValues(["c"], second, lambda: read.append(1))]
    for is_steady in (False, True):
        path = tmp_path / f"{is_steady}.csv"
        recorder = Recorder(path, sources, {}, is_steady=is_steady)
        for n in range(4):
            first[:], second[:] = (10.0 + n, 20.0 + n), 30.0 + n
            recorder.observe(n, 1e-3 * n, network)
        recorder.finish()
        rows = np.loadtxt(path, delimiter=",", skiprows=1)
        assert rows.tolist() == [[1e-3 * n, 10.0 + n, 20.0 + n, 30.0 + n] for n in range(4)]
    assert len(read) == 8


def test_a_block_of_rows_reads_as_one_row_after_the_other(tmp_path, fake_slave):
    """Constant columns, signs of zero, NaN and infinity included."""
    network = Network([fake_slave("s", (), ("y",), np.zeros(1), lambda s, u, t, h: np.zeros(1))], [])
    table = np.random.default_rng(4).standard_normal((30, 7)) * 10.0 ** np.arange(-12, 9, 3)
    table[:, 1], table[:, 3], table[:, 5] = 0.1 + 0.2, np.nan, 0.0
    table[7, 5], table[9, 2] = -0.0, np.inf
    values, written = np.zeros(7), []
    for is_steady in (True, False):
        recorder = Recorder(tmp_path / f"{is_steady}.csv", [RecordedValues("abcdefg", values)], {}, is_steady=is_steady)
        for n, row in enumerate(table):
            values[:] = row
            recorder.observe(n, 1e-3 * n, network)
        recorder.finish()
        written.append(recorder.path.read_text().splitlines()[1:])
    assert written[0] == written[1]
    assert written[1] == [",".join(f"{v:.10g}" for v in (1e-3 * n, *row)) for n, row in enumerate(table)]
    assert "-0" in written[1][7].split(",")


def test_rows_reach_the_disk_while_the_run_goes_on(tmp_path, fake_slave):
    path, seen = tmp_path / "a.csv", []

    def flow(s, u, t, h):
        seen.append(len(path.read_text().splitlines()) - 1)
        return np.array([t + h])

    record(fake_slave, path, 600, flow=flow)
    assert seen[300] >= 250
    assert seen[-1] >= 500
