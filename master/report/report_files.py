"""What a run's folder is given to look at: ``report.html``, and every chart that goes to paper as PNG and SVG."""

from __future__ import annotations

from pathlib import Path

from master.evaluation.measured_force import MeasuredComparison
from master.report.charts import static_charts
from master.report.charts.output_charts import has_contacts, output_plots
from master.report.run_page import page
from master.results import results_folder
from master.results.run_results import Results
from master.safety.safe_files import atomic_file, write_atomically


def write(done: Results, measured: MeasuredComparison | None = None) -> Path:
    """Write the plots (PNG and SVG) and ``report.html`` into the run's folder; returns the report's path."""
    path = done.folder / results_folder.REPORT
    write_atomically(path, page(done, measured).encode())
    figures = static_charts.all_plots(done) if has_contacts(done) else output_plots(done)
    for name, figure in figures.items():
        with atomic_file(done.folder / f"{name}.svg") as temporary:
            figure.savefig(temporary, format="svg", metadata={"Date": None})
        with atomic_file(done.folder / f"{name}.png") as temporary:
            figure.savefig(temporary, format="png", dpi=130)
    return path
