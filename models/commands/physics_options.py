"""Options and output that several verbs share."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from master.evaluation.filters import DEFAULT, ForceFilter
from models.definition_files.given_value import in_si, number_advice
from models.definition_files.message_text import printable
from models.definition_files.parameter import Definition, ParameterError
from models.definition_files.toml_reader import LARGEST, SMALLEST

_PARTS = ("line", "pantograph")


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Add ``--set part.parameter=value``, repeatable."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        type=_setting,
        metavar="PART.PARAMETER=VALUE",
        help="change a parameter: line.damping.alpha=0.00275, line.contact_wire.tension='12 kN' (SI where no unit is)",
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


class Setting(NamedTuple):
    """A value from the command line: of the line or the pantograph, its parameter, and as text with or without unit."""

    part: str
    parameter: str
    value: str


def settings(given: Iterable[Setting], part: str, definition: Definition) -> dict[str, float]:
    """Return the ``--set`` values of one part [SI].

    Raises
    ------
    ParameterError
        If a value is no number, or has a unit that does not fit its parameter.
    """
    units = {p.name: p.unit for p in definition.parameters()}
    own = (s for s in given if s.part == part)
    return {s.parameter: _value(s, units.get(s.parameter)) for s in own}


def _setting(text: str) -> Setting:
    name, equals, value = text.partition("=")
    part, dot, parameter = name.partition(".")
    if not (equals and dot and parameter and value) or part not in _PARTS:
        raise argparse.ArgumentTypeError(f"'{text}': write line.PARAMETER=VALUE or pantograph.PARAMETER=VALUE")
    return Setting(part, parameter, value)


def _value(setting: Setting, wanted: str | None) -> float:
    try:
        return in_si(setting.value, wanted)  # the definition reports an unknown parameter
    except ValueError as error:
        raise ParameterError(f"--set {setting.part}.{setting.parameter}={setting.value}: {error}") from error


def finite(text: str) -> float:
    """Read a finite number from the command line; argparse reports what is wrong with another."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) <= LARGEST or "_" in text or not text.isascii():
        raise argparse.ArgumentTypeError(f"'{text}' is not a number (finite, at most {LARGEST:g}){number_advice(text)}")
    return value


def positive(text: str) -> float:
    """Read a number greater than 0 from the command line."""
    value = finite(text)
    if value < SMALLEST:
        raise argparse.ArgumentTypeError(f"'{text}' must be greater than 0")
    return value


def print_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table, first column left, others right."""
    table = Table(title=printable(title), title_justify="left")
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "right")
    for row in rows:
        table.add_row(*map(printable, row))
    # Without markup: "[m]" is a unit here.
    Console(width=None if Console().is_terminal else 100, markup=False).print(table)


def warn(texts: Iterable[str]) -> None:
    """Print what deserves a second look; the command continues."""
    for text in dict.fromkeys(filter(None, texts)):
        print(f"warning: {printable(text)}", file=sys.stderr)


def new_folder(path: Path) -> Path:
    """Create a folder for results (an existing one is used) and return it."""
    path.mkdir(parents=True, exist_ok=True)
    return path


def check_folder(path: Path | None) -> None:
    """Refuse, before anything is computed, a folder for results that cannot be made.

    Raises
    ------
    ParameterError
        If a file is in its way.
    """
    if path is None:
        return
    there = next(place for place in (path, *path.absolute().parents) if place.exists())
    if not there.is_dir():
        raise ParameterError(f"--out {path}: {there} is a file; name a folder, a new one or one of results")
