"""A study: variants one after the other, and what is left of them on disk after each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from master.batch.study.family import VARIANTS, Family, Variant, folder_name
from master.batch.study.study_outcome import GENERATOR, Done, Outcome, as_csv, as_data
from master.batch.study.study_page import page
from master.batch.study.variants import Runner, finished
from master.errors import InterruptedRunError, MasterError, Problem, RequestError, ScenarioError
from master.results import results_folder, run_summary
from master.safety.supervision import unfinished

JSON: Final = "study.json"
CSV: Final = "study.csv"
PAGE: Final = "study.html"


def study(
    family: Family,
    chosen: Sequence[Variant],
    folder: Path,
    runner: Runner,
    again: bool = False,
    show: Callable[[Done], None] = lambda _: None,
) -> Outcome:
    """Run variants; page, table and JSON in ``folder`` are written anew after each.

    A variant that an earlier study in the same folder has finished, with the same FMUs and values, is not run again;
    those that were not chosen are reported if they are there.

    Parameters
    ----------
    family : Family
    chosen : sequence of Variant
        What is run.
    folder : Path
        Made, or taken over if it is an earlier study's.
    runner : Runner
        Makes the runs.
    again : bool
        Whether finished variants are run again.
    show : callable
        Is given every variant that has been run.

    Raises
    ------
    InterruptedRunError, KeyboardInterrupt
        If the user stops it; the finished variants are in the page then.
    ScenarioError
        If a variant cannot be run as it is written; nothing was run then.
    MasterError
        If the folder holds something else.
    """
    check(family, chosen, runner)
    with results_folder.taken_over(folder, JSON, GENERATOR, "study"), unfinished(folder / JSON):
        return _study(family, chosen, folder, runner, again, show)


def _study(
    family: Family, chosen: Sequence[Variant], folder: Path, runner: Runner, again: bool, show: Callable[[Done], None]
) -> Outcome:
    state = Outcome(family, datetime.now(UTC).isoformat(timespec="seconds"), run_summary.versions())
    write(state, folder)
    try:
        for variant in family.variants:
            place = folder / folder_name(variant.name)
            wanted = variant in chosen
            state = _with_variant(state, variant, runner, _Task(place, wanted, not (again and wanted), show))
            write(state, folder)
    except (InterruptedRunError, KeyboardInterrupt):
        write(replace(state, status="interrupted"), folder)
        raise
    state = replace(state, status="complete")
    write(state, folder)
    return state


def check(family: Family, chosen: Sequence[Variant], runner: Runner) -> None:
    """Open every variant that is to be run, and close it again; raises `ScenarioError` with all that is wrong."""
    problems: list[Problem] = []
    for variant in chosen:
        try:
            with runner.opened(family, variant):
                pass
        except ScenarioError as error:
            found = (Problem(VARIANTS, 0, p.rule, f"variant '{variant.name}': {p}") for p in error.problems)
            problems += found
        except RequestError as error:
            problems.append(Problem(VARIANTS, 0, "variants", f"variant '{variant.name}': {error}"))
    if problems:
        raise ScenarioError(problems)


def write(state: Outcome, folder: Path) -> None:
    """Write what there is so far."""
    results_folder.write_json(folder / JSON, as_data(state))
    results_folder.write_text(folder / CSV, as_csv(state))
    results_folder.write_text(folder / PAGE, page(state))


@dataclass(frozen=True)
class _Task:
    """What is to become of a variant: where it lies, whether it is run, whether an earlier run counts."""

    folder: Path
    wanted: bool
    reuse: bool
    show: Callable[[Done], None]


def _with_variant(state: Outcome, variant: Variant, runner: Runner, task: _Task) -> Outcome:
    if not task.wanted and not results_folder.is_ours(task.folder):
        return state
    try:
        with runner.opened(state.family, variant) as system:
            found = finished(task.folder, system) if task.reuse else None
            if found is None and task.wanted:
                runner.tell(f"{system.name}, {system.start:g} s to {system.stop:g} s")
                found = runner.run(system, task.folder)
    except InterruptedRunError:
        raise
    except MasterError as error:
        return replace(state, failures={**state.failures, variant.name: str(error)})
    if found is None:
        return state
    done = Done(variant.name, found)
    if task.wanted:
        task.show(done)
    return replace(state, done=(*state.done, done))
