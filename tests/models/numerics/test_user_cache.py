"""Arrays kept for the next process: found again to the bit, or passed over in silence."""

from __future__ import annotations

import os

import numpy as np
import pytest

from models.numerics import user_cache
from models.numerics.user_cache import keep_arrays, kept_arrays

ARRAYS = {"x": np.array([[0.1, -np.inf], [np.nan, 2.0**-1074]]), "none": np.zeros((0, 3)), "one": np.array(7)}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv(user_cache.SWITCH, raising=False)
    return tmp_path / "openpanto/kept"


def test_what_was_kept_is_found_again_to_the_bit(folder):
    assert kept_arrays("a") is None
    keep_arrays("a", ARRAYS)
    found = kept_arrays("a")
    assert found.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        assert found[name].dtype == array.dtype
        assert found[name].shape == array.shape
        assert found[name].tobytes() == array.tobytes()
    assert kept_arrays("b") is None
    assert [path.name for path in folder.iterdir()] == ["a.kept"]


@pytest.mark.parametrize("place", [0, 20, 60, 400, -1])
def test_a_changed_byte_is_noticed(folder, place):
    keep_arrays("a", ARRAYS)
    file = folder / "a.kept"
    data = bytearray(file.read_bytes())
    data[place] ^= 1
    file.write_bytes(data)
    assert kept_arrays("a") is None
    keep_arrays("a", ARRAYS)
    assert kept_arrays("a") is not None


@pytest.mark.parametrize("length", [0, 1, 17, 49, 50, 300])
def test_a_file_that_was_cut_is_noticed(folder, length):
    keep_arrays("a", ARRAYS)
    file = folder / "a.kept"
    file.write_bytes(file.read_bytes()[:length])
    assert kept_arrays("a") is None


def test_nothing_in_a_file_is_ever_executed(folder):
    """Not even in one whose checksum holds: objects are refused when written, and when read."""
    with pytest.raises(ValueError, match="allow_pickle"):
        keep_arrays("a", {"x": np.array([print], dtype=object)})
    assert kept_arrays("a") is None


def test_where_nothing_can_be_kept_nothing_is_said(folder, tmp_path, monkeypatch, capfd):
    folder.parent.mkdir()
    folder.write_text("a file")
    keep_arrays("a", ARRAYS)
    assert kept_arrays("a") is None
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "openpanto/kept"))  # below a file
    keep_arrays("a", ARRAYS)
    assert kept_arrays("a") is None
    assert capfd.readouterr() == ("", "")


@pytest.mark.skipif(os.name != "posix", reason="modes of folders")
def test_a_folder_that_others_may_write_to_is_left_alone(folder):
    keep_arrays("a", ARRAYS)
    folder.chmod(0o777)
    assert kept_arrays("a") is None
    keep_arrays("b", ARRAYS)
    assert not (folder / "b.kept").exists()
    folder.chmod(0o700)
    assert kept_arrays("a") is not None


def test_it_can_be_switched_off(folder, monkeypatch):
    keep_arrays("a", ARRAYS)
    monkeypatch.setenv(user_cache.SWITCH, "off")
    assert kept_arrays("a") is None
    keep_arrays("b", ARRAYS)
    assert not (folder / "b.kept").exists()


def test_the_folder_stays_within_bounds_and_keeps_what_was_used_last(folder, monkeypatch):
    keep_arrays("a", ARRAYS)
    size = (folder / "a.kept").stat().st_size
    monkeypatch.setattr(user_cache, "_MOST", 3 * size)
    for number, name in enumerate("abc"):
        keep_arrays(name, ARRAYS)
        os.utime(folder / f"{name}.kept", (number + 1, number + 1))
    assert kept_arrays("a") is not None  # and so it is younger than the others
    keep_arrays("d", ARRAYS)
    assert sorted(path.stem for path in folder.iterdir()) == ["a", "c", "d"]
    monkeypatch.setattr(user_cache, "_LARGEST", size // 2)
    keep_arrays("e", ARRAYS)
    assert not (folder / "e.kept").exists()
