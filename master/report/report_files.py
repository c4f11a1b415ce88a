"""The files that a run's folder holds to be looked at: ``report.html``, and charts as PNG or SVG."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
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
FORMATS: Final[dict[str, dict[str, Any]]] = {"png": {"dpi": 130}, "svg": {"metadata": {"Date": None}}}
#: Names within an SVG are made from its content and this, instead of at random.
_SAME_NAMES: Final[Any] = {"svg.hashsalt": "openpanto"}
#: The format of a run whose user asks for none: every one costs as much as the page.
_DEFAULT: Final = "png"


def write(done: Results, measured: MeasuredComparison | None = None, formats: Collection[str] = ()) -> Path:
    """Write the charts' files and ``report.html`` into the run's folder, and return the report's path.

    Parameters
    ----------
    done : Results
    measured : MeasuredComparison, optional
    formats : collection of str
        Of `FORMATS`. Those that the folder already holds charts in are written as well, so that none is older than the
        report; PNG, if there is neither.
    """
    path = done.folder / results_folder.REPORT
    write_atomically(path, page(done, measured).encode())
    write_charts(file_charts(done), done.folder, formats)
    return path


def write_charts(charts: Mapping[str, Sequence[Chart]], folder: Path, formats: Collection[str] = ()) -> list[Path]:
    """Write charts, those of a file one below the other, by the file's name; return the files.

    Those formats that the folder already holds charts in are written as well; PNG, if there is neither.
    """
    from matplotlib import rc_context

    there = [ending for ending in FORMATS if any((folder / f"{name}.{ending}").exists() for name in charts)]
    wanted = sorted({*formats, *there} or {_DEFAULT})
    written = []
    for name, each in charts.items():
        figure = static_figure(each)
        # Laid out once, not for every format and each time twice.
        layout: Any = figure.get_layout_engine()
        layout.execute(figure)
        figure.set_layout_engine("none")
        for ending in wanted:
            written.append(folder / f"{name}.{ending}")
            with atomic_file(written[-1]) as temporary, rc_context(_SAME_NAMES):
                figure.savefig(temporary, format=ending, **FORMATS[ending])
    return written
