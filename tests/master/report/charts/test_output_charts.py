"""Curves of a chart of outputs can be told apart."""

from __future__ import annotations

from master.report.charts.run_charts import Curve


def test_no_two_curves_of_a_chart_are_alike():
    styles = [tuple(Curve(i, "f").line.values()) for i in range(36)]
    assert len(set(styles)) == len(styles)
