"""Measurements beside simulations: read, filtered alike, compared."""

import numpy as np
import pytest

from master.errors import MasterError
from master.evaluation.measured_force import compare_measured, read_measured
from master.report.charts.measured_charts import comparison_rows
from tests.master.report.conftest import _made_up


def write(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def as_csv(title, xs, fs):
    return "\n".join([title, *(f"{x:.6f},{f:.6f}" for x, f in zip(xs, fs, strict=True))])


@pytest.fixture
def signals():
    return _made_up().signals[0]


def test_a_measurement_of_the_simulation_itself_correlates_fully(signals, tmp_path):
    over_x = write(tmp_path / "x.csv", as_csv("position [m],force [N]", signals.position, signals.raw))
    over_t = write(tmp_path / "t.csv", as_csv("time [s],force [N]", signals.time, signals.raw))
    for path in (over_x, over_t):
        found = compare_measured(signals, read_measured(path))
        assert found.correlation == pytest.approx(1.0, abs=1e-6)
        assert found.rms < 0.01
        assert found.start == pytest.approx(50.0, abs=0.07)


def test_units_separators_and_further_columns(signals, tmp_path):
    rows = [f"{x / 1e3:.7f};7;{f / 1e3 + 0.01:.7f}" for x, f in zip(signals.position, signals.raw, strict=True)]
    path = write(tmp_path / "m.csv", "\ufeffposition [km];mark;Force (kN)\n" + "\n".join(rows) + "\n\n")
    found = compare_measured(signals, read_measured(path))
    rows = {r[0]: r[1:] for r in comparison_rows(found)}
    assert rows["mean force [N]"][2] == "-10.0"
    assert rows["standard deviation [N]"][2] == "+0.0"
    assert rows["correlation"][2] == "1.000"


@pytest.mark.parametrize(("every", "gap", "is_coarse"), [(1, None, False), (20, None, False), (40, None, True),
                                                         (1, (70.0, 72.4), True)])  # fmt: skip
def test_rows_too_far_apart_for_the_filter_are_told(signals, tmp_path, every, gap, is_coarse):
    """20 Hz needs a row every 25 ms at least; at 60 m/s a gap of 2.4 m takes 40 ms."""
    kept = np.zeros(len(signals.time), dtype=bool)
    kept[::every] = True
    if gap is not None:
        kept &= (signals.position < gap[0]) | (signals.position > gap[1])
    for title, there in (("time [s]", signals.time), ("position [m]", signals.position)):
        path = write(tmp_path / "m.csv", as_csv(f"{title},force [N]", there[kept], signals.raw[kept]))
        found = compare_measured(signals, read_measured(path))
        assert bool(found.coarse) == is_coarse
        assert not is_coarse or "40 ms apart; 20 Hz needs at most 25 ms" in found.coarse.replace("41 ms", "40 ms")
        assert found.part == ""


def test_a_measurement_of_a_part_of_the_interval_is_told(signals, tmp_path):
    half = signals.position < 80.0
    path = write(tmp_path / "m.csv", as_csv("time [s],force [N]", signals.time[half], signals.raw[half]))
    assert "only 49.9 % of the interval" in compare_measured(signals, read_measured(path)).part


def test_noise_above_20_hz_does_not_disturb(signals, tmp_path):
    noise = 40.0 * np.sin(2 * np.pi * 80.0 * signals.time)
    path = write(tmp_path / "m.csv", as_csv("time [s],force [N]", signals.time, signals.raw + noise))
    assert compare_measured(signals, read_measured(path)).rms < 0.5


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("position [m],speed [m/s]\n1,2\n", "no column named force"),
        ("force [N]\n1\n", "no column named position or time"),
        ("time [min],force [N]\n1,2\n2,3\n3,4\n", "unit 'min'"),
        ("time [s],force [N]\n1,2\n2,x\n3,4\n", "is not a finite number"),
        ("time [s],force [N]\n1,2\n1,3\n3,4\n", "does not increase"),
        ("time [s],force [N]\n1,2\n2,nan\n3,4\n", "finite"),
        ("", "no column named position or time .*; it is empty"),
        ("PK;Fc\n1;2\n", "no column named position or time .*; it has 'pk', 'fc': rename the columns"),
        ("position [m];Kraft [N]\n1;2\n", "no column named force .*; it has 'position', 'kraft': rename the columns"),
        ("312,5;127,1\n313;128\n", "; it begins with '312,5', '127,1': write a line of titles above"),
        ("position [m],force [N]\n1,2,,3\n", ":2: has 4 cells, the head has 2"),
        ('position [m],force [N]\n"84,312",1\n', "'84,312' in column 1 .*: write a decimal point, and nothing between"),
        (b"position [m],force [N]\n# M\xfcller\n", r"m\.csv is not UTF-8 text \(line 2\): save it as UTF-8"),
    ],
)
def test_what_is_wrong_with_a_measurement_is_said(tmp_path, text, said):
    with pytest.raises(MasterError, match=said):
        read_measured(write(tmp_path / "m.csv", text))


def test_a_measurement_elsewhere_is_refused(signals, tmp_path):
    path = write(tmp_path / "m.csv", "position [m],force [N]\n900,1\n901,2\n902,3\n")
    with pytest.raises(MasterError, match="outside the interval of interest"):
        compare_measured(signals, read_measured(path))


def in_rows(signals, place, mark="."):
    """Return the simulated force as rows over ``place``."""
    rows = (f"{x:.6f};{f:.6f}".replace(".", mark) for x, f in zip(place, signals.raw, strict=True))
    return "\n".join(["position [m];force [N]", *rows, ""])


def test_comments_decimal_commas_tabs_and_decanewtons(signals, tmp_path):
    text = "# run of 3 May\n\n% km 12\n" + in_rows(signals, signals.position, ",").replace(";", "\t")
    found = compare_measured(signals, read_measured(write(tmp_path / "m.csv", text)))
    assert found.rms < 0.01
    tenth = write(tmp_path / "d.csv", as_csv("position [m],force [daN]", signals.position, signals.raw / 10.0))
    assert compare_measured(signals, read_measured(tenth)).rms < 0.01


def test_two_decimal_marks_in_one_table_are_refused(tmp_path):
    path = write(tmp_path / "m.csv", "position [m];force [N]\n1,5;120\n2.5;121\n3;122\n4,5;123\n5.5;124\n")
    with pytest.raises(MasterError, match="a comma in line 2 and a point in line 3"):
        read_measured(path)


def test_empty_cells_at_the_end_of_a_row_are_left_out(tmp_path):
    path = write(tmp_path / "m.csv", "position [m],force [N]\n1,120.5\n2,121,,\n3,122.5\n")
    assert read_measured(path).force.tolist() == [120.5, 121.0, 122.5]


def test_a_force_in_another_unit_than_its_column_says_is_doubted(signals, tmp_path):
    path = write(tmp_path / "m.csv", as_csv("position [m],force [kN]", signals.position, signals.raw))
    (warning,) = compare_measured(signals, read_measured(path)).warnings
    assert warning == "the measured force is 1e+03 times the simulated one: check the unit of its column"


def test_decimal_commas_between_commas_are_explained(tmp_path):
    with pytest.raises(MasterError, match="need columns separated by semicolons or tabs"):
        read_measured(write(tmp_path / "m.csv", "position [m],force [N]\n1,5,120,0\n2,5,121,0\n3,5,122,0\n"))


def test_an_offset_moves_positions_and_times(signals, tmp_path):
    over_x = write(tmp_path / "x.csv", as_csv("position [m],force [N]", signals.position + 12000.0, signals.raw))
    over_t = write(tmp_path / "t.csv", as_csv("time [s],force [N]", signals.time - 3.0, signals.raw))
    for path, offset, said in ((over_x, -12000.0, "x.csv, its positions -12000 m"), (over_t, 3.0, "times +3 s")):
        with pytest.raises(MasterError, match=r"interval of interest \(.*\); --measured-offset D moves it"):
            compare_measured(signals, read_measured(path))
        found = compare_measured(signals, read_measured(path), offset)
        assert found.rms < 0.01
        assert said in found.source


def test_kilometrage_that_falls_counts_back_from_the_offset(signals, tmp_path):
    path = write(tmp_path / "m.csv", in_rows(signals, 12000.0 - signals.position))
    measured = read_measured(path)
    assert measured.falls
    with pytest.raises(MasterError, match=r"the position falls.*D less the measured one"):
        compare_measured(signals, measured)
    found = compare_measured(signals, measured, 12000.0)
    assert found.rms < 0.01
    assert found.correlation == pytest.approx(1.0, abs=1e-6)
    assert found.source == "m.csv, at 12000 m less its positions"
