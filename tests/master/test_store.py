"""Asking for FMUs: missing, stale, foreign."""

import subprocess
import zipfile

import pytest

from master import store


class Builder:
    """Stands in for ``python -m fmus``."""

    def __init__(self, fingerprint="AB-12", code=0, said=""):
        self.fingerprint, self.code, self.said = fingerprint, code, said
        self.asked = []

    def __call__(self, *arguments, seconds):
        self.asked.append(arguments[0])
        if arguments[0] == "fingerprint":
            return subprocess.CompletedProcess(arguments, self.code, self.fingerprint + "\n", self.said)
        if not self.said:
            name, folder = arguments[1], arguments[3]
            with zipfile.ZipFile(f"{folder}/{name}.fmu", "w") as file:
                file.writestr("modelDescription.xml", f'<fmiModelDescription guid="{{{self.fingerprint.lower()}}}"/>')
        return subprocess.CompletedProcess(arguments, 1 if self.said else 0, "", self.said)


@pytest.fixture
def builder(monkeypatch):
    made = Builder()
    monkeypatch.setattr(store, "_fmus", lambda *a, seconds: made(*a, seconds=seconds))
    monkeypatch.setattr(store, "has_builder", lambda: True)
    return made


def test_missing_then_fresh_then_stale(builder, tmp_path):
    path, told = tmp_path / "X.fmu", []
    store.ensure(path, told.append)
    assert builder.asked == ["fingerprint", "build"]
    store.ensure(path, told.append)
    assert builder.asked == ["fingerprint", "build", "fingerprint"]
    builder.fingerprint = "CD-34"
    store.ensure(path, told.append)
    assert builder.asked[-2:] == ["fingerprint", "build"]
    assert told == ["building X.fmu", "building X.fmu again: its sources have changed"]
    assert store.stored_guid(path) == "{cd-34}"


def test_a_foreign_fmu_is_left_alone(builder, tmp_path):
    builder.code = 2
    (tmp_path / "X.fmu").write_text("foreign")
    store.ensure(tmp_path / "X.fmu", print)
    assert builder.asked == ["fingerprint"]
    assert (tmp_path / "X.fmu").read_text() == "foreign"


def test_the_builders_words_are_passed_on(builder, tmp_path):
    builder.code, builder.said = 1, "warning\nX: tension is negative"
    with pytest.raises(ValueError, match="cannot be built: X: tension is negative"):
        store.ensure(tmp_path / "X.fmu", print)
    builder.code = 0
    with pytest.raises(ValueError, match="could not be built: X: tension is negative"):
        store.ensure(tmp_path / "X.fmu", lambda _: None)


def test_without_fmus_nothing_is_asked(monkeypatch, tmp_path):
    monkeypatch.setattr(store.importlib.util, "find_spec", lambda name: None)
    assert not store.has_builder()
    monkeypatch.setattr(store, "_fmus", lambda *a, seconds: pytest.fail("asked"))
    store.ensure(tmp_path / "X.fmu", print)


@pytest.mark.parametrize("data", [b"", b"not a zip"])
def test_a_broken_fmu_has_no_guid(tmp_path, data):
    (tmp_path / "X.fmu").write_bytes(data)
    assert store.stored_guid(tmp_path / "X.fmu") == ""
