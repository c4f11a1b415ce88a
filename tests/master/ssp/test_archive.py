"""Opening scenarios, hostile archives among them."""

import stat
import zipfile

import pytest

from master.errors import ScenarioError
from master.ssp import archive
from master.ssp.archive import Sources, extract, open_package


def make(path, members):
    with zipfile.ZipFile(path, "w") as file:
        for name, data in members:
            file.writestr(name, data)
    return path


def refusal(path, folder):
    folder.mkdir()
    with pytest.raises(ScenarioError) as caught:
        extract(path, folder)
    assert list(folder.iterdir()) == []  # nothing at all was written
    return str(caught.value)


@pytest.mark.parametrize("name", ["../evil", "a/../../evil", "/etc/evil", "..\\evil", "C:/evil", "a/../b"])
def test_members_that_climb_out_are_refused(tmp_path, name):
    path = make(tmp_path / "x.ssp", [("SystemStructure.ssd", "<a/>"), (name, "x")])
    assert "outside the folder" in refusal(path, tmp_path / "out")
    assert not (tmp_path / "evil").exists()


def test_symbolic_links_are_refused(tmp_path):
    link = zipfile.ZipInfo("link")
    link.create_system = 3
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    path = make(tmp_path / "x.ssp", [(link, "/etc/passwd")])
    assert "symbolic link" in refusal(path, tmp_path / "out")


def test_size_and_number_of_files_are_bounded(tmp_path, monkeypatch):
    path = make(tmp_path / "x.ssp", [("a", b"0" * 1000), ("b", b"0" * 1000)])
    monkeypatch.setattr(archive, "MAX_BYTES", 1999)
    assert "would unpack to 2000 bytes" in refusal(path, tmp_path / "out")
    monkeypatch.setattr(archive, "MAX_FILES", 1)
    assert "has 2 files" in refusal(path, tmp_path / "out2")


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04 not a zip", b"<xml/>"])
def test_what_is_no_archive_is_refused(tmp_path, data):
    path = tmp_path / "x.ssp"
    path.write_bytes(data)
    with pytest.raises(ScenarioError, match=r"not a readable \.ssp archive"):
        extract(path, tmp_path)


def test_a_damaged_archive_is_refused(tmp_path):
    path = make(tmp_path / "x.ssp", [("SystemStructure.ssd", "<a/>" * 200)])
    data = bytearray(path.read_bytes())
    data[60] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(ScenarioError, match=r"not a readable \.ssp archive"):
        extract(path, tmp_path / "out")


def test_folder_and_archive_look_alike(tmp_path):
    folder = tmp_path / "one.ssp"
    folder.mkdir()
    (folder / "SystemStructure.ssd").write_text("<a/>")
    packed = make(tmp_path / "two.ssp", [("SystemStructure.ssd", "<a/>")])
    with open_package(folder) as one, open_package(packed) as two:
        assert (one.name, two.name) == ("one", "two")
        assert (one.writable, two.writable) == (True, False)
        assert (one.root / "SystemStructure.ssd").read_text() == (two.root / "SystemStructure.ssd").read_text()
        temporary = two.root
    assert not temporary.exists()
    assert folder.exists()


def test_missing_scenarios_are_named(tmp_path):
    with pytest.raises(ScenarioError, match="there is no such folder"), open_package(tmp_path / "none.ssp"):
        pass
    with pytest.raises(ScenarioError, match=r"contains no SystemStructure\.ssd"), open_package(tmp_path):
        pass


@pytest.mark.parametrize("source", ["../x.fmu", "/x.fmu", "a/../../x", "file:/x", "http://host/x.fmu", "a\\..\\x"])
def test_sources_outside_the_scenario_are_refused(tmp_path, source):
    assert Sources(tmp_path).find(source) is None


def test_links_out_of_the_scenario_are_refused(tmp_path):
    (tmp_path / "s").mkdir()
    (tmp_path / "secret").write_text("x")
    (tmp_path / "s" / "link").symlink_to(tmp_path / "secret")
    assert Sources(tmp_path / "s").find("link") is None
    assert Sources(tmp_path / "s").find("resources/X.fmu") == tmp_path / "s" / "resources" / "X.fmu"
