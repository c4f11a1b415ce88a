"""Commands killed at any moment: the next one recovers or refuses with a reason, and nothing is certified falsely."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from master.recording.recording import load
from tests import forked_commands
from tests.effort import IS_LONG, count
from tests.master.conftest import SSV, ssd_text, toy_fmus  # noqa: F401 (a fixture)

ROOT = Path(__file__).parents[2]
STUDY = 'title = "Toys"\n[[interval]]\nname = "whole"\nstart = 10.0\nend = 20.0\n'
VARIANTS = "variant,catenary.stiffness,stop\nsoft,4000,0.5\nfirm,6000,0.5\nhard,8000,0.5\n"
CASE = """
title = "Toys"
description = "Nothing but a run."
citation = "made up"

[runs]
toy = {{ scenario = "{scenario}" }}

[[rows]]
quantity = "mean"
title = "mean force"
run = "toy"
value = 150
tolerance_percent = 90
source = "made up"
"""


@dataclass(frozen=True)
class Command:
    """A command, what it leaves, and what must be true of that whenever it was killed."""

    arguments: list[str]
    check: Callable[[], None]


def _kill_one(process: forked_commands.Process | subprocess.Popen[str], chance: random.Random) -> None:
    """Kill the command's process, or one of those that it has started."""
    family = [process.pid, *_descendants(process.pid)]
    try:
        os.kill(chance.choice(family), signal.SIGKILL)
    except ProcessLookupError:
        return


def _descendants(pid: int) -> list[int]:
    found = []
    for tasks in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            own = [int(text) for text in tasks.read_text().split()]
        except OSError:
            continue
        found += own + [below for child in own for below in _descendants(child)]
    return found


def _start(command: Command) -> forked_commands.Process | subprocess.Popen[str]:
    """Begin a command; the long checks may kill it while Python itself starts."""
    if not IS_LONG:
        return forked_commands.start(*command.arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    return subprocess.Popen(
        [sys.executable, "-m", *command.arguments], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def _status(file: Path) -> str:
    return json.loads(file.read_text())["status"] if file.is_file() else ""


def _check_run(folder: Path, rows: int) -> None:
    """Certified is only what is whole."""
    if _status(folder / "summary.json") == "complete":
        assert len(load(folder / "timeseries.csv").time) == rows
        assert json.loads((folder / "summary.json").read_text())["steps"] == rows - 1


@pytest.fixture
def commands(toy_fmus: Path, tmp_path: Path) -> dict[str, Command]:  # noqa: F811
    """The commands, by name, on a scenario of its own each."""
    out = tmp_path / "out"

    def scenario(name: str) -> Path:
        folder = tmp_path / f"{name}.ssp"
        (folder / "resources").mkdir(parents=True)
        for path in toy_fmus.glob("*.fmu"):
            (folder / "resources" / path.name).write_bytes(path.read_bytes())
        (folder / "SystemStructure.ssd").write_text(ssd_text(stop="0.5", run='<panto:Interval start="10" end="20"/>'))
        (folder / "parameters.ssv").write_text(SSV)
        return folder

    study, calibrated = scenario("study"), scenario("calibrated")
    (study / "study.toml").write_text(STUDY)
    (study / "variants.csv").write_text(VARIANTS)
    case = tmp_path / "toys.toml"
    case.write_text(CASE.format(scenario=scenario("verified")))

    def check_study() -> None:
        file = out / "study" / "study.json"
        done = json.loads(file.read_text()) if file.is_file() else {}
        for variant in done.get("variants", []):
            assert _status(out / "study" / variant["folder"] / "summary.json") == "complete"
        for folder in (out / "study").glob("*/"):
            _check_run(folder, 501)
        assert done.get("status") != "complete" or len(done["variants"]) + len(done["failures"]) == 3

    def check_verify() -> None:
        if _status(out / "verify" / "verify.json") == "complete":
            assert _status(out / "verify" / "runs" / "verified" / "summary.json") == "complete"

    def check_archive(path: Path) -> Callable[[], None]:
        def check() -> None:
            if path.is_file():
                assert zipfile.ZipFile(path).testzip() is None

        return check

    def check_calibrated() -> None:
        text = (calibrated / "parameters.ssv").read_text()
        assert text == SSV or "<!-- calibrated:" in text
        assert text.endswith("</ssv:ParameterSet>\n")

    common = ["--no-build", "--quiet"]
    plain = ["--no-build", "--no-report", "--quiet"]
    return {
        "run": Command(["master", "run", str(scenario("run")), *plain, "--out", str(out / "run")],
                       lambda: _check_run(out / "run", 501)),
        "isolated": Command(["master", "run", str(scenario("isolated")), *plain, "--isolate", "--out",
                             str(out / "isolated")], lambda: _check_run(out / "isolated", 501)),
        "study": Command(["master", "study", str(study), *common, "--out", str(out / "study")], check_study),
        "verify": Command(["master", "verify", str(case), *common, "--out", str(out / "verify")], check_verify),
        "calibrate": Command(["master", "calibrate", str(calibrated), "--no-build", "--parameter",
                              "pantograph.static_force", "--mean", "150", "--tolerance", "5"], check_calibrated),
        "pack": Command(["master", "pack", str(scenario("packed")), "--no-build", "--out", str(out / "a.ssp")],
                        check_archive(out / "a.ssp")),
        "build": Command(["fmus", "build", "Pantograph_CX", "--out", str(out / "fmus")],
                         check_archive(out / "fmus" / "Pantograph_CX.fmu")),
    }  # fmt: skip


@pytest.mark.skipif(sys.platform != "linux", reason="looks for the processes in /proc")
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(n, marks=[] if n in ("run", "isolated", "pack") else pytest.mark.long)
        for n in ("run", "isolated", "study", "verify", "calibrate", "pack", "build")
    ],
)
def test_the_next_command_recovers_or_says_why_not(commands: dict[str, Command], name: str) -> None:
    """Seven commands, thirty kills each in the long checks."""
    command, chance = commands[name], random.Random(name)
    began = time.monotonic()
    process = _start(command)
    _, said = process.communicate(timeout=120)
    assert process.returncode in (0, 1), said
    lasts = time.monotonic() - began
    for _ in range(count(2, 30)):
        process = _start(command)
        time.sleep(chance.uniform(0.0, 1.2 * lasts))
        _kill_one(process, chance)
        _, said = process.communicate(timeout=120)
        assert "Traceback" not in said
        assert process.returncode in (0, 1, -signal.SIGKILL)
        assert process.returncode != 1 or "error: " in said or name == "verify", said
        command.check()
    process = _start(command)
    _, said = process.communicate(timeout=120)
    assert process.returncode == 0, said
    command.check()
