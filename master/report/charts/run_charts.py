"""The charts of a run: those of its page, in their order, and those of its files."""

from __future__ import annotations

from collections.abc import Sequence

from master.evaluation.contact_signals import Signals
from master.report.charts.chart import Chart
from master.report.charts.dropper_charts import dropper_charts
from master.report.charts.force_charts import (
    force_charts,
    force_over_time,
    forces_together,
    height_chart,
    histogram,
    lateral_histogram,
    spectrum,
)
from master.report.charts.line_charts import geometry_charts
from master.report.charts.output_charts import has_contacts, output_charts
from master.report.charts.uplift_charts import uplift_bars, uplift_history
from master.results.run_results import Results


def run_charts(results: Results, signals: Sequence[Signals]) -> list[Chart]:
    """Return every chart that the run has the data for, in the order of the report."""
    found = [
        *force_charts(results, signals),
        *forces_together(results, signals),
        *force_over_time(signals),
        histogram(signals),
        spectrum(results, signals),
        uplift_bars(results),
        uplift_history(results),
        *dropper_charts(results),
        lateral_histogram(signals),
        *(c for name, values in results.geometry.items() for c in geometry_charts(name, values)),
    ]
    return [chart for chart in found if chart is not None]


def file_charts(results: Results) -> dict[str, list[Chart]]:
    """Return the charts that are written as files, one below the other, by file name without ending."""
    if not has_contacts(results):
        return {chart.key: [chart] for chart in output_charts(results)}
    single = {
        "uplift": uplift_bars(results),
        "uplift_history": uplift_history(results),
        "contact_height": height_chart(results, results.signals),
    }
    found = {
        "contact_force": force_charts(results, results.signals),
        "contact_force_over_time": force_over_time(results.signals),
        **{name: [chart] for name, chart in single.items() if chart is not None},
        **{f"line_{name}": geometry_charts(name, values) for name, values in results.geometry.items()},
    }
    return {name: charts for name, charts in found.items() if charts}
