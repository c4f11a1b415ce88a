"""How long initialization and stepping take by the wall clock."""

from __future__ import annotations

import time
from dataclasses import dataclass

from master.coupling.network import Network


@dataclass(frozen=True)
class Timing:
    """Wall time of a run [s]: initialization, and stepping with recording."""

    initialisation: float
    stepping: float


class Stopwatch:
    """Observer that measures the wall time of initialization and of stepping."""

    def __init__(self) -> None:
        self._created = time.perf_counter()
        self._began: float | None = None
        self._ended: float | None = None

    def begin(self, start: float, network: Network) -> None:
        """Stepping begins."""
        self._began = time.perf_counter()

    def observe(self, index: int, end: float, network: Network) -> None:
        """Nothing to measure."""

    def finish(self) -> None:
        """Stepping has ended."""
        self._ended = time.perf_counter()

    @property
    def timing(self) -> Timing:
        """What was measured."""
        ended = self._ended if self._ended is not None else time.perf_counter()
        began = self._began if self._began is not None else ended
        return Timing(began - self._created, ended - began)
