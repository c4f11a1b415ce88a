"""The tables of a study for a terminal 80 columns wide."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, Literal

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from master.batch.study.family import Family, Interval
from master.batch.study.study_evaluation import StudyEntry
from master.batch.study.study_outcome import StudyOutcome, differences, filter_remarks, filters, judged_by, shown
from master.report.result_tables import ruled_table

#: Heads of the columns that hold words.
_TEXTS: Final = ("variant", "compared with", "study", "variants", "title")
_SIGMA: Final = "\u03c3"
_FIGURE_HEADS: Final = (*("variant", "mean", _SIGMA, f"{_SIGMA}/Fm", "max", "min", "stat", "upl", "slack", "loss"),)


def show(console: Console, outcome: StudyOutcome) -> None:
    """Print a study: figures and differences for each interval, changes of wire, and what failed."""
    for interval in outcome.family.settings.interval:
        found = outcome.entries(interval)
        if found:
            console.print(figures_table(interval, found, outcome))
        if beside := differences(found):
            console.print(differences_table(beside))
    if sharing := [e for e in outcome.all_entries if e.sharing]:
        console.print(sharing_table(sharing))
    for remark in filter_remarks(outcome.all_entries):
        console.print(remark, markup=False, soft_wrap=True)
    for sentence in filters(outcome):
        console.print(f"filter: {sentence}", markup=False, soft_wrap=True)
    for name, text in outcome.failures.items():
        console.print(f"variant '{name}' failed: {text}", style="red", markup=False, soft_wrap=True)


def figures_table(interval: Interval, found: Sequence[StudyEntry], outcome: StudyOutcome) -> Table:
    """Return the statistics of all pantographs; rows are yellow where a limit is not met."""
    where = f"{interval.name}, {interval.start:g}-{interval.end:g} m"
    title = f"{where}: low-passed force [N], uplift [mm], slack droppers and loss [%]"
    table = _table(title, _FIGURE_HEADS, _failing(found, judged_by(outcome.done)))
    for e in found:
        q = e.assessment.quality
        numbers = (q.mean, q.sigma, q.sigma_share, q.maximum, q.minimum, q.statistical_minimum)
        texts = [shown(v, d) for v, d in zip(numbers, (1, 1, 3, 0, 0, 0), strict=True)]
        uplift = shown(None if e.uplift is None else 1e3 * e.uplift, 0)
        slack = shown(None if e.slack is None else 1e2 * e.slack, 0)
        style = "" if e.assessment.passed else "yellow"
        table.add_row(escape(e.name), *texts, uplift, slack, shown(q.losses.percentage, 1), style=style)
    return table


def _failing(found: Sequence[StudyEntry], title: str) -> str:
    """Return which limits are not met, and by which pantographs."""
    failing: dict[str, list[str]] = {}
    for e in found:
        for criterion in e.assessment.criteria:
            if not criterion.passed:
                failing.setdefault(criterion.name, []).append(e.name)
    withheld = [f"{e.name}: {e.assessment.withheld}" for e in found if e.assessment.withheld]
    not_judged = "".join(f"\nnot judged: {text}" for text in withheld)
    if not failing:
        others = "all others pass" if withheld else "all pass"
        return f"{title}: {others if len(withheld) < len(found) else 'none is judged'}{not_judged}"
    words = (f"{what}: {'all' if len(who) == len(found) else '; '.join(who)}" for what, who in failing.items())
    return f"{title} is not met by\n" + "\n".join(words) + not_judged


def differences_table(rows: Iterable[tuple[str, str, str, tuple[float, float, float]]]) -> Table:
    """Return the differences between pantographs."""
    table = _table(
        "differences from the pantograph ahead and from the single one [N]",
        ("variant", "compared with", _SIGMA, "max", "min"),
    )
    for variant, pantograph, other, change in rows:
        table.add_row(escape(f"{variant}, {pantograph}"), escape(other), *(f"{d:+.1f}" for d in change))
    return table


def sharing_table(found: Sequence[StudyEntry]) -> Table:
    """Return the passages of the strips from wire to wire."""
    heads = ("variant", "from m", "to m", "s", "losses per wire", "least total N")
    table = _table("From wire to wire: both touched", heads)
    for e in found:
        if (s := e.sharing) is not None:
            numbers = (f"{s.start:.1f}", f"{s.end:.1f}", f"{s.duration:.3f}", " ".join(map(str, s.losses)))
            table.add_row(escape(e.name), *numbers, f"{s.least_force:.0f}")
    return table


def list_table(families: Sequence[Family]) -> Table:
    """Return the studies with their variants."""
    table = _table("", ("study", "variants", "title"))
    for family in families:
        names = "\n".join(v.name for v in family.variants)
        table.add_row(escape(family.name), escape(names), escape(family.settings.title))
    return table


def _table(title: str, heads: Sequence[str], caption: str = "") -> Table:
    table = ruled_table(title, caption)
    for head in heads:
        is_text = head in _TEXTS
        justify: Literal["left", "right"] = "left" if is_text else "right"
        table.add_column(head, justify=justify, no_wrap=not is_text, ratio=1 if head == "variant" else None)
    table.padding = (0, 0)
    return table
