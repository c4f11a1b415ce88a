"""Figures and verdicts as rows of tables, and as tables for a terminal 80 columns wide."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from master.evaluation.contact_assessment import Assessment
from master.evaluation.contact_quality import Filtered, Quality
from master.evaluation.en50367_limits import ORIGINS, Criterion, LimitChoice, limits_at
from master.evaluation.filters import ForceFilter
from master.evaluation.line_geometry import Uplift
from master.results.run_results import Results

#: Reads a figure of an assessment, None if there is none.
_Get = Callable[[Assessment], float | None]


def _of(get: Callable[[Quality], float | None], scale: float = 1.0) -> _Get:
    return lambda a: _scaled(get(a.quality), scale)


def _scaled(value: float | None, scale: float) -> float | None:
    return None if value is None else scale * value


#: Rows of the table of figures: title, unit, how to read it, decimals.
_FIGURES: Final[tuple[tuple[str, str, _Get, int], ...]] = (
    ("mean force", "N", _of(lambda q: q.mean), 1),
    ("standard deviation", "N", _of(lambda q: q.sigma), 1),
    ("maximum", "N", _of(lambda q: q.maximum), 1),
    ("minimum", "N", _of(lambda q: q.minimum), 1),
    ("amplitude", "N", _of(lambda q: q.amplitude), 1),
    ("statistical maximum", "N", _of(lambda q: q.statistical_maximum), 1),
    ("statistical minimum", "N", _of(lambda q: q.statistical_minimum), 1),
    ("sigma 0-2 Hz", "N", _of(lambda q: q.sigma_bands["0-2"]), 1),
    ("sigma 0-5 Hz", "N", _of(lambda q: q.sigma_bands["0-5"]), 1),
    ("sigma 5-20 Hz", "N", _of(lambda q: q.sigma_bands["5-20"]), 1),
    ("contact losses", "", _of(lambda q: q.losses.count), 0),
    ("longest loss", "ms", _of(lambda q: 1e3 * q.losses.longest), 1),
    ("share of loss", "%", _of(lambda q: q.losses.percentage), 2),
    ("contact height range", "mm", _of(lambda q: q.contact_height_range, 1e3), 1),
    ("contact on strip, minimum", "mm", _of(lambda q: q.lateral_minimum, 1e3), 0),
    ("contact on strip, maximum", "mm", _of(lambda q: q.lateral_maximum, 1e3), 0),
    ("uplift at supports, largest", "mm", lambda a: None if a.uplift is None else 1e3 * a.uplift.maximum, 1),
    ("slack droppers at passage", "%", lambda a: _scaled(a.slack, 1e2), 0),
)


@dataclass(frozen=True)
class Headline:
    """One of the figures that are seen first.

    Attributes
    ----------
    name, value, unit, limit : str
        As shown.
    passed : bool, optional
        Whether the limit is met, None where there is none.
    is_at_limit : bool
        Whether it is met only because the figure is at the limit.
    """

    name: str
    value: str
    unit: str
    limit: str
    passed: bool | None = None
    is_at_limit: bool = False


def figure_values(assessment: Assessment) -> dict[str, float]:
    """Return the figures of a contact by title with unit; NaN where there is none."""
    found = ((_titled(title, unit), get(assessment)) for title, unit, get, _ in _FIGURES)
    return {title: math.nan if value is None else float(value) for title, value in found}


def _titled(title: str, unit: str) -> str:
    return f"{title} [{unit}]" if unit else title


def figure_rows(assessments: Sequence[Assessment]) -> list[tuple[str, ...]]:
    """Return the rows of the table of figures: title with unit, then one value per contact."""
    rows = []
    for title, unit, get, decimals in _FIGURES:
        values = [get(a) for a in assessments]
        shown = ["-" if v is None else f"{v:.{decimals}f}" for v in values]
        rows.append((_titled(title, unit), *shown))
    return rows


def filter_rows(quality: Quality, chosen: ForceFilter) -> list[tuple[str, ...]]:
    """Return sigma, maximum and minimum [N] with every filter if an extreme depends on the filter, else no rows."""
    if not quality.filter_dependent:
        return []
    own = Filtered(chosen.short, quality.mean, quality.sigma, quality.minimum, quality.maximum)
    return [
        (f.filter, f"{f.sigma:.1f}", f"{f.maximum:.1f}", f"{f.minimum:.1f}") for f in (own, *quality.filter_dependent)
    ]


FILTER_HEADS: Final = ("filter", "sigma [N]", "maximum [N]", "minimum [N]")


def headlines(assessment: Assessment, limits: LimitChoice) -> tuple[Headline, ...]:
    """Return what a reader of EN 50367 looks for first: Fm, sigma, Fmax, Fmin, uplift and loss."""
    q = assessment.quality
    at, kept = limits_at(abs(q.speed), limits), {c.name: c for c in assessment.criteria}
    share = at.sigma_share.value
    found = [
        _headline("Fm", f"{q.mean:.1f}", "N", kept.get("mean force")),
        Headline(
            "\u03c3", f"{q.sigma:.1f}", "N", f"< {share * q.mean:.1f} ({share:g} Fm)", _kept(kept.get("sigma / mean"))
        ),
        _headline("Fmax", f"{q.maximum:.1f}", "N", kept.get("maximum force")),
        Headline("Fmin", f"{q.minimum:.1f}", "N", f"Fm - 3\u03c3 = {q.statistical_minimum:.1f}"),
    ]
    if assessment.uplift is not None:
        value = f"{1e3 * assessment.uplift.maximum:.1f}"
        found.append(_headline("uplift", value, "mm", kept.get("uplift at supports")))
    nq = kept.get("NQ (estimate)")
    limit = "" if nq is None else f"NQ {nq.limit}"
    found.append(Headline("loss", f"{q.losses.percentage:.2f}", "%", limit, _kept(nq)))
    return tuple(found)


def _kept(criterion: Criterion | None) -> bool | None:
    """Return whether a limit is met, None where there is no verdict."""
    return None if criterion is None else criterion.passed


def _headline(name: str, value: str, unit: str, criterion: Criterion | None) -> Headline:
    """Return a figure with its limit, if it is judged."""
    limit = "" if criterion is None else criterion.limit.removesuffix(f" {unit}")
    return Headline(name, value, unit, limit, _kept(criterion), criterion is not None and criterion.is_at_limit)


def verdict_table(assessment: Assessment, limits: LimitChoice) -> Table:
    """Return the table of a contact's criteria, with the origin of each limit."""
    q = assessment.quality
    where = f"{q.start:.0f}-{q.end:.0f} m, {3.6 * q.speed:.0f} km/h"
    table = Table(title=escape(f"{limits.title}, {assessment.contact.pantograph}, {where}"), title_justify="left")
    table.width, table.pad_edge = 78, False  # wide enough for the longest verdict and limit
    for head in ("figure", "value", "limit", "origin", "verdict"):
        table.add_column(head, justify="left" if head in ("figure", "origin") else "right", no_wrap=True)
    for c in assessment.criteria:
        table.add_row(c.name, c.value, c.limit, c.origin, f"[{_COLOURS[c.word]}]{c.word}[/]")
    remarks = [f"{c.name}: {c.remark}" for c in assessment.criteria if c.remark]
    table.caption, table.caption_justify = escape("\n".join([*remarks, ORIGINS])), "left"
    return table


_COLOURS: Final = {"passed": "green", "at the limit": "yellow", "failed": "red"}


def figures_table(assessments: Sequence[Assessment], heads: Sequence[str], filters: Sequence[ForceFilter]) -> Table:
    """Return the table of figures of several contacts or runs side by side."""
    filtered = "; ".join(dict.fromkeys(f"{f.band}, {f.short}" for f in filters))
    table = Table(title=escape(f"Figures ({filtered})"), title_justify="left", width=78)
    table.add_column("figure", no_wrap=True)
    for head in heads:
        table.add_column(escape(head), justify="right", overflow="fold")
    for row in figure_rows(assessments):
        table.add_row(*map(escape, row))
    return table


def plain_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """Return a table in which all columns but the first hold numbers."""
    table = Table(width=78)
    for i, head in enumerate(heads):
        table.add_column(escape(head), justify="right" if i else "left", overflow="fold")
    for row in rows:
        table.add_row(*map(escape, row))
    return table


def ruled_table(title: str, caption: str = "", width: int = 80) -> Table:
    """Return an empty table without a frame, its head underlined, for a terminal of a given width."""
    table = Table(title=escape(title) or None, caption=escape(caption) or None, box=SIMPLE_HEAD, width=width - 1)
    table.title_justify = table.caption_justify = "left"
    table.pad_edge = False
    return table


def uplift_line(done: Results) -> str:
    """Return a line on the largest uplift of the whole run, raising included; empty if uplift is not recorded."""
    uplifts = done.uplifts
    return f"whole run: largest uplift {_place(max(uplifts, key=lambda u: u.maximum))}" if uplifts else ""


def _place(most: Uplift) -> str:
    where = f"x = {most.x:.1f} m" if most.x is not None else f"support {most.support}"
    return f"{1e3 * most.maximum:.1f} mm at {where} (t = {most.time:.2f} s)"


def calibration_line(done: Results) -> str:
    """Return how far the mean force is off the target of the calibration; empty if there is no target."""
    wanted = done.summary.get("settings", {}).get("calibration")
    found = [a for a in done.assessments() if wanted and a.quality.contact == wanted.get("contact", 1)]
    if not found:
        return ""
    target = wanted["mean_force"]
    off = round(found[0].quality.mean - target, 1) + 0.0  # no negative zero
    return f"target of the calibration (no limit): mean force {target:g} N; it is {off:+.1f} N off"
