"""Every output replaces the old one as a whole: nothing is written but by the few functions that do so."""

from __future__ import annotations

import ast
import errno
import io
import os
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from fmus.builder import fmu_build as building
from fmus.builder import recipe
from fmus.builder.recipe import BuildError
from master.batch.calibration import store_value
from master.errors import MasterError
from master.safety import safe_files
from master.safety.safe_files import PART, atomic_file, write_atomically
from master.ssp.pack import pack
from models.commands import physics_files
from models.definition_files.parameter import ParameterError

ROOT = Path(__file__).parents[1]
#: Calls that write to a file by its name.
WRITES = {"write_text", "write_bytes", "savefig", "savetxt", "write_table", "saving", "save", "savez", "to_csv"}
#: Functions that may: they write beside the file's place, into memory, or into a temporary folder of their own.
WHOLE = {
    "master/safety/folder_lock.py": {"_sign"},
    "master/results/results_folder.py": {"write_forces"},
    "master/safety/safe_files.py": {"write_atomically"},
    "master/report/report_files.py": {"write_charts"},
    "master/results/parquet_export.py": {"_write"},
    "master/batch/sweep/sweep_table.py": {"write_parquet"},
    "master/batch/sweep/lane_system.py": {"write"},
    "master/batch/sweep/lanes_engine.py": {"_process"},
    "master/report/film_file.py": {"write_film"},
    "master/fmu/kept_fingerprints.py": {"keep_answer"},
    "master/ssp/pack.py": {"pack"},
    "models/commands/desk/inline_figure.py": {"inline_figure"},
    "models/commands/physics_files.py": {"write_atomically", "write_csv", "write_figure"},
    "models/layout/xlsx_sheets.py": {"workbook_bytes"},
    "models/numerics/kernel_cache.py": None,
    "models/numerics/user_cache.py": {"keep_arrays"},
    "fmus/builder/fmu_build.py": {"_describe", "_zipped", "_write_atomically"},
    "fmus/loader/runtime.py": {"_archive", "_replace"},
}
#: Functions that are called ``write_text`` and ``save`` and are no writing by a file's name.
HARMLESS = {
    "results_folder.write_text",
    "algorithm.save",
    "observer.save",
    "slave.save",
    "self.save",
    "self._instance.save",
}


def writing_calls(path: Path):
    """Return function and text of every call that writes a file by its name."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for function in (n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)):
        for call in (n for n in ast.walk(function) if isinstance(n, ast.Call)):
            name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
            modes = [a.value for a in call.args if isinstance(a, ast.Constant) and isinstance(a.value, str)]
            opens = name in ("open", "ZipFile", "fdopen") and any(set(m) & set("wax") and len(m) < 4 for m in modes)
            if opens or (name in WRITES and isinstance(call.func, ast.Attribute)):
                yield function.name, ast.unparse(call.func)


def test_nothing_is_written_but_as_a_whole():
    found = []
    for package in ("master", "models", "fmus"):
        for path in sorted((ROOT / package).rglob("*.py")):
            may = WHOLE.get(path.relative_to(ROOT).as_posix(), set())
            calls = writing_calls(path) if may is not None else ()
            found += [(path.name, *call) for call in calls if call[0] not in may and call[1] not in HARMLESS]
    assert found == []


def full(*_):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))  # without a name, as the system tells it when writing


@pytest.mark.parametrize(
    ("write", "raised"),
    [
        (lambda p: write_atomically(p, b"new"), MasterError),
        (lambda p: physics_files.write_text(p, "new"), OSError),
        (lambda p: physics_files.write_csv(p, ["a"], [np.zeros(3)]), OSError),
        (lambda p: physics_files.write_figure(p, Figure(), 50), OSError),
        (lambda p: building._write_atomically(p, b"new"), OSError),
    ],
)
def test_a_full_disk_leaves_the_old_file_and_names_it(tmp_path, monkeypatch, write, raised):
    path = tmp_path / "some.png"
    path.write_text("old")
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(raised) as error:
        write(path)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["some.png"]
    if write.__code__.co_names[0] != "building":  # the builder's caller names it, see below
        assert str(path) in str(error.value)
        assert "No space left on device" in str(error.value)


def test_an_fmu_that_cannot_be_written_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(building, "archive", lambda *_: b"new")
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(BuildError, match=r"Pantograph_CX\.fmu cannot be written \(No space left on device\)"):
        building.build(recipe.recipe("Pantograph_CX"), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_pack_that_does_not_fit_leaves_the_old_one(tmp_path, monkeypatch):
    (tmp_path / "s.ssp").mkdir()
    (tmp_path / "s.ssp" / "SystemStructure.ssd").write_text(f"<a>{'x' * 1000}</a>")
    archive = tmp_path / "out.ssp"
    archive.write_text("old")
    monkeypatch.setattr(safe_files.os, "fsync", full)
    with pytest.raises(MasterError, match=r"out\.ssp cannot be written \(No space left on device\); make room"):
        pack(tmp_path / "s.ssp", archive)
    assert archive.read_text() == "old"
    assert not (tmp_path / ("out.ssp" + PART)).exists()


def test_a_calibrated_value_that_does_not_fit_leaves_the_scenario(tmp_path, monkeypatch):
    path = tmp_path / "p.ssv"
    old = '<ssv:Parameter name="f"><ssv:Real value="1"/></ssv:Parameter>'
    path.write_text(old)
    monkeypatch.setattr(safe_files.os, "fsync", full)
    with pytest.raises(MasterError, match=r"p\.ssv cannot be written"):
        store_value(path, "f", 2.0, "found")
    assert path.read_text() == old


def test_an_interruption_leaves_the_old_file(tmp_path):
    path = tmp_path / "x"
    path.write_text("old")
    with atomic_file(path) as temporary:
        temporary.write_text("new")
    with pytest.raises(KeyboardInterrupt), atomic_file(path) as temporary:
        _interrupted(temporary)
    assert [p.read_text() for p in tmp_path.iterdir()] == ["new"]


def _interrupted(path):
    path.write_text("half")
    raise KeyboardInterrupt


def test_a_figure_of_no_known_format_is_told(tmp_path):
    with pytest.raises(ParameterError, match=r"x\.abc: a figure must be named \.png or \.svg"):
        physics_files.write_figure(tmp_path / "x.abc", Figure(), 50)


def test_a_full_standard_output_is_named(monkeypatch, capsys):
    from fmus.__main__ import main

    class Full(io.StringIO):
        def flush(self):
            full()

    monkeypatch.setattr("sys.stdout", Full())
    assert main(["list"]) == 1
    assert capsys.readouterr().err == "error: standard output: No space left on device\n"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes with names")
@pytest.mark.parametrize(
    ("write", "raised"), [(safe_files.write_atomically, MasterError), (physics_files.write_atomically, OSError)]
)
def test_what_is_no_file_is_not_replaced(tmp_path, write, raised):
    """Such as /dev/null, for everybody, when it is root who writes."""
    path = tmp_path / "device"
    os.mkfifo(path)
    with pytest.raises(raised, match="is not a file and is left alone"):
        write(path, b"new")
    assert path.is_fifo()
    assert [p.name for p in tmp_path.iterdir()] == ["device"]
