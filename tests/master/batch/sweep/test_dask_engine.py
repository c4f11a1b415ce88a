"""Sweeps on Dask workers: the same table whoever makes the runs, and whoever of them dies."""

import json
import os
import re
import signal
import socket
import time
from contextlib import contextmanager

import pytest

from master.batch.sweep.sweep_run import RunPlace
from master.commands.main import main
from master.errors import MasterError
from tests import forked_commands
from tests.effort import IS_LONG
from tests.master.batch.sweep.conftest import GRID, ROOT, ended, journal

distributed = pytest.importorskip("distributed")
import dask.config  # noqa: E402 (it comes with distributed)

from master.batch.sweep import dask_engine, local_cluster  # noqa: E402 (it needs distributed)
from master.batch.sweep.dask_engine import DaskEngine  # noqa: E402
from master.batch.sweep.engine_selection import engine_of  # noqa: E402

SMALL = {"over": {"catenary.stiffness": "4000:6000:500"}}


def _free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Cluster:
    """A scheduler and workers, each a process of its own."""

    def __init__(self, folder):
        self.folder, self.port = folder, _free_port()
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.workers = []
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard")

    def _start(self, kind, *options):
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
        command = (f"distributed.cli.dask_{kind}", *options)
        return forked_commands.start(*command, cwd=self.folder, env=environment, crew="sweep")

    def add_worker(self):
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1", "--death-timeout", "60")
        self.workers.append(self._start("worker", self.address, *options, "--local-directory", str(self.folder)))
        return self.workers[-1]

    def end(self):
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@contextmanager
def cluster_of(folder, workers=2):
    folder.mkdir(exist_ok=True)
    cluster = Cluster(folder)
    try:
        for _ in range(workers):
            cluster.add_worker()
        deadline = time.monotonic() + 60.0
        while True:
            try:
                with distributed.Client(cluster.address, timeout=2.0) as client:
                    client.wait_for_workers(workers, timeout=30.0)
                break
            except (OSError, TimeoutError):
                assert time.monotonic() < deadline
        yield cluster
    finally:
        cluster.end()


@pytest.fixture(scope="module")
def crew(tmp_path_factory):
    """A scheduler with two workers that live as long as the module's tests."""
    with cluster_of(tmp_path_factory.mktemp("cluster")) as found:
        yield found


@pytest.fixture
def forked_processes(monkeypatch):
    """Let Dask's processes be forks of one that has imported what they need; elsewhere they begin as users' do."""
    monkeypatch.setenv("DASK_DISTRIBUTED__WORKER__MULTIPROCESSING_METHOD", "forkserver")
    with dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"}):
        yield


def _wait_for_runs(process, folder, count):
    deadline = time.monotonic() + 90.0
    while len(journal(folder)) < count:
        assert time.monotonic() < deadline
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)


@pytest.mark.usefixtures("forked_processes")
def test_the_same_bits_here_with_processes_and_through_a_scheduler(swept, tmp_path, crew):
    engines = {"one": DaskEngine(jobs=1, renew_after=2), "cluster": DaskEngine(scheduler=crew.address)}
    if IS_LONG:
        engines["two"] = DaskEngine(jobs=2)
    swept("here", **SMALL)
    for name, engine in engines.items():
        swept(name, engine, **SMALL)
    table = (tmp_path / "here" / "sweep.csv").read_bytes()
    assert table.count(b"\n") == 6
    assert {(tmp_path / name / "sweep.csv").read_bytes() for name in engines} == {table}
    used = {name: {run["worker"] for run in journal(tmp_path / name)} for name in engines}
    assert len(used.pop("one")) >= 2, "a process is renewed after two runs"
    assert {len(workers) for workers in used.values()} == {2}


@pytest.mark.long  # `test_child_engine` tries it in every run
def test_a_run_whose_worker_always_dies_is_a_row_and_the_others_go_on(exiting_toy, command, tmp_path):
    process = command("--over", "catenary.fail_at=0.2,9,10", "--jobs", "1", quiet=False)
    code, error = ended(process)
    assert code == 1
    assert re.search(r"worker 127\S+ died in run 1; the run is made once more", error)
    assert re.search(r"worker 127\S+ died in run 1 too; the run has failed", error)
    data = json.loads((tmp_path / "out" / "sweep.json").read_text())
    assert data["failures"] == {"1": "the worker's process died in this run, 2 times"}
    assert (data["status"], data["finished"]) == ("complete", 3)


@pytest.mark.long  # as are all of them, one after the other, below
def test_a_worker_that_is_killed_costs_its_run_one_retry(command, tmp_path, whole_table):
    with cluster_of(tmp_path / "cluster") as cluster:
        process = command(*GRID, "--scheduler", cluster.address, quiet=False)
        _wait_for_runs(process, tmp_path / "out", 2)
        cluster.workers[0].kill()
        code, error = ended(process)
    assert code == 0, error
    assert len(re.findall(r"worker 127\S+ died in run \d; the run is made once more", error)) <= 1
    assert (tmp_path / "out" / "sweep.csv").read_bytes() == whole_table


def test_whoever_is_killed_a_second_sweep_ends_with_the_same_table(command, tmp_path, whole_table):
    """The master, then the scheduler, and then all workers; each time the sweep goes on where it was."""
    out = tmp_path / "out"
    with cluster_of(tmp_path / "cluster") as cluster:
        process = command(*GRID, "--scheduler", cluster.address)
        _wait_for_runs(process, out, 2)
        os.kill(process.pid, signal.SIGKILL)
        ended(process)
        process = command(*GRID, "--scheduler", cluster.address)
        _wait_for_runs(process, out, 4)
        cluster.scheduler.kill()
        code, error = ended(process)
        assert code == 1
        assert "is gone; start the sweep again to go on" in error
    before = len(journal(out))
    assert 4 <= before < 9
    with cluster_of(tmp_path / "other", workers=1) as cluster:
        process = command(*GRID, "--scheduler", cluster.address)
        _wait_for_runs(process, out, before + 1)
        for worker in cluster.workers:
            worker.kill()
        cluster.add_worker()
        assert ended(process)[0] == 0
    assert len(journal(out)) == 9
    assert (out / "sweep.csv").read_bytes() == whole_table


@pytest.mark.usefixtures("forked_processes")
def test_an_interruption_ends_the_processes_and_leaves_what_is_finished(command, tmp_path, whole_table):
    process = command(*GRID, "--jobs", "2")
    _wait_for_runs(process, tmp_path / "out", 2)
    process.send_signal(signal.SIGINT)
    code, error = ended(process)
    assert code == 1
    assert re.fullmatch(r"error: interrupted. \d of 9 runs are finished and in .*\n", error)
    data = json.loads((tmp_path / "out" / "sweep.json").read_text())
    assert data["status"] == "interrupted"
    assert data["finished"] >= 2
    assert ended(command(*GRID)) == (0, "")
    assert (tmp_path / "out" / "sweep.csv").read_bytes() == whole_table


def test_processes_that_cannot_be_started_are_one_sentence(swept, tmp_path, monkeypatch):
    def ended(**_):
        raise RuntimeError("Nanny failed to start.") from OSError("Cannot allocate memory")

    ended._instances = set()
    monkeypatch.setattr(local_cluster, "LocalCluster", ended)
    text = "the 2 processes of --jobs cannot be started (Cannot allocate memory); start the sweep again"
    with pytest.raises(MasterError, match=re.escape(text)):
        swept("out", DaskEngine(jobs=2), **SMALL)
    with pytest.raises(MasterError, match="does its work under: if __name__ == '__main__':"):
        swept("out", engine_of(2, None, lambda _: None, is_script=True), **SMALL)
    assert journal(tmp_path / "out") == []


def test_processes_that_are_interrupted_as_they_start_do_not_trip_dask_at_its_end(monkeypatch):
    class HalfMade:
        _instances = set()  # noqa: RUF012 (as Dask has it)

        def __init__(self, **_):
            self._instances.add(self)
            raise KeyboardInterrupt

        def close(self, timeout=None):
            raise AssertionError("Status.init")

    assert hasattr(distributed.LocalCluster, "_instances")
    HalfMade._instances.add("of another")
    monkeypatch.setattr(local_cluster, "LocalCluster", HalfMade)
    with pytest.raises(KeyboardInterrupt):
        local_cluster.local_cluster(2, "auto")
    assert HalfMade._instances == {"of another"}


@pytest.mark.parametrize("jobs", [0, -3, 1.5, "2"])
def test_a_number_of_processes_that_is_none_is_one_sentence(jobs):
    with pytest.raises(MasterError, match=f"jobs: {jobs!r} is not a whole number above 0"):
        engine_of(jobs, None, lambda _: None)


def test_a_worker_that_ends_for_its_memory_is_told_with_the_limit(toy_system, tmp_path):
    engine = DaskEngine(jobs=1, memory_limit="60MB")
    crew = dask_engine._Crew(None, toy_system, RunPlace(tmp_path / "runs", "figures"), engine, lambda: None)
    assert (
        crew._problem(OSError("Stream is closed")) == "died before its first run: --memory-limit 60MB may be too little"
    )
    engine.memory_limit = "auto"
    assert crew._problem(OSError("Stream is closed")) == "cannot be examined: Stream is closed"


@pytest.mark.parametrize("limit", ["much", "-1GB", "0"])
def test_a_size_of_memory_that_is_none_is_one_sentence(limit):
    with pytest.raises(MasterError, match=f"'{limit}' is no size of memory"):
        local_cluster.local_cluster(1, limit)


def test_a_scheduler_that_does_not_answer_is_one_sentence(toy, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(dask_engine, "_PATIENCE", 1.5)
    began = time.monotonic()
    address = f"tcp://127.0.0.1:{_free_port()}"
    command = ["sweep", str(toy), *GRID, "--scheduler", address, "--out", str(tmp_path / "out"), "--no-build"]
    assert main([*command, "--quiet"]) == 1
    error = " ".join(capsys.readouterr().err.split())
    assert re.fullmatch(r"error: no Dask scheduler answers at tcp://127.0.0.1:\d+ within 1.5 s; .*", error)
    assert time.monotonic() - began < 30.0
    assert not (tmp_path / "out" / "sweep.csv").exists()


@pytest.mark.parametrize("address", ["nowhere", "tcp://", "http//x"])
def test_an_address_that_is_none_is_one_sentence(swept, address):
    with pytest.raises(MasterError, match="is not the address of a Dask scheduler"):
        swept("out", DaskEngine(scheduler=address), **SMALL)


def test_workers_with_other_versions_are_refused_before_anything_runs(swept, tmp_path, crew, monkeypatch):
    ours = dask_engine.versions()
    monkeypatch.setattr(dask_engine, "versions", lambda: {**ours, "numpy": "0.9"})
    with pytest.raises(MasterError, match=r"worker 127\S+ has other versions: numpy \S+, here 0.9") as caught:
        swept("out", DaskEngine(scheduler=crew.address), **SMALL)
    assert "\n" not in str(caught.value)
    assert journal(tmp_path / "out") == []
