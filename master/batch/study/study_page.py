"""The page of a study: a single HTML file that needs no other."""

from __future__ import annotations

from collections.abc import Sequence

from master.batch.assessment_figures import FIGURES, verdict_of
from master.batch.study import study_charts
from master.batch.study.study_evaluation import StudyEntry
from master.batch.study.study_outcome import (
    StudyOutcome,
    differences,
    filter_remarks,
    filters,
    judged_by,
    shown,
)
from master.report import html_markup
from master.report.charts.chart import Chart
from master.report.run_page import INTERVAL_NOTE

_STATUS = {
    "running": "Not finished: the study is still running or was killed. The results so far follow.",
    "interrupted": "Interrupted. The results so far follow.",
}


def page(outcome: StudyOutcome) -> str:
    """Return the whole page."""
    settings = outcome.family.settings
    drawn: list[Chart] = []
    body = [
        f"<h1>{html_markup.text(outcome.family.name)}</h1>",
        f"<p>{html_markup.text(settings.title)}</p>",
        f"<p class='note'>{html_markup.text(settings.source)}; {html_markup.text(outcome.date)}</p>",
    ]
    if outcome.status in _STATUS:
        body.append(f"<p class='warning'>{_STATUS[outcome.status]}</p>")
    body += [f"<p class='warning'>{html_markup.text(f'{n}: {why}')}</p>" for n, why in outcome.failures.items()]
    for interval in settings.interval:
        found = outcome.entries(interval)
        title = f"{interval.name}, {interval.start:g} m to {interval.end:g} m"
        body.append(f"<h2>{html_markup.text(title)}</h2>")
        if found:
            body += _tables(found, judged_by(outcome.done))
            body += html_markup.placed(study_charts.interval_charts(outcome, interval, found), drawn)
    body += _sharing(outcome)
    body += html_markup.placed(study_charts.sharing_charts(outcome), drawn)
    if histories := study_charts.history_charts(outcome):
        body += ["<h2>Histories</h2>", *html_markup.placed(histories, drawn)]
    body += [f"<p class='note'>Contact forces: {html_markup.text(f)}.</p>" for f in filters(outcome)]
    return html_markup.document(outcome.family.name, body, drawn)


def _tables(found: Sequence[StudyEntry], title: str) -> list[str]:
    heads = ["variant, pantograph", *(f"{name} [{unit}]".removesuffix(" [1]") for name, unit, _, _ in FIGURES), title]
    rows = [
        [e.name, *(shown(get(e.assessment), d) for _, _, get, d in FIGURES), verdict_of(e.assessment)] for e in found
    ]
    note = INTERVAL_NOTE
    parts = [html_markup.table(heads, rows), f"<p class='note'>{note}</p>"]
    parts += [f"<p class='note'>{html_markup.text(r)}</p>" for r in filter_remarks(found)]
    if beside := differences(found):
        lines = [[f"{v}, {p}", other, *(f"{d:+.1f}" for d in change)] for v, p, other, change in beside]
        heads = ["variant, pantograph", "compared with", "sigma [N]", "maximum [N]", "minimum [N]"]
        parts += ["<h3>Differences between pantographs</h3>", html_markup.table(heads, lines)]
    return parts


def _sharing(outcome: StudyOutcome) -> list[str]:
    found = outcome.all_entries
    heads = ["variant, pantograph", "both wires from [m]", "to [m]", "for [s]", "losses per wire", "lowest total [N]"]
    rows = []
    for e in found:
        if (s := e.sharing) is not None:
            losses = ", ".join(map(str, s.losses))
            rows.append([e.name, f"{s.start:.1f}", f"{s.end:.1f}", f"{s.duration:.3f}", losses, f"{s.least_force:.1f}"])
    return ["<h2>From wire to wire</h2>", html_markup.table(heads, rows)] if rows else []
