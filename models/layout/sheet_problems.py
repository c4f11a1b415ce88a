"""What is wrong with tables that others wrote: every problem with its sheet, row and column, all in one error."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from models.definition_files.message_text import shown_value
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
    """The problems of a file, or of a folder of files, as they are found; and the hidden sheets that were not read."""

    file: str
    found: list[Problem] = field(default_factory=list)
    hidden: list[str] = field(default_factory=list)

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what was left out, in a line; none if nothing was."""
        if not self.hidden:
            return ()
        *others, last = map(shown_value, self.hidden)
        if not others:
            return (f"{self.file}: {last} is hidden and was not read",)
        return (f"{self.file}: {', '.join(others)} and {last} are hidden and were not read",)

    def add(self, place: Place, text: str) -> None:
        """Record what is wrong at a place, once."""
        problem = Problem(self.file, str(place), text)
        if problem not in self._places:
            self._places[problem] = place
            self.found.append(problem)

    def has(self, sheet: str) -> bool:
        """Return whether a problem of a sheet has been recorded."""
        return any(p.key == sheet or p.key.startswith(f"{sheet},") for p in self.found)

    def finish(self) -> None:
        """Raise ``LayoutError`` with all problems, row after row of a sheet, if there are any."""
        if not self.found:
            return
        sheets = list(dict.fromkeys(place.sheet for place in self._places.values()))
        ordered = sorted(self._places.items(), key=lambda item: (sheets.index(item[1].sheet), *_order(item[1])))
        raise LayoutError(tuple(problem for problem, _ in ordered))

    def __post_init__(self) -> None:
        self._places: dict[Problem, Place] = {}


class ProblemsOfOthers(SheetProblems):
    """Problems of other sheets than one that is missing, which has been told."""

    def __init__(self, inner: SheetProblems, missing: str) -> None:
        super().__init__(inner.file)
        self.inner, self.missing = inner, missing

    def add(self, place: Place, text: str) -> None:
        """Record a problem of another sheet."""
        if place.sheet != self.missing:
            super().add(place, text)
            self.inner.add(place, text)


def _order(place: Place) -> tuple[int, int, str]:
    letters = place.column.partition(" ")[0]
    return place.row, len(letters), letters
