"""The whole page: what it says of every kind of sweep, of failures, of strange names, and how large it gets."""

import json
import re

import pytest

from master.batch.sweep.pages.sweep_page import MOST_ROWS, chapters, file_charts, page
from master.report.html_markup import asset
from tests.master.batch.sweep.pages.conftest import SAMPLED, SETTING, failure, grid_rows, row, sample_rows, view
from tests.master.batch.sweep.pages.test_sensitivity_charts import indices

#: What every page carries.
_FIXED = len(asset("plotly-basic.min.js"))


def data_of(html):
    return json.loads(re.search(r"<script type='application/json' id='charts'>(.*?)</script>", html)[1])


def test_a_grid_has_maps_and_curves(grid):
    assert [c.key for c in chapters(grid)] == ["maps", "curves"]
    html = page(grid)
    assert "15 of 15 runs finished, 0 of them failed" in html
    assert "200, 225, 250, 275, 300" in html
    places = set(re.findall(r"id='chart-([^']+)'", html))
    assert places == set(data_of(html))


def test_samples_have_shares_distributions_and_effects():
    whole = view(sample_rows(30), SAMPLED)
    assert [c.key for c in chapters(whole)] == ["shares", "distributions", "effects"]
    html = page(whole)
    assert (
        "<td>any limit</td><td class='n'>3 of 30</td><td class='n'>10.0 %</td><td class='n'>2.1 to 26.5 %</td>" in html
    )
    assert "normal(0, 1): 30 values" in html


def test_runs_without_figures_are_told():
    bare = {"status": "complete", "verdict": "the run ends before the interval"}
    whole = view([row(1, {"a": 1.0}), *({"run": float(k), "a": float(k), **bare} for k in (2, 3))], {"a": ""})
    assert "<p class='warning'>2 runs have no figures; run 2: the run ends before the interval</p>" in page(whole)
    assert "no figures" not in page(view([row(1, {"a": 1.0})], {"a": ""}))


def test_a_design_for_sensitivity_has_no_method_of_sampling():
    request = {"samples": 30, "method": "lhs"}
    assert "method of sampling" in page(view(sample_rows(30), SAMPLED, request=request))
    assert "method of sampling" not in page(view(sample_rows(30), SAMPLED, request={**request, "sensitivity": "sobol"}))


def test_samples_of_seeds_have_a_seed_and_no_method():
    rows = [row(k, {"line.seed": str(k)}, sigma=40.0 + k % 7) for k in range(1, 31)]
    html = page(view(rows, {"line.seed": ""}, request={"samples": 30, "seed": 1, "method": "lhs"}))
    assert "method of sampling" not in html
    assert "<td>seed</td>" in html
    assert "<td>seed</td>" not in page(view(rows, {"line.seed": ""}, over=("line.seed",)))


def test_values_of_all_runs_are_on_the_page(grid):
    changed = view(grid_rows((250.0, 300.0), (19.0, 20.0)), dict.fromkeys(("speed [km/h]", "tension [kN]"), ""),
                   setting={**SETTING, "changes": {"line.irregularity.sigma": "10 mm"}})  # fmt: skip
    assert re.search(r"<td[^>]*>line\.irregularity\.sigma, in all runs</td>\s*<td[^>]*>10 mm</td>", page(changed))
    assert "in all runs" not in page(grid)


def test_seeds_of_a_grid_are_samples():
    rows = [row(k, {"line.seed": str(k)}, sigma=40.0 + k % 7) for k in range(1, 31)]
    whole = view(rows, {"line.seed": ""}, over=("line.seed",))
    assert [c.key for c in chapters(whole)] == ["shares", "distributions"]


def test_samples_on_a_grid_have_curves_and_every_group_its_share():
    rows = [{**r, "v": v, "run": 30.0 * i + r["run"]} for i, v in enumerate((1.0, 2.0)) for r in sample_rows(30)]
    whole = view(rows, {"v": "", **SAMPLED}, over=("v",))
    assert [c.key for c in chapters(whole)] == ["curves", "shares", "distributions", "effects"]
    assert page(whole).count("<td>v 1</td><td>any limit</td>") == 1


def test_a_table_of_one_parameter_has_curves_and_one_of_several_points():
    one = view([row(k, {"a": float(k)}) for k in range(1, 4)], {"a": ""})
    two = view([row(k, {"a": float(k), "b": float(k % 2)}, variant=f"v{k}") for k in range(1, 4)], {"a": "", "b": ""})
    assert [c.key for c in chapters(one)] == ["curves"]
    assert [c.key for c in chapters(two)] == ["runs"]
    assert "v3" in page(two)


def test_each_pantograph_has_its_chapters():
    rows = [{**r, "pantograph": p} for r in grid_rows([200.0, 300.0], [20.0]) for p in ("front", "rear")]
    whole = view(rows, {"speed [km/h]": "", "tension [kN]": ""}, over=("speed",))
    assert [c.title for c in chapters(whole)] == ["Over speed, front", "Over speed, rear"]
    assert list(file_charts(whole)) == ["sweep_curves_1", "sweep_curves_2"]


def test_runs_that_failed_are_named_with_their_reason():
    rows = [*sample_rows(5), *(failure(k, {"a [1]": 0.0, "b [1]": 0.0}, "the wire <broke>") for k in range(6, 36))]
    html = page(view(rows, SAMPLED))
    assert "30 of 35 finished runs failed; they are in no figure below." in html
    assert "6, 7, 8" in html
    assert "and 10 more" in html
    assert "the wire &lt;broke&gt;" in html
    assert "<td>any limit</td><td class='n'>0 of 5</td>" in html


@pytest.mark.parametrize(
    "rows",
    [
        [],
        [failure(1, {"a [1]": 1.0, "b [1]": 2.0}, "no")],
        sample_rows(1),
        [row(1, {"a [1]": 1.0, "b [1]": 2.0}, mean=None, sigma=None, maximum=None)],
        [{**r, "passed": "", "verdict": "not judged"} for r in sample_rows(3)],
        [row(k, {"a [1]": 1.0, "b [1]": 2.0}) for k in (1, 2, 3)],
    ],
    ids=["nothing", "all failed", "one run", "no figures", "no verdict", "all the same"],
)
@pytest.mark.parametrize("kind", ["sampled", "grid", "listed"])
def test_there_is_a_page_however_little_there_is(rows, kind):
    parameters = SAMPLED if kind == "sampled" else dict.fromkeys(SAMPLED, "")
    whole = view(rows, parameters, over=("a", "b") if kind == "grid" else ())
    html = page(whole)
    data_of(html)
    assert ("No run is complete" in html) == (not whole.complete)
    assert "NaN" not in html.replace(asset("plotly-basic.min.js"), "").replace(asset("table_sort.js"), "")


def test_a_sweep_that_was_stopped_says_so(grid):
    assert "Interrupted. The runs so far follow." in page(view(grid.rows, {}, status="interrupted"))
    assert "was killed" in page(view(grid.rows, {}, status="running"))


def test_names_cannot_act_on_the_page():
    evil = "<img src=x onerror=alert(1)>"
    rows = [row(k, {evil: float(k), "b": evil * k}, variant=evil, remarks=evil) for k in (1, 2, 3)]
    for over in ((), (evil, "b")):
        html = page(view(rows, {evil: "", "b": ""}, over=over, scenario=evil))
        bare = html.replace(asset("plotly-basic.min.js"), "")
        assert "<img" not in bare
        assert "&lt;img src=x" in json.dumps(data_of(html)) or not over


def test_five_hundred_runs_are_a_page_of_bounded_size():
    many = view(sample_rows(5000), SAMPLED, indices=[indices(30)] * 40)
    html = page(many)
    assert f"The first {MOST_ROWS} of 5000 rows; sweep.csv has all." in html
    assert html.count("<tr>") < MOST_ROWS + 100
    assert len(html) < _FIXED + 1_000_000
    wide = grid_rows([200.0 + k for k in range(45)], [15.0 + 0.1 * k for k in range(45)])
    html = page(view(wide, {"speed [km/h]": "", "tension [kN]": ""}, over=("speed", "tension")))
    assert "40 of 45 and 40 of 45 values; the table has all." in html
    assert len(html) < _FIXED + 2_000_000


def test_twenty_thousand_runs_are_a_page_of_bounded_size():
    listed = [row(k, {"a": float(k % 7), "b": float(k)}, variant=f"v{k}", sigma=40.0 + k % 11) for k in range(20_000)]
    html = page(view(listed, {"a": "", "b": ""}))
    assert "1000 of 20000 runs; the table has all." in html
    assert len(html) < _FIXED + 1_000_000
    html = page(view(listed, {"b": ""}, over=("b",)))
    assert len(html) < _FIXED + 1_000_000


def test_indices_have_a_chapter_of_their_own(grid):
    found = view(grid.rows, {}, indices=[indices(), indices(method="morris")])
    (chapter,) = (c for c in chapters(found) if c.key == "indices")
    assert [c.title for c in chapter.charts] == ["Sobol indices of sigma", "Morris indices of sigma"]
