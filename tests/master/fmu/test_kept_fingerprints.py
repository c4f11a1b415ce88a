"""Answers of the builder, kept while nothing has changed that they depend on."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path

import pytest

from master.fmu import fmu_provision, kept_fingerprints
from master.fmu.fmu_provision import Lookup
from master.fmu.kept_fingerprints import Answer, keep_answer, kept_answer

QUESTION = ("fingerprint", "X")
ANSWER = Answer("ab-12", ("two definitions",))
#: Later than all that a test has written.
LATER = time.time() + 1e6


@pytest.fixture
def cache(tmp_path_factory, monkeypatch):
    folder = tmp_path_factory.mktemp("cache")
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    monkeypatch.delenv(kept_fingerprints.SWITCH, raising=False)
    return folder / "openpanto/fingerprints"


@pytest.fixture
def tree(tmp_path):
    (tmp_path / "models/lines").mkdir(parents=True)
    (tmp_path / "models/lines/A.toml").write_text("a = 1")
    (tmp_path / "models/code.py").write_text("x = 1")
    (tmp_path / "LICENSE").write_text("free")
    return tmp_path


def places(tree):
    return [str(tree / name) for name in ("models", "LICENSE", "project/lines")]


def rewritten(path, text):
    """Write a file again, and set the time of its content back, as an unpacked archive does."""
    before = path.stat()
    path.write_text(text)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


CHANGES = {
    "a line is longer": lambda t: (t / "models/lines/A.toml").write_text("a = 10"),
    "a line is as long, and as old": lambda t: rewritten(t / "models/lines/A.toml", "a = 2"),
    "a new module": lambda t: (t / "models/more.py").write_text(""),
    "a module less": lambda t: (t / "models/code.py").unlink(),
    "another name": lambda t: (t / "models/code.py").rename(t / "models/core.py"),
    "a file": lambda t: rewritten(t / "LICENSE", "FREE"),
    "a file less": lambda t: (t / "LICENSE").unlink(),
    "a folder that was missing": lambda t: (
        (t / "project/lines").mkdir(parents=True),
        (t / "project/lines/A.toml").write_text(""),
    ),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_an_answer_is_kept_until_something_changes(cache, tree, change):
    assert kept_answer(QUESTION) is None
    keep_answer(QUESTION, ANSWER, places(tree), LATER)
    assert kept_answer(QUESTION) == ANSWER
    assert kept_answer((*QUESTION, "--pantographs")) is None
    (tree / "models/__pycache__").mkdir()
    (tree / "models/__pycache__/code.pyc").write_text("compiled")
    assert kept_answer(QUESTION) == ANSWER
    time.sleep(0.02)  # a tick of the file system's clock
    change(tree)
    assert kept_answer(QUESTION) is None


def test_what_changed_just_before_is_not_kept(cache, tree):
    keep_answer(QUESTION, ANSWER, places(tree), time.time())
    assert kept_answer(QUESTION) is None
    keep_answer(QUESTION, ANSWER, [], LATER)  # a builder that does not say what it depends on
    assert kept_answer(QUESTION) is None
    assert not cache.exists()


@pytest.mark.parametrize("damage", [b"", b"{}", b"\xff", b"null\n", b"[1]\nx"])
def test_a_damaged_file_is_passed_over(cache, tree, damage):
    keep_answer(QUESTION, ANSWER, places(tree), LATER)
    (file,) = cache.iterdir()
    good = file.read_bytes()
    file.write_bytes(damage)
    assert kept_answer(QUESTION) is None
    file.write_bytes(good.replace(b"ab-12", b"ab-13"))
    assert kept_answer(QUESTION) is None
    keep_answer(QUESTION, ANSWER, places(tree), LATER)
    assert kept_answer(QUESTION) == ANSWER


def test_where_nothing_can_be_kept_nothing_is_said(cache, tree, monkeypatch, capfd):
    cache.parent.mkdir()
    cache.write_text("a file")
    keep_answer(QUESTION, ANSWER, places(tree), LATER)
    assert kept_answer(QUESTION) is None
    cache.unlink()
    monkeypatch.setenv(kept_fingerprints.SWITCH, "off")
    keep_answer(QUESTION, ANSWER, places(tree), LATER)
    assert not cache.exists()
    assert capfd.readouterr() == ("", "")


@pytest.mark.skipif(os.name != "posix", reason="modes of folders")
def test_a_folder_that_others_may_write_to_is_left_alone(cache, tree):
    keep_answer(QUESTION, ANSWER, places(tree), LATER)
    cache.chmod(0o777)
    assert kept_answer(QUESTION) is None


def test_a_bounded_number_is_kept(cache, tree, monkeypatch):
    monkeypatch.setattr(kept_fingerprints, "_MOST", 2)
    for number in range(3):
        keep_answer((str(number),), ANSWER, places(tree), LATER)
        for age, file in enumerate(sorted(cache.iterdir(), key=lambda f: f.stat().st_mtime)):
            os.utime(file, (number + age, number + age))
    assert len(list(cache.iterdir())) == 2
    assert kept_answer(("2",)) == ANSWER


def test_the_builder_is_asked_once_and_again_when_a_definition_changes(cache, tmp_path, monkeypatch):
    """With the real builder: it names what it depends on, a definition that does not exist yet included."""
    asked = []
    ask = fmu_provision._fmus
    monkeypatch.setattr(fmu_provision, "_fmus", lambda *a, seconds: asked.append(a) or ask(*a, seconds=seconds))
    monkeypatch.setattr(fmu_provision.time, "time", lambda: LATER)
    lookup = Lookup("Pantograph_CX", tmp_path)
    first = fmu_provision.fingerprint(lookup)
    assert fmu_provision.fingerprint(lookup) == first is not None
    assert len(asked) == 1
    (tmp_path / "pantographs").mkdir()
    library = Path(fmu_provision.__file__).parents[2] / "models/library/pantographs/CX.toml"
    (tmp_path / "pantographs/CX.toml").write_text(library.read_text().replace("7.75", "7.76"))
    notes = []
    assert fmu_provision.fingerprint(lookup, notes.append) not in (None, first)
    assert len(asked) == 2
    assert fmu_provision.fingerprint(lookup, notes.append) is not None
    assert len(asked) == 2
    assert len(notes) == 2  # of two definitions of a name: said again, though not asked again
    assert notes[0] == notes[1]
    monkeypatch.setenv("OPENPANTO_LIBRARY", str(tmp_path))
    fmu_provision.fingerprint(lookup)
    assert len(asked) == 3


def test_what_the_builder_does_not_know_is_kept_as_well(cache, tmp_path, monkeypatch):
    monkeypatch.setattr(fmu_provision.time, "time", lambda: LATER)
    lookup = Lookup("Theirs", tmp_path)
    assert fmu_provision.fingerprint(lookup) is None
    monkeypatch.setattr(fmu_provision, "_fmus", lambda *_, **__: pytest.fail("asked"))
    assert fmu_provision.fingerprint(lookup) is None


def test_an_error_is_not_kept(cache, monkeypatch):
    answer = subprocess.CompletedProcess((), 1, 'watched: "/etc"\n', "error: X: no")
    monkeypatch.setattr(fmu_provision, "_fmus", lambda *_, **__: answer)
    with pytest.raises(ValueError, match="X: no"):
        fmu_provision.fingerprint(Lookup("X"))
    assert not cache.exists()
