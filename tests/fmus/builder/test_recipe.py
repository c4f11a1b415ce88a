"""Names and files that FMUs are made of, the hash of their sources, and the mark that says whose an FMU is."""

from __future__ import annotations

import shutil
import zipfile

import pytest

from fmus.__main__ import main
from fmus.builder.fmu_build import build
from fmus.builder.recipe import MARK, BuildError, UnknownFmuError, content_hash, fingerprint, recipe
from master.fmu import fmu_provision
from models.library.catalogue import line_path, pantograph_path
from models.library.definition_copy import renamed
from tests.fmus.support import Instance, toy_recipe, toy_variant


@pytest.fixture
def own(tmp_path):
    """Definitions of a user: a line and two kinds of pantograph."""
    folder = tmp_path / "my definitions"
    folder.mkdir()
    shutil.copy(line_path("C270"), folder / "Mine.toml")
    shutil.copy(pantograph_path("CX"), folder / "Light.toml")
    shutil.copy(pantograph_path("CX_multibody"), folder / "Bodies.toml")
    return folder


def test_a_file_becomes_an_fmu_of_its_name(own, tmp_path, capsys):
    words = [str(own / f"{name}.toml") for name in ("Light", "Bodies")]
    assert main(["build", *words, "--out", str(tmp_path / "out")]) == 0
    built = [tmp_path / "out" / f"Pantograph_{name}.fmu" for name in ("Light", "Bodies")]
    assert capsys.readouterr().out.split() == [str(path) for path in built]
    instance = Instance(built[0])
    instance.initialise(**{"contact.force": 100.0})
    instance.step(0.0)
    assert instance["A.z"] < 5.02
    instance.free()


def test_a_line_gets_as_many_ports_as_wanted(own, tmp_path, capsys):
    assert main(["build", str(own / "Mine.toml"), "--pantographs", "2", "--out", str(tmp_path)]) == 0
    path = tmp_path / "Catenary_Mine_P2.fmu"
    assert capsys.readouterr().out.strip() == str(path)
    assert main(["fingerprint", "--pantographs", "2", str(own / "Mine.toml")]) == 0
    guid = capsys.readouterr().out.strip()
    mark = fmu_provision.read_mark(path)
    assert (mark["guid"], mark["definition"], mark["pantographs"]) == (guid, "my definitions/Mine.toml", "2")
    assert fmu_provision.why_not_ours(path) == ""


def test_the_guid_follows_the_file_and_not_its_place(own, tmp_path):
    path = own / "Light.toml"
    before = fingerprint(recipe(str(path)))
    (tmp_path / "other").mkdir()
    shutil.copy(path, tmp_path / "other")
    assert fingerprint(recipe(str(tmp_path / "other" / "Light.toml"))) == before
    path.write_text(path.read_text().replace("168", "170"), encoding="utf-8-sig")  # as Windows' editors write it
    assert recipe(str(path)).title == recipe(str(tmp_path / "other" / "Light.toml")).title
    assert fingerprint(recipe(str(path))) != before


def test_a_changed_file_makes_its_fmu_stale(own, tmp_path):
    path, said = build(recipe(str(own / "Light.toml")), tmp_path), []
    assert fmu_provision.provide_fmu(path, said.append) == path
    assert said == []
    (own / "Light.toml").write_text((own / "Light.toml").read_text().replace("168", "170"))
    fmu_provision.provide_fmu(path, said.append)
    assert said == ["building Pantograph_Light.fmu again: what it is made of has changed"]
    assert fmu_provision.stored_guid(path) == fingerprint(recipe(str(own / "Light.toml")))
    fmu_provision.provide_fmu(path, said.append)
    assert len(said) == 1


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("none.toml", None, "there is no such file; a definition of the library is called by its name"),
        ("broken.toml", "type = ", "is not TOML: "),
        ("other.toml", 'type = "boat"', "defines neither a line"),
        ("two words.toml", 'type = "lumped"', "may hold letters, digits and _ only"),
        ("b\u00fcgel.toml", 'type = "lumped"', "may hold letters, digits and _ only"),
        ("empty.toml", 'type = "lumped"', "Pantograph_empty cannot be built"),
    ],
)
def test_what_is_no_definition_is_refused_in_words(tmp_path, capsys, name, text, said):
    if text is not None:
        (tmp_path / name).write_text(text)
    assert main(["build", str(tmp_path / name), "--out", str(tmp_path / "out")]) == 1
    error = capsys.readouterr().err
    assert said in error
    assert "Traceback" not in error


def test_a_pantograph_has_no_ports(own):
    with pytest.raises(BuildError, match="only lines have pantograph ports"):
        recipe(str(own / "Light.toml"), 2)


def test_the_mark_holds_the_hash_of_all_other_files(tmp_path):
    with zipfile.ZipFile(build(recipe("Pantograph_CX"), tmp_path)) as file:
        files = {name: file.read(name) for name in file.namelist()}
    mark = dict(line.split("=", 1) for line in files[MARK].decode().splitlines())
    assert mark["content"] == content_hash(files)
    assert content_hash({**files, "resources/definition.toml": b""}) != mark["content"]
    assert "definition" not in mark  # of the library


def test_fingerprint_is_the_guid(instantiate):
    assert instantiate().description.guid == fingerprint(toy_recipe())


@pytest.mark.parametrize(
    ("old", "new", "file"),
    [
        ("GAIN = 1.0", "GAIN = 2.0", "law.py"),
        ("choice: round", "Table 2", "toy.toml"),
        ("not used", "of no use", "slave.py"),
    ],
)
def test_any_change_of_sources_changes_the_fingerprint(tmp_path, old, new, file):
    assert fingerprint(toy_recipe(toy_variant(tmp_path, old, new, file))) != fingerprint(toy_recipe())


def test_unknown_name_lists_the_known_ones(tmp_path, capsys):
    assert main(["build", "Catenary_LN2", "Catenary_Nowhere", "--out", str(tmp_path)]) == 1
    said = capsys.readouterr().err
    assert said.startswith("error: There is no FMU 'Catenary_Nowhere'; known are")
    assert "Catenary_LN2" in said
    assert not list(tmp_path.iterdir())


def test_list_names_every_definition(capsys):
    assert main(["list"]) == 0
    assert "Catenary_LN2" in capsys.readouterr().out.split()


@pytest.fixture
def project(tmp_path):
    """A project with a line and a pantograph of its own, the line named as one of the library."""
    folder = tmp_path / "demo"
    for kind, path, name in (("lines", line_path("C270"), "LN2"), ("pantographs", pantograph_path("CX"), "Mine")):
        (folder / kind).mkdir(parents=True)
        (folder / kind / f"{name}.toml").write_text(renamed(path.read_text(), name))
    (folder / "openpanto.toml").write_text("")
    (folder / "demo.ssp").mkdir()
    return folder


def test_a_name_is_looked_up_in_the_project_before_the_library(project):
    found = recipe("Catenary_LN2_P2", folders=[project])
    assert (found.name, found.definition) == ("Catenary_LN2_P2", project / "lines" / "LN2.toml")
    assert found.settings == {"pantographs": 2}
    assert found.is_own
    assert recipe("Pantograph_Mine", folders=[project]).definition == project / "pantographs" / "Mine.toml"
    assert not recipe("Catenary_LN2").is_own


def test_what_an_fmu_was_built_from_comes_before_the_library_and_after_the_project(project, own):
    (own / "LN2.toml").write_text((own / "Mine.toml").read_text())
    known = {"built_from": own / "LN2.toml"}
    assert recipe("Catenary_LN2", **known).definition == own / "LN2.toml"
    assert recipe("Catenary_LN2", folders=[project], **known).definition == project / "lines" / "LN2.toml"
    (own / "LN2.toml").unlink()
    with pytest.raises(BuildError, match="which Catenary_LN2 was built from, is missing"):
        recipe("Catenary_LN2", **known)


def test_a_pantograph_among_the_lines_is_refused(project):
    shutil.copy(pantograph_path("CX"), project / "lines" / "CX.toml")
    with pytest.raises(BuildError, match="is no definition for Catenary_CX: it defines what Pantograph_CX is made of"):
        recipe("Catenary_CX", folders=[project])


def test_the_fmu_of_an_own_definition_is_built_from_where_the_scenario_lies(project, capsys):
    scenario = project / "demo.ssp"
    said, path = [], scenario / "resources" / "Pantograph_Mine.fmu"
    fmu_provision.provide_fmu(path, said.append, library=scenario)
    assert said == ["building Pantograph_Mine.fmu"]
    file = project / "pantographs" / "Mine.toml"
    assert fmu_provision.definition_of(path) == str(file)
    file.write_text(file.read_text().replace("168", "170"))
    fmu_provision.provide_fmu(path, said.append, library=scenario)
    assert said[1:] == ["building Pantograph_Mine.fmu again: what it is made of has changed"]
    file.unlink()
    fmu_provision.provide_fmu(path, said.append, library=scenario)
    assert "which it was built from, is missing" in said[-1]


def test_two_definitions_of_one_name_are_reported(project, capsys):
    assert main(["fingerprint", "--library", str(project / "demo.ssp"), "Catenary_LN2"]) == 0
    first, second = project / "lines" / "LN2.toml", line_path("LN2", ())
    assert capsys.readouterr().err == f"note: two definitions are named 'LN2': {first} is used, {second} is not\n"


def test_an_fmu_of_the_library_says_so(tmp_path):
    path = build(recipe("Pantograph_CX"), tmp_path)
    assert fmu_provision.definition_of(path) == "library: pantographs/CX.toml"


def test_a_mistyped_name_is_answered_by_the_one_that_may_be_meant(capsys):
    assert main(["build", "Catenary_LN22"]) == 1
    assert "did you mean 'Catenary_LN2'?" in capsys.readouterr().err


@pytest.mark.parametrize(("name", "fmu"), [("CX", "Pantograph_CX"), ("LN2", "Catenary_LN2")])
def test_the_name_of_a_definition_leads_to_that_of_its_fmu(name, fmu):
    with pytest.raises(UnknownFmuError) as error:
        recipe(name)
    assert str(error.value) == f"There is no FMU '{name}'; that of the definition '{name}' is {fmu}."
