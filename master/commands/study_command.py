"""The verb ``study``."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console

from master.batch.batch_session import Runner
from master.batch.calibration import unchanged
from master.batch.study.family import Family, Variant, family_names, load_family, store_values
from master.batch.study.study_outcome import VariantResult
from master.batch.study.study_session import CSV, JSON, PAGE, study
from master.batch.study.study_table import list_table, show
from master.batch.study.variants import calibrate_variant
from master.commands.command_options import batch_runner
from master.errors import UsageError
from master.report.terminal_summary import WIDTH, Terminal, printable_json
from master.scenario.scenario_place import refuse_installed


def study_verb(options: argparse.Namespace) -> int:
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
