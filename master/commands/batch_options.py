"""Options and progress that the verbs of many runs share: ``sweep`` and ``optimise``."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.status import Status

from master.commands.command_options import say
from master.errors import UsageError

#: Seconds between two lines of progress where there is no terminal.
_LINES = 30.0


def add_engine(parser: argparse.ArgumentParser) -> None:
    """Declare who makes the runs."""
    parser.add_argument("--jobs", type=count, metavar="N", help="make N runs at a time, in processes of this computer")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="make the runs on the workers of this Dask scheduler")
    parser.add_argument("--memory-limit", default="auto", metavar="SIZE", help="of each process with --jobs, e.g. 2GB")
    parser.add_argument(
        "--renew-after", type=count, default=200, metavar="K", help="runs after which a process is renewed"
    )


def named_values(text: str) -> tuple[str, str]:
    """Return name and values of an argument NAME=VALUES."""
    name, sign, value = text.partition("=")
    if not (name.strip() and sign and value.strip()):
        raise argparse.ArgumentTypeError(f"'{text}' must be written NAME=VALUES")
    return name.strip(), value.strip()


def count(text: str) -> int:
    """Return an argument as a whole number above 0."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number above 0")
    return value


def distinct(option: str, pairs: list[tuple[str, str]]) -> dict[str, str]:
    """Return the values of a repeated option by their names.

    Raises
    ------
    UsageError
        If a name is given twice.
    """
    names = [name for name, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            raise UsageError(f"{option} {name} is given twice")
    return dict(pairs)


@contextmanager
def progress_lines(console: Console, quiet: bool) -> Iterator[Callable[[object], None]]:
    """Yield what shows the progress: one line that changes in a terminal, lines now and then elsewhere."""
    if quiet:
        yield lambda _: None
    elif sys.stderr.isatty():
        with Status("", console=console) as status:
            yield lambda progress: status.update(str(progress))
    else:
        lines = _Lines(console)
        yield lines
        lines.end()


class _Lines:
    """Prints the progress, but not more often than one cares to read."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._due = 0.0
        self._last = ""

    def __call__(self, progress: object) -> None:
        self._last = str(progress)
        if time.monotonic() >= self._due:
            self._due = time.monotonic() + _LINES
            self.end()

    def end(self) -> None:
        """Print what was not printed yet."""
        if self._last:
            say(self._last, self._console)
        self._last = ""
