"""A figure that was held against a limit: what, how much, where, whether it keeps it, where the limit is from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

Word = Literal["keeps", "does not keep", "within", "beyond"]
_KEPT: Final = ("keeps", "within")


@dataclass(frozen=True)
class Judgement:
    """A figure and its limit.

    Attributes
    ----------
    what : str
        What was judged, with its unit.
    figure : str
        How much, and where.
    word : {"keeps", "does not keep", "within", "beyond"}
    limit : str
        The limit, with what it is of.
    source : str
        Where the limit is from.
    is_conditional : bool
        Whether it is kept only if something is proven.
    """

    what: str
    figure: str
    word: Word
    limit: str
    source: str = ""
    is_conditional: bool = False

    @property
    def is_kept(self) -> bool:
        """Whether the limit is kept, and nothing has to be proven for that."""
        return self.word in _KEPT and not self.is_conditional

    @property
    def text(self) -> str:
        """Figure, verdict and limit in a line."""
        return f"{self.figure}: {self.word} {self.limit}"


def kept(*, is_kept: bool) -> Word:
    """Return the word for a limit that is kept or is not."""
    return "keeps" if is_kept else "does not keep"
