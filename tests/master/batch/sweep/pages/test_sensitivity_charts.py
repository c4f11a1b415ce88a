"""Tornado and indices as they are drawn."""

import numpy as np
import pytest

from master.batch.sweep.pages.sensitivity_charts import MOST_PARAMETERS, effect_rows, effects_of, index_chart, tornado
from tests.master.batch.sweep.pages.conftest import SAMPLED, sample_rows, view


def indices(count=3, method="sobol"):
    first = [0.1 * k for k in range(count)]
    return {
        "method": method,
        "figure": "sigma",
        "unit": "N",
        "parameters": [f"line.p{k} [mm]" for k in range(count)],
        "first": first,
        "first_interval": [[v - 0.02, v + 0.03] for v in first],
        "total": [v + 0.1 for v in first],
        "total_interval": [[v + 0.05, v + 0.2] for v in first],
    }


def test_the_greatest_effect_lies_on_top():
    rows = sample_rows(60)
    whole = view(rows, SAMPLED)
    (figure, effects), *_ = effects_of(whole, rows, whole.of_kind("sampled"))
    chart = tornado(figure, effects, "t")
    bars = chart.parts[0]
    assert figure.name == "sigma"
    assert chart.y.words == ("b [1]", "a [1]")
    assert bars.y[1] == pytest.approx(2.0 * np.subtract(*np.quantile([r["a [1]"] for r in rows], (0.95, 0.05))))
    assert bars.y[0] < 0.0 < bars.y[1]
    assert bars.is_lying
    assert chart.note == "R\u00b2 = 1.00 from 60 samples."
    assert [r[0] for r in effect_rows([(figure, effects)])] == ["a [1]", "b [1]"]


def test_a_figure_that_does_not_vary_has_no_effects():
    rows = sample_rows(20)
    whole = view(rows, SAMPLED)
    found = {f.name: e for f, e in effects_of(whole, rows, whole.of_kind("sampled"))}
    assert found["maximum"] is None


def test_indices_have_their_intervals_and_the_greatest_total_on_top():
    chart = index_chart(indices(), "i")
    first, total = chart.parts
    assert (first.name, total.name) == ("first order", "total")
    assert chart.y.words[-1] == "line.p2 [mm]"
    assert first.y.tolist() == [0.0, 0.1, 0.2]
    assert total.interval[0].tolist() == pytest.approx([0.05, 0.15, 0.25])
    assert total.interval[1].tolist() == pytest.approx([0.2, 0.3, 0.4])
    assert chart.x.unit == ""


def test_a_parameter_that_acts_with_others_alone_lies_where_its_total_says():
    chart = index_chart({**indices(), "total": [0.9, 0.2, 0.3]}, "i")
    assert [w.split(" ")[0] for w in chart.y.words] == ["line.p1", "line.p2", "line.p0"]
    assert chart.parts[0].y.tolist() == [0.1, 0.2, 0.0]


def test_morris_has_other_words_its_unit_and_mu_for_its_order():
    data = {**indices(method="morris"), "total": [9.0, 1.0, 0.0]}
    chart = index_chart(data, "i")
    assert [p.name for p in chart.parts] == ["mu*", "sigma"]
    assert chart.x.unit == "N"
    assert chart.y.words[-1] == "line.p2 [mm]"


def test_of_many_parameters_the_greatest_are_drawn():
    chart = index_chart(indices(30), "i")
    assert len(chart.parts[0].y) == MOST_PARAMETERS
    assert chart.parts[1].y.max() == pytest.approx(3.0)
    assert f"{MOST_PARAMETERS} of 30 parameters" in chart.note


def test_what_could_not_be_computed_is_missing():
    data = {**indices(), "total": [0.1, None, 0.3], "total_interval": [[0.0, 0.2], [None, None], [0.2, 0.4]]}
    total = index_chart(data, "i").parts[1]
    assert np.isnan(total.y).sum() == 1
    assert np.isnan(total.interval[0]).sum() == 1
