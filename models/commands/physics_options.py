"""Options and output that several verbs share."""

from __future__ import annotations

import argparse
import errno
import logging
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from master.evaluation.filters import DEFAULT, ForceFilter
from models.commands.physics_verbs import Setting
from models.definition_files.given_value import in_si
from models.definition_files.message_text import printable, said
from models.definition_files.parameter import Definition, ParameterError


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


def own_settings(given: Sequence[Setting], part: str, definition: Definition) -> dict[str, float]:
    """Return the ``--set`` values of the only part that a verb has [SI].

    Raises
    ------
    ParameterError
        As `settings`, and if a value is of another part.
    """
    for other in (s for s in given if s.part != part):
        raise ParameterError(f"--set {other.part}.{other.parameter}={other.value}: there is no {other.part} here")
    return settings(given, part, definition)


def _value(setting: Setting, wanted: str | None) -> float:
    try:
        return in_si(setting.value, wanted)  # the definition reports an unknown parameter
    except ValueError as error:
        raise ParameterError(f"--set {setting.part}.{setting.parameter}={setting.value}: {error}") from error


def print_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table, first column left, others right."""
    table = Table(title=printable(title), title_justify="left")
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "right")
    for row in rows:
        table.add_row(*map(printable, row))
    # Without markup: "[m]" is a unit here.
    Console(width=None if Console().is_terminal else 100, markup=False).print(table)


@contextmanager
def shown_progress(values: Sequence[float], name: str, is_quiet: bool) -> Iterator[Iterable[float]]:
    """Hand out values one by one, and show at a terminal how far that is; nothing of it is left at the end.

    The bar is gone when the context is left, by an error too: one that went later would take its message along.
    """
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    hidden = is_quiet or not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=hidden) as bar:
        yield bar.track(values, description=name)


def warn(texts: Iterable[str]) -> None:
    """Print what deserves a second look; the command continues."""
    for text in dict.fromkeys(filter(None, texts)):
        print(f"warning: {printable(text)}", file=sys.stderr)


class _LogLines(logging.Handler):
    """Hands every message of the project's log to a function."""

    def __init__(self, write: Callable[[str], None]) -> None:
        super().__init__()
        self._write = write

    def emit(self, record: logging.LogRecord) -> None:
        """Hand a message on."""
        self._write(record.getMessage())


def show_log(write: Callable[[str], None]) -> None:
    """Have what is logged written from now on, and no longer where an earlier call wanted it: that kernels compile."""
    logger = logging.getLogger("openpanto")
    for handler in [h for h in logger.handlers if isinstance(h, _LogLines)]:
        logger.removeHandler(handler)
    logger.addHandler(_LogLines(write))
    logger.setLevel(logging.INFO)


def new_folder(path: Path) -> Path:
    """Create a folder for results (an existing one is used) and return it."""
    path.mkdir(parents=True, exist_ok=True)
    return path


def check_folder(path: Path | None) -> None:
    """Refuse, before anything is computed, a folder for results that cannot be made.

    Raises
    ------
    ParameterError
        If a file is in its way, or permissions.
    """
    if path is None:
        return
    there = next(place for place in (path, *path.absolute().parents) if place.exists())
    if not there.is_dir():
        raise ParameterError(f"--out {path}: {there} is a file; name a folder, a new one or one of results")
    if not os.access(there, os.W_OK):
        raise ParameterError(f"--out {path}: {said(PermissionError(errno.EACCES, ''))}")
