"""The verb ``verify``."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from functools import partial

from master.batch.verification.case import find_cases, load_cases
from master.batch.verification.case_runs import RUNS, Runs
from master.batch.verification.verification_outcome import CaseOutcome
from master.batch.verification.verification_session import JSON, PAGE, verify
from master.batch.verification.verification_table import list_table, show_case
from master.commands.command_options import batch_runner
from master.report.terminal_summary import WIDTH, Terminal, printable_json


def verify_verb(options: argparse.Namespace) -> int:
    """Verify; return 0 if every row that must hold does, 1 if not."""
    cases = load_cases(find_cases(options.cases))
    if options.list:
        Terminal(width=_width()).print(list_table(cases))
        return 0
    is_shown = not (options.quiet or options.json)
    out = Terminal(width=_width(), highlight=False)
    runs = Runs(options.out / RUNS, batch_runner(options))
    show = partial(show_case, out) if is_shown else lambda _: None
    done = verify(cases, options.out, runs, show)
    if options.json:
        print(printable_json((options.out / JSON).read_text(encoding="utf-8")), end="")
    elif is_shown:
        out.print(done.sentence, style="green" if done.passed else "bold red", markup=False, soft_wrap=True)
        for line in _failing(done.cases):
            out.print(line, markup=False, soft_wrap=True)
        out.print(f"page: {options.out / PAGE}", markup=False, soft_wrap=True)
    return 0 if done.passed else 1


def _width() -> int | None:
    """Return 80 where nobody looks on, else the width of the terminal."""
    return None if Terminal().is_terminal else WIDTH


def _failing(cases: Sequence[CaseOutcome]) -> Iterator[str]:
    for outcome in cases:
        for row in outcome.failing:
            yield f"FAILED: {outcome.case.name}, {row.title}: {row.shown}, wanted {row.reference}"
