"""Charts as files: what is drawn where."""

import dataclasses

import numpy as np
import pytest

from master.evaluation.contact_quality import figures_of
from master.report.charts.chart import Band
from master.report.charts.force_charts import force_over_time
from master.report.charts.line_charts import geometry_charts, line_marks
from master.report.charts.run_charts import file_charts, run_charts
from master.report.charts.static_figure import static_figure


def drawn(run, name):
    return static_figure(file_charts(run)[name]).axes


def lines(axes):
    return {line.get_label(): line for line in axes.get_lines()}


def test_contact_force_shows_raw_and_filtered_over_track_position(made_up):
    (axes,) = drawn(made_up(), "contact_force")
    curves = lines(axes)
    assert curves["raw"].get_xdata()[0] == pytest.approx(20.0)
    assert np.ptp(curves["raw"].get_ydata()) == pytest.approx(180.0, rel=0.03)
    assert np.ptp(curves["0-20 Hz"].get_ydata()) == pytest.approx(60.0, rel=0.1)
    shown = {c.get_label(): c for c in axes.collections}
    assert len(shown["support"].get_segments()) == 2  # at 50 m and 100 m; 150 m is beyond the run
    assert len(shown["dropper"].get_segments()) == 4
    (band,) = [p for p in axes.patches if p.get_label() == "interval of interest"]
    assert band.get_x() == pytest.approx(50.0)
    assert band.get_width() == pytest.approx(60.0)


def test_uplift_bars_are_in_millimetres_at_their_supports(made_up):
    (axes,) = drawn(made_up(), "uplift")
    bars = [p for c in axes.containers for p in c]
    assert [bar.get_height() for bar in bars] == pytest.approx([40.0] * 3)
    assert [bar.get_x() + 0.5 * bar.get_width() for bar in bars] == pytest.approx([50.0, 100.0, 150.0])


def test_uplift_history_keeps_to_the_interval(made_up):
    (axes,) = drawn(made_up(), "uplift_history")
    assert [line.get_label() for line in axes.get_lines()] == ["50 m", "100 m"]


def test_geometry_shows_elevation_and_plan(line_geometry):
    elevation, plan = static_figure(geometry_charts("line", line_geometry)).axes
    wire = lines(elevation)["contact wire"]
    assert wire.get_xdata().tolist() == sorted(wire.get_xdata())
    assert len(wire.get_xdata()) == 7
    assert max(lines(elevation)["messenger wire"].get_ydata()) == pytest.approx(6.48)
    assert max(plan.get_lines()[0].get_ydata()) == pytest.approx(200.0)
    assert "[mm]" in plan.get_ylabel()


def test_what_has_no_data_has_no_plot(made_up):
    bare = dataclasses.replace(made_up(with_geometry=False), recordings=(made_up().recordings[0],))
    assert set(file_charts(bare)) == {"contact_force", "contact_height"}
    assert geometry_charts("line", {"support[1].x": 1.0}) == []


@pytest.fixture
def on_ring(made_up):
    """The run on a line of supports at 50 and 100 m that repeats after 100 m, interest in 110 to 125 m."""
    run = made_up()
    gone = ("support[3]", "dropper[3]", "dropper[4]")
    values = {k: v for k, v in run.geometry["catenary"].items() if k[:10] not in gone}
    settings = run.summary["settings"] | {"interval": {"start": 110.0, "end": 125.0}}
    summary = run.summary | {"settings": settings}
    return dataclasses.replace(run, summary=summary, geometry={"catenary": values | {"period": 100.0}})


def test_supports_of_a_line_that_closes_on_itself_are_marked_in_every_lap(on_ring):
    (axes,) = drawn(on_ring, "contact_force")
    shown = {c.get_label(): c for c in axes.collections}
    assert [s[0, 0] for s in shown["support"].get_segments()] == [50.0, 100.0]
    assert [s[0, 0] for s in shown["dropper"].get_segments()] == [55.0, 80.0]
    supports, droppers = (mark.x for mark in line_marks(on_ring, "catenary", (120.0, 260.0)))
    assert sorted(set(supports)) == [150.0, 200.0, 250.0]
    assert sorted(set(droppers)) == [155.0, 180.0, 255.0]


def test_the_interval_of_a_later_lap_has_its_supports(on_ring):
    settings = on_ring.summary["settings"] | {"interval": {"start": 140.0, "end": 160.0}}
    run = dataclasses.replace(on_ring, summary=on_ring.summary | {"settings": settings})
    (axes,) = drawn(run, "uplift_history")
    assert [line.get_label() for line in axes.get_lines()] == ["50 m"]


def test_charts_over_places_of_one_lap_say_so(made_up):
    ends = made_up()
    ring = dataclasses.replace(ends, geometry={"catenary": ends.geometry["catenary"] | {"period": 200.0}})
    for run, named in ((ring, True), (ends, False)):
        (bars,) = [c for c in run_charts(run, run.signals) if c.key == "uplift"]
        (droppers,) = [c for c in run_charts(run, run.signals) if c.key == "droppers_catenary"]
        for chart in (bars, droppers):
            assert ("in its lap" in chart.x.label) == named
            assert any(isinstance(part, Band) for part in chart.parts) != named  # the interval is not of one lap


def test_a_run_whose_speed_changes_shows_its_force_over_time_too(made_up):
    """And its figures are those of the interval's own mean speed: its way over its time."""
    steady = made_up().signals
    assert force_over_time(steady) == []
    assert "contact_force_over_time" not in file_charts(made_up())
    s = steady[0]
    faster = dataclasses.replace(
        s, position=s.position[0] + 20.0 * (s.time - s.time[0]) + 2.0 * (s.time - s.time[0]) ** 2
    )
    (chart,) = force_over_time([faster])
    assert chart.x.name == "time"
    inside = (faster.position > 25.0) & (faster.position < 60.0)
    quality = figures_of(dataclasses.replace(faster, inside=inside).sampled, s.filter, 1)
    t = faster.time[inside]
    way = faster.position[inside]
    assert quality.speed == pytest.approx((way[-1] - way[0]) / (t[-1] - t[0]))
    assert 20.0 < quality.speed < 60.0
