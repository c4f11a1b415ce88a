"""A command under supervision: whatever ends it before it has finished is reported, and counts as a failure.

An FMU in the master's own process is native code: it may crash, call ``exit(0)``, or never return. So the command works
in a child process, and its parent, which loads nothing, waits: it passes signals on, ends a child that ignores
them, and turns an end that the child had not announced into exit code 1 and a sentence, with the results so far marked.
Without ``fork`` (Windows), and for those who call the package from their own program, there is no supervision.
"""

from __future__ import annotations

import gc
import io
import json
import os
import select
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from master.safety.interruption import end_signals, raise_on_signals

#: prctl(2): the signal that a process gets when its parent ends.
_PR_SET_PDEATHSIG: Final = 1
#: Phases in which native code may keep the child from reacting to a signal, and how long it may [s].
_PATIENCE: Final = {"loading": 2.0, "computing": 5.0, "stepping": 10.0, "closing": 10.0}
#: Seconds within which a child that has finished has to be gone.
_ENDING_SECONDS: Final = 10.0
#: Seconds after which an interrupt that was dropped is delivered again.
_AGAIN_SECONDS: Final = 0.01

#: When the command's process looks for cyclic garbage (`gc.set_threshold`): what it imports makes none, and a run next
#: to none, so that looking hundreds of times, as is usual, finds nothing and takes as long as ten simulated seconds.
_COLLECTIONS: Final = (20_000, 50, 100)

#: Where the child reports to its parent what it does; None without supervision.
_reports: int | None = None


def supervised(work: Callable[[], int]) -> int:
    """Do work in a child process; return the exit code, 1 if the child ends without having finished.

    Returns in both processes: the caller is to end with the code that it gets.
    """
    global _reports
    _fill_standard_streams()
    if not hasattr(os, "fork"):
        return work()
    reports, _reports = os.pipe()
    parent = os.getpid()
    # No signal may arrive before a handler is there.
    signal.pthread_sigmask(signal.SIG_BLOCK, end_signals())
    child = os.fork()
    if child == 0:
        os.close(reports)
        os.setpgid(0, 0)  # the terminal's Ctrl-C arrives through the parent, and so only once
        die_with(parent)
        gc.set_threshold(*_COLLECTIONS)
        return _worked(work)
    os.close(_reports)
    return _Supervisor(child, reports).wait()


def _fill_standard_streams() -> None:
    """Open what the caller has closed (``>&-``): else the next file opened would receive what FMUs print."""
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(descriptor, True)
    os.close(descriptor)
    for descriptor, name in ((1, "stdout"), (2, "stderr")):
        if getattr(sys, name) is None:
            setattr(sys, name, io.TextIOWrapper(io.FileIO(descriptor, "w", closefd=False), encoding="utf-8"))


def die_with(parent: int) -> None:
    """End this process with its parent, even in an endless loop; on other systems than Linux only if that has ended."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(0)


@contextmanager
def phase(name: str) -> Iterator[None]:
    """Tell the supervisor that native code is about to be called: in which of the phases that it has patience for."""
    _tell(phase=name)
    try:
        yield
    finally:
        _tell(phase="")


@contextmanager
def unfinished(file: Path, key: str = "") -> Iterator[None]:
    """Tell the supervisor which JSON file, and of which run, is to be marked if this process ends in between."""
    path = str(file.resolve())
    _tell(begun=path, key=key)
    try:
        yield
    finally:
        _tell(ended=path)


def _tell(**report: Any) -> None:
    if _reports is not None:
        with suppress(OSError):  # the parent is gone
            os.write(_reports, (json.dumps(report) + "\n").encode())


def _worked(work: Callable[[], int]) -> int:
    code = 1
    try:
        raise_on_signals()
        sys.unraisablehook = keep_interrupt
        signal.pthread_sigmask(signal.SIG_UNBLOCK, end_signals())
        code = work()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
    except KeyboardInterrupt:
        print("error: interrupted", file=sys.stderr)
    except MemoryError:
        print("error: there is not enough memory; end other programs, or raise the limit (ulimit -v)", file=sys.stderr)
    except BrokenPipeError:  # the reader of the output has closed it, and knows
        pass
    except BaseException as error:
        if _is_interrupt(error):
            print("error: interrupted", file=sys.stderr)
        else:
            traceback.print_exc()
    with suppress(OSError, ValueError):
        sys.stdout.flush()
    _tell(finished=code)
    # Python looks through all objects several times as it ends, a sixth of the time of a run; the system frees them.
    gc.freeze()
    return code


def keep_interrupt(dropped: Any) -> None:
    """Deliver an interrupt again that came where Python drops what is raised, as in a callback during an import."""
    if dropped.exc_type is KeyboardInterrupt:
        waiting = threading.main_thread().ident or 0
        threading.Timer(_AGAIN_SECONDS, signal.pthread_kill, (waiting, signal.SIGINT)).start()
    else:
        sys.__unraisablehook__(dropped)


def _is_interrupt(error: BaseException) -> bool:
    """Whether an error is what was made of an interrupt on the way, as by Python 3.11 where a class is being made."""
    cause = error.__cause__
    return isinstance(error, KeyboardInterrupt) or (cause is not None and _is_interrupt(cause))


class _Supervisor:
    """The parent: waits for the child, and reports what has become of it.

    Parameters
    ----------
    child : int
        Its process.
    reports : int
        Where it reports what it does.
    """

    def __init__(self, child: int, reports: int) -> None:
        self._child = child
        self._rest = b""
        self._phase = ""
        self._unfinished: dict[str, str] = {}
        self._code: int | None = None
        self._deadline: float | None = None
        self._signals = 0
        self._is_ended_by_us = False
        self._wake = _wake_up(self._pass_on)
        self._sources = [self._wake, reports]

    def wait(self) -> int:
        """Wait for the child's end and return the exit code."""
        while (status := self._status()) is None:
            self._listen(self._patience())
        while len(self._sources) > 1 and select.select(self._sources[1:], [], [], 0.0)[0]:
            self._listen(0.0)
        if self._code is not None:
            return self._code
        print(f"error: {self._what_happened(status)}", file=sys.stderr)
        return 1

    def _status(self) -> int | None:
        done, status = os.waitpid(self._child, os.WNOHANG)
        return os.waitstatus_to_exitcode(status) if done else None

    def _patience(self) -> float | None:
        if self._deadline is None:
            return None
        left = self._deadline - time.monotonic()
        if left <= 0.0:
            self._end()
            return 0.1
        return left

    def _end(self) -> None:
        self._is_ended_by_us = True
        self._send(signal.SIGKILL)

    def _send(self, number: int) -> None:
        with suppress(ProcessLookupError):
            os.kill(self._child, number)

    def _listen(self, seconds: float | None) -> None:
        """Wait for a signal or a report, and process what has arrived."""
        ready, _, _ = select.select(self._sources, [], [], seconds)
        for source in ready:
            piece = os.read(source, 65536)
            if source == self._wake:
                continue
            if not piece:
                self._sources.remove(source)
            *lines, self._rest = (self._rest + piece).split(b"\n")
            for line in lines:
                self._take(json.loads(line))

    def _take(self, report: dict[str, Any]) -> None:
        if "phase" in report:
            self._phase = report["phase"]
            self._hurry()
        elif "begun" in report:
            self._unfinished[report["begun"]] = report["key"]
        elif "ended" in report:
            self._unfinished.pop(report["ended"], None)
        elif "finished" in report:
            self._code = report["finished"]
            self._deadline = time.monotonic() + _ENDING_SECONDS

    def _hurry(self) -> None:
        """Set how long the child may take, if it was asked to end."""
        if self._code is None:
            patience = _PATIENCE.get(self._phase) if self._signals else None
            self._deadline = None if patience is None else time.monotonic() + patience

    def _pass_on(self, number: int, _frame: object) -> None:
        if number in end_signals():
            self._signals += 1
            if self._signals > 1:
                self._end()
            else:
                self._send(number)
                self._hurry()
        elif number == signal.SIGTSTP:  # the terminal stops only the foreground group, which the child is not in
            self._send(signal.SIGSTOP)
            os.kill(os.getpid(), signal.SIGSTOP)
            self._send(signal.SIGCONT)

    def _what_happened(self, status: int) -> str:
        marked = "interrupted" if self._signals else "failed"
        if self._is_ended_by_us:
            how = "interrupted. The process did not stop by itself and was ended"
        elif status < 0:
            how = f"the process was ended by signal {signal_text(-status)} before it had finished"
        else:
            how = f"the process ended itself with exit code {status} before it had finished"
        if not self._is_ended_by_us and -status != signal.SIGKILL:
            how += ", as happens when an FMU crashes or exits; --isolate shows which one"
        folders = [str(Path(p).parent) for p in self._unfinished if _mark(Path(p), self._unfinished[p], marked, how)]
        return how + (f". What was computed is in {', '.join(folders)}, marked {marked}" if folders else "")


def _wake_up(handle: Callable[[int, object], None]) -> int:
    """Handle signals, and return a descriptor that becomes readable after each."""
    ours, theirs = os.pipe()
    os.set_blocking(theirs, False)
    signal.set_wakeup_fd(theirs, warn_on_full_buffer=False)
    for number in (*end_signals(), signal.SIGTSTP, signal.SIGCHLD):
        signal.signal(number, handle)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, end_signals())
    return ours


def _mark(path: Path, key: str, status: str, reason: str) -> bool:
    """Mark the JSON file of a run that has ended; return whether it was this run's and still open."""
    from master.errors import MasterError
    from master.safety.folder_lock import claimed
    from master.safety.safe_files import write_atomically

    try:
        with claimed(path.parent):
            data = json.loads(path.read_text(encoding="utf-8"))
            if data.get("status") != "running" or data.get("run", "") != key:
                return False
            text = json.dumps({**data, "status": status, "reason": reason}, indent=1, ensure_ascii=False)
            write_atomically(path, (text + "\n").encode())
    except (OSError, ValueError, AttributeError, MasterError):
        return False
    return True


def signal_text(number: int) -> str:
    """Return a signal's name and what it means.

    Examples
    --------
    >>> signal_text(11)
    'SIGSEGV (Segmentation fault)'
    """
    try:
        return f"{signal.Signals(number).name} ({signal.strsignal(number)})"
    except ValueError:
        return str(number)
