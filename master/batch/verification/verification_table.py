"""The tables of a verification for the terminal."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from master.batch.verification.case import Case
from master.batch.verification.judgement import Judged, Verdict
from master.batch.verification.verification_outcome import CaseOutcome, count_verdicts
from master.report.result_tables import ruled_table

_STYLES: Final[dict[Verdict, str]] = {
    "passed": "green",
    "near": "yellow",
    "failed": "bold red",
    "agrees": "dim",
    "departs": "dim yellow",
}
_HEADS: Final = ("quantity", "computed", "reference", "source", "verdict")
_NUMBERS: Final = ("computed", "verdict")


def show_case(console: Console, outcome: CaseOutcome) -> None:
    """Print a case: its rows, its filters, and why runs failed."""
    console.print(case_table(outcome, console.width))
    for line in filter_lines(outcome):
        console.print(line, style="dim", markup=False)
    for name, text in outcome.failures.items():
        console.print(f"run '{name}' failed: {text}", style="red", markup=False, soft_wrap=True)
    console.print()


def case_table(outcome: CaseOutcome, width: int) -> Table:
    """Return the rows of a case as a table."""
    title = f"{outcome.case.name}: {outcome.case.title}"
    table = ruled_table(title, count_verdicts((outcome,)), min(width, 120))
    for head in _HEADS:
        table.add_column(head, no_wrap=head in _NUMBERS, justify="right" if head == "computed" else "left")
    several = len(outcome.case.runs) > 1
    for judged in outcome.rows:
        table.add_row(*_cells(judged, several))
    return table


def filter_lines(outcome: CaseOutcome) -> list[str]:
    """Return the filters that low-passed the forces of a case's runs, if they have any."""
    filters = {name: run.evaluation.filter.sentence for name, run in outcome.runs.items() if run.signals}
    sentences = dict.fromkeys(filters.values())
    if len(sentences) == 1:
        return [f"filter: {next(iter(sentences))}"]
    return [f"filter of {name}: {sentence}" for name, sentence in filters.items()]


def _cells(judged: Judged, several: bool) -> tuple[str, ...]:
    where = f" ({judged.row.run})" if several and not judged.row.title else ""
    remark = f"\n[dim]{escape(judged.remark)}[/]" if judged.remark else ""
    kind = "" if judged.row.kind == "must hold" else f"\n[dim]{judged.row.kind}[/]"
    return (
        escape(f"{judged.title}{where}") + remark,
        escape(judged.shown),
        escape(judged.reference.replace(" %", "\N{NO-BREAK SPACE}%")),
        escape(judged.row.source) + kind,
        f"[{_STYLES[judged.verdict]}]{verdict_text(judged)}[/]",
    )


def verdict_text(judged: Judged) -> str:
    """Return the verdict with the deviation of the figure."""
    word = judged.verdict.upper() if judged.fails else judged.verdict
    return f"{word} {percent(judged.deviation)}".rstrip()


def percent(value: float | None) -> str:
    """Return a deviation as text, empty where there is none.

    Examples
    --------
    >>> percent(-0.01)
    '+0.0 %'
    """
    return "" if value is None else f"{round(value, 1) + 0.0:+.1f} %"


def list_table(cases: Iterable[Case]) -> Table:
    """Return the cases with the scenarios that they run."""
    table = Table(title="Cases", title_justify="left")
    for head in ("case", "subject", "rows", "scenarios"):
        table.add_column(head, overflow="fold", justify="right" if head == "rows" else "left")
    for case in cases:
        scenarios = "\n".join(dict.fromkeys(run.scenario for run in case.runs.values()))
        table.add_row(case.name, escape(case.title), str(len(case.rows)), escape(scenarios))
    return table
