"""A scenario is found by path, as the only one of a project folder, or by its name in the library."""

from __future__ import annotations

from pathlib import Path

import pytest

from master.errors import RequestError, ScenarioError
from master.scenario import scenario_place
from master.scenario.scenario_place import LIBRARY, fmu_cache, located, refuse_installed, scenario_names


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def scenario(folder):
    folder.mkdir(parents=True)
    (folder / "SystemStructure.ssd").write_text("<x/>")
    return folder


def test_a_name_of_the_library_is_found_from_anywhere():
    assert "cx_ln2" in scenario_names()
    assert located("cx_ln2") == LIBRARY / "cx_ln2.ssp"


def test_what_lies_in_the_working_folder_comes_first(tmp_path):
    scenario(tmp_path / "cx_ln2.ssp")
    assert located("cx_ln2") == Path("cx_ln2.ssp")
    assert located(tmp_path / "cx_ln2") == tmp_path / "cx_ln2.ssp"


def test_a_project_folder_is_its_only_scenario(tmp_path):
    wanted = scenario(tmp_path / "demo" / "demo.ssp")
    (tmp_path / "demo" / "lines").mkdir()
    assert located(tmp_path / "demo") == wanted
    scenario(tmp_path / "demo" / "other.ssp")
    with pytest.raises(ScenarioError, match=r"holds 2 scenarios; name one of them: .*demo\.ssp, .*other\.ssp"):
        located("demo")


def test_a_results_folder_of_the_same_name_hides_nothing(tmp_path):
    (tmp_path / "cx_ln2").mkdir()
    assert located("cx_ln2") == LIBRARY / "cx_ln2.ssp"


def test_a_mistyped_name_is_told_with_the_nearest():
    with pytest.raises(ScenarioError, match=r"no such folder or \.ssp archive, .*; did you mean 'cx_multibody_ln2'\?"):
        located("cx_multybody_ln2")


def test_fmus_of_a_checkout_are_built_in_their_place():
    assert fmu_cache(LIBRARY / "cx_ln2.ssp") is None
    refuse_installed(LIBRARY / "cx_ln2.ssp")


def test_an_installed_library_is_left_alone(tmp_path, monkeypatch):
    library = tmp_path / "site-packages" / "ssp_scenarios"
    own = scenario(library / "cx_ln2.ssp")
    monkeypatch.setattr(scenario_place, "LIBRARY", library)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = fmu_cache(own)
    assert folder.is_relative_to(tmp_path / "cache" / "openpanto" / "fmus")
    assert folder.name == "cx_ln2"
    assert fmu_cache(tmp_path / "demo.ssp") is None
    with pytest.raises(RequestError, match="belongs to the installed library"):
        refuse_installed(own)


def test_a_mistyped_project_is_answered_by_the_one_that_is_there(tmp_path, monkeypatch):
    (tmp_path / "demo" / "demo.ssp").mkdir(parents=True)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ScenarioError, match=r"did you mean 'demo'\?"):
        located("demoo")
