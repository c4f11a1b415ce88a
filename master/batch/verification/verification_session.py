"""A verification: cases one after the other, and what is left of them on disk after each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from master.batch.verification.case import Case
from master.batch.verification.case_runs import Runs
from master.batch.verification.verification_outcome import GENERATOR, CaseOutcome, Verification, as_data, judge_case
from master.batch.verification.verification_page import page
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
        return _verify(cases, runs, show, folder)


def _verify(cases: Sequence[Case], runs: Runs, show: Callable[[CaseOutcome], None], folder: Path) -> Verification:
    state = Verification(datetime.now(UTC).isoformat(timespec="seconds"), run_summary.versions(), len(cases))
    write(state, folder)
    try:
        for case in cases:
            state = state.with_case(judge_case(case, runs))
            write(state, folder)
            show(state.cases[-1])
    except (InterruptedRunError, KeyboardInterrupt):
        write(replace(state, status="interrupted"), folder)
        raise
    state = replace(state, status="complete")
    write(state, folder)
    return state


def write(state: Verification, folder: Path) -> None:
    """Write what there is so far."""
    results_folder.write_json(folder / JSON, as_data(state))
    results_folder.write_text(folder / PAGE, page(state))
