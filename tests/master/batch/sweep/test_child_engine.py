"""Runs in one process beside the command: what crashes there is a row, and nothing else is lost."""

import re

from master.batch.sweep.child_engine import ChildEngine
from master.batch.sweep.sweep_run import DIED
from tests.master.batch.sweep.conftest import journal

RUNS = {"over": {"catenary.fail_at": "0.2,9"}}


def test_a_run_that_no_process_survives_is_a_row_and_the_others_go_on(exiting_toy, swept):
    said = []
    done = swept("out", ChildEngine(said.append), **RUNS)
    assert done.failures == {1: DIED}
    assert [row["status"] for row in done.rows] == ["failed", "complete"]
    assert re.fullmatch(r"the process of run 1 ended itself with exit code 3.*; the run is made once more", said[-2])
    assert re.fullmatch(r"the process of run 1 ended itself with exit code 3.*; the run has failed", said[-1])


def test_a_process_that_is_killed_once_costs_its_run_one_retry(ending_toy, request, tmp_path):
    mark = tmp_path / "killed"
    kill = f"import os, pathlib; mark = pathlib.Path({str(mark)!r})"
    ending_toy(f"{kill}; mark.exists() or (mark.touch(), os.kill(os.getpid(), 9))")
    swept, said = request.getfixturevalue("swept"), []
    done = swept("out", ChildEngine(said.append), **RUNS)
    assert (done.failures, len(done.rows), mark.exists()) == ({}, 2, True)
    assert said == ["the process of run 1 was ended by signal SIGKILL (Killed); the run is made once more"]
    swept("again", ChildEngine(), **RUNS)
    assert (tmp_path / "out" / "sweep.csv").read_bytes() == (tmp_path / "again" / "sweep.csv").read_bytes()


def test_a_crash_in_the_rehearsal_costs_the_estimate_alone(exiting_toy, swept):
    done = swept("out", ChildEngine(), over={"catenary.fail_at": "0.001"})
    assert list(done.failures) == [1]


def test_the_process_is_renewed_and_the_table_is_that_of_this_process(swept, tmp_path):
    stiffnesses = {"over": {"catenary.stiffness": "4000:5000:500"}}
    swept("here", **stiffnesses)
    swept("child", ChildEngine(renew_after=2), **stiffnesses)
    here, child = ((tmp_path / name / "sweep.csv").read_bytes() for name in ("here", "child"))
    assert here == child
    # The rehearsal is a run too.
    assert len({run["worker"] for run in journal(tmp_path / "child")}) == 2
