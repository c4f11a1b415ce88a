"""What is wrong with tables that others wrote: every problem with its sheet, row and column, all in one error."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from models.definition_files.toml_reader import DefinitionError, Problem

#: Most problems listed; more of them have one cause.
_MOST: Final = 1000


class LayoutError(DefinitionError):
    """Tables that cannot be used; the message lists every problem, one per line."""

    def __init__(self, problems: tuple[Problem, ...]) -> None:
        super().__init__(problems)
        lines = [str(p) for p in problems[:_MOST]]
        if len(problems) > _MOST:
            lines.append(f"... and {len(problems) - _MOST} more problems")
        self.args = ("\n".join(lines),)


@dataclass(frozen=True)
class Place:
    """Where something stands: a sheet (empty: the file is its own), a row from 1, a column; 0 and empty: all of it.

    Examples
    --------
    >>> print(Place("supports", 7, "C (height)"))
    supports, row 7, column C (height)
    """

    sheet: str
    row: int = 0
    column: str = ""

    def __str__(self) -> str:
        row, column = (f"row {self.row}" if self.row else "", f"column {self.column}" if self.column else "")
        return ", ".join(filter(None, (self.sheet, row, column)))


@dataclass
class SheetProblems:
    """The problems of a file, or of a folder of files, as they are found."""

    file: str
    found: list[Problem] = field(default_factory=list)

    def add(self, place: Place, text: str) -> None:
        """Record what is wrong at a place, once."""
        problem = Problem(self.file, str(place), text)
        if problem not in self._seen:
            self._seen.add(problem)
            self.found.append(problem)

    def finish(self) -> None:
        """Raise ``LayoutError`` with all problems, if there are any."""
        if self.found:
            raise LayoutError(tuple(self.found))

    def __post_init__(self) -> None:
        self._seen = set(self.found)
