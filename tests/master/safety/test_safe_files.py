"""What a run has computed survives its sudden end, and a run that was ended can be finished."""

from __future__ import annotations

import csv
import errno
import json
import os
import random
import resource
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from master.commands.main import main
from master.errors import MasterError
from master.recording import checkpoint
from master.recording.recorder import LONGEST_UNWRITTEN, RecordedValues, Recorder
from master.recording.recording import load
from master.results import results_folder, run_results
from master.safety import safe_files
from master.safety.safe_files import AppendOnlyFile, write_atomically
from tests import forked_commands
from tests.effort import rest

ROOT = Path(__file__).parents[3]
SERIES = ("timeseries.csv", "timeseries_5ms.csv")


def go(toy, folder, *options):
    return main([str(toy), "--no-build", "--quiet", "--no-report", "--out", str(folder), *options])


def started(toy, folder, *options, **settings):
    command = ["master", toy, "--no-build", "--quiet", "--no-report", "--out", folder, *options]
    return forked_commands.start(*command, stderr=subprocess.PIPE, **settings)


def kill(process, folder, more, delay):
    """End a run with SIGKILL, some time after its file has grown by ``more`` bytes."""
    series = folder / SERIES[0]
    size = series.stat().st_size if series.exists() else 0
    deadline = time.monotonic() + 60
    while process.poll() is None and time.monotonic() < deadline:
        if series.exists() and series.stat().st_size != size and series.stat().st_size >= more:
            break
        time.sleep(0.001)
    time.sleep(delay)
    process.send_signal(signal.SIGKILL)
    process.communicate(timeout=60)


def check_readable(folder):
    for name in SERIES:
        text = (folder / name).read_text()
        assert text.endswith("\n")
        rows = list(csv.reader(text.splitlines()))
        assert {len(row) for row in rows} == {len(rows[0])}
        assert all(np.isfinite([float(x) for x in row]).all() for row in rows[1:])


def finish(toy, folder, *options):
    """Finish a run, or run it again if it was ended before its first checkpoint."""
    if (folder / checkpoint.NAME).exists():
        return main([str(toy), "--no-build", "--quiet", "--no-report", "--resume", str(folder), *options])
    return go(toy, folder, *options)


@pytest.mark.parametrize("every", ["0.002", *rest("0.1")])
def test_a_run_killed_again_and_again_ends_like_one_that_was_not(toy, tmp_path, every):
    """With a checkpoint every other step, most kills come while one is being written."""
    chance = random.Random(every)
    options = ["--stop", "1.5", "--scheme", "iterative"]
    assert go(toy, tmp_path / "whole", *options) == 0
    folder = tmp_path / "killed"
    process = started(toy, folder, *options, "--checkpoint-every", every)
    for _ in range(3):
        kill(process, folder, 0, chance.uniform(0.0, 0.4))
        check_readable(folder)
        if run_results.read(folder).summary["status"] == "complete":
            break  # it was too fast for this kill
        assert run_results.read(folder).summary["status"] == "running"
        resume = ["--resume", str(folder)] if (folder / checkpoint.NAME).exists() else []
        process = started(toy, folder, *options, "--checkpoint-every", every, *resume)
    kill(process, folder, 0, 0.0)
    goes_on = (folder / checkpoint.NAME).exists()
    assert finish(toy, folder, *options) == 0
    for name in (*SERIES, "geometry.json"):
        assert (folder / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    whole, killed = (json.loads((tmp_path / n / "summary.json").read_text()) for n in ("whole", "killed"))
    for key in ("status", "steps", "quality", "uplift", "interface_power", "contacts", "components"):
        assert killed[key] == whole[key]
    assert ("resumed" in killed) == goes_on


@pytest.fixture
def killed(toy, tmp_path):
    """A run of 0.5 s that was ended after 0.3 s, with a checkpoint at 0.2 s."""
    folder = tmp_path / "killed"
    options = ["--stop", "0.5", "--set", "catenary.fail_at=0.3", "--checkpoint-every", "0.2"]
    assert go(toy, folder, *options) == 1
    return folder


def test_a_run_is_cut_back_to_its_checkpoint_and_goes_on(toy, tmp_path, killed):
    options = ["--stop", "0.5", "--set", "catenary.fail_at=0.3"]
    before = load(killed / SERIES[0]).time[-1]
    assert before > 0.2
    assert go(toy, tmp_path / "whole", *options) == 1
    assert finish(toy, killed, *options) == 1
    assert (killed / SERIES[0]).read_bytes() == (tmp_path / "whole" / SERIES[0]).read_bytes()


def test_a_run_ended_before_its_summary_was_written_gets_one(toy, tmp_path):
    folder = tmp_path / "out"
    assert go(toy, folder, "--stop", "0.2", "--checkpoint", "0.2") == 0
    done = (folder / SERIES[0]).read_bytes()
    summary = json.loads((folder / "summary.json").read_text())
    (folder / "summary.json").write_text(json.dumps({**summary, "status": "running"}))
    assert finish(toy, folder, "--stop", "0.2") == 0
    assert (folder / SERIES[0]).read_bytes() == done
    assert json.loads((folder / "summary.json").read_text())["quality"] == summary["quality"]


def test_a_run_can_be_made_longer(toy, tmp_path):
    assert go(toy, tmp_path / "long", "--stop", "0.3") == 0
    assert go(toy, tmp_path / "short", "--stop", "0.2", "--checkpoint-every", "0.1") == 0
    assert finish(toy, tmp_path / "short", "--stop", "0.3") == 0
    for name in SERIES:
        assert (tmp_path / "short" / name).read_bytes() == (tmp_path / "long" / name).read_bytes()


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--step", "0.0005"], "its step was 0.001 s"),
        (["--scheme", "gauss-seidel"], "its scheme was jacobi, is gauss-seidel"),
        (["--renew", "pantograph"], "cannot renew 'pantograph'"),
        (["--set", "pantograph.static_force=1"], "pantograph.static_force was 140.0, is 1.0"),
        (["--stop", "0.1"], "it was saved at 0.2 s, the run would end at 0.1 s"),
        (["--out", "elsewhere"], "finishes the run in that folder"),
    ],
)
def test_a_run_goes_on_only_as_it_began(toy, killed, capsys, options, text):
    before = (killed / SERIES[0]).read_bytes()
    command = [str(toy), "--no-build", "--quiet", "--resume", str(killed), "--set", "catenary.fail_at=0.3", *options]
    assert main(command) == (2 if "--out" in options else 1)  # --resume and --out exclude one another
    assert text in " ".join(capsys.readouterr().err.split())
    assert (killed / SERIES[0]).read_bytes() == before


@pytest.mark.parametrize(
    ("spoil", "text"),
    [
        (lambda f: (f / checkpoint.NAME).unlink(), "holds no checkpoint.state to continue from"),
        (lambda f: (f / SERIES[1]).write_text("time [s],other\n0,1\n"), "records other variables than this run does"),
        (lambda f: (f / SERIES[0]).write_bytes((f / SERIES[0]).read_bytes()[:9000]), "some are lost"),
        (lambda f: (f / "summary.json").write_text('{"generator": "openpanto master", "run": "x"}'), "another run"),
        (lambda f: (f / "summary.json").write_text('{"generator": "openpanto master"}'), "another run"),
        (lambda f: (f / "summary.json").unlink(), "is not a results folder"),
    ],
)
def test_what_does_not_belong_together_is_refused(toy, killed, capsys, spoil, text):
    spoil(killed)
    command = [str(toy), "--no-build", "--quiet", "--resume", str(killed), "--set", "catenary.fail_at=0.3"]
    assert main(command) == 1
    assert text in " ".join(capsys.readouterr().err.split())


def test_a_killed_run_can_be_reported_on(toy, tmp_path):
    folder = tmp_path / "out"
    kill(started(toy, folder, "--stop", "1e3"), folder, 200_000, 0.0)
    assert main(["report", str(folder)]) == 0
    page = (folder / "report.html").read_text()
    assert "Incomplete" in page
    summary = run_results.read(folder).summary
    assert summary["status"] == "running"
    assert summary["quality"][0]["mean"] > 0.0
    assert (folder / "geometry.json").exists()


def test_a_full_disk_ends_the_run_with_one_sentence(toy, tmp_path):
    """No file may grow beyond a limit that an FMU's library just keeps, as if there were no more room."""
    folder = tmp_path / "out"
    limit = 1_000_000

    def restrict():
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    process = started(toy, folder, "--stop", "1e3", preexec_fn=restrict)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert said.count("\n") == 1
    assert said.startswith(f"error: {folder}/timeseries.csv cannot be written (File too large); make room there")
    check_readable(folder)
    assert limit - 1000 < (folder / SERIES[0]).stat().st_size <= limit
    assert run_results.read(folder).summary["status"] == "failed"


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (errno.ENOSPC, "summary.json cannot be written (No space left on device); make room there, or choose another"),
        (errno.EACCES, "summary.json cannot be written (Permission denied); choose another folder with --out"),
        (errno.EROFS, "summary.json cannot be written (Read-only file system); choose another folder with --out"),
    ],
)
def test_a_folder_that_takes_nothing_is_told_before_the_run(toy, tmp_path, monkeypatch, capsys, number, text):
    def refuse(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(safe_files.os, "fsync", refuse)
    assert go(toy, tmp_path / "out") == 1
    assert " ".join(capsys.readouterr().err.split()).startswith(f"error: {tmp_path / 'out'}/{text}")
    assert list((tmp_path / "out").iterdir()) == []


def test_a_folder_of_a_run_killed_at_once_is_taken_over(toy, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "summary.json.part").write_text("{")
    assert go(toy, folder, "--stop", "0.01") == 0
    (folder / "checkpoint.state.part").write_text("half")
    assert go(toy, folder, "--stop", "0.01") == 0
    assert not list(folder.glob("*.part"))


def test_no_room_for_the_summary_leaves_the_rows(toy, tmp_path, monkeypatch, capsys):
    folder, write = tmp_path / "out", results_folder.write_atomically

    def full(path, data):
        if b'"quality"' in data:
            raise safe_files.cannot_write(path, OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))
        write(path, data)

    monkeypatch.setattr(results_folder, "write_atomically", full)
    assert go(toy, folder, "--stop", "0.2") == 1
    assert "What was written before is in" in " ".join(capsys.readouterr().err.split())
    assert len(load(folder / SERIES[0]).time) == 201


class TestAppendOnlyFile:
    def test_lines_that_still_fit_are_kept_and_no_piece_of_one(self, tmp_path, monkeypatch):
        file = AppendOnlyFile(tmp_path / "a")
        file.write(b"first\n")
        room, write = [14], os.write

        def little(descriptor, data):
            if not room[0]:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            done = write(descriptor, data[: room[0]])
            room[0] -= done
            return done

        monkeypatch.setattr(safe_files.os, "write", little)
        with pytest.raises(MasterError, match="No space left on device"):
            file.write(b"second\nthird\nfourth\n")
        monkeypatch.undo()
        assert (tmp_path / "a").read_text() == "first\nsecond\nthird\n"
        file.write(b"fifth\n")
        file.close()
        file.close()
        assert (tmp_path / "a").read_text() == "first\nsecond\nthird\nfifth\n"

    def test_what_is_kept_is_gone_on_with(self, tmp_path):
        (tmp_path / "a").write_text("first\nsecond\nthi")
        file = AppendOnlyFile(tmp_path / "a", keep=6)
        file.write(b"2\n")
        file.close()
        assert (tmp_path / "a").read_text() == "first\n2\n"


def test_a_file_is_replaced_as_a_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "a"
    write_atomically(path, b"old")

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(safe_files.os, "fsync", full)
    with pytest.raises(MasterError, match="a cannot be written"):
        write_atomically(path, b"new")
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


@pytest.mark.parametrize(("step", "every"), [(1e-3, 1), (1e-3, 5), (5e-3, 10), (0.3, 1), (0.4, 3), (1e-3, 2000)])
def test_no_more_than_a_second_waits_to_be_written(tmp_path, step, every):
    """Whenever the run is ended, every row more than a second old is in the file."""
    path = tmp_path / "a.csv"
    recorder = Recorder(path, [RecordedValues(["t"], np.zeros(1))], {}, every)
    recorder.begin(0.0, None)
    recorded = [0.0]
    for n in range(1, round(6.0 / step)):
        waiting = recorded[path.read_bytes().count(b"\n") - 1 :]
        assert not waiting or n * step - waiting[0] <= LONGEST_UNWRITTEN + 1e-9
        recorder.observe(n, n * step, None)
        if n % every == 0:
            recorded.append(n * step)
    recorder.finish()
    assert load(path).time.tolist() == pytest.approx(recorded)


def test_every_write_is_of_whole_lines(tmp_path, monkeypatch):
    written, write = [], os.write

    def note(descriptor, data):
        written.append(bytes(data))
        return write(descriptor, data)

    monkeypatch.setattr(safe_files.os, "write", note)
    recorder = Recorder(tmp_path / "a.csv", [RecordedValues(["t"], np.zeros(1))], {})
    recorder.begin(0.0, None)
    for n in range(1, 2000):
        recorder.observe(n, n * 1e-3, None)
    recorder.finish()
    assert len(written) < 15
    assert all(piece.endswith(b"\n") for piece in written)
    assert b"".join(written) == (tmp_path / "a.csv").read_bytes()
