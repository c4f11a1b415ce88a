"""Every module can be imported where Unix, or Linux, is missing: Windows and macOS, as far as that can be had here."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]

#: Imports every module once, so that foreign packages are there; then takes away what the other system lacks, and
#: imports all of ours again.
SCRIPT = """
import importlib, os, pathlib, signal, sys

OURS = ("models", "fmus", "master", "openpanto")
LACKING = {
    "win32": (
        ("fcntl", "resource", "pwd", "grp", "termios", "tty", "pty", "syslog", "readline", "posix", "_posixsubprocess"),
        ("fork", "forkpty", "setsid", "setpgid", "getpgid", "killpg", "geteuid", "getuid", "getegid", "uname",
         "O_CLOEXEC", "O_NOFOLLOW", "WNOHANG", "mkfifo", "chown", "fchmod", "set_blocking", "sched_getaffinity",
         "sched_setaffinity", "nice", "wait3", "wait4", "register_at_fork", "sysconf", "RTLD_NOLOAD", "RTLD_GLOBAL",
         "RTLD_NOW", "RTLD_LAZY"),
        ("SIGHUP", "SIGKILL", "SIGQUIT", "SIGSTOP", "SIGCONT", "SIGTSTP", "SIGCHLD", "SIGALRM", "SIGPIPE", "SIGUSR1",
         "SIGBUS", "SIG_BLOCK", "SIG_UNBLOCK", "pthread_sigmask", "pthread_kill", "setitimer", "alarm", "sigwait"),
    ),
    "darwin": (
        (),
        ("sched_getaffinity", "sched_setaffinity", "memfd_create", "pidfd_open", "getrandom"),
        ("sigtimedwait",),
    ),
}

def names():
    for top in OURS:
        for path in sorted(pathlib.Path(top).rglob("*.py")):
            if "toy" not in path.parts:
                yield ".".join(path.with_suffix("").parts).removesuffix(".__init__")
        if pathlib.Path(top + ".py").is_file():
            yield top

def load():
    for name in names():
        if not name.endswith("__main__"):
            importlib.import_module(name)

def is_ours(name):
    return name.partition(".")[0] in OURS

load()
opened = []
sys.addaudithook(lambda event, args: opened.append(str(args[0])) if event == "open" else None)
for platform in sys.argv[1:]:
    for name in [n for n in sys.modules if is_ours(n)]:
        del sys.modules[name]
    modules, of_os, of_signal = LACKING[platform]
    sys.platform = platform
    sys.modules.update(dict.fromkeys(modules))
    for owner, attributes in ((os, of_os), (signal, of_signal)):
        for attribute in attributes:
            if hasattr(owner, attribute):
                delattr(owner, attribute)
    opened.clear()
    try:
        load()
    except Exception as error:
        print(platform, type(error).__name__, error)
        raise
    proc = sorted({p for p in opened if p.startswith("/proc")})
    print(platform, "modules", len([n for n in sys.modules if is_ours(n)]), "proc", proc)
"""


def test_every_module_can_be_imported(tmp_path):
    """On macOS, and then on Windows, which lacks what macOS lacks and more."""
    script = tmp_path / "script.py"
    script.write_text(f"import sys; sys.path.insert(0, {str(ROOT)!r})\n{SCRIPT}", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, script, "darwin", "win32"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    for platform in ("darwin", "win32"):
        found = re.search(rf"^{platform} modules (\d+) proc (.*)$", done.stdout, re.MULTILINE)
        assert int(found[1]) > 200, platform
        assert found[2] == "[]", platform


def test_the_check_finds_what_it_is_for(tmp_path):
    """A package that needs ``fcntl`` and ``signal.SIGHUP`` at import is found out."""
    for text in ("import fcntl", "import signal\nsignal.SIGHUP"):
        (tmp_path / "models").mkdir(exist_ok=True)
        (tmp_path / "models" / "__init__.py").write_text(text)
        command = [sys.executable, "-c", SCRIPT, "win32"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 1
        assert "Error" in done.stderr
