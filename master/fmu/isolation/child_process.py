"""The process of an isolated FMU: started, listened to, ended."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from threading import Thread
from typing import IO, Final

from master.errors import one_line
from master.fmu.isolation.channel import Channel
from master.safety.supervision import signal_text

#: Seconds within which a process has to be gone after its connection has ended.
_ENDING_SECONDS: Final = 5.0
#: Seconds that a process has to end by itself once it was asked to, or its connection was closed.
_GRACE_SECONDS: Final = 2.0
#: Environment variable that says whose child a process is, whatever it has become since.
_MARK: Final = "OPENPANTO_ISOLATED"
#: What is kept of what an FMU prints: this many pieces of at most so many bytes.
_PIECES: Final = 4
_PIECE: Final = 4096


#: How a line begins that a child prints for the user.
NOTE: Final = "note: "


class Process:
    """A child process with a connection to it, its own folder for temporary files, and a thread for what it prints.

    Parameters
    ----------
    module : str
        What it runs, with the connection's file descriptor and the number of this process as arguments.
    tell : callable
        Shows the user a line that it prints after `NOTE`, as soon as that is printed.

    Attributes
    ----------
    channel : Channel
        The master's end of the connection.
    """

    def __init__(self, module: str = "master.fmu.isolation", tell: Callable[[str], None] = lambda _: None) -> None:
        self._tell = tell
        self._folder = tempfile.mkdtemp(prefix="isolated-")
        ours, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                # -P: nothing is imported from the working folder.
                [sys.executable, "-P", "-m", module, str(theirs.fileno()), str(os.getpid())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                pass_fds=[theirs.fileno()],
                env=self._environment(),
                start_new_session=True,  # the terminal's Ctrl-C is not for it
            )
        self.channel = Channel(ours)
        self._said: deque[bytes] = deque(maxlen=_PIECES)
        # What an FMU prints has to be read, or it would block when the pipe is full.
        self._listener = Thread(target=self._listen, args=(self._process.stdout,), daemon=True)
        self._listener.start()
        self._reaper = Thread(target=self._reap, daemon=True)
        self._reaper.start()

    def how_it_ended(self) -> str:
        """Wait for the process and return how it ended, in words, with the last line that it printed."""
        try:
            code = self._process.wait(_ENDING_SECONDS)
        except subprocess.TimeoutExpired:
            self.end(grace=0.0)
            return "closed its connection" + self._last_words()
        self._listener.join(_ENDING_SECONDS)
        if code < 0:
            return f"was ended by signal {signal_text(-code)}" + self._last_words()
        return f"ended itself with exit code {code}" + self._last_words()

    def end(self, grace: float = _GRACE_SECONDS) -> None:
        """End the process, if it does not end by itself within ``grace`` seconds, and remove its files."""
        self.channel.close()
        try:
            self._process.wait(grace)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reaper.join()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _environment(self) -> dict[str, str]:
        paths = [path or str(Path.cwd()) for path in sys.path]
        return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "TMPDIR": self._folder, _MARK: self._folder}

    def _reap(self) -> None:
        """Wait for the process to end and end what it left behind, which may keep the connection and the pipe open."""
        self._process.wait()
        _end_group(self._process.pid)
        for left in marked_processes(self._folder):
            with suppress(ProcessLookupError, PermissionError):
                os.kill(left, signal.SIGKILL)
        self.channel.shut()

    def _listen(self, pipe: IO[bytes]) -> None:
        with pipe:
            while piece := os.read(pipe.fileno(), _PIECE):
                self._said.append(piece)
                for line in piece.splitlines():
                    if line.startswith(NOTE.encode()):
                        self._tell(line.decode("utf-8", "replace").removeprefix(NOTE))

    def _last_words(self) -> str:
        lines = b"".join(self._said).decode("utf-8", "replace").split("\n")
        spoken = [line.strip() for line in lines if line.strip()]
        return f"; the last that it printed was: {one_line(spoken[-1])}" if spoken else ""


def _end_group(group: int) -> None:
    """End the processes of a session whose leader is gone; the number stays its own while there are any."""
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(group, signal.SIGKILL)


def marked_processes(folder: str) -> Iterator[int]:
    """Yield the processes that were started with a folder's mark, also in other sessions (on Linux)."""
    mark = f"{_MARK}={folder}\0".encode()
    for path in Path("/proc").glob("[0-9]*/environ"):
        with suppress(OSError):
            if mark in path.read_bytes():
                yield int(path.parent.name)
