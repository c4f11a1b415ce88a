"""Packed scenarios: deterministic, complete, readable."""

import os
import zipfile

import pytest

from master.errors import MasterError
from master.ssp.archive import open_package
from master.ssp.pack import left_out, pack


def test_same_files_same_bytes_whatever_their_times_and_modes(toy, tmp_path):
    first = pack(toy, tmp_path / "a.ssp").read_bytes()
    for path in toy.rglob("*"):
        if path.is_file():
            os.utime(path, (1.0, 2.0e9))
            path.chmod(0o600)
    assert pack(toy, tmp_path / "b.ssp").read_bytes() == first


def test_round_trip(toy, tmp_path):
    (toy / ".hidden").write_text("x")
    (toy / "note~").write_text("x")
    packed = pack(toy, tmp_path / "deep" / "a.ssp")
    with open_package(packed) as package:
        found = {p.relative_to(package.root): p.read_bytes() for p in package.root.rglob("*") if p.is_file()}
    names = {
        "SystemStructure.ssd",
        "parameters.ssv",
        "resources/ToyCatenary.fmu",
        "resources/ToyPantograph.fmu",
    }
    assert {p.as_posix() for p in found} == names
    for path, data in found.items():
        assert (toy / path).read_bytes() == data
    with zipfile.ZipFile(packed) as file:
        assert file.testzip() is None
        assert file.namelist() == sorted(names)


def test_links_are_refused(toy, tmp_path):
    (toy / "link").symlink_to(toy / "parameters.ssv")
    with pytest.raises(MasterError, match="symbolic link"):
        pack(toy, tmp_path / "a.ssp")
    assert not list(tmp_path.glob("a.ssp*"))


def test_what_the_description_does_not_name_stays_out(toy, tmp_path):
    """The FMU of a pantograph that was replaced is somebody's data."""
    (toy / "resources" / "Secret.fmu").write_bytes(b"the old pantograph")
    (toy / "notes.txt").write_text("mine")
    with zipfile.ZipFile(pack(toy, tmp_path / "a.ssp")) as file:
        names = file.namelist()
    assert left_out(toy) == ("notes.txt", "resources/Secret.fmu")
    assert not set(names) & set(left_out(toy))
    assert "resources/ToyPantograph.fmu" in names
