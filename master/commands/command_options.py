"""Options and messages that several verbs of the command line share."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console

from master.batch.batch_session import Runner
from master.errors import MasterError
from master.report.progress import progress_shown
from master.report.report_files import FORMATS
from master.report.terminal_summary import Terminal
from master.scenario.overrides import Overrides
from master.ssp.run_settings import SCHEMES
from master.ssp.ssp_units import number_advice
from master.system.components import System


def add_tolerance(parser: argparse.ArgumentParser) -> None:
    """Declare the tolerance for all FMUs."""
    text = "relative tolerance for all FMUs, default: that of their default experiments"
    parser.add_argument("--tolerance", dest="fmu_tolerance", type=positive_number, metavar="R", help=text)


def add_overrides(parser: argparse.ArgumentParser) -> None:
    """Declare what may be changed of a scenario, and how strictly it is read."""
    parser.add_argument("--strict", action="store_true", help="treat warnings of the scenario as errors")
    parser.add_argument(
        "--allow-outside",
        action="append",
        default=[],
        type=Path,
        metavar="DIR",
        help="let the scenario name files in this folder outside it, such as FMUs that scenarios share",
    )
    parser.add_argument("--stop", type=finite_number, metavar="T", help="stop time [s]")
    parser.add_argument("--step", type=positive_number, metavar="H", help="macro step [s]")
    parser.add_argument("--scheme", choices=SCHEMES, help="coupling scheme")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        type=assignment,
        metavar="COMPONENT.PARAMETER=VALUE",
        help="change a parameter",
    )


def add_figures(parser: argparse.ArgumentParser) -> None:
    """Declare the formats of the charts' files."""
    text = "charts as png (the default) or svg; once for each format"
    parser.add_argument("--figures", action="append", default=[], choices=tuple(FORMATS), help=text)


def finite_number(text: str) -> float:
    """Return an argument as a finite number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text or not text.isascii():
        raise argparse.ArgumentTypeError(f"'{text}' is not a finite number{number_advice(text)}")
    return value


def positive_number(text: str) -> float:
    """Return an argument as a number above 0."""
    value = finite_number(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"'{text}' must be greater than 0")
    return value


def assignment(text: str, form: str = "COMPONENT.PARAMETER=VALUE") -> tuple[str, str]:
    """Return name and value of an argument, which has this form."""
    name, sign, value = text.partition("=")
    if not (name and sign and value):
        raise argparse.ArgumentTypeError(f"'{text}' must be written {form}")
    return name, value


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


def add_verb(
    verbs: Any, name: str, text: str, verb: Callable[..., int], scenario: bool = False
) -> argparse.ArgumentParser:
    """Declare a verb and what carries it out; return the parser of its options."""
    parser: argparse.ArgumentParser = verbs.add_parser(name, help=text, description=text)
    parser.set_defaults(verb=verb)
    if scenario:
        text = "folder NAME.ssp/, archive NAME.ssp, folder of a project, or name of a scenario in the library"
        parser.add_argument("scenario", type=Path, metavar="SCENARIO", help=text)
        parser.add_argument("--no-build", action="store_true", help="do not build missing or stale FMUs")
    return parser


def say(text: str, console: Console | None = None) -> None:
    """Print a note or a warning to standard error."""
    (console or Terminal(stderr=True)).print(text, style="dim", markup=False, highlight=False, emoji=False)


def batch_runner(options: argparse.Namespace) -> Runner:
    """Return how a batch makes its runs: with progress and messages on standard error, or quietly."""
    if options.quiet:
        return Runner(build=not options.no_build)
    console = Terminal(stderr=True)
    return Runner(partial(progress_shown, console), partial(say, console=console), not options.no_build)


def say_warnings(system: System, note: Callable[[str], None] = say) -> None:
    """Print what a scenario warns of."""
    for text in system.warnings:
        note(f"warning: {text}")
