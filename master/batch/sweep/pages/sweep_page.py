"""The page of a sweep: a single HTML file that needs no other, and its charts for files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from master.batch.sweep.pages import criticality, grid_charts, sample_charts, sensitivity_charts, variant_charts
from master.batch.sweep.pages.force_bands import force_band
from master.batch.sweep.pages.sweep_view import SweepView, SweptColumn, is_judged, level_text, levels
from master.batch.sweep.sweep_run import Row
from master.batch.sweep.sweep_table import unjudged_note
from master.report import html_markup
from master.report.charts.chart import Chart

#: Most rows of the table of runs, of that of failures, and pantographs with charts of their own.
MOST_ROWS: Final = 500
_MOST_REASONS: Final = 50
_MOST_NUMBERS: Final = 20
_MOST_PANTOGRAPHS: Final = 4
_STATUS: Final = {
    "running": "Not finished: the sweep is still running or was killed. The runs so far follow.",
    "interrupted": "Interrupted. The runs so far follow.",
}
_SHARES: Final = (
    "Interval: 95 %, exact binomial (Clopper and Pearson), of independent samples; a Latin hypercube or a Sobol "
    "sequence scatters less. Runs that failed or have no verdict are not among the samples."
)
_EFFECTS: Final = (
    "Change of the figure when a parameter goes from its 5 % to its 95 % quantile and the others stay, from a linear "
    "regression of the samples, with its 95 % interval; beside it Spearman's rank correlation."
)
_DESIGN: Final = (
    "The runs are a design for these indices and no independent samples: they have no shares, and no distributions."
)
_NO_INDICES: Final = "None: runs are missing, no figure varies, or too few blocks of runs are complete."
_FAULTS: Final = (
    "Each fault by itself, against the line without any; ranked by the change of the maximum. Combinations of faults "
    "are in the table of runs alone."
)


@dataclass(frozen=True)
class Chapter:
    """A part of the page.

    Attributes
    ----------
    key : str
        Name of the file with its charts.
    title : str
    text : tuple of str
        HTML before the charts.
    charts : tuple of Chart
    """

    key: str
    title: str
    text: tuple[str, ...] = ()
    charts: tuple[Chart, ...] = ()


def page(view: SweepView) -> str:
    """Return the whole page."""
    drawn: list[Chart] = []
    body = [
        f"<h1>{html_markup.text(view.scenario)}: sweep</h1>",
        f"<p class='note'>{html_markup.text(_count(view))}; {html_markup.text(view.date)}</p>",
    ]
    if view.status in _STATUS:
        body.append(f"<p class='warning'>{_STATUS[view.status]}</p>")
    body += [html_markup.table(("parameter", "values"), _parameter_rows(view), numbers=False), *_failures(view)]
    if not view.complete:
        body.append("<p class='warning'>No run is complete: there is nothing to draw.</p>")
    if note := unjudged_note(view.rows):
        body.append(f"<p class='warning'>{html_markup.text(note)}</p>")
    for chapter in chapters(view):
        body += [f"<h2>{html_markup.text(chapter.title)}</h2>", *chapter.text]
        if chapter.charts:
            is_wide = any(c.least_width for c in chapter.charts) or len(chapter.charts) == 1
            placed = html_markup.placed(chapter.charts, drawn)
            body += placed if is_wide else ["<div class='columns'>", *placed, "</div>"]
    return html_markup.document(f"{view.scenario}: sweep", [*body, *_table(view)], drawn)


def file_charts(view: SweepView) -> dict[str, Sequence[Chart]]:
    """Return the charts that are written as files, by file name without ending."""
    return {f"sweep_{chapter.key}": chapter.charts for chapter in chapters(view) if chapter.charts}


def chapters(view: SweepView) -> list[Chapter]:
    """Return the parts of the page that have something to show, pantograph by pantograph."""
    found = []
    for number, pantograph in enumerate(view.pantographs[:_MOST_PANTOGRAPHS], 1):
        name = f", {pantograph}" if len(view.pantographs) > 1 else ""
        key = f"_{number}" if len(view.pantographs) > 1 else ""
        found += [
            Chapter(f"{c.key}{key}", f"{c.title}{name}", c.text, c.charts) for c in _chapters(view, pantograph, number)
        ]
    if view.request.get("sensitivity") and not view.indices:
        return [*found, Chapter("indices", "Indices of sensitivity", (f"<p class='note'>{_NO_INDICES}</p>",))]
    charts = tuple(
        sensitivity_charts.index_chart(data, f"indices_{k}")
        for k, data in enumerate(view.indices[: sensitivity_charts.MOST_INDICES])
    )
    if charts:
        found.append(Chapter("indices", "Indices of sensitivity", (f"<p class='note'>{_DESIGN}</p>",), charts))
    return found


def _chapters(view: SweepView, pantograph: str, number: int) -> Iterator[Chapter]:
    rows = view.rows_of(pantograph)
    faults = criticality.fault_parameters(view)
    grid = grid_charts.ordered(view, [p for p in view.of_kind("grid") if p not in faults])
    listed = [p for p in view.of_kind("listed") if p not in faults]
    others = [*grid, *_grouping(view, listed)]
    if found := criticality.criticalities(view, rows, [*grid, *listed]):
        yield _faults(found, number, criticality.unseen_note(view.places, view.interval))
        rows = [row for row in rows if not criticality.acting_faults(row, faults)]  # the other charts mix no faults
    if len(grid) > 1 and (charts := grid_charts.map_charts(view, rows, others, f"map_{number}")):
        names = [view.short_names[p.title] for p in grid]
        yield Chapter("maps", f"Over {names[0]} and {names[1]}", (), tuple(charts))
    if grid or (len(listed) == 1 and not view.of_kind("sampled")):
        parameters = others if grid else listed
        if charts := grid_charts.curve_charts(view, rows, parameters, f"curve_{number}"):
            yield Chapter("curves", f"Over {view.short_names[parameters[0].title]}", (), tuple(charts))
    elif listed and not view.of_kind("sampled"):
        yield Chapter("runs", "Run by run", (), tuple(variant_charts.variant_charts(view, rows, f"run_{number}")))
    if view.of_kind("sampled") and not view.request.get("sensitivity"):
        yield from _samples(view, rows, others, (pantograph, number))


def _grouping(view: SweepView, listed: Sequence[SweptColumn]) -> list[SweptColumn]:
    """Return what tells the rows of a table apart: their names, or the parameters if they have none."""
    if not listed:
        return []
    return [SweptColumn("variant", "listed")] if any(row.get("variant") for row in view.rows) else list(listed)


def _faults(found: Sequence[criticality.Criticality], number: int, unseen: str) -> Chapter:
    figures = [f.title.removesuffix(" [1]") for f in found[0].figures]
    heads = [*(["parameters"] if len(found) > 1 else []), "fault", "position [m]", *figures]
    rows = criticality.ranking_rows(found)
    leading = 2 if len(found) > 1 else 1
    ranking = html_markup.table(heads, rows[:MOST_ROWS], leading=leading, is_sortable=True)
    warning = [f"<p class='warning'>{html_markup.text(unseen)}</p>"] if unseen else []
    text = (*warning, f"<p class='note'>{_FAULTS}</p>", ranking)
    return Chapter(
        "faults", "Which fault matters", text, tuple(criticality.criticality_charts(found, f"fault_{number}"))
    )


def _samples(
    view: SweepView, rows: Sequence[Row], others: Sequence[SweptColumn], pantograph: tuple[str, int]
) -> Iterator[Chapter]:
    """Yield the chapters of samples: shares, distributions, bands, effects."""
    name, number = pantograph
    groups = grid_charts.grouped(view, rows, others)
    head = ["parameters"] if len(groups) > 1 else []
    shares = sample_charts.share_rows(groups)
    drawn = grid_charts.evenly(list(groups), sample_charts.MOST_DRAWN)
    running = [
        c
        for k, g in enumerate(drawn)
        for c in _titled(sample_charts.running_charts(view, groups[g], f"settle_{number}_{k}"), g)
    ]
    if shares:
        without = sum(not is_judged(row) for row in rows)
        told = f" {without} of {len(rows)} complete runs have no verdict." if without else ""
        heads = [*head, "limit", "samples that fail it", "share", "interval"]
        table = html_markup.table(heads, shares, leading=1 + len(head))
        text = (f"<p class='note'>{_SHARES}{told}</p>", table, *_more(groups))
        yield Chapter("shares", "How many samples fail a limit", text, tuple(running))
    table = html_markup.table(
        [*head, *sample_charts.FIGURE_HEADS], sample_charts.figure_rows(view, groups), leading=1 + len(head)
    )
    text = (table, "<p class='note'>Mean with its 95 % interval (Student), of independent samples.</p>", *_more(groups))
    charts = sample_charts.distribution_charts(view, groups, f"distribution_{number}")
    yield Chapter("distributions", "Distribution of the figures", text, tuple(charts))
    if bands := _bands(view, {g: groups[g] for g in drawn}, name, number):
        yield Chapter("bands", "Contact force over the track", (), tuple(bands))
    sampled = [p for p in view.of_kind("sampled") if not p.is_seed]
    found = {g: sensitivity_charts.effects_of(view, groups[g], sampled) for g in drawn}
    effects = [(g, f, e) for g, each in found.items() for f, e in each if e is not None]
    if effects:
        effect_heads = ["parameter", "figure", "change", "interval", "rank correlation"]
        tables = []
        for g in drawn:
            title = [f"<h3>{html_markup.text(g)}</h3>"] if g else []
            own = sensitivity_charts.effect_rows([(f, e) for o, f, e in effects if o == g])
            tables += [*title, html_markup.table(effect_heads, own, leading=2)]
        charts = [
            chart
            for k, (g, f, e) in enumerate(effects)
            for chart in _titled([sensitivity_charts.tornado(f, e, f"effect_{number}_{k}")], g)
        ]
        yield Chapter("effects", "Which parameter matters", (f"<p class='note'>{_EFFECTS}</p>", *tables), tuple(charts))


def _titled(charts: Sequence[Chart], group: str) -> list[Chart]:
    """Return charts whose titles say which group they show."""
    return [replace(c, title=f"{c.title}, {group}") if group else c for c in charts]


def _more(groups: sample_charts.Groups) -> list[str]:
    more = len(groups) - sample_charts.MOST_LISTED
    return [f"<p class='note'>{more} more combinations are in the table of runs alone.</p>"] if more > 0 else []


def _bands(view: SweepView, groups: sample_charts.Groups, pantograph: str, number: int) -> list[Chart]:
    if view.folder is None or pantograph not in view.contacts:
        return []
    made = []
    for k, (name, rows) in enumerate(groups.items()):
        folders = [view.folder / "runs" / Path(str(row["key"])).name for row in rows]
        band = force_band(folders, view.contacts[pantograph], view.interval)
        if band is not None:
            made += _titled([sample_charts.band_chart(view, band, "Contact force", f"band_{number}_{k}")], name)
    return made


def _count(view: SweepView) -> str:
    failed = len(view.failures)
    return f"{view.finished} of {view.runs} runs finished, {failed} of them failed"


def _parameter_rows(view: SweepView) -> Iterator[tuple[str, str]]:
    """Yield each parameter with its values or its distribution, then what else was asked for."""
    faults = criticality.fault_parameters(view)
    if faults:
        yield "faults", f"{len(faults)}: {faults[0].name} to {faults[-1].name}" if len(faults) > 1 else faults[0].name
    for p in (p for p in view.parameters if p not in faults):
        found = levels(view.rows, p.title)
        text = (
            ", ".join(map(level_text, found))
            if len(found) <= 12
            else (f"{len(found)} values, {level_text(found[0])} to {level_text(found[-1])}")
        )
        count = "1 value" if len(found) == 1 else f"{len(found)} values"
        yield p.title, f"{p.distribution}: {count}" if p.distribution else text
    yield from ((f"{name}, in all runs", str(value)) for name, value in view.changes.items())
    names = {"samples": "samples", "seed": "seed", "method": "method of sampling", "static_force": "static force"}
    is_sampled = any(p.distribution for p in view.parameters)
    if view.request.get("sensitivity") or not any(p.distribution and not p.is_seed for p in view.parameters):
        del names["method"]  # a design has its own, and seeds are counted
    if not view.request.get("samples"):
        del names["seed"]
    for key, name in {
        **names,
        "sensitivity": "sensitivity",
        "mean_force": "mean force wanted",
        "stop": "stop time [s]",
    }.items():
        if view.request.get(key) is not None and (is_sampled or key not in ("seed", "method")):
            yield name, str(view.request[key])
    if view.limits is not None:
        yield "limits", view.limits.title


def _failures(view: SweepView) -> list[str]:
    """Return what is said of runs that failed: each reason with its runs."""
    if not view.failures:
        return []
    reasons = Counter(view.failures.values())
    rows = []
    for reason, count in reasons.most_common(_MOST_REASONS):
        numbers = [n for n, why in view.failures.items() if why == reason]
        more = f" and {count - _MOST_NUMBERS} more" if count > _MOST_NUMBERS else ""
        rows.append([f"{', '.join(numbers[:_MOST_NUMBERS])}{more}", reason])
    hidden = len(reasons) - len(rows)
    others = [f"<p class='note'>{hidden} more reasons are in the table of the sweep.</p>"] if hidden else []
    told = f"{len(view.failures)} of {view.finished} finished runs failed; they are in no figure below."
    text = f"<p class='warning'>{told}</p>"
    return [text, html_markup.table(("runs that failed", "reason"), rows, numbers=False), *others]


def _table(view: SweepView) -> list[str]:
    """Return the table of runs, sortable; of many runs the first."""
    if not view.rows:
        return []
    has_variants = any(row.get("variant") for row in view.rows)
    has_names = len(view.pantographs) > 1
    texts = [*(["variant"] if has_variants else []), *(["pantograph"] if has_names else [])]
    figures = view.figures[: grid_charts.MOST_CHARTS]
    faults = criticality.fault_parameters(view)
    inputs = [p.title for p in view.parameters if p not in faults]
    titles = [*map(view.short_title, inputs), *(f.title.removesuffix(" [1]") for f in figures)]
    heads = ["run", *texts, *(["faults"] if faults else []), *titles, "verdict"]
    rows = []
    for row in view.rows[:MOST_ROWS]:
        number = row.get("run")
        values = (row.get(f.title) for f in figures)
        cells = (f.shown(v if isinstance(v, float) else np.nan) for f, v in zip(figures, values, strict=True))
        verdict = row.get("verdict") if row.get("status") == "complete" else f"run failed: {row.get('reason')}"
        given = (level_text(row.get(title)) for title in inputs)
        named = [str(row.get(title) or "") for title in texts] + (
            [criticality.acting_names(view, row)] if faults else []
        )
        rows.append([level_text(number), *named, *given, *cells, _short(str(verdict or ""))])
    more = len(view.rows) - len(rows)
    note = f" The first {len(rows)} of {len(view.rows)} rows; sweep.csv has all." if more else ""
    return [
        "<h2>All runs</h2>",
        f"<p class='note'>A click on a head sorts.{note}</p>",
        html_markup.table(heads, rows, leading=1 + len(texts) + bool(faults), is_sortable=True),
    ]


def _short(text: str) -> str:
    return text if len(text) <= 80 else f"{text[:79]}\u2026"
