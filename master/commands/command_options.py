"""Options and messages that several verbs of the command line share."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial

from rich.console import Console

from master.batch.batch_session import Runner
from master.errors import MasterError
from master.report.log_notes import show_log
from master.report.progress import progress_shown
from master.report.terminal_summary import Terminal
from master.scenario.overrides import Overrides
from master.system.components import System


def overrides_of(options: argparse.Namespace) -> Overrides:
    """Return the changes that the options make to a scenario."""
    outside = tuple(options.allow_outside)
    for folder in outside:
        if not folder.is_dir():
            raise MasterError(f"--allow-outside {folder}: there is no such folder")
    return Overrides(
        options.stop,
        options.step,
        options.scheme,
        dict(options.set),
        tolerance=getattr(options, "fmu_tolerance", None),
        strict=options.strict,
        outside=outside,
    )


def say(text: str, console: Console | None = None) -> None:
    """Print a note or a warning to standard error."""
    (console or Terminal(stderr=True)).print(text, style="dim", markup=False, highlight=False, emoji=False)


def batch_runner(options: argparse.Namespace) -> Runner:
    """Return how a batch makes its runs: with progress and messages on standard error, or quietly."""
    if options.quiet:
        return Runner(build=not options.no_build)
    console = Terminal(stderr=True)
    tell = partial(say, console=console)
    show_log(tell)
    return Runner(partial(progress_shown, console), tell, not options.no_build)


def say_warnings(system: System, note: Callable[[str], None] = say) -> None:
    """Print what a scenario warns of."""
    for text in system.warnings:
        note(f"warning: {text}")
