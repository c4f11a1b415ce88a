"""The terminal as a place for text from others: what an FMU says and a file names is shown, never obeyed.

Names, titles and messages come from FMUs and files of unknown origin. A control sequence in one of them could move the
cursor, colour a failed verdict green or set the clipboard; so every character that does not print is written out as
its escape. Rich's own sequences, for colours, are made after that and stay.
"""

from __future__ import annotations

import json
from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from master.errors import printable


class Terminal(Console):
    """A console that shows the characters that do not print instead of sending them."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render, and write out what does not print."""
        for segment in super().render(renderable, options):
            if segment.control:
                yield segment
            else:
                yield Segment(printable(segment.text), segment.style)


def printable_json(text: str) -> str:
    r"""Return JSON in which every character prints, and which says the same.

    Examples
    --------
    >>> print(printable_json('{"said": "\x9b2J"}'))
    {"said": "\u009b2J"}
    """
    return "".join(c if c.isprintable() or c == "\n" else json.dumps(c)[1:-1] for c in text)
