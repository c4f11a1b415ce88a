"""Which dropper matters: each fault alone against the healthy line."""

import math
import re

import numpy as np
import pytest

from master.batch.sweep.pages.criticality import criticalities, criticality_charts, ranking_rows, unseen_note
from master.batch.sweep.pages.sweep_page import chapters, page
from tests.master.batch.sweep.pages.conftest import failure, row, view

FAULTS = [f"line.fault[{k}].active" for k in (1, 2, 3)]
PLACES = {
    f: f"whether it acts; dropper {d} of span 14 at {x} m, supports at 601.00 and 650.50 m [choice: default [2]]"
    for f, d, x in zip(FAULTS, (3, 1, 2), (618.70, 605.20, 611.95), strict=True)
}


def acting(*numbers):
    return {f: "1" if k in numbers else "0" for k, f in enumerate(FAULTS, 1)}


ROWS = [
    row(1, acting(), maximum=200.0, sigma=40.0),
    row(2, acting(1), maximum=210.0, sigma=39.0),
    row(3, acting(2), maximum=230.0, sigma=44.0),
    row(4, acting(3), maximum=190.0, sigma=41.0),
    row(5, acting(1, 2), maximum=900.0, sigma=90.0),
]


def faults(rows, places=PLACES):
    setting = {"limits": None, "speeds": {}, "places": places}
    whole = view(rows, dict.fromkeys(FAULTS, ""), setting=setting)
    return criticalities(whole, whole.rows_of("front"), [])


def test_each_fault_alone_is_compared_with_the_healthy_line():
    (found,) = faults(ROWS)
    assert [d.position for d in found.parts] == [605.20, 611.95, 618.70]
    assert found.parts[0].name == "span 14, dropper 1"
    assert [f.name for f in found.figures] == ["maximum", "sigma", "uplift"]
    assert found.healthy[:2] == (200.0, 40.0)
    assert found.faulty[:, 0].tolist() == [230.0, 190.0, 210.0]


def test_bars_stand_at_the_droppers():
    chart = criticality_charts(faults(ROWS), "f")[0]
    bars, span = chart.parts
    assert bars.x.tolist() == [605.20, 611.95, 618.70]
    assert bars.y.tolist() == [30.0, -10.0, 10.0]
    assert (np.nanmin(span.x), np.nanmax(span.x)) == (601.0, 650.5)
    upright = np.flatnonzero(np.diff(span.x) == 0.0)
    assert sorted(set(span.x[upright])) == [601.0, *bars.x.tolist(), 650.5], "supports and droppers"
    assert np.nanmax(span.y) < -10.0, "below all bars"
    assert chart.y.limits[0] < np.nanmin(span.y)
    assert min(chart.y.ticks) == -10.0


def test_what_no_fault_changes_has_no_chart():
    assert [c.title for c in criticality_charts(faults(ROWS), "f")] == ["Change of maximum", "Change of sigma"]


def test_arms_stand_at_their_supports_other_faults_have_their_words():
    words = (
        "steady arm of support 13 at 601.00 m",
        "steady arm of support 14 at 650.50 m",
        "contact wire from 5 m to 9 m",
    )
    places = {f: f"whether the fault acts: 1 yes, 0 no; {w}" for f, w in zip(FAULTS, words, strict=True)}
    (found,) = faults([ROWS[0], *ROWS[2:4]], {**places, FAULTS[2]: places[FAULTS[0]], FAULTS[0]: ""})
    assert [(p.name, p.position) for p in found.parts] == [
        ("steady arm of support 13", 601.0),
        ("steady arm of support 14", 650.5),
    ]
    bars, span = criticality_charts([found], "f")[0].parts
    assert bars.width == 5.0
    assert (np.nanmin(span.x), np.nanmax(span.x)) == (601.0, 650.5)
    (found,) = faults(ROWS[:4], places)
    assert criticality_charts([found], "f")[0].parts[0].x == (*(w.split(" at")[0] for w in words[:2]), words[2])


def test_the_ranking_begins_with_the_greatest_maximum():
    rows = ranking_rows(faults(ROWS))
    assert rows[0][:3] == ["none, the healthy line", "", "200.0"]
    assert [r[0] for r in rows[1:]] == ["span 14, dropper 1", "span 14, dropper 3", "span 14, dropper 2"]
    assert rows[1][1:4] == ["605.20", "230.0 (+15.0 %)", "44.0 (+10.0 %)"]


def test_without_places_droppers_have_the_names_of_their_faults():
    (found,) = faults(ROWS, {})
    assert math.isnan(found.parts[0].position)
    (bars,) = criticality_charts([found], "f")[0].parts
    assert bars.x == ("line.fault[1]", "line.fault[2]", "line.fault[3]")


def test_a_fault_whose_run_failed_is_not_drawn_as_harmless():
    rows = [*ROWS[:3], failure(4, acting(3), "no")]
    (found,) = faults(rows)
    assert [d.name for d in found.parts] == ["span 14, dropper 1", "span 14, dropper 3"]
    missing = [*ROWS[:3], row(4, acting(3), maximum=None, sigma=None, mean=None)]
    (found,) = faults(missing)
    assert np.isnan(found.faulty[1, 0])
    assert ranking_rows([found])[-1][2] == "-"


def test_faults_where_no_run_is_judged_are_told():
    at = [float(re.search(r" at ([\d.]+) m", PLACES[fault])[1]) for fault in FAULTS]
    assert unseen_note(PLACES, (min(at), max(at))) == unseen_note(PLACES, (None, None)) == ""
    assert unseen_note({FAULTS[0]: "", "line.speed": "x; dropper 1 of span 2 at 5.00 m"}, (10.0, 20.0)) == ""
    told = unseen_note(PLACES, (min(at) + 0.1, None))
    assert told.startswith(f"1 of 3 faults lie outside the interval of interest, from {min(at) + 0.1:g} m, in which")
    assert "(span 14, dropper 1)" in told
    assert "3 of 3 faults" in unseen_note(PLACES, (0.0, 1.0))
    setting = {"places": PLACES, "interval": [0.0, 1.0]}
    (chapter, *_) = chapters(view(ROWS, dict.fromkeys(FAULTS, ""), setting=setting))
    assert chapter.text[0].startswith("<p class='warning'>3 of 3 faults lie outside")


@pytest.mark.parametrize("rows", [ROWS[1:], ROWS[:1], []], ids=["no healthy line", "no fault", "nothing"])
def test_without_a_comparison_there_is_none(rows):
    assert faults(rows) == []


def test_the_page_shows_what_acts_and_mixes_no_faults_into_its_other_charts():
    rows = [
        row(10 * i + r["run"], {**{f: r[f] for f in FAULTS}, "speed [km/h]": v}, maximum=r["maximum [N]"] + v)
        for i, v in enumerate((200.0, 300.0))
        for r in ROWS
    ]
    whole = view(rows, {**dict.fromkeys(FAULTS, ""), "speed [km/h]": ""}, over=("speed",), setting={"places": PLACES})
    faults, curves = chapters(whole)
    assert [b.name for b in faults.charts[0].parts[:2]] == ["speed 200 km/h", "speed 300 km/h"]
    maximum = next(c for c in curves.charts if c.title == "Maximum")
    assert [p.y.tolist() for p in maximum.parts] == [[400.0, 500.0]]
    html = page(whole)
    assert "<td>span 14, dropper 3; span 14, dropper 1</td>" in html
    assert "3: line.fault[1].active to line.fault[3].active" in html
