"""A verification: cases one after the other, and what is left of them on disk after each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from master.batch.verification import verification_page
from master.batch.verification.case import Case
from master.batch.verification.case_runs import Runs
from master.batch.verification.verification_outcome import GENERATOR, CaseOutcome, Verification, as_data, judge_case
from master.errors import InterruptedRunError
from master.results import results_folder, run_summary
from master.safety.supervision import unfinished

JSON: Final = "verify.json"
PAGE: Final = "verify.html"


def verify(
    cases: Sequence[Case],
    folder: Path,
    runs: Runs,
    show: Callable[[CaseOutcome], None] = lambda _: None,
) -> Verification:
    """Run and judge cases; page and JSON in ``folder`` are written anew after each.

    Parameters
    ----------
    cases : sequence of Case
        What is verified, in this order.
    folder : Path
        Made, or taken over if it is an earlier verification's.
    runs : Runs
        Makes the runs.
    show : callable
        Is given every finished case.

    Raises
    ------
    InterruptedRunError, KeyboardInterrupt
        If the user stops it; the finished cases are in the page then.
    MasterError
        If the folder holds something else.
    """
    with results_folder.taken_over(folder, JSON, GENERATOR, "verification"), unfinished(folder / JSON):
        return _verify(cases, runs, show, _Writer(folder))


def _verify(cases: Sequence[Case], runs: Runs, show: Callable[[CaseOutcome], None], writer: _Writer) -> Verification:
    state = Verification(datetime.now(UTC).isoformat(timespec="seconds"), run_summary.versions(), len(cases))
    writer.write(state)
    try:
        for case in cases:
            state = state.with_case(judge_case(case, runs))
            writer.write(state)
            show(state.cases[-1])
    except (InterruptedRunError, KeyboardInterrupt):
        writer.write(replace(state, status="interrupted"))
        raise
    state = replace(state, status="complete")
    writer.write(state)
    return state


class _Writer:
    """Writes page and JSON; each case's part of the page is made once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._sections: list[str] = []

    def write(self, state: Verification) -> None:
        self._sections += [verification_page.section(c) for c in state.cases[len(self._sections) :]]
        results_folder.write_json(self._folder / JSON, as_data(state))
        results_folder.write_text(self._folder / PAGE, verification_page.page(state, self._sections))
