"""Tables of signals: what is read of them, and what is told of those that cannot be read."""

import time

import numpy as np
import pytest

from models.signals.signal_reading import SignalFileError, read_signals

GOOD = "time [s],base.z [mm],train.vx [km/h]\n0,0,72\n0.5,10,90\n"


@pytest.fixture
def file(tmp_path):
    def write(text):
        path = tmp_path / "roof.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


@pytest.mark.parametrize("text", [GOOD, GOOD.replace("\n", "\r\n"), "\ufeff" + GOOD, GOOD + "\n\n"])
def test_columns_are_read_in_si(file, text):
    found = read_signals(file(text))
    assert (found.names, found.units) == (("base.z", "train.vx"), ("m", "m/s"))
    np.testing.assert_allclose(found.time, [0.0, 0.5])
    np.testing.assert_allclose(found.values, [[0.0, 20.0], [0.01, 25.0]])


def test_another_column_may_hold_the_times(file):
    found = read_signals(file("force [kN],clock [ms]\n1,0\n2,500\n"), "clock")
    assert found.names == ("force",)
    np.testing.assert_allclose(found.time, [0.0, 0.5])
    np.testing.assert_allclose(found.values, [[1000.0], [2000.0]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time [s]\n0\n1\n", "line 1: needs a column of times and at least one more"),
        ("time [s];z [m]\n0;1\n", "separate them by commas"),
        ("time [s],z\n0,1\n1,1\n", "line 1, column 2 ('z'): has no unit: write 'name [unit]'"),
        ("time [s],z [furlong]\n0,1\n1,1\n", "line 1, column 2 ('z'): has the unknown unit 'furlong'"),
        ("time [s],v [kmh]\n0,1\n1,1\n", "did you mean 'km/h'?"),
        ("time [s],2z [m]\n0,1\n1,1\n", "line 1, column 2 ('2z'): is no name"),
        ("time [s],a..z [m]\n0,1\n1,1\n", "line 1, column 2 ('a..z'): is no name"),
        ("time [s],<z> [m]\n0,1\n1,1\n", "line 1, column 2 ('<z>'): is no name"),
        ("time [s],z [m],z [m]\n0,1,1\n1,1,1\n", "line 1, column 3 ('z'): is the name of a column before it too"),
        ("t [s],z [m]\n0,1\n1,1\n", "line 1, column 1 ('t'): is not 'time': name the column of the times by --time"),
        ("time [m],z [m]\n0,1\n1,1\n", "has times in a unit of 'm'"),
        ("time [s],z [m]\n0,1\n1,\n", "line 3, column 2 ('z'): is empty"),
        ("time [s],z [m]\n0,1\n1,nan\n", "line 3, column 2 ('z'): is nan"),
        ("time [s],z [m]\n0,1\n1,inf\n", "line 3, column 2 ('z'): is inf"),
        ("time [s],z [m]\n0,1\n1,one\n", "line 3, column 2 ('z'): 'one' is not a number"),
        ("time [s],z [m]\n0,1\n1,1,1\n", "line 3: has 3 values for 2 columns"),
        ("time [s],z [m]\n0,1\n\n1,1\n", "line 3: has 0 values for 2 columns"),
        ("time [s],z [m]\n0,1\n1,1\n1,2\n", "line 4: the time 1 s is that of the line before too; times must rise"),
        ("time [s],z [m]\n0,1\n1,1\n0.5,2\n", "line 4: the time 0.5 s lies before that of the line before"),
        ("time [s],z [m]\n0,1\n", "has 1 row of values where a signal takes at least 2"),
        ("time [s],z [m]\n", "has no row of values"),
        (b"time [s],z [m]\n0,\xff\n", "is not UTF-8 text (line 2): save it as UTF-8"),
        ("", "line 1: needs a column of times"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(file, text, said):
    with pytest.raises(SignalFileError) as caught:
        read_signals(file(text))
    assert said in str(caught.value)
    assert "roof.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(SignalFileError, match="cannot be read"):
        read_signals(tmp_path / "none.csv")


def test_a_column_of_times_that_is_not_there(file):
    with pytest.raises(SignalFileError, match="there is no column 'tme' of times; did you mean 'time'"):
        read_signals(file(GOOD), "tme")


def test_a_hundred_thousand_rows_are_read_within_half_a_second_of_cpu(file):
    """A million within five: what is asked for."""
    rows = "\n".join(f"{0.001 * k:.3f},{k % 7}.25,{k % 90}" for k in range(100_000))
    path = file("time [s],base.z [mm],train.vx [km/h]\n" + rows)
    begin = time.process_time()
    assert len(read_signals(path).time) == 100_000
    assert time.process_time() - begin < 0.5
