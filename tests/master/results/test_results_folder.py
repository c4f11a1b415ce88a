"""The results folder of a run: whose it is, and what a claim leaves in it."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from master.errors import RequestError
from master.results.results_folder import (
    GENERATOR,
    SUMMARY,
    RunFolder,
    claimed_for_run,
    contents_of,
    replaced_run,
)


def summary_of(run):
    return {"generator": GENERATOR, "run": run}


def continued(run, folder):
    checkpoint = SimpleNamespace(run=run)
    return SimpleNamespace(checkpoint=checkpoint, file=folder / "checkpoint.state", is_same_run=True)


def test_a_new_run_finds_its_folder_empty_and_gets_its_own_identity(tmp_path):
    folder = tmp_path / "out"
    with claimed_for_run(folder) as first:
        first.write_summary(summary_of(first.run))
        (folder / "timeseries.csv").write_text("time [s]\n0\n")
        (folder / "notes.txt").write_text("the user's")
    with claimed_for_run(folder) as second:
        assert second.run != first.run
        assert sorted(p.name for p in folder.iterdir() if not p.name.startswith(".")) == ["notes.txt", SUMMARY]
        assert contents_of(folder / SUMMARY) == {**summary_of(first.run), "status": "running"}


@pytest.mark.parametrize("removed", range(4))
def test_whoever_is_killed_while_old_results_are_removed_leaves_a_folder_of_ours(tmp_path, monkeypatch, removed):
    with claimed_for_run(tmp_path) as own:
        own.write_summary({**summary_of(own.run), "status": "complete"})
    for name in ("notes.txt", "timeseries.csv", "report.html", "force.png", "checkpoint.state"):
        (tmp_path / name).write_text("there")
    results, unlink = iter(range(removed)), Path.unlink

    def kill(path):
        if not path.name.startswith(".") and next(results, None) is None:
            raise KeyboardInterrupt
        unlink(path)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", kill)
        with pytest.raises(KeyboardInterrupt), claimed_for_run(tmp_path):
            pass
    assert contents_of(tmp_path / SUMMARY)["status"] == "running"
    with claimed_for_run(tmp_path):
        assert sorted(p.name for p in tmp_path.iterdir() if not p.name.startswith(".")) == ["notes.txt", SUMMARY]


def test_a_run_knows_whether_its_results_still_lie_there(tmp_path):
    with claimed_for_run(tmp_path / "out") as own:
        assert not own.holds_this_run  # nothing is written yet
        own.write_summary(summary_of(own.run))
        assert own.holds_this_run
        own.write_summary(summary_of("another"))
        assert not own.holds_this_run


def test_only_the_run_of_the_checkpoint_continues_in_its_folder(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    RunFolder(folder, "first").write_summary(summary_of("first"))
    (folder / "timeseries.csv").write_text("time [s]\n0\n")
    with claimed_for_run(folder, continued("first", folder)) as own:
        assert own.run == "first"
        assert (folder / "timeseries.csv").exists()
    with (
        pytest.raises(RequestError, match="comes from another run"),
        claimed_for_run(folder, continued("second", folder)),
    ):
        pass


def test_a_run_with_other_definitions_is_told_that_it_replaces_one(tmp_path):
    own = {"catenary": "a/lines/x.toml", "pantograph": ""}
    assert replaced_run(tmp_path, own) == ""
    components = [{"name": name, "definition": file} for name, file in own.items()]
    (tmp_path / SUMMARY).write_text(json.dumps({"components": components}))
    assert replaced_run(tmp_path, own) == ""
    said = replaced_run(tmp_path, {**own, "catenary": "b/lines/x.toml"})
    assert said == f"{tmp_path} held a run with a/lines/x.toml, which this one replaces; --out DIR keeps both"
    (tmp_path / SUMMARY).write_text('{"components": [1]}')
    assert replaced_run(tmp_path, own) == ""
