"""Copies of FMUs that a sweep holds."""

from master.batch.sweep.dask_engine import ScenarioOnWorker, _anywhere
from master.batch.sweep.held_fmus import held_fmus


def test_workers_find_them_from_their_own_working_folder(toy_system, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path.relative_to(tmp_path)  # as --out gives it
    with held_fmus(toy_system, folder) as held:
        paths = [c.fmu.path for c in held.components]
        assert all(path.is_absolute() and path.is_file() for path in paths)
    assert not any(path.exists() for path in paths)


def test_what_dask_sends_names_its_fmus_by_whole_paths(toy_system, tmp_path, monkeypatch):
    from dataclasses import replace
    from pathlib import Path

    near = tuple(replace(c, fmu=replace(c.fmu, path=Path("near") / c.fmu.path.name)) for c in toy_system.components)
    monkeypatch.chdir(tmp_path)
    sent = ScenarioOnWorker(_anywhere(replace(toy_system, components=near)), None).base
    assert [c.fmu.path for c in sent.components] == [tmp_path / "near" / c.fmu.path.name for c in near]
