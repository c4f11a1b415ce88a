"""What can go wrong, in words for the user: what, where, which value, what to do about it."""

from __future__ import annotations

import difflib
import errno
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

#: Longest value or text that is shown in full [characters], and most problems that are listed at once.
_LONGEST: Final = 500
_MOST: Final = 100
#: What the system says of a file, in words, with what to do.
_SAID: Final = {
    errno.ENOENT: "there is no such file or folder: check the name",
    errno.ENOTDIR: "a part of the path is a file, where a folder is needed: name another place",
    errno.EISDIR: "it is a folder, where a file is needed: name the file",
    errno.EEXIST: "it is a file, where a folder is needed: name another place",
    errno.EACCES: "its permissions do not allow it: change them, or name another place",
    errno.EROFS: "the disk is read-only: name another place",
}


def one_line(text: str) -> str:
    r"""Return text on one line, without control characters, its middle left out if it is very long.

    What a file or a command line holds may be megabytes long, or made to confuse a terminal.

    Examples
    --------
    >>> print(one_line("soon\n\x1b[2J"))
    soon\n\x1b[2J
    >>> print(one_line("a column named '\N{NO-BREAK SPACE}'"))
    a column named '\xa0'
    """
    if len(text) > _LONGEST:
        half = _LONGEST // 2
        text = f"{text[:half]} ... ({len(text)} characters) ... {text[-half:]}"
    return "".join(map(_shown, text))


def said(error: OSError) -> str:
    """Return why a file could not be used, and what to do, in words.

    Examples
    --------
    >>> said(FileNotFoundError(errno.ENOENT, "No such file or directory"))
    'there is no such file or folder: check the name'
    """
    return _SAID.get(error.errno or 0) or error.strerror or str(error)


def not_utf8(error: UnicodeDecodeError) -> str:
    r"""Return what is wrong with a file that is not text as it should be, and what to do.

    Examples
    --------
    >>> try:
    ...     b"Kettenwerk\nH\xf6he\n".decode()
    ... except UnicodeDecodeError as error:
    ...     print(not_utf8(error))
    is not UTF-8 text (line 2): save it as UTF-8
    """
    line = error.object[: error.start].count(b"\n") + 1
    return f"is not UTF-8 text (line {line}): save it as UTF-8"


def hint(name: str, known: Iterable[str], most: int = 1) -> str:
    """Return the question whether a known name was meant, empty if none is near: one that is very near, or the nearest.

    Examples
    --------
    >>> hint("Sigmaa", ["mean", "sigma"])
    "; did you mean 'sigma'?"
    >>> hint("height", ["mean", "sigma"])
    ''
    """
    folded = {k.casefold(): k for k in known}
    matches = partial(difflib.get_close_matches, name.casefold(), folded)
    near = matches(n=1, cutoff=0.85) or matches(n=most, cutoff=0.55)
    return f"; did you mean {' or '.join(repr(folded[k]) for k in near)}?" if near else ""


def empty_argument(given: Sequence[str]) -> str:
    """Return what to say of an empty argument, as of a shell variable that is not set; nothing if none is empty.

    Examples
    --------
    >>> empty_argument(["run", "cx_ln2", "--out", ""])
    "what comes after '--out' is empty: write it out, or set the shell variable that stands there"
    >>> empty_argument(["run", "cx_ln2"])
    ''
    """
    for k, text in enumerate(given):
        option, equals, value = text.partition("=")
        if not text.strip():
            what = f"what comes after '{given[k - 1]}'" if k else "the first argument"
        elif option.startswith("--") and equals and not value.strip():
            what = f"what comes after '{text}'"
        else:
            continue
        return f"{what} is empty: write it out, or set the shell variable that stands there"
    return ""


def printable(text: str) -> str:
    r"""Return text whose characters all print, lines kept: for what others have written, on its way to a terminal.

    Examples
    --------
    >>> print(printable("red\x1b[31m\nnext"))
    red\x1b[31m
    next
    >>> printable("8\N{NO-BREAK SPACE}%") == "8\N{NO-BREAK SPACE}%"
    True
    """
    return text if text.isprintable() else "".join(c if c in "\n\N{NO-BREAK SPACE}" else _shown(c) for c in text)


def _shown(c: str) -> str:
    return c if c.isprintable() else c.encode("unicode_escape").decode("ascii")


@dataclass(frozen=True)
class Problem:
    """One mistake in a scenario.

    Attributes
    ----------
    file : str
        File name inside the scenario, e.g. ``SystemStructure.ssd``.
    line : int
        Line in that file, 0 when no single line is at fault.
    rule : str
        Short name of the violated rule, e.g. ``connection``.
    text : str
        What is wrong and what to do.
    """

    file: str
    line: int
    rule: str
    text: str

    def __str__(self) -> str:
        file = one_line(self.file)
        where = f"{file}:{self.line}" if self.line else file
        return f"{where}: {one_line(self.text)} [{self.rule}]"


class MasterError(Exception):
    """A failure that the user sees as one message, never as a traceback."""


class ScenarioError(MasterError):
    """A scenario that cannot be run; carries every problem found."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        lines = [str(p) for p in self.problems[:_MOST]]
        if len(self.problems) > _MOST:
            lines.append(f"... and {len(self.problems) - _MOST} more problems")
        super().__init__("\n".join(lines))


class SlaveError(MasterError):
    """An FMU that failed; the message carries the FMU's own words."""


class RunError(MasterError):
    """A run that stopped before its end; what was computed is on disk."""


class InterruptedRunError(RunError):
    """A run that the user stopped."""


class ForeignResultsError(MasterError):
    """A results folder that no longer holds what the run has written into it."""


class RequestError(MasterError):
    """A command line that asks for something impossible: a name that does not exist, a value out of range.

    The command has failed (exit code 1), as it has for a scenario or a file that cannot be used.
    """


class UsageError(MasterError):
    """A command line that was not understood: options that need or exclude one another (exit code 2)."""
