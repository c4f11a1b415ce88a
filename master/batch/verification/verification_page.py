"""A verification as a page: one HTML file that needs nothing else."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterable, Sequence
from typing import Final

from master.batch.verification.judgement import Judged
from master.batch.verification.verification_outcome import CaseOutcome, Verification, count_verdicts
from master.batch.verification.verification_table import filter_lines, percent, verdict_text
from master.report.charts import static_charts
from master.results.run_results import Results

_STYLE: Final = """
body{font:15px/1.45 system-ui,sans-serif;max-width:70rem;margin:2rem auto;padding:0 1rem;color:#202124}
h1{font-size:1.5rem;margin-bottom:.2rem}h2{font-size:1.15rem;margin:2.4rem 0 .2rem}p{margin:.4rem 0}
table{border-collapse:collapse;margin:.8rem 0;width:100%}img{max-width:100%}a{color:#1f5fa8}
td,th{padding:.25rem .7rem;border-bottom:1px solid #e3e5e8;text-align:left;vertical-align:top}
th{font-weight:600;color:#5f6368}td.n{text-align:right;white-space:nowrap}td.v{white-space:nowrap;font-weight:600}
.holds{color:#1e7b34}.near{color:#9a6700}.fails{color:#b3261e}.agrees,.departs{color:#5f6368}
tr.failing td{background:#fdecea}
col.q{width:35%}col.c{width:15%}col.r{width:19%}col.s{width:18%}col.v{width:13%}.rows{table-layout:fixed}
details table{width:auto;margin:.2rem 0}details td{white-space:nowrap}th.n{text-align:right}
small,.note{color:#5f6368;font-size:.85rem}summary{cursor:pointer;color:#5f6368;font-size:.85rem}
.banner{padding:.5rem .8rem;border-left:4px solid}
.good{background:#e8f5ea;border-color:#1e7b34}.bad{background:#fdecea;border-color:#b3261e}
.unfinished{background:#fff4e0;border-color:#9a6700}
"""
_HEADS: Final = (
    "<colgroup><col class='q'><col class='c'><col class='r'><col class='s'><col class='v'></colgroup>"
    "<tr><th>quantity</th><th class='n'>computed</th><th>reference</th><th>source</th><th>verdict</th></tr>"
)
_LEGEND: Final = (
    "<b class='holds'>holds</b>: within its range, or within the tolerance of its value. "
    "<b class='near'>near</b>: outside its range, but within the tolerance stated for it. "
    "<b class='fails'>FAILS</b>: neither. A row marked <i>indicative</i> is meant to hold too, though its source "
    "calls its own data indicative. A row marked <i>report</i> is printed and fails only outside its band: it "
    "<b class='agrees'>agrees</b> or <b class='departs'>departs</b>. "
    "Percentages are of the value, or of the range's nearer limit."
)


def page(verification: Verification, sections: Iterable[str]) -> str:
    """Return the whole page around the cases' sections."""
    versions = ", ".join(f"{name} {version}" for name, version in verification.versions.items())
    return "\n".join(
        [
            "<!doctype html><html lang='en'><head><meta charset='utf-8'>",
            "<meta name='viewport' content='width=device-width'>",
            f"<title>Verification</title><style>{_STYLE}</style></head><body>",
            "<h1>Verification</h1>",
            f"<p class='note'>{html.escape(verification.date)}; {html.escape(versions)}</p>",
            _banner(verification),
            _overview(verification.cases),
            f"<p class='note'>{_LEGEND}</p>",
            *sections,
            "</body></html>\n",
        ]
    )


def section(outcome: CaseOutcome) -> str:
    """Return a case's part of the page: its rows, plots and provenance."""
    case = outcome.case
    parts = [f"<h2 id='{html.escape(case.name)}'>{html.escape(f'{case.name}: {case.title}')}</h2>"]
    parts += [f"<p>{html.escape(case.description)}</p>"] if case.description else []
    parts += [f"<p class='note'>{html.escape(case.citation)}</p>"] if case.citation else []
    parts += [_failure(name, text) for name, text in outcome.failures.items()]
    parts += [f"<p class='note'>{html.escape(line)}</p>" for line in filter_lines(outcome)]
    parts.append(_rows(outcome))
    if len(outcome.runs) == 1:
        parts += [_picture(results) for results in outcome.runs.values()]
    parts.append(_provenance(outcome))
    return "\n".join(parts)


def _banner(verification: Verification) -> str:
    if verification.status != "complete":
        kind, word = "unfinished", "Not finished"
    else:
        kind, word = ("good", "Verified") if verification.passed else ("bad", "Not verified")
    return f"<p class='banner {kind}'><b>{word}.</b> {html.escape(verification.sentence)}.</p>"


def _overview(cases: Sequence[CaseOutcome]) -> str:
    rows = "".join(
        f"<tr><td><a href='#{html.escape(c.case.name)}'>{html.escape(c.case.name)}</a></td>"
        f"<td>{html.escape(c.case.title)}</td><td>{html.escape(count_verdicts((c,)))}</td>"
        f"<td class='v {'holds' if c.passed else 'fails'}'>{'passes' if c.passed else 'FAILS'}</td></tr>"
        for c in cases
    )
    return f"<table><tr><th>case</th><th>what</th><th>rows</th><th>verdict</th></tr>{rows}</table>" if rows else ""


def _rows(outcome: CaseOutcome) -> str:
    several = len(outcome.case.runs) > 1
    rows = "".join(_row(row, several) for row in outcome.rows)
    return f"<table class='rows'>{_HEADS}{rows}</table>"


def _row(judged: Judged, several: bool) -> str:
    where = f" ({judged.row.run})" if several and not judged.row.title else ""
    remark = f"<br><small>{html.escape(judged.remark)}</small>" if judged.remark else ""
    kind = "" if judged.row.kind == "must hold" else f"<br><small><i>{judged.row.kind}</i></small>"
    return (
        f"<tr{' class=failing' if judged.fails else ''}>"
        f"<td>{html.escape(judged.title + where)}{remark}{_details(judged)}</td>"
        f"<td class='n'>{html.escape(judged.shown)}</td><td>{html.escape(judged.reference)}</td>"
        f"<td>{html.escape(judged.row.source)}{kind}</td>"
        f"<td class='v {judged.verdict}'>{html.escape(verdict_text(judged))}</td></tr>"
    )


def _details(judged: Judged) -> str:
    """Return the single numbers of a row that has several."""
    measured = judged.measured
    if measured is None or len(measured.values) < 2:
        return ""
    rows = "".join(
        f"<tr><td>{html.escape(label)}</td><td class='n'>{value:.1f} {html.escape(judged.unit)}</td>"
        f"<td class='n'>{'' if b.target is None else f'{b.target:g}'}</td>"
        f"<td class='n'>{percent(b.deviation(value))}</td></tr>"
        for label, value, b in zip(measured.labels, measured.values, judged.bounds, strict=True)
    )
    heads = "<tr><th>at</th><th>computed</th><th>reference</th><th>off</th></tr>"
    return f"<details><summary>each of them</summary><table>{heads}{rows}</table></details>"


def _failure(name: str, text: str) -> str:
    return f"<p class='banner bad'>Run '{html.escape(name)}' failed: {html.escape(text)}</p>"


def _picture(results: Results) -> str:
    """Return the contact force over the track, empty where a run has none."""
    figure = static_charts.contact_force(results)
    if figure is None:
        return ""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    encoded = base64.b64encode(buffer.getvalue()).decode("ascii")
    return f"<img alt='contact force over the track' src='data:image/png;base64,{encoded}'>"


def _provenance(outcome: CaseOutcome) -> str:
    lines = [_run_line(name, results) for name, results in outcome.runs.items()]
    if not lines:
        return ""
    items = "".join(f"<li>{html.escape(line)}</li>" for line in lines)
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
