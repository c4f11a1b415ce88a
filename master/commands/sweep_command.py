"""The verb ``sweep``."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, get_args

from rich.console import Console
from rich.status import Status

from master.batch.sweep.distributions import Method
from master.batch.sweep.engine_selection import engine_of
from master.batch.sweep.sweep_plan import Engine, Keep, SweepRequest, stored_request
from master.batch.sweep.sweep_session import CSV, JSON, PARQUET, PreparedSweep, SweepOutcome, SweepProgress, sweep
from master.commands.command_options import add_overrides, add_verb, overrides_of, positive_number, say
from master.errors import UsageError
from master.interface.scenario_runs import keep_apart
from master.report.terminal_summary import WIDTH, Terminal, printable_json
from master.scenario.open_scenario import open_scenario
from master.scenario.scenario_place import located

#: Seconds between two lines of progress where there is no terminal.
_LINES = 30.0


def add_sweep(verbs: Any) -> None:
    """Declare ``sweep`` and its options."""
    parser = add_verb(
        verbs, "sweep", "run a scenario over a grid, a sample or a table of values", _sweep, scenario=True
    )
    _add_values(parser)
    add_overrides(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: results/sweep/NAME")
    parser.add_argument(
        "--keep", choices=get_args(Keep), help="what stays of the runs beside the table; default: figures"
    )
    text = "what makes the runs: their FMUs (default), or many side by side without FMUs, for lumped pantographs"
    parser.add_argument("--engine", choices=get_args(Engine), help=text)
    text = "with --engine lanes: runs that are made as FMUs as well, to compare; default: 1"
    parser.add_argument("--check", type=_count_or_none, metavar="N", help=text)
    parser.add_argument("--jobs", type=_count, metavar="N", help="make N runs at a time, in processes of this computer")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="make the runs on the workers of this Dask scheduler")
    parser.add_argument("--memory-limit", default="auto", metavar="SIZE", help="of each process with --jobs, e.g. 2GB")
    parser.add_argument(
        "--renew-after", type=_count, default=200, metavar="K", help="runs after which a process is renewed"
    )
    parser.add_argument("--again", action="store_true", help="also make the runs again that failed")
    parser.add_argument("--dry-run", action="store_true", help="check everything and say how many runs there are")
    parser.add_argument("--quiet", action="store_true", help="no progress; files and exit code only")
    parser.add_argument("--json", action="store_true", help=f"print {JSON}")


def _add_values(parser: argparse.ArgumentParser) -> None:
    def assigned(option: str, values: str, text: str) -> None:
        parser.add_argument(option, action="append", default=[], type=_assignment, metavar=f"NAME={values}", help=text)

    assigned("--over", "A,B,..|FIRST:LAST:STEP", "values of a grid; may be repeated")
    assigned("--vary", "DISTRIBUTION", "e.g. normal(20kN, 0.2kN), uniform(a, b); needs --samples; may be repeated")
    parser.add_argument("--samples", type=_count, metavar="N", help="number of samples of what varies")
    parser.add_argument("--seed", type=int, metavar="S", help="of the samples; default 1")
    parser.add_argument("--method", choices=get_args(Method), help="Latin hypercube (default) or Sobol sequence")
    parser.add_argument("--from-csv", type=Path, metavar="FILE", help="a row for each run, a column for each parameter")
    parser.add_argument("--static-force", metavar="'F0 N + c v^2'", help="static force over the speed v in km/h")
    parser.add_argument("--mean-force", metavar="'F0 N + c v^2'", help="mean force that the static force is found for")
    parser.add_argument("--mean-tolerance", type=positive_number, metavar="N", help="how near is enough; default 0.2")


def _assignment(text: str) -> tuple[str, str]:
    name, sign, value = text.partition("=")
    if not (name.strip() and sign and value.strip()):
        raise argparse.ArgumentTypeError(f"'{text}' must be written NAME=VALUES")
    return name.strip(), value.strip()


def _count(text: str) -> int:
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number above 0")
    return value


def _count_or_none(text: str) -> int:
    return 0 if text == "0" else _count(text)


def _sweep(options: argparse.Namespace) -> int:
    """Make a sweep; return 0 if every run was made, 1 if one failed."""
    console = Terminal(stderr=True)
    note: Callable[[str], None] = (lambda _: None) if options.quiet else partial(say, console=console)
    request = _request(options)
    overrides = replace(overrides_of(options), may_stop_early=options.stop is not None)
    with open_scenario(options.scenario, overrides, note, not options.no_build) as scenario:
        prepared = PreparedSweep.of(scenario.system, request)
        if options.dry_run:
            Terminal(width=WIDTH).print(f"{len(prepared.outcome.runs)} run(s), all can be made", markup=False)
            return 0
        folder = options.out or Path("results") / "sweep" / scenario.system.name
        keep_apart(folder, scenario.package)
        engine = engine_of(options.jobs, options.scheduler, note, options.memory_limit, options.renew_after, request)
        with _progress(console, options.quiet) as show:
            done = sweep(prepared, folder, engine, note, show, options.again)
    _print(options, folder, done)
    return 1 if done.failures else 0


def _request(options: argparse.Namespace) -> SweepRequest:
    """Return what is asked for: the options, or the scenario's stored sweep with these changes."""
    given = {
        "over": _distinct("--over", options.over),
        "vary": _distinct("--vary", options.vary),
        "samples": options.samples,
        "seed": options.seed,
        "method": options.method,
        "table": options.from_csv,
        "stop": options.stop,
        "static_force": options.static_force,
        "mean_force": options.mean_force,
        "tolerance": options.mean_tolerance,
        "keep": options.keep,
        "engine": options.engine,
        "check": options.check,
    }
    asked = {name: value for name, value in given.items() if value not in (None, {})}
    # A plan is taken whole, from here or from there: half of each would be neither's.
    is_own = any(name in asked for name in ("over", "vary", "table"))
    stored = {} if is_own else stored_request(located(options.scenario))
    return SweepRequest.read({**stored, **asked}, "" if is_own else "study.toml, [sweep]" if stored else "")


def _distinct(option: str, pairs: list[tuple[str, str]]) -> dict[str, str]:
    names = [name for name, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            raise UsageError(f"{option} {name} is given twice")
    return dict(pairs)


@contextmanager
def _progress(console: Console, quiet: bool) -> Iterator[Callable[[SweepProgress], None]]:
    """Yield what shows the progress: one line that changes in a terminal, lines now and then elsewhere."""
    if quiet:
        yield lambda _: None
    elif sys.stderr.isatty():
        with Status("", console=console) as status:
            yield lambda progress: status.update(str(progress))
    else:
        yield _Lines(console)


class _Lines:
    """Prints the progress, but not more often than one cares to read."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._due = 0.0

    def __call__(self, progress: SweepProgress) -> None:
        if time.monotonic() >= self._due or progress.done == progress.total:
            self._due = time.monotonic() + _LINES
            say(str(progress), self._console)


def _print(options: argparse.Namespace, folder: Path, done: SweepOutcome) -> None:
    if options.json:
        print(printable_json((folder / JSON).read_text(encoding="utf-8")), end="")
    elif not options.quiet:
        console = Terminal(width=WIDTH, highlight=False)
        for number, reason in list(done.failures.items())[:10]:
            console.print(f"run {number} failed: {reason}", markup=False, soft_wrap=True)
        files = [str(folder / name) for name in (CSV, PARQUET) if (folder / name).is_file()]
        text = f"{len(done.finished)} runs, {len(done.failures)} failed; table: {', '.join(files)}"
        console.print(text, markup=False, soft_wrap=True)
        if done.checks:
            largest = max(check["largest difference [N]"] for check in done.checks)
            text = f"{len(done.checks)} of them made by FMUs as well: contact forces differ by at most {largest:.1e} N"
            console.print(text, markup=False, soft_wrap=True)
