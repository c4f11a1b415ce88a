"""The verb ``optimise``."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

from master.batch.optimisation.optimisation_goal import OptimisationRequest
from master.batch.optimisation.optimisation_page import lines, page
from master.batch.optimisation.optimisation_session import (
    CSV,
    JSON,
    PAGE,
    PLACE,
    OptimisationOutcome,
    PreparedOptimisation,
    check_place,
    optimise,
)
from master.batch.sweep.engine_selection import engine_of
from master.commands.batch_progress import distinct, progress_lines
from master.commands.command_options import overrides_of, say
from master.interface.scenario_runs import keep_apart
from master.report.terminal_summary import WIDTH, Terminal, printable_json
from master.scenario.open_scenario import open_scenario


def optimise_verb(options: argparse.Namespace) -> int:
    """Optimise; return 0 if a point was found that keeps the constraints, else 1."""
    console = Terminal(stderr=True)
    note: Callable[[str], None] = (lambda _: None) if options.quiet else partial(say, console=console)
    overrides = overrides_of(options)
    request = _request(options)
    if not options.dry_run:
        check_place(options.out)
    with open_scenario(options.scenario, overrides, note, not options.no_build) as scenario:
        prepared = PreparedOptimisation.of(scenario.system, request, str(options.scenario), overrides.options)
        if options.dry_run:
            text = f"{prepared.outcome.goal.text}: can be looked for, in at most {request.max_runs} run(s)"
            Terminal(width=WIDTH).print(text, markup=False)
            return 0
        folder = options.out or PLACE / scenario.system.name
        keep_apart(folder, scenario.package)
        engine = engine_of(options.jobs, options.scheduler, note, options.memory_limit, options.renew_after)
        with progress_lines(console, options.quiet) as show:
            done = optimise(prepared, folder, page, engine, note, show, options.again)
    _print(options, folder, done)
    return 0 if done.best is not None else 1


def _request(options: argparse.Namespace) -> OptimisationRequest:
    given = {
        "minimise": options.minimise,
        "maximise": options.maximise,
        "vary": distinct("--vary", options.vary),
        "subject_to": options.subject_to,
        "max_runs": options.max_runs,
        "seed": options.seed,
        "tolerance": options.mean_tolerance,
        "stop": options.stop,
    }
    return OptimisationRequest.read({name: value for name, value in given.items() if value is not None})


def _print(options: argparse.Namespace, folder: Path, done: OptimisationOutcome) -> None:
    if options.json:
        print(printable_json((folder / JSON).read_text(encoding="utf-8")), end="")
    elif not options.quiet:
        console = Terminal(width=WIDTH, highlight=False)
        for line in (*lines(done), f"page: {folder / PAGE}, table: {folder / CSV}"):
            console.print(line, markup=False, soft_wrap=True)
