"""The process that makes the runs of a sweep one after the other: ``python -m master.batch.sweep.run_child``."""

from __future__ import annotations

import os
import pickle
import signal
import socket
import sys
from contextlib import suppress
from typing import Any, Final

from master.batch.sweep.sweep_run import RunPlace, carry_out
from master.batch.sweep.swept_systems import SweepRun
from master.fmu.isolation.channel import Channel, EndedError
from master.fmu.isolation.child_process import NOTE
from master.report.log_notes import show_log
from master.safety.supervision import die_with
from master.system.components import System

#: Longest scenario or run that is accepted [bytes].
_LONGEST: Final = 1 << 30


def main() -> None:
    """Serve the connection whose file descriptor is the first argument; the second is the command's process."""
    die_with(int(sys.argv[2]))
    # Ctrl-C is meant for the command, which ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    show_log(lambda text: print(f"{NOTE}{text}", flush=True))
    with suppress(EndedError):
        serve(Channel(socket.socket(fileno=int(sys.argv[1]))))
    # What FMUs have left behind, threads or handlers, must not keep the process.
    os._exit(0)


def serve(channel: Channel) -> None:
    """Receive a scenario and where its runs go, then make every run that is asked for.

    The other side is trusted, and what it sends is unpickled; what goes back is text, as FMUs are strangers here.
    """
    base, place = _received(channel, System, RunPlace)
    while True:
        (wanted,) = _received(channel, SweepRun)
        channel.send(0, 0, carry_out(base, wanted, place).line())


def _received(channel: Channel, *kinds: type) -> tuple[Any, ...]:
    _, _, length = channel.receive(_LONGEST)
    found = pickle.loads(channel.rest(length))
    return found if len(kinds) > 1 else (found,)


if __name__ == "__main__":
    main()
