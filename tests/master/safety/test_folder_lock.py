"""One process at a time works in a folder, and nothing is certified that another one has written."""

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
from master.recording.recording import load
from master.results import run_results
from master.safety import folder_lock
from master.safety.folder_lock import LOCK, OWNER, FolderInUseError, claimed
from tests import forked_commands

ROOT = Path(__file__).parents[3]
HOLDER = """
import sys, time
from pathlib import Path
from master.safety.folder_lock import claimed
with claimed(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def go(toy, folder, *options):
    return main([str(toy), "--no-build", "--quiet", "--no-report", "--out", str(folder), *options])


def said(capsys):
    return " ".join(capsys.readouterr().err.split())


def start(*arguments):
    return forked_commands.start("master", *arguments, stderr=subprocess.PIPE)


def running(toy, folder, *options):
    """A run that is in the middle of its steps."""
    process = start(toy, "--no-build", "--quiet", "--no-report", "--out", folder, "--stop", "1e3", *options)
    wait_for(lambda: (folder / "timeseries.csv").exists() and (folder / "timeseries.csv").stat().st_size > 50_000)
    return process


def wait_for(condition):
    deadline = time.monotonic() + 60.0
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.02)


def end(process):
    process.kill()
    process.communicate(timeout=60)


@pytest.fixture
def busy(toy, tmp_path):
    """A results folder in which a run writes; gives it with the run's process."""
    folder = tmp_path / "busy"
    process = running(toy, folder)
    yield folder, process
    end(process)


@pytest.fixture
def holder(tmp_path):
    """Function that has another process claim a folder; it ends with the test at the latest."""
    made = []

    def hold(folder):
        folder.mkdir(exist_ok=True)
        process = subprocess.Popen([sys.executable, "-c", HOLDER, folder], cwd=ROOT, stdout=subprocess.PIPE, text=True)
        made.append(process)
        assert process.stdout.readline() == "held\n"
        return process

    yield hold
    for process in made:
        end(process)


def test_a_folder_is_claimed_by_one_process_and_free_after_its_end(tmp_path, holder):
    folder = tmp_path / "a"
    process = holder(folder)
    with pytest.raises(FolderInUseError, match=rf"a is in use \(process {process.pid} on .*, since 2.*\); choose"):
        claimed(folder).__enter__()
    with pytest.raises(FolderInUseError, match="wait for it to end"):
        folder_lock.check_free(folder)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert (folder / OWNER).exists()  # what stays means nothing
    folder_lock.check_free(folder)
    with claimed(folder), claimed(folder):
        assert json.loads((folder / OWNER).read_text())["process"] == os.getpid()
    assert list(folder.iterdir()) == []


def test_whoever_waits_does_not_lock_a_file_that_was_removed(tmp_path, monkeypatch):
    """The owner takes its file away while another one has it open already."""
    real, removed = folder_lock.lock_descriptor, []

    def locked(descriptor, **options):
        if not removed:
            removed.append((tmp_path / LOCK).unlink())
        return real(descriptor, **options)

    monkeypatch.setattr(folder_lock, "lock_descriptor", locked)
    with claimed(tmp_path):
        assert (tmp_path / LOCK).is_file()
        assert removed


def test_without_locks_nobody_is_kept_out(tmp_path, monkeypatch, holder):
    holder(tmp_path)

    def none(*_, **__):
        raise OSError(next(iter(folder_lock._NO_LOCKS)), "no locks")

    monkeypatch.setattr(folder_lock, "lock_descriptor", none)
    with claimed(tmp_path):
        pass


def test_a_second_run_is_refused_and_the_first_is_not_disturbed(toy, tmp_path, capsys, busy):
    folder, process = busy
    before = (folder / "timeseries.csv").read_bytes()
    assert go(toy, folder) == 1
    owner = json.loads((folder / OWNER).read_text())["process"]
    assert f"{folder} is in use (process {owner} on " in said(capsys)
    assert go(toy, tmp_path / "other", "--stop", "0.02") == 0
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert (folder / "timeseries.csv").read_bytes().startswith(before)
    done = run_results.read(folder)
    assert done.summary["status"] == "interrupted"
    assert len(done.recordings[0].time) == done.summary["steps"] + 1


@pytest.mark.parametrize("verb", ["report", "compare", "resume"])
def test_what_a_run_writes_is_not_read(toy, tmp_path, capsys, busy, verb):
    folder, _ = busy
    if verb == "resume":
        (folder / checkpoint.NAME).write_bytes(b"openpanto arrays 1\n")
        assert main([str(toy), "--no-build", "--resume", str(folder)]) == 1
        return
    arguments = ["report", str(folder)] if verb == "report" else ["compare", str(folder), str(folder)]
    assert main(arguments) == 1
    assert f"{folder} is in use (process " in said(capsys)
    assert not (folder / "report.html").exists()
    assert json.loads((folder / "summary.json").read_text())["status"] == "running"


def test_of_two_resumes_one_is_refused(toy, tmp_path, capsys):
    folder = tmp_path / "out"
    options = ["--checkpoint-every", "0.1"]
    first = running(toy, folder, *options)
    wait_for((folder / checkpoint.NAME).exists)
    end(first)
    owner = (folder / OWNER).read_text()  # what a killed one leaves
    again = start(toy, "--no-build", "--quiet", "--no-report", "--resume", folder, "--stop", "1e3", *options)
    wait_for(lambda: (folder / OWNER).read_text() not in ("", owner))
    assert main([str(toy), "--no-build", "--quiet", "--resume", str(folder), "--stop", "1e3"]) == 1
    assert "is in use (process " in said(capsys)
    end(again)


@pytest.mark.parametrize("kind", ["removed", "taken"])
def test_results_that_are_gone_at_the_end_are_not_certified(toy, tmp_path, busy, kind):
    folder, process = busy
    shutil.rmtree(folder)
    if kind == "taken":
        assert go(toy, folder, "--stop", "0.05") == 0
        own = {path.name: path.read_bytes() for path in folder.iterdir()}
    process.send_signal(signal.SIGTERM)
    _, text = process.communicate(timeout=60)
    assert process.returncode == 1
    assert f"the results in {folder} were removed or taken by another run" in text
    assert text.count("\n") == 1
    if kind == "taken":
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == own
    else:
        assert not (folder / "summary.json").exists()


@pytest.mark.parametrize("rows", [-1, 1])
def test_rows_are_counted_before_a_run_is_complete(toy, tmp_path, capsys, monkeypatch, rows):
    """As if another process had cut, or added to, what this one wrote."""
    folder = tmp_path / "out"

    def changed(path):
        if path.name == "timeseries.csv":
            lines = path.read_text().splitlines(keepends=True)
            more = [lines[-1].replace(lines[-1].split(",")[0], "9", 1)]
            path.write_text("".join(lines[:-1] if rows < 0 else lines + more))
        return load(path)

    monkeypatch.setattr("master.recording.recorder.load", changed)
    assert go(toy, folder, "--stop", "0.1") == 1
    assert f"timeseries.csv has {101 + rows} rows, 101 were written: it was changed" in said(capsys)
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["status"] == "failed"
    assert "quality" not in summary


def test_rows_are_the_written_ones_before_a_run_is_complete(toy, tmp_path, capsys, monkeypatch):
    """As if somebody had put another table, of as many rows and bytes, in its place meanwhile."""
    folder = tmp_path / "out"

    def replaced(path):
        if path.name == "timeseries.csv":
            text = path.read_text().rstrip("\n")
            path.write_text(f"{text[:-1]}{'1' if text[-1] != '1' else '2'}\n")
        return load(path)

    monkeypatch.setattr("master.recording.recorder.load", replaced)
    assert go(toy, folder, "--stop", "0.1") == 1
    assert "timeseries.csv is not what was written: it was changed while the run was in progress" in said(capsys)
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["status"] == "failed"
    assert "quality" not in summary


def test_a_folder_made_anew_keeps_its_lock_when_the_first_owner_ends(tmp_path, holder):
    folder = tmp_path / "held"
    folder.mkdir()
    with claimed(folder):
        folder.rename(tmp_path / "moved")
        process = holder(folder)
    assert json.loads((folder / OWNER).read_text())["process"] == process.pid
    with pytest.raises(FolderInUseError, match=f"process {process.pid} on"), claimed(folder):
        pass


def test_study_and_verification_are_alone_in_their_folders(toy, tmp_path, capsys, holder):
    (toy / "study.toml").write_text('title = "a"\n[[interval]]\nname = "whole"\nstart = 10.0\nend = 45.0\n')
    (toy / "variants.csv").write_text("variant,catenary.stiffness\nsoft,4000\n")
    folder = tmp_path / "held"
    process = holder(folder)
    for command in (["study", str(toy)], ["verify", "wave_speeds"]):
        assert main([*command, "--no-build", "--out", str(folder)]) == 1
        assert f"held is in use (process {process.pid} on" in said(capsys)
    assert {path.name for path in folder.iterdir()} == {LOCK, OWNER}


def test_one_calibration_at_a_time_stores_its_value(toy, capsys, holder):
    command = ["calibrate", str(toy), "--no-build", "--parameter", "pantograph.static_force", "--mean", "150"]
    process = holder(toy)
    assert main(command) == 1
    assert f"is in use (process {process.pid} on" in said(capsys)
    end(process)
    owner = (toy / OWNER).read_text()
    before = (toy / "parameters.ssv").read_text()
    running = start(*command[:-1], "120")  # which takes a second run
    first = next(line for line in running.stderr if "mean force" in line)  # what is written was read before
    assert (toy / OWNER).read_text() not in ("", owner)
    (toy / "parameters.ssv").write_text(before + " ")
    _, text = running.communicate(timeout=120)
    assert running.returncode == 1, first + text
    assert "parameters.ssv was changed during the calibration; nothing was stored" in " ".join(text.split())
    assert (toy / "parameters.ssv").read_text() == before + " "


def test_a_checkpoint_of_an_earlier_run_does_not_stay(toy, tmp_path):
    folder = tmp_path / "out"
    assert go(toy, folder, "--stop", "0.1", "--checkpoint", "0.05") == 0
    file = folder / checkpoint.NAME
    assert go(toy, folder, "--stop", "0.2", "--resume", str(file)) == 0
    assert file.exists()  # it is where this run began
    assert go(toy, folder, "--stop", "0.1") == 0
    assert not file.exists()


def test_two_packs_of_one_archive_do_not_mix(toy, tmp_path):
    target = tmp_path / "dist" / "a.ssp"
    packing = [start("pack", toy, "--no-build", "--out", target) for _ in range(2)]
    assert [p.communicate(timeout=60) and p.returncode for p in packing] == [0, 0]
    assert [p.name for p in target.parent.iterdir()] == ["a.ssp"]
    assert main(["validate", str(target), "--no-build"]) == 0
