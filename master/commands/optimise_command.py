"""The verb ``optimise``."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from master.batch.optimisation.optimisation_goal import OptimisationRequest
from master.batch.optimisation.optimisation_page import lines, page
from master.batch.optimisation.optimisation_session import (
    CSV,
    JSON,
    PAGE,
    OptimisationOutcome,
    PreparedOptimisation,
    optimise,
)
from master.batch.sweep.engine_selection import engine_of
from master.commands.batch_options import add_engine, count, distinct, named_values, progress_lines
from master.commands.command_options import add_overrides, add_verb, overrides_of, positive_number, say
from master.interface.scenario_runs import keep_apart
from master.report.terminal_summary import WIDTH, Terminal, printable_json
from master.scenario.open_scenario import open_scenario


def add_optimise(verbs: Any) -> None:
    """Declare ``optimise`` and its options."""
    parser = add_verb(
        verbs,
        "optimise",
        "find the values of a few parameters for which a figure is least or greatest",
        _optimise,
        scenario=True,
    )
    goal = parser.add_mutually_exclusive_group(required=True)
    goal.add_argument("--minimise", metavar="FIGURE", help="the figure that shall be least, e.g. sigma")
    goal.add_argument("--maximise", metavar="FIGURE", help="the figure that shall be greatest")
    text = "bounds of a parameter, e.g. 3000:12000N/m; may be repeated"
    parser.add_argument(
        "--vary", action="append", default=[], type=named_values, metavar="NAME=LOW:HIGH", required=True, help=text
    )
    text = "mean=157.5N (by the static force), maximum<=350N, minimum>=0N; may be repeated"
    parser.add_argument("--subject-to", action="append", default=[], metavar="CONSTRAINT", help=text)
    parser.add_argument("--mean-tolerance", type=positive_number, metavar="N", help="how near is enough; default 0.2")
    parser.add_argument("--max-runs", type=count, metavar="N", help="most points that are tried; default 60")
    parser.add_argument("--seed", type=int, metavar="S", help="of the search; default 1")
    add_overrides(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: results/optimise/NAME")
    add_engine(parser)
    parser.add_argument("--again", action="store_true", help="also make the runs again that failed")
    parser.add_argument("--dry-run", action="store_true", help="check everything and run nothing")
    parser.add_argument("--quiet", action="store_true", help="no progress; files and exit code only")
    parser.add_argument("--json", action="store_true", help=f"print {JSON}")


def _optimise(options: argparse.Namespace) -> int:
    """Optimise; return 0 if a point was found that keeps the constraints, else 1."""
    console = Terminal(stderr=True)
    note: Callable[[str], None] = (lambda _: None) if options.quiet else partial(say, console=console)
    overrides = replace(overrides_of(options), may_stop_early=options.stop is not None)
    request = _request(options)
    with open_scenario(options.scenario, overrides, note, not options.no_build) as scenario:
        prepared = PreparedOptimisation.of(scenario.system, request)
        if options.dry_run:
            text = f"{prepared.outcome.goal.text}: can be looked for, in at most {request.max_runs} run(s)"
            Terminal(width=WIDTH).print(text, markup=False)
            return 0
        folder = options.out or Path("results") / "optimise" / scenario.system.name
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
