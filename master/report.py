"""The report: one HTML file that needs nothing else, the plots as files, and tables for the terminal."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from rich.markup import escape
from rich.table import Table

from master import plots, results
from master.quality import FILTER_NOTE, Quality
from master.results import Assessment, Results

_STYLE: Final = """
body{font:15px/1.45 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#202124}
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}table{border-collapse:collapse;margin:.6rem 0}
td,th{padding:.2rem .8rem;border-bottom:1px solid #e3e5e8;text-align:left}td.n{text-align:right}
.pass{color:#1e7b34;font-weight:600}.fail{color:#b3261e;font-weight:600}img{max-width:100%}
.note{color:#5f6368;font-size:.85rem}
.warn{background:#fdecea;padding:.5rem .8rem;border-left:4px solid #b3261e}
"""

#: Rows of the figures' table: title, unit, how to get it, decimals.
_FIGURES: Final = (
    ("mean force", "N", lambda q: q.mean, 1),
    ("standard deviation", "N", lambda q: q.sigma, 1),
    ("maximum", "N", lambda q: q.maximum, 1),
    ("minimum", "N", lambda q: q.minimum, 1),
    ("amplitude", "N", lambda q: q.amplitude, 1),
    ("statistical maximum", "N", lambda q: q.statistical_maximum, 1),
    ("statistical minimum", "N", lambda q: q.statistical_minimum, 1),
    ("sigma 0-2 Hz", "N", lambda q: q.sigma_bands["0-2"], 1),
    ("sigma 0-5 Hz", "N", lambda q: q.sigma_bands["0-5"], 1),
    ("sigma 5-20 Hz", "N", lambda q: q.sigma_bands["5-20"], 1),
    ("contact losses", "", lambda q: q.losses.count, 0),
    ("longest loss", "ms", lambda q: 1e3 * q.losses.longest, 1),
    ("share of loss", "%", lambda q: q.losses.percentage, 2),
    ("contact height range", "mm", lambda q: _scaled(q.contact_height_range), 1),
    ("contact on strip, least", "mm", lambda q: _scaled(q.lateral_minimum), 0),
    ("contact on strip, greatest", "mm", lambda q: _scaled(q.lateral_maximum), 0),
)


def _scaled(value: float | None) -> float | None:
    return None if value is None else 1e3 * value


def figure_rows(qualities: Sequence[Quality]) -> list[tuple[str, ...]]:
    """Return the figures' table: title with unit, then one value per contact."""
    rows = []
    for title, unit, get, decimals in _FIGURES:
        values = [get(q) for q in qualities]
        shown = ["-" if v is None else f"{v:.{decimals}f}" for v in values]
        rows.append((f"{title} [{unit}]" if unit else title, *shown))
    return rows


def write(done: Results) -> Path:
    """Write the plots (PNG and SVG) and ``report.html`` into the run's folder; returns the report's path."""
    pictures = []
    for name, figure in plots.all_plots(done).items():
        figure.savefig(done.folder / f"{name}.svg", metadata={"Date": None})
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=130)
        (done.folder / f"{name}.png").write_bytes(buffer.getvalue())
        pictures.append((plots.title_of(name), buffer.getvalue()))
    path = done.folder / results.REPORT
    path.write_text(page(done, pictures), encoding="utf-8")
    return path


def page(done: Results, pictures: Iterable[tuple[str, bytes]] = ()) -> str:
    """Return the report as HTML, pictures inlined."""
    summary = done.summary
    name = html.escape(str(summary.get("scenario", "")))
    parts = [
        "<!doctype html><html lang='en'><head><meta charset='utf-8'>",
        f"<title>{name}</title><style>{_STYLE}</style>",
    ]
    parts.append(f"</head><body><h1>{name}: pantograph-catenary interaction</h1>")
    parts.append(_status(summary))
    assessments = done.assessments()
    parts.extend(_verdict(a) for a in assessments)
    if assessments:
        heads = ["0-20 Hz", *(f"contact {a.quality.contact}" for a in assessments)]
        parts.append("<h2>Figures in the interval of interest</h2>")
        parts.append(_html_table(heads, figure_rows([a.quality for a in assessments])))
        parts.append(f"<p class='note'>Filter: {html.escape(FILTER_NOTE)}.</p>")
    parts.extend(_picture(title, data) for title, data in pictures)
    parts.append(_provenance(summary))
    return "\n".join(parts) + "</body></html>\n"


def _status(summary: dict[str, Any]) -> str:
    if summary.get("status") == "complete":
        return ""
    reason = html.escape(str(summary.get("reason", "")))
    reached = summary.get("time_reached", 0.0)
    status = html.escape(str(summary.get("status")))
    return f"<p class='warn'>This run is {status} at t = {reached:.6g} s. {reason}</p>"


def _verdict(assessment: Assessment) -> str:
    q = assessment.quality
    word = _mark(assessment.passed)
    head = f"<h2>EN 50367, {html.escape(assessment.contact.pantograph)}: {word}</h2>"
    where = f"<p>{q.start:.1f} m to {q.end:.1f} m at {3.6 * q.speed:.1f} km/h.</p>"
    rows = [
        (html.escape(c.name), html.escape(c.value), html.escape(c.limit), _mark(c.passed)) for c in assessment.criteria
    ]
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    heads = "<tr><th>figure</th><th>value</th><th>limit</th><th>verdict</th></tr>"
    return f"{head}{where}<table>{heads}{body}</table>"


def _mark(passed: bool) -> str:
    return "<span class='pass'>passed</span>" if passed else "<span class='fail'>failed</span>"


def _html_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = "".join(f"<th>{html.escape(h)}</th>" for h in heads)
    body = "".join(
        f"<tr><td>{html.escape(r[0])}</td>" + "".join(f"<td class='n'>{html.escape(c)}</td>" for c in r[1:]) + "</tr>"
        for r in rows
    )
    return f"<table><tr>{head}</tr>{body}</table>"


def _picture(title: str, data: bytes) -> str:
    encoded = base64.b64encode(data).decode("ascii")
    return f"<h2>{html.escape(title)}</h2><img alt='{html.escape(title)}' src='data:image/png;base64,{encoded}'>"


def _provenance(summary: dict[str, Any]) -> str:
    settings, performance = summary.get("settings", {}), summary.get("performance", {})
    rows = [
        ("date", str(summary.get("date", ""))),
        (
            "coupling",
            f"{settings.get('coupling', {}).get('scheme')}, step {1e3 * settings.get('step', 0.0):g} ms",
        ),
        (
            "wall time",
            f"{performance.get('wall_time', 0.0):.2f} s, "
            f"real-time factor {performance.get('real_time_factor', 0.0):.2f}",
        ),
        *(
            (
                f"contact {p['contact']}: energy added by the coupling",
                f"{p['energy']:.3g} J of {p['transferred']:.3g} J exchanged",
            )
            for p in summary.get("interface_power", [])
        ),
        *((f"FMU {c['name']}", f"{c['fmu']}, sha256 {c['sha256'][:16]}") for c in summary.get("components", [])),
        *((f"version of {k}", v) for k, v in summary.get("versions", {}).items()),
    ]
    return "<h2>How it was computed</h2>" + _html_table(("what", "value"), rows)


def verdict_table(assessment: Assessment) -> Table:
    """Return the verdict of one contact for a terminal of 80 columns."""
    q = assessment.quality
    title = f"EN 50367, {assessment.contact.pantograph}, {q.start:.0f}-{q.end:.0f} m, {3.6 * q.speed:.0f} km/h"
    table = Table(title=title, title_justify="left", width=78)
    for head in ("figure", "value", "limit", "verdict"):
        table.add_column(head, justify="left" if head == "figure" else "right", no_wrap=True)
    for c in assessment.criteria:
        table.add_row(c.name, c.value, c.limit, "[green]passed[/]" if c.passed else "[red]failed[/]")
    return table


def figures_table(qualities: Sequence[Quality], heads: Sequence[str]) -> Table:
    """Return the figures of several contacts or runs side by side for a terminal of 80 columns."""
    table = Table(title="Figures, 0-20 Hz", title_justify="left", width=78)
    table.add_column("figure", no_wrap=True)
    for head in heads:
        table.add_column(head, justify="right", overflow="fold")
    for row in figure_rows(qualities):
        table.add_row(*map(escape, row))
    return table


def uplift_line(done: Results) -> str:
    """Return one line on the supports' uplift, empty if it is not recorded."""
    uplifts = done.uplifts
    if not uplifts:
        return ""
    most = max(uplifts, key=lambda u: u.maximum)
    where = f"x = {most.x:.1f} m" if most.x is not None else f"support {most.support}"
    return f"largest uplift {1e3 * most.maximum:.1f} mm at {where} (t = {most.time:.2f} s)"
