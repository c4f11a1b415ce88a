"""Recordings read back from their files."""

import pytest

from master.errors import MasterError
from master.recording.recording import header, load

NAME = "clock.pantograph[1].contact.force"


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
