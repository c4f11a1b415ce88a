"""The report of one run: what stands where."""

import base64
import dataclasses
import json
import re

import numpy as np
import pytest

from master.recording.recording import Recording
from master.report import run_page
from master.report.charts.interactive_figure import interactive_figure
from master.report.charts.run_charts import run_charts
from master.report.result_tables import figure_rows
from master.report.run_inputs import inputs_of, quality_rows
from master.report.run_title import run_title
from master.results.run_results import Results
from master.system.contacts import Contact


def unpacked(numbers):
    return np.frombuffer(base64.b64decode(numbers["bdata"]), dtype="<f4")


def charts_of(run):
    return {c.key: c for c in run_charts(run, run.signals)}


def traces_of(chart):
    return {t["name"]: t for t in interactive_figure(chart)["data"]}


def test_the_page_bears_the_names_of_scenario_line_and_pantograph(made_up):
    run = made_up()
    models = {"catenary": "LN2, simple catenary", "pantograph": "Faiveley <CX>, three-stage lumped mass"}
    components = [{"name": name, "description": text, "fmu": f"{name}.fmu"} for name, text in models.items()]
    text = run_page.page(
        dataclasses.replace(run, summary={**run.summary, "title": "CX on LN2", "components": components})
    )
    assert "<h1>CX on LN2</h1>" in text
    assert (
        "scenario &lt;made&gt; &amp; up; catenary: LN2, simple catenary; pantograph: Faiveley &lt;CX&gt;, three" in text
    )
    assert "<b>Faiveley &lt;CX&gt;</b>" in text
    assert "<th class='n'>Faiveley &lt;CX&gt;</th>" in text
    assert "pantograph-catenary interaction</h1>" in run_page.page(run)


def test_a_train_whose_speed_changes_has_no_old_speed_in_its_heading(made_up):
    run = made_up()
    fast = run.recordings[0]
    titled = dataclasses.replace(run, summary={**run.summary, "title": "CX on LN2 at 216 km/h"})
    assert "<h1>CX on LN2 at 216 km/h</h1>" in run_page.page(titled)
    values = fast.values.copy()
    for k, name in enumerate(fast.names):
        if name.endswith(".x"):
            values[:, k] += 2.5 * fast.time**2  # 216 km/h, and 5 m/s2 for 2 s: 252 km/h in the end
    braking = dataclasses.replace(titled, recordings=(dataclasses.replace(fast, values=values), *run.recordings[1:]))
    assert "<h1>CX on LN2, changing speed, 217 to 251 km/h</h1>" in run_page.page(braking)
    for inputs, how in (([], "speed profile"), ([{"name": "use_train", "value": 1}], "speed as inputs say")):
        component = {"name": "pantograph", "fmu": "P.fmu", "inputs": inputs}
        told = dataclasses.replace(braking, summary={**braking.summary, "components": [component]})
        assert f"CX on LN2, {how}, 217 to 251 km/h" in run_title(told)


def test_text_is_escaped_and_incompleteness_is_said_first(made_up):
    page = run_page.page(made_up("failed"))
    assert "&lt;made&gt; &amp; up" in page
    assert "<b>Incomplete.</b> This run failed at t = 1 s. the wire &lt;broke&gt;. The" in page
    assert "<broke>" not in page
    assert page.index("Incomplete") < page.index("class='tiles'")
    assert "so far" in page
    assert "EN 50367, AC not judged" in page
    assert "EN 50367, AC \u2713" not in page


def test_the_first_screen_has_what_en_50367_asks_for(made_up):
    page = run_page.page(made_up())
    tiles = page[page.index("class='tiles'") : page.index("<h2>Figures")]
    names = re.findall(r"class='name'><span>([^<]*)<", tiles)
    assert names == ["Fm", "\u03c3", "Fmax", "Fmin", "uplift", "loss"]
    assert "zero phase" in page


def test_every_criterion_has_its_clause(made_up):
    (assessment,) = made_up().assessments()
    assert all(c.source.startswith("EN 50367") and c.origin in ("recalled", "read") for c in assessment.criteria)
    page = run_page.page(made_up())
    assert all(f"{c.source}; {c.origin}" in page for c in assessment.criteria)


def test_the_page_forbids_itself_the_network(made_up):
    page = run_page.page(made_up())
    assert "Content-Security-Policy" in page
    assert "default-src 'none'" in page
    assert not re.search(r"<(script|img|link)[^>]*(src|href)='http", page)


def test_charts_are_json_with_units_on_every_axis(made_up):
    page = run_page.page(made_up())
    (text,) = re.findall(r"<script type='application/json' id='charts'>(.*?)</script>", page)
    charts = json.loads(text)
    assert len(charts) >= 9
    for key, chart in charts.items():
        for axis in ("xaxis", "yaxis"):
            assert re.search(r"\[.+\]|number", chart["layout"][axis]["title"]["text"]), (key, axis)
        assert page.count(f"id='chart-{key}'") == 1


def test_supports_stand_where_they_are(made_up):
    chart = charts_of(made_up())["force_catenary_1"]
    drawn = traces_of(chart)
    assert sorted(set(unpacked(drawn["support"]["x"]))) == [50.0, 100.0]  # 150 m is beyond the run
    assert sorted(set(unpacked(drawn["dropper"]["x"]))) == [55.0, 80.0, 105.0, 130.0]
    (band,) = interactive_figure(chart)["layout"]["shapes"]
    assert (band["x0"], band["x1"]) == (50.0, 110.0)


def test_raw_and_filtered_differ_in_width_not_in_colour_alone(made_up):
    drawn = traces_of(charts_of(made_up())["force_catenary_1"])
    assert drawn["0-20 Hz"]["line"]["width"] >= 2 * drawn["raw"]["line"]["width"]
    assert np.ptp(unpacked(drawn["raw"]["y"])) == pytest.approx(180.0, rel=0.03)
    assert np.ptp(unpacked(drawn["0-20 Hz"]["y"])) == pytest.approx(60.0, rel=0.1)


def test_slack_droppers_are_marked(made_up):
    chart = charts_of(made_up())["droppers_catenary"]
    slack = traces_of(chart)["slack"]
    assert unpacked(slack["x"]).tolist() == [80.0]
    assert slack["text"] == ["slack 49.9 % of the time"]


def test_droppers_are_marked_slack_when_the_line_says_so(made_up, told_slack):
    slack = traces_of(charts_of(told_slack(made_up(), 3))["droppers_catenary"])["slack"]
    assert unpacked(slack["x"]).tolist() == [80.0, 105.0]
    assert slack["text"] == ["slack 49.9 % of the time", "slack 100.0 % of the time"]


def test_uplift_bars_are_in_millimetres_at_their_supports(made_up):
    (bars,) = interactive_figure(charts_of(made_up())["uplift"])["data"]
    assert unpacked(bars["x"]).tolist() == [50.0, 100.0, 150.0]
    assert unpacked(bars["y"]) == pytest.approx([40.0] * 3)


def test_histograms_sum_to_100_percent(made_up):
    (bars,) = interactive_figure(charts_of(made_up())["histogram"])["data"]
    assert unpacked(bars["y"]).sum() == pytest.approx(100.0, rel=1e-5)


def test_what_has_no_data_has_no_chart(made_up):
    bare = dataclasses.replace(made_up(with_geometry=False), recordings=(made_up().recordings[0],))
    assert set(charts_of(bare)) == {"force_catenary_1", "histogram", "spectrum"}
    nothing = [dataclasses.replace(r, time=r.time[:0], values=r.values[:0]) for r in made_up().recordings]
    empty = dataclasses.replace(made_up("failed"), recordings=tuple(nothing))
    assert "No contact-quality figures" in run_page.page(empty)


def test_rows_give_a_dash_where_there_is_no_value(made_up):
    (assessment,) = made_up().assessments()
    rows = {r[0]: r[1] for r in figure_rows([assessment])}
    assert rows["contact on strip, minimum [mm]"] == "-"
    assert float(rows["mean force [N]"]) == pytest.approx(assessment.quality.mean, abs=0.05)
    assert float(rows["contact height range [mm]"]) == pytest.approx(18.0, rel=0.05)


def test_inputs_say_value_unit_source_and_who_set_them():
    listed = [
        {"name": "tension", "value": "20000", "unit": "N", "description": "tension [Table 5.2]", "changed": False},
        {
            "name": "speed",
            "value": 83.3333333,
            "unit": "m/s",
            "description": "speed [choice: default]",
            "changed": True,
        },
    ]
    first, second = inputs_of({"inputs": listed})
    assert (first.value, first.unit, first.description, first.source) == ("20000", "N", "tension", "Table 5.2")
    assert second.source == "scenario or command line; the FMU's own: choice: default"
    (old,) = inputs_of({"parameters": {"speed": 80.0}})
    assert (old.name, old.value, old.changed) == ("speed", "80", True)


def test_time_is_shared_out_completely():
    performance = {"wall_time": 10.0, "real_time_factor": 0.5, "component_time": {"catenary": 8.0, "pantograph": 1.0}}
    rows = dict(quality_rows({"performance": performance}))
    assert rows["time in catenary"] == "8.00 s (80 %)"
    assert rows["time in the master"].startswith("1.00 s (10 %)")


def longest_run(contacts, seconds, supports, droppers):
    """A run of the size of the longest reference runs."""
    rng = np.random.default_rng(1)
    time = np.arange(round(seconds * 1000) + 1) * 1e-3
    made = [Contact(i, "line", f"pantograph{i}", f"line.pantograph[{i}].contact") for i in range(1, contacts + 1)]
    names, columns = [], []
    for c in made:
        x = 83.3 * time - 100.0 * c.index
        names += [c.force, c.point("x"), c.point("z"), *(c.end(e, "x") for e in "AB")]
        columns += [150.0 + 40.0 * rng.normal(size=len(time)), x, 5.08 + 0.01 * rng.normal(size=len(time)), x, x]
    fast = Recording(time, tuple(names), ("",) * len(names), np.column_stack(columns))
    slow_names = [f"line.support[{i + 1}].uplift" for i in range(supports)]
    slow_names += [f"line.dropper[{i + 1}].force" for i in range(droppers)]
    values = rng.normal(0.0, 1.0, size=(len(time[::5]), len(slow_names)))
    slow = Recording(time[::5], tuple(slow_names), ("",) * len(slow_names), values)
    length = 83.3 * seconds
    geometry = {}
    for kind, n, extra in (
        ("support", supports, ("y", "z", "messenger_wire.z")),
        ("dropper", droppers, ("lower.y", "lower.z", "upper.z")),
    ):
        for i in range(n):
            geometry[f"{kind}[{i + 1}].x"] = length * (i + 0.5) / n
            geometry |= {f"{kind}[{i + 1}].{name}": 5.0 + rng.normal() for name in extra}
    summary = {"status": "complete", "scenario": "long", "contacts": [dataclasses.asdict(c) for c in made]}
    return Results(None, summary, (fast, slow), {"line": geometry})


def test_the_longest_run_stays_below_8_megabytes():
    """30 s, four pantographs, 50 spans, every dropper recorded, no interval to choose from, and all of it noise."""
    page = run_page.page(longest_run(contacts=4, seconds=30.0, supports=50, droppers=400))
    assert len(page.encode()) < 8e6
