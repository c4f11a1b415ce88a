"""A figure that was held against a limit: what, how much, where, whether it passes, where the limit is from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

#: The words of runs' reports and of ``verify``; with proof: passed only if something is proven.
Word = Literal["passed", "with proof", "failed"]


@dataclass(frozen=True)
class Judgement:
    """A figure and its limit.

    Attributes
    ----------
    what : str
        What was judged, with its unit.
    figure : str
        How much, and where.
    word : {"passed", "with proof", "failed"}
        The verdict; with proof: it passes only if something is proven.
    limit : str
        The limit, with what it is of.
    source : str
        Where the limit is from.
    """

    what: str
    figure: str
    word: Word
    limit: str
    source: str = ""

    @property
    def passed(self) -> bool:
        """Whether the limit is kept, and nothing has to be proven for that."""
        return self.word == "passed"

    @property
    def text(self) -> str:
        """Figure, verdict and limit in a line."""
        return f"{self.figure}: {self.word}, limit {self.limit}"


def verdict_word(*, is_kept: bool) -> Word:
    """Return the word for a limit that is kept or is not."""
    return "passed" if is_kept else "failed"
