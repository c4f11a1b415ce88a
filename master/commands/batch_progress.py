"""What ``sweep`` and ``optimise`` share: repeated options, and progress."""

from __future__ import annotations

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
