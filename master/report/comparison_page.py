"""The page that compares two or more runs; every contact of every run is a column."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from master.arrays import FloatArray
from master.errors import MasterError
from master.evaluation.contact_assessment import Assessment
from master.evaluation.contact_signals import Signals
from master.report import html_markup
from master.report.charts import force_charts as forces
from master.report.charts.chart import Axis, Bars, Chart, Curve, stroke
from master.report.charts.line_charts import line_marks
from master.report.charts.uplift_charts import support_bars
from master.report.result_tables import figure_rows
from master.report.run_inputs import quality_rows, unequal_inputs
from master.report.run_names import short_names
from master.report.run_page import status_note
from master.report.run_title import run_title
from master.results.run_difference import setting_notes
from master.results.run_results import Results

#: Inputs that differ which are shown at once.
MOST_INPUTS: Final = 15
_BANDS: Final = ("0-2", "0-5", "5-20")


@dataclass(frozen=True)
class Column:
    """A contact of a run.

    Attributes
    ----------
    name : str
        As shown.
    run : Results
        Its run.
    assessment : Assessment
        Its figures.
    signals : Signals
        Its force.
    """

    name: str
    run: Results
    assessment: Assessment
    signals: Signals


def columns(runs: Sequence[Results]) -> tuple[Column, ...]:
    """Return the contacts that have figures, in the order of the runs.

    Raises
    ------
    MasterError
        If there are fewer than two.
    """
    names = run_names([run.folder for run in runs])
    found = [c for name, run in zip(names, runs, strict=True) for c in _columns(name, run)]
    if len(found) < 2:
        raise MasterError("nothing to compare: fewer than two contacts have figures in their interval of interest")
    return tuple(found)


def _columns(name: str, run: Results) -> list[Column]:
    by_contact = {s.contact: s for s in run.signals}
    assessments = [a for a in run.assessments() if a.contact in by_contact]
    several, short = len(assessments) > 1, short_names(run.summary)
    return [
        Column(f"{name}, {short[a.contact.pantograph]}" if several else name, run, a, by_contact[a.contact])
        for a in assessments
    ]


def run_names(folders: Sequence[Path]) -> list[str]:
    """Return the shortest endings of the folders' paths that tell them apart.

    Examples
    --------
    >>> run_names([Path("a/before"), Path("a/after")])
    ['before', 'after']
    >>> run_names([Path("x/out"), Path("y/out")])
    ['x/out', 'y/out']
    """
    paths = [folder.absolute().parts for folder in folders]
    for length in range(1, max(len(p) for p in paths) + 1):
        names = ["/".join(p[-length:]) for p in paths]
        if len(set(names)) == len(names):
            return names
    return [f"{'/'.join(p[-1:])} ({i + 1})" for i, p in enumerate(paths)]


def comparison_page(runs: Sequence[Results]) -> str:
    """Return the page that compares runs, or the contacts of one run.

    Raises
    ------
    MasterError
        If there is nothing to compare.
    """
    found = columns(runs)
    charts = comparison_charts(found)
    names = [c.name for c in found]
    body = [
        f"<h1>{html_markup.text(' | '.join(dict.fromkeys(names)))}</h1>",
        *map(_note, run_names([r.folder for r in runs]), runs),
        *_input_section(runs),
        "<h2>Verdict</h2>",
        *map(_verdict, found),
        *(f"<p class='warning'>Warning: {html_markup.text(note)}.</p>" for note in setting_notes(runs)),
        "<h2>Figures</h2>",
        html_markup.table(["figure, low-passed", *names], _rows_with_differences(found)),
        f"<p class='note'>In brackets: difference from {html_markup.text(names[0])}. {_filters(runs)}</p>",
        "<h2>Curves</h2>",
        *map(html_markup.chart, charts),
        *_quality_section(runs),
    ]
    return html_markup.document(f"comparison: {', '.join(names)}", body, charts)


def _note(name: str, run: Results) -> str:
    """Return what a run is, and a warning if it is not complete."""
    scenario, title = run.summary.get("scenario", ""), run_title(run)
    what = f"{name}: {title}, scenario {scenario}" if title else f"{name}: scenario {scenario}"
    return f"<p class='note'>{html_markup.text(what)}</p>{status_note(run.summary)}"


def _verdict(c: Column) -> str:
    return html_markup.verdict(c.assessment, c.name, c.run.evaluation.limits)


def _filters(runs: Sequence[Results]) -> str:
    """Return the filters with which the runs were evaluated."""
    return f"Filter: {html_markup.text('; '.join(dict.fromkeys(run.evaluation.filter.sentence for run in runs)))}."


def _rows_with_differences(found: Sequence[Column]) -> list[tuple[str, ...]]:
    return [_with_differences(row) for row in figure_rows([c.assessment for c in found])]


def _with_differences(row: Sequence[str]) -> tuple[str, ...]:
    name, first, *others = row
    return (name, first, *(_difference(first, other) for other in others))


def _difference(first: str, other: str) -> str:
    if "-" in (first, other):
        return other
    decimals = len(other.partition(".")[2])
    return f"{other} ({float(other) - float(first):+.{decimals}f})"


def comparison_charts(found: Sequence[Column]) -> list[Chart]:
    """Return the charts in which the curves of all columns lie over one another."""
    charts = [_force_chart(found), _histogram(found), _spectrum(found), _bands(found)]
    if any(c.run.uplifts for c in found):
        charts.append(_uplift(found))
    return charts


def _force_chart(found: Sequence[Column]) -> Chart:
    curves = (
        Curve(c.name, c.signals.position, c.signals.shown, stroke(i, 1.9 - 0.2 * min(i, 3)))
        for i, c in enumerate(found)
    )
    first = found[0]
    marks = line_marks(first.run, first.assessment.contact.catenary, forces.extent([first.signals]))
    y, note = forces.force_axis([c.signals for c in found]), f"Supports and droppers of {first.name}."
    return Chart("force", "Contact force", forces.TRACK, y, (*curves, *marks), note, 440)


def _histogram(found: Sequence[Column]) -> Chart:
    cuts = [c.signals.filtered[c.signals.inside] for c in found]
    edges = forces.common_edges(cuts)
    curves = tuple(
        Curve(c.name, *_staircase(edges, forces.shares(cut, edges)), stroke(i))
        for i, (c, cut) in enumerate(zip(found, cuts, strict=True))
    )
    x = forces.force_axis([c.signals for c in found])
    return Chart("histogram", "Histogram", x, forces.SHARE, curves, "Interval of interest of each run.", 340)


def _staircase(edges: FloatArray, heights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the outline of a histogram."""
    return np.repeat(edges, 2), np.concatenate(([0.0], np.repeat(heights, 2), [0.0]))


def _spectrum(found: Sequence[Column]) -> Chart:
    chosen = [(i, c) for i, c in enumerate(found) if np.count_nonzero(c.signals.inside) > 16]
    curves = tuple(forces.spectrum_curve(c.signals, c.name, stroke(i, 1.4)) for i, c in chosen)
    note = "Force as computed, interval of interest of each run."
    return Chart("spectrum", "Spectrum", forces.FREQUENCY, forces.DENSITY, curves, note)


def _bands(found: Sequence[Column]) -> Chart:
    names = ("whole", *(f"{b} Hz" for b in _BANDS))
    qualities = [(c.name, c.assessment.quality) for c in found]
    bars = tuple(
        Bars(name, names, np.array([q.sigma, *(q.sigma_bands[b] for b in _BANDS)]), i)
        for i, (name, q) in enumerate(qualities)
    )
    y = Axis("standard deviation", "N")
    return Chart("bands", "Standard deviation per band", Axis("band"), y, bars, height=320)


def _uplift(found: Sequence[Column]) -> Chart:
    runs = {id(c.run): (i, c) for i, c in reversed(list(enumerate(found)))}
    bars = []
    for i, c in sorted(runs.values(), key=lambda entry: entry[0]):
        own = [u for u in c.run.uplifts if u.component == c.assessment.contact.catenary]
        if own:
            bars.append(replace(support_bars(own, c.name, i), width=None))
    x, y = Axis("track position of the support", "m"), Axis("largest uplift", "mm")
    return Chart("uplift", "Uplift at the supports", x, y, tuple(bars), "Whole run.", 340)


def _input_section(runs: Sequence[Results]) -> list[str]:
    if len(runs) < 2:
        return []
    rows = unequal_inputs(runs)
    heads = ["input", *run_names([run.folder for run in runs])]
    shown = html_markup.table(heads, rows[:MOST_INPUTS], numbers=False) if rows else "<p>The inputs are the same.</p>"
    if rest := rows[MOST_INPUTS:]:
        more = f"<summary>{len(rest)} more</summary>"
        shown += f"<details>{more}{html_markup.table(heads, rest, numbers=False)}</details>"
    return ["<h2>Inputs that differ</h2>", shown]


def _quality_section(runs: Sequence[Results]) -> list[str]:
    tables = [dict(quality_rows(run.summary)) for run in runs]
    names = list(dict.fromkeys(name for table in tables for name in table))
    rows = [(name, *(table.get(name, "-") for table in tables)) for name in names]
    heads = ["item", *run_names([run.folder for run in runs])]
    return ["<h2>Numerical quality</h2>", html_markup.table(heads, rows, numbers=False)]
