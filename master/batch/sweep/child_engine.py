"""The runs of a sweep in one process beside the command: an FMU that crashes costs its run, not the sweep."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import Any, Final

from master.batch.sweep.sweep_engines import MakeRuns
from master.batch.sweep.sweep_run import ATTEMPTS, DIED, RunPlace, SweepResult
from master.batch.sweep.swept_systems import SweepRun
from master.fmu.isolation.channel import EndedError, ProtocolError
from master.fmu.isolation.child_process import Process
from master.system.components import System

#: What the process runs.
_MODULE: Final = "master.batch.sweep.run_child"
#: Longest result that is accepted [bytes].
_LONGEST: Final = 1 << 26


def can_start_processes() -> bool:
    """Whether this system lets a process inherit a connection by its number."""
    return os.name == "posix"


@dataclass(frozen=True)
class ChildEngine:
    """Makes runs one after the other in a process that is replaced if it dies, and after so many runs.

    Attributes
    ----------
    tell : callable
        Shows the user that a process has died, or compiles kernels.
    renew_after : int
        Runs after which the process is replaced by a new one.
    """

    tell: Callable[[str], None] = lambda _: None
    renew_after: int = 200
    width: int = 1
    is_rehearsed: bool = True
    checks: Sequence[Mapping[str, Any]] = ()

    @contextmanager
    def opened(self, base: System, place: RunPlace) -> Iterator[MakeRuns]:
        """Yield what makes runs."""
        with closing(_Child(pickle.dumps((base, place)), self)) as child:
            yield lambda runs: map(child.made, runs)


class _Child:
    """The process, started when it is first needed."""

    def __init__(self, scenario: bytes, engine: ChildEngine) -> None:
        self._scenario, self._engine = scenario, engine
        self._process: Process | None = None
        self._count = 0

    def made(self, run: SweepRun) -> SweepResult:
        """Make a run, once more if the process dies of it."""
        for attempt in range(1, ATTEMPTS + 1):
            process = self._ready()
            try:
                process.channel.send(0, 0, pickle.dumps(run))
                _, _, length = process.channel.receive(_LONGEST)
                answer = process.channel.rest(length)
            except (EndedError, ProtocolError):
                said = process.how_it_ended()
                self.close()
                what = "has failed" if attempt == ATTEMPTS else "is made once more"
                self._engine.tell(f"the process of run {run.number} {said}; the run {what}")
                continue
            self._count += 1
            if (result := SweepResult.of_line(answer)) is not None:
                return result
        return SweepResult(run.key, reason=DIED)

    def _ready(self) -> Process:
        """Return the process, a new one if there is none or the old one has made its runs."""
        if self._count >= self._engine.renew_after:
            self.close()
        if self._process is None:
            self._process, self._count = Process(_MODULE, self._engine.tell), 0
            self._process.channel.limit(None)
            self._process.channel.send(0, 0, self._scenario)
        return self._process

    def close(self) -> None:
        """End the process, whatever it is doing."""
        if self._process is not None:
            self._process.end(grace=0.0)
            self._process = None
