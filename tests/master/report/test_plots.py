"""Plots as files."""

import dataclasses

import numpy as np
import pytest

from master import plots


def lines(axes):
    return {line.get_label(): line for line in axes.get_lines()}


def test_contact_force_shows_raw_and_filtered_over_track_position(made_up):
    (axes,) = plots.contact_force(made_up()).axes
    drawn = lines(axes)
    assert drawn["raw"].get_xdata()[0] == pytest.approx(20.0)
    assert np.ptp(drawn["raw"].get_ydata()) == pytest.approx(180.0, rel=0.03)
    assert np.ptp(drawn["0-20 Hz"].get_ydata()) == pytest.approx(60.0, rel=0.1)
    shown = {c.get_label(): c for c in axes.collections}
    assert len(shown["support"].get_segments()) == 2  # at 50 m and 100 m; 150 m is beyond the run
    assert len(shown["dropper"].get_segments()) == 4
    (band,) = [p for p in axes.patches if p.get_label() == "interval of interest"]
    assert band.get_x() == pytest.approx(50.0)
    assert band.get_width() == pytest.approx(60.0)


def test_uplift_bars_are_in_millimetres_at_their_supports(made_up):
    (axes,) = plots.uplift(made_up()).axes
    assert [bar.get_height() for bar in axes.patches] == pytest.approx([40.0] * 3)
    assert [t.get_text() for t in axes.get_xticklabels()] == ["50", "100", "150"]


def test_uplift_history_keeps_to_the_interval(made_up):
    (axes,) = plots.uplift_history(made_up()).axes
    assert [line.get_label() for line in axes.get_lines()] == ["50 m", "100 m"]


def test_geometry_shows_elevation_and_plan(line_geometry):
    elevation, plan = plots.geometry(line_geometry).axes
    wire = lines(elevation)["contact wire"]
    assert wire.get_xdata().tolist() == sorted(wire.get_xdata())
    assert len(wire.get_xdata()) == 7
    assert max(lines(elevation)["messenger wire"].get_ydata()) == pytest.approx(6.48)
    assert max(plan.get_lines()[0].get_ydata()) == pytest.approx(0.2)


def test_what_has_no_data_has_no_plot(made_up):
    bare = dataclasses.replace(made_up(with_geometry=False), recordings=(made_up().recordings[0],))
    assert set(plots.all_plots(bare)) == {"contact_force", "contact_height"}
    assert plots.geometry({"support[1].x": 1.0}) is None
