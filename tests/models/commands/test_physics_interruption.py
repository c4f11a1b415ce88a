"""Ctrl-C ends a command of the physics, whatever it is busy with."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no watching process without fork")

BUSY = """
from models.commands.physics_interruption import watch_interruptions
watch_interruptions({grace})
print("ready", flush=True)
{work}
print("done", flush=True)
"""
#: One call into C that takes hours and looks at no signal.
NATIVE = "import itertools; sum(itertools.repeat(0, 10**13))"
PATIENT = """
import time
try:
    time.sleep(60.0)
except KeyboardInterrupt:
    time.sleep(0.2)
"""


def start(work, grace):
    code = BUSY.format(work=work, grace=grace)
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.2)
    return process


def interrupt(process, times=1):
    for _ in range(times):
        process.send_signal(signal.SIGINT)
        time.sleep(0.2)
    began = time.monotonic()
    out, err = process.communicate(timeout=30)
    return out, err, time.monotonic() - began


@pytest.fixture(autouse=True)
def _heeded():
    """A suite that was started in the background may ignore interruptions, and its children with it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_native_code_that_does_not_return_is_ended_after_a_while():
    process = start(NATIVE, 1.0)
    out, err, seconds = interrupt(process)
    assert (process.returncode, out) == (-signal.SIGKILL, "")
    assert err == "error: interrupted in a computation that does not return; the command was ended\n"
    assert seconds < 10.0


def test_a_second_signal_does_not_wait():
    process = start(NATIVE, 1000.0)
    assert interrupt(process, times=2)[2] < 10.0
    assert process.returncode == -signal.SIGKILL


def test_a_command_that_heeds_the_first_signal_ends_by_itself():
    process = start(PATIENT, 1000.0)
    out, err, seconds = interrupt(process)
    assert (process.returncode, out, err) == (0, "done\n", "")
    assert seconds < 10.0


def test_the_watching_process_goes_with_the_command():
    """What it prints ends with the command: nobody waits for the other process."""
    code = BUSY.format(work="", grace=1000.0)
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=30, check=True)
    assert (done.stdout, done.stderr) == ("ready\ndone\n", "")
