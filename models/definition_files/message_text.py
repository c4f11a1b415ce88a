"""Text for messages: short, printable, whatever was written in a file."""

from __future__ import annotations

import difflib
import errno
import reprlib
from collections.abc import Iterable, Sequence
from functools import partial
from typing import Final

#: Longest message shown in full [characters], as a value may be megabytes of nested lists.
_LONGEST: Final = 500
#: What the system says of a file, in words, with what to do.
_SAID: Final = {
    errno.ENOENT: "there is no such file or folder: check the name",
    errno.ENOTDIR: "a part of the path is a file, where a folder is needed: name another place",
    errno.EISDIR: "it is a folder, where a file is needed: name the file",
    errno.EEXIST: "it is a file, where a folder is needed: name another place",
    errno.EACCES: "its permissions do not allow it: change them, or name another place",
    errno.EROFS: "the disk is read-only: name another place",
}


class _Shown(reprlib.Repr):
    """Values as shown in messages: short, whatever they hold."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlist = self.maxdict = self.maxlevel = 4
        self.maxstring = self.maxother = self.maxlong = 80

    def repr_int(self, x: int, level: int) -> str:
        """Return a number as text; Python refuses to write out thousands of digits."""
        return f"(a whole number of {x.bit_length()} bits)" if x.bit_length() > 1000 else super().repr_int(x, level)


#: Return a value as shown in messages.
shown_value = _Shown().repr


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
    >>> hint("ln2", ["CA160", "LN2"])
    "; did you mean 'LN2'?"
    >>> hint("height", ["CA160", "LN2"])
    ''
    """
    found = nearest(name, known, most)
    return f"; did you mean {' or '.join(map(repr, found))}?" if found else ""


def nearest(name: str, known: Iterable[str], most: int = 1) -> list[str]:
    """Return the known name that is very near to another, otherwise the nearest ones, which may be none."""
    folded = {k.casefold(): k for k in known}
    matches = partial(difflib.get_close_matches, name.casefold(), folded)
    return [folded[k] for k in matches(n=1, cutoff=0.85) or matches(n=most, cutoff=0.55)]


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


def one_line(text: str) -> str:
    """Return text on one line without control characters, and without its middle if it is very long."""
    if len(text) > _LONGEST:
        half = _LONGEST // 2
        text = f"{text[:half]} ... ({len(text)} characters) ... {text[-half:]}"
    return "".join(map(_printed, text))


def printable(text: str) -> str:
    """Return text with printable characters only, its lines kept, so that foreign text is safe on a terminal."""
    return "".join(c if c == "\n" else _printed(c) for c in text)


def _printed(c: str) -> str:
    return c if c.isprintable() else c.encode("unicode_escape").decode("ascii")
