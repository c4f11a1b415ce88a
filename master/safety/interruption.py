"""Signals that end a run: the first is a request, the second an order.

A request takes effect after the current step, or at once where nothing would be lost: while FMUs are loaded or
initialised, and while the master waits for another process. Native code that never returns is ended from outside
(`master.safety.supervision`).
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

#: Those that end a run: closing the terminal counts as much as its Ctrl-C.
_NAMES: Final = ("SIGINT", "SIGTERM", "SIGHUP")


class _State:
    """Whether a stop is requested in this process, and whether it may take effect at once."""

    def __init__(self) -> None:
        self.is_stop_requested = False
        self.at_once = 0

    def handle(self, _number: int, _frame: FrameType | None) -> None:
        is_second, self.is_stop_requested = self.is_stop_requested, True
        if is_second or self.at_once:
            raise KeyboardInterrupt


_state: Final = _State()


def end_signals() -> tuple[signal.Signals, ...]:
    """Return the signals that end a run; without that of the terminal if the program shall outlive it (nohup)."""
    known = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]
    return tuple(s for s in known if s == signal.SIGINT or signal.getsignal(s) != signal.SIG_IGN)


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Turn the first signal into a request to stop, which is yielded; let the second raise KeyboardInterrupt."""
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    _state.is_stop_requested, _state.at_once = False, 0
    before = {number: signal.signal(number, _state.handle) for number in end_signals()}
    try:
        yield lambda: _state.is_stop_requested
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def interruptible_at_once() -> Iterator[None]:
    """Let the first signal raise KeyboardInterrupt too, within `interruptible`."""
    _state.at_once += 1
    try:
        yield
    finally:
        _state.at_once -= 1


def is_stop_requested() -> bool:
    """Whether the present run is to stop."""
    return _state.is_stop_requested


def raise_on_signals() -> None:
    """Let every signal that ends a run raise KeyboardInterrupt from now on, as Ctrl-C does."""
    for number in end_signals():
        signal.signal(number, signal.default_int_handler)
