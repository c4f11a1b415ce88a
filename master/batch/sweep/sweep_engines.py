"""What makes the runs of a sweep: the protocol, and the engine that makes them here, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Any, Protocol

from master.batch.sweep.sweep_run import RunPlace, SweepResult, carry_out
from master.batch.sweep.swept_systems import SweepRun
from master.system.components import System

#: Makes runs and yields their results as they come, in any order.
MakeRuns = Callable[[Sequence[SweepRun]], Iterator[SweepResult]]


class SweepEngine(Protocol):
    """Makes the runs of a sweep."""

    @property
    def width(self) -> int:
        """How many runs it makes at a time."""

    @property
    def is_rehearsed(self) -> bool:
        """Whether a few steps of FMUs tell how long its runs take."""

    @property
    def checks(self) -> Sequence[Mapping[str, Any]]:
        """Runs that it has made in another way as well, and by how much the two differ."""

    def opened(self, base: System, place: RunPlace) -> AbstractContextManager[MakeRuns]:
        """Get ready for the runs of a scenario, and yield what makes them.

        Raises
        ------
        MasterError
            If it cannot, before any run: nobody answers, or the workers differ from here.
        """


class HereEngine:
    """Makes runs in this process."""

    width = 1
    is_rehearsed = True
    checks: Sequence[Mapping[str, Any]] = ()

    @contextmanager
    def opened(self, base: System, place: RunPlace) -> Iterator[MakeRuns]:
        """Yield what makes runs, one after the other."""
        yield lambda runs: (carry_out(base, wanted, place) for wanted in runs)
