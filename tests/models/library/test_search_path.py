"""Where definitions are looked up: the project, named folders, the library."""

import os

import pytest

from models.library.catalogue import UnknownNameError, doubts, line_path, load_line, pantograph_path
from models.library.search_path import LIBRARY, definition_files, definition_names, doubles, project_folder, search_path


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A project with a scenario in a folder of it, and nothing named from outside."""
    monkeypatch.delenv("OPENPANTO_LIBRARY", raising=False)
    project = tmp_path / "demo"
    (project / "demo.ssp").mkdir(parents=True)
    (project / "openpanto.toml").write_text("")
    return project


def define(folder, kind, name):
    (folder / kind).mkdir(parents=True, exist_ok=True)
    path = folder / kind / f"{name}.toml"
    path.write_text((LIBRARY / kind / f"{'LN2' if kind == 'lines' else 'CX'}.toml").read_text())
    return path


def test_the_folders_are_those_up_to_the_project_then_the_named_ones(project, monkeypatch, tmp_path):
    monkeypatch.setenv("OPENPANTO_LIBRARY", os.pathsep.join([str(tmp_path / "a"), "", str(tmp_path / "b")]))
    scenario = project / "demo.ssp"
    assert search_path(scenario) == (scenario, project, tmp_path / "a", tmp_path / "b")
    assert project_folder(scenario) == project


def test_outside_a_project_no_parent_is_searched(project, tmp_path):
    assert search_path(tmp_path) == (tmp_path,)
    assert project_folder(tmp_path) is None


def test_an_own_definition_comes_before_the_librarys(project, monkeypatch):
    own = define(project, "lines", "LN2")
    assert line_path("LN2", search_path(project / "demo.ssp")) == own
    assert line_path("LN2", ()) == LIBRARY / "lines" / "LN2.toml"
    assert pantograph_path("CX", search_path(project)) == LIBRARY / "pantographs" / "CX.toml"
    monkeypatch.chdir(project / "demo.ssp")
    assert line_path("LN2") == own  # from where one stands


def test_the_nearest_of_several_counts_and_the_others_are_named(project):
    near, far = define(project / "demo.ssp", "lines", "Mine"), define(project, "lines", "Mine")
    found = definition_files("lines", "Mine", [*search_path(project / "demo.ssp"), LIBRARY])
    assert found == [near, far]
    assert doubles(found) == f"two definitions are named 'Mine': {near} is used, {far} is not"
    assert doubles([near]) == ""
    assert doubles([near, far, far]).endswith(f"{near} is used, {far} and {far} are not")


def test_a_folder_that_is_not_there_is_told_and_a_name_that_its_file_does_not_have(project, monkeypatch):
    own = define(project, "lines", "Mine")
    renamed = own.read_text().replace('name = "LN2"', 'name = "Mine"')
    monkeypatch.chdir(project)
    told = f"{own} is called 'Mine', as its file is, not 'LN2', its name: give both the same"
    assert doubts("lines", "Mine") == doubts("lines", str(own)) == [told]
    own.write_text(renamed)
    assert doubts("lines", "Mine") == doubts("lines", str(own)) == []
    monkeypatch.setenv("OPENPANTO_LIBRARY", os.pathsep.join([str(project), "nowhere"]))
    assert doubts("lines", "Mine") == ["OPENPANTO_LIBRARY names no folder with 'nowhere': correct it"]
    with pytest.raises(UnknownNameError, match="OPENPANTO_LIBRARY names no folder with 'nowhere'"):
        line_path("Other")
    monkeypatch.setenv("OPENPANTO_LIBRARY", str(project / "lines"))  # one folder too deep
    told = f"OPENPANTO_LIBRARY names '{project / 'lines'}', with no folder lines or pantographs in it: correct it"
    assert doubts("lines", "Mine") == [told]


def test_a_name_that_is_not_there_is_answered_by_the_known_ones(project):
    define(project, "lines", "Mine")
    with pytest.raises(UnknownNameError, match=r"no line 'mine'.*known: .*LN2.*Mine.*did you mean 'Mine'\?"):
        line_path("mine", search_path(project))


def test_a_project_given_for_a_line_is_answered_by_its_file(project, monkeypatch):
    define(project, "lines", "Mine")
    monkeypatch.chdir(project.parent)
    with pytest.raises(UnknownNameError, match=rf"is a project: name its file, {project.name}/lines/Mine\.toml"):
        line_path(project.name)


def test_a_line_given_for_a_pantograph_is_recognised():
    with pytest.raises(UnknownNameError, match=r"it is a line$"):
        pantograph_path("LN2")
    with pytest.raises(UnknownNameError, match=r"it is a pantograph$"):
        line_path("DSA380")


@pytest.mark.parametrize("name", ["../pantographs/CX", "", "LN2.toml.bak", "*"])
def test_a_name_is_no_path_and_no_pattern(name):
    with pytest.raises(UnknownNameError):
        line_path(name, ())
    assert definition_files("lines", name, [LIBRARY]) == []


def test_the_file_of_an_own_definition_is_read_by_its_name(project, monkeypatch):
    define(project, "lines", "Mine")
    monkeypatch.chdir(project)
    assert load_line("Mine").name == "LN2"  # what the copied file says
    assert definition_names("lines", [project]) == ("Mine",)
