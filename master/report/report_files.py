"""What a run's folder is given to look at: ``report.html``, and every chart that goes to paper as PNG and SVG."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from master.report.charts.measured_charts import Comparison
from master.report.charts.run_charts import file_charts
from master.report.charts.static_figure import static_figure
from master.report.run_page import page
from master.results import run_results
from master.results.run_results import Results
from master.safety.safe_files import whole_file, write_whole

#: Endings of the charts' files, and what is asked of each format: no date, so that equal runs have equal files.
_FORMATS: Final[dict[str, dict[str, Any]]] = {"svg": {"metadata": {"Date": None}}, "png": {"dpi": 130}}


def write(done: Results, measured: Comparison | None = None) -> Path:
    """Write the charts' files and ``report.html`` into the run's folder, and return the report's path."""
    path = done.folder / run_results.REPORT
    write_whole(path, page(done, measured).encode())
    for name, charts in file_charts(done).items():
        figure = static_figure(charts)
        for ending, options in _FORMATS.items():
            with whole_file(done.folder / f"{name}.{ending}") as temporary:
                figure.savefig(temporary, format=ending, **options)
    return path
