"""The FMUs of the library: valid, complete, restorable."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import fmpy
import lark
import pytest
from fmpy.validation import validate_fmu

from fmus.builder.fmu_build import build
from fmus.builder.recipe import fingerprint, known_names, recipe
from tests.effort import some
from tests.fmus.support import Instance, names_of, run

READY = [name for name in known_names() if "Catenary" not in name or find_spec("models.catenary.line_part")]
#: Those that are tried in every run of the suite: one of every kind of line and of pantograph.
STARTED = (
    "Catenary_AC_mixed",
    "Catenary_LN2_ring",
    "Catenary_Re330",
    "Catenary_Shinkansen",
    "Pantograph_CX",
    "Pantograph_generic_multibody_cam",
)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Function that returns an FMU of the library, built once."""
    folder = tmp_path_factory.mktemp("fmus")
    return cache(lambda name: build(recipe(name), folder))


@pytest.fixture(scope="module", params=some(READY, *STARTED))
def fmu(request: pytest.FixtureRequest, built: Callable[[str], Path]) -> Path:
    return built(request.param)


@dataclass(frozen=True)
class Begun:
    """An FMU that has been initialised, its computed values before and after that, and what it said of it."""

    fmu: Path
    instance: Instance
    before: list[float]
    after: list[float]
    said: list[tuple[int, str]]


@pytest.fixture(scope="module", params=some(READY, *(name for name in STARTED if name != "Catenary_Re330")))
def begun(request: pytest.FixtureRequest, built: Callable[[str], Path]) -> Iterator[Begun]:
    fmu = built(request.param)
    instance = Instance(fmu)
    computed = names_of(instance, "output", "local", "calculatedParameter")
    instance.slave.setupExperiment(startTime=0.0)
    instance.slave.enterInitializationMode()
    before = instance.get(computed)
    instance.slave.exitInitializationMode()
    yield Begun(fmu, instance, before, instance.get(computed), [*instance.messages])
    instance.free()


@pytest.fixture(scope="module")
def names_by_pattern() -> Iterator[None]:
    """Let FMPy parse one of all names that differ in digits alone: a thousand take it ten seconds."""
    parse, good = lark.Lark.parse, {}

    def parsed(self: lark.Lark, name: str) -> lark.ParseTree:
        pattern = re.sub(r"\d+", "1", name)
        if (self.source_grammar, pattern) not in good:
            good[self.source_grammar, pattern] = parse(self, pattern)
        return good[self.source_grammar, pattern]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lark.Lark, "parse", parsed)
        yield


@pytest.mark.usefixtures("names_by_pattern")
def test_fmpy_finds_no_problems(fmu):
    assert validate_fmu(str(fmu)) == []


def test_a_name_outside_the_grammar_is_found(names_by_pattern, tmp_path):
    fmu = build(recipe("Pantograph_CX"), tmp_path)
    bad = tmp_path / "bad.fmu"
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(bad, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            new.writestr(
                name, data.replace(b'"contact.force"', b'"contact[].force"') if name.endswith(".xml") else data
            )
    assert any("contact[].force" in problem for problem in validate_fmu(str(bad)))


def test_every_real_has_a_unit_and_every_variable_a_description(fmu):
    description = fmpy.read_model_description(str(fmu))
    for variable in description.modelVariables:
        assert variable.description
        assert variable.unit or variable.type != "Real"


def test_identity_is_the_content(fmu):
    assert fmpy.read_model_description(str(fmu)).guid == fingerprint(recipe(fmu.stem))


def test_saved_state_continues_bit_for_bit_here_and_elsewhere(begun):
    instance = begun.instance
    observed = names_of(instance, "output", "local")
    run(instance, range(20), observed)
    data = instance.slave.serializeFMUstate(instance.slave.getFMUstate())
    first = run(instance, range(20, 50), observed)
    other = Instance(begun.fmu)
    other.slave.setFMUstate(other.slave.deSerializeFMUstate(data))
    assert run(other, range(20, 50), observed) == first
    instance.slave.setFMUstate(instance.slave.deSerializeFMUstate(data))
    assert run(instance, range(20, 50), observed) == first
    assert first[0] != first[-1]
    other.free()


def test_outputs_at_the_end_of_initialization_are_those_before(begun):
    assert begun.after == begun.before
    assert not [text for status, text in begun.said if status != 0]


def test_a_mechanism_says_in_which_form_it_moves(begun):
    form = "reduced form of the equations of motion, in coordinates of the arm"
    assert [text.startswith(form) for _, text in begun.said] == ([True] if "multibody" in begun.fmu.name else [])
