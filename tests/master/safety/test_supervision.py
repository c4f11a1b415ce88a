"""A command ends as it says, or reports that it has ended otherwise."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from master.safety.supervision import keep_interrupt

ROOT = Path(__file__).parents[3]
SCRIPT = """
import os, signal, sys, time
from pathlib import Path
from master.safety.supervision import phase, supervised, unfinished
def work():
{work}
sys.exit(supervised(work))
"""


def script(work):
    return SCRIPT.format(work=textwrap.indent(textwrap.dedent(work).strip(), "    "))


def go(work, *arguments, **options):
    command = [sys.executable, "-c", script(work), *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, **options)


@pytest.mark.parametrize(
    ("work", "code", "text"),
    [
        ("return 0", 0, ""),
        ("return 1", 1, ""),
        ("sys.exit(2)", 2, ""),
        ("os._exit(0)", 1, "error: the process ended itself with exit code 0 before it had finished"),
        ("os._exit(7)", 1, "error: the process ended itself with exit code 7 before it had finished"),
        ("raise MemoryError", 1, "error: there is not enough memory; end other programs"),
        ("os.abort()", 1, "error: the process was ended by signal SIGABRT (Aborted) before it had finished"),
        ("os.kill(os.getpid(), signal.SIGKILL)", 1, "error: the process was ended by signal SIGKILL (Killed)"),
        ("os.kill(os.getppid(), signal.SIGHUP); time.sleep(30)", 1, "error: interrupted"),
        ("import atexit; atexit.register(os.abort); return 0", 0, ""),  # too late to matter
    ],
)
def test_only_what_was_finished_counts(work, code, text):
    done = go(work)
    assert (done.returncode, done.stdout) == (code, "")
    assert done.stderr.startswith(text)
    assert done.stderr.count("\n") == (1 if text else 0)


@pytest.mark.parametrize(("key", "status"), [("mine", "failed"), ("another", "running")])
def test_what_was_not_finished_is_marked(tmp_path, key, status):
    file = tmp_path / "summary.json"
    file.write_text(json.dumps({"status": "running", "run": key, "more": 1}))
    done = go('with unfinished(Path(sys.argv[1]), "mine"):\n    os._exit(0)', file)
    found = json.loads(file.read_text())
    assert (found["status"], found["more"]) == (status, 1)
    assert ("exit code 0" in found.get("reason", "")) == (f"is in {tmp_path}, marked failed" in done.stderr)
    assert [path.name for path in tmp_path.iterdir()] == ["summary.json"]


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere it may go on until it notices")
def test_output_goes_where_it_would_and_the_working_process_dies_with_its_parent(tmp_path):
    work = """
    print(os.getpid(), flush=True)
    while True:
        time.sleep(0.1)
    """
    process = subprocess.Popen([sys.executable, "-c", script(work)], cwd=ROOT, stdout=subprocess.PIPE, text=True)
    worker = int(process.stdout.readline())
    assert worker != process.pid
    process.kill()
    process.communicate(timeout=60)  # until nobody holds its output
    deadline = time.monotonic() + 10.0
    while Path(f"/proc/{worker}").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not Path(f"/proc/{worker}").exists()


def test_a_signal_that_comes_before_anybody_waits_is_heeded():
    """The child has begun to work before its parent has got to waiting for it."""
    slow = (
        "import master.safety.supervision as s\nwake = s._wake_up\ns._wake_up = lambda h: (time.sleep(1), wake(h))[1]\n"
    )
    code = script("os.kill(os.getppid(), signal.SIGTERM); time.sleep(30)").replace("def work", slow + "def work")
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (1, "error: interrupted\n")


def test_a_program_that_is_to_outlive_its_terminal_does(tmp_path):
    work = "os.kill(os.getppid(), signal.SIGHUP); time.sleep(0.5); return 0"
    assert go(work, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN)).returncode == 0


def test_nothing_that_is_only_in_unix_is_needed_to_import_the_master():
    code = """
    import os, signal, sys
    import filelock, subprocess, socket, selectors  # whose own business it is
    try:
        import distributed
    except ImportError:
        pass
    for name in ("fcntl", "resource", "termios", "pwd", "grp"):
        sys.modules[name] = None
    for module, names in ((os, ("fork", "killpg", "setpgid", "getppid")), (signal, ("SIGHUP", "SIGTSTP", "SIGCHLD"))):
        for name in names:
            delattr(module, name)
    import importlib, pkgutil, master
    for found in pkgutil.walk_packages(master.__path__, "master."):
        if not found.name.endswith("__main__"):
            importlib.import_module(found.name)
    from master.safety.supervision import supervised
    sys.exit(supervised(lambda: 3))
    """
    command = [sys.executable, "-c", textwrap.dedent(code)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (3, "")


def test_what_the_caller_has_closed_takes_no_output_of_others(tmp_path):
    """Else the first table that is opened is descriptor 1, and native code prints into it."""
    table = tmp_path / "table.csv"
    work = """
        table = open(sys.argv[1], "w")
        os.write(1, b"printed by an FMU")
        print("and by us")
        table.write("row")
        return 0
    """
    command = [sys.executable, "-c", script(work), str(table)]
    done = subprocess.run(["sh", "-c", 'exec "$@" >&- 2>&-', "sh", *command], cwd=ROOT, timeout=60)
    assert (done.returncode, table.read_text()) == (0, "row")


def test_an_interrupt_that_python_drops_is_delivered_again():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        keep_interrupt(SimpleNamespace(exc_type=KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            time.sleep(5.0)
    finally:
        signal.signal(signal.SIGINT, before)
