"""The report of one run: a single HTML file that needs no other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from master.evaluation.contact_assessment import Assessment
from master.evaluation.contact_signals import Signals
from master.evaluation.filters import SETTLING, ForceFilter
from master.evaluation.measured_force import MeasuredComparison
from master.report import html_markup
from master.report.charts.chart import Chart
from master.report.charts.measured_charts import comparison_chart, comparison_rows
from master.report.charts.output_charts import HEADS, has_contacts, output_charts, output_rows
from master.report.charts.run_charts import run_charts
from master.report.moving_picture import Movie, make_movie
from master.report.result_tables import FILTER_HEADS, calibration_line, figure_rows, filter_rows, uplift_line
from master.report.run_inputs import Input, inputs_of, provenance_rows, quality_rows
from master.report.run_names import coupled_models, short_names
from master.report.run_title import run_title
from master.results.run_results import Results

_CONTENTS: Final = (
    ("verdict", "Verdict"),
    ("outputs", "Outputs"),
    ("figures", "Figures"),
    ("measured", "Measured"),
    ("force", "Contact force"),
    ("movie-part", "Moving picture"),
    ("line", "Line and droppers"),
    ("inputs", "Inputs"),
    ("computed", "How it was computed"),
)
_LINE_CHARTS: Final = ("uplift", "dropper", "elevation", "plan")


def page(done: Results, measured: MeasuredComparison | None = None) -> str:
    """Return the report of a run as HTML.

    Parameters
    ----------
    done : Results
        The run, complete or not.
    measured : MeasuredComparison, optional
        A measured contact force to show beside it.
    """
    summary, signals, assessments = done.summary, done.signals, done.assessments()
    is_coupling, names = has_contacts(done), short_names(summary)
    charts = run_charts(done, signals) if is_coupling else output_charts(done)
    extra = [comparison_chart(measured)] if measured is not None else []
    movie = make_movie(done, signals)
    body = [
        _head(done, assessments, is_coupling),
        *([] if is_coupling else _outputs(done, charts)),
        _figures(done, assessments, names),
        _spans(assessments, names),
        *(_measured(measured, extra[0]) if measured is not None else ()),
        *_section("force", "Contact force", [c for c in charts if is_coupling and not c.key.startswith(_LINE_CHARTS)]),
        *(_movie(movie, signals) if movie is not None else ()),
        *_section("line", "Line and droppers", [c for c in charts if c.key.startswith(_LINE_CHARTS)]),
        _inputs(summary),
        _computed(summary),
    ]
    contents = "".join(f"<a href='#{k}'>{t}</a>" for k, t in _CONTENTS if any(f"id='{k}'" in part for part in body))
    title = f"{summary.get('scenario', '')}: {run_title(done) or _subject(is_coupling)}"
    title += "".join(f", {key} = {value}" for key, value in (summary.get("changes") or {}).items())
    return html_markup.document(title, [f"<nav>{contents}</nav>", *body], [*charts, *extra], movie)


def _subject(is_coupling: bool) -> str:
    return "pantograph-catenary interaction" if is_coupling else "outputs of the run"


def _outputs(done: Results, charts: list[Chart]) -> list[str]:
    """Return the section of a run without a contact: its outputs."""
    table = f"<div class='scroll'>{html_markup.table(HEADS, output_rows(done))}</div>"
    return ["<section id='outputs'><h2>Outputs</h2>", table, *map(html_markup.chart, charts), "</section>"]


def _head(done: Results, assessments: tuple[Assessment, ...], is_coupling: bool = True) -> str:
    summary, limits = done.summary, done.evaluation.limits
    key, names = "verdict" if is_coupling else "run", short_names(summary)
    parts = [f"<section id='{key}'>{_title(done, is_coupling)}", status_note(summary)]
    parts.append(_warnings(summary))
    parts += [html_markup.verdict(a, names[a.contact.pantograph], limits) for a in assessments]
    if reason := summary.get("not_judged", ""):
        parts.append(f"<p class='warning'><b>Not judged.</b> There are no figures: {html_markup.text(reason)}.</p>")
    elif not assessments and is_coupling:
        parts.append("<p class='warning'>No contact-quality figures: no contact force in the interval of interest.</p>")
    return "".join([*parts, "</section>"])


def _title(done: Results, is_coupling: bool) -> str:
    """Return what the scenario says that it is, with the names of line and pantographs."""
    summary = done.summary
    name = str(summary.get("scenario", ""))
    head = run_title(done) or f"{name}: {_subject(is_coupling)}"
    parts = [f"scenario {name}"] if summary.get("title") else []
    parts += [f"{component}: {model}" for component, model in coupled_models(summary)]
    if changes := summary.get("changes"):  # the title is the scenario's, which does not know of them
        parts.append("with " + ", ".join(f"{key} = {value}" for key, value in changes.items()))
    note = f"<p class='note'>{html_markup.text('; '.join(parts))}</p>" if parts else ""
    return f"<h1>{html_markup.text(head)}</h1>{note}"


def _warnings(summary: dict[str, Any]) -> str:
    """Return the warnings of the FMUs, and those on the scenario."""
    said = ((html_markup.text(w["component"]), html_markup.text(w["text"])) for w in summary.get("warnings", []))
    found = [f"<p class='warning'>{component} warns: {text}</p>" for component, text in said]
    of_files = (html_markup.text(text) for text in summary.get("scenario_warnings", []))
    return "".join([*found, *(f"<p class='warning'>{text}</p>" for text in of_files)])


def status_note(summary: dict[str, Any]) -> str:
    """Return a warning if the run is not complete."""
    status = str(summary.get("status"))
    if status == "complete":
        return ""
    reached, stop = summary.get("time_reached"), summary.get("settings", {}).get("stop")
    where = f" at t = {reached:.6g} s" if reached is not None else ""
    where += f" of {stop:.6g} s" if where and stop is not None else ""
    words = {"running": "was not finished (it is still running or was killed)", "failed": "failed"}
    how = words.get(status, f"was {status}")
    reason = f" {html_markup.text(summary['reason'])}." if summary.get("reason") else ""
    note = f"<b>Incomplete.</b> This run {html_markup.text(how)}{where}.{reason} The results so far follow."
    return f"<p class='warning'>{note}</p>"


def _figures(done: Results, assessments: tuple[Assessment, ...], names: Mapping[str, str]) -> str:
    if not assessments:
        return ""
    chosen, title = done.evaluation.filter, html_markup.text(done.evaluation.limits.title)
    heads = [f"figure, {chosen.band}", *(names[a.contact.pantograph] for a in assessments)]
    verdicts = "".join(
        f"<h3>{title}, {html_markup.text(names[a.contact.pantograph])}</h3>{html_markup.criteria(a)}"
        for a in assessments
    )
    rows = html_markup.table(heads, figure_rows(assessments))
    said = [f"{f.sentence}." for f in done.follower_effects] + [
        t for t in (calibration_line(done), uplift_line(done)) if t
    ]
    notes = f"<p class='note'>{INTERVAL_NOTE} Filter: {html_markup.text(chosen.sentence)}.</p>"
    notes += "".join(f"<p>{html_markup.text(line)}</p>" for line in said)
    notes += "".join(_filters(a, chosen, names[a.contact.pantograph]) for a in assessments)
    statistics = f"<div><h3>Statistics in the interval of interest</h3>{rows}{notes}</div>"
    return (
        f"<section id='figures'><h2>Figures</h2><div class='columns'><div>{verdicts}</div>{statistics}</div></section>"
    )


#: From which part of the run each figure is taken, for the reader.
INTERVAL_NOTE: Final = (
    "Forces, losses and heights are taken while the strip is in the interval of interest, which, if no start is "
    f"given, begins {SETTLING:g} s after the first contact. Uplift: of supports in the interval, its ends included, "
    "over the whole run. Slack droppers: share of the droppers in the interval that go slack as the pantograph "
    "passes, before the next one arrives."
)


def _filters(a: Assessment, chosen: ForceFilter, name: str) -> str:
    """Return the figures with every filter, if they depend on it."""
    rows = filter_rows(a.quality, chosen)
    head = f"<h3>The extremes of {html_markup.text(name)} depend on the filter</h3>"
    return f"{head}{html_markup.table(FILTER_HEADS, rows)}" if rows else ""


def _spans(assessments: tuple[Assessment, ...], names: Mapping[str, str]) -> str:
    """Return the figures span by span, which show whether the run has settled."""
    heads = ("span", "mean [N]", "sigma [N]", "maximum [N]", "minimum [N]")
    parts = []
    for a in assessments:
        rows = [
            (f"{s.start:.1f} m to {s.end:.1f} m{'' if s.is_inside else ' (outside the interval)'}",
             *(f"{v:.1f}" for v in (s.mean, s.sigma, s.maximum, s.minimum)))
            for s in a.spans
        ]  # fmt: skip
        if rows:
            parts.append(f"<h3>{html_markup.text(names[a.contact.pantograph])}</h3>{html_markup.table(heads, rows)}")
    if not parts:
        return ""
    note = "<p class='note'>Low-passed force in every whole span after the contact has settled.</p>"
    return f"<section id='spans'><details><summary>Span by span</summary>{note}{''.join(parts)}</details></section>"


def _section(key: str, title: str, charts: list[Chart]) -> list[str]:
    if not charts:
        return []
    return [f"<section id='{key}'><h2>{title}</h2>", *map(html_markup.chart, charts), "</section>"]


def _movie(movie: Movie, signals: tuple[Signals, ...]) -> list[str]:
    inside = np.flatnonzero(signals[0].inside)
    begin = (inside[0] + inside[-1]) / 2.0 / len(signals[0].inside) if inside.size else 0.5
    return [
        f"<section id='movie-part'><h2>Moving picture</h2>{html_markup.movie_player(movie, float(begin))}</section>"
    ]


def _measured(found: MeasuredComparison, chart: Chart) -> list[str]:
    heads = ("low-passed", "simulated", "measured", "difference")
    rows = html_markup.table(heads, comparison_rows(found))
    where = f"compared from {found.start:.1f} m to {found.end:.1f} m"
    note = f"<p class='note'>Measured: {html_markup.text(found.source)}; {where}.</p>"
    note += "".join(f"<p class='warning'>Warning: {html_markup.text(w)}.</p>" for w in found.warnings)
    return [
        "<section id='measured'><h2>Measured and simulated</h2>",
        note,
        rows,
        html_markup.chart(chart),
        "</section>",
    ]


def _inputs(summary: dict[str, Any]) -> str:
    parts = ["<section id='inputs'><h2>Inputs and where they come from</h2>"]
    parts.append("<p class='note'>A dot marks parameters set by the scenario or the command line.</p>")
    for component in summary.get("components", []):
        rows = "".join(_input_row(i) for i in inputs_of(component))
        heads = "<tr><th>parameter</th><th class='n'>value</th><th>unit</th><th>description</th><th>source</th></tr>"
        model = ", ".join(filter(None, (component.get("description"), component.get("fmu", "-"))))
        head = f"<summary>{html_markup.text(component['name'])}: {html_markup.text(model)}</summary>"
        parts.append(f"<details>{head}<div class='scroll'><table>{heads}{rows}</table></div></details>")
    return "".join([*parts, "</section>"])


def _input_row(i: Input) -> str:
    changed = " class='changed'" if i.changed else ""
    return (
        f"<tr{changed}><td>{html_markup.text(i.name)}</td><td class='n'>{html_markup.text(i.value)}</td>"
        f"<td>{html_markup.text(i.unit)}</td><td class='text'>{html_markup.text(i.description)}</td>"
        f"<td class='text note'>{html_markup.text(i.source)}</td></tr>"
    )


def _computed(summary: dict[str, Any]) -> str:
    quality = html_markup.table(("item", "value"), quality_rows(summary), numbers=False)
    provenance = html_markup.table(("item", "value"), provenance_rows(summary), numbers=False)
    return (
        "<section id='computed'><h2>How it was computed</h2><div class='columns'>"
        f"<div><h3>Numerical quality</h3>{quality}</div>"
        f"<div><h3>Versions and provenance</h3>{provenance}</div></div></section>"
    )
