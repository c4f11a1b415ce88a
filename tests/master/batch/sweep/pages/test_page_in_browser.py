"""The page of a sweep in a real browser: every chart is drawn, nothing is said, tables sort."""

import re

import pytest

from master.batch.sweep.pages.sweep_page import page
from tests.master.batch.sweep.pages.conftest import SAMPLED, grid_rows, sample_rows, view
from tests.master.batch.sweep.pages.test_sensitivity_charts import indices
from tests.master.report.test_browser import look_at, needs_browser


def of_grid():
    rows = grid_rows([200.0, 250.0, 300.0], [18.0, 22.0])
    return view(rows, {"speed [km/h]": "", "tension [kN]": ""}, over=("speed", "tension"))


def of_samples():
    return view(sample_rows(30), SAMPLED, indices=[indices(), indices(method="morris")])


@needs_browser
@pytest.mark.slow
@pytest.mark.parametrize("made", [of_grid, of_samples])
def test_every_chart_is_drawn(made, tmp_path):
    path = tmp_path / "sweep.html"
    path.write_text(page(made()), encoding="utf-8")
    dom, said = look_at(path, tmp_path / "profile")
    assert said == []
    wanted = path.read_text().count("class='chart'")
    assert wanted >= 5
    assert f'data-drawn="{wanted}"' in dom


@needs_browser
@pytest.mark.slow
def test_a_click_on_a_head_sorts_and_another_turns_the_order(tmp_path):
    path = tmp_path / "sweep.html"
    html = page(of_grid())
    click = "<script>document.querySelectorAll('.sortable th button')[4].click();</script>"
    for clicks, order in ((1, sorted), (2, lambda v: sorted(v, reverse=True))):
        path.write_text(html.replace("</body>", click * clicks + "</body>"), encoding="utf-8")
        dom, said = look_at(path, tmp_path / "profile")
        assert said == []
        table = dom[dom.index('class="sortable"') :]
        sigma = [
            float(row.split('<td class="n">')[4].split("<")[0]) for row in re.findall(r"<tr>(.*?)</tr>", table)[1:]
        ]
        assert sigma == order(sigma)
        assert len(set(sigma)) == 6
