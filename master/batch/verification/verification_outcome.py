"""The results of a verification: judged rows by case, and the runs behind them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from master.batch.batch_session import BatchState
from master.batch.verification.case import Case
from master.batch.verification.case_runs import Runs
from master.batch.verification.judgement import Judged, Verdict, judge_row
from master.errors import InterruptedRunError, MasterError
from master.results.run_results import Results

#: Version of ``verify.json``; a file without one is of version 1.
FORMAT: Final = 3
#: Verdicts in the order in which they are counted, with the words for several rows.
WORDS: Final[Mapping[Verdict, str]] = {
    "passed": "passed",
    "near": "near",
    "failed": "FAILED",
    "agrees": "reported: agree",
    "departs": "reported: depart",
}


@dataclass(frozen=True)
class CaseOutcome:
    """A case with its judged rows.

    Attributes
    ----------
    case : Case
    rows : tuple of Judged
        In the order of the case file.
    runs : dict
        Results by the names that the case gives its runs, without those that failed.
    failures : dict
        Reasons why runs failed, by name.
    """

    case: Case
    rows: tuple[Judged, ...]
    runs: Mapping[str, Results]
    failures: Mapping[str, str]

    @property
    def failing(self) -> tuple[Judged, ...]:
        """The rows that fail."""
        return tuple(r for r in self.rows if r.fails)

    @property
    def passed(self) -> bool:
        """Whether no row fails and every run was made."""
        return not self.failing and not self.failures


@dataclass(frozen=True)
class Verification(BatchState):
    """The state of a verification.

    Attributes
    ----------
    wanted : int
        Number of cases requested.
    cases : tuple of CaseOutcome
        The finished ones.
    """

    wanted: int
    cases: tuple[CaseOutcome, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether all cases are finished and pass."""
        return self.status == "complete" and all(c.passed for c in self.cases)

    @property
    def sentence(self) -> str:
        """The state in one line."""
        counted = count_verdicts(self.cases)
        unfinished = "" if self.status == "complete" else f"{self.status}: {len(self.cases)} of {self.wanted} cases; "
        failed = sum(len(c.failures) for c in self.cases)
        return f"{unfinished}{counted}{f'; {failed} runs failed' if failed else ''}"

    def with_case(self, outcome: CaseOutcome) -> Verification:
        """Return the verification with one more case."""
        return replace(self, cases=(*self.cases, outcome))


def judge_case(case: Case, runs: Runs) -> CaseOutcome:
    """Make the runs of a case and judge its rows.

    Raises
    ------
    InterruptedRunError
        If the user stops it.
    """
    made: dict[str, Results] = {}
    failures: dict[str, str] = {}
    for name in case.runs:
        try:
            made[name] = runs.get(case, name)
        except InterruptedRunError:
            raise
        except MasterError as error:
            failures[name] = str(error)

    def results_of(name: str) -> Results:
        if name in failures:
            raise MasterError(f"run '{name}' failed")
        return made[name]

    rows = tuple(judge_row(row, results_of) for row in case.rows)
    return CaseOutcome(case, rows, made, failures)


def count_verdicts(cases: tuple[CaseOutcome, ...]) -> str:
    """Return in words how many rows have which verdict."""
    counts = Counter(row.verdict for c in cases for row in c.rows)
    total = sum(counts.values())
    shown = [f"{counts[v]} {words}" for v, words in WORDS.items() if counts[v]]
    return f"{total} rows: {', '.join(shown)}" if total else "no rows"


def as_data(verification: Verification) -> dict[str, Any]:
    """Return the contents of ``verify.json``."""
    return {
        "format": FORMAT,
        "date": verification.date,
        "versions": dict(verification.versions),
        "status": verification.status,
        "passed": verification.passed,
        "summary": verification.sentence,
        "cases": [_case_data(c) for c in verification.cases],
    }


def _case_data(outcome: CaseOutcome) -> dict[str, Any]:
    case = outcome.case
    return {
        "name": case.name,
        "title": case.title,
        "citation": case.citation,
        "passed": outcome.passed,
        "failures": dict(outcome.failures),
        "runs": {name: _run_data(results) for name, results in outcome.runs.items()},
        "rows": [_row_data(row) for row in outcome.rows],
    }


def _run_data(results: Results) -> dict[str, Any]:
    summary = results.summary
    return {
        "scenario": summary["scenario"],
        "folder": str(results.folder),
        "filter": results.evaluation.filter.sentence,
        "settings": summary["settings"],
        "components": summary["components"],
        "performance": summary["performance"],
    }


def _row_data(judged: Judged) -> dict[str, Any]:
    measured = judged.measured
    return {
        "quantity": judged.row.quantity,
        "title": judged.title,
        "run": judged.row.run,
        "unit": judged.unit,
        "values": list(measured.values) if measured else [],
        "labels": list(measured.labels) if measured else [],
        "computed": judged.computed,
        "reference": judged.reference,
        "bounds": [asdict(b) for b in judged.bounds],
        "source": judged.row.source,
        "recalled": judged.row.recalled,
        "band": judged.row.band,
        "other_filters": dict(measured.others) if measured else {},
        "kind": judged.row.kind,
        "verdict": judged.verdict,
        "deviation_percent": judged.deviation,
        "remark": judged.remark,
    }
