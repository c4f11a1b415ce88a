"""What people look at: reports in HTML, plots as files, films, and tables for the terminal."""

from __future__ import annotations

from pathlib import Path

from master.evaluation.measured_force import Comparison
from master.report.charts import static_charts
from master.report.charts.measured_charts import comparison_rows
from master.report.charts.output_charts import has_contacts, output_plots, outputs_table
from master.report.result_tables import (
    FILTER_HEADS,
    calibration_line,
    figure_rows,
    figures_table,
    filter_rows,
    headlines,
    plain_table,
    uplift_line,
    verdict_table,
)
from master.report.run_page import page
from master.results import results_folder
from master.results.run_results import Results
from master.safety.safe_files import whole_file, write_whole

__all__ = [
    "FILTER_HEADS",
    "calibration_line",
    "comparison_rows",
    "figure_rows",
    "figures_table",
    "filter_rows",
    "has_contacts",
    "headlines",
    "outputs_table",
    "page",
    "plain_table",
    "uplift_line",
    "verdict_table",
    "write",
]


def write(done: Results, measured: Comparison | None = None) -> Path:
    """Write the plots (PNG and SVG) and ``report.html`` into the run's folder; returns the report's path."""
    path = done.folder / results_folder.REPORT
    write_whole(path, page(done, measured).encode())
    figures = static_charts.all_plots(done) if has_contacts(done) else output_plots(done)
    for name, figure in figures.items():
        with whole_file(done.folder / f"{name}.svg") as temporary:
            figure.savefig(temporary, format="svg", metadata={"Date": None})
        with whole_file(done.folder / f"{name}.png") as temporary:
            figure.savefig(temporary, format="png", dpi=130)
    return path
