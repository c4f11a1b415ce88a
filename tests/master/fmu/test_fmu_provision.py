"""Asking for FMUs: missing, stale, foreign."""

import struct
import subprocess
import zipfile
from pathlib import Path

import pytest

from master.fmu import fmu_provision


def write_fmu(path, guid, **mark):
    """Write an FMU that carries our mark."""
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("modelDescription.xml", f'<fmiModelDescription guid="{{{guid}}}"/>')
    with zipfile.ZipFile(path) as file:
        mark = {"format": 1, "guid": guid, "content": fmu_provision._content_hash(file), **mark}
    with zipfile.ZipFile(path, "a") as file:
        file.writestr("resources/openpanto.txt", "".join(f"{key}={value}\n" for key, value in mark.items()))


class Builder:
    """Stands in for ``python -m fmus``."""

    def __init__(self, fingerprint="AB-12", code=0, said=""):
        self.fingerprint, self.code, self.said = fingerprint, code, said
        self.asked, self.orders = [], []
        self.mark = {}

    def __call__(self, *arguments, seconds):
        self.asked.append(arguments[0])
        self.orders.append(arguments)
        if arguments[0] == "fingerprint":
            if "--built-from" in arguments and not Path(arguments[arguments.index("--built-from") + 1]).is_file():
                return subprocess.CompletedProcess(arguments, 0, "", "")  # as for a name that it does not know
            return subprocess.CompletedProcess(arguments, self.code, self.fingerprint + "\n", self.said)
        if not self.said:
            name, folder = arguments[-1], arguments[2]
            write_fmu(Path(folder) / f"{Path(name).stem}.fmu", self.fingerprint.lower(), **self.mark)
        return subprocess.CompletedProcess(arguments, 1 if self.said else 0, "", self.said)


@pytest.fixture
def builder(monkeypatch):
    made = Builder()
    monkeypatch.setattr(fmu_provision, "_fmus", lambda *a, seconds: made(*a, seconds=seconds))
    monkeypatch.setattr(fmu_provision, "has_builder", lambda: True)
    return made


def test_missing_then_fresh_then_stale(builder, tmp_path):
    path, reported = tmp_path / "X.fmu", []
    fmu_provision.provide_fmu(path, reported.append)
    assert builder.asked == ["fingerprint", "build"]
    fmu_provision.provide_fmu(path, reported.append)
    assert builder.asked == ["fingerprint", "build", "fingerprint"]
    builder.fingerprint = "CD-34"
    fmu_provision.provide_fmu(path, reported.append)
    assert builder.asked[-2:] == ["fingerprint", "build"]
    assert reported == ["building X.fmu", "building X.fmu again: what it is made of has changed"]
    assert fmu_provision.stored_guid(path) == "{cd-34}"


def test_a_foreign_fmu_is_left_alone(builder, tmp_path):
    builder.fingerprint = ""  # what it says of a name that it does not know
    (tmp_path / "X.fmu").write_text("foreign")
    fmu_provision.provide_fmu(tmp_path / "X.fmu", print)
    assert builder.asked == ["fingerprint"]
    assert (tmp_path / "X.fmu").read_text() == "foreign"


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"resources/definition.toml": b"mine"}, "it was changed since it was built"),
        ({"resources/openpanto.txt": None}, "it was not built by this project"),
        ({"modelDescription.xml": b'<fmiModelDescription guid="{other}"/>'}, "it was changed since it was built"),
        ({"modelDescription.xml": None}, "it is not an FMU that could be read"),
    ],
)
def test_what_is_not_as_we_built_it_is_kept_and_that_is_said(builder, tmp_path, change, why):
    path, reported = tmp_path / "X.fmu", []
    fmu_provision.provide_fmu(path, reported.append)
    with zipfile.ZipFile(path) as file:
        members = {name: file.read(name) for name in file.namelist()} | change
    with zipfile.ZipFile(path, "w") as file:
        for name, data in members.items():
            if data is not None:
                file.writestr(name, data)
    before = path.read_bytes()
    builder.fingerprint = "CD-34"
    assert fmu_provision.provide_fmu(path, reported.append) == path
    assert path.read_bytes() == before
    assert reported[1:] == [f"X.fmu is used as it is: {why}; to have it rebuilt, remove it"]


@pytest.mark.parametrize(("script", "is_ours"), [("X_ab1234567890", True), ("X_cd1234567890", False), ("own", False)])
def test_older_builds_are_known_by_the_name_of_their_script(builder, tmp_path, script, is_ours):
    path = tmp_path / "X.fmu"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("modelDescription.xml", '<fmiModelDescription guid="ab123456-7890-1111"/>')
        file.writestr("resources/slavemodule.txt", script)
        file.writestr(f"resources/{script}.py", "")
    builder.fingerprint = "CD-34"
    fmu_provision.provide_fmu(path, lambda _: None)
    assert builder.asked == (["fingerprint", "build"] if is_ours else ["fingerprint"])


def test_the_fmu_of_a_users_definition_follows_its_file(builder, tmp_path):
    (tmp_path / "lines").mkdir()
    (tmp_path / "lines" / "Mine.toml").write_text("")
    path, reported = tmp_path / "Mine.fmu", []
    write_fmu(path, "ab-12", definition="lines/Mine.toml", pantographs="2")
    builder.mark = {"definition": "lines/Mine.toml", "pantographs": "2"}
    fmu_provision.provide_fmu(path, reported.append)
    assert reported == []
    ports = ("--built-from", f"{tmp_path}/lines/Mine.toml", "--pantographs", "2", "--", "Mine")
    assert builder.orders[-1] == ("fingerprint", "--if-known", "--watched", *ports)
    builder.fingerprint = "CD-34"
    fmu_provision.provide_fmu(path, reported.append)
    assert reported == ["building Mine.fmu again: what it is made of has changed"]
    assert builder.orders[-1][3:] == ports
    (tmp_path / "lines" / "Mine.toml").unlink()
    fmu_provision.provide_fmu(path, reported.append)
    assert "which it was built from, is missing" in reported[-1]
    assert builder.asked == ["fingerprint", "fingerprint", "build", "fingerprint"]


def test_definitions_are_looked_up_where_the_scenario_lies(builder, tmp_path):
    fmu_provision.provide_fmu(tmp_path / "X.fmu", print, library=tmp_path)
    assert builder.orders[0] == ("fingerprint", "--if-known", "--watched", "--library", str(tmp_path), "--", "X")
    assert builder.orders[1][3:] == ("--library", str(tmp_path), "--", "X")


def test_notes_of_the_builder_are_passed_on(monkeypatch, tmp_path):
    said = "note: two definitions are named 'X': a is used, b is not\nanything else\n"
    answer = subprocess.CompletedProcess((), 0, "", said)
    monkeypatch.setattr(fmu_provision, "_fmus", lambda *a, seconds: answer)
    reported = []
    fmu_provision.provide_fmu(tmp_path / "X.fmu", reported.append)
    assert reported == ["two definitions are named 'X': a is used, b is not"]


def test_an_fmu_says_which_definition_it_was_built_from(tmp_path):
    path = tmp_path / "demo.ssp" / "resources" / "X.fmu"
    path.parent.mkdir(parents=True)
    write_fmu(path, "ab-12", definition="../../lines/X.toml", pantographs="1")
    assert fmu_provision.definition_of(path) == str(tmp_path / "lines" / "X.toml")
    write_fmu(path, "ab-12", library="lines/X.toml")
    assert fmu_provision.definition_of(path) == "library: lines/X.toml"
    write_fmu(path, "ab-12")
    assert fmu_provision.definition_of(path) == ""


def test_nothing_is_written_where_there_is_a_scratch_folder(builder, tmp_path):
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    assert fmu_provision.provide_fmu(tmp_path / "X.fmu", lambda _: None, lambda: scratch) == scratch / "X.fmu"
    assert not (tmp_path / "X.fmu").exists()


def test_what_the_scratch_folder_holds_is_used_as_long_as_it_fits(builder, tmp_path):
    scratch, reported = tmp_path / "cache", []
    scratch.mkdir()
    for _ in range(2):
        fmu_provision.provide_fmu(tmp_path / "X.fmu", reported.append, lambda: scratch)
    assert builder.asked == ["fingerprint", "build", "fingerprint"]
    builder.fingerprint = "CD-34"
    fmu_provision.provide_fmu(tmp_path / "X.fmu", reported.append, lambda: scratch)
    assert reported == ["building X.fmu", "building X.fmu again: what it is made of has changed"]


def test_the_builder_takes_no_modules_from_the_working_folder(monkeypatch, tmp_path):
    monkeypatch.setattr("sys.path", ["", str(tmp_path)])
    assert fmu_provision._places() == [str(tmp_path), str(Path(__file__).parents[3])]


def test_the_builder_takes_no_modules_from_fmus_that_ran_here(tmp_path, monkeypatch):
    (tmp_path / "slavemodule.txt").write_text("x")
    (tmp_path / "pythonfmu").mkdir()
    (tmp_path / "pythonfmu" / "__init__.py").write_text("raise ImportError('of another FMU')")
    before = fmu_provision.fingerprint(fmu_provision.Lookup("Pantograph_CX"))
    monkeypatch.syspath_prepend(str(tmp_path))
    assert fmu_provision.fingerprint(fmu_provision.Lookup("Pantograph_CX")) == before


def test_the_builders_words_are_passed_on(builder, tmp_path):
    builder.code, builder.said = 1, "warning\nerror: X: tension is negative\nX: mass is negative"
    with pytest.raises(ValueError, match=r"cannot be built: X: tension is negative\nX: mass is negative$"):
        fmu_provision.provide_fmu(tmp_path / "X.fmu", print)
    builder.code = 0
    with pytest.raises(ValueError, match="could not be built: X: tension is negative"):
        fmu_provision.provide_fmu(tmp_path / "X.fmu", lambda _: None)


def test_without_fmus_nothing_is_asked(monkeypatch, tmp_path):
    monkeypatch.setattr(fmu_provision.importlib.util, "find_spec", lambda name: None)
    assert not fmu_provision.has_builder()
    monkeypatch.setattr(fmu_provision, "_fmus", lambda *a, seconds: pytest.fail("asked"))
    fmu_provision.provide_fmu(tmp_path / "X.fmu", print)


def test_a_name_that_looks_like_an_option_is_a_name():
    assert fmu_provision.fingerprint(fmu_provision.Lookup("--help")) is None


@pytest.mark.parametrize("data", [b"", b"not a zip"])
def test_a_broken_fmu_has_no_guid(tmp_path, data):
    (tmp_path / "X.fmu").write_bytes(data)
    assert fmu_provision.stored_guid(tmp_path / "X.fmu") == ""


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
    assert fmu_provision.stored_guid(tmp_path / "X.fmu") == "ab"
    stored(tmp_path / "X.fmu", **changes)
    assert fmu_provision.stored_guid(tmp_path / "X.fmu") == ""


def test_a_folder_that_cannot_be_made_is_named_with_what_to_do(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(
        ValueError, match=r"file/fmus cannot be made \(Not a directory\); XDG_CACHE_HOME names the folder"
    ):
        fmu_provision.build(tmp_path / "file" / "fmus" / "Pantograph_CX.fmu", fmu_provision.Lookup("Pantograph_CX"))
