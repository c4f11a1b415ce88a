"""Figures and verdicts as rows, and as tables for a terminal of 80 columns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from rich.markup import escape
from rich.table import Table

from master.quality import MAX_FORCE, Criterion, Quality, target_mean_force
from master.results import Assessment, Results

#: Rows of the figures' table: title, unit, how to get it, decimals.
_FIGURES: Final[tuple[tuple[str, str, Callable[[Quality], float | None], int], ...]] = (
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

#: Where each limit comes from. Clause numbers are given only where they were read.
CLAUSES: Final = {
    "mean force": "EN 50367, mean contact force, AC (cited by TSI ENE 4.2.11); the tolerance is this tool's",
    "sigma / mean": "EN 50367, standard deviation of the contact force; TSI ENE 4.2.12",
    "maximum force": "EN 50367, maximum contact force",
    "NQ (estimate)": "EN 50367 with EN 50317, percentage of arcing; TSI ENE 4.2.12; here from losses of 5 ms or more",
    "uplift at supports": "EN 50367 (edition of 2020: 5.2.6, contact wire uplift)",
    "contact height range": "EN 50367, vertical amplitude of the contact point",
}


@dataclass(frozen=True)
class Headline:
    """One figure of the first screen.

    Attributes
    ----------
    name, value, unit, limit : str
        As shown.
    passed : bool, optional
        Whether the limit is kept, None where there is none.
    """

    name: str
    value: str
    unit: str
    limit: str
    passed: bool | None = None


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


def headlines(assessment: Assessment) -> tuple[Headline, ...]:
    """Return what a reader of EN 50367 looks for first: Fm, sigma, Fmax, Fmin, uplift and loss."""
    q = assessment.quality
    kept = {c.name: c for c in assessment.criteria}
    found = [
        Headline("Fm", f"{q.mean:.1f}", "N", f"target {target_mean_force(q.speed):.1f}", _kept(kept, "mean force")),
        Headline("\u03c3", f"{q.sigma:.1f}", "N", f"< {0.3 * q.mean:.1f} (0.3 Fm)", _kept(kept, "sigma / mean")),
        Headline("Fmax", f"{q.maximum:.1f}", "N", f"< {MAX_FORCE:g}", _kept(kept, "maximum force")),
        Headline("Fmin", f"{q.minimum:.1f}", "N", f"Fm - 3\u03c3 = {q.statistical_minimum:.1f}"),
    ]
    if (uplift := kept.get("uplift at supports")) is not None:
        found.append(_of_criterion("uplift", uplift))
    lost = f"{q.losses.percentage:.2f}"
    found.append(Headline("loss", lost, "%", f"NQ {kept['NQ (estimate)'].limit}", _kept(kept, "NQ (estimate)")))
    return tuple(found)


def _kept(criteria: dict[str, Criterion], name: str) -> bool | None:
    return criteria[name].passed if name in criteria else None


def _of_criterion(name: str, criterion: Criterion) -> Headline:
    value, _, unit = criterion.value.partition(" ")
    return Headline(name, value, unit, criterion.limit.removesuffix(f" {unit}"), criterion.passed)


def verdict_table(assessment: Assessment) -> Table:
    """Return the verdict of one contact for a terminal of 80 columns."""
    q = assessment.quality
    title = f"EN 50367, {escape(assessment.contact.pantograph)}, {q.start:.0f}-{q.end:.0f} m, {3.6 * q.speed:.0f} km/h"
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
        table.add_column(escape(head), justify="right", overflow="fold")
    for row in figure_rows(qualities):
        table.add_row(*map(escape, row))
    return table


def plain_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """Return a table for a terminal of 80 columns; all columns but the first are numbers."""
    table = Table(width=78)
    for i, head in enumerate(heads):
        table.add_column(escape(head), justify="right" if i else "left")
    for row in rows:
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
