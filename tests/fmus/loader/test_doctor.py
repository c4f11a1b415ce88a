"""What the doctor says of machines that lack something."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import pytest

from fmus.__main__ import main
from fmus.loader import doctor
from fmus.loader.loader_build import INNER_SUFFIX, PROBE


@pytest.fixture(autouse=True)
def this_python(monkeypatch):
    monkeypatch.setenv("OPENPANTO_PYTHON", sys.executable)


def _said(path):
    found = doctor.examine(path)
    return {level: " | ".join(f.text for f in found if f.level == level) for level in ("ok", "note", "missing")}


def _changed(fmu, folder, change):
    """A copy of an FMU: ``change`` maps a member's name and bytes to new ones, or to None."""
    copy = folder / fmu.name
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(copy, "w") as new:
        for name in old.namelist():
            if (member := change(name, old.read(name))) is not None:
                new.writestr(*member)
    return copy


def test_a_machine_that_has_all(toy_fmu, capsys):
    assert main(["doctor", str(toy_fmu)]) == 0
    out = capsys.readouterr().out
    assert "made a step" in out
    assert "missing" not in out


def test_no_python(toy_fmu, monkeypatch, capsys):
    monkeypatch.setenv("OPENPANTO_PYTHON", "/nowhere/python3")
    assert main(["doctor", str(toy_fmu)]) == 1
    assert "no Python found: '/nowhere/python3' cannot be run" in capsys.readouterr().out


def test_python_without_the_packages(toy_fmu, tmp_path, monkeypatch):
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(tmp_path / "bare")], check=True)
    monkeypatch.setenv("OPENPANTO_PYTHON", str(tmp_path / "bare" / "bin" / "python"))
    assert "lacks the packages numpy and scipy; install them: " in _said(toy_fmu)["missing"]


def test_no_library_for_this_platform(toy_fmu, tmp_path):
    copy = _changed(toy_fmu, tmp_path, lambda n, d: None if n.startswith("binaries/linux64") else (n, d))
    assert "no library for this platform" in _said(copy)["missing"]


def test_no_shared_library_of_python(toy_fmu, monkeypatch):
    static = doctor.Interpreter(sys.executable, "3.11", "", "")
    monkeypatch.setattr(doctor, "ask", lambda: static)
    assert "has no shared library; install libpython" in _said(toy_fmu)["missing"]


def test_with_and_without_the_loader(toy_fmu, tmp_path):
    assert doctor.ask().library == "" or "its loader will load" in _said(toy_fmu)["ok"]
    inner = f"binaries/linux64/Toy{INNER_SUFFIX}"
    copy = _changed(toy_fmu, tmp_path, lambda n, d: None if n == inner else (n, d))
    assert doctor.ask().library == "" or "LD_PRELOAD=" in _said(copy)["note"]


def test_the_fmu_is_loaded_as_a_run_does_in_the_runs_folder(toy_fmu, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    said = _said(toy_fmu)
    assert f"loaded as a run does it, in {tmp_path}, the FMU was initialised and made a step" in said["ok"]
    assert list(tmp_path.iterdir()) == []

    def spoil(name, data):
        return name, data.replace(b"mass =", b"mess =") if name == "resources/definition.toml" else data

    copies = tmp_path / "copies"
    copies.mkdir()
    assert "the FMU fails: " in (text := _said(_changed(toy_fmu, copies, spoil))["missing"])
    assert "mess: unknown key" in text


def test_a_folder_that_cannot_be_written(toy_fmu, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    found = list(doctor._run(doctor.read_package(toy_fmu)))
    assert "cannot be unpacked in" in found[0].text


def test_an_older_machine(toy_fmu, monkeypatch):
    monkeypatch.setattr(doctor.platform, "libc_ver", lambda: ("glibc", "2.17"))
    assert "need glibc 2.32 or newer; this machine is older, it has 2.17" in _said(toy_fmu)["missing"]


def test_code_that_takes_the_arguments_of_pythonfmu_alone(toy_fmu, tmp_path):
    def plain(name, data):
        old = b"stop_time: float | None = None, tolerance: float | None = None"
        return name, data.replace(old, b"stop_time: float | None, tolerance: float | None")

    assert not _said(_changed(toy_fmu, tmp_path, plain))["missing"]


def test_code_that_does_not_run(toy_fmu, tmp_path):
    def spoil(name, data):
        return name, data.replace(b"GAIN = 1.0", b"import nothing_of_this_name") if name.endswith("law.py") else data

    assert "No module named 'nothing_of_this_name'" in _said(_changed(toy_fmu, tmp_path, spoil))["missing"]


@pytest.mark.parametrize("content", [b"", b"PK\x05\x06" + bytes(18), b"no archive"])
def test_what_is_no_fmu(tmp_path, content):
    path = tmp_path / "x.fmu"
    path.write_bytes(content)
    assert "is not an FMU of this kind" in _said(path)["missing"]
    assert "none.fmu cannot be read (there is no such file" in _said(tmp_path / "none.fmu")["missing"]


def test_the_probe_answers_line_by_line():
    probe = PROBE.read_text(encoding="utf-8")
    compile(probe, "probe", "exec", dont_inherit=True)
    answer = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    begin, *lines = answer.stdout.splitlines()
    assert begin == "openpanto_probe:"
    assert Path(lines[0]).resolve() == Path(sys.executable).resolve()
    assert lines[1] == f"{sys.version_info.major}.{sys.version_info.minor}"
    assert lines[3] == ""
