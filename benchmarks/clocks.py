"""Clocks around parts of a program, for shares of its time."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from types import ModuleType
from unittest import mock

#: Part -> class or module, and its methods or functions that make up the part.
Parts = Mapping[str, tuple[type | ModuleType, Sequence[str]]]


class Clocks:
    """Time spent in parts of a program, each without those inside it.

    Attributes
    ----------
    spent : dict
        Part -> time [s].
    """

    def __init__(self) -> None:
        self.spent: dict[str, float] = defaultdict(float)
        self._inside: list[float] = []

    def around(self, part: str, method: Callable) -> Callable:
        """Return a method that is clocked."""

        def clocked(*arguments, **named):
            self._inside.append(0.0)
            begin = time.process_time()
            try:
                return method(*arguments, **named)
            finally:
                whole = time.process_time() - begin
                self.spent[part] += whole - self._inside.pop()
                if self._inside:
                    self._inside[-1] += whole

        return clocked

    @contextmanager
    def running(self, parts: Parts) -> Iterator[None]:
        """Clock parts of what is done herein."""
        with ExitStack() as stack:
            for part, (owner, names) in parts.items():
                for name in names:
                    stack.enter_context(mock.patch.object(owner, name, self.around(part, getattr(owner, name))))
            yield
