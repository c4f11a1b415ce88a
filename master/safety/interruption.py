"""Signals that end a run: the first is a wish, the second an order.

A wish is heeded after the current step; where nothing would be lost it is heeded at once: while FMUs are loaded or
initialised, and while the master waits for another process. What does not return at all, in native code, is ended from
outside (`master.safety.supervision`).
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

#: Those that end a run: the terminal's end is an order as good as its Ctrl-C.
_NAMES: Final = ("SIGINT", "SIGTERM", "SIGHUP")


class _State:
    """What is wished for in this process, and whether it may be heeded at once."""

    def __init__(self) -> None:
        self.is_wished = False
        self.at_once = 0

    def handle(self, _number: int, _frame: FrameType | None) -> None:
        is_second, self.is_wished = self.is_wished, True
        if is_second or self.at_once:
            raise KeyboardInterrupt


_state: Final = _State()


def end_signals() -> tuple[signal.Signals, ...]:
    """Return the signals that end a run; not the terminal's end if the program was started to outlive it (nohup)."""
    known = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]
    return tuple(s for s in known if s == signal.SIGINT or signal.getsignal(s) != signal.SIG_IGN)


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Turn the first signal into a wish to stop; the second raises KeyboardInterrupt. Gives the wish."""
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    _state.is_wished, _state.at_once = False, 0
    before = {number: signal.signal(number, _state.handle) for number in end_signals()}
    try:
        yield lambda: _state.is_wished
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def heeded_at_once() -> Iterator[None]:
    """Let the first signal raise KeyboardInterrupt too, within `interruptible`."""
    _state.at_once += 1
    try:
        yield
    finally:
        _state.at_once -= 1


def is_wished() -> bool:
    """Whether the run that goes on is to stop."""
    return _state.is_wished


def raise_on_signals() -> None:
    """Let every signal that ends a run raise KeyboardInterrupt from now on, as Ctrl-C does."""
    for number in end_signals():
        signal.signal(number, signal.default_int_handler)
