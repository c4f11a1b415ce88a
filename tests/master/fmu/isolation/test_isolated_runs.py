"""Whole runs with isolated FMUs, from the command line."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from master.commands.main import main
from master.recording import checkpoint
from master.results import run_results
from tests import forked_commands
from tests.effort import rest

ROOT = Path(__file__).parents[4]


def go(toy, folder, *options):
    return main([str(toy), "--no-build", "--quiet", "--no-report", "--out", str(folder), *options])


def files(folder):
    return {name: (folder / name).read_bytes() for name in ("timeseries.csv", "timeseries_5ms.csv", "geometry.json")}


@pytest.mark.parametrize("scheme", ["iterative", *rest("jacobi", "gauss-seidel")])
def test_figures_are_the_same_to_the_last_bit(toy, tmp_path, scheme):
    options = ["--scheme", scheme, "--stop", "0.15"]
    assert go(toy, tmp_path / "plain", *options, "--checkpoint", "0.05") == 0
    assert go(toy, tmp_path / "isolated", *options, "--checkpoint", "0.05", "--isolate", "--step-timeout", "60") == 0
    assert files(tmp_path / "isolated") == files(tmp_path / "plain")
    plain, isolated = (json.loads((tmp_path / n / "summary.json").read_text()) for n in ("plain", "isolated"))
    for key in ("quality", "uplift", "interface_power"):
        assert isolated[key] == plain[key]
    assert isolated["performance"]["component_time"].keys() == {"catenary", "pantograph"}
    states = [checkpoint.read(tmp_path / n / checkpoint.NAME).states for n in ("plain", "isolated")]
    assert states[0] == states[1]
    file = str(tmp_path / "plain" / checkpoint.NAME)
    assert go(toy, tmp_path / "rest", *options, "--resume", file, "--isolate") == 0
    whole, rest = ((tmp_path / n / "timeseries.csv").read_text().splitlines() for n in ("plain", "rest"))
    assert rest[1:] == whole[51:]


@pytest.fixture
def with_crasher(toy, crasher_fmu, toy_text):
    """The toy scenario with a third component that nobody listens to, connected to the contact force."""
    shutil.copy(crasher_fmu, toy / "resources")
    component = """<ssd:Component name="toy" source="resources/Crasher.fmu"><ssd:Connectors>
        <ssd:Connector name="u" kind="input"><ssc:Real/></ssd:Connector></ssd:Connectors></ssd:Component>
        </ssd:Elements>"""
    wire = """<ssd:Connection startElement="pantograph" startConnector="A.vx" endElement="toy" endConnector="u"/>
        </ssd:Connections>"""
    text = toy_text().replace("</ssd:Elements>", component).replace("</ssd:Connections>", wire)
    (toy / "SystemStructure.ssd").write_text(text)
    return toy


@pytest.mark.parametrize(
    ("deed", "text"),
    [
        (1, "crashed in a step at t = 0.3 s: its process was ended by signal SIGSEGV (Segmentation fault)"),
        (3, "did not finish a step at t = 0.3 s within 1 s (--step-timeout); its process was ended"),
    ],
)
def test_a_crash_leaves_what_was_computed(with_crasher, tmp_path, capsys, deed, text):
    folder = tmp_path / "out"
    parameters = ["--set", f"toy.deed={deed}", "--set", "toy.at=0.2995", "--set", "toy.gain=0"]
    assert go(with_crasher, folder, *parameters, "--isolate", "--step-timeout", "1") == 1
    said = " ".join(capsys.readouterr().err.split())
    assert said.startswith(f"error: component 'toy' (Crasher.fmu) {text}")
    assert said.count("error") == 1
    assert "Traceback" not in said
    left = run_results.read(folder)
    assert left.summary["status"] == "failed"
    assert text in left.summary["reason"]
    assert left.recordings[0].time[-1] == pytest.approx(0.3)
    assert len(left.recordings[0].time) == 301


def test_output_of_an_fmu_is_not_the_masters(with_crasher, tmp_path):
    options = ["--set", "toy.deed=5", "--set", "toy.gain=0", "--stop", "0.02", "--isolate", "--json", "--no-report"]
    done = forked_commands.run("master", with_crasher, "--no-build", "--out", tmp_path / "out", *options)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["status"] == "complete"
    assert "garbage" not in done.stderr


def test_a_step_timeout_needs_isolation(toy, tmp_path, capsys):
    assert go(toy, tmp_path / "out", "--step-timeout", "1") == 2
    assert "--step-timeout needs --isolate" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_interruption_reaches_the_master_alone(toy, tmp_path):
    """Ctrl-C goes to every process of the terminal's group."""
    folder = tmp_path / "out"
    command = [sys.executable, "-m", "master", str(toy), "--no-build", "--isolate", "--stop", "1e3"]
    process = subprocess.Popen(
        [*command, "--no-report", "--out", str(folder)],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    series = folder / "timeseries.csv"
    deadline = time.monotonic() + 60
    while not (series.exists() and series.stat().st_size > 50_000) and time.monotonic() < deadline:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "error: interrupted." in said
    left = run_results.read(folder)
    assert left.summary["status"] == "interrupted"
    assert len(left.recordings[0].time) == left.summary["steps"] + 1
