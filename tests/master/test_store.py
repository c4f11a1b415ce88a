"""Asking for FMUs: missing, stale, foreign."""

import struct
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
            name, folder = arguments[4], arguments[2]
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
    builder.fingerprint = ""  # what it says of a name that it does not know
    (tmp_path / "X.fmu").write_text("foreign")
    store.ensure(tmp_path / "X.fmu", print)
    assert builder.asked == ["fingerprint"]
    assert (tmp_path / "X.fmu").read_text() == "foreign"


def test_the_builders_words_are_passed_on(builder, tmp_path):
    builder.code, builder.said = 1, "warning\nerror: X: tension is negative"
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


def test_a_name_that_looks_like_an_option_is_a_name():
    assert store.fingerprint("--help") is None


@pytest.mark.parametrize("data", [b"", b"not a zip"])
def test_a_broken_fmu_has_no_guid(tmp_path, data):
    (tmp_path / "X.fmu").write_bytes(data)
    assert store.stored_guid(tmp_path / "X.fmu") == ""


def stored(path, **changes):
    """Write an archive with a model description whose entries in both headers are changed."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("modelDescription.xml", '<fmiModelDescription guid="ab"/>')
    data = bytearray(path.read_bytes())
    local, central = 0, data.index(b"PK\x01\x02")
    for offset, value in changes.get("headers", ()):
        struct.pack_into("<H", data, local + offset, value)
        struct.pack_into("<H", data, central + offset + 2, value)
    for place in range(*changes.get("body", (0, 0))):
        data[place] ^= 0xFF
    path.write_bytes(data)


@pytest.mark.parametrize(
    "changes",
    [{"headers": [(6, 1)]}, {"headers": [(8, 99)]}, {"body": (50, 60)}],
    ids=["encrypted", "method 99", "damaged"],
)
def test_an_fmu_whose_archive_cannot_be_unpacked_has_no_guid(tmp_path, changes):
    stored(tmp_path / "X.fmu")
    assert store.stored_guid(tmp_path / "X.fmu") == "ab"
    stored(tmp_path / "X.fmu", **changes)
    assert store.stored_guid(tmp_path / "X.fmu") == ""
