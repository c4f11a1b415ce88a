"""Commands as processes of their own that need not import everything again: forks of a server that has.

``start("master", "run", ...)`` does what ``python -m master run ...`` does in a new process, and what it returns is
used as a `subprocess.Popen`: signals, pipes, exit codes and the process's children are those of an ordinary process.
What a new interpreter does before the first line of the package (imports, search path) is not part of it: tests of that
start one. Libraries of linear algebra use one thread, as in ``.ci/run``.
"""

from __future__ import annotations

import array
import atexit
import contextlib
import functools
import gc
import importlib
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

ROOT: Final = Path(__file__).parents[1]
#: What commands import, by the package that they begin in.
COMMON: Final = ("numpy", "scipy.sparse.linalg", "fmpy.fmi2", "lxml.etree", "pydantic", "rich.progress")
PRELOADED: Final[Mapping[str, tuple[str, ...]]] = {
    "master": (*COMMON, "master.commands.run_command", "master.commands.report_commands"),
    "sweep": (*COMMON, "distributed.cli.utils", "master.commands.sweep_command", "master.batch.sweep.dask_engine"),
}
_LARGEST: Final = 1 << 20


def start(
    *command: str | Path, cwd: Path = ROOT, env: Mapping[str, str] | None = None, crew: str = "master", **pipes: Any
) -> Process | subprocess.Popen[str]:
    """Begin ``python -m`` and the words of a command in a process of its own.

    Parameters
    ----------
    *command
        Name of the module and its arguments.
    cwd, env
        As for `subprocess.Popen`.
    crew : str
        Which modules it finds imported, of `PRELOADED`.
    **pipes
        ``stdout`` and ``stderr`` as for `subprocess.Popen`, text; what is not mentioned is thrown away. With anything
        else (``preexec_fn``) the command is a whole new Python.
    """
    words, environment = [str(word) for word in command], dict(os.environ if env is None else env)
    if not hasattr(os, "pidfd_open") or pipes.keys() - {"stdout", "stderr"}:  # what a fork of the server cannot take
        whole = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, **pipes}
        return subprocess.Popen([sys.executable, "-m", *words], cwd=cwd, env=environment, text=True, **whole)
    return _server(crew).start({"words": words, "cwd": str(cwd), "environment": environment}, pipes)


def run(*command: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
    """Carry out a command as `start` does and return what it said and its exit code."""
    process = start(*command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)
    out, error = process.communicate(timeout=600)
    return subprocess.CompletedProcess(command, process.returncode, out, error)


class Process:
    """A process that the server has forked, as far as tests use a `subprocess.Popen`."""

    def __init__(self, pid: int, ending: int, streams: Mapping[str, int]) -> None:
        self.pid, self.returncode, self._ending = pid, None, ending
        self.stdout, self.stderr = (
            os.fdopen(streams[name], encoding="utf-8") if name in streams else None for name in ("stdout", "stderr")
        )

    def poll(self) -> int | None:
        """Return the exit code, None while it runs."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            return self.wait(0.0)
        return None

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end and return the exit code, the number of a signal less than zero."""
        if self.returncode is None:
            if not select.select([self._ending], [], [], timeout)[0]:
                raise subprocess.TimeoutExpired(f"process {self.pid}", timeout or 0.0)
            self.returncode = array.array("i", os.read(self._ending, 4))[0]
            os.close(self._ending)
        return self.returncode

    def communicate(self, timeout: float | None = None) -> tuple[str, str]:
        """Read both streams to their ends, wait, and return what was read."""
        streams = {stream.fileno(): stream for stream in (self.stdout, self.stderr) if stream and not stream.closed}
        said = dict.fromkeys(streams, b"")
        deadline = None if timeout is None else time.monotonic() + timeout
        while streams:
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            ready, _, _ = select.select(list(streams), [], [], left)
            if not ready:
                raise subprocess.TimeoutExpired(f"process {self.pid}", timeout or 0.0)
            for descriptor in ready:
                data = os.read(descriptor, 1 << 16)
                said[descriptor] += data
                if not data:
                    del streams[descriptor]
        texts = []
        for stream in (self.stdout, self.stderr):
            texts.append(said.get(stream.fileno(), b"").decode() if stream and not stream.closed else "")
            if stream:
                stream.close()
        self.wait(None if deadline is None else max(0.0, deadline - time.monotonic()))
        return texts[0], texts[1]

    def send_signal(self, number: int) -> None:
        """Send a signal, unless it has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """End it at once."""
        self.send_signal(signal.SIGKILL)

    def terminate(self) -> None:
        """Ask it to end."""
        self.send_signal(signal.SIGTERM)


class _Server:
    """The process that is forked, seen from the tests."""

    def __init__(self, crew: str) -> None:
        self._connection, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        command = [sys.executable, __file__, str(theirs.fileno()), crew]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
        with theirs:
            self._process = subprocess.Popen(command, pass_fds=[theirs.fileno()], env=environment, cwd=ROOT)
        atexit.register(self.end)

    def start(self, request: Mapping[str, Any], pipes: Mapping[str, Any]) -> Process:
        ending, their_ending = os.pipe()
        handed, ours = [their_ending], {}
        for name in ("stdout", "stderr"):
            if pipes.get(name) == subprocess.PIPE:
                ours[name], theirs = os.pipe()
            else:
                theirs = os.open(os.devnull, os.O_WRONLY)
            handed.append(theirs)
        socket.send_fds(self._connection, [json.dumps(request).encode()], handed)
        for descriptor in handed:
            os.close(descriptor)
        return Process(int(self._connection.recv(64)), ending, ours)

    def end(self) -> None:
        self._connection.close()  # and so it ends
        self._process.wait(10.0)


@functools.cache
def _server(crew: str) -> _Server:
    return _Server(crew)


def _serve(connection: socket.socket) -> dict[str, Any]:
    """Fork for every request; return it in the child. The server itself ends when its tests do."""
    gc.freeze()  # forks search none of it for garbage, and so copy none of it
    running: dict[int, tuple[int, int]] = {}  # descriptor of a process -> its id, and whom to tell its end
    while True:
        for descriptor in select.select([connection, *running], [], [])[0]:
            if descriptor is not connection:
                pid, ending = running.pop(descriptor)
                os.write(ending, array.array("i", [os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])]).tobytes())
                os.close(ending)
                os.close(descriptor)
                continue
            data, handed, _, _ = socket.recv_fds(connection, _LARGEST, 3)
            if not data:
                os._exit(0)
            pid = os.fork()
            if pid == 0:
                connection.close()
                for stream, theirs in zip((1, 2), handed[1:], strict=True):
                    os.dup2(theirs, stream)
                for descriptor in (*handed, *running, *(end for _, end in running.values())):
                    os.close(descriptor)
                return dict(json.loads(data))
            for theirs in handed[1:]:
                os.close(theirs)
            running[os.pidfd_open(pid)] = pid, handed[0]
            connection.send(str(pid).encode())


def _carry_out(request: dict[str, Any]) -> None:
    """Do what ``python -m`` does with these words."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["environment"])
    module, *arguments = request["words"]
    sys.argv = [module, *arguments]
    sys.path[0] = os.getcwd()  # noqa: PTH109 (as Python has it)
    runpy.run_module(module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    for _name in PRELOADED[sys.argv[2]]:
        importlib.import_module(_name)
    _carry_out(_serve(socket.socket(fileno=int(sys.argv[1]))))
