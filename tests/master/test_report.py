"""Plots and report of a run."""

import dataclasses
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from master import plots, report
from master.contacts import Contact
from master.recorder import Recording
from master.results import Results

CONTACT = Contact(1, "catenary", "pantograph", "catenary.pantograph[1].contact")
GEOMETRY = {
    f"support[{i}].{name}": value
    for i in (1, 2, 3)
    for name, value in (("x", 50.0 * i), ("y", 0.2 * (-1) ** i), ("z", 5.08), ("messenger_wire.z", 6.48))
} | {
    f"dropper[{i}].{name}": value
    for i in (1, 2, 3, 4)
    for name, value in (("x", 30.0 + 25.0 * i), ("lower.y", 0.0), ("lower.z", 5.05), ("upper.z", 6.2))
}


def made_up(status="complete", with_geometry=True):
    time = np.arange(2001) * 1e-3
    x = 60.0 * time + 20.0
    force = 157.0 + 30.0 * np.sin(2 * np.pi * 2.0 * time) + 60.0 * np.sin(2 * np.pi * 60.0 * time)
    names = (CONTACT.force, CONTACT.point("x"), CONTACT.point("z"), "pantograph.A.x", "pantograph.B.x")
    fast = Recording(time, names, ("N", "m", "m", "m", "m"), np.column_stack((force, x, 5.0 + 1e-4 * force, x, x)))
    uplifts = np.column_stack([0.04 * np.exp(-(((time - 0.3 * i) / 0.1) ** 2)) for i in (1, 2, 3)])
    coarse = Recording(time[::5], tuple(f"catenary.support[{i}].uplift" for i in (1, 2, 3)), ("m",) * 3, uplifts[::5])
    summary = {
        "scenario": "<made> & up",
        "status": status,
        "reason": "the wire <broke>",
        "time_reached": 1.0,
        "settings": {"interval": {"start": 50.0, "end": 110.0}, "step": 1e-3, "coupling": {"scheme": "jacobi"}},
        "contacts": [dataclasses.asdict(CONTACT)],
        "interface_power": [{"contact": 1, "energy": 0.5, "transferred": 20.0, "rms": 1.0}],
    }
    return Results(None, summary, (fast, coarse), {"catenary": GEOMETRY} if with_geometry else {})


def lines(axes):
    return {line.get_label(): line for line in axes.get_lines()}


def test_contact_force_shows_raw_and_filtered_over_track_position():
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


def test_uplift_bars_are_in_millimetres_at_their_supports():
    (axes,) = plots.uplift(made_up()).axes
    assert [bar.get_height() for bar in axes.patches] == pytest.approx([40.0] * 3)
    assert [t.get_text() for t in axes.get_xticklabels()] == ["50", "100", "150"]


def test_uplift_history_keeps_to_the_interval():
    (axes,) = plots.uplift_history(made_up()).axes
    assert [line.get_label() for line in axes.get_lines()] == ["50 m", "100 m"]


def test_geometry_shows_elevation_and_plan():
    elevation, plan = plots.geometry(GEOMETRY).axes
    wire = lines(elevation)["contact wire"]
    assert wire.get_xdata().tolist() == sorted(wire.get_xdata())
    assert len(wire.get_xdata()) == 7
    assert max(lines(elevation)["messenger wire"].get_ydata()) == pytest.approx(6.48)
    assert max(plan.get_lines()[0].get_ydata()) == pytest.approx(0.2)


def test_what_has_no_data_has_no_plot():
    bare = dataclasses.replace(made_up(with_geometry=False), recordings=(made_up().recordings[0],))
    assert set(plots.all_plots(bare)) == {"contact_force", "contact_height"}
    assert plots.geometry({"support[1].x": 1.0}) is None


def test_page_is_well_formed_and_escapes_text():
    page = report.page(made_up("failed"), [("Picture", b"png")])
    assert "&lt;made&gt; &amp; up" in page
    assert "This run is failed at t = 1 s. the wire &lt;broke&gt;" in page
    assert "<broke>" not in page
    ET.fromstring(
        page.replace("<!doctype html>", "")
        .replace("<meta charset='utf-8'>", "")
        .replace("'>", "'>")
        .replace("<img alt='Picture' src='data:image/png;base64,cG5n'>", "")
    )


def test_verdict_stands_before_the_pictures():
    page = report.page(made_up(), [("Picture", b"png")])
    assert 0 < page.index("EN 50367") < page.index("<img")
    assert "zero-phase" in page


def test_rows_give_a_dash_where_there_is_no_value():
    (assessment,) = made_up().assessments()
    rows = {r[0]: r[1] for r in report.figure_rows([assessment.quality])}
    assert rows["contact on strip, least [mm]"] == "-"
    assert float(rows["mean force [N]"]) == pytest.approx(assessment.quality.mean, abs=0.05)
    assert float(rows["contact height range [mm]"]) == pytest.approx(18.0, rel=0.05)
