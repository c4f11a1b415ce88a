"""What went wrong in an instance, in words that are safe in every host, and whether the host knows it."""

from __future__ import annotations

import sys
import traceback
from pathlib import Path


class AdapterError(RuntimeError):
    """A call that the FMU cannot honour; its text is meant for the user."""


class SlaveFailures:
    """The failures of one instance.

    Every method that records one returns the text to log, empty if the host knows it.

    Attributes
    ----------
    refused : str
        What the host did wrong: stays until a state is restored.
    broken : str
        What the part could not do: tried again when a value changes.
    """

    def __init__(self, who: str) -> None:
        self.refused = ""
        self.broken = ""
        self._who = clean(who)
        self._is_repeated = False

    @property
    def current(self) -> str:
        """What keeps the instance from stepping, empty if nothing does."""
        return self.refused or self.broken

    def announce(self, error: BaseException) -> str:
        """Put an error into words on standard error, for hosts that show no log."""
        text = explain(error)
        print(f"{self._who}: {text}", file=sys.stderr, flush=True)
        self._is_repeated = False
        return text

    def refuse(self, error: BaseException) -> str:
        """Record a call that cannot be honoured; it is logged even after another one: it has a status too."""
        if self.refused:
            return explain(error)
        self.refused = self.announce(error)
        return self.refused

    def break_down(self, error: BaseException) -> str:
        """Record what the part could not do; the same again is logged once, where a step can return a status."""
        text = explain(error)
        if text != self.current:
            self.broken = self.announce(error)
            return text
        is_known, self._is_repeated = self._is_repeated, True
        return "" if is_known else text

    def restore(self, refused: str, broken: str) -> None:
        """Restore the failures of a saved state, which the host knows."""
        self.refused, self.broken = refused, broken
        self._is_repeated = bool(self.current)


def explain(error: BaseException) -> str:
    """Return why it failed; for errors that nobody put into words, with their place in the source."""
    if isinstance(error, KeyboardInterrupt):
        return "interrupted from the keyboard"
    text = str(error) or type(error).__name__
    if not _is_foreign(type(error)):
        return clean(text)
    place = traceback.extract_tb(error.__traceback__)[-1:]
    where = f" in {Path(place[0].filename).name}, line {place[0].lineno}" if place else ""
    return clean(f"{text} ({type(error).__name__}{where})")


def _is_foreign(error: type[BaseException]) -> bool:
    return error.__module__.partition(".")[0] in {"builtins", "numpy", "scipy"}


def clean(text: str) -> str:
    """Return text that is safe as a C host's printf format and as UTF-8.

    Examples
    --------
    >>> clean("slipped by 3%")
    'slipped by 3 percent'
    """
    spelled = text.replace(" %", " percent").replace("%", " percent")
    return spelled.encode("utf-8", "replace").decode("utf-8")
