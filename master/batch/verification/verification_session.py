"""A verification: its cases are judged one after the other, and its files written after each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from master.batch.batch_session import BatchFiles, run_tasks
from master.batch.verification.case import Case
from master.batch.verification.case_runs import Runs
from master.batch.verification.verification_outcome import CaseOutcome, Verification, as_data, judge_case
from master.batch.verification.verification_page import page

JSON: Final = "verify.json"
PAGE: Final = "verify.html"
FILES: Final = BatchFiles("verification", "openpanto verify", JSON, as_data, {PAGE: page})


def verify(
    cases: Sequence[Case],
    folder: Path,
    runs: Runs,
    show: Callable[[CaseOutcome], None] = lambda _: None,
) -> Verification:
    """Run and judge cases; page and JSON file are written after each.

    Parameters
    ----------
    cases : sequence of Case
        The cases, in this order.
    folder : Path
        Created, or taken over from an earlier verification.
    runs : Runs
        Makes the runs.
    show : callable
        Called with each finished case.

    Raises
    ------
    InterruptedRunError, KeyboardInterrupt
        If the user stops it; the page then has the finished cases.
    MasterError
        If the folder holds something else.
    """

    def finish(state: Verification, case: Case) -> Verification:
        judged = judge_case(case, runs)
        show(judged)
        return state.with_case(judged)

    return run_tasks(Verification(len(cases)), cases, finish, FILES, folder)
