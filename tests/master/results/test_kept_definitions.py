"""The definitions that a run was computed from: kept with it, and compared."""

import dataclasses
import zipfile
from types import SimpleNamespace

import pytest

from master.report.run_inputs import unequal_inputs
from master.results.kept_definitions import differing_definitions, write_definitions
from models.library.catalogue import line_path
from tests.master.report.conftest import made_up  # noqa: F401  fixture


@pytest.fixture
def run(made_up, tmp_path):  # noqa: F811
    """Return what makes the results of a run, with a line of this text (None: it kept none)."""

    def made(name, text):
        components = [{"name": "pantograph", "sha256": "same"}, {"name": "catenary", "sha256": name}]
        (tmp_path / name).mkdir()
        done = made_up(folder=tmp_path / name)
        if text is not None:
            with zipfile.ZipFile(tmp_path / f"{name}.fmu", "w") as file:
                file.writestr("resources/definition.toml", text)
            fmus = [tmp_path / "of_another_tool.fmu", tmp_path / f"{name}.fmu"]
            write_definitions(tmp_path / name, [SimpleNamespace(fmu=SimpleNamespace(path=path)) for path in fmus])
        return dataclasses.replace(done, summary={**done.summary, "components": components})

    return made


LN2 = line_path("LN2", ()).read_text(encoding="utf-8")


def test_the_keys_that_differ_are_named_with_both_values_and_their_unit(run):
    edited = LN2.replace('encumbrance = [1.4, "m"', 'encumbrance = [1.5, "m"').replace("45.0, 45.0,", "45.0, 40.0,", 1)
    assert differing_definitions([run("before", LN2), run("after", edited)]) == [
        ("catenary: profile.encumbrance", "1.4 m", "1.5 m"),
        ("catenary: spans.lengths[2]", "45.0 m", "40.0 m"),
    ]


@pytest.mark.parametrize("is_set", [False, True])
def test_a_value_of_the_definition_is_listed_once_unless_the_scenario_sets_another(run, is_set):
    runs = [run("before", LN2), run("after", LN2.replace('encumbrance = [1.4, "m"', 'encumbrance = [1.5, "m"'))]
    for done, value in zip(runs, (1.4, 1.6 if is_set else 1.5), strict=True):
        line = done.summary["components"][1]
        line["inputs"] = [{"name": "profile.encumbrance", "value": value, "unit": "m", "changed": value == 1.6}]
    rows = [row for row in unequal_inputs(runs) if "encumbrance" in row[0]]
    own = ("catenary: profile.encumbrance", "1.4 m", "1.5 m")
    assert rows == [own, *([("catenary.profile.encumbrance [m]", "1.4", "1.6")] if is_set else [])]


def test_other_sources_and_comments_are_no_other_line(run):
    edited = LN2.replace('"Table 5.2, catenary height"', '"a letter"') + "\n# looked at again\n"
    assert differing_definitions([run("before", LN2), run("after", edited)]) == []


def test_what_was_not_kept_is_told(run):
    runs = [run("before", None), run("after", LN2)]
    assert differing_definitions(runs) == [("catenary: definition", "not kept with the run", "kept")]


def test_a_component_that_a_run_does_not_have_is_not_one_whose_definition_it_has_not_kept(run):
    runs = [run("before", LN2), run("after", None)]
    del runs[1].summary["components"][1]
    assert differing_definitions(runs) == []
