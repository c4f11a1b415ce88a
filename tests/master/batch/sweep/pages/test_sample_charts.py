"""Tables and charts of samples."""

import numpy as np
import pytest

from master.batch.sweep.pages.sample_charts import (
    distribution_charts,
    figure_rows,
    running_charts,
    share_rows,
)
from master.batch.sweep.pages.sample_statistics import share
from master.report.charts.chart import Bars, Curve, Envelope
from tests.master.batch.sweep.pages.conftest import SAMPLED, row, sample_rows, view


def test_shares_count_what_was_judged_and_every_limit_that_was_failed():
    rows = sample_rows(40)
    rows[0] |= {"passed": "", "verdict": "not judged", "failed limits": ""}
    rows[1] |= {"failed limits": "maximum force; contact height range", "passed": "false"}
    found = {limit: shown for limit, *shown in share_rows({"": rows})}
    exact = share(5, 39)
    assert found["any limit"] == ["5 of 39", "12.8 %", f"{100 * exact.low:.1f} to {100 * exact.high:.1f} %"]
    assert found["sigma / mean"][0] == "4 of 39"
    assert found["maximum force"][0] == found["contact height range"][0] == "1 of 39"
    assert found["uplift at supports"][0] == found["mean force"][0] == "0 of 39"


def test_without_a_verdict_there_are_no_shares():
    assert share_rows({"": [row(1, {}, passed="")]}) == []


def test_figures_have_their_mean_deviation_and_quantiles():
    rows = [row(k, {"a [1]": float(k)}, sigma=float(k)) for k in range(101)]
    whole = view(rows, {"a [1]": "uniform(0, 100)"})
    found = {name: cells for name, *cells in figure_rows(whole, {"": rows})}
    count, centre, deviation, low, middle, high, least, most = found["sigma [N]"]
    assert (count, deviation, low, middle, high, least, most) == ("101", "29.3", "5.0", "50.0", "95.0", "0.0", "100.0")
    assert centre.startswith("50.0 \u00b1 5.8")
    assert found["maximum [N]"][1:3] == ["260.0 \u00b1 0.0", "0.0"]


def test_missing_figures_are_not_counted():
    rows = [row(1, {}, sigma=None), row(2, {}, sigma=30.0)]
    whole = view(rows, {})
    assert {name: cells[0] for name, *cells in figure_rows(whole, {"": rows})}["sigma [N]"] == "1"


def test_a_histogram_holds_all_samples():
    rows = sample_rows(500)
    whole = view(rows, SAMPLED)
    (chart,) = (c for c in distribution_charts(whole, {"": rows}, "d") if c.title == "Sigma")
    (bars,) = (p for p in chart.parts if isinstance(p, Bars))
    assert bars.y.sum() == pytest.approx(100.0)
    assert 10 <= len(bars.x) <= 40
    assert [c.title for c in distribution_charts(whole, {"": rows}, "d")] == ["Sigma", "Sigma / mean"]


def test_the_running_share_ends_at_the_share():
    rows = sample_rows(40)
    chart = running_charts(view(rows, SAMPLED), rows, "r")[0]
    (curve,) = (p for p in chart.parts if isinstance(p, Curve))
    (band,) = (p for p in chart.parts if isinstance(p, Envelope))
    exact = share(4, 40)
    assert (curve.y[-1], band.low[-1], band.high[-1]) == pytest.approx((10.0, 100 * exact.low, 100 * exact.high))
    assert np.array_equal(curve.x, np.arange(1.0, 41.0))


def test_a_figure_settles_within_the_quantiles_of_the_samples():
    rows = sample_rows(200)
    chart = next(c for c in running_charts(view(rows, SAMPLED), rows, "r") if c.title == "Sigma of the samples")
    spread, median, interval, mean = chart.parts
    values = np.array([r["sigma [N]"] for r in rows])
    for k in (9, 199):
        assert (spread.low[k], median.y[k], spread.high[k]) == pytest.approx(
            np.quantile(values[: k + 1], (0.05, 0.5, 0.95))
        )
        assert mean.y[k] == pytest.approx(values[: k + 1].mean())
    assert (interval.high - interval.low)[-1] < 0.2 * (spread.high - spread.low)[-1]
