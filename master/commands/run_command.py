"""The verb ``run``."""

from __future__ import annotations

import argparse
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from master.commands import report_commands
from master.commands.command_options import (
    add_figures,
    add_overrides,
    add_tolerance,
    add_verb,
    finite_number,
    overrides_of,
    positive_number,
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


def add_run(verbs: Any) -> None:
    """Declare ``run`` and its options."""
    parser = add_verb(verbs, "run", "run a scenario", _run, scenario=True)
    add_overrides(parser)
    add_tolerance(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="results folder, default: results/NAME")
    parser.add_argument("--quiet", action="store_true", help="no progress bar, no tables")
    parser.add_argument("--no-report", action="store_true", help="no plots, no report.html")
    add_figures(parser)
    parser.add_argument("--json", action="store_true", help="print summary.json instead of tables")
    parser.add_argument("--checkpoint", type=finite_number, metavar="T", help="write the whole state at time T to DIR")
    parser.add_argument(
        "--checkpoint-every", type=positive_number, metavar="T", help="write it every T seconds of simulated time"
    )
    parser.add_argument(
        "--resume",
        type=Path,
        metavar="DIR|FILE",
        help="finish the run in results folder DIR from its last checkpoint; or begin a new run from checkpoint FILE",
    )
    parser.add_argument(
        "--renew", action="append", default=[], metavar="COMPONENT", help="with --resume: this component starts afresh"
    )
    parser.add_argument("--energy", action="store_true", help="check the energy balance and report its drift")
    parser.add_argument("--parquet", action="store_true", help="also write the time series as Parquet")
    parser.add_argument("--isolate", action="store_true", help="run each FMU in a separate process, which may crash")
    parser.add_argument(
        "--step-timeout",
        type=positive_number,
        metavar="S",
        help="with --isolate: longest that a step may take",
    )
    parser.add_argument(
        "--init-timeout",
        type=positive_number,
        metavar="S",
        help=f"with --isolate: longest that loading or initialising may take, default {INIT_TIMEOUT:g}",
    )
    parser.add_argument(
        "--real-time",
        type=positive_number,
        nargs="?",
        const=1.0,
        metavar="FACTOR",
        help="keep pace with the wall clock: FACTOR simulated seconds per second (default 1)",
    )


def _run_overrides(options: argparse.Namespace) -> Overrides:
    """Return the changes to a scenario: a run with --stop may end before it can be judged."""
    return replace(overrides_of(options), energy=options.energy, may_stop_early=options.stop is not None)


def _run(options: argparse.Namespace) -> int:
    note = (lambda _: None) if options.quiet else say
    if options.figures and options.no_report:
        raise UsageError("--figures says how charts are written, which --no-report leaves out: omit one of them")
    run_options = _run_options(options)
    with open_scenario(options.scenario, _run_overrides(options), note, not options.no_build) as scenario:
        folder = _folder(options, scenario.system)
        keep_apart(folder, scenario.package)
        say_warnings(scenario.system, note)
        with results_folder.claimed(folder):  # until the report is written too
            try:
                done = run_shown(scenario.system, folder, options.quiet, run_options)
            except RunError:
                if not options.no_report:
                    _report_what_there_is(folder)
                raise
            _show_results(done, options)
    return 0


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
