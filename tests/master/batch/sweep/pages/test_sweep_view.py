"""A sweep as its page sees it: from a sweep and from its files alike, with its limits."""

import json
import math

import pytest

from master.batch.sweep.pages.sweep_page import page
from master.batch.sweep.pages.sweep_view import levels, read_view, view_of
from master.batch.sweep.sweep_session import as_data
from master.errors import MasterError
from master.system.pantograph_motion import parameter_value
from tests.master.batch.sweep.pages.conftest import failure, row, view


def test_files_give_the_same_view_as_the_sweep(swept, tmp_path):
    done = swept(over={"catenary.stiffness": "4000,5000"}, vary={"speed": "uniform(40, 60)"}, samples=2)
    folder = tmp_path / "out"
    assert (
        page(read_view(folder / "sweep.json", folder / "sweep.csv", folder / "sensitivity.json"))
        == (folder / "sweep.html").read_text()
    )
    assert page(view_of(as_data(done), done.rows, folder)) == (folder / "sweep.html").read_text()


def test_indices_are_on_the_page_of_the_sweep_and_of_its_files(swept, tmp_path):
    swept(vary={"catenary.stiffness": "uniform(4000, 6000)"}, samples=4, sensitivity="morris")
    folder = tmp_path / "out"
    html = (folder / "sweep.html").read_text()
    assert "Morris indices of mean" in html
    assert "How many samples fail a limit" not in html
    assert page(read_view(folder / "sweep.json", folder / "sweep.csv", folder / "sensitivity.json")) == html


def test_the_setting_names_speeds_contacts_and_the_interval(swept, toy_system):
    setting = as_data(swept(over={"catenary.stiffness": "4000,5000"}))["setting"]
    ((name, speed),) = setting["speeds"].items()
    assert speed == pytest.approx(3.6 * parameter_value(toy_system.component(name), "speed"))
    assert setting["contacts"].keys() == {name}
    assert "changes" not in setting
    assert setting["interval"] == [toy_system.settings.interval.start, toy_system.settings.interval.end]


@pytest.mark.parametrize("text", ["{", "[]", '{"parameters": 3}', '{"parameters": [{}]}', "{}"])
def test_damaged_files_are_a_sentence(tmp_path, text):
    (tmp_path / "sweep.json").write_text(text)
    with pytest.raises(MasterError, match="holds no sweep that can be read"):
        read_view(tmp_path / "sweep.json", tmp_path / "sweep.csv", tmp_path / "s.json")


def test_a_damaged_table_is_a_sentence(swept, tmp_path):
    swept(over={"catenary.stiffness": "4000,5000"})
    table = tmp_path / "out" / "sweep.csv"
    table.write_text(table.read_text() + "3,4\n")
    with pytest.raises(MasterError, match="holds no sweep that can be read"):
        read_view(tmp_path / "out" / "sweep.json", table, table)


def test_whole_numbers_are_numbers_and_words_are_texts():
    rows = [row(1, {"n": "1", "law": "a"}), row(2, {"n": "0", "law": "2"})]
    found = view(rows, {"n": "", "law": ""})
    assert levels(found.rows, "n") == [0.0, 1.0]
    assert levels(found.rows, "law") == ["a", "2"]


def test_limits_follow_the_speed_of_the_row():
    rows = [row(1, {"speed [km/h]": 200.0}), row(2, {"speed [km/h]": 300.0})]
    found = view(rows, {"speed [km/h]": ""}, over=("speed",))
    figures = {f.name: f for f in found.figures}
    slow, fast = found.rows
    assert found.bounds(figures["maximum"], slow) == (-math.inf, 300.0)
    assert found.bounds(figures["maximum"], fast) == (-math.inf, 350.0)
    assert found.bounds(figures["mean"], fast)[1] == pytest.approx(0.00097 * 300.0**2 + 70.0)
    assert found.bounds(figures["sigma"], fast)[1] == pytest.approx(0.3 * 150.0)
    assert found.bounds(figures["uplift"], fast) == (-math.inf, 120.0)


def test_figures_know_what_judges_them():
    names = ["mean force", "sigma / mean", "sigma / mean", "maximum force", "uplift at supports"]
    assert [f.criterion for f in view([row(1, {})], {}).figures] == names


def test_a_speed_in_another_unit_is_the_same_speed():
    slow = view([row(1, {"speed [m/s]": 50.0})], {"speed [m/s]": ""})
    assert slow.bounds(slow.figures[3], slow.rows[0])[1] == 300.0
    as_it_is = view([row(1, {"a [1]": 1.0})], {"a [1]": ""})
    assert as_it_is.bounds(as_it_is.figures[3], as_it_is.rows[0])[1] == 350.0


def test_names_are_as_short_as_they_may_be():
    titles = ("line.contact_wire.tension [kN]", "line.messenger_wire.tension [kN]", "front.static_force [N]")
    found = view([row(1, dict.fromkeys(titles, 1.0))], dict.fromkeys(titles, ""))
    shown = ["contact_wire.tension [kN]", "messenger_wire.tension [kN]", "static_force [N]"]
    assert [found.short_title(t) for t in titles] == shown


def test_runs_that_failed_are_no_rows_of_a_pantograph():
    found = view([row(1, {"a": 1.0}), failure(2, {"a": 2.0}, "no")], {"a": ""})
    assert [r["run"] for r in found.rows_of("front")] == [1.0]
    assert found.failures == {"2": "no"}
    assert found.pantographs == ("front",)
    assert len(found.complete) == 1


def test_a_setting_of_own_limits_is_read(tmp_path):
    data = {"scenario": "x", "status": "complete", "date": "", "parameters": [], "runs": 1, "finished": 1}
    data["setting"] = {"limits": {"supply": "DC3", "own": {"maximum": 222.0}}, "speeds": {"front": 100.0}}
    (tmp_path / "sweep.json").write_text(json.dumps(data))
    found = read_view(tmp_path / "sweep.json", tmp_path / "sweep.csv", tmp_path / "s.json")
    assert found.limits.supply == "DC3"
    assert found.limits.own.maximum == 222.0
    assert found.rows == ()
