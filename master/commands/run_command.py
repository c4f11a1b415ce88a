"""The verb ``run``."""

from __future__ import annotations

import argparse
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Final

from master.commands import report_commands
from master.commands.command_options import (
    overrides_of,
    say,
    say_warnings,
)
from master.coupling.fmu_warnings import FmuWarningObserver
from master.errors import RequestError, RunError, UsageError
from master.fmu.isolation.isolated_instance import INIT_TIMEOUT, Isolation
from master.interface.scenario_runs import keep_apart
from master.recording import checkpoint
from master.recording.continuation import Continuation
from master.report import report_files
from master.report.log_notes import show_log
from master.report.progress import ProgressObserver
from master.report.terminal_summary import Terminal, printable_json, show_run
from master.results import parquet_export, results_folder
from master.results.run_results import Results
from master.run_session import RunOptions, run
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides
from master.system.components import System
from master.system.step_rounding import adjustments

_DEFAULT: Final = RunOptions()


def _run_overrides(options: argparse.Namespace) -> Overrides:
    """Return the changes to a scenario: a run with --stop may end before it can be judged."""
    return replace(overrides_of(options), energy=options.energy, may_stop_early=options.stop is not None)


def run_verb(options: argparse.Namespace) -> int:
    """Run a scenario and show its results."""
    note = (lambda _: None) if options.quiet else say
    if options.figures and options.no_report:
        raise UsageError("--figures says how charts are written, which --no-report leaves out: omit one of them")
    run_options = _run_options(options)
    if options.out is not None:
        results_folder.check_writable(options.out)  # before FMUs are built
    with open_scenario(options.scenario, _run_overrides(options), note, not options.no_build) as scenario:
        folder = _folder(options, scenario.system)
        keep_apart(folder, scenario.package)
        say_warnings(scenario.system, note)
        with results_folder.claimed(folder):  # until the report is written too
            if options.out is None and (text := _replaced(folder, scenario.system)):
                note(f"note: {text}")
            try:
                done = run_shown(scenario.system, folder, options.quiet, run_options)
            except RunError:
                if not options.no_report:
                    _report_what_there_is(folder)
                raise
            _show_results(done, options)
    return 0


def _replaced(folder: Path, system: System) -> str:
    return results_folder.replaced_run(folder, {c.name: c.fmu.definition for c in system.components})


def _show_results(done: Results, options: argparse.Namespace) -> None:
    if not options.no_report:
        report_files.write(done, formats=options.figures)
    if options.parquet:
        parquet_export.write_parquet(done.folder)
    if options.json:
        print(printable_json((done.folder / results_folder.SUMMARY).read_text(encoding="utf-8")), end="")
    elif not options.quiet:
        show_run(done)


def _report_what_there_is(folder: Path) -> None:
    # The user has to know why the run stopped, not that there is no room for its report either.
    with suppress(OSError):
        report_commands.report_what_there_is(folder)


def _folder(options: argparse.Namespace, system: System) -> Path:
    """Return where the results go: a run to be finished stays in its folder."""
    out: Path = options.out or Path("results") / system.name
    if options.resume is None or not options.resume.is_dir():
        return out
    resumed: Path = options.resume
    if options.out is not None and out.resolve() != resumed.resolve():
        raise UsageError(
            f"--resume {resumed} finishes the run in that folder: omit --out, or give the file "
            f"{resumed / checkpoint.NAME} to begin a new run from it"
        )
    return resumed


def _run_options(options: argparse.Namespace) -> RunOptions:
    for option, value in (("--step-timeout", options.step_timeout), ("--init-timeout", options.init_timeout)):
        if value is not None and not options.isolate:
            raise UsageError(f"{option} needs --isolate: only a separate process can be ended if it does not return")
    limits = (options.step_timeout, options.real_time is not None, options.init_timeout or INIT_TIMEOUT)
    isolation = Isolation(*limits) if options.isolate else None
    every = options.checkpoint_every
    return RunOptions(options.checkpoint, every, _continuation(options), isolation, options.real_time)


def _continuation(options: argparse.Namespace) -> Continuation | None:
    if options.resume is None:
        if options.renew:
            raise UsageError("--renew needs --resume FILE: it names what a run does not take from its checkpoint")
        return None
    is_same_run = options.resume.is_dir()
    file = options.resume / checkpoint.NAME if is_same_run else options.resume
    if is_same_run and not file.is_file():
        raise RequestError(
            f"{options.resume} holds no {checkpoint.NAME} to continue from: the run was started without "
            "--checkpoint-every, or ended before the first one; run it again"
        )
    return Continuation(checkpoint.read(file), str(file), tuple(options.renew), is_same_run)


def run_shown(system: System, folder: Path, quiet: bool, options: RunOptions = _DEFAULT) -> Results:
    """Run a system with its warnings and its progress in the terminal, unless ``quiet``."""
    if quiet:
        return run(system, folder, (), options)
    console = Terminal(stderr=True)  # that of the progress bar, which then stays below
    show_log(lambda text: say(text, console))
    for text in adjustments(system, options.checkpoint_every):
        say(f"warning: {text}", console)
    warnings = FmuWarningObserver(lambda warning: say(str(warning), console))
    if options.real_time is not None:  # drawing takes more time than a step has
        say(f"running for {(system.stop - system.start) / options.real_time:g} s by the wall clock")
        return run(system, folder, [warnings], options)
    progress = ProgressObserver(console, system.start, system.stop)
    try:
        return run(system, folder, [warnings, progress], options)
    finally:
        progress.finish()
