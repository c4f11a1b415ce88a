"""Options and output that several verbs share."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from master.evaluation.filters import DEFAULT, ForceFilter
from models.definition import LARGEST, SMALLEST
from models.part import ParameterError


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Add ``--set part.parameter=value``, repeatable."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="PART.PARAMETER=VALUE",
        help="change a parameter: line.damping.alpha=0.00275, pantograph.static_force=170 (SI units)",
    )


def add_filter(parser: argparse.ArgumentParser) -> None:
    """Add the choice of the contact force's low-pass."""
    parser.add_argument("--filter", choices=("butterworth", "fft"), default=DEFAULT.kind, help="low-pass of the force")
    parser.add_argument("--filter-order", type=int, metavar="N", help=f"of butterworth (default {DEFAULT.order})")
    parser.add_argument("--filter-phase", choices=("zero", "causal"), help=f"of butterworth (default {DEFAULT.phase})")
    parser.add_argument("--cutoff", type=positive, default=DEFAULT.cutoff, help=f"Hz (default {DEFAULT.cutoff:g})")


def chosen_filter(arguments: argparse.Namespace) -> ForceFilter:
    """Return the low-pass that was asked for.

    Raises
    ------
    ParameterError
        If an option does not belong to the filter, or is out of its range.
    """
    order, phase = arguments.filter_order, arguments.filter_phase
    if arguments.filter == "fft" and (order is not None or phase is not None):
        raise ParameterError("--filter fft: has neither order nor phase; leave --filter-order and --filter-phase out")
    if order is not None and not 1 <= order <= _HIGHEST_ORDER:
        raise ParameterError(f"--filter-order {order}: must lie between 1 and {_HIGHEST_ORDER}")
    if 2.0 * arguments.cutoff * arguments.step >= 1.0:
        half = f"half the sampling frequency, {0.5 / arguments.step:g} Hz at --step {arguments.step:g}"
        raise ParameterError(f"--cutoff {arguments.cutoff:g}: must lie below {half}, or nothing is filtered")
    return ForceFilter(arguments.filter, order or DEFAULT.order, arguments.cutoff, phase or DEFAULT.phase)


_HIGHEST_ORDER = 20


def settings(given: Iterable[str], part: str) -> dict[str, float]:
    """Return the ``--set`` values of one part.

    Raises
    ------
    ParameterError
        If a setting is not of the form PART.PARAMETER=VALUE.
    """
    result = {}
    for text in given:
        name, equals, value = text.partition("=")
        head, dot, parameter = name.partition(".")
        if not equals or not dot or head not in ("line", "pantograph"):
            raise ParameterError(
                f"--set {text}: write line.PARAMETER=VALUE or pantograph.PARAMETER=VALUE"
            )
        if head == part:
            result[parameter] = _number(text, value)
    return result


def finite(text: str) -> float:
    """Read a finite number from the command line; argparse tells what is wrong with another."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) <= LARGEST or "_" in text or not text.isascii():
        raise argparse.ArgumentTypeError(f"'{text}' is not a number (finite, at most {LARGEST:g})")
    return value


def positive(text: str) -> float:
    """Read a number greater than 0 from the command line."""
    value = finite(text)
    if value < SMALLEST:
        raise argparse.ArgumentTypeError(f"'{text}' must be greater than 0")
    return value


def print_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table, first column left, others right."""
    table = Table(title=title, title_justify="left")
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "right")
    for row in rows:
        table.add_row(*row)
    # Without markup: "[m]" is a unit here.
    Console(width=None if Console().is_terminal else 100, markup=False).print(table)


def warn(texts: Iterable[str]) -> None:
    """Tell what deserves a second look; the command goes on."""
    for text in filter(None, texts):
        print(f"warning: {text}", file=sys.stderr)


def new_folder(path: Path) -> Path:
    """Create a folder for results (an existing one is used) and return it."""
    path.mkdir(parents=True, exist_ok=True)
    return path


def _number(text: str, value: str) -> float:
    try:
        return float(value)
    except ValueError as error:
        raise ParameterError(f"--set {text}: '{value}' is not a number") from error
