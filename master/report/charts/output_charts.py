"""The outputs of a run without a pantograph, as a table and over time; those of one unit share a chart."""

from __future__ import annotations

from collections.abc import Iterator

from rich.table import Table

from master.evaluation.output_figures import output_figures
from master.recording.recording import Recording
from master.report.charts.chart import Axis, Chart, Curve, stroke
from master.report.result_tables import plain_table
from master.results.run_results import Results

#: Largest number of curves in a chart, and of rows in the table on a terminal.
_MOST_CURVES = 8
_MOST_ROWS = 40
#: Longest name of an output that the table on a terminal shows in full.
_LONGEST = 30
HEADS = ("output", "start", "end", "minimum", "maximum", "mean")


def has_contacts(results: Results) -> bool:
    """Return whether the run couples pantograph and line; if not, only its outputs can be shown."""
    return bool(results.contacts)


def output_rows(results: Results) -> list[tuple[str, ...]]:
    """Return a row for every recorded variable: name with unit, then its figures."""
    rows = []
    for f in output_figures(results.recordings):
        figures = (f.start, f.end, f.minimum, f.maximum, f.mean)
        rows.append((f"{f.name} [{f.unit}]" if f.unit else f.name, *(f"{v:.5g}" for v in figures)))
    return rows


def outputs_table(results: Results) -> Table:
    """Return the table of outputs for a terminal 80 columns wide."""
    rows = [(_short(row[0]), *row[1:]) for row in output_rows(results)]
    table = plain_table(HEADS, rows[:_MOST_ROWS])
    more = len(rows) - _MOST_ROWS
    table.title = "Outputs"
    if more > 0:
        table.title += f", the first {_MOST_ROWS} of {len(rows)}; the others are in report.html"
    table.title_justify = "left"
    return table


def output_charts(results: Results) -> list[Chart]:
    """Return a chart over time for the variables of each unit, more than one if there are many."""
    charts = []
    for number, (unit, names, recording) in enumerate(_groups(results), start=1):
        curves = tuple(Curve(name, recording.time, recording[name], stroke(i)) for i, name in enumerate(names))
        title = ", ".join(names) if len(names) < 3 else _title(unit)
        charts.append(Chart(f"outputs{number}", title, Axis("time", "s"), Axis("value", unit), curves))
    return charts


def _groups(results: Results) -> Iterator[tuple[str, list[str], Recording]]:
    for recording in results.recordings:
        if len(recording.time) < 2:
            continue
        by_unit: dict[str, list[str]] = {}
        for name, unit in zip(recording.names, recording.units, strict=True):
            by_unit.setdefault(unit, []).append(name)
        for unit, names in by_unit.items():
            for first in range(0, len(names), _MOST_CURVES):
                yield unit, names[first : first + _MOST_CURVES], recording


def _title(unit: str) -> str:
    return f"Outputs in {unit}" if unit not in ("", "1") else "Outputs without a unit"


def _short(name: str) -> str:
    return name if len(name) <= _LONGEST else f"...{name[-_LONGEST + 3 :]}"
