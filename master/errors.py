"""What can go wrong, in words for the user: what, where, which value, what to do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


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
        where = f"{self.file}:{self.line}" if self.line else self.file
        return f"{where}: {self.text} [{self.rule}]"


class MasterError(Exception):
    """A failure that is told to the user as one message, never as a traceback."""


class ScenarioError(MasterError):
    """A scenario that cannot be run; carries every problem found."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(str(p) for p in self.problems))


class SlaveError(MasterError):
    """An FMU that failed; the message carries the FMU's own words."""


class RunError(MasterError):
    """A run that stopped before its end; what was computed is on disk."""


class InterruptedRunError(RunError):
    """A run that the user stopped."""


class UsageError(MasterError):
    """A wrong command line."""
