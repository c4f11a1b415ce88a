"""Whole sweeps of the toy scenario: the table, runs that fail, what is kept, and what a second sweep does."""

import csv
import io
import json
import math
import os
import re
import signal
import time
from dataclasses import replace
from types import SimpleNamespace

import pytest

from master import run_session
from master.batch.sweep import sweep_run, sweep_session
from master.batch.sweep.pages import grid_charts
from master.batch.sweep.sweep_engines import HereEngine
from master.batch.sweep.sweep_plan import SweepRequest
from master.batch.sweep.sweep_run import SweepResult
from master.batch.sweep.sweep_session import PreparedSweep, as_data, sweep, write_report
from master.batch.sweep.sweep_table import as_csv, write_parquet
from master.commands.main import main
from master.errors import InterruptedRunError, MasterError
from master.results import results_folder
from master.results.results_folder import WORK
from tests.master.batch.sweep.conftest import GRID, ended, journal

STIFFNESSES = {"over": {"catenary.stiffness": "4000,5000,6000"}}


def table(folder):
    return list(csv.DictReader(io.StringIO((folder / "sweep.csv").read_text())))


class Backwards(HereEngine):
    """Makes the last run first, and counts."""

    def __init__(self):
        self.made = []

    def opened(self, base, place):
        import contextlib

        @contextlib.contextmanager
        def ready():
            with super(Backwards, self).opened(base, place) as make:

                def made(runs):
                    for run in reversed(runs):
                        if not run.is_rehearsal:
                            self.made.append(run.number)
                        yield from make([run])

                yield made

        return ready()


def test_the_table_has_inputs_and_figures_to_the_last_bit(swept, tmp_path):
    done = swept(**STIFFNESSES)
    rows = table(tmp_path / "out")
    assert [float(row["catenary.stiffness"]) for row in rows] == [4000.0, 5000.0, 6000.0]
    assert [float(row["sigma [N]"]) for row in rows] == [row["sigma [N]"] for row in done.rows]
    assert {row["status"] for row in rows} == {"complete"}
    assert done.status == "complete"


def test_parquet_holds_the_same(swept, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    done = swept(**STIFFNESSES)
    assert parquet.read_table(tmp_path / "out" / "sweep.parquet").column("mean [N]").to_pylist() == [
        row["mean [N]"] for row in done.rows
    ]


def test_programs_read_whole_numbers_and_truths_as_such(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    inputs = {"a.n": ("-1", "2"), "a.on": ("true", "false"), "a.file": ("7", "x"), "key": ("11", "12")}
    rows = [{"run": 1.0 + k, **{n: v[k] for n, v in inputs.items()}, "passed": ("", "true")[k]} for k in (0, 1)]
    write_parquet(rows, tmp_path / "t.parquet")
    assert parquet.read_table(tmp_path / "t.parquet").to_pydict() == {
        "run": [1, 2],
        "a.n": [-1, 2],
        "a.on": [True, False],
        "a.file": ["7", "x"],
        "key": ["11", "12"],
        "passed": [None, True],
    }
    assert as_csv(rows).splitlines()[1] == "1,-1,true,7,11,"


def test_an_option_that_runs_would_not_heed_is_refused(toy, capsys):
    grid = ["sweep", str(toy), "--over", "speed=40,50", "--dry-run", "--no-build"]
    assert main([*grid, "--set", "pantograph.speed=60"]) == 1
    assert "'pantograph.speed' is varied, so it cannot be given a value for all runs" in capsys.readouterr().err
    assert main([*grid[:-2], "--memory-limit", "2GB", "--no-build"]) == 2
    assert "--memory-limit is of the processes that --jobs starts" in capsys.readouterr().err


def test_a_figure_that_is_no_number_is_an_empty_cell(ishigami_swept, tmp_path, monkeypatch):
    figure = SimpleNamespace(name="f.y", unit="", end=math.nan, minimum=-math.inf, maximum=1.0, mean=math.nan)
    monkeypatch.setattr(sweep_run, "output_figures", lambda _: [figure])
    done = ishigami_swept(over={"f.x3": "1,2"})
    assert [row["f.y end [1]"] for row in done.rows] == [None, None]
    assert [row["f.y maximum [1]"] for row in done.rows] == [1.0, 1.0]
    assert "nan" not in (tmp_path / "out" / "sweep.csv").read_text()


def test_runs_that_will_have_no_figures_are_told_before_the_first_one_others_at_the_end(
    toy_system, tmp_path, monkeypatch
):
    told = []
    asked = SweepRequest.read({"over": {"catenary.stiffness": "4000,5000"}, "stop": 0.2})
    known = {1: "the run ends at 0.2 s: stop at 1 s", 2: ""}
    monkeypatch.setattr(sweep_session, "uncovered", lambda system: known[int(system.name[-1])])
    prepared = PreparedSweep.of(replace(toy_system, may_stop_early=True), asked)
    sweep(prepared, tmp_path / "out", tell=told.append)
    assert told[0] == f"1 run will have no figures; run 1: {known[1]}"
    assert told[1].startswith("2 runs, 1 at a time")
    assert told[2].startswith("1 run has no figures; run 2: the run ends with 'pantograph' at ")


@pytest.mark.parametrize("verb", [["sweep"], ["optimise", "--minimise", "sigma", "--vary", "catenary.stiffness=1:2"]])
def test_a_folder_that_cannot_be_had_is_told_before_anything_is_built(toy, tmp_path, monkeypatch, capsys, verb):
    (tmp_path / "notes").write_text("mine")
    for path in (toy / "resources").glob("*.fmu"):
        path.unlink()  # what would be told next
    for out, why in (
        ("notes/out", f"cannot be made: {tmp_path}/notes is a file"),
        ("a/b", f"no permission in {tmp_path}"),
    ):
        assert main([verb[0], str(toy), *verb[1:], "--out", str(tmp_path / out)]) == 1
        assert why in capsys.readouterr().err
        monkeypatch.setattr(results_folder.os, "access", lambda *_: False)
    monkeypatch.chdir(tmp_path)
    assert main([verb[0], str(toy), *verb[1:]]) == 1
    assert "the folder results/" in capsys.readouterr().err


def test_what_was_thinned_is_made_again_if_all_is_to_be_kept(swept, tmp_path):
    over = {"over": {"catenary.stiffness": "4000"}}
    (run,) = swept(keep="thinned", **over).runs
    engine = Backwards()
    swept("out", engine, keep="all", **over)
    assert engine.made == [1]
    assert (tmp_path / "out" / "runs" / run.key / "timeseries.csv").is_file()
    engine = Backwards()
    swept("out", engine, keep="thinned", **over)
    assert engine.made == []


def test_the_time_of_a_first_run_is_not_that_of_all(toy_system, tmp_path):
    class Cold(HereEngine):
        """Takes long in its first run alone."""

        def opened(self, base, place):
            import contextlib

            def made(runs):
                for run in runs:
                    self.count += 1
                    yield SweepResult(run.key, seconds=1000.0 if self.count == 1 else 1.0, stepping=0.1)

            self.count = 0
            return contextlib.nullcontext(made)

    told = []
    prepared = PreparedSweep.of(toy_system, SweepRequest.read(STIFFNESSES))
    sweep(prepared, tmp_path / "out", Cold(), told.append)
    assert told == ["3 runs, 1 at a time, about 6 s"]  # 3 * (0.9 s + 1000 steps of 0.1 s / 100)


def test_the_order_of_the_runs_does_not_matter(swept, tmp_path):
    swept("one", **STIFFNESSES)
    swept("two", Backwards(), **STIFFNESSES)
    assert (tmp_path / "one" / "sweep.csv").read_bytes() == (tmp_path / "two" / "sweep.csv").read_bytes()


def test_a_second_sweep_makes_only_what_is_missing(swept, tmp_path):
    swept(**STIFFNESSES)
    engine = Backwards()
    swept("out", engine, over={"catenary.stiffness": "4000:6000:500"})
    assert sorted(engine.made) == [2, 4]
    swept("whole", over={"catenary.stiffness": "4000:6000:500"})
    assert (tmp_path / "out" / "sweep.csv").read_bytes() == (tmp_path / "whole" / "sweep.csv").read_bytes()


def test_a_damaged_line_of_the_journal_costs_its_run(swept, tmp_path):
    swept(**STIFFNESSES)
    path = tmp_path / "out" / "sweep_runs.jsonl"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text(lines[0] + "{damaged\n" + lines[2][: len(lines[2]) // 2])
    engine = Backwards()
    swept("out", engine, **STIFFNESSES)
    assert sorted(engine.made) == [2, 3]


def test_a_run_that_fails_is_a_row_with_its_reason(swept, tmp_path):
    done = swept(over={"catenary.fail_at": "0.5,9"})
    rows = table(tmp_path / "out")
    assert [row["status"] for row in rows] == ["failed", "complete"]
    assert "the wire broke at 100 percent load" in rows[0]["reason"]
    assert str(tmp_path) not in rows[0]["reason"]
    assert list(done.failures) == [1]
    engine = Backwards()
    swept("out", engine, over={"catenary.fail_at": "0.5,9"})
    assert engine.made == []


@pytest.mark.parametrize(
    ("keep", "kept"),
    [
        ("figures", [set(), set()]),
        ("failed", [{"summary.json", "timeseries.csv"}, set()]),
        ("thinned", [{"summary.json", "geometry.json"}, {"summary.json", "geometry.json", "contact_force.csv"}]),
        ("all", [{"summary.json", "timeseries.csv"}, {"summary.json", "timeseries.csv", "contact_force.csv"}]),
    ],
)
def test_what_is_kept(swept, tmp_path, keep, kept):
    done = swept(over={"catenary.fail_at": "0.5,9"}, keep=keep)
    for run, names in zip(done.runs, kept, strict=True):
        folder = tmp_path / "out" / "runs" / run.key
        found = {p.name for p in folder.iterdir()} if folder.is_dir() else set()
        assert names <= found
        assert keep != "thinned" or "timeseries.csv" not in found
        assert bool(names) == folder.is_dir()
    assert list((tmp_path / "out").glob(f"runs/{WORK}*")) == []


@pytest.mark.parametrize(("keep", "copied"), [("figures", 0), ("thinned", 0), ("failed", 2), ("all", 2)])
def test_definitions_are_copied_only_into_folders_that_stay_whole(swept, monkeypatch, keep, copied):
    calls = []
    monkeypatch.setattr(run_session, "write_definitions", lambda folder, components: calls.append(folder))
    swept(over={"catenary.stiffness": "4000,8000"}, keep=keep)
    assert len(calls) == copied


def test_the_static_force_is_found_for_the_mean_force(swept):
    done = swept(over={"catenary.stiffness": "4000,8000"}, mean_force="150 N", tolerance=0.5)
    assert [row["mean [N]"] for row in done.rows] == pytest.approx([150.0, 150.0], abs=0.5)
    assert all(row["static force [N]"] != 140.0 for row in done.rows)


def test_fmus_that_are_built_anew_meanwhile_change_no_run(toy, toy_system, swept, tmp_path):
    swept("whole", **STIFFNESSES)
    prepared = PreparedSweep.of(toy_system, SweepRequest.read(STIFFNESSES))

    def build(progress):
        for path in (toy / "resources").glob("*.fmu"):
            path.write_bytes(b"half an FMU")

    sweep(prepared, tmp_path / "out", show=build)
    assert (tmp_path / "out" / "sweep.csv").read_bytes() == (tmp_path / "whole" / "sweep.csv").read_bytes()
    assert not any((tmp_path / "out").glob(f"{WORK}*"))
    with pytest.raises(MasterError, match="has been built anew just now; start the sweep again"):
        sweep(prepared, tmp_path / "late")


def test_equal_runs_are_made_once(swept, tmp_path):
    (tmp_path / "t.csv").write_text("variant,catenary.stiffness\na,4000\nb,4000\n")
    engine = Backwards()
    done = swept("out", engine, table=tmp_path / "t.csv")
    assert engine.made == [1] or engine.made == [2]
    assert [row["variant"] for row in done.rows] == ["a", "b"]
    assert done.rows[0]["mean [N]"] == done.rows[1]["mean [N]"]


def test_an_interruption_leaves_what_is_finished(swept, tmp_path):
    class Impatient(Backwards):
        def opened(self, base, place):
            import contextlib

            @contextlib.contextmanager
            def ready():
                with HereEngine.opened(self, base, place) as make:

                    def made(runs):
                        yield from make(runs[:1])
                        raise InterruptedRunError("interrupted")

                    yield made

            return ready()

    with pytest.raises(InterruptedRunError, match="1 of 3 runs are finished"):
        swept("out", Impatient(), **STIFFNESSES)
    assert [row["run"] for row in table(tmp_path / "out")] == ["1"]
    page = (tmp_path / "out" / "sweep.html").read_text()
    assert "Interrupted. The runs so far follow." in page
    assert "1 of 3 runs finished, 0 of them failed" in page


def test_the_page_is_written_at_the_end_and_again_on_demand(swept, tmp_path, monkeypatch):
    monkeypatch.setattr(grid_charts, "MOST_CHARTS", 1)  # drawing all takes seconds
    swept(**STIFFNESSES)
    folder = tmp_path / "out"
    page = (folder / "sweep.html").read_text()
    assert "3 of 3 runs finished" in page
    (folder / "sweep.html").unlink()
    written = write_report(folder)
    assert (folder / "sweep.html").read_text() == page
    assert [p.name for p in written] == ["sweep.html", "sweep_curves.png"]
    assert all(p.stat().st_size > 5000 for p in written)


def test_a_folder_of_something_else_is_left_alone(swept, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.txt").write_text("mine")
    with pytest.raises(MasterError, match="left alone"):
        swept(**STIFFNESSES)
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["thesis.txt"]


def test_a_sweep_of_another_scenario_is_left_alone(toy_system, tmp_path):
    data = {"generator": "openpanto sweep", "scenario": toy_system.name}
    (tmp_path / "sweep.json").write_text(json.dumps(data))
    (tmp_path / "sweep.csv").write_text("mine")
    other = PreparedSweep.of(replace(toy_system, name="other"), SweepRequest(**STIFFNESSES))
    with pytest.raises(MasterError, match=f"holds a sweep of the scenario '{toy_system.name}', this one is of 'other'"):
        sweep(other, tmp_path)
    assert (tmp_path / "sweep.csv").read_text() == "mine"


LOST = "and its table would be replaced; choose another with --out"


@pytest.mark.parametrize(
    ("changed", "asked", "why"),
    [
        ({"step": 0.0025}, {}, "a sweep with step 0.001 s, this one has step 0.0025 s; choose another with --out"),
        ({"changes": {"a.b": "2"}}, {}, "with no --set a.b, this one has --set a.b=2; choose another with --out"),
        ({}, {"over": {"catenary.stiffness": "4000"}}, f"; 2 of its 3 runs are not among those of this one, {LOST}"),
        (
            {},
            {"over": {"speed": "50"}},
            "another sweep, over catenary.stiffness; 3 of its 3 runs are not",
        ),
        ({}, {"static_force": "130 N"}, f"; 3 of its 3 runs are not among those of this one, {LOST}"),
    ],
)
def test_another_sweep_of_the_scenario_is_left_alone(toy_system, tmp_path, changed, asked, why):
    made = as_data(PreparedSweep.of(toy_system, SweepRequest.read(STIFFNESSES)).outcome)
    assert made["settings"] == {"step": 0.001, "scheme": "jacobi", "tolerance": {}}
    (tmp_path / "sweep.json").write_text(json.dumps({**made, "generator": "openpanto sweep", "finished": 3}))
    other = PreparedSweep.of(replace(toy_system, **changed), SweepRequest.read({**STIFFNESSES, **asked}))
    with pytest.raises(MasterError, match=re.escape(why)):
        sweep(other, tmp_path)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_command_that_is_ended_goes_on_where_it_was(command, tmp_path, number, whole_table):
    process = command(*GRID)
    deadline = time.monotonic() + 60.0
    while len(journal(tmp_path / "out")) < 3:
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.01)
    os.kill(process.pid, number)
    code, _ = ended(process)
    assert code != 0
    done = len(journal(tmp_path / "out"))
    assert 3 <= done < 9
    assert ended(command(*GRID)) == (0, "")
    assert len(journal(tmp_path / "out")) == 9
    assert (tmp_path / "out" / "sweep.csv").read_bytes() == whole_table


def test_the_verb_report_knows_a_sweep(swept, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(grid_charts, "MOST_CHARTS", 1)
    swept(**STIFFNESSES)
    folder = tmp_path / "out"
    (folder / "sweep.html").unlink()
    assert main(["report", str(folder), "--figures", "svg"]) == 0
    assert capsys.readouterr().out.split() == [str(folder / n) for n in ("sweep.html", "sweep_curves.svg")]
    assert "3 of 3 runs finished" in (folder / "sweep.html").read_text()
    assert main(["report", str(folder), "--film", "a.gif"]) == 2
    assert "holds a sweep; --measured, --film and --parquet are of a single run" in capsys.readouterr().err
    (folder / "sweep.csv").write_text("run\n1,2\n")
    assert main(["report", str(folder)]) == 1
    assert "holds no sweep that can be read" in capsys.readouterr().err
