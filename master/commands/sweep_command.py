"""The verb ``sweep``."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from master.batch.sweep.engine_selection import engine_of
from master.batch.sweep.sweep_plan import SweepRequest, check_overridden, listed_faults, stored_request
from master.batch.sweep.sweep_session import (
    CSV,
    JSON,
    PAGE,
    PARQUET,
    PLACE,
    SENSITIVITY_CSV,
    PreparedSweep,
    SweepOutcome,
    check_place,
    sweep,
)
from master.commands.batch_progress import distinct, progress_lines
from master.commands.command_options import overrides_of, say
from master.interface.scenario_runs import keep_apart
from master.report.terminal_summary import WIDTH, Terminal, printable_json
from master.scenario.open_scenario import open_scenario
from master.scenario.scenario_place import located


def sweep_verb(options: argparse.Namespace) -> int:
    """Make a sweep; return 0 if every run was made, 1 if one failed."""
    console = Terminal(stderr=True)
    note: Callable[[str], None] = (lambda _: None) if options.quiet else partial(say, console=console)
    request = _request(options)
    overrides = replace(
        overrides_of(options),
        may_stop_early=options.stop is not None,
        faults=request.faults,
        faults_of=request.faults_of,
    )
    if not options.dry_run:
        check_place(options.out)
    with open_scenario(options.scenario, overrides, note, not options.no_build) as scenario:
        prepared = PreparedSweep.of(scenario.system, request)
        check_overridden(prepared.outcome.plan, (*overrides.parameters, *(["step"] if overrides.step else [])))
        if options.dry_run:
            for text in prepared.notes:
                note(text)
            Terminal(width=WIDTH).print(f"{len(prepared.outcome.runs)} run(s), all can be made", markup=False)
            return 0
        folder = options.out or PLACE / scenario.system.name
        keep_apart(folder, scenario.package)
        engine = engine_of(options.jobs, options.scheduler, note, options.memory_limit, options.renew_after, request)
        with progress_lines(console, options.quiet) as show:
            done = sweep(prepared, folder, engine, note, show, options.again)
    _print(options, folder, done)
    return 1 if done.failures else 0


def _request(options: argparse.Namespace) -> SweepRequest:
    """Return what is asked for: the options, or the scenario's stored sweep with these changes."""
    given = {
        "over": distinct("--over", options.over),
        "vary": distinct("--vary", options.vary),
        "samples": options.samples,
        "seed": options.seed,
        "method": options.method,
        "sensitivity": options.sensitivity,
        "table": options.from_csv,
        **listed_faults(options.faults, options.span),
        "stop": options.stop,
        "static_force": options.static_force,
        "mean_force": options.mean_force,
        "tolerance": options.mean_tolerance,
        "keep": options.keep,
        "engine": options.engine,
        "check": options.check,
    }
    asked = {name: value for name, value in given.items() if value not in (None, {}, ())}
    # A plan is taken whole, from here or from there: half of each would be neither's.
    is_own = any(name in asked for name in ("over", "vary", "table", "faults"))
    stored = {} if is_own else stored_request(located(options.scenario))
    return SweepRequest.read({**stored, **asked}, "" if is_own else "study.toml, [sweep]" if stored else "")


def _print(options: argparse.Namespace, folder: Path, done: SweepOutcome) -> None:
    if options.json:
        print(printable_json((folder / JSON).read_text(encoding="utf-8")), end="")
    elif not options.quiet:
        console = Terminal(width=WIDTH, highlight=False)
        for number, reason in list(done.failures.items())[:10]:
            console.print(f"run {number} failed: {reason}", markup=False, soft_wrap=True)
        files = [str(folder / name) for name in (CSV, PARQUET, SENSITIVITY_CSV) if (folder / name).is_file()]
        count = f"{len(done.finished)} runs, {len(done.failures)} failed"
        text = f"{count}; page: {folder / PAGE}; table: {', '.join(files)}"
        console.print(text, markup=False, soft_wrap=True)
        if done.checks:
            largest = max(check["largest difference [N]"] for check in done.checks)
            text = f"{len(done.checks)} of them made by FMUs as well: contact forces differ by at most {largest:.1e} N"
            console.print(text, markup=False, soft_wrap=True)
