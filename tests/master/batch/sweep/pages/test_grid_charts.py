"""Curves and maps of a grid: every value in its place, the limit where there is one, few curves of many values."""

import numpy as np
import pytest

from master.batch.sweep.pages.grid_charts import MOST_CURVES, curve_charts, evenly, map_charts, ordered
from master.report.charts.chart import LIMIT, Cells, Curve, Envelope, Level
from tests.master.batch.sweep.pages.conftest import failure, grid_rows, row, view


def parts_of(charts, title, kind):
    (chart,) = (c for c in charts if c.title == title)
    return [p for p in chart.parts if isinstance(p, kind)]


def curves(grid):
    return curve_charts(grid, grid.rows_of("front"), ordered(grid, grid.of_kind("grid")), "c")


def test_there_is_a_curve_for_each_value_of_the_other_parameter(grid):
    found = {c.name: c for c in parts_of(curves(grid), "Sigma", Curve) if c.stroke.colour != LIMIT}
    assert list(found) == ["tension 18 kN", "tension 20 kN", "tension 22 kN"]
    assert found["tension 18 kN"].x.tolist() == [200.0, 225.0, 250.0, 275.0, 300.0]
    assert found["tension 22 kN"].y == pytest.approx(0.15 * found["tension 22 kN"].x - 2.0)


def test_the_limit_is_a_level_or_a_curve_over_the_speed(grid):
    found = curves(grid)
    (level,) = parts_of(found, "Sigma / mean", Level)
    assert level.at == 0.3
    (limit,) = (c for c in parts_of(found, "Maximum", Curve) if c.stroke.colour == LIMIT)
    assert limit.y.tolist() == [300.0, 350.0, 350.0, 350.0, 350.0]
    limits = [c.name for c in parts_of(found, "Mean", Curve) if c.stroke.colour == LIMIT]
    assert limits == ["lower limit", "upper limit"]


def test_a_run_that_failed_is_a_gap_in_its_curve():
    rows = grid_rows([200.0, 250.0, 300.0], [20.0])
    rows[1] = failure(2, {"speed [km/h]": 250.0, "tension [kN]": 20.0}, "no")
    whole = view(
        [*rows, row(4, {"speed [km/h]": 250.0, "tension [kN]": 22.0})],
        {"speed [km/h]": "", "tension [kN]": ""},
        over=("speed", "tension"),
    )
    first = parts_of(curves(whole), "Sigma", Curve)[0]
    assert np.isnan(first.y).tolist() == [False, True, False]


def test_of_many_curves_some_are_drawn_and_the_chart_says_so():
    rows = grid_rows(np.linspace(200.0, 300.0, 20).tolist(), np.linspace(15.0, 25.0, 15).tolist())
    whole = view(rows, {"speed [km/h]": "", "tension [kN]": ""}, over=("speed", "tension"))
    chart = next(c for c in curves(whole) if c.title == "Sigma")
    drawn = [p.name for p in chart.parts if isinstance(p, Curve) and p.stroke.colour != LIMIT]
    assert len(drawn) == MOST_CURVES
    assert (drawn[0], drawn[-1]) == ("tension 15 kN", "tension 25 kN")
    assert chart.note == f"{MOST_CURVES} of 15 curves; the table has all."


def test_with_samples_a_curve_is_their_median_in_the_band_of_their_quantiles():
    rows = [
        row(10 * i + k, {"v [km/h]": v, "a [1]": float(k)}, sigma=v / 10 + k)
        for i, v in enumerate((200.0, 300.0))
        for k in range(101)
    ]
    whole = view(rows, {"v [km/h]": "", "a [1]": "normal(0, 1)"}, over=("v",))
    charts = curve_charts(whole, whole.rows_of("front"), whole.of_kind("grid"), "c")
    (band,), (curve,) = (parts_of(charts, "Sigma", kind) for kind in (Envelope, Curve))
    assert curve.y.tolist() == [70.0, 80.0]
    assert (band.low.tolist(), band.high.tolist()) == ([25.0, 35.0], [115.0, 125.0])


def test_a_map_has_every_value_in_its_cell_and_hatches_those_beyond_the_limit(grid):
    found = map_charts(grid, grid.rows_of("front"), ordered(grid, grid.of_kind("grid")), "m")
    (cells,) = parts_of(found, "Sigma [N]", Cells)
    assert cells.values.shape == (3, 5)
    for r, tension in enumerate((18.0, 20.0, 22.0)):
        for c, speed in enumerate((200.0, 225.0, 250.0, 275.0, 300.0)):
            assert cells.values[r, c] == 0.15 * speed - (tension - 20.0)
            assert cells.words[r][c] == f"{cells.values[r, c]:.1f}"
            assert cells.hatched[r, c] == (cells.values[r, c] >= 45.0)
    assert "tension 18 kN: sigma 47.0 N, limit not met" in cells.hints[0][4]
    (unmet,) = parts_of(found, "Limits that are not met", Cells)
    assert unmet.values.tolist() == cells.hatched.astype(float).tolist()


def test_a_map_of_many_values_thins_its_labels_and_a_cell_without_a_run_is_empty():
    speeds, tensions = np.linspace(200.0, 300.0, 25).tolist(), np.linspace(15.0, 25.0, 20).tolist()
    rows = grid_rows(speeds, tensions)
    rows[7] = failure(8, {"speed [km/h]": speeds[0], "tension [kN]": tensions[7]}, "no")
    whole = view(rows, {"speed [km/h]": "", "tension [kN]": ""}, over=("speed", "tension"))
    chart = next(
        c
        for c in map_charts(whole, whole.rows_of("front"), ordered(whole, whole.of_kind("grid")), "m")
        if c.title.startswith("Sigma")
    )
    (cells,) = chart.parts
    assert len(chart.x.ticks) <= 20 < cells.values.shape[1]
    assert np.argwhere(np.isnan(cells.values)).tolist() == [[7, 0]]
    assert cells.words[7][0] == ""


def test_evenly_keeps_the_ends():
    assert evenly([1, 2, 3], 5) == [1, 2, 3]
    assert evenly(list(range(11)), 3) == [0, 5, 10]


def test_limits_are_seen_with_their_words(grid):
    for chart in curves(grid):
        low, high = chart.y.limits
        levels = [p.at for p in chart.parts if isinstance(p, Level)]
        points = np.concatenate([p.y for p in chart.parts if isinstance(p, Curve)])
        assert low <= np.nanmin(points)
        assert high > max([*levels, np.nanmax(points)])


def test_maps_of_one_figure_have_one_scale_of_colours():
    rows = [
        row(100 * i + k, {"v": v, "t": t, "law": law}, sigma=v + t + 100.0 * i)
        for i, law in enumerate("ab")
        for k, (v, t) in enumerate(((1.0, 1.0), (1.0, 2.0), (2.0, 1.0), (2.0, 2.0)))
    ]
    whole = view(rows, {"v": "", "t": "", "law": ""}, over=("v", "t", "law"))
    charts = map_charts(whole, rows, ordered(whole, whole.of_kind("grid")), "m")
    first, second = (next(c.parts[0] for c in charts if c.title == f"Sigma [N], law {law}") for law in "ab")
    assert first.span == second.span == (2.0, 104.0)
    assert first.colours[0][0] != second.colours[0][0]
    assert second.colours[1][1] == "#252d64"
