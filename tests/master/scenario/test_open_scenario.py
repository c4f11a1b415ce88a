"""Opening a scenario: what is said of a component that has no FMU."""

from pathlib import Path

import pytest

from master.scenario import open_scenario
from master.scenario.open_scenario import _provide, _Provision, _unprovided


@pytest.mark.parametrize(
    ("file", "said"),
    [
        ("Catenary_mine_LN2_P3.fmu", "does not exist, nor does a definition to build it from, lines/mine_LN2.toml in"),
        ("Pantograph_mine.fmu", "does not exist, nor does a definition to build it from, pantographs/mine.toml in"),
        ("Theirs.fmu", "does not exist"),
    ],
)
def test_an_fmu_that_is_not_there_is_told_with_the_definition_that_it_lacks(tmp_path, monkeypatch, file, said):
    monkeypatch.setattr(open_scenario.fmu_provision, "provide_fmu", lambda path, *_: path)  # knows no such name
    found = _provide(tmp_path / file, _Provision(True, print, None, tmp_path))
    assert str(found).startswith(said)
    assert str(found).count("definition") == said.count("definition")
    assert _provide(tmp_path / file, _Provision(False, print, None, tmp_path)) == "does not exist"


def test_every_mistake_of_a_definition_is_a_problem_with_its_place():
    file = Path("lines", "x.toml")
    why = f"could not be built: {file}: a: is missing\n{file}: b: is odd (at line 7, column 1)\n... and 3 more problems"
    problems = _unprovided("catenary", "resources/x.fmu", 9, why)
    assert [(p.file, p.line) for p in problems] == [(str(file), 0), (str(file), 7), (str(file), 0)]
    assert [p.text.partition("; so ")[0] for p in problems] == [
        "a: is missing", "b: is odd (at line 7, column 1)", "... and 3 more problems"
    ]  # fmt: skip
    assert [p.text.endswith("'catenary' (SystemStructure.ssd:9) cannot be built") for p in problems] == [0, 0, 1]
    (other,) = _unprovided("catenary", "resources/x.fmu", 9, "could not be built: no room\nat all")
    assert other.text == "component 'catenary': resources/x.fmu could not be built: no room; at all"
