"""FMUs that crash, exit, hang, fail or lie in any of their functions: the master ends in one sentence, and honestly."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from master.commands.main import main
from tests import forked_commands
from tests.effort import IS_LONG

ROOT = Path(__file__).parents[2]
#: What the master says it was doing when it called a function, isolated and in words of the FMU's own failure.
WHERE = {
    "fmi2Instantiate": ("loading", ""),
    "fmi2SetupExperiment": ("entering initialization at t = 0 s", "setting up the experiment at t = 0 s"),
    "fmi2EnterInitializationMode": ("entering initialization at t = 0 s", "entering initialization at t = 0 s"),
    "fmi2ExitInitializationMode": ("its initialization at t = 0 s", "its initialization at t = 0 s"),
    "fmi2SetReal": ("a step at t = 0.05 s", "setting its inputs at t = 0.04 s"),
    "fmi2GetReal": ("a step at t = 0.04 s", "reading its variables at t = 0.04 s"),
    "fmi2DoStep": ("a step at t = 0.05 s", "a step at t = 0.05 s"),
    "fmi2GetFMUstate": ("serialising its state at t = 0.04 s", "saving its state at t = 0.04 s"),
    "fmi2SerializedFMUstateSize": ("serialising its state at t = 0.04 s", "serialising its state at t = 0.04 s"),
    "fmi2SerializeFMUstate": ("serialising its state at t = 0.04 s", "serialising its state at t = 0.04 s"),
    "fmi2Terminate": ("its termination at t = 0.09 s", "its termination at t = 0.09 s"),
    "fmi2FreeInstance": ("its termination at t = 0.09 s", ""),
}
KINDS = ("crash", "exit", "hang", "error", "negative", "claim")
#: Taken in every run of the tests; the whole table in the long checks.
SAMPLE = {
    ("fmi2Instantiate", "hang"), ("fmi2ExitInitializationMode", "exit"), ("fmi2DoStep", "crash"),
    ("fmi2DoStep", "negative"), ("fmi2SerializedFMUstateSize", "claim"), ("fmi2FreeInstance", "crash"),
}  # fmt: skip
CASES = [(f, k) for f in WHERE for k in KINDS if IS_LONG or (f, k) in SAMPLE]
WHO = r"component 'bad' \(Hostile\.fmu\)"


def due(function):
    """From when on the deed is done: while stepping for what is called more often."""
    stepping = function in ("fmi2SetReal", "fmi2GetReal", "fmi2DoStep") or "State" in function or "state" in function
    return 0.05 if stepping else -1.0


def expected(function, kind):
    """The sentence that an isolated FMU must give, as a pattern; empty if nothing goes wrong."""
    doing, failing = WHERE[function]
    loading, freeing = function == "fmi2Instantiate", function == "fmi2FreeInstance"
    if kind == "crash":
        return rf"{WHO} crashed in {re.escape(doing)}: its process was ended by signal SIGSEGV"
    if kind == "exit":
        return rf"{WHO} crashed in {re.escape(doing)}: its process ended itself with exit code 0"
    if kind == "hang":
        return rf"{WHO} did not finish {re.escape(doing)} within \d+ s.*; its process was ended"
    if function == "fmi2SerializedFMUstateSize" and kind == "claim":
        return rf"{WHO} claims a state of {2**40} bytes, more than the {2**30} that are read"
    if loading:
        return r"component 'bad': Hostile\.fmu cannot be loaded" + ("" if kind != "claim" else r".*: x+ \.\.\.")
    if freeing:
        return ""
    status = {"error": "error", "claim": "error", "negative": "-7, which FMI does not know"}[kind]
    more = r"x+ \.\.\. " if kind == "claim" else ""
    return rf"{WHO} failed in {re.escape(failing)}, status {status}: {more}"


def options(folder):
    return ["--no-build", "--no-report", "--out", str(folder), "--checkpoint", "0.05"]


def summary(folder):
    return json.loads((folder / "summary.json").read_text())


@pytest.mark.parametrize(("function", "kind"), CASES)
def test_isolated_it_is_told_by_name(pair, tmp_path, capsys, function, kind):
    scenario, folder = pair(function, kind, due(function)), tmp_path / "out"
    limits = ["--isolate"]
    if kind == "hang":
        limits += ["--init-timeout", "1" if function == "fmi2Instantiate" else "3", "--step-timeout", "2"]
    code = main([str(scenario), *options(folder), *limits])
    lines = capsys.readouterr().err.splitlines()
    said, found = " ".join(" ".join(lines).split()), summary(folder)
    text = expected(function, kind)
    assert len(said) < 2000
    assert "Traceback" not in said
    if function in ("fmi2Terminate", "fmi2FreeInstance"):  # what was computed is not touched by how an FMU ends
        assert (code, found["status"]) == (0, "complete")
        assert [bool(re.search(text, w["text"])) for w in found["warnings"]] == ([True] if text else [])
        assert re.search(expected(function, "error" if kind == "claim" else kind), said)  # lines are broken there
    else:
        assert (code, found["status"]) == (1, "failed")
        assert re.search(text, said), said
        assert re.search(text, found["reason"])
        assert [line.startswith("error: ") for line in lines].count(True) == 1


@pytest.fixture
def started(tmp_path):
    """Function that starts a run, and gives it when it hangs, if it is to; all end with the test."""
    made = []

    def start(scenario, folder, *more, hangs=True):
        mark = tmp_path / "hangs"
        environment = {**os.environ, "HOSTILE_MARK": str(mark)}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        process = forked_commands.start("master", scenario, *options(folder), *more, env=environment, **pipes)
        made.append(process)
        deadline = time.monotonic() + 60.0
        while hangs and not mark.exists() and time.monotonic() < deadline:
            time.sleep(0.02)
        return process

    yield start
    for process in made:
        process.kill()
        process.communicate()


@pytest.mark.parametrize(("function", "kind"), [*CASES, *([("fmi2DoStep", "_exit")] if IS_LONG else [])])
def test_in_the_process_nothing_ends_without_a_word(pair, tmp_path, started, function, kind):
    scenario, folder = pair(function, kind, due(function)), tmp_path / "out"
    process = started(scenario, folder, hangs=kind == "hang")
    if kind == "hang":
        assert process.poll() is None
        process.terminate()
    _, said = process.communicate(timeout=60)
    said, found = " ".join(said.split()), summary(folder)
    assert "Traceback" not in said
    if kind == "hang":
        assert (process.returncode, found["status"]) == (1, "interrupted")
        assert "error: interrupted. " in said
    elif kind in ("crash", "exit", "_exit"):
        how = "was ended by signal SIGSEGV (Segmentation fault)" if kind == "crash" else "ended itself with exit code 0"
        assert (process.returncode, found["status"]) == (1, "failed")
        assert f"error: the process {how} before it had finished" in said
        assert how in found["reason"]
    elif function in ("fmi2Terminate", "fmi2FreeInstance"):
        assert (process.returncode, found["status"]) == (0, "complete")
    else:
        assert (process.returncode, found["status"]) == (1, "failed")
        assert re.search(expected(function, kind), said), said


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_one_signal_ends_the_loading_of_an_isolated_fmu(pair, tmp_path, started, number):
    folder = tmp_path / "out"
    process = started(pair("fmi2Instantiate", "hang"), folder, "--isolate")
    process.send_signal(number)
    began = time.monotonic()
    _, said = process.communicate(timeout=20)
    assert time.monotonic() - began < 10.0
    assert (process.returncode, summary(folder)["status"]) == (1, "interrupted")
    assert said.startswith("error: interrupted. What was computed")  # the master itself: nobody had to end it


def test_a_second_signal_ends_a_step_at_once(pair, tmp_path, started):
    folder = tmp_path / "out"
    process = started(pair("fmi2DoStep", "hang", 0.05), folder)
    process.send_signal(signal.SIGINT)
    time.sleep(0.5)
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    _, said = process.communicate(timeout=20)
    assert time.monotonic() - began < 5.0
    assert (process.returncode, summary(folder)["status"]) == (1, "interrupted")
    assert "error: interrupted. " in said


GIL_HOLDER = """
import ctypes, sys
from master.safety.supervision import phase, supervised
def work():
    with phase("loading"):
        ctypes.PyDLL(sys.argv[1]).fmi2Instantiate(b"a", 1, b"", sys.argv[2].encode(), None, 0, 0)
    return 0
sys.exit(supervised(work))
"""


def test_native_code_that_lets_no_python_run_is_ended_by_one_signal(library, tmp_path):
    """As a factorisation may spin that keeps the interpreter's lock: no handler and no thread of Python runs."""
    (tmp_path / "deed").write_text("fmi2Instantiate hang -1")
    mark = tmp_path / "hangs"
    command = [sys.executable, "-c", GIL_HOLDER, str(library), str(tmp_path)]
    environment = {**os.environ, "HOSTILE_MARK": str(mark)}
    process = subprocess.Popen(command, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60.0
    while not mark.exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    process.terminate()
    _, said = process.communicate(timeout=20)
    assert process.returncode == 1
    assert said == "error: interrupted. The process did not stop by itself and was ended\n"


def alive(pattern):
    """Processes of which /proc knows that they have mapped a file."""
    found = []
    for maps in Path("/proc").glob("[0-9]*/maps"):
        try:
            if pattern in maps.read_text():
                found.append(int(maps.parent.name))
        except OSError:
            continue
    return [pid for pid in found if pid != os.getpid()]


@pytest.mark.parametrize("kind", ["fork", "daemon", "orphan"])
def test_what_an_isolated_fmu_has_started_ends_with_it(pair, tmp_path, monkeypatch, started, kind):
    """An orphan keeps the connection and the pipe of the one that crashed."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    folder = tmp_path / "out"
    process = started(pair("fmi2DoStep", kind, 0.05), folder, "--isolate", hangs=False)
    _, said = process.communicate(timeout=60)
    time.sleep(0.2)
    assert alive(str(tmp_path)) == []
    assert process.returncode == (kind == "orphan")
    if kind == "orphan":
        assert "crashed in a step at t = 0.05 s" in " ".join(said.split())


def test_its_group_ends_with_it_where_processes_cannot_be_looked_through(pair, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("master.fmu.isolation.child_process.marked_processes", lambda _: ())
    assert main([str(pair("fmi2DoStep", "fork", 0.05)), *options(tmp_path / "out"), "--isolate"]) == 0
    time.sleep(0.2)
    assert alive(str(tmp_path)) == []
