"""The page of a verification: a single HTML file that needs no other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from master.batch.verification.judgement import Judged, Verdict
from master.batch.verification.verification_outcome import CaseOutcome, Verification, count_verdicts
from master.batch.verification.verification_table import filter_lines, percent, verdict_text
from master.report import html_markup
from master.report.charts.chart import Chart
from master.report.charts.force_charts import force_charts
from master.report.html_markup import text
from master.results.run_results import Results

#: Classes of the verdicts in the style sheet of the pages.
_KINDS: Final[dict[Verdict, str]] = {
    "passed": "pass",
    "near": "near",
    "failed": "fail",
    "agrees": "soft",
    "departs": "soft",
}
_HEADS: Final = "<tr><th>quantity</th><th class='n'>computed</th><th>reference</th><th>source</th><th>verdict</th></tr>"
_LEGEND: Final = (
    "<b class='pass'>passed</b>: within its range, or within the tolerance of its value. "
    "<b class='near'>near</b>: outside its range, but within the tolerance stated for it. "
    "<b class='fail'>FAILED</b>: neither. A row marked <i>indicative</i> must hold too, though its source "
    "calls its own data indicative. A row marked <i>report</i> fails only outside its band; otherwise it "
    "<b class='soft'>agrees</b> or <b class='soft'>departs</b>. "
    "Percentages are of the value, or of the nearer limit of the range."
)


def page(verification: Verification) -> str:
    """Return the whole page."""
    versions = ", ".join(f"{name} {version}" for name, version in verification.versions.items())
    drawn: list[Chart] = []
    body = [
        "<h1>Verification</h1>",
        f"<p class='note'>{text(verification.date)}; {text(versions)}</p>",
        _banner(verification),
        _overview(verification.cases),
        f"<p class='note'>{_LEGEND}</p>",
        *(part for outcome in verification.cases for part in _section(outcome, drawn)),
    ]
    return html_markup.document("Verification", body, drawn)


def _section(outcome: CaseOutcome, drawn: list[Chart]) -> Iterator[str]:
    """Yield the section of a case: its rows, charts and provenance."""
    case = outcome.case
    yield f"<h2 id='{text(case.name)}'>{text(f'{case.name}: {case.title}')}</h2>"
    if case.description:
        yield f"<p>{text(case.description)}</p>"
    for note in filter(None, (case.citation, *filter_lines(outcome))):
        yield f"<p class='note'>{text(note)}</p>"
    for name, why in outcome.failures.items():
        yield f"<p class='warning'>Run '{text(name)}' failed: {text(why)}</p>"
    several = len(case.runs) > 1
    rows = "".join(_row(row, several) for row in outcome.rows)
    yield f"<div class='scroll'><table>{_HEADS}{rows}</table></div>"
    if not several:
        made = [
            replace(c, key=f"{case.name}_{c.key}") for r in outcome.runs.values() for c in force_charts(r, r.signals)
        ]
        yield from html_markup.placed(made, drawn)
    yield _provenance(outcome)


def _banner(verification: Verification) -> str:
    if verification.status != "complete":
        return f"<p class='warning'><b>Not finished.</b> {text(verification.sentence)}.</p>"
    kind, word = ("pass", "Verified") if verification.passed else ("fail", "Not verified")
    return f"<p><b class='{kind}'>{word}.</b> {text(verification.sentence)}.</p>"


def _overview(cases: Sequence[CaseOutcome]) -> str:
    rows = "".join(
        f"<tr><td><a href='#{text(c.case.name)}'>{text(c.case.name)}</a></td>"
        f"<td>{text(c.case.title)}</td><td>{text(count_verdicts((c,)))}</td>"
        f"<td class='{'pass' if c.passed else 'fail'}'>{'passed' if c.passed else 'FAILED'}</td></tr>"
        for c in cases
    )
    heads = "<tr><th>case</th><th>subject</th><th>rows</th><th>verdict</th></tr>"
    return f"<div class='scroll'><table>{heads}{rows}</table></div>" if rows else ""


def _row(judged: Judged, several: bool) -> str:
    where = f" ({judged.row.run})" if several and not judged.row.title else ""
    remark = f"<div class='note'>{text(judged.remark)}</div>" if judged.remark else ""
    kind = "" if judged.row.kind == "must hold" else f"<div class='note'><i>{judged.row.kind}</i></div>"
    return (
        f"<tr{' class=failing' if judged.fails else ''}>"
        f"<td class='text'>{text(judged.title + where)}{remark}{_details(judged)}</td>"
        f"<td class='n'>{text(judged.shown)}</td><td>{text(judged.reference)}</td>"
        f"<td class='text'>{text(judged.row.source)}{kind}</td>"
        f"<td class='{_KINDS[judged.verdict]}'>{text(verdict_text(judged))}</td></tr>"
    )


def _details(judged: Judged) -> str:
    """Return the individual values of a row that has several."""
    measured = judged.measured
    if measured is None or len(measured.values) < 2:
        return ""
    rows = [
        (label, f"{v:.1f} {judged.unit}", "" if b.target is None else f"{b.target:g}", percent(b.deviation(v)))
        for label, v, b in zip(measured.labels, measured.values, judged.bounds, strict=True)
    ]
    shown = html_markup.table(("at", "computed", "reference", "deviation"), rows)
    return f"<details><summary>individual values</summary>{shown}</details>"


def _provenance(outcome: CaseOutcome) -> str:
    lines = [_run_line(name, results) for name, results in outcome.runs.items()]
    if not lines:
        return ""
    items = "".join(f"<li>{text(line)}</li>" for line in lines)
    return f"<details><summary>how it was computed</summary><ul class='note'>{items}</ul></details>"


def _run_line(name: str, results: Results) -> str:
    summary = results.summary
    settings, performance = summary["settings"], summary["performance"]
    fmus = "; ".join(f"{c['fmu']} sha256 {c['sha256'][:16]}" for c in summary["components"])
    shown = f"{name} = {summary['scenario']}" if name != summary["scenario"] else name
    return (
        f"{shown}: {settings['coupling']['scheme']}, step {1e3 * settings['step']:g} ms, "
        f"{settings['start']:g} s to {settings['stop']:g} s in {performance['wall_time']:.1f} s; {fmus}"
    )
