"""The pieces of HTML of which every page consists.

Plain f-strings rather than a template engine: most of a page is tables, whose rows are computed anyway. With Jinja the
page of a verification would take about 125 lines (49 of them template) instead of 133, in two languages and with one
more dependency. All text from outside goes through `text`.
"""

from __future__ import annotations

import html
import json
from collections.abc import Iterable, Sequence
from importlib import resources
from typing import Any, Final

from master.evaluation.contact_assessment import Assessment
from master.evaluation.en50367_limits import ORIGINS, Criterion, LimitChoice
from master.report.charts.chart import Chart
from master.report.charts.interactive_figure import interactive_figure
from master.report.moving_picture import Movie, as_json
from master.report.result_tables import headlines

_ICON: Final = "<link rel='icon' href='data:,'>"
#: The browser itself prevents the page from requesting anything.
_SEALED: Final = (
    "<meta http-equiv='Content-Security-Policy' content=\"default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data: blob:\">"
)


def document(title: str, body: Sequence[str], charts: Sequence[Chart], movie: Movie | None = None) -> str:
    """Return a complete page that needs no other file."""
    parts = [
        "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'>",
        _SEALED,
        "<meta name='viewport' content='width=device-width, initial-scale=1'>",
        f"{_ICON}<title>{text(title)}</title><style>{asset('style.css')}</style></head><body><main>",
        *body,
        "</main>",
        _data("charts", {c.key: {**interactive_figure(c), "height": c.height} for c in charts}),
    ]
    if charts:
        parts += [_script("plotly-basic.min.js"), _script("charts.js")]
    if movie is not None:
        parts += [_data("movie-data", as_json(movie)), _script("movie.js")]
    if any("<table class='sortable'>" in part for part in body):
        parts.append(_script("table_sort.js"))
    return "\n".join([*parts, "</body></html>\n"])


def asset(name: str) -> str:
    """Return the text of a file that is embedded in pages."""
    return resources.files("master.report").joinpath("assets", name).read_text(encoding="utf-8")


def _script(name: str) -> str:
    return f"<script>{asset(name)}</script>"


def _data(key: str, data: Any) -> str:
    encoded = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return f"<script type='application/json' id='{key}'>{encoded}</script>"


def text(value: object) -> str:
    """Return text escaped for HTML."""
    return html.escape(str(value), quote=True)


def signs(limit: str) -> str:
    """Return a limit escaped for HTML, with typographic signs.

    Examples
    --------
    >>> signs("157.3 +- 2.5 N"), signs("<= 0.2 %"), signs("< 350 N")
    ('157.3 ± 2.5 N', '≤ 0.2 %', '&lt; 350 N')
    """
    return text(limit.replace("+-", "\u00b1").replace("<=", "\u2264"))


def table(
    heads: Sequence[str],
    rows: Iterable[Sequence[str]],
    numbers: bool = True,
    leading: int = 1,
    is_sortable: bool = False,
) -> str:
    """Return a table; the columns after the leading ones hold numbers, or text. The reader may sort a sortable one."""
    kind = "n" if numbers else "text"
    right = " class='n'" if numbers else ""
    head = "".join(f"<th{right if i >= leading else ''}>{text(h)}</th>" for i, h in enumerate(heads))
    body = "".join(
        "<tr>"
        + "".join(f"<td>{text(c)}</td>" for c in r[:leading])
        + "".join(f"<td class='{kind}'>{text(c)}</td>" for c in r[leading:])
        + "</tr>"
        for r in rows
    )
    kind = " class='sortable'" if is_sortable else ""
    return f"<div class='scroll'><table{kind}><tr>{head}</tr>{body}</table></div>"


def chart(found: Chart) -> str:
    """Return the element into which a chart is drawn, with its caption."""
    note = f"<p class='note'>{text(found.note)}</p>" if found.note else ""
    least = f";min-width:{found.least_width}px" if found.least_width else ""
    place = f"<div class='chart' id='chart-{text(found.key)}' style='height:{found.height}px{least}'></div>"
    place = f"<div class='scroll'>{place}</div>" if least else place
    return f"<figure><figcaption><h3>{text(found.title)}</h3>{note}</figcaption>{place}</figure>"


def placed(made: Sequence[Chart], drawn: list[Chart]) -> list[str]:
    """Return the elements of charts, and add the charts to those that the page draws."""
    drawn += made
    return [chart(c) for c in made]


def no_badge(title: str) -> str:
    """Return the badge that takes the place of a verdict where there is none."""
    return f"<span class='badge'>{text(title)} not judged</span>"


def mark(criterion: Criterion) -> str:
    """Return the verdict on a criterion as a sign and a word, not by colour alone."""
    kind, sign = ("pass", "\u2713") if criterion.passed else ("fail", "\u2717")
    return f"<span class='{kind}'>{sign}<span class='word'> {criterion.word}</span></span>"


def badge(passed: bool, title: str, at_limit: Sequence[str] = ()) -> str:
    """Return the overall verdict, naming the criteria that pass only because they are at the limit."""
    word = "\u2713 passed" if passed else "\u2717 failed"
    aside = f", at the limit: {', '.join(at_limit)}" if passed and at_limit else ""
    return f"<span class='badge {'pass' if passed else 'fail'}'>{text(title)} {word}{text(aside)}</span>"


def verdict(assessment: Assessment, name: str, limits: LimitChoice) -> str:
    """Return what is seen first of a contact: its verdict and headline figures."""
    q = assessment.quality
    where = f"{q.start:.1f} m to {q.end:.1f} m at {3.6 * q.speed:.1f} km/h"
    passed, at_limit = assessment.passed, assessment.at_limit
    word = no_badge(limits.title) if assessment.withheld else badge(passed, limits.title, at_limit)
    aside = f"<span class='note'>{where}</span>{_broken(assessment)}"
    head = f"<div class='verdict'><b>{text(name)}</b> {word} {aside}</div>"
    tiles = "".join(
        f"<div class='tile'><div class='name'><span>{text(h.name)}</span>{_sign(h.passed, h.is_at_limit)}</div>"
        f"<div class='value'>{text(h.value)} <small>{text(h.unit)}</small></div>"
        f"<div class='limit'>{signs(h.limit)}</div></div>"
        for h in headlines(assessment, limits)
    )
    warnings = "".join(f"<p class='warning'>{text(w)}</p>" for w in assessment.warnings)
    return f"{head}<div class='tiles'>{tiles}</div>{warnings}"


def _broken(assessment: Assessment) -> str:
    if assessment.withheld:
        return f" <span class='warning'>no verdict: {text(assessment.withheld)}</span>"
    names = ", ".join(c.name for c in assessment.criteria if not c.passed)
    return f" <span class='fail'>not met: {text(names)}</span>" if names else ""


def _sign(passed: bool | None, is_at_limit: bool = False) -> str:
    if passed is None:
        return ""
    if is_at_limit:
        return "<span class='pass'>at the limit</span>"
    return "<span class='pass'>\u2713</span>" if passed else "<span class='fail'>\u2717</span>"


def criteria(assessment: Assessment) -> str:
    """Return the table of criteria with their verdicts."""
    if assessment.withheld:
        return f"<p class='warning'>No verdict: {text(assessment.withheld)}.</p>"
    rows = "".join(
        f"<tr><td>{text(c.name)}<div class='note'>{text(c.source)}; {text(c.origin)}</div>{_remark(c)}</td>"
        f"<td class='n'>{text(c.value)}</td><td class='n'>{signs(c.limit)}</td><td>{mark(c)}</td></tr>"
        for c in assessment.criteria
    )
    heads = "<tr><th>figure and limit</th><th class='n'>value</th><th class='n'>limit</th><th>verdict</th></tr>"
    return f"<div class='scroll'><table>{heads}{rows}</table></div><p class='note'>{text(ORIGINS)}.</p>"


def _remark(criterion: Criterion) -> str:
    return f"<div>{text(criterion.remark)}</div>" if criterion.remark else ""


def movie_player(movie: Movie, begin: float) -> str:
    """Return the canvas and controls of the moving picture; it opens at the share ``begin`` of the run."""
    how = (
        "as recorded at supports, droppers and contacts" if movie.everywhere else "as recorded at supports and contacts"
    )
    note = (
        f"Side view that follows the pantographs. The deformation of the contact wire is drawn {how}, straight in "
        "between, and magnified; the messenger wire is drawn at rest, slack droppers are dashed. "
        "Below: the contact force, thin as computed, thick low-passed."
    )
    speeds = "".join(f"<option value='{v}'>{n}</option>" for v, n in ((1, "real time"), (0.25, "1/4"), (0.1, "1/10")))
    return (
        f"<p class='note'>{note}</p>"
        f"<canvas id='movie' data-begin='{begin:.4f}' style='height:26rem' role='img' "
        "aria-label='moving picture of line and pantographs'></canvas>"
        "<div class='controls'><button id='movie-play' type='button'>play</button>"
        "<input class='seek' id='movie-seek' type='range' min='0' max='1' value='0' aria-label='time'>"
        "<span id='movie-clock'></span>"
        f"<label>speed <select id='movie-speed'>{speeds}</select></label>"
        "<label>deformation \u00d7 <input id='movie-scale' type='range' min='1' max='30' value='8'></label></div>"
    )
