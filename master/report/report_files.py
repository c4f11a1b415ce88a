"""The files that a run's folder holds to be looked at: ``report.html``, and charts as PNG and SVG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from master.evaluation.measured_force import MeasuredComparison
from master.report.charts.chart import Chart
from master.report.charts.run_charts import file_charts
from master.report.charts.static_figure import static_figure
from master.report.run_page import page
from master.results import results_folder
from master.results.run_results import Results
from master.safety.safe_files import atomic_file, write_atomically

#: Formats of the charts' files with their options: no date, so that equal runs leave equal files.
_FORMATS: Final[dict[str, dict[str, Any]]] = {"svg": {"metadata": {"Date": None}}, "png": {"dpi": 130}}


def write(done: Results, measured: MeasuredComparison | None = None) -> Path:
    """Write the charts' files and ``report.html`` into the run's folder, and return the report's path."""
    path = done.folder / results_folder.REPORT
    write_atomically(path, page(done, measured).encode())
    write_charts(file_charts(done), done.folder)
    return path


def write_charts(charts: Mapping[str, Sequence[Chart]], folder: Path) -> list[Path]:
    """Write charts as PNG and SVG, those of a file one below the other, by the file's name; return the files."""
    written = []
    for name, each in charts.items():
        figure = static_figure(each)
        for ending, options in _FORMATS.items():
            written.append(folder / f"{name}.{ending}")
            with atomic_file(written[-1]) as temporary:
                figure.savefig(temporary, format=ending, **options)
    return written
