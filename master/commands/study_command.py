"""The verb ``study``."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from master.batch.batch_session import Runner
from master.batch.calibration import unchanged
from master.batch.study.family import Family, Variant, family_names, load_family, store_values
from master.batch.study.study_outcome import VariantResult
from master.batch.study.study_session import CSV, JSON, PAGE, study
from master.batch.study.study_table import list_table, show
from master.batch.study.variants import calibrate_variant
from master.commands.command_options import add_verb, batch_runner
from master.errors import UsageError
from master.report.terminal_summary import WIDTH, Terminal, printable_json
from master.scenario.scenario_place import refuse_installed


def add_study(verbs: Any) -> None:
    """Declare ``study`` and its options."""
    parser = add_verb(verbs, "study", "run a family of variants of a scenario and report them side by side", _study)
    parser.add_argument("name", nargs="?", metavar="NAME", help="study, or folder of its scenario; not with --list")
    parser.add_argument("--list", action="store_true", help="list the studies and their variants and run nothing")
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="VARIANT",
        help="run only this variant; may be repeated",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: results/study/NAME")
    parser.add_argument("--again", action="store_true", help="run again what an earlier study finished")
    parser.add_argument(
        "--calibrate",
        action="store_true",
        help="first find and store the static forces for the wanted mean",
    )
    parser.add_argument("--quiet", action="store_true", help="no progress, no tables; files and exit code only")
    parser.add_argument("--json", action="store_true", help=f"print {JSON} instead of tables")
    parser.add_argument("--no-build", action="store_true", help="do not build missing or stale FMUs")


def _study(options: argparse.Namespace) -> int:
    """Run a study; return 0 if every variant was run, 1 if not."""
    if options.list:
        names = [options.name] if options.name else family_names()
        Terminal(width=WIDTH).print(list_table([load_family(n) for n in names]))
        return 0
    if not options.name:
        raise UsageError(f"which study? known: {', '.join(family_names()) or 'none'}")
    family = load_family(options.name)
    chosen = family.chosen(options.only)
    runner = batch_runner(options)
    if options.calibrate:
        family, chosen = _calibrated(family, chosen, options, runner)
    folder = options.out or Path("results") / "study" / family.name
    done = study(family, chosen, folder, runner, options.again, _announcer(runner))
    _print(options, folder, lambda console: show(console, done))
    return 1 if done.failures else 0


def _print(options: argparse.Namespace, folder: Path, tables: Callable[[Console], None]) -> None:
    if options.json:
        print(printable_json((folder / JSON).read_text(encoding="utf-8")), end="")
    elif not options.quiet:
        console = Terminal(width=WIDTH, highlight=False)
        tables(console)
        console.print(f"page: {folder / PAGE}, table: {folder / CSV}", markup=False, soft_wrap=True)


def _calibrated(
    family: Family, chosen: Sequence[Variant], options: argparse.Namespace, runner: Runner
) -> tuple[Family, tuple[Variant, ...]]:
    """Find and store the forces of variants, one after the other; return the family as it is then."""
    refuse_installed(family.folder)
    for variant in chosen:
        with unchanged(family.folder) as check:
            found = calibrate_variant(family, variant, runner)
            check()
            store_values(family, variant.name, {name: f.value for name, f in found.items()})
    renewed = load_family(str(family.folder))
    return renewed, renewed.chosen(options.only)


def _announcer(runner: Runner) -> Callable[[VariantResult], None]:
    return lambda done: runner.tell(f"{done.name}: results in {done.results.folder}")
