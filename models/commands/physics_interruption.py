"""Ctrl-C that also ends a command whose native code does not return.

Python acts on a signal between two of its instructions. A factorisation that spins, under a memory limit say, never
comes back to one. The handler in C, however, writes the signal's number into a pipe at once (`signal.set_wakeup_fd`); a
small process at its other end gives the command some time, and then ends it.

The master's commands have `master.safety.supervision` for this. It stands twice because neither package may import the
other, and the two differ: the master works in the child, whose results the parent marks; here the child only watches.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
from typing import Final

#: Time that a command has to end by itself after the first signal [s]; the second one ends it at once.
GRACE: Final = 5.0
_SENTENCE: Final = b"error: interrupted in a computation that does not return; the command was ended\n"


def watch_interruptions(grace: float = GRACE) -> None:
    """Start the process that ends this one ``grace`` seconds after an interruption, unless it has ended by then.

    It does nothing where processes cannot be forked: there a second Ctrl-C does no more than the first.
    """
    if not hasattr(os, "fork"):
        return
    command = os.getpid()
    reading, writing = os.pipe()
    if os.fork() == 0:
        os.close(writing)
        try:
            _watch(reading, command, grace)
        finally:
            os._exit(0)
    os.close(reading)
    os.set_blocking(writing, False)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)


def _watch(reading: int, command: int, grace: float) -> None:
    """Wait for the command's end, which closes the pipe, or for a signal in it."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    for stream in (0, 1):  # a reader of what the command prints waits for nobody else
        with contextlib.suppress(OSError):
            os.close(stream)
    if not os.read(reading, 1):
        return
    ready, _, _ = select.select([reading], [], [], grace)
    if ready and not os.read(reading, 1):
        return
    with contextlib.suppress(OSError):
        os.kill(command, signal.SIGKILL)
        os.write(2, _SENTENCE)
