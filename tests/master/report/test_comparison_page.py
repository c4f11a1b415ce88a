"""Runs beside runs."""

import dataclasses

import pytest

from master.errors import MasterError
from master.report.comparison_page import columns, comparison_page
from master.report.run_inputs import differing_inputs


def test_runs_stand_side_by_side_with_their_differences(made_up, tmp_path):
    before, after = made_up(folder=tmp_path / "before"), made_up(folder=tmp_path / "after")
    louder = dataclasses.replace(after.recordings[0], values=after.recordings[0].values.copy())
    louder.values[:, 0] += 10.0
    after = dataclasses.replace(after, recordings=(louder, *after.recordings[1:]))
    assert [c.name for c in columns([before, after])] == ["before", "after"]
    page = comparison_page([before, after])
    assert "(+10.0)" in page
    assert page.count("class='tiles'") == 2
    assert page.index("The inputs are the same") < page.index("class='tiles'")


def test_one_run_alone_is_no_comparison(made_up, tmp_path):
    with pytest.raises(MasterError, match="nothing to compare"):
        comparison_page([made_up(folder=tmp_path / "a")])


def test_only_inputs_that_differ_are_listed():
    def run(tension):
        inputs = [{"name": "tension", "value": tension, "unit": "N"}, {"name": "length", "value": 1.0}]
        component = {"name": "line", "fmu": "Line.fmu", "sha256": "0" * 64, "inputs": inputs}
        return {"components": [component]}

    assert differing_inputs([run(1.0), run(2.0)]) == [("line.tension [N]", "1", "2")]
    assert differing_inputs([run(1.0), run(1.0)]) == []


def test_what_was_set_comes_before_what_else_differs(made_up, tmp_path):
    def run(name, length, tension, line):
        inputs = [
            {"name": "length", "value": length, "unit": "m"},
            {"name": "tension", "value": tension, "unit": "N", "changed": True},
        ]
        component = {"name": "catenary", "fmu": "Line.fmu", "description": line, "inputs": inputs}
        made = made_up(folder=tmp_path / name)
        return dataclasses.replace(made, summary={**made.summary, "components": [component]})

    runs = [run("old", 45.0, 1.0, "LN2, simple"), run("new", 50.0, 2.0, "LN6, simple")]
    assert differing_inputs([r.summary for r in runs]) == [
        ("catenary", "LN2, simple", "LN6, simple"),
        ("catenary.tension [N]", "1", "2"),
        ("catenary.length [m]", "45", "50"),
    ]
    page = comparison_page(runs)
    assert "<th>input</th><th>old</th><th>new</th>" in page
    assert page.index("<td>catenary.tension [N]</td>") < page.index("class='tiles'")
