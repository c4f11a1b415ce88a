"""The verbs ``report`` and ``compare`` of the command line."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from master.errors import MasterError, UsageError
from master.evaluation.measured_force import MeasuredComparison, compare_measured, read_measured
from master.report import report_files, result_tables
from master.report.charts.measured_charts import comparison_rows
from master.report.comparison_page import MOST_INPUTS, columns, comparison_page, run_names
from master.report.film_file import FilmOptions, check_name, write_film
from master.report.moving_picture import MOST_LAPS, make_movie
from master.report.run_inputs import unequal_inputs
from master.report.terminal_summary import WIDTH, Terminal
from master.results import parquet_export, results_folder, run_difference, run_results, run_summary
from master.results.run_results import Results
from master.safety import folder_lock
from master.safety.safe_files import write_atomically


def report_verb(options: argparse.Namespace) -> int:
    """Write the report of a run again, and what else is asked for."""
    if options.measured_offset is not None and not options.measured:
        raise UsageError("--measured-offset moves a measurement: give that as well, with --measured FILE")
    if options.film:
        check_name(options.film)
    if results_folder.made_by(options.run / "sweep.json", "openpanto sweep"):
        return _report_sweep(options)
    results_folder.identity(options.run)  # a folder that is not ours is left alone
    with _claimed(options.run):
        done = run_results.read(options.run)
        summary = {**done.summary, **run_summary.figures(done), "format": results_folder.FORMAT}
        summary["settings"] = {**summary.get("settings", {}), "filter": run_summary.filter_data(done.evaluation.filter)}
        done = replace(done, summary=summary)
        measured = _measured(done, options) if options.measured else None
        results_folder.write_forces(done.folder, done.signals)
        results_folder.write_json(done.folder / results_folder.SUMMARY, summary)
        print(report_files.write(done, measured, options.figures))
        if options.parquet:
            print(*parquet_export.write_parquet(done.folder), sep="\n")
    _warn_of_open_runs([done])
    if options.film:
        print(_film(done, options))
    if measured is not None:
        _say_measured(measured)
    return 0


def _report_sweep(options: argparse.Namespace) -> int:
    """Write the page and the charts of a sweep again."""
    from master.batch.sweep import sweep_session  # takes longer than all that the report of a run needs

    if options.measured or options.film or options.parquet:
        text = "--measured, --film and --parquet are of a single run"
        raise UsageError(f"{options.run} holds a sweep; {text}")
    with _claimed(options.run):
        print(*sweep_session.write_report(options.run, options.figures), sep="\n")
    return 0


@contextmanager
def _claimed(folder: Path) -> Iterator[None]:
    """Keep others out of a results folder while its report is written."""
    with ExitStack() as claim:
        try:
            claim.enter_context(folder_lock.claimed(folder, "wait for it to end"))
        except PermissionError as error:  # before figures are made for nothing
            text = "its permissions do not allow it: change them, or copy the folder and report on the copy"
            raise MasterError(f"{folder} cannot be written into: {text}") from error
        yield


def _warn_of_open_runs(runs: Sequence[Results]) -> None:
    """Warn of runs that are not complete: they show only a part."""
    for done in runs:
        status = done.summary.get("status") or "complete"
        if status != "complete":
            how = "ended before it was finished" if status == "running" else f"is {status}"
            text = f"warning: the run in {done.folder} {how}; its figures are of what it left"
            Terminal(stderr=True).print(text, style="dim", markup=False, highlight=False, soft_wrap=True)


def report_what_there_is(folder: Path) -> None:
    """Write the report of a run that stopped, if it has left anything to report on."""
    try:
        done = run_results.read(folder)
        results_folder.write_forces(done.folder, done.signals)
        report_files.write(done)
    except MasterError:
        return  # it stopped before anything was recorded; the caller reports the error itself


def _measured(done: Results, options: argparse.Namespace) -> MeasuredComparison:
    signals = [s for s in done.signals if s.contact.index == options.contact]
    if not signals:
        raise MasterError(
            f"{done.folder} has no contact {options.contact} with a recorded force; choose another with --contact"
        )
    return compare_measured(signals[0], read_measured(options.measured), options.measured_offset)


def _say_measured(measured: MeasuredComparison) -> None:
    rows = result_tables.plain_table(("low-passed", "simulated", "measured", "difference"), comparison_rows(measured))
    console = Terminal(width=WIDTH, highlight=False)
    console.print(rows)
    console.print(f"compared from {measured.start:.1f} m to {measured.end:.1f} m", markup=False)
    for warning in measured.warnings:
        console.print(f"warning: {warning}", markup=False, soft_wrap=True)


def _film(done: Results, options: argparse.Namespace) -> Path:
    movie = make_movie(done, done.signals)
    if movie is None:
        needed = "a film needs recorded uplift, contact point and geometry"
        raise MasterError(f"{done.folder} cannot be drawn: {needed}, and at most {MOST_LAPS} laps of a line")
    start, end = done.interval
    return write_film(movie, options.film, FilmOptions(options.magnify, start=start, end=end))


def compare_verb(options: argparse.Namespace) -> int:
    """Compare runs with the first one."""
    runs = [run_results.read(folder) for folder in (options.first, *options.others)]
    _warn_of_open_runs(runs)
    if options.report:
        write_atomically(options.report, comparison_page(runs).encode(), "another file with --report")
    pairs = [run_difference.compare(runs[0], other) for other in runs[1:]]
    if options.json:
        others = [(other, c) for other, found in zip(runs[1:], pairs, strict=True) for c in found]
        print(json.dumps([_as_json(c, runs[0], other) for other, c in others], indent=1))
        return 0
    _show(runs, pairs, options)
    return 0


def _show(
    runs: Sequence[Results], pairs: Sequence[Sequence[run_difference.RunDifference]], options: argparse.Namespace
) -> None:
    console = Terminal(width=WIDTH, highlight=False)
    found = columns(runs)
    heads = [c.name for c in found]
    _show_inputs(console, runs)
    console.print(
        result_tables.figures_table([c.assessment for c in found], heads, [r.evaluation.filter for r in runs])
    )
    warnings = [f"{c.name}: {warning}" for c in found for warning in c.assessment.warnings]
    for note in (*run_difference.setting_notes(runs), *warnings):
        console.print(f"warning: {note}", markup=False)
    for folder, differences in zip(options.others, pairs, strict=True):
        for c in differences:
            console.print(f"{folder}, {c.first.contact.pantograph}: {c.sentence}", markup=False, soft_wrap=True)
    if options.report:
        console.print(f"report in {options.report}", markup=False, soft_wrap=True)


def _show_inputs(console: Terminal, runs: Sequence[Results]) -> None:
    """Print what differs in the inputs of runs."""
    rows = unequal_inputs(runs)
    if not rows:
        console.print("the inputs are the same")
        return
    heads = ["input that differs", *run_names([run.folder for run in runs])]
    console.print(result_tables.plain_table(heads, rows[:MOST_INPUTS]))
    if len(rows) > MOST_INPUTS:
        console.print(f"and {len(rows) - MOST_INPUTS} more inputs; --report FILE lists them all", markup=False)


def _as_json(c: run_difference.RunDifference, first: Results, other: Results) -> Mapping[str, Any]:
    names = ("mean", "sigma", "minimum", "maximum")
    one, two = c.first.quality, c.second.quality
    difference = {n: getattr(two, n) - getattr(one, n) for n in names}
    filters = [run.evaluation.filter.short for run in (first, other)]
    same = len(set(filters)) == 1
    notes = list(run_difference.setting_notes([first, other]))
    forces = {"rms": c.rms, "largest": c.largest, "apart": c.apart}
    known = {"notes": notes, "contact": one.contact, "difference": difference, **forces}
    inputs = {name: values for name, *values in unequal_inputs([first, other])}
    return {**known, "filters": filters, "same_filter": same, "inputs": inputs}
