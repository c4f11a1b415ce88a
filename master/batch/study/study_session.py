"""A study: its variants are run one after the other, and its files written after each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from master.batch.batch_session import BatchFiles, Runner, run_tasks
from master.batch.study.family import VARIANTS, Family, Variant, folder_name
from master.batch.study.study_outcome import StudyOutcome, VariantResult, as_csv, as_data
from master.batch.study.study_page import page
from master.batch.study.variants import finished, opened_variant
from master.errors import InterruptedRunError, MasterError, Problem, RequestError, ScenarioError
from master.results import results_folder
from master.results.run_results import Results

JSON: Final = "study.json"
CSV: Final = "study.csv"
PAGE: Final = "study.html"
FILES: Final = BatchFiles("study", "openpanto study", JSON, as_data, {CSV: as_csv, PAGE: page})


def study(
    family: Family,
    chosen: Sequence[Variant],
    folder: Path,
    runner: Runner,
    again: bool = False,
    show: Callable[[VariantResult], None] = lambda _: None,
) -> StudyOutcome:
    """Run the variants of a study; page, table and JSON file are written after each.

    A variant that an earlier study in the same folder finished, with the same FMUs and values, is not run again;
    those that were not chosen are reported if their results are there.

    Parameters
    ----------
    family : Family
    chosen : sequence of Variant
        The variants to run.
    folder : Path
        Created, or taken over from an earlier study.
    runner : Runner
        Makes the runs.
    again : bool
        Whether finished variants are run again.
    show : callable
        Called with each variant that was run.

    Raises
    ------
    InterruptedRunError, KeyboardInterrupt
        If the user stops it; the page then has the finished variants.
    ScenarioError
        If a variant cannot be run as it is written; nothing is run then.
    MasterError
        If the folder holds something else.
    """
    results_folder.check_free(folder, JSON, FILES.generator, FILES.kind)  # before the FMUs are built
    check(family, chosen, runner)

    def finish(state: StudyOutcome, variant: Variant) -> StudyOutcome:
        is_chosen, place = variant in chosen, folder / folder_name(variant.name)
        if not is_chosen and not results_folder.is_ours(place):
            return state
        try:
            found = _results(state.family, variant, runner, place, (is_chosen, not (again and is_chosen)))
        except InterruptedRunError:
            raise
        except MasterError as error:
            return replace(state, failures={**state.failures, variant.name: str(error)})
        if found is None:
            return state
        done = VariantResult(variant.name, found)
        if is_chosen:
            show(done)
        return replace(state, done=(*state.done, done))

    return run_tasks(StudyOutcome(family), family.variants, finish, FILES, folder)


def _results(family: Family, variant: Variant, runner: Runner, folder: Path, may: tuple[bool, bool]) -> Results | None:
    """Return the results of an earlier run of a variant if it may be reused, else of a new one if it may be run."""
    may_run, may_reuse = may
    with opened_variant(family, variant, runner) as system:
        found = finished(folder, system) if may_reuse else None
        if found is None and may_run:
            runner.tell(f"{system.name}, {system.start:g} s to {system.stop:g} s")
            found = runner.run(system, folder)
    return found


def check(family: Family, chosen: Sequence[Variant], runner: Runner) -> None:
    """Open and close every variant that is to be run; raise `ScenarioError` with all mistakes."""
    problems: list[Problem] = []
    for variant in chosen:
        try:
            with opened_variant(family, variant, runner):
                pass
        except ScenarioError as error:
            found = (Problem(VARIANTS, 0, p.rule, f"variant '{variant.name}': {p}") for p in error.problems)
            problems += found
        except RequestError as error:
            problems.append(Problem(VARIANTS, 0, "variants", f"variant '{variant.name}': {error}"))
    if problems:
        raise ScenarioError(problems)
