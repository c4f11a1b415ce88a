"""A cache of machine code that is never trusted blindly and never decides whether a run works."""

from __future__ import annotations

import gc
import logging
import os
import pickle
import shutil
import subprocess
import sys

import pytest

from models.numerics import kernel_cache
from models.numerics.kernel_cache import _kept_source, load_kernels

pytest.importorskip("numba")

SOURCE = "from numba import njit\n\n\n@njit(cache=True)\ndef twice(x):\n    return 2 * x  # {}\n"


class Trap:
    """What a pickle from somebody else could do: leave a mark while it is read."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return (os.mkdir, (self.mark,))


@pytest.fixture
def cache(tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    caplog.set_level(logging.WARNING, "openpanto")  # a command may have asked for more
    monkeypatch.setattr(kernel_cache, "_named", set())
    return tmp_path


@pytest.fixture
def twice(request):
    """Load the kernel as a new process would."""

    def load():
        for name in [n for n in sys.modules if n.startswith("openpanto_toy")]:
            del sys.modules[name]
        return load_kernels("toy", SOURCE.format(request.node.name).encode()).twice

    return load


def files(cache):
    found = sorted(f for f in cache.rglob("*.sum") if f.is_file())
    assert {f.name.split(".")[-2] for f in found} == {"nbi", "nbc"}
    return found


def test_the_second_process_compiles_nothing(cache, twice, caplog):
    first = twice()
    assert first(21) == 42
    second = twice()
    assert second is not first
    assert second(21) == 42
    assert sum(first.stats.cache_hits.values()) == 0
    assert sum(second.stats.cache_hits.values()) == 1
    assert not caplog.records


def test_no_garbage_is_looked_for_while_a_kernel_is_compiled(cache, twice):
    found = []
    first = twice()
    first._cache.load_overload = lambda *_: found.append(gc.isenabled())
    assert first(21) == 42
    assert found == [False]
    assert gc.isenabled()
    with pytest.raises(Exception, match="Cannot determine Numba type"):
        first(object())
    assert gc.isenabled()
    gc.disable()
    try:
        assert first(0.5) == 1.0
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_compiling_is_told_once_and_only_if_it_happens(cache, twice, caplog, monkeypatch):
    caplog.set_level(logging.INFO, "openpanto")
    first = twice()
    assert first(21) == 42
    assert first(0.5) == 1.0
    assert [r.getMessage().split()[0] for r in caplog.records] == ["compiling"]
    monkeypatch.setattr(kernel_cache, "_named", set())
    caplog.clear()
    assert twice()(21) == 42
    assert not caplog.records


def test_what_was_not_used_for_longest_makes_room(cache, monkeypatch):
    monkeypatch.setattr(kernel_cache, "_MOST_VERSIONS", 3)

    def kept(name, k):
        copy = _kept_source(f"VALUE = {k}\n".encode(), f"{name}-{k:016x}")
        os.utime(copy.parent, (k, k))
        return copy.parent

    other, old = kept("toy_of_another_kind", 1), kept("toy", 2)
    rest = [kept("toy", k) for k in (3, 4)]
    _kept_source(b"VALUE = 2\n", old.name)  # used again
    newest = _kept_source(b"VALUE = 5\n", f"toy-{5:016x}").parent
    assert sorted(f.name for f in (cache / "openpanto").iterdir()) == sorted(
        f.name for f in (other, old, rest[1], newest)
    )


def test_a_changed_copy_of_the_source_is_not_used(cache):
    source = b"VALUE = 1\n"
    copy = _kept_source(source, "key")
    assert copy.read_bytes() == source
    copy.write_bytes(b"VALUE = 2\n")
    assert _kept_source(source, "key").read_bytes() == source


def test_a_cache_that_cannot_be_written_is_done_without(cache):
    (cache / "openpanto").write_text("in the way")
    copy = _kept_source(b"x = 1\n", "key")
    assert copy.read_bytes() == b"x = 1\n"
    assert not copy.is_relative_to(cache)


DAMAGE = {
    "empty": lambda _: b"",
    "cut": lambda b: b[: len(b) // 2],
    "a changed byte": lambda b: b[:-9] + bytes([b[-9] ^ 1]) + b[-8:],
    "a changed checksum": lambda b: bytes([b[0] ^ 1]) + b[1:],
    "another pickle": lambda _: pickle.dumps("something else"),
    "zeros": lambda b: bytes(len(b)),
}


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_file_is_compiled_afresh_and_mended(cache, twice, caplog, kind, damage):
    twice()(1)
    for file in files(cache):
        if file.name.endswith(f".{kind}.sum"):
            file.write_bytes(DAMAGE[damage](file.read_bytes()))
    kernel = twice()
    assert kernel(21) == 42
    assert kernel(21.5) == 43.0
    (record,) = caplog.records
    assert str(cache) in record.getMessage()
    assert "damaged" in record.getMessage()
    caplog.clear()
    assert twice()(4) == 8
    assert not caplog.records
    assert sum(twice().stats.cache_hits.values()) == 0  # nothing is read before it is asked for


def test_a_trap_in_the_place_of_a_file_is_not_read(cache, twice, tmp_path):
    twice()(1)
    for file in files(cache):
        file.write_bytes(pickle.dumps(Trap(str(tmp_path / "sprung"))))
    assert twice()(21) == 42
    assert not (tmp_path / "sprung").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps a user's folders to the user")
@pytest.mark.parametrize("place", ["openpanto", "openpanto/*", "openpanto/*/__pycache__"])
def test_a_folder_that_others_may_write_to_is_not_used(cache, twice, caplog, place):
    twice()(1)
    (folder,) = cache.glob(place)
    folder.chmod(0o777)
    kernel = twice()
    assert kernel(21) == 42
    assert sum(kernel.stats.cache_hits.values()) == 0
    (record,) = caplog.records
    assert f"{folder} can be written by others; chmod go-w it" in record.getMessage()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps a user's folders to the user")
def test_a_folder_that_numba_was_told_is_checked_too(cache, twice, caplog, tmp_path, monkeypatch):
    folder = tmp_path / "shared"
    folder.mkdir()
    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(folder))
    first = twice()
    assert first(21) == 42
    (place,) = folder.iterdir()
    place.chmod(0o777)
    kernel = twice()
    assert kernel(21) == 42
    assert sum(kernel.stats.cache_hits.values()) == 0
    assert f"{place} can be written by others" in caplog.text


@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() != 0, reason="giving a folder away takes root")
def test_a_folder_of_another_user_is_not_used(cache, twice, caplog):
    twice()(1)
    os.chown(cache / "openpanto", 12345, 12345)
    kernel = twice()
    assert kernel(21) == 42
    assert sum(kernel.stats.cache_hits.values()) == 0
    assert "belongs to another user" in caplog.text


def test_a_cache_without_room_for_the_machine_code(cache, twice, caplog):
    """The folder takes the source and nothing else."""
    kernel = twice()
    (folder,) = cache.glob("openpanto/*")
    shutil.rmtree(folder / "__pycache__")  # empty, or with Python's own bytecode
    (folder / "__pycache__").write_text("in the way")
    (folder / "__pycache__").chmod(0o600)
    assert kernel(21) == 42
    assert "cannot be kept" in caplog.text
    assert str(folder) in caplog.text


def _full(cache, monkeypatch, *endings):
    """Let a disk be full for files of some names below a folder."""
    replace = os.replace

    def full(source, target, **options):
        if str(target).startswith(str(cache)) and str(target).endswith(endings):
            raise OSError(28, "No space left on device", str(target))
        replace(source, target, **options)

    monkeypatch.setattr("os.replace", full)


@pytest.mark.parametrize("ending", [".nbi.sum", ".nbc.sum", "kernels.py"])
def test_a_full_disk(cache, twice, caplog, monkeypatch, ending):
    """Whatever does not fit any more, the kernels work, and once there is room again they are kept."""
    _full(cache, monkeypatch, ending)
    assert twice()(21) == 42
    (record,) = caplog.records
    assert "No space left on device" in record.getMessage()
    assert str(cache) in record.getMessage()
    assert not list(cache.rglob("*.part"))
    monkeypatch.undo()
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    assert twice()(21) == 42
    assert sum((again := twice()).stats.cache_hits.values()) == 0
    assert again(21) == 42
    assert sum(again.stats.cache_hits.values()) == 1


def test_a_user_without_a_home(monkeypatch, twice, caplog):
    def homeless(_):
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr("pathlib.Path.expanduser", homeless)
    monkeypatch.setattr(kernel_cache, "_named", set())
    assert twice()(21) == 42
    assert "compiled in every run: Could not determine home directory" in caplog.text


def test_a_relative_cache_folder_is_ignored(tmp_path, monkeypatch, twice):
    """The XDG Base Directory Specification wants it so; a run leaves nothing in the working directory."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", "here")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert twice()(21) == 42
    assert [p.name for p in tmp_path.iterdir()] == ["home"]


def test_no_folder_at_all_means_no_kernels(cache, twice, monkeypatch):
    (cache / "openpanto").write_text("in the way")

    def none(**_):
        raise FileNotFoundError(2, "No usable temporary directory found")

    monkeypatch.setattr("tempfile.mkdtemp", none)
    with pytest.raises(ImportError, match="no folder can hold what the kernels are compiled from"):
        twice()


def test_a_warning_is_one_line_on_standard_error(tmp_path):
    """Without any handler `logging` writes warnings there, which is what the user of a command or a host sees."""
    code = (
        "from models.numerics.kernel_cache import _kept_source, load_kernels\n"
        f"print(load_kernels('toy', {SOURCE.format('worded')!r}.encode()).twice(21))\n"
    )
    (tmp_path / "openpanto").write_text("in the way")
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "42\n"
    (line,) = done.stderr.splitlines()
    assert line.startswith("warning: compiled kernels are not kept")
    assert str(tmp_path / "openpanto") in line
